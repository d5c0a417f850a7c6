/* Whole images: the samplers agree, threads change nothing, and the counts are right. */
#include "tests/support/render_check.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

enum { WIDTH = 40, HEIGHT = 30 };

static struct scene room(void)
{
    struct scene s = build_room(10);
    check_finish(&s);
    return s;
}

struct how {
    struct sampler sampler;
    enum bvh_kind accel;
    int bounces, spp, threads;
};

static struct moments image(const struct scene *s, struct how how, struct render_stats *stats)
{
    struct err e = {0};
    struct camera c;
    MUST(camera_init(&c, s, WIDTH, HEIGHT, &e));
    struct render_options o = {.integrator = check_options(DIRECT_MIS, how.bounces, 0),
                               .width = WIDTH,
                               .height = HEIGHT,
                               .num_samples = (uint32_t)how.spp,
                               .threads = how.threads};
    o.integrator.sampler = how.sampler;
    return check_render_all(s, &c, &o, how.accel, stats);
}

static bool same_bits(const struct moments *a, const struct moments *b)
{
    size_t n = (size_t)a->width * (size_t)a->height;
    return memcmp(a->n, b->n, n * sizeof *a->n) == 0 &&
           memcmp(a->mean, b->mean, 3 * n * sizeof *a->mean) == 0 &&
           memcmp(a->m2, b->m2, 3 * n * sizeof *a->m2) == 0 &&
           memcmp(a->m3, b->m3, 3 * n * sizeof *a->m3) == 0;
}

/* The same image, and the same rays and tests counted, by 1, 2 and 7 threads: every ray is traced
 * once whoever does it, so the sums over threads have to be those of one thread, to the last ray. */
TEST(threads_change_nothing)
{
    OWN(scene) s = room();
    for (int sampler = SAMPLER_INDEPENDENT; sampler <= SAMPLER_SOBOL; sampler++)
        for (int accel = BVH_BRUTE_FORCE; accel <= BVH_WIDE; accel++) {
            struct how how = {{(enum sampler_kind)sampler, 3}, (enum bvh_kind)accel, 4, 4, 1};
            struct render_stats one, many;
            OWN(moments) a = image(&s, how, &one);
            for (how.threads = 2; how.threads <= 7; how.threads += 5) {
                OWN(moments) b = image(&s, how, &many);
                assert_true(same_bits(&a, &b));
                assert_true(one.rays.rays == many.rays.rays);
                assert_true(one.rays.box_tests == many.rays.box_tests);
                assert_true(one.rays.primitive_tests == many.rays.primitive_tests);
                assert_true(one.samples == many.samples);
            }
            /* Negative control: another seed is another image with other counts. */
            how.sampler.seed++;
            OWN(moments) b = image(&s, how, &many);
            assert_false(same_bits(&a, &b));
            assert_true(one.rays.rays != many.rays.rays);
        }
}

/* What can be counted by hand: with no bounce there is one ray per path, and brute force tests each
 * of the primitives (11: ten triangles and a ball) for each. A hierarchy tests the root for all. */
TEST(counts_are_right)
{
    OWN(scene) s = room();
    struct render_stats stats;
    for (int accel = BVH_BRUTE_FORCE; accel <= BVH_SAH; accel++) {
        struct how how = {{SAMPLER_INDEPENDENT, 3}, (enum bvh_kind)accel, 0, 3, 2};
        struct moments m = image(&s, how, &stats);
        moments_free(&m);
        assert_true(stats.rays.rays == WIDTH * HEIGHT * 3);
        assert_true(stats.samples == WIDTH * HEIGHT * 3);
        if (accel == BVH_BRUTE_FORCE) {
            assert_true(stats.rays.primitive_tests == stats.rays.rays * 11);
            assert_true(stats.rays.box_tests == 0);
        } else {
            assert_true(stats.rays.primitive_tests < stats.rays.rays * 11);
            assert_true(stats.rays.box_tests >= stats.rays.rays);
        }
    }
}

