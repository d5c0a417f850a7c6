#include "calibrate_power.h"

#include "calibrate_synthetic.h"

#include "tools/stats/distributions.h"

enum { EACH = 250, PILOTS = 50, POINT_09 = 6, POINT_11 = 8 };
static const double power_alpha = 1e-3;
const double power_bias[POWER_POINTS] = {0, 0.3, 0.5, 0.6, 0.7, 0.8, 0.9, 1, 1.1, 1.25};

struct power_job {
    const struct power_cell *cell;
    enum weakness weakness;
    double bias; /* of A */
};

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

/* Counts what is DIFFERENT, and the mean of the MDBs over PILOTS pairs. */
static bool power_pair(void *arg, struct library *l, size_t i, struct moments *a, struct moments *b,
                       double count[PAIR_COUNTS], struct err *e)
{
    (void)i;
    const struct power_job *job = arg;
    const struct power_cell *cell = job->cell;
    const struct compare_options opt = {.alpha = power_alpha,
                                        .margin_global = cell->margin_global,
                                        .margin_tile = cell->margin_tile,
                                        .tile = cell->side / 2};
    struct outcome o;
    biased_pair(cell, l, job->bias, a, b);
    if (!tester_run(job->weakness, a, b, &opt, &o, e))
        return false;
    count[0] += o.verdict == VERDICT_DIFFERENT;
    count[1] += (cell->one_tile ? o.mdb_tile : o.mdb_global) / PILOTS;
    return true;
}

double power_cost(const struct power_cell *cell, size_t pairs)
{
    double pixels = (double)cell->side * cell->side;
    return (double)pairs * POWER_POINTS * pixels * (1.8e-3 + 4e-6 * pairs_block(cell->n));
}

