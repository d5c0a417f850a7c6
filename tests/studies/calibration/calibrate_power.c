#include "calibrate_power.h"

#include "calibrate_synthetic.h"
#include "tests/support/rates.h"

#include "tools/stats/distributions.h"

enum { CHUNK = 250, PILOTS = 50, POINT_09 = 6, POINT_11 = 8 };
static const double power_alpha = 1e-3;
const double power_bias[POWER_POINTS] = {0, 0.3, 0.5, 0.6, 0.7, 0.8, 0.9, 1, 1.1, 1.25};

struct power_job {
    const struct power_cell *cell;
    enum weakness weakness;
    size_t pairs, blocks;
    double mdb;
    int chunks;
    double *found; /* one a job */
};

static int block_of(int n)
{
    return n < 64 ? n : 64;
}

/* A pair whose A is brighter by `bias` in all pixels or in the first tile. */
static void biased_pair(const struct power_cell *cell, struct library *l, double bias,
                        struct moments *a, struct moments *b)
{
    size_t side = (size_t)cell->side, tile = side / 2;
    library_renew(l, side * side / 4);
    library_image(l, cell->n / l->n, cell->is_grey, NULL, a);
    library_image(l, cell->n / l->n, cell->is_grey, a, b);
    for (size_t p = 0; p < side * side; p++)
        if (!cell->one_tile || (p % side < tile && p / side < tile))
            for (size_t i = 3 * p; i < 3 * p + 3; i++)
                a->mean[i] += bias;
}

static struct compare_options options_of(const struct power_cell *cell)
{
    return (struct compare_options){.alpha = power_alpha,
                                    .margin_global = cell->margin_global,
                                    .margin_tile = cell->margin_tile,
                                    .tile = cell->side / 2};
}

/* The mean of the MDBs of pairs without a bias. */
static bool printed_mdb(struct power_job *job, struct err *e)
{
    const struct power_cell *cell = job->cell;
    struct compare_options opt = options_of(cell);
    struct library library;
    if (!library_init(&library, cell->law, block_of(cell->n), job->blocks, cell->seed << 20, e))
        return false;
    struct moments a = new_moments(cell->side, cell->side, "sample");
    struct moments b = new_moments(cell->side, cell->side, "sample");
    bool ok = true;
    for (int i = 0; ok && i < PILOTS; i++) {
        struct outcome o;
        biased_pair(cell, &library, 0, &a, &b);
        ok = tester_run(job->weakness, &a, &b, &opt, &o, e);
        if (ok)
            job->mdb += (cell->one_tile ? o.mdb_tile : o.mdb_global) / PILOTS;
    }
    moments_free(&a);
    moments_free(&b);
    library_free(&library);
    return ok;
}

static bool power_chunk(void *arg, int index, struct err *e)
{
    struct power_job *job = arg;
    const struct power_cell *cell = job->cell;
    struct compare_options opt = options_of(cell);
    int point = index / job->chunks, chunk = index % job->chunks;
    if (cell->is_short && (point < POINT_09 || point > POINT_11))
        return true;
    struct library library;
    uint64_t seed = (cell->seed << 20) + 1000003u * (uint64_t)(index + 1);
    if (!library_init(&library, cell->law, block_of(cell->n), job->blocks, seed, e))
        return false;
    struct moments a = new_moments(cell->side, cell->side, "sample");
    struct moments b = new_moments(cell->side, cell->side, "sample");
    bool ok = true;
    size_t end = (size_t)(chunk + 1) * CHUNK;
    for (size_t i = (size_t)chunk * CHUNK; ok && i < end && i < job->pairs; i++) {
        struct outcome o;
        biased_pair(cell, &library, power_bias[point] * job->mdb, &a, &b);
        ok = tester_run(job->weakness, &a, &b, &opt, &o, e);
        job->found[index] += ok && o.verdict == VERDICT_DIFFERENT;
    }
    moments_free(&a);
    moments_free(&b);
    library_free(&library);
    return ok;
}

double power_cost(const struct power_cell *cell, size_t pairs)
{
    double pixels = (double)cell->side * cell->side;
    return (double)pairs * POWER_POINTS * pixels * (1.8e-3 + 4e-6 * block_of(cell->n));
}

bool power_run(struct work *w, const struct power_cell *cell, enum weakness weakness, size_t pairs,
               size_t blocks, struct power_result *out, struct err *e)
{
    *out = (struct power_result){.pairs = (double)pairs, .is_grey = cell->is_grey};
    snprintf(out->name, sizeof out->name, "%s", cell->name);
    struct power_job job = {.cell = cell,
                            .weakness = weakness,
                            .pairs = pairs,
                            .blocks = blocks,
                            .chunks = (int)((pairs + CHUNK - 1) / CHUNK)};
    int jobs = POWER_POINTS * job.chunks;
    job.found = calloc((size_t)jobs, sizeof *job.found);
    if (job.found == NULL)
        return err_set(e, "out of memory for %d parts", jobs);
    bool ok = printed_mdb(&job, e) &&
              work_run(w, jobs, power_cost(cell, pairs) / jobs, power_chunk, &job, e);
    out->mdb = job.mdb;
    for (int i = 0; i < jobs; i++)
        out->found[i / job.chunks] += job.found[i];
    free(job.found);
    return ok || err_prefix(e, "%s", cell->name);
}

/* Away from 0 and 1, where the quantile is infinite. */
static double quantile_of_rate(double k, double n)
{
    return -stats_normal_quantile((k + 0.5) / (n + 1));
}

double power_95(const struct power_result *r)
{
    double target = -stats_normal_quantile(0.95);
    for (int i = 1; i < POWER_POINTS; i++) {
        double lo = quantile_of_rate(r->found[i - 1], r->pairs);
        double hi = quantile_of_rate(r->found[i], r->pairs);
        if (hi >= target && hi > lo)
            return power_bias[i - 1] +
                   (power_bias[i] - power_bias[i - 1]) * fmax(0, target - lo) / (hi - lo);
    }
    return 0;
}

bool power_check(const struct power_result *r, struct checks *c)
{
    bool holds = true;
    for (int i = 0; i < POWER_POINTS; i++) {
        double f = power_bias[i];
        if (f == 1)
            holds =
                check_at_least(c, r->found[i], r->pairs, 0.95, "%s: found at the MDB", r->name) &&
                holds;
        if (f == 1.1)
            holds = check_proves_at_least(c, r->found[i], r->pairs, 0.95,
                                          "%s: found at 1.1 of the MDB", r->name) &&
                    holds;
        if (f == 0.9 && r->is_grey)
            holds = check_proves_at_most(c, r->found[i], r->pairs, 0.95,
                                         "%s: found at 0.9 of the MDB", r->name) &&
                    holds;
    }
    return holds;
}