/* Renders `count` replicates with different seeds: *mean is the mean of their image means, *var the variance of
 * that mean. */
static void replicates(const struct scene *s, struct how how, int count, double *mean, double *var)
{
    double m2 = 0;
    *mean = 0;
    for (int k = 0; k < count; k++) {
        how.sampler.seed++;
        OWN(moments) m = image(s, how, NULL);
        double sum = 0;
        for (size_t i = 0; i < WIDTH * HEIGHT * 3; i++)
            sum += m.mean[i] / (WIDTH * HEIGHT * 3);
        double d = sum - *mean;
        *mean += d / (k + 1);
        m2 += d * (sum - *mean);
    }
    *var = m2 / (count - 1) / count;
}

/* H0: Sobol and independent samples have the same mean. Welch's t of 32 replicates each, 16 samples;
 * |t| < 6.2, which has p = 7e-7 (two-sided) at 31 degrees of freedom, Welch's least number here; one fixed
 * set of seeds. The relative standard error is about 0.25 %, so 2 % (t = 8) is found with power 0.96. */
TEST(samplers_agree)
{
    OWN(scene) s = room();
    struct how how = {{SAMPLER_INDEPENDENT, 100}, BVH_SAH, 3, 16, 2};
    double mean[3], var[3];
    replicates(&s, how, 32, &mean[0], &var[0]);
    how.sampler = (struct sampler){SAMPLER_SOBOL, 200};
    replicates(&s, how, 32, &mean[1], &var[1]);
    double t = (mean[1] - mean[0]) / sqrt(var[0] + var[1]);
    print_message("independent %.6g +- %.2g, Sobol %.6g +- %.2g, t = %.2f\n", mean[0], sqrt(var[0]),
                  mean[1], sqrt(var[1]), t);
    assert_true(fabs(t) < 6.2);
    /* Negative control: a bounce less. */
    how.bounces--;
    replicates(&s, how, 32, &mean[2], &var[2]);
    assert_true(fabs((mean[2] - mean[0]) / sqrt(var[0] + var[2])) > 6.2);
}

/* Sum over pixels and channels of the variance, estimated from two images with different seeds. */
static double noise(const struct scene *s, struct how how)
{
    OWN(moments) a = image(s, how, NULL);
    how.sampler.seed += 50;
    OWN(moments) b = image(s, how, NULL);
    double sum = 0;
    for (size_t i = 0; i < WIDTH * HEIGHT * 3; i++)
        sum += (a.mean[i] - b.mean[i]) * (a.mean[i] - b.mean[i]) / 2;
    return sum;
}

/* Direct light at 64 samples: 3600 pixel channels, so the ratio of two such sums is known to about
 * 10 % even where a tenth of the pixels has most of the noise. Sobol has to have less than half, and
 * independent samples with another seed neither half nor twice (negative control). The moments of Sobol
 * images are marked "stratified": their M2 gives no standard error. */
TEST(sobol_has_less_noise)
{
    OWN(scene) s = room();
    struct how how = {{SAMPLER_INDEPENDENT, 1}, BVH_SAH, 1, 64, 2};
    double independent = noise(&s, how);
    how.sampler.seed = 2;
    double again = noise(&s, how);
    how.sampler.kind = SAMPLER_SOBOL;
    double sobol = noise(&s, how);
    print_message("noise of Sobol over independent: %.3f\n", sobol / independent);
    assert_true(sobol < independent / 2);
    assert_true(again > independent / 2 && again < independent * 2);
    struct moments m = image(&s, how, NULL);
    assert_string_equal(m.unit, "stratified");
    assert_true(isnan(moments_var_of_mean(&m, 0, 0)));
    moments_free(&m);
    how.sampler.kind = SAMPLER_INDEPENDENT;
    m = image(&s, how, NULL);
    assert_string_equal(m.unit, "sample");
    assert_false(isnan(moments_var_of_mean(&m, 0, 0)));
    moments_free(&m);
}
