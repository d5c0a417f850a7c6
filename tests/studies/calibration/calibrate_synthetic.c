#include "calibrate_synthetic.h"

#include "tools/compare/region.h"
#include "tools/stats/distributions.h"

#include <string.h>

enum {
    SIDE = 16,
    TILE = 8,
    EACH = 5000,
    REGIONS_EACH = 1000000,
    RENEWED = 128,
    REGION_PIXELS = 64
};
const double tail_level[3] = {1e-4, 1e-5, 1e-6};
static const double guard_factor = 1.2214; /* e^0.2 */
const char *const law_name[] = {
    [LAW_NORMAL] = "normal",           [LAW_EXPONENTIAL] = "exponential",
    [LAW_BLACK] = "90 % black",        [LAW_RARE] = "2 % bright",
    [LAW_FIREFLY] = "fireflies",       [LAW_LOGNORMAL] = "lognormal",
    [LAW_PARETO] = "Pareto fireflies",
};

void synthetic_name(const struct synthetic_cell *cell, char *text, size_t size)
{
    if (cell->n_b > 0)
        snprintf(text, size, "%s, %d and %d", law_name[cell->law], cell->n_a, cell->n_b);
    else
        snprintf(text, size, "%s, %d and exact", law_name[cell->law], cell->n_a);
}

/* Seeds of parts must not be near each other: splitmix64 counts up. */
static uint64_t seed_of(uint64_t seed, int part)
{
    uint64_t state = seed * 0x632be59bd9b4e019u + (uint64_t)part;
    for (int i = 0; i < 4; i++)
        state ^= (uint64_t)(uniform(&state) * 0x1p53) << (i * 3);
    return state;
}

struct synthetic_job {
    const struct synthetic_cell *cell;
    struct null_run run;
};

static bool synthetic_pair(void *arg, struct library *l, size_t i, struct moments *a,
                           struct moments *b, double count[PAIR_COUNTS], struct err *e)
{
    (void)count;
    struct synthetic_job *job = arg;
    const struct synthetic_cell *cell = job->cell;
    bool grey = i % 2 == 0;
    library_renew(l, RENEWED);
    library_image(l, cell->n_a / l->n, grey, NULL, a);
    if (cell->n_b > 0)
        library_image(l, cell->n_b / l->n, grey, a, b);
    else
        constant(b, library_mean(l), 1);
    return null_pair(&job->run, i, a, b, TILE, e);
}

static size_t largest_of(const size_t pairs[NUM_LEVELS])
{
    size_t largest = 0;
    for (int l = 0; l < NUM_LEVELS; l++)
        largest = pairs[l] > largest ? pairs[l] : largest;
    return largest;
}

double synthetic_cost(const struct synthetic_cell *cell, const size_t pairs[NUM_LEVELS])
{
    double runs = 0;
    for (int l = 0; l < NUM_LEVELS; l++)
        runs += (double)pairs[l];
    return 0.45 * runs + (double)largest_of(pairs) * RENEWED * pairs_block(cell->n_a) * 15e-6;
}

bool synthetic_run(struct work *w, const struct synthetic_cell *cell, enum weakness weakness,
                   const size_t pairs[NUM_LEVELS], size_t blocks, struct null_result *out,
                   struct err *e)
{
    char name[64];
    synthetic_name(cell, name, sizeof name);
    struct synthetic_job job = {.cell = cell};
    if (!null_init(&job.run, weakness, pairs, e))
        return false;
    const struct synthetic_pairs of = {.law = cell->law,
                                       .n = cell->n_a,
                                       .side = SIDE,
                                       .is_exact = cell->n_b == 0,
                                       .blocks = blocks,
                                       .seed = cell->seed,
                                       .seed_of = seed_of,
                                       .pair = synthetic_pair,
                                       .arg = &job};
    double count[PAIR_COUNTS];
    bool exact = cell->law == LAW_NORMAL && cell->n_b == cell->n_a;
    bool ok = synthetic_pairs_run(w, &of, largest_of(pairs), EACH, synthetic_cost(cell, pairs),
                                  count, e) &&
              null_summary(&job.run, name, exact, out, e);
    null_free(&job.run);
    return ok || err_prefix(e, "%s", name);
}

