#include "calibrate_power.h"
#include "calibrate_synthetic.h"

enum { SIDE = 16, TILE = 8, CHUNK = 1000 };

/* What the jobs of coverage and of margins share: pairs of one library, and six counters a job. */
struct pairs_job {
    const struct cover_cell *cover;
    const struct margin_cell *margin; /* one of both */
    enum weakness weakness;
    size_t pairs, blocks;
    int chunks;
    double (*count)[6];
};

static int block_of(int n)
{
    return n < 64 ? n : 64;
}

static bool in_first_tile(size_t p)
{
    return p % SIDE < TILE && p / SIDE < TILE;
}

/* Brings all but the first tile nearer to the mean, a hundredfold: its interval reaches furthest out. */
static void quieten(struct moments *m)
{
    for (size_t i = 0; i < 3 * SIDE * SIDE; i++)
        if (!in_first_tile(i / 3)) {
            m->mean[i] = 1 + (m->mean[i] - 1) / 100;
            m->m2[i] /= 1e4;
            m->m3[i] /= 1e6;
        }
}

static bool cover_pair(const struct pairs_job *job, struct library *l, struct moments *a,
                       struct moments *b, double count[6], struct err *e)
{
    const struct cover_cell *cell = job->cover;
    struct compare_options opt = {.alpha = cell->alpha, .tile = TILE};
    struct outcome o;
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

static bool margin_pair(const struct pairs_job *job, struct library *l, struct moments *a,
                        struct moments *b, double count[6], struct err *e)
{
    const struct margin_cell *cell = job->margin;
    struct compare_options opt = {.alpha = cell->alpha,
                                  .margin_global = cell->margin_global,
                                  .margin_tile = cell->margin_tile,
                                  .tile = TILE};
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

static bool pairs_chunk(void *arg, int chunk, struct err *e)
{
    struct pairs_job *job = arg;
    bool is_cover = job->cover != NULL, exact = is_cover && job->cover->n_b == 0;
    enum law law = is_cover ? job->cover->law : job->margin->law;
    int n = is_cover ? job->cover->n_a : job->margin->n;
    uint64_t seed = ((is_cover ? job->cover->seed : job->margin->seed) << 20) +
                    1000003u * (uint64_t)(chunk + 1);
    struct library library;
    if (!library_init(&library, law, block_of(n), job->blocks, seed, e))
        return false;
    struct moments a = new_moments(SIDE, SIDE, "sample");
    struct moments b = new_moments(SIDE, SIDE, exact ? "exact" : "sample");
    bool ok = true;
    size_t end = (size_t)(chunk + 1) * CHUNK;
    for (size_t i = (size_t)chunk * CHUNK; ok && i < end && i < job->pairs; i++) {
        library_renew(&library, SIDE * SIDE);
        ok = (is_cover ? cover_pair : margin_pair)(job, &library, &a, &b, job->count[chunk], e);
    }
    moments_free(&a);
    moments_free(&b);
    library_free(&library);
    return ok;
}

static bool pairs_run(struct work *w, struct pairs_job *job, double cost, double count[6],
                      struct err *e)
{
    job->chunks = (int)((job->pairs + CHUNK - 1) / CHUNK);
    job->count = calloc((size_t)job->chunks, sizeof *job->count);
    if (job->count == NULL)
        return err_set(e, "out of memory for %d parts", job->chunks);
    bool ok = work_run(w, job->chunks, cost / job->chunks, pairs_chunk, job, e);
    for (int i = 0; i < job->chunks; i++)
        for (int k = 0; k < 6; k++)
            count[k] += job->count[i][k];
    free(job->count);
    return ok;
}

double cover_cost(const struct cover_cell *cell, size_t pairs)
{
    return (double)pairs * (0.45 + 256e-6 * 15 * block_of(cell->n_a));
}

bool cover_run(struct work *w, const struct cover_cell *cell, enum weakness weakness, size_t pairs,
               size_t blocks, struct cover_result *out, struct err *e)
{
    *out = (struct cover_result){.alpha = cell->alpha, .pairs = (double)pairs};
    struct synthetic_cell named = {cell->law, cell->n_a, cell->n_b, 0};
    synthetic_name(&named, out->name, sizeof out->name);
    struct pairs_job job = {.cover = cell, .weakness = weakness, .pairs = pairs, .blocks = blocks};
    double count[6] = {0};
    if (!pairs_run(w, &job, cover_cost(cell, pairs), count, e))
        return err_prefix(e, "intervals, %s", out->name);
    for (int i = 0; i < 2; i++) {
        out->valid[i] = count[i];
        out->missed[i] = count[2 + i];
    }
    return true;
}

bool cover_check(const struct cover_result *r, struct checks *c)
{
    bool holds = true;
    for (int i = 0; i < 2; i++)
        if (r->valid[i] > 0)
            holds = check_at_most(c, r->missed[i], r->valid[i], 2 * r->alpha,
                                  "%s: %s outside its %g %% interval", r->name,
                                  i == 0 ? "image" : "tile", 100 * (1 - 2 * r->alpha)) &&
                    holds;
    return holds;
}

double margin_cost(const struct margin_cell *cell, size_t pairs)
{
    return (double)pairs * (1.4 + 256e-6 * 15 * block_of(cell->n));
}

bool margin_run(struct work *w, const struct margin_cell *cell, enum weakness weakness,
                size_t pairs, size_t blocks, struct margin_result *out, struct err *e)
{
    *out = (struct margin_result){.alpha = cell->alpha, .pairs = (double)pairs};
    struct synthetic_cell named = {cell->law, cell->n, cell->n, 0};
    synthetic_name(&named, out->name, sizeof out->name);
    struct pairs_job job = {.margin = cell, .weakness = weakness, .pairs = pairs, .blocks = blocks};
    double count[6] = {0};
    if (!pairs_run(w, &job, margin_cost(cell, pairs), count, e))
        return err_prefix(e, "margins, %s", out->name);
    for (int i = 0; i < 3; i++)
        out->equivalent[i] = count[i];
    for (int i = 0; i < 2; i++)
        out->different[i] = count[3 + i];
    return true;
}

bool margin_check(const struct margin_result *r, struct checks *c)
{
    bool holds = true;
    for (int i = 0; i < 2; i++) {
        const char *what = i == 0 ? "image" : "tile";
        holds = check_at_most(c, r->equivalent[i], r->pairs, r->alpha,
                              "%s: EQUIVALENT at %g, %s outside", r->name, r->alpha, what) &&
                holds;
        holds = check_at_most(c, r->different[i], r->pairs, r->alpha,
                              "%s: DIFFERENT at %g, %s at the edge", r->name, r->alpha, what) &&
                holds;
    }
    return holds;
}
