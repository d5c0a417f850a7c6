#include "calibrate.h"

#include "renderer/base/sha256.h"

#include <assert.h>

static const enum law laws[] = {LAW_NORMAL, LAW_EXPONENTIAL, LAW_BLACK, LAW_PARETO, LAW_LOGNORMAL};
enum { NUM_LAWS = sizeof laws / sizeof *laws };

static size_t part(double share, double num)
{
    double n = share * num;
    return n < 50 ? 50 : (size_t)n;
}

/* Appends a cell to one of the lists; its seed is the list's first one and its place. */
#define ADD(s, list, first_seed, ...)                                                              \
    do {                                                                                           \
        assert((size_t)(s)->num_##list < sizeof(s)->list / sizeof *(s)->list);                     \
        (s)->list[(s)->num_##list] = (__typeof__(*(s)->list)){__VA_ARGS__};                        \
        (s)->list[(s)->num_##list].seed = (first_seed) + (uint64_t)(s)->num_##list;                \
        (s)->num_##list++;                                                                         \
    } while (0)
#define ADD_SYNTHETIC(s, law, n_a, n_b) ADD(s, synthetic, 1000, law, n_a, n_b, 0)
#define ADD_RENDER(s, ...)              ADD(s, render, 3000, __VA_ARGS__, 0)
#define ADD_POWER(s, ...)               ADD(s, power, 4000, __VA_ARGS__)
#define NORMAL_16                       .law = LAW_NORMAL, .n = 16, .side = 32
#define EXPONENTIAL_64                  .law = LAW_EXPONENTIAL, .n = 64, .side = 32
#define ADD_COVER(s, ...)               ADD(s, cover, 5000, __VA_ARGS__, 0)
#define ADD_MARGIN(s, ...)              ADD(s, margin, 6000, __VA_ARGS__, 0)
#define ADD_STAGES(s, ...)              ADD(s, stages, 7000, __VA_ARGS__, 0)
#define ADD_PERMUTATION(s, law)         ADD(s, permutation, 8000, law, 0, 0)
#define ADD_FLIPS(s, law, draws)        ADD(s, permutation, 8000, law, draws, 0)

static void add_tail(struct settings *s, enum law law, int n_a, int n_b, size_t regions)
{
    ADD(s, tail, 2000, law, n_a, n_b, 0);
    s->tail_regions[s->num_tail - 1] = regions;
}

struct settings settings_published(double share)
{
    static const char *const scenes[] = {"25_ggx_metal",     "33_sphere_light", "41_cornell",
                                         "42_cornell_glass", "45_many_lights",  "46_sky"};
    static const double interval_alpha[] = {0.05, 0.005, 0.0005}; /* 90, 99, 99.9 % */
    static const double margin_alpha[] = {0.05, 0.01, 0.001};
    struct settings s = {
        .blocks = 65536,
        .synthetic_pairs = {part(share, 2e4), part(share, 1e5), 0},
        .render_pairs = part(share, 200),
        .power_pairs = part(share, 2000),
        .cover_pairs = part(share, 2e4),
        .margin_pairs = part(share, 1e4),
        .stages_pairs = part(share, 2e4),
        .permutation_pairs = part(share, 1e4),
    };
    for (int i = 0; i < NUM_LAWS; i++) {
        static const int n[][2] = {{16, 16}, {64, 64}, {1024, 1024}, {64, 1024}, {1024, 0}};
        for (size_t k = 0; k < sizeof n / sizeof *n; k++)
            ADD_SYNTHETIC(&s, laws[i], n[k][0], n[k][1]);
        add_tail(&s, laws[i], 64, 64, part(share, 5e6));
    }
    add_tail(&s, LAW_NORMAL, 16, 16, part(share, 5e6));
    add_tail(&s, LAW_EXPONENTIAL, 64, 1024, part(share, 1e5));
    add_tail(&s, LAW_EXPONENTIAL, 1024, 0, part(share, 1e5));
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
        ADD_RENDER(&s, scenes[i], 16, 64, 0);
        ADD_RENDER(&s, scenes[i], 32, 16, 0);
        ADD_RENDER(&s, scenes[i], 16, 32, 8);
    }
    ADD_POWER(&s, .name = "normal, 16; all pixels", NORMAL_16, .is_grey = true);
    ADD_POWER(&s, .name = "normal, 16; one tile of 16 x 16", NORMAL_16, .is_grey = true,
              .one_tile = true);
    ADD_POWER(&s, .name = "exponential, 64; all pixels", EXPONENTIAL_64, .is_grey = true);
    ADD_POWER(&s, .name = "exponential, 64; one tile of 16 x 16", EXPONENTIAL_64, .is_grey = true,
              .one_tile = true);
    ADD_POWER(&s, .name = "normal, 16; all pixels, margins 1 % and 4 %", NORMAL_16, .is_grey = true,
              .margin_global = 0.01, .margin_tile = 0.04);
    ADD_POWER(&s, .name = "normal, 16; all pixels, channels independent", NORMAL_16);
    for (size_t i = 0; i < 3; i++) {
        ADD_COVER(&s, LAW_NORMAL, 16, 16, interval_alpha[i]);
        ADD_COVER(&s, LAW_EXPONENTIAL, 64, 64, interval_alpha[i]);
        ADD_COVER(&s, LAW_BLACK, 64, 64, interval_alpha[i]);
        ADD_COVER(&s, LAW_LOGNORMAL, 64, 1024, interval_alpha[i]);
        ADD_COVER(&s, LAW_EXPONENTIAL, 1024, 0, interval_alpha[i]);
        ADD_MARGIN(&s, LAW_NORMAL, 16, margin_alpha[i], 0.03, 0.08);
        ADD_MARGIN(&s, LAW_EXPONENTIAL, 64, margin_alpha[i], 0.05, 0.15);
    }
    ADD_STAGES(&s, LAW_NORMAL, 16, 0.01);
    ADD_STAGES(&s, LAW_EXPONENTIAL, 64, 0.01);
    ADD_STAGES(&s, LAW_NORMAL, 16, 0.001);
    ADD_STAGES(&s, LAW_EXPONENTIAL, 64, 0.001);
    ADD_PERMUTATION(&s, LAW_NORMAL);
    ADD_PERMUTATION(&s, LAW_BLACK);
    ADD_PERMUTATION(&s, LAW_PARETO);
    return s;
}

struct settings settings_short(void)
{
    struct settings s = {
        .blocks = 4096,
        .synthetic_pairs = {400, 400, 0},
        .render_pairs = 60,
        .power_pairs = 800,
        .cover_pairs = 400,
        .margin_pairs = 300,
        .permutation_pairs = 1000,
    };
    ADD_SYNTHETIC(&s, LAW_NORMAL, 16, 16);
    ADD_SYNTHETIC(&s, LAW_EXPONENTIAL, 64, 64);
    ADD_SYNTHETIC(&s, LAW_BLACK, 64, 0);
    ADD_SYNTHETIC(&s, LAW_PARETO, 64, 0);
    add_tail(&s, LAW_EXPONENTIAL, 64, 64, 20000);
    ADD_RENDER(&s, "41_cornell", 16, 16, 0);
    ADD_POWER(&s, .name = "normal, 16; all pixels", .law = LAW_NORMAL, .n = 16, .side = 16,
              .is_grey = true, .is_short = true);
    ADD_COVER(&s, LAW_NORMAL, 16, 16, 0.005);
    ADD_MARGIN(&s, LAW_NORMAL, 16, 0.01, 0.03, 0.08);
    ADD_FLIPS(&s, LAW_PARETO, 4);
    return s;
}

void settings_hash(const struct settings *s, char hex[65])
{
    char *text = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    if (f == NULL)
        abort();
    fprintf(f, "blocks %zu\n", s->blocks);
    for (int i = 0; i < s->num_synthetic; i++) {
        const struct synthetic_cell *c = &s->synthetic[i];
        fprintf(f, "synthetic %s %d %d %ju\n", law_name[c->law], c->n_a, c->n_b,
                (uintmax_t)c->seed);
    }
    for (int l = 0; l < NUM_LEVELS; l++)
        fprintf(f, "%zu pairs at %g\n", s->synthetic_pairs[l], null_level[l]);
    for (int i = 0; i < s->num_tail; i++) {
        const struct synthetic_cell *c = &s->tail[i];
        fprintf(f, "tail %s %d %d %ju %zu\n", law_name[c->law], c->n_a, c->n_b, (uintmax_t)c->seed,
                s->tail_regions[i]);
    }
    for (int i = 0; i < s->num_render; i++) {
        const struct render_cell *c = &s->render[i];
        fprintf(f, "render %s %d %d %d %ju\n", c->scene, c->side, c->spp, c->replicates,
                (uintmax_t)c->seed);
    }
    for (int i = 0; i < s->num_power; i++) {
        const struct power_cell *c = &s->power[i];
        fprintf(f, "power %s %s %d %d %d %d %d %g %g %ju\n", c->name, law_name[c->law], c->n,
                c->side, c->is_grey, c->one_tile, c->is_short, c->margin_global, c->margin_tile,
                (uintmax_t)c->seed);
    }
    for (int i = 0; i < s->num_cover; i++) {
        const struct cover_cell *c = &s->cover[i];
        fprintf(f, "cover %s %d %d %g %ju\n", law_name[c->law], c->n_a, c->n_b, c->alpha,
                (uintmax_t)c->seed);
    }
    for (int i = 0; i < s->num_margin; i++) {
        const struct margin_cell *c = &s->margin[i];
        fprintf(f, "margin %s %d %g %g %g %ju\n", law_name[c->law], c->n, c->alpha,
                c->margin_global, c->margin_tile, (uintmax_t)c->seed);
    }
    for (int i = 0; i < s->num_stages; i++) {
        const struct stages_cell *c = &s->stages[i];
        fprintf(f, "stages %s %d %g %ju\n", law_name[c->law], c->n, c->alpha, (uintmax_t)c->seed);
    }
    for (int i = 0; i < s->num_permutation; i++) {
        const struct permutation_cell *c = &s->permutation[i];
        fprintf(f, "permutation %s %ju\n", law_name[c->law], (uintmax_t)c->seed);
        if (c->draws > 0)
            fprintf(f, "of flips, %d draws\n", c->draws);
    }
    fprintf(f, "pairs %zu %zu %zu %zu %zu %zu\n", s->render_pairs, s->power_pairs, s->cover_pairs,
            s->margin_pairs, s->stages_pairs, s->permutation_pairs);
    fclose(f);
    sha256_text(text, hex);
    free(text);
}

double calibrate_cost(const struct settings *s)
{
    double sum = 0;
    for (int i = 0; i < s->num_synthetic; i++)
        sum += synthetic_cost(&s->synthetic[i], s->synthetic_pairs);
    for (int i = 0; i < s->num_tail; i++)
        sum += tail_cost(&s->tail[i], s->tail_regions[i]);
    for (int i = 0; i < s->num_render; i++)
        sum += render_cost(&s->render[i], s->render_pairs);
    for (int i = 0; i < s->num_power; i++)
        sum += power_cost(&s->power[i], s->power_pairs);
    for (int i = 0; i < s->num_cover; i++)
        sum += cover_cost(&s->cover[i], s->cover_pairs);
    for (int i = 0; i < s->num_margin; i++)
        sum += margin_cost(&s->margin[i], s->margin_pairs);
    for (int i = 0; i < s->num_stages; i++)
        sum += stages_cost(&s->stages[i], s->stages_pairs);
    sum += s->num_permutation * permutations_cost(s->permutation_pairs);
    return sum;
}

bool calibrate(struct work *w, const struct settings *s, const char *scenes, enum weakness weakness,
               struct results *out, struct err *e)
{
    *out = (struct results){0};
    bool ok = true;
    for (int i = 0; ok && i < s->num_render; i++)
        ok = render_run(w, scenes, &s->render[i], weakness, s->render_pairs, &out->render[i], e);
    for (int i = 0; ok && i < s->num_power; i++)
        ok = power_run(w, &s->power[i], weakness, s->power_pairs, s->blocks, &out->power[i], e);
    for (int i = 0; ok && i < s->num_cover; i++)
        ok = cover_run(w, &s->cover[i], weakness, s->cover_pairs, s->blocks, &out->cover[i], e);
    for (int i = 0; ok && i < s->num_margin; i++)
        ok = margin_run(w, &s->margin[i], weakness, s->margin_pairs, s->blocks, &out->margin[i], e);
    for (int i = 0; ok && i < s->num_stages; i++)
        ok = stages_run(w, &s->stages[i], s->stages_pairs, s->blocks, &out->stages[i], e);
    for (int i = 0; ok && i < s->num_permutation; i++)
        ok = permutations_run(w, &s->permutation[i], s->permutation_pairs, &out->permutation[i], e);
    for (int i = 0; ok && i < s->num_tail; i++)
        ok = tail_run(w, &s->tail[i], s->tail_regions[i], s->blocks, &out->tail[i], e);
    for (int i = 0; ok && i < s->num_synthetic; i++)
        ok = synthetic_run(w, &s->synthetic[i], weakness, s->synthetic_pairs, s->blocks,
                           &out->synthetic[i], e);
    return ok;
}

void calibrate_check(const struct settings *s, const struct results *r, struct checks *c)
{
    struct null_result pooled;
    for (int i = 0; i < s->num_render; i++)
        null_check(&r->render[i], c);
    null_pool(r->render, s->num_render, "renders", &pooled);
    null_check(&pooled, c);
    for (int i = 0; i < s->num_synthetic; i++)
        null_check(&r->synthetic[i], c);
    for (int i = 0; i < s->num_tail; i++)
        tail_check(&r->tail[i], c);
    for (int i = 0; i < s->num_power; i++)
        power_check(&r->power[i], c);
    for (int i = 0; i < s->num_cover; i++)
        cover_check(&r->cover[i], c);
    for (int i = 0; i < s->num_margin; i++)
        margin_check(&r->margin[i], c);
    for (int i = 0; i < s->num_stages; i++)
        stages_check(&r->stages[i], c);
    for (int i = 0; i < s->num_permutation; i++)
        permutations_check(&r->permutation[i], c);
}
