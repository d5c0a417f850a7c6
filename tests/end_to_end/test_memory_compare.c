/* Every allocation fails in turn in what compares: statistics, tests, FLIP. Results are
 * held against those with memory enough. */
#include "tests/support/alloc_fail.h"
#include "tests/support/simulate.h"

#include "tools/compare/compare.h"
#include "tools/stats/stated_error.h"
#include "tools/stats/sample_efficiency.h"
#include "tools/images/flip.h"
#include "tools/sequential/two_stage.h"
#include "tools/compare/permutation.h"
#include "tools/compare/pyramid.h"
#include "tools/images/replicate_dir.h"
#include "tools/stats/noise_estimate.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 32, RENDERS = 4 };

struct pair {
    struct moments a, b, a2, b2;
    struct compare_options opt;
    struct comparison first; /* by two_stage_first() */
    double sum;              /* of what came out with memory enough; 0: not known yet */
};

static void hold(double *right, double sum)
{
    if (*right == 0)
        *right = sum;
    assert_true(sum == *right);
}

static double comparison_sum(const struct comparison *c)
{
    double sum = 1 + (double)c->verdict + c->num_tests + c->rms_bias + c->direction.explained;
    for (int s = 0; s < NUM_STATISTICS; s++)
        sum += (s + 1) * c->statistic[s].log10_p;
    for (int i = 0; i < c->tiles_x * c->tiles_y; i++)
        sum += (i + 1) * c->tile_t[i];
    for (int i = 0; i < SIDE * SIDE; i++)
        sum += c->z.data[i] + c->relative.data[i];
    return sum;
}

static bool finish_comparison(struct pair *p, struct comparison *c, bool ok)
{
    alloc_fail_off();
    if (ok) {
        hold(&p->sum, comparison_sum(c));
        comparison_free(c);
    }
    return ok;
}

static bool compare(void *ctx, struct err *e)
{
    struct pair *p = ctx;
    struct comparison c = {0};
    return finish_comparison(p, &c, compare_moments(&p->a, &p->b, &p->opt, &c, e));
}

static bool first_stage(void *ctx, struct err *e)
{
    struct pair *p = ctx;
    struct comparison c = {0};
    return finish_comparison(p, &c, two_stage_first(&p->a, &p->b, &p->opt, &c, e));
}

static bool second_stage(void *ctx, struct err *e)
{
    struct pair *p = ctx;
    struct comparison c = {0};
    return finish_comparison(p, &c, two_stage_confirm(&p->first, &p->a2, &p->b2, &p->opt, &c, e));
}

static bool sums_of_regions(void *ctx, struct err *e)
{
    struct pair *p = ctx;
    struct pyramid s = {0};
    bool ok = pyramid_build(&p->a, &p->b, CHANNEL_LUMINANCE, 8, &s, e);
    alloc_fail_off();
    if (ok) {
        hold(&p->sum, s.level[s.num_levels - 1].cell[0].a);
        pyramid_free(&s);
    }
    return ok;
}

static struct moments drawn(double scale, uint64_t seed)
{
    struct moments m = new_moments(SIDE, SIDE, "sample");
    simulate(&m, LAW_EXPONENTIAL, scale, 16, false, &seed);
    return m;
}

static void comparisons(void **state)
{
    (void)state;
    struct err e;
    struct pair p = {.a = drawn(1.2, 1),
                     .b = drawn(1, 2),
                     .a2 = drawn(1.2, 3),
                     .b2 = drawn(1, 4),
                     .opt = {.alpha = 1e-3, .margin_global = 0.01, .margin_tile = 0.05, .tile = 8}};
    alloc_fail_each("pyramid_build", ALLOC_ALL, sums_of_regions, &p);
    p.sum = 0;
    alloc_fail_each("compare_moments", ALLOC_ALL, compare, &p);
    p.sum = 0;
    alloc_fail_each("gate_first", ALLOC_ALL, first_stage, &p);
    assert_true(two_stage_first(&p.a, &p.b, &p.opt, &p.first, &e));
    assert_int_equal(p.first.verdict, VERDICT_DIFFERENT);
    p.sum = 0;
    alloc_fail_each("gate_confirm", ALLOC_ALL, second_stage, &p);
    comparison_free(&p.first);
    moments_free(&p.a);
    moments_free(&p.b);
    moments_free(&p.a2);
    moments_free(&p.b2);
}

