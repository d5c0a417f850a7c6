#include "calibrate_pairs.h"

struct parts {
    size_t pairs, each;
    pairs_part *part;
    void *arg;
    double (*count)[PAIR_COUNTS]; /* one a part */
};

static bool run_part(void *arg, int part, struct err *e)
{
    struct parts *p = arg;
    size_t first = (size_t)part * p->each, end = first + p->each;
    return p->part(p->arg, part, first, end < p->pairs ? end : p->pairs, p->count[part], e);
}

bool pairs_run(struct work *w, size_t pairs, size_t each, double cost, pairs_part *part, void *arg,
               double count[PAIR_COUNTS], struct err *e)
{
    int num = (int)((pairs + each - 1) / each);
    struct parts p = {pairs, each, part, arg, calloc((size_t)num, sizeof *p.count)};
    if (p.count == NULL)
        return err_set(e, "out of memory for %d parts", num);
    bool ok = work_run(w, num, cost / num, run_part, &p, e);
    for (int k = 0; k < PAIR_COUNTS; k++) {
        count[k] = 0;
        for (int i = 0; i < num; i++)
            count[k] += p.count[i][k];
    }
    free(p.count);
    return ok;
}

uint64_t pairs_seed(uint64_t seed, int part)
{
    return (seed << 20) + 1000003u * (uint64_t)(part + 1);
}

static bool synthetic_part(void *arg, int part, size_t first, size_t end, double count[PAIR_COUNTS],
                           struct err *e)
{
    const struct synthetic_pairs *of = arg;
    struct library library;
    uint64_t seed =
        (of->seed_of != NULL ? of->seed_of : pairs_seed)(of->seed, of->first_part + part);
    if (!library_init(&library, of->law, pairs_block(of->n), of->blocks, seed, e))
        return false;
    struct moments a = new_moments(of->side, of->side, "sample");
    struct moments b = new_moments(of->side, of->side, of->is_exact ? "exact" : "sample");
    bool ok = true;
    for (size_t i = first; ok && i < end; i++)
        ok = of->pair(of->arg, &library, i, &a, &b, count, e);
    moments_free(&a);
    moments_free(&b);
    library_free(&library);
    return ok;
}

bool synthetic_pairs_run(struct work *w, const struct synthetic_pairs *of, size_t pairs,
                         size_t each, double cost, double count[PAIR_COUNTS], struct err *e)
{
    return pairs_run(w, pairs, each, cost, synthetic_part, (void *)of, count, e);
}
