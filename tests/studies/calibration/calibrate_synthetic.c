#include "calibrate_synthetic.h"

#include "tools/compare/region.h"
#include "tools/stats/distributions.h"

#include <string.h>

enum { SIDE = 16, TILE = 8, CHUNK = 5000, RENEWED = 128, REGION_PIXELS = 64 };
static const size_t tail_chunk = 1000000;
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

/* Large n are sums of blocks of 64. */
static int block_of(const struct synthetic_cell *cell)
{
    return cell->n_a < 64 ? cell->n_a : 64;
}

/* Seeds of chunks must not be near each other: splitmix64 counts up. */
static uint64_t seed_of(const struct synthetic_cell *cell, int chunk)
{
    uint64_t state = cell->seed * 0x632be59bd9b4e019u + (uint64_t)chunk;
    for (int i = 0; i < 4; i++)
        state ^= (uint64_t)(uniform(&state) * 0x1p53) << (i * 3);
    return state;
}

struct synthetic_job {
    const struct synthetic_cell *cell;
    struct null_run run;
    size_t blocks, largest;
};

static bool synthetic_chunk(void *arg, int chunk, struct err *e)
{
    struct synthetic_job *job = arg;
    const struct synthetic_cell *cell = job->cell;
    struct library library;
    int block = block_of(cell);
    if (!library_init(&library, cell->law, block, job->blocks, seed_of(cell, chunk), e))
        return false;
    struct moments a = new_moments(SIDE, SIDE, "sample");
    struct moments b = new_moments(SIDE, SIDE, cell->n_b > 0 ? "sample" : "exact");
    bool ok = true;
    size_t first = (size_t)chunk * CHUNK, end = first + CHUNK;
    for (size_t i = first; ok && i < end && i < job->largest; i++) {
        bool grey = i % 2 == 0;
        library_renew(&library, RENEWED);
        library_image(&library, cell->n_a / block, grey, NULL, &a);
        if (cell->n_b > 0)
            library_image(&library, cell->n_b / block, grey, &a, &b);
        else
            constant(&b, library_mean(&library), 1);
        ok = null_pair(&job->run, i, &a, &b, TILE, e);
    }
    moments_free(&a);
    moments_free(&b);
    library_free(&library);
    return ok;
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
    return 0.45 * runs + (double)largest_of(pairs) * RENEWED * block_of(cell) * 15e-6;
}

bool synthetic_run(struct work *w, const struct synthetic_cell *cell, enum weakness weakness,
                   const size_t pairs[NUM_LEVELS], size_t blocks, struct null_result *out,
                   struct err *e)
{
    char name[64];
    synthetic_name(cell, name, sizeof name);
    struct synthetic_job job = {.cell = cell, .blocks = blocks, .largest = largest_of(pairs)};
    if (!null_init(&job.run, weakness, pairs, e))
        return false;
    int chunks = (int)((job.largest + CHUNK - 1) / CHUNK);
    bool exact = cell->law == LAW_NORMAL && cell->n_b == cell->n_a;
    bool ok = work_run(w, chunks, synthetic_cost(cell, pairs) / chunks, synthetic_chunk, &job, e) &&
              null_summary(&job.run, name, exact, out, e);
    null_free(&job.run);
    return ok || err_prefix(e, "%s", name);
}

struct tail_job {
    const struct synthetic_cell *cell;
    size_t blocks, regions;
    struct tail_result *part; /* one a chunk */
};

/* A pixel of a region, straight from a library: whole images for every region would take hours. */
static struct estimate pick_pixel(struct library *l, int merge)
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

static bool tail_chunk_run(void *arg, int chunk, struct err *e)
{
    struct tail_job *job = arg;
    const struct synthetic_cell *cell = job->cell;
    struct tail_result *out = &job->part[chunk];
    struct library library;
    int block = block_of(cell);
    if (!library_init(&library, cell->law, block, job->blocks, seed_of(cell, chunk), e))
        return false;
    double guard = stats_normal_quantile(tail_level[2] / 2);
    struct judge judge = {.opt = {.alpha = tail_level[2], .tile = 8},
                          .width = 16,
                          .height = 16,
                          .floor = 0.05,
                          .n_min = cell->n_a,
                          .z_guard = {[STATISTIC_PYRAMID] = guard}};
    struct rect rect = {0, 0, 8, 8};
    size_t first = (size_t)chunk * tail_chunk;
    size_t regions = job->regions - first < tail_chunk ? job->regions - first : tail_chunk;
    /* Below this |t| no p is small: no need to know it. */
    double least = 0.9 * stats_normal_quantile(tail_level[0] / 2);
    for (size_t i = 0; i < regions; i++) {
        struct cell sum = {0};
        library_renew(&library, 1);
        for (int p = 0; p < REGION_PIXELS; p++) {
            struct estimate a = pick_pixel(&library, cell->n_a / block);
            struct estimate b = {.mean = library_mean(&library)};
            if (cell->n_b > 0)
                b = pick_pixel(&library, cell->n_b / block);
            pyramid_add_pixel(&sum, &a, &b);
        }
        struct measured m = region_measure(&judge, &sum, rect);
        if (m.noise_free || !region_testable(&judge, &m))
            continue;
        out->tested++;
        if (region_excess_t(&m) < least)
            continue;
        double log10_p = region_log10_p(&judge, &m, 0);
        for (int l = 0; l < 3; l++)
            out->rejected[l] += log10_p <= log10(tail_level[l]);
    }
    out->regions = (double)regions;
    library_free(&library);
    return true;
}

double tail_cost(const struct synthetic_cell *cell, size_t regions)
{
    double merge = (cell->n_a + cell->n_b) / block_of(cell);
    return (double)regions * (64 * merge * 10e-6 + block_of(cell) * 15e-6);
}

bool tail_run(struct work *w, const struct synthetic_cell *cell, size_t regions, size_t blocks,
              struct tail_result *out, struct err *e)
{
    *out = (struct tail_result){0};
    synthetic_name(cell, out->name, sizeof out->name);
    int chunks = (int)((regions + tail_chunk - 1) / tail_chunk);
    struct tail_job job = {cell, blocks, regions, calloc((size_t)chunks, sizeof *job.part)};
    if (job.part == NULL)
        return err_set(e, "out of memory for %d parts", chunks);
    bool ok = work_run(w, chunks, tail_cost(cell, regions) / chunks, tail_chunk_run, &job, e);
    for (int i = 0; ok && i < chunks; i++) {
        out->regions += job.part[i].regions;
        out->tested += job.part[i].tested;
        for (int l = 0; l < 3; l++)
            out->rejected[l] += job.part[i].rejected[l];
    }
    free(job.part);
    return ok || err_prefix(e, "%s", out->name);
}

bool tail_check(const struct tail_result *r, struct checks *c)
{
    bool holds = true;
    for (int l = 0; l < 3; l++)
        holds = check_at_most(c, r->rejected[l], fmax(1, r->tested), tail_level[l] * guard_factor,
                              "%s: single regions at %g", r->name, tail_level[l]) &&
                holds;
    return holds;
}
