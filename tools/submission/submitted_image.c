#include "submitted_image.h"

#include "rubric.h"
#include "renderer/base/sha256.h"
#include "tools/images/image_file.h"
#include "tools/images/luminance.h"
#include "tools/images/tone_curve.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double clip_sd = 5; /* standard errors around the clipping point where nothing is compared */

static bool check_header(const char *path, int width, int height, struct image_info *info,
                         struct err *e)
{
    struct err why;
    if (!image_inspect(path, info, &why)) {
        const char *what = strstr(why.msg, ": "); /* without our path */
        return err_set(e, "the image: %.300s", what != NULL ? what + 2 : "cannot be read");
    }
    if (info->width != width || info->height != height)
        return err_set(e, "the image is %d x %d pixels, not %d x %d", info->width, info->height,
                       width, height);
    return info->channels <= 64 || err_set(e, "the image has %d channels", info->channels);
}

/* All planes as one block, the means first. */
static bool allocate(struct submitted_image *s, struct err *e)
{
    size_t n = 3 * (size_t)s->width * (size_t)s->height, all = 5 * n + n / 3 * 4;
    s->mean = calloc(1, all * sizeof *s->mean + n);
    if (s->mean == NULL)
        return err_set(e, "out of memory for %d x %d pixels", s->width, s->height);
    s->tolerance = s->mean + n;
    s->rounding = s->tolerance + n;
    s->variance = s->rounding + n;
    s->k3 = s->variance + n;
    s->measured = s->k3 + n;
    s->clipped = (unsigned char *)(s->mean + all);
    return true;
}

static void set_code(struct submitted_image *s, size_t i, const struct curve *curve, int k,
                     int steps)
{
    double lo, hi;
    tone_curve_bin(curve, k, steps, &lo, &hi);
    s->clipped[i] = k == steps;
    s->mean[i] = k == steps ? s->clip : (lo + hi) / 2;
    s->tolerance[i] = k == steps ? 0 : (hi - lo) / 2;
    s->rounding[i] = k == steps ? 0 : (hi - lo) * (hi - lo) / 12;
}

/* Width of the bin of a float: half floats are rounded, RGBE may be truncated; 0: exact. */
static double float_step(const struct image_file *pic, float v, const float *px)
{
    if (pic->info.type == IMAGE_HALF)
        return fmax(ldexp(fabs((double)v), -10), 0x1p-24);
    double brightest = fmaxf(px[0], fmaxf(px[1], px[2]));
    int exponent;
    frexp(brightest, &exponent);
    return strcmp(pic->info.format, "hdr") == 0 && brightest > 0 ? 2 * ldexp(1, exponent - 8) : 0;
}

static bool fill(struct submitted_image *s, const struct image_file *pic, const struct curve *curve,
                 struct err *e)
{
    size_t n = 3 * (size_t)s->width * (size_t)s->height;
    int steps = pic->info.type == IMAGE_INT8 ? 255 : pic->info.type == IMAGE_INT16 ? 65535 : 0;
    double lo, hi;
    s->clip = INFINITY;
    if (steps > 0) {
        tone_curve_bin(curve, steps, steps, &lo, &hi);
        s->clip = lo;
    }
    for (size_t i = 0; i < n; i++) {
        float v = pic->rgb[i];
        if (!(v >= 0))
            return err_set(e, "the image has negative numbers");
        if (steps > 0) {
            set_code(s, i, curve, (int)lround((double)v * steps), steps);
            continue;
        }
        double step = float_step(pic, v, pic->rgb + i / 3 * 3);
        s->mean[i] = (double)v;
        s->tolerance[i] = step / 2;
        s->rounding[i] = step * step / 12;
    }
    return true;
}

bool submitted_image_read(const char *path, const char *curve, int width, int height,
                          struct submitted_image *out, struct err *e)
{
    struct image_file pic;
    struct image_info info;
    struct curve c;
    *out = (struct submitted_image){.width = width, .height = height};
    if (!check_header(path, width, height, &info, e) || !tone_curve_parse(curve, &c, e) ||
        !image_file_read_inspected(path, &info, &pic, e))
        return false;
    bool ok = allocate(out, e) && fill(out, &pic, &c, e) && sha256_file(path, out->sha256, e);
    image_file_free(&pic);
    if (!ok)
        submitted_image_free(out);
    return ok;
}

