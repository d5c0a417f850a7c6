#include "calibrate.h"

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
