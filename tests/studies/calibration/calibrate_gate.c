#include "calibrate_gate.h"

#include "calibrate_synthetic.h"

#include "tools/sequential/two_stage.h"
#include "tools/exact/permutation.h"
#include "tools/exact/sign_flip.h"

enum { SIDE = 16, TILE = 8, RENEWED = 128, CHUNK = 500, REPLICATES = 6, PERMUTED_SIDE = 8 };
const double permutation_level[2][NUM_PERMUTATION_LEVELS] = {{0.1, 0.05, 0.01}, {1e-2, 1e-3, 1e-4}};

struct gate_job {
    const struct stages_cell *stages;
    const struct permutation_cell *permutation; /* one of both */
    size_t pairs, blocks;
    double (*count)[NUM_PERMUTATION_LEVELS]; /* one a chunk; stages: flagged, different */
};

static bool stages_pair(const struct stages_cell *cell, struct library *l, bool is_grey,
                        struct moments *a, struct moments *b, double *count, struct err *e)
{
    struct compare_options opt = {.alpha = cell->alpha, .tile = TILE};
    struct comparison first, second;
    library_renew(l, RENEWED);
    library_image(l, cell->n / l->n, is_grey, NULL, a);
    library_image(l, cell->n / l->n, is_grey, a, b);
    if (!two_stage_first(a, b, &opt, &first, e))
        return false;
    bool flagged = first.verdict == VERDICT_DIFFERENT, ok = true;
    if (flagged) {
        library_image(l, cell->n / l->n, is_grey, NULL, a);
        library_image(l, cell->n / l->n, is_grey, a, b);
        ok = two_stage_confirm(&first, a, b, &opt, &second, e);
        if (ok) {
            count[1] += second.verdict == VERDICT_DIFFERENT;
            comparison_free(&second);
        }
    }
    count[0] += flagged;
    comparison_free(&first);
    return ok;
}

static bool stages_chunk(void *arg, int chunk, struct err *e)
{
    struct gate_job *job = arg;
    const struct stages_cell *cell = job->stages;
    uint64_t seed = (cell->seed << 20) + 1000003u * (uint64_t)(chunk + 1);
    struct library library;
    if (!library_init(&library, cell->law, cell->n < 64 ? cell->n : 64, job->blocks, seed, e))
        return false;
    struct moments a = new_moments(SIDE, SIDE, "sample"), b = new_moments(SIDE, SIDE, "sample");
    bool ok = true;
    size_t end = (size_t)(chunk + 1) * CHUNK;
    for (size_t i = (size_t)chunk * CHUNK; ok && i < end && i < job->pairs; i++)
        ok = stages_pair(cell, &library, i % 2 == 0, &a, &b, job->count[chunk], e);
    moments_free(&a);
    moments_free(&b);
    library_free(&library);
    return ok;
}

/* Never all black, which two images could both be: the same image twice is refused. */
static void draw_image(enum law law, uint64_t *state, float *pixels)
{
    float sum = 0;
    while (sum == 0)
        for (int p = 0; p < PERMUTED_SIDE * PERMUTED_SIDE; p++) {
            float x = (float)fmax(0, draw(law, state));
            for (int c = 0; c < 3; c++)
                pixels[3 * p + c] = x;
            sum += x;
        }
}

static bool permutation_chunk(void *arg, int chunk, struct err *e)
{
    struct gate_job *job = arg;
    uint64_t state = (job->permutation->seed << 20) + 1000003u * (uint64_t)(chunk + 1);
    float pixels[2 * REPLICATES][3 * PERMUTED_SIDE * PERMUTED_SIDE];
    float *image[2 * REPLICATES];
    char name[2 * REPLICATES][16], *names[2 * REPLICATES];
    for (int k = 0; k < 2 * REPLICATES; k++) {
        snprintf(name[k], sizeof name[k], "%d", k);
        image[k] = pixels[k];
        names[k] = name[k];
    }
    struct replicate_dir a = {REPLICATES, PERMUTED_SIDE, PERMUTED_SIDE, image, names};
    struct replicate_dir b = {REPLICATES, PERMUTED_SIDE, PERMUTED_SIDE, image + REPLICATES,
                              names + REPLICATES};
    struct permutation_options opt = {.alpha = permutation_level[0][0], .min_side = 2};
    size_t end = (size_t)(chunk + 1) * CHUNK;
    for (size_t i = (size_t)chunk * CHUNK; i < end && i < job->pairs; i++) {
        struct permutation p;
        for (int k = 0; k < 2 * REPLICATES; k++)
            draw_image(job->permutation->law, &state, pixels[k]);
        if (!permutation_test(&a, &b, &opt, &p, e))
            return false;
        for (int l = 0; l < NUM_PERMUTATION_LEVELS; l++)
            job->count[chunk][l] += p.p <= permutation_level[0][l];
    }
    return true;
}