void submitted_image_free(struct submitted_image *s)
{
    free(s->mean);
    for (int k = 0; k < s->num_runs; k++)
        submitted_image_free(&s->run[k]);
    free(s->run);
    *s = (struct submitted_image){0};
}

/* Frees runs below a third of the largest. */
static void drop_small(struct submitted_image *s)
{
    static const double least = 1.0 / 3;
    double most = 0;
    int num = 0;
    for (int k = 0; k < s->num_runs; k++)
        most = fmax(most, s->run[k].spp);
    s->spp = 0;
    for (int k = 0; k < s->num_runs; k++) {
        if (s->run[k].spp < least * most) {
            submitted_image_free(&s->run[k]);
            continue;
        }
        s->spp += s->run[k].spp;
        s->run[num++] = s->run[k];
    }
    s->num_runs = num;
}

/* at[]: the pixels of the 3 x 3 around p, itself included, that lie in the image; returns their
 * number. */
static int neighbours(const struct submitted_image *s, size_t p, size_t at[9])
{
    int num = 0, x = (int)(p % (size_t)s->width), y = (int)(p / (size_t)s->width);
    for (int k = 0; k < 9; k++) {
        int u = x - 1 + k % 3, v = y - 1 + k / 3;
        if (u >= 0 && v >= 0 && u < s->width && v < s->height)
            at[num++] = (size_t)v * (size_t)s->width + (size_t)u;
    }
    return num;
}

/* From the scatter of the runs around their weighted mean: sum of w (x - mean)^2 over (runs - 1). */
static void measure_runs(struct submitted_image *s)
{
    size_t pixels = (size_t)s->width * (size_t)s->height;
    s->runs_dof = s->num_runs - 1;
    memset(s->measured, 0, 4 * pixels * sizeof *s->measured);
    for (int k = 0; k < s->num_runs && s->num_runs > 1; k++)
        for (size_t p = 0; p < pixels; p++) {
            const double *x = s->run[k].mean + 3 * p, *mean = s->mean + 3 * p;
            double w = s->run[k].spp / s->spp / s->runs_dof;
            for (size_t c = 0; c < 3; c++)
                s->measured[4 * p + c] += w * pow(x[c] - mean[c], 2);
            s->measured[4 * p + 3] += w * pow(luminance(x) - luminance(mean), 2);
        }
}

static void average_runs(struct submitted_image *s)
{
    size_t n = 3 * (size_t)s->width * (size_t)s->height;
    memset(s->clipped, 0, n);
    for (size_t i = 0; i < n; i++) {
        s->mean[i] = s->tolerance[i] = s->rounding[i] = 0;
        for (int k = 0; k < s->num_runs; k++) {
            const struct submitted_image *run = &s->run[k];
            double w = run->spp / s->spp;
            s->mean[i] += w * run->mean[i];
            s->tolerance[i] += w * run->tolerance[i];
            s->rounding[i] += w * w * run->rounding[i];
            s->clipped[i] |= run->clipped[i];
        }
    }
    measure_runs(s);
}

bool submitted_image_add_run(struct submitted_image *s, struct submitted_image *more, struct err *e)
{
    struct submitted_image *run = realloc(s->run, ((size_t)s->num_runs + 2) * sizeof *run);
    if (run == NULL)
        return err_set(e, "out of memory");
    s->run = run;
    if (s->num_runs == 0) { /* what it is becomes the first of its runs */
        struct submitted_image mean = *s;
        if (!allocate(&mean, e))
            return false;
        s->run = NULL;
        run[0] = *s;
        *s = mean;
        s->run = run;
        s->num_runs = 1;
    }
    run[s->num_runs++] = *more;
    *more = (struct submitted_image){0};
    drop_small(s);
    average_runs(s);
    return true;
}

bool submitted_image_is_black(const struct submitted_image *s)
{
    for (size_t i = 0; i < 3 * (size_t)s->width * (size_t)s->height; i++)
        if (s->mean[i] > s->tolerance[i])
            return false;
    return true;
}

bool submitted_image_same(const struct submitted_image *a, const struct submitted_image *b)
{
    return a->width == b->width && a->height == b->height &&
           memcmp(a->mean, b->mean, 3 * (size_t)a->width * (size_t)a->height * sizeof *a->mean) ==
               0;
}