struct tail_job {
    const struct synthetic_cell *cell;
    size_t blocks;
};

/* A pixel of a region, straight from a library: whole images for every region would take hours. */
static struct pixel_estimate pick_pixel(struct library *l, int merge)
{
    struct block b = {0, 0, 0};
    for (int k = 0; k < merge; k++) {
        const struct block *pick = &l->block[(size_t)(uniform(&l->state) * (double)l->num)];
        b.s1 += pick->s1;
        b.s2 += pick->s2;
        b.s3 += pick->s3;
    }
    double n = (double)merge * l->n, shift = b.s1 / n;
    double v = fmax(0, b.s2 - b.s1 * shift) / (n * (n - 1));
    double k3 = (b.s3 - 3 * b.s2 * shift + 2 * b.s1 * shift * shift) / (n * (n - 1) * (n - 2));
    return pyramid_estimate_from(1 + shift, v, k3, n);
}

/* Counts regions that are tested, and those rejected at each level. */
static bool tail_part(void *arg, int part, size_t first, size_t end, double count[PAIR_COUNTS],
                      struct err *e)
{
    const struct tail_job *job = arg;
    const struct synthetic_cell *cell = job->cell;
    struct library library;
    int block = pairs_block(cell->n_a);
    if (!library_init(&library, cell->law, block, job->blocks, seed_of(cell->seed, part), e))
        return false;
    double guard = stats_normal_quantile(tail_level[2] / 2);
    struct judge judge = {.opt = {.alpha = tail_level[2], .tile = 8},
                          .width = 16,
                          .height = 16,
                          .floor = 0.05,
                          .n_min = cell->n_a,
                          .z_guard = {[STATISTIC_PYRAMID] = guard}};
    struct rect rect = {0, 0, 8, 8};
    /* Below this |t| p exceeds every level, so it need not be computed. */
    double least = 0.9 * stats_normal_quantile(tail_level[0] / 2);
    for (size_t i = first; i < end; i++) {
        struct cell sum = {0};
        library_renew(&library, 1);
        for (int p = 0; p < REGION_PIXELS; p++) {
            struct pixel_estimate a = pick_pixel(&library, cell->n_a / block);
            struct pixel_estimate b = {.mean = library_mean(&library)};
            if (cell->n_b > 0)
                b = pick_pixel(&library, cell->n_b / block);
            pyramid_add_pixel(&sum, &a, &b);
        }
        struct measured m = region_measure(&judge, &sum, rect);
        if (m.noise_free || !region_testable(&judge, &m))
            continue;
        count[0]++;
        if (region_excess_t(&m) < least)
            continue;
        double log10_p = region_log10_p(&judge, &m, 0);
        for (int l = 0; l < 3; l++)
            count[1 + l] += log10_p <= log10(tail_level[l]);
    }
    library_free(&library);
    return true;
}

double tail_cost(const struct synthetic_cell *cell, size_t regions)
{
    double merge = (cell->n_a + cell->n_b) / pairs_block(cell->n_a);
    return (double)regions * (64 * merge * 10e-6 + pairs_block(cell->n_a) * 15e-6);
}

bool tail_run(struct work *w, const struct synthetic_cell *cell, size_t regions, size_t blocks,
              struct tail_result *out, struct err *e)
{
    *out = (struct tail_result){.regions = (double)regions};
    synthetic_name(cell, out->name, sizeof out->name);
    struct tail_job job = {cell, blocks};
    double count[PAIR_COUNTS];
    if (!pairs_run(w, regions, REGIONS_EACH, tail_cost(cell, regions), tail_part, &job, count, e))
        return err_prefix(e, "%s", out->name);
    out->tested = count[0];
    memcpy(out->rejected, count + 1, sizeof out->rejected);
    return true;
}

void tail_check(const struct tail_result *r, struct checks *c)
{
    for (int l = 0; l < 3; l++)
        check_at_most(c, r->rejected[l], fmax(1, r->tested), tail_level[l] * guard_factor,
                      "%s: single regions at %g", r->name, tail_level[l]);
}
