#include "stopping_rule.h"

#include <gsl/gsl_randist.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { REPEATS = 8, SHAPES = 3 };
static const double uncertain = 3.3; /* standard deviations of ln kappa */

/* Names of the catalogue's bugs that follow another rule. */
static const char *const bug_of[NUM_STOPPING_KINDS] = {
    [STOPS_BY_ONE_SIGMA] = "adaptive_one_sigma", [STOPS_BY_ABSOLUTE] = "adaptive_absolute",
    [STOPS_BY_N] = "adaptive_without_root",      [STOPS_BY_SIGMA] = "adaptive_without_root-whole",
    [STOPS_AT_ONCE] = "adaptive_at_once",        [STOPS_NEVER] = "adaptive_never_stops",
};

/* A sample is c, or c + a with probability p; p 1: no fluctuation, as if mean and variance were known. */
struct shape {
    double p, c, a;
};

static struct shape shape_of(int kind, double mean, double variance)
{
    double p = mean * mean / (mean * mean + variance) / (kind == 2 ? 3 : 1);
    if (kind == 0 || !(mean > 0))
        return (struct shape){.p = 1};
    double a = sqrt(variance / (p * (1 - p)));
    return (struct shape){p, mean - p * a, a};
}

static bool stops(enum stopping_kind by, double n, double mean, double variance, double tolerance)
{
    double sigma = sqrt(fmax(0, variance));
    switch (by) {
    case STOPS_RIGHTLY: return 1.96 * sigma / sqrt(n) <= tolerance * mean;
    case STOPS_BY_ONE_SIGMA: return sigma / sqrt(n) <= tolerance * mean;
    case STOPS_BY_ABSOLUTE: return 1.96 * sigma / sqrt(n) <= tolerance;
    case STOPS_BY_N: return 1.96 * sigma / n <= tolerance * mean;
    case STOPS_BY_SIGMA: return 1.96 * sigma <= tolerance * mean;
    case STOPS_AT_ONCE: return true;
    case STOPS_NEVER:
    case NUM_STOPPING_KINDS: break;
    }
    return false;
}

/* Samples after which one pixel stops; *bias: its mean then, less that of all `most` samples of the same run. */
static double run_pixel(const gsl_rng *rng, enum stopping_kind by, struct shape s, double mean,
                        double variance, int batch, double tolerance, int most, double *bias)
{
    double hits = 0, stopped = 0, at_stop = 0;
    *bias = 0;
    for (int taken = batch; taken < most && stopped == 0; taken += batch) {
        double n = taken;
        double found = mean, spread = variance;
        if (s.p < 1) {
            hits += gsl_ran_binomial(rng, s.p, (unsigned)batch);
            found = s.c + s.a * hits / n;
            spread = s.a * s.a * hits * (1 - hits / n) / (n - 1);
        }
        if (stops(by, n, found, spread, tolerance)) {
            stopped = n;
            at_stop = found;
        }
    }
    if (stopped == 0)
        return most;
    if (s.p < 1) {
        hits += gsl_ran_binomial(rng, s.p, (unsigned)(most - stopped));
        *bias = at_stop - (s.c + s.a * hits / most);
    }
    return stopped;
}

/* What is simulated, and of which pixel. */
struct simulation {
    const gsl_rng *rng;
    const struct rubric_image *image;
    const struct moments *m;
    const double *light; /* of each tile, over that of m; NULL: as much */
    enum stopping_kind by;
    double batch, tolerance;
};

/* Luminance of a sample: for any correlation of the channels the variance is at most this (pyramid.h). */
static void sample_of(const struct moments *m, size_t pixel, double *mean, double *variance)
{
    double sd = 0, n = m->n[pixel];
    *mean = 0;
    for (size_t c = 0; c < 3; c++) {
        size_t i = 3 * pixel + c;
        *mean += luminance_weight[c] * m->mean[i];
        sd += luminance_weight[c] * (n > 1 ? sqrt(m->m2[i] / (n - 1) * fmax(1, m->spp)) : 0);
    }
    *variance = sd * sd;
}

/* Simulates a tile with one shape and kappa. Returns the samples of all its pixels; *bias: relative
 * to its light. */
static double run_tile(const struct simulation *s, struct rect r, int kind, double kappa,
                       double brighter, double *bias)
{
    double taken = 0, light = 0, off = 0;
    for (int y = r.y; y < r.y + r.height; y++)
        for (int x = r.x; x < r.x + r.width; x++) {
            double mean, variance, b;
            int repeats = kind == 0 ? 1 : REPEATS;
            sample_of(s->m, (size_t)y * (size_t)s->m->width + (size_t)x, &mean, &variance);
            mean *= brighter;
            const struct shape shape = shape_of(kind, mean, kappa * variance);
            for (int k = 0; k < repeats; k++) {
                taken += run_pixel(s->rng, s->by, shape, mean, kappa * variance, (int)s->batch,
                                   s->tolerance, s->image->spp, &b) /
                         repeats;
                off += b / repeats;
            }
            light += mean;
        }
    *bias = light > 0 ? off / light : 0;
    return taken;
}