void submitted_image_expect(struct submitted_image *s, const struct moments *m, double spp)
{
    for (int k = 0; k < s->num_runs; k++)
        submitted_image_expect(&s->run[k], m, s->run[k].spp);
    spp = s->num_runs > 0 ? s->spp : spp;
    const double paths = fmax(1, m->spp) / spp;
    for (size_t i = 0; i < 3 * (size_t)s->width * (size_t)s->height; i++) {
        double v = 0, k3 = 0, num = 0;
        size_t at[9];
        for (int k = 0, all = neighbours(s, i / 3, at); k < all; k++) {
            size_t j = 3 * at[k] + i % 3;
            double n = m->n[at[k]];
            if (m->mean[j] >= s->clip)
                continue;
            v += n > 1 ? m->m2[j] / (n - 1) * paths : 0;
            k3 += n > 2 ? n * m->m3[j] / ((n - 1) * (n - 2)) * paths * paths : 0;
            num++;
        }
        bool varies = m->mean[i] < s->clip;
        s->variance[i] = varies ? v / num : 0;
        s->k3[i] = varies ? k3 / num : 0;
    }
}

bool submitted_image_from(const struct moments *m, const struct submitted_image *like,
                          struct submitted_image *out, struct err *e)
{
    *out = (struct submitted_image){.width = like->width,
                                    .height = like->height,
                                    .clip = like->clip,
                                    .known = m != NULL,
                                    .runs_dof = m != NULL ? 0 : INFINITY};
    if (!allocate(out, e))
        return false;
    for (size_t i = 0; m != NULL && i < 3 * (size_t)m->width * (size_t)m->height; i++) {
        double n = m->n[i / 3];
        out->mean[i] = fmin(m->mean[i], like->clip);
        if (m->mean[i] >= like->clip)
            continue;
        out->variance[i] = n > 1 ? m->m2[i] / (n * (n - 1)) : 0;
        out->k3[i] = n > 2 ? m->m3[i] / (n * (n - 1) * (n - 2)) : 0;
    }
    return true;
}

bool submitted_image_copy(const struct submitted_image *s, struct submitted_image *out,
                          struct err *e)
{
    if (!submitted_image_from(NULL, s, out, e))
        return false;
    memcpy(out->sha256, s->sha256, sizeof out->sha256);
    submitted_image_add(out, s);
    memcpy(out->k3, s->k3, 3 * (size_t)s->width * (size_t)s->height * sizeof *s->k3);
    return true;
}

void submitted_image_model(struct submitted_image *s, double kappa)
{
    static const double known_dof = 30;
    s->runs_dof = kappa > 0 ? known_dof : 0;
    for (size_t p = 0; p < (size_t)s->width * (size_t)s->height; p++) {
        double *v = s->measured + 4 * p, sd = 0;
        for (size_t c = 0; c < 3; c++) {
            v[c] = kappa * s->variance[3 * p + c] + s->rounding[3 * p + c];
            sd += luminance_weight[c] * sqrt(v[c]); /* for any correlation of the channels */
        }
        v[3] = sd * sd;
    }
}

static void scale_tile(struct submitted_image *s, int x0, int y0, const unsigned char *use)
{
    double measured = 0, ours = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < RUBRIC_TILE * RUBRIC_TILE; k++) {
            int x = x0 + k % RUBRIC_TILE, y = y0 + k / RUBRIC_TILE;
            size_t p = (size_t)y * (size_t)s->width + (size_t)x;
            for (size_t i = 3 * p; i < 3 * p + 3 && x < s->width && y < s->height; i++)
                if (pass == 1) {
                    s->k3[i] *= ours > 0 ? pow(measured / ours, 1.5) : 1;
                } else if (use[p]) {
                    measured += s->measured[4 * p + i % 3];
                    ours += s->variance[i] + s->rounding[i];
                }
        }
}

void submitted_image_scale_skewness(struct submitted_image *s, const unsigned char *use)
{
    for (int y = 0; y < s->height; y += RUBRIC_TILE)
        for (int x = 0; x < s->width; x += RUBRIC_TILE)
            scale_tile(s, x, y, use);
}

void submitted_image_add(struct submitted_image *dst, const struct submitted_image *src)
{
    for (size_t i = 0; i < 3 * (size_t)dst->width * (size_t)dst->height; i++) {
        dst->mean[i] += src->mean[i];
        dst->tolerance[i] += src->tolerance[i];
        dst->rounding[i] += src->rounding[i];
        dst->variance[i] += src->variance[i];
        dst->k3[i] += src->k3[i];
        dst->clipped[i] |= src->clipped[i];
    }
    dst->runs_dof = fmin(dst->runs_dof, src->runs_dof);
    for (size_t i = 0; i < 4 * (size_t)dst->width * (size_t)dst->height; i++)
        dst->measured[i] += src->measured[i];
}