static void draw_means(enum law law, int draws, uint64_t *state, float *pixels)
{
    for (int p = 0; p < SIDE * SIDE; p++) {
        double sum = 0;
        for (int k = 0; k < draws; k++)
            sum += draw(law, state);
        for (int c = 0; c < 3; c++)
            pixels[3 * p + c] = (float)(sum / draws);
    }
}

static bool flips_chunk(void *arg, int chunk, struct err *e)
{
    struct gate_job *job = arg;
    const struct permutation_cell *cell = job->permutation;
    uint64_t state = (cell->seed << 20) + 1000003u * (uint64_t)(chunk + 1);
    float a[3 * SIDE * SIDE], b[3 * SIDE * SIDE];
    float *rows[] = {a, b};
    struct sign_flip_images in = {1, SIDE, SIDE, &rows[0], &rows[1], NULL};
    struct sign_flip_options opt = {
        .alpha = permutation_level[1][0], .filter_width = 1, .tile = TILE};
    size_t end = (size_t)(chunk + 1) * CHUNK;
    for (size_t i = (size_t)chunk * CHUNK; i < end && i < job->pairs; i++) {
        struct sign_flip f;
        draw_means(cell->law, cell->draws, &state, a);
        draw_means(cell->law, cell->draws, &state, b);
        if (!sign_flip_test(&in, &opt, &f, e))
            return false;
        for (int l = 0; l < NUM_PERMUTATION_LEVELS; l++)
            job->count[chunk][l] += f.log10_p <= log10(permutation_level[1][l]);
    }
    return true;
}

/* Runs all chunks and adds what they counted. */
static bool run_chunks(struct work *w, struct gate_job *job, double cost, work_job *chunk,
                       double count[NUM_PERMUTATION_LEVELS], struct err *e)
{
    int chunks = (int)((job->pairs + CHUNK - 1) / CHUNK);
    job->count = calloc((size_t)chunks, sizeof *job->count);
    if (job->count == NULL)
        return err_set(e, "out of memory for %d parts", chunks);
    bool ok = work_run(w, chunks, cost / chunks, chunk, job, e);
    for (int i = 0; i < chunks; i++)
        for (int l = 0; l < NUM_PERMUTATION_LEVELS; l++)
            count[l] += job->count[i][l];
    free(job->count);
    return ok;
}

double stages_cost(const struct stages_cell *cell, size_t pairs)
{
    return (double)pairs * (1 + RENEWED * 15e-6 * (cell->n < 64 ? cell->n : 64));
}

bool stages_run(struct work *w, const struct stages_cell *cell, size_t pairs, size_t blocks,
                struct stages_result *out, struct err *e)
{
    *out = (struct stages_result){.alpha = cell->alpha, .pairs = (double)pairs};
    struct synthetic_cell named = {cell->law, cell->n, cell->n, 0};
    synthetic_name(&named, out->name, sizeof out->name);
    struct gate_job job = {.stages = cell, .pairs = pairs, .blocks = blocks};
    double count[NUM_PERMUTATION_LEVELS] = {0};
    if (!run_chunks(w, &job, stages_cost(cell, pairs), stages_chunk, count, e))
        return err_prefix(e, "two stages, %s", out->name);
    out->flagged = count[0];
    out->different = count[1];
    return true;
}

bool stages_check(const struct stages_result *r, struct checks *c)
{
    bool flagged = check_at_most(c, r->flagged, r->pairs, two_stage_alpha(r->alpha),
                                 "%s: flagged by the first of two stages at %g", r->name, r->alpha);
    return check_at_most(c, r->different, r->pairs, r->alpha, "%s: two stages at %g", r->name,
                         r->alpha) &&
           flagged;
}

double permutations_cost(size_t pairs)
{
    return 1.5 * (double)pairs;
}

bool permutations_run(struct work *w, const struct permutation_cell *cell, size_t pairs,
                      struct permutation_result *out, struct err *e)
{
    *out = (struct permutation_result){.pairs = (double)pairs, .is_flips = cell->draws > 0};
    snprintf(out->name, sizeof out->name, "%s", law_name[cell->law]);
    if (out->is_flips)
        snprintf(out->name, sizeof out->name, "%s, %d", law_name[cell->law], cell->draws);
    struct gate_job job = {.permutation = cell, .pairs = pairs};
    if (!run_chunks(w, &job, permutations_cost(pairs),
                    out->is_flips ? flips_chunk : permutation_chunk, out->rejected, e))
        return err_prefix(e, "%s, %s", out->is_flips ? "flips" : "permutation", out->name);
    return true;
}

bool permutations_check(const struct permutation_result *r, struct checks *c)
{
    bool holds = true;
    for (int l = 0; l < NUM_PERMUTATION_LEVELS; l++)
        holds = check_at_most(c, r->rejected[l], r->pairs, permutation_level[r->is_flips][l],
                              "%s: %s at %g", r->name, r->is_flips ? "flips" : "permutation",
                              permutation_level[r->is_flips][l]) &&
                holds;
    return holds;
}
