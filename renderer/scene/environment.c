#include "environment.h"

#include "renderer/math/discrete.h"
#include "renderer/math/warp.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const double PI = 3.14159265358979323846;

struct environment {
    enum environment_kind kind;
    rgb radiance; /* not image */
    double total;
    /* Image. Cells are `width` columns, of which column c lies between the centres of texels c-1
     * and c, and height+1 rows, of which the first and the last are half as high. */
    uint32_t width, height;
    rgb *texel;
    double *bound;     /* height+2: sin^2(theta/2) between rows of cells, which is proportional to
                             the solid angle from the top and exact near both poles */
    uint32_t *row_end; /* of the choice of a row */
    uint32_t *column_end; /* width of them per row */
    float *row_pdf_w;     /* probability of the row over the solid angle of one of its cells */
};

/* A direction's cell, and where in it: 0 at the centres of texel c-1 and row r-1, 1 at c and r. */
struct place {
    uint32_t row, column;
    float down, right;
};

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
    free(env->bound);
    free(env->row_end);
    free(env->column_end);
    free(env->row_pdf_w);
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

static const rgb *texel_row(const struct environment *env, uint32_t row)
{
    return env->texel + (size_t)env->width * (row < env->height ? row : env->height - 1);
}

/* The rows of texels above and below a row of cells. */
static void texel_rows(const struct environment *env, uint32_t row, const rgb **above,
                       const rgb **below)
{
    *above = texel_row(env, row > 0 ? row - 1 : 0);
    *below = texel_row(env, row);
}

static uint32_t left_of(const struct environment *env, uint32_t column)
{
    return column > 0 ? column - 1 : env->width - 1;
}

/* The tables of choice. weight has room for a row, row_weight for one number per row. */
static void build_tables(struct environment *env, double *weight, double *row_weight)
{
    uint32_t rows = env->height + 1;
    for (uint32_t r = 1; r < rows; r++) {
        double s = sin((r - 0.5) * PI / (2.0 * env->height));
        env->bound[r] = s * s;
    }
    env->bound[0] = 0;
    env->bound[rows] = 1;
    for (uint32_t r = 0; r < rows; r++) {
        const rgb *above, *below;
        texel_rows(env, r, &above, &below);
        double cell = 4 * PI * (env->bound[r + 1] - env->bound[r]) / env->width;
        for (uint32_t c = 0; c < env->width; c++) {
            uint32_t left = left_of(env, c);
            weight[c] = 0.25 * cell *
                        (rgb_luminance(above[left]) + rgb_luminance(above[c]) +
                         rgb_luminance(below[left]) + rgb_luminance(below[c]));
        }
        row_weight[r] =
            discrete_build(weight, env->width, env->column_end + (size_t)r * env->width);
    }
    env->total = discrete_build(row_weight, rows, env->row_end);
    for (uint32_t r = 0; r < rows; r++) {
        double cell = 4 * PI * (env->bound[r + 1] - env->bound[r]) / env->width;
        env->row_pdf_w[r] = (float)((double)discrete_probability(env->row_end, r) / cell);
    }
}