double submitted_image_expected_sd(const struct moments *reference, size_t i, double spp)
{
    double n = reference->n[i / 3], paths = fmax(1, reference->spp);
    return n > 1 ? sqrt(reference->m2[i] / (n - 1) * paths / spp) : 0;
}

/* Clears use[p] if p or a neighbour is marked `kind` or more, unless p itself is marked
 * `spared`. */
static void clear_around(const struct submitted_image *s, const unsigned char *mark,
                         unsigned char kind, unsigned char spared, unsigned char *use)
{
    for (size_t p = 0; p < (size_t)s->width * (size_t)s->height; p++) {
        size_t at[9];
        for (int k = 0, all = neighbours(s, p, at); k < all; k++)
            if (mark[at[k]] >= kind && mark[p] != spared)
                use[p] = 0;
    }
}

/* Drops pixels of more than 20 times the mean variance: a few at the rim of a lamp or a caustic can
 * hold most of an image's noise and all of its skewness. */
static void drop_loudest(const struct submitted_image *s, const struct moments *m, double spp,
                         double *v, unsigned char *use)
{
    static const double loudest = 20; /* times the mean variance */
    size_t pixels = (size_t)s->width * (size_t)s->height;
    double num = 0, total = 0;
    for (size_t p = 0; p < pixels; p++) {
        double sum = 0;
        for (size_t i = 3 * p; i < 3 * p + 3; i++)
            sum += m->mean[i] < s->clip ? pow(submitted_image_expected_sd(m, i, spp), 2) : 0;
        v[p] = sum;
        if (use[p] && sum > 0) {
            total += sum;
            num++;
        }
    }
    for (size_t p = 0; p < pixels; p++)
        if (num > 0 && v[p] > loudest * total / num)
            use[p] = 0;
}

/* Standard error measured from run to run in the 3 x 3 pixels, for the run with fewest samples. */
static double measured_sd(const struct submitted_image *s, size_t i)
{
    double sum = 0, least = INFINITY;
    size_t at[9];
    int num = neighbours(s, i / 3, at);
    for (int k = 0; k < s->num_runs; k++)
        least = fmin(least, s->run[k].spp);
    for (int k = 0; k < num; k++)
        sum += s->measured[4 * at[k] + i % 3];
    return sqrt(sum / num * s->spp / least);
}

enum mark { MARK_NONE, MARK_CLIPPED, MARK_UNKNOWN };

bool submitted_image_comparable(const struct submitted_image *s, const struct moments *m,
                                double spp, bool measured, unsigned char *use, struct err *e)
{
    size_t pixels = (size_t)s->width * (size_t)s->height;
    unsigned char *mark = calloc(pixels, 1);
    double *v = calloc(pixels, sizeof *v);
    if (mark == NULL || v == NULL) {
        free(mark);
        free(v);
        return err_set(e, "out of memory for %zu pixels", pixels);
    }
    for (size_t i = 0; i < 3 * pixels; i++) {
        double far = m->mean[i] - s->clip;
        double sd = submitted_image_expected_sd(m, i, spp);
        if (measured && s->num_runs > 1 && isfinite(far))
            sd = fmax(sd, measured_sd(s, i));
        if (fabs(far) < clip_sd * sd + s->tolerance[i])
            mark[i / 3] = MARK_UNKNOWN;
        else if (far > 0 && mark[i / 3] == MARK_NONE)
            mark[i / 3] = MARK_CLIPPED;
    }
    clear_around(s, mark, MARK_CLIPPED, MARK_CLIPPED, use);
    drop_loudest(s, m, spp, v, use);
    free(mark);
    free(v);
    return true;
}

void submitted_image_unclipped(const struct submitted_image *s, unsigned char *use)
{
    for (size_t p = 0; p < (size_t)s->width * (size_t)s->height; p++) {
        size_t at[9];
        for (int k = 0, all = neighbours(s, p, at); k < all; k++) {
            const unsigned char *c = s->clipped + 3 * at[k];
            if (c[0] || c[1] || c[2])
                use[p] = 0;
        }
    }
}
