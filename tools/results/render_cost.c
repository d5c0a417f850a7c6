#include "render_cost.h"

#include "reference/suite/engine_table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COSTS_ON_A_LINE = 5 };

static struct scene_cost *entry(struct scene_cost *out, int *num, const char *scene)
{
    for (int i = 0; i < *num; i++)
        if (strcmp(out[i].scene, scene) == 0)
            return &out[i];
    if (*num == MAX_COSTS)
        return NULL;
    out[*num] = (struct scene_cost){.scene = scene};
    return &out[(*num)++];
}

static double total(const struct scene_cost *c)
{
    return c->ours_s + c->references_s;
}

static int by_total(const void *a, const void *b)
{
    const struct scene_cost *x = a, *y = b;
    return total(x) != total(y) ? (total(x) < total(y)) - (total(x) > total(y))
                                : strcmp(x->scene, y->scene);
}

int render_cost_gather(const json_t *results, struct scene_cost out[MAX_COSTS])
{
    int num = 0;
    json_each(c, json_object_get(results, "claims")) {
        const json_t *cost = json_object_get(c, "cost_s"), *looks = json_object_get(c, "looks");
        struct scene_cost *e = cost != NULL ? entry(out, &num, member_text(c, "scene")) : NULL;
        if (e == NULL)
            continue;
        bool is_probe = engine_with_goldens(member_text(c, "a")) != NULL;
        *(is_probe ? &e->references_s : &e->ours_s) += member_number(cost, "a");
        bool is_ours = strcmp(member_text(c, "b"), "pathtracer") == 0;
        *(is_ours ? &e->ours_s : &e->references_s) += member_number(cost, "b");
        e->claims++;
        e->looks += (int)json_array_size(looks);
        e->undecided +=
            results_claim_lacks_time(c) || results_claim_outcome(c) == OUTCOME_UNDECIDED;
        json_each(look, looks)
            e->largest_n = fmax(e->largest_n, is_probe ? 0 : member_number(look, "n_a"));
    }
    for (struct results_walk w = {.results = results, .kind = JUDGED_STATED_ERROR};
         results_next(&w) && w.kind != JUDGED_CONVERGENCE;) {
        struct scene_cost *e = entry(out, &num, w.scene);
        if (e != NULL)
            e->ours_s += member_number(w.json, "seconds");
    }
    qsort(out, (size_t)num, sizeof *out, by_total);
    return num;
}

void render_cost_print(FILE *f, const json_t *results)
{
    static const char *const format[] = {"%.2f", "%.1f", "%.0f"};
    struct scene_cost cost[MAX_COSTS];
    int num = render_cost_gather(results, cost);
    double sum = 0;
    for (int i = 0; i < num; i++)
        sum += total(&cost[i]);
    if (sum <= 0)
        return;
    fputs("cost:", f);
    for (int i = 0; i < num && i < COSTS_ON_A_LINE; i++) {
        char text[32];
        snprintf(text, sizeof text, format[(total(&cost[i]) >= 1) + (total(&cost[i]) >= 10)],
                 total(&cost[i]));
        fprintf(f, "%s %s %s s", i > 0 ? "," : "", cost[i].scene, text);
        if (i == 0)
            fprintf(f, " of %.3g s", sum);
        if (cost[i].undecided > 0)
            fprintf(f, " (%d undecided)", cost[i].undecided);
    }
    fprintf(f, "%s of processor time\n", num > COSTS_ON_A_LINE ? ", ..." : "");
}
