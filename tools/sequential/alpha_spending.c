#include "alpha_spending.h"

#include "two_stage.h"

#include <assert.h>
#include <math.h>

const struct alpha_spending alpha_spending_single = {{0, 0, 0, 0, 1, 0, 0, 0}};
const struct alpha_spending alpha_spending_declared = {{.02, .04, .06, .08, .80, 0, 0, 0}};
const struct alpha_spending alpha_spending_open = {{.02, .04, .06, .08, .60, .10, .05, .025}};

static const double size[NUM_LOOKS] = {1.0 / 64, 1.0 / 16, 1.0 / 4, 1.0 / 2, 1, 2, 4, 8};

int alpha_spending_count(int look, int declared, int least)
{
    assert(look >= 0 && look < NUM_LOOKS && declared > 0);
    double n = floor(declared * size[look]);
    if (look < LOOK_DECLARED && n < least)
        return 0;
    return n < 1 << 24 ? (int)n : 1 << 24;
}

/* An image without any noise is the same for every seed. */
static bool check_fresh(const struct moments *m, const struct moments *again, const char *side,
                        struct err *e)
{
    size_t values = 3 * (size_t)m->width * (size_t)m->height;
    for (size_t i = 0; i < values; i++)
        if (m->m2[i] > 0)
            return two_stage_check_fresh(m, again, e) || err_prefix(e, "%s", side);
    return true;
}

bool alpha_spending_judge(const struct alpha_spending *q, int look, int stages,
                          const struct compare_options *opt, alpha_spending_pair pair, void *ctx,
                          struct comparison *out, int *stage, struct err *e)
{
    struct compare_options o = *opt;
    const struct moments *a, *b, *a2, *b2;
    struct comparison first;
    assert(q->share[look] > 0 && (stages == 1 || stages == 2));
    o.alpha *= q->share[look];
    *stage = 0;
    if (!pair(ctx, 0, &a, &b, e))
        return false;
    if (stages == 1)
        return compare_moments(a, b, &o, out, e);
    if (!two_stage_first(a, b, &o, &first, e))
        return false;
    if (first.verdict != VERDICT_DIFFERENT) {
        *out = first;
        return true;
    }
    *stage = 1;
    bool ok = pair(ctx, 1, &a2, &b2, e) && check_fresh(a, a2, "A", e) &&
              check_fresh(b, b2, "B", e) && two_stage_confirm(&first, a2, b2, &o, out, e);
    comparison_free(&first);
    return ok;
}