struct environment *environment_from_image(const struct image *im, const char *where, struct err *e)
{
    struct environment *env = new_environment(ENVIRONMENT_IMAGE, e);
    double *weight = NULL, *row_weight = NULL;
    bool ok = false;
    if (env == NULL)
        return NULL;
    if (im->width >= DISCRETE_MOST || im->height >= DISCRETE_MOST) {
        err_set(e, "%s: %d x %d is too large for an environment map", where, im->width, im->height);
        goto done;
    }
    env->width = (uint32_t)im->width;
    env->height = (uint32_t)im->height;
    size_t rows = (size_t)env->height + 1;
    env->texel = calloc((size_t)env->width * env->height, sizeof *env->texel);
    env->bound = calloc(rows + 1, sizeof *env->bound);
    env->row_end = calloc(rows, sizeof *env->row_end);
    env->column_end = calloc(rows * env->width, sizeof *env->column_end);
    env->row_pdf_w = calloc(rows, sizeof *env->row_pdf_w);
    weight = calloc(env->width, sizeof *weight);
    row_weight = calloc(rows, sizeof *row_weight);
    if (env->texel == NULL || env->bound == NULL || env->row_end == NULL ||
        env->column_end == NULL || env->row_pdf_w == NULL || weight == NULL || row_weight == NULL) {
        err_set(e, "%s: out of memory", where);
        goto done;
    }
    ok = copy_texels(env, im, where, e);
    if (ok)
        build_tables(env, weight, row_weight);
done:
    free(weight);
    free(row_weight);
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

/* atan2 of lengths is exact near the poles, where acos(y) is not. */
static struct place find_place(const struct environment *env, vec3 w)
{
    double wx = w.x, wz = w.z;
    double theta = atan2(sqrt(wx * wx + wz * wz), w.y), phi = atan2(-wz, wx) + PI;
    double x = phi / (2 * PI) * env->width + 0.5, y = theta / PI * env->height + 0.5;
    uint32_t column = (uint32_t)x, row = (uint32_t)y;
    if (row > env->height)
        row = env->height;
    return (struct place){.row = row,
                          .column = column % env->width,
                          .down = (float)(y - row),
                          .right = (float)(x - column)};
}

static rgb mix(rgb a, rgb b, float t)
{
    return rgb_add(rgb_scale(a, 1 - t), rgb_scale(b, t));
}

static rgb interpolate(const struct environment *env, const struct place *p)
{
    const rgb *above, *below;
    uint32_t left = left_of(env, p->column);
    texel_rows(env, p->row, &above, &below);
    return mix(mix(above[left], above[p->column], p->right),
               mix(below[left], below[p->column], p->right), p->down);
}

static float cell_pdf_w(const struct environment *env, uint32_t row, uint32_t column)
{
    return env->row_pdf_w[row] *
           discrete_probability(env->column_end + (size_t)row * env->width, column);
}

rgb environment_radiance(const struct environment *env, vec3 w)
{
    switch (env->kind) {
    case ENVIRONMENT_CONSTANT: return env->radiance;
    case ENVIRONMENT_UPPER_HALF: return w.y > 0 ? env->radiance : grey(0);
    case ENVIRONMENT_IMAGE: {
        struct place p = find_place(env, w);
        return interpolate(env, &p);
    }
    }
    return grey(0);
}

static struct environment_sample sample_image(const struct environment *env, const float u[4])
{
    struct place p = {.right = u[1]};
    p.row = discrete_pick(env->row_end, env->height + 1, u[2]);
    p.column = discrete_pick(env->column_end + (size_t)p.row * env->width, env->width, u[3]);
    double top = env->bound[p.row], s = top + (double)u[0] * (env->bound[p.row + 1] - top);
    double sin_theta = 2 * sqrt(s * (1 - s));
    double phi = 2 * PI * ((double)p.column - 0.5 + (double)u[1]) / env->width;
    p.down = (float)(2 * asin(sqrt(s)) / PI * env->height + 0.5 - p.row);
    return (struct environment_sample){
        .wi = v3((float)(-sin_theta * cos(phi)), (float)(1 - 2 * s), (float)(sin_theta * sin(phi))),
        .radiance = interpolate(env, &p),
        .pdf_w = cell_pdf_w(env, p.row, p.column)};
}

struct environment_sample environment_sample_direction(const struct environment *env,
                                                       const float u[4])
{
    struct environment_sample s = {.radiance = env->radiance};
    switch (env->kind) {
    case ENVIRONMENT_CONSTANT:
        s.wi = warp_uniform_sphere(u[0], u[1]);
        s.pdf_w = 0.25f * INV_PI_F;
        break;
    case ENVIRONMENT_UPPER_HALF: {
        vec3 local = warp_uniform_hemisphere(u[0], u[1]);
        s.wi = v3(local.x, local.z, -local.y);
        s.pdf_w = warp_uniform_hemisphere_pdf_w(local);
        break;
    }
    case ENVIRONMENT_IMAGE: return sample_image(env, u);
    }
    return s;
}

float environment_pdf_w(const struct environment *env, vec3 w)
{
    switch (env->kind) {
    case ENVIRONMENT_CONSTANT: return 0.25f * INV_PI_F;
    case ENVIRONMENT_UPPER_HALF: return w.y > 0 ? 0.5f * INV_PI_F : 0;
    case ENVIRONMENT_IMAGE: {
        struct place p = find_place(env, w);
        return cell_pdf_w(env, p.row, p.column);
    }
    }
    return 0;
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
