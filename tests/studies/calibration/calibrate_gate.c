#include "calibrate_gate.h"

#include "calibrate_synthetic.h"

#include "tools/sequential/two_stage.h"
#include "tools/exact/permutation.h"
#include "tools/exact/sign_flip.h"

#include <string.h>

enum { SIDE = 16, TILE = 8, RENEWED = 128, EACH = 500, REPLICATES = 6, PERMUTED_SIDE = 8 };
const double permutation_level[2][NUM_PERMUTATION_LEVELS] = {{0.1, 0.05, 0.01}, {1e-2, 1e-3, 1e-4}};

static bool stages_pair(void *arg, struct library *l, size_t i, struct moments *a,
                        struct moments *b, double count[PAIR_COUNTS], struct err *e)
{
    const struct stages_cell *cell = arg;
    bool is_grey = i % 2 == 0;
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

static bool permutation_part(void *arg, int part, size_t first, size_t end,
                             double count[PAIR_COUNTS], struct err *e)
{
    const struct permutation_cell *cell = arg;
    uint64_t state = pairs_seed(cell->seed, part);
    float pixels[2 * REPLICATES][3 * PERMUTED_SIDE * PERMUTED_SIDE];
    float *image[2 * REPLICATES];
    char name[2 * REPLICATES][16], *names[2 * REPLICATES];
    for (int k = 0; k < 2 * REPLICATES; k++) {
        snprintf(name[k], sizeof name[k], "%d", k);
        image[k] = pixels[k];
        names[k] = name[k];
    }
    struct replicate_dir a = {REPLICATES, PERMUTED_SIDE, PERMUTED_SIDE, image, names, 0};
    struct replicate_dir b = {REPLICATES, PERMUTED_SIDE, PERMUTED_SIDE, image + REPLICATES,
                              names + REPLICATES, 0};
    struct permutation_options opt = {.alpha = permutation_level[0][0], .min_side = 2};
    for (size_t i = first; i < end; i++) {
        struct permutation p;
        for (int k = 0; k < 2 * REPLICATES; k++)
            draw_image(cell->law, &state, pixels[k]);
        if (!permutation_test(&a, &b, &opt, &p, e))
            return false;
        for (int l = 0; l < NUM_PERMUTATION_LEVELS; l++)
            count[l] += p.p <= permutation_level[0][l];
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

static bool flips_part(void *arg, int part, size_t first, size_t end, double count[PAIR_COUNTS],
                       struct err *e)
{
    const struct permutation_cell *cell = arg;
    uint64_t state = pairs_seed(cell->seed, part);
    float a[3 * SIDE * SIDE], b[3 * SIDE * SIDE];
    float *rows[] = {a, b};
    struct sign_flip_images in = {1, SIDE, SIDE, &rows[0], &rows[1], NULL};
    struct sign_flip_options opt = {
        .alpha = permutation_level[1][0], .filter_width = 1, .tile = TILE};
    for (size_t i = first; i < end; i++) {
        struct sign_flip f;
        draw_means(cell->law, cell->draws, &state, a);
        draw_means(cell->law, cell->draws, &state, b);
        if (!sign_flip_test(&in, &opt, &f, e))
            return false;
        for (int l = 0; l < NUM_PERMUTATION_LEVELS; l++)
            count[l] += f.log10_p <= log10(permutation_level[1][l]);
    }
    return true;
}

double stages_cost(const struct stages_cell *cell, size_t pairs)
{
    return (double)pairs * (1 + RENEWED * 15e-6 * pairs_block(cell->n));
}

bool stages_run(struct work *w, const struct stages_cell *cell, size_t pairs, size_t blocks,
                struct stages_result *out, struct err *e)
{
    *out = (struct stages_result){.alpha = cell->alpha, .pairs = (double)pairs};
    struct synthetic_cell named = {cell->law, cell->n, cell->n, 0};
    synthetic_name(&named, out->name, sizeof out->name);
    const struct synthetic_pairs of = {.law = cell->law,
                                       .n = cell->n,
                                       .side = SIDE,
                                       .blocks = blocks,
                                       .seed = cell->seed,
                                       .pair = stages_pair,
                                       .arg = (void *)cell};
    double count[PAIR_COUNTS];
    if (!synthetic_pairs_run(w, &of, pairs, EACH, stages_cost(cell, pairs), count, e))
        return err_prefix(e, "two stages, %s", out->name);
    out->flagged = count[0];
    out->different = count[1];
    return true;
}

void stages_check(const struct stages_result *r, struct checks *c)
{
    check_at_most(c, r->flagged, r->pairs, two_stage_alpha(r->alpha),
                  "%s: flagged by the first of two stages at %g", r->name, r->alpha);
    check_at_most(c, r->different, r->pairs, r->alpha, "%s: two stages at %g", r->name, r->alpha);
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
    double count[PAIR_COUNTS];
    if (!pairs_run(w, pairs, EACH, permutations_cost(pairs),
                   out->is_flips ? flips_part : permutation_part, (void *)cell, count, e))
        return err_prefix(e, "%s, %s", out->is_flips ? "flips" : "permutation", out->name);
    memcpy(out->rejected, count, sizeof out->rejected);
    return true;
}

void permutations_check(const struct permutation_result *r, struct checks *c)
{
    for (int l = 0; l < NUM_PERMUTATION_LEVELS; l++)
        check_at_most(c, r->rejected[l], r->pairs, permutation_level[r->is_flips][l],
                      "%s: %s at %g", r->name, r->is_flips ? "flips" : "permutation",
                      permutation_level[r->is_flips][l]);
}
