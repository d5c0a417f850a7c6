#include "environment.h"

#include "environment_simd.h"
#include "renderer/math/mat4.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const double PI = M_PI;

static struct environment *new_environment(enum environment_kind kind, struct err *e)
{
    struct environment *env = calloc(1, sizeof *env);
    if (env == NULL)
        err_set(e, "out of memory for the environment");
    else
        env->kind = kind;
    return env;
}

struct environment *environment_constant(rgb radiance, struct err *e)
{
    struct environment *env = new_environment(ENVIRONMENT_CONSTANT, e);
    if (env != NULL) {
        env->radiance = radiance;
        env->total = 4 * PI * rgb_luminance(radiance);
    }
    return env;
}

struct environment *environment_upper_half(rgb radiance, struct err *e)
{
    struct environment *env = new_environment(ENVIRONMENT_UPPER_HALF, e);
    if (env != NULL) {
        env->radiance = radiance;
        env->total = 2 * PI * rgb_luminance(radiance);
    }
    return env;
}

void environment_free(struct environment *env)
{
    if (env == NULL)
        return;
    free(env->texel);
    free(env->begin);
    free(env->growth);
    free(env->region_row);
    free(env->region_column);
    free(env->region_end);
    free(env->row_end);
    free(env->row_pdf_w);
    free(env->column_end);
    free(env);
}

static bool copy_texels(struct environment *env, const struct image *im, const char *where,
                        struct err *e)
{
    static const char *const NAMES[3] = {"R", "G", "B"};
    int channel[3];
    bool black = true;
    for (int k = 0; k < 3; k++) {
        channel[k] = image_channel(im, NAMES[k]);
        if (channel[k] < 0)
            return err_set(e, "%s: no channel %s: not an environment map", where, NAMES[k]);
    }
    for (size_t i = 0; i < (size_t)env->width * env->height; i++) {
        float v[3];
        for (int k = 0; k < 3; k++) {
            v[k] = im->data[i * (size_t)im->channels + (size_t)channel[k]];
            if (!(v[k] >= 0) || !isfinite(v[k]))
                return err_set(e, "%s: pixel (%zu, %zu) from the top left: channel %s is %g", where,
                               i % env->width, i / env->width, NAMES[k], (double)v[k]);
        }
        env->texel[i] = (rgb){v[0], v[1], v[2]};
        black = black && rgb_is_zero(env->texel[i]);
    }
    return !black || err_set(e, "%s: the environment map is black everywhere", where);
}

/* sin^2(theta/2) at the upper edge of row r of cells. */
static double bound(const struct environment *env, uint32_t r)
{
    double s = sin((r - 0.5) * PI / (2.0 * env->height));
    return r == 0 ? 0 : r > env->height ? 1 : s * s;
}

/* Unit direction of a place: integral r is the upper edge of row r, integral c the left edge of column c. */
static dvec3 direction(const struct environment *env, double r, double c)
{
    double theta = fmin(fmax(r - 0.5, 0), env->height) * PI / env->height,
           phi = 2 * PI * (c - 0.5) / env->width;
    return d3(-sin(theta) * cos(phi), cos(theta), sin(theta) * sin(phi));
}

/* A region: its luminance integrated over solid angle, the unit direction in the middle of its light, and the largest
 * angle (radians) between that and any of its directions. */
struct region {
    double weight, angle;
    dvec3 middle;
};

/* About the cosine factor of the light from a region. x: cosine between the rounded normal and the
 * middle of the region; angle: the region's extent plus the rounding of the normal. Where part of
 * the region may be below the horizon, the mean of max(0, c) over c in [x - sin(angle), x +
 * sin(angle)]; from 90 degrees on, a linear ramp. Positive wherever light may arrive. */
static double part_received(double x, double angle)
{
    const double s = sin(angle);
    if (angle >= PI / 2)
        return (1.1 + x) / 2.1;
    return x >= s ? x : x > -s ? (x + s) * (x + s) / (4 * s) : 0;
}