/* Nothing of a side may have changed where it fails, or the caller could not try again. */
static bool spatial(void *ctx, struct err *e)
{
    struct pair *p = ctx;
    struct noise_estimate s;
    alloc_fail_off();
    struct moments a = drawn(1, 1), b = drawn(1, 2);
    alloc_fail_on();
    bool ok = noise_estimate_variance(&a, &b, NULL, NULL, NULL, &s, e);
    alloc_fail_off();
    if (ok)
        hold(&p->sum, a.m2[77] + s.factor[1]);
    moments_free(&a);
    moments_free(&b);
    return ok;
}

struct replicates {
    struct replicate_dir a, b;
    struct moments render[RENDERS];
    double variance[3 * SIDE * SIDE];
    double sum;
};

static bool permute(void *ctx, struct err *e)
{
    struct replicates *r = ctx;
    const struct permutation_options opt = {.alpha = 0.05};
    struct permutation first, second;
    bool ok = permutation_test(&r->a, &r->b, &opt, &first, e) &&
              permutation_confirm(&first, &r->a, &r->b, &opt, &second, e);
    alloc_fail_off();
    if (ok)
        hold(&r->sum, first.p + first.t + second.t);
    return ok;
}

static bool judge_consistency(void *ctx, struct err *e)
{
    struct replicates *r = ctx;
    struct stated_error c;
    struct sample_efficiency f;
    bool ok = stated_error_judge(r->render, RENDERS, 0.2, 1e-3, &c, e) &&
              sample_efficiency_judge(r->render, RENDERS, 16, r->variance, 0.2, 1e-3, &f, e);
    alloc_fail_off();
    if (ok)
        hold(&r->sum, c.pixels + c.image + f.ratio);
    return ok;
}

static float *pictures[RENDERS];

static void replicates(void **state)
{
    (void)state;
    struct pair p = {.sum = 0};
    static char *name[] = {"0", "1", "2", "3"};
    static struct replicates r;
    uint64_t seed = 9;
    float *values = calloc(2 * RENDERS, sizeof *values * 3 * SIDE * SIDE);
    assert_non_null(values);
    for (int i = 0; i < 2 * RENDERS * 3 * SIDE * SIDE; i++)
        values[i] = (float)draw(LAW_EXPONENTIAL, &seed);
    float *more[RENDERS];
    for (int k = 0; k < RENDERS; k++) {
        pictures[k] = values + k * 3 * SIDE * SIDE;
        more[k] = values + (RENDERS + k) * 3 * SIDE * SIDE;
        r.render[k] = drawn(1, 20 + (uint64_t)k);
    }
    for (int i = 0; i < 3 * SIDE * SIDE; i++)
        r.variance[i] = 1;
    r.a = (struct replicate_dir){RENDERS, SIDE, SIDE, pictures, name};
    r.b = (struct replicate_dir){RENDERS, SIDE, SIDE, more, name};
    alloc_fail_each("spatial_variance", ALLOC_ALL, spatial, &p);
    alloc_fail_each("permutation_test, permutation_confirm", ALLOC_ALL, permute, &r);
    r.sum = 0;
    alloc_fail_each("consistency_judge, sample_efficiency_judge", ALLOC_ALL, judge_consistency, &r);
    for (int k = 0; k < RENDERS; k++)
        moments_free(&r.render[k]);
    free(values);
}

static bool see(void *ctx, struct err *e)
{
    double *right = ctx;
    static double reference[3 * SIDE * SIDE], test[3 * SIDE * SIDE];
    static float low[SIDE * SIDE], high[SIDE * SIDE];
    struct flip_exposures exposures;
    for (int i = 0; i < 3 * SIDE * SIDE; i++) {
        reference[i] = (i * 7 % 11) / 10.0;
        test[i] = (i * 5 % 13) / 12.0;
    }
    bool ok = flip_ldr(reference, test, SIDE, SIDE, FLIP_PPD, low, e) &&
              flip_exposures(reference, SIDE * SIDE, &exposures, e) &&
              flip_hdr(reference, test, SIDE, SIDE, FLIP_PPD, &exposures, high, e);
    alloc_fail_off();
    if (ok)
        hold(right, flip_mean(low, SIDE * SIDE) + flip_mean(high, SIDE * SIDE));
    return ok;
}

static void flip(void **state)
{
    (void)state;
    double right = 0;
    alloc_fail_each("flip_ldr, flip_exposures, flip_hdr", ALLOC_ALL, see, &right);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(comparisons, alloc_fail_tell),
        cmocka_unit_test_teardown(replicates, alloc_fail_tell),
        cmocka_unit_test_teardown(flip, alloc_fail_tell),
    };
    return cmocka_run_group_tests(tests, NULL, alloc_fail_sum);
}