bool power_run(struct work *w, const struct power_cell *cell, enum weakness weakness, size_t pairs,
               size_t blocks, struct power_result *out, struct err *e)
{
    *out = (struct power_result){.pairs = (double)pairs, .is_grey = cell->is_grey};
    snprintf(out->name, sizeof out->name, "%s", cell->name);
    struct power_job job = {.cell = cell, .weakness = weakness};
    struct synthetic_pairs of = {.law = cell->law,
                                 .n = cell->n,
                                 .side = cell->side,
                                 .blocks = blocks,
                                 .seed = cell->seed,
                                 .first_part = -1,
                                 .pair = power_pair,
                                 .arg = &job};
    double count[PAIR_COUNTS];
    int parts = (int)((pairs + EACH - 1) / EACH);
    if (!synthetic_pairs_run(w, &of, PILOTS, PILOTS, 0, count, e))
        return err_prefix(e, "%s", cell->name);
    out->mdb = count[1];
    for (int point = 0; point < POWER_POINTS; point++) {
        if (cell->is_short && (point < POINT_09 || point > POINT_11))
            continue;
        of.first_part = point * parts;
        job.bias = power_bias[point] * out->mdb;
        if (!synthetic_pairs_run(w, &of, pairs, EACH, power_cost(cell, pairs) / POWER_POINTS, count,
                                 e))
            return err_prefix(e, "%s", cell->name);
        out->found[point] = count[0];
    }
    return true;
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

void power_check(const struct power_result *r, struct checks *c)
{
    for (int i = 0; i < POWER_POINTS; i++) {
        double f = power_bias[i];
        if (f == 1)
            check_at_least(c, r->found[i], r->pairs, 0.95, "%s: found at the MDB", r->name);
        if (f == 1.1)
            check_proves_at_least(c, r->found[i], r->pairs, 0.95, "%s: found at 1.1 of the MDB",
                                  r->name);
        if (f == 0.9 && r->is_grey)
            check_proves_at_most(c, r->found[i], r->pairs, 0.95, "%s: found at 0.9 of the MDB",
                                 r->name);
    }
}

enum { SIDE = 16, TILE = 8, COVER_EACH = 1000 };

struct cover_job {
    const struct cover_cell *cell;
    enum weakness weakness;
};
struct margin_job {
    const struct margin_cell *cell;
    enum weakness weakness;
};

static bool in_first_tile(size_t p)
{
    return p % SIDE < TILE && p / SIDE < TILE;
}

/* Divides the noise of all but the first tile by 100, so that the first tile's interval reaches furthest out. */
static void quieten(struct moments *m)
{
    for (size_t i = 0; i < 3 * SIDE * SIDE; i++)
        if (!in_first_tile(i / 3)) {
            m->mean[i] = 1 + (m->mean[i] - 1) / 100;
            m->m2[i] /= 1e4;
            m->m3[i] /= 1e6;
        }
}

/* Counts of the image and of the tile: with an interval, and outside it. */
static bool cover_pair(void *arg, struct library *l, size_t index, struct moments *a,
                       struct moments *b, double count[PAIR_COUNTS], struct err *e)
{
    (void)index;
    const struct cover_job *job = arg;
    const struct cover_cell *cell = job->cell;
    struct compare_options opt = {.alpha = cell->alpha, .tile = TILE};
    struct outcome o;
    library_renew(l, SIDE * SIDE);
    library_image(l, cell->n_a / l->n, true, NULL, a);
    quieten(a);
    if (cell->n_b > 0) {
        library_image(l, cell->n_b / l->n, true, a, b);
    } else {
        constant(b, library_mean(l), 1);
    }
    quieten(b);
    if (!tester_run(job->weakness, a, b, &opt, &o, e))
        return false;
    if (o.worst_tile.x != 0 || o.worst_tile.y != 0)
        return err_set(e, "the tile at %d,%d reaches further out than the noisy one",
                       o.worst_tile.x, o.worst_tile.y);
    const struct region *region[2] = {&o.mean, &o.worst_tile};
    for (int i = 0; i < 2; i++)
        if (region[i]->ci_valid) {
            count[i]++;
            count[2 + i] += region[i]->ci_lo > 0 || region[i]->ci_hi < 0;
        }
    return true;
}

/* Counts what is EQUIVALENT with the image outside, a tile, neither; DIFFERENT with the first two. */
static bool margin_pair(void *arg, struct library *l, size_t index, struct moments *a,
                        struct moments *b, double count[PAIR_COUNTS], struct err *e)
{
    (void)index;
    const struct margin_job *job = arg;
    const struct margin_cell *cell = job->cell;
    struct compare_options opt = {.alpha = cell->alpha,
                                  .margin_global = cell->margin_global,
                                  .margin_tile = cell->margin_tile,
                                  .tile = TILE};
    library_renew(l, SIDE * SIDE);
    library_image(l, cell->n / l->n, true, NULL, a);
    library_image(l, cell->n / l->n, true, a, b);
    for (int which = 0; which < 3; which++) { /* the same noise for all three */
        double bias = which == 0 ? cell->margin_global : which == 1 ? cell->margin_tile : 0;
        struct outcome o;
        for (size_t i = 0; i < 3 * SIDE * SIDE; i++)
            if (which == 0 || in_first_tile(i / 3))
                a->mean[i] += bias * (1 + 1e-6);
        if (!tester_run(job->weakness, a, b, &opt, &o, e))
            return false;
        count[which] += o.verdict == VERDICT_EQUIVALENT;
        if (which < 2)
            count[3 + which] += o.verdict == VERDICT_DIFFERENT;
        for (size_t i = 0; i < 3 * SIDE * SIDE; i++)
            if (which == 0 || in_first_tile(i / 3))
                a->mean[i] -= bias * (1 + 1e-6);
    }
    return true;
}

double cover_cost(const struct cover_cell *cell, size_t pairs)
{
    return (double)pairs * (0.45 + 256e-6 * 15 * pairs_block(cell->n_a));
}

bool cover_run(struct work *w, const struct cover_cell *cell, enum weakness weakness, size_t pairs,
               size_t blocks, struct cover_result *out, struct err *e)
{
    *out = (struct cover_result){.alpha = cell->alpha, .pairs = (double)pairs};
    struct synthetic_cell named = {cell->law, cell->n_a, cell->n_b, 0};
    synthetic_name(&named, out->name, sizeof out->name);
    struct cover_job job = {cell, weakness};
    const struct synthetic_pairs of = {.law = cell->law,
                                       .n = cell->n_a,
                                       .side = SIDE,
                                       .is_exact = cell->n_b == 0,
                                       .blocks = blocks,
                                       .seed = cell->seed,
                                       .pair = cover_pair,
                                       .arg = &job};
    double count[PAIR_COUNTS];
    if (!synthetic_pairs_run(w, &of, pairs, COVER_EACH, cover_cost(cell, pairs), count, e))
        return err_prefix(e, "intervals, %s", out->name);
    for (int i = 0; i < 2; i++) {
        out->valid[i] = count[i];
        out->missed[i] = count[2 + i];
    }
    return true;
}

void cover_check(const struct cover_result *r, struct checks *c)
{
    for (int i = 0; i < 2; i++)
        if (r->valid[i] > 0)
            check_at_most(c, r->missed[i], r->valid[i], 2 * r->alpha,
                          "%s: %s outside its %g %% interval", r->name, i == 0 ? "image" : "tile",
                          100 * (1 - 2 * r->alpha));
}

double margin_cost(const struct margin_cell *cell, size_t pairs)
{
    return (double)pairs * (1.4 + 256e-6 * 15 * pairs_block(cell->n));
}

bool margin_run(struct work *w, const struct margin_cell *cell, enum weakness weakness,
                size_t pairs, size_t blocks, struct margin_result *out, struct err *e)
{
    *out = (struct margin_result){.alpha = cell->alpha, .pairs = (double)pairs};
    struct synthetic_cell named = {cell->law, cell->n, cell->n, 0};
    synthetic_name(&named, out->name, sizeof out->name);
    struct margin_job job = {cell, weakness};
    const struct synthetic_pairs of = {.law = cell->law,
                                       .n = cell->n,
                                       .side = SIDE,
                                       .blocks = blocks,
                                       .seed = cell->seed,
                                       .pair = margin_pair,
                                       .arg = &job};
    double count[PAIR_COUNTS];
    if (!synthetic_pairs_run(w, &of, pairs, COVER_EACH, margin_cost(cell, pairs), count, e))
        return err_prefix(e, "margins, %s", out->name);
    for (int i = 0; i < 3; i++)
        out->equivalent[i] = count[i];
    for (int i = 0; i < 2; i++)
        out->different[i] = count[3 + i];
    return true;
}

void margin_check(const struct margin_result *r, struct checks *c)
{
    for (int i = 0; i < 2; i++) {
        const char *what = i == 0 ? "image" : "tile";
        check_at_most(c, r->equivalent[i], r->pairs, r->alpha, "%s: EQUIVALENT at %g, %s outside",
                      r->name, r->alpha, what);
        check_at_most(c, r->different[i], r->pairs, r->alpha, "%s: DIFFERENT at %g, %s at the edge",
                      r->name, r->alpha, what);
    }
}