/* Fills end[], the table for choosing a region under the rounded normal n. */
static void build_regions(const struct environment *env, dvec3 n, const struct region *region,
                          uint32_t *end)
{
    const double spread = asin(0.5 * sqrt(3) / NORMAL_STEPS);
    double weight[REGION_COLUMNS], rows[REGION_ROWS];
    n = d3_scale(n, 1 / d3_length(n));
    for (uint32_t i = 0; i < env->num_rows; i++) {
        for (uint32_t j = 0; j < env->num_columns; j++) {
            const struct region *r = &region[i * env->num_columns + j];
            weight[j] = r->weight * part_received(d3_dot(n, r->middle), r->angle + spread);
        }
        rows[i] =
            discrete_build(weight, env->num_columns, end + env->num_rows + i * env->num_columns);
    }
    discrete_build(rows, env->num_rows, end);
}

/* Sets middle and angle of region (i, j). towards: the sum over its rows of luminance times direction.
 * In a region no wider than a quarter turn the corners are the furthest points. */
static void bound_region(const struct environment *env, uint32_t i, uint32_t j, dvec3 towards,
                         struct region *region)
{
    const double length = d3_length(towards);
    region->angle = PI;
    region->middle = d3(0, 1, 0);
    if (!(length > 0) || env->num_columns < 4)
        return;
    region->middle = d3_scale(towards, 1 / length);
    double least = 1;
    for (uint32_t k = 0; k < 4; k++)
        least = fmin(least, d3_dot(region->middle, direction(env, env->row_first[i + k / 2],
                                                             env->column_first[j + k % 2])));
    region->angle = acos(fmax(-1, least));
}

/* Builds the tables by which cells are chosen. weight: scratch for a row and a column of cells. */
static void build_tables(struct environment *env, double *weight, struct region *region)
{
    const uint32_t rows = env->height + 1, width = env->width;
    for (uint32_t r = 0; r < rows; r++) {
        /* In the lower half theta is taken from the bottom, so the tables are mirrored. */
        const bool lower = r > env->height / 2;
        env->begin[r] = (float)(lower ? bound(env, rows - r) : bound(env, r));
        env->growth[r] = (float)(bound(env, r + 1) - bound(env, r)) * (lower ? -1.0f : 1.0f);
        env->region_row[r] = (uint8_t)((uint64_t)r * env->num_rows / rows);
        env->row_first[env->region_row[r] + 1] = r + 1;
    }
    for (uint32_t c = 0; c < width; c++) {
        env->region_column[c] = (uint8_t)((uint64_t)c * env->num_columns / width);
        env->column_first[env->region_column[c] + 1] = c + 1;
    }
    for (uint32_t j = 0; j < env->num_columns; j++) {
        const uint32_t c0 = env->column_first[j], c1 = env->column_first[j + 1];
        for (uint32_t i = 0; i < env->num_rows; i++) {
            const uint32_t r0 = env->row_first[i], r1 = env->row_first[i + 1];
            struct region *to = &region[i * env->num_columns + j];
            dvec3 towards = d3(0, 0, 0);
            for (uint32_t r = r0; r < r1; r++) {
                const rgb *above = env->texel + (size_t)width * (r > 0 ? r - 1 : 0);
                const rgb *below = env->texel + (size_t)width * (r < env->height ? r : r - 1);
                const double cell = 4 * PI * (double)fabsf(env->growth[r]) / width;
                for (uint32_t c = c0; c < c1; c++) {
                    const uint32_t left = c > 0 ? c - 1 : width - 1;
                    weight[c - c0] = 0.25 * cell *
                                     (rgb_luminance(above[left]) + rgb_luminance(above[c]) +
                                      rgb_luminance(below[left]) + rgb_luminance(below[c]));
                }
                weight[width + r - r0] =
                    discrete_build(weight, c1 - c0, env->column_end + (size_t)r * width + c0);
                towards = d3_sub(towards, d3_scale(direction(env, r + 0.5, 0.5 * (c0 + c1)),
                                                   -weight[width + r - r0]));
            }
            uint32_t *end = env->row_end + (size_t)j * rows + r0;
            to->weight = discrete_build(weight + width, r1 - r0, end);
            for (uint32_t r = r0; r < r1; r++)
                env->row_pdf_w[(size_t)j * rows + r] =
                    (float)((double)discrete_probability(end, r - r0) * width /
                            (4 * PI * (double)fabsf(env->growth[r])));
            bound_region(env, i, j, towards, to);
            env->total += to->weight;
        }
    }
    for (int k = 0; k < NORMAL_SIDE * NORMAL_SIDE * NORMAL_SIDE; k++) {
        const dvec3 n =
            d3(k / (NORMAL_SIDE * NORMAL_SIDE) - NORMAL_STEPS,
               k / NORMAL_SIDE % NORMAL_SIDE - NORMAL_STEPS, k % NORMAL_SIDE - NORMAL_STEPS);
        /* Only the grid points that unit vectors can round to. */
        if (fabs(d3_length(n) - NORMAL_STEPS) < 0.5 * sqrt(3))
            build_regions(env, n, region,
                          env->region_end + (size_t)k * env->num_rows * (1 + env->num_columns));
    }
}