static void run_all(const struct simulation *s, const double *kappa, double factor, int kind,
                    struct stopping *out)
{
    int columns = s->image->width / RUBRIC_TILE, tiles = columns * (s->image->height / RUBRIC_TILE);
    double taken = 0;
    for (int t = 0; t < tiles; t++) {
        double bias;
        const struct rect r = {t % columns * RUBRIC_TILE, t / columns * RUBRIC_TILE, RUBRIC_TILE,
                               RUBRIC_TILE};
        taken += run_tile(s, r, kind, kappa[t] * factor, s->light != NULL ? s->light[t] : 1, &bias);
        if (out->low != NULL) {
            out->low[t] = fmin(out->low[t], bias);
            out->high[t] = fmax(out->high[t], bias);
        }
    }
    taken /= (double)s->image->width * s->image->height;
    out->least = fmin(out->least, taken);
    out->most = fmax(out->most, taken);
}

/* All shapes, with kappa at both ends of its interval. */
static void simulate(const struct simulation *s, const double *kappa, double sd,
                     struct stopping *out)
{
    out->least = INFINITY;
    for (int kind = 0; kind < SHAPES; kind++)
        for (int end = -1; end <= 1; end += 2)
            run_all(s, kappa, exp(end * uncertain * sd), kind, out);
}

bool stopping_rule_range(const struct rubric_image *p, const struct submitted_image *s,
                         const struct submitted_image *right, const struct moments *m,
                         const unsigned char *use, struct stopping *out, struct err *e)
{
    size_t tiles = (size_t)(p->width / RUBRIC_TILE) * (size_t)(p->height / RUBRIC_TILE);
    double *kappa = calloc(tiles, sizeof *kappa), sd;
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_taus2);
    *out = (struct stopping){.low = calloc(tiles, sizeof *out->low),
                             .high = calloc(tiles, sizeof *out->high)};
    bool ok = ((kappa != NULL && rng != NULL && out->low != NULL && out->high != NULL) ||
               err_set(e, "out of memory")) &&
              difference_kappas(s, right, use, kappa, &sd, e);
    if (ok) {
        const struct simulation sim = {.rng = rng,
                                       .image = p,
                                       .m = m,
                                       .batch = rubric_option(p, "-a", 0),
                                       .tolerance = rubric_option(p, "-a", 1)};
        simulate(&sim, kappa, sd, out);
    } else {
        stopping_rule_free(out);
    }
    gsl_rng_free(rng);
    free(kappa);
    return ok;
}

enum stopping_kind stopping_rule_of(const char *bug)
{
    for (int k = 0; k < NUM_STOPPING_KINDS; k++)
        if (bug_of[k] != NULL && strcmp(bug_of[k], bug) == 0)
            return (enum stopping_kind)k;
    return STOPS_RIGHTLY;
}

/* Luminance of s over that of m in each tile, both clipped at the brightest code; 1 where either is
 * black. */
static void light_of(const struct submitted_image *s, const struct moments *m, double *light)
{
    int columns = s->width / RUBRIC_TILE, tiles = columns * (s->height / RUBRIC_TILE);
    for (int t = 0; t < tiles; t++) {
        double a = 0, b = 0;
        for (int i = 0; i < RUBRIC_TILE * RUBRIC_TILE; i++) {
            int x = t % columns * RUBRIC_TILE + i % RUBRIC_TILE,
                y = t / columns * RUBRIC_TILE + i / RUBRIC_TILE;
            size_t p = 3 * ((size_t)y * (size_t)s->width + (size_t)x);
            a += fmin(luminance(s->mean + p), s->clip);
            b += fmin(luminance(m->mean + p), s->clip);
        }
        light[t] = a > 0 && b > 0 ? a / b : 1;
    }
}

bool stopping_rule_samples(const struct rubric_image *p, const struct submitted_image *s,
                           const struct moments *m, struct stopping out[NUM_STOPPING_KINDS],
                           struct err *e)
{
    size_t tiles = (size_t)(p->width / RUBRIC_TILE) * (size_t)(p->height / RUBRIC_TILE),
           pixels = (size_t)p->width * (size_t)p->height;
    double *kappa = calloc(2 * tiles, sizeof *kappa), sd;
    unsigned char *use = malloc(pixels);
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_taus2);
    struct submitted_image right = {0};
    bool ok = (kappa != NULL && use != NULL && rng != NULL) || err_set(e, "out of memory");
    if (ok)
        memset(use, 1, pixels);
    ok = ok && submitted_image_comparable(s, m, p->spp, false, use, e) &&
         submitted_image_from(m, s, &right, e) && difference_kappas(s, &right, use, kappa, &sd, e);
    if (ok) {
        struct simulation sim = {.rng = rng,
                                 .image = p,
                                 .m = m,
                                 .light = kappa + tiles,
                                 .batch = rubric_option(p, "-a", 0),
                                 .tolerance = rubric_option(p, "-a", 1)};
        light_of(s, m, kappa + tiles);
        for (int by = 0; by < NUM_STOPPING_KINDS; by++) {
            sim.by = (enum stopping_kind)by;
            out[by] = (struct stopping){0};
            simulate(&sim, kappa, sd, &out[by]);
        }
    }
    submitted_image_free(&right);
    gsl_rng_free(rng);
    free(use);
    free(kappa);
    return ok;
}

void stopping_rule_free(struct stopping *s)
{
    free(s->low);
    free(s->high);
    *s = (struct stopping){0};
}