struct environment *environment_from_image(const struct image *im, const char *where, struct err *e)
{
    struct environment *env = new_environment(ENVIRONMENT_IMAGE, e);
    double *weight = NULL;
    struct region *region = NULL;
    bool ok = false;
    if (env == NULL)
        return NULL;
    if (im->width >= DISCRETE_MOST || im->height >= DISCRETE_MOST ||
        (int64_t)im->width * im->height > INT32_MAX / 2) {
        err_set(e, "%s: %d x %d is too large for an environment map", where, im->width, im->height);
        goto done;
    }
    env->width = (uint32_t)im->width;
    env->height = (uint32_t)im->height;
    const size_t rows = (size_t)env->height + 1, columns = env->width;
    env->num_rows = rows < REGION_ROWS ? (uint32_t)rows : REGION_ROWS;
    env->num_columns = columns < REGION_COLUMNS ? (uint32_t)columns : REGION_COLUMNS;
    env->texel =
        calloc(columns * env->height + 2, sizeof *env->texel); /* gather_columns() reads 2 beyond */
    env->begin = calloc(rows, sizeof *env->begin);
    env->growth = calloc(rows, sizeof *env->growth);
    env->region_row = calloc(rows, 1);
    env->region_column = calloc(columns, 1);
    env->region_end = calloc((size_t)(NORMAL_SIDE * NORMAL_SIDE * NORMAL_SIDE) * env->num_rows,
                             (1 + env->num_columns) * sizeof *env->region_end);
    env->row_end = calloc(rows * env->num_columns, sizeof *env->row_end);
    env->row_pdf_w = calloc(rows * env->num_columns, sizeof *env->row_pdf_w);
    env->column_end = calloc(rows * columns, sizeof *env->column_end);
    weight = calloc(rows + columns, sizeof *weight);
    region = calloc((size_t)env->num_rows * env->num_columns, sizeof *region);
    if (env->texel == NULL || env->begin == NULL || env->growth == NULL ||
        env->region_row == NULL || env->region_column == NULL || env->region_end == NULL ||
        env->row_end == NULL || env->row_pdf_w == NULL || env->column_end == NULL ||
        weight == NULL || region == NULL) {
        err_set(e, "%s: out of memory", where);
        goto done;
    }
    ok = copy_texels(env, im, where, e);
    if (ok)
        build_tables(env, weight, region);
done:
    free(weight);
    free(region);
    if (!ok) {
        environment_free(env);
        env = NULL;
    }
    return env;
}

struct environment *environment_read(const char *path, struct err *e)
{
    const char *dot = strrchr(path, '.');
    struct image im = {0};
    if (dot == NULL || (strcasecmp(dot, ".exr") != 0 && strcasecmp(dot, ".hdr") != 0)) {
        err_set(e, "%s: an environment map must be an .exr or .hdr file", path);
        return NULL;
    }
    bool image_is_exr = strcasecmp(dot, ".exr") == 0;
    if (!(image_is_exr ? image_read_exr(path, &im, NULL, e) : image_read_hdr(path, &im, e)))
        return NULL;
    struct environment *env = environment_from_image(&im, path, e);
    image_free(&im);
    return env;
}

rgb environment_radiance(const struct environment *env, vec3 w)
{
    return look_up_environment(env, NULL, w, 1, NULL);
}

bool environment_is_hidden(const struct environment *env)
{
    return env->kind == ENVIRONMENT_UPPER_HALF;
}

struct environment_parts environment_parts(const struct environment *env)
{
    return (struct environment_parts){.kind = env->kind,
                                      .radiance = env->radiance,
                                      .width = env->width,
                                      .height = env->height,
                                      .texel = env->texel};
}

double environment_total(const struct environment *env)
{
    return env->total;
}
