/* The random function and the warps. */
#include "renderer/math/sampler.h"
#include "renderer/math/warp.h"
#include "tests/support/test.h"

#include <gsl/gsl_cdf.h>

/* Known answers of the generator's authors (Random123, file kat_vectors) [Salmon11]. */
TEST(known_answers)
{
    static const struct {
        int rounds;
        uint32_t counter[4], key[2], expected[4];
    } kat[] = {
        {10, {0, 0, 0, 0}, {0, 0}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
        {10,
         {0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff},
         {0xffffffff, 0xffffffff},
         {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
        {10,
         {0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344},
         {0xa4093822, 0x299f31d0},
         {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
    };
    for (size_t i = 0; i < sizeof kat / sizeof kat[0]; i++) {
        uint32_t out[4];
        sampler_philox4x32(kat[i].counter, kat[i].key, kat[i].rounds, out);
        assert_memory_equal(out, kat[i].expected, sizeof out);
    }
}

/* Every index matters, and the numbers stay inside [0, 1). */
TEST(every_index_matters)
{
    struct sample4 a = sampler_get(7, 1, 2, 3, 4);
    const struct sample4 others[5] = {sampler_get(8, 1, 2, 3, 4), sampler_get(7, 0, 2, 3, 4),
                                      sampler_get(7, 1, 0, 3, 4), sampler_get(7, 1, 2, 0, 4),
                                      sampler_get(7, 1, 2, 3, 0)};
    for (int i = 0; i < 5; i++)
        assert_memory_not_equal(&a, &others[i], sizeof a);
    struct sample4 high = sampler_get(7 + (1ull << 32), 1, 2, 3, 4);
    assert_memory_not_equal(&a, &high, sizeof a);
    for (uint32_t i = 0; i < 100000; i++) {
        struct sample4 s = sampler_get(1, i, 0, 0, 0);
        for (int k = 0; k < 4; k++)
            assert_true(s.u[k] >= 0 && s.u[k] < 1);
    }
}

enum { BINS_A = 10, BINS_B = 20, BINS = BINS_A * BINS_B, SAMPLES = 1000000 };

/* H0: the warp has its density. alpha = 1e-6 for each of the tests of this file, n = 1e6, fixed
 * seed, no retry. All bins are made equally likely, so each expects 5000 and chi-square is exact
 * enough; a density 1 % too high in half the bins and 1 % too low in the others adds 100 to
 * chi-square, which is 199 +- 20 under H0. */
static double chi2_p(const double *count)
{
    double chi2 = 0, expected = (double)SAMPLES / BINS;
    for (int i = 0; i < BINS; i++)
        chi2 += (count[i] - expected) * (count[i] - expected) / expected;
    return gsl_cdf_chisq_Q(chi2, BINS - 1);
}

static int bin(double x, int n)
{
    int i = (int)(x * n);
    return i < 0 ? 0 : i >= n ? n - 1 : i;
}

static double turn(double x, double y)
{
    double phi = atan2(y, x) / (2 * M_PI);
    return phi < 0 ? phi + 1 : phi;
}

enum warp { COSINE, UNIFORM, SPHERE, CONE, DISK, TRIANGLE, NUM_WARPS };

/* *a, *b: uniform on the unit square if the density is what warp.h says: the cumulative
 * distribution function of the height (in closed form), and the azimuth in turns. */
static void unwarp(enum warp w, const float u[4], double *a, double *b)
{
    const float omc = 0.03f;
    float x, y;
    vec3 d = {0};
    switch (w) {
    case COSINE:
        d = warp_cosine_hemisphere(u[0], u[1]);
        *a = 1 - (double)d.z * d.z;
        break;
    case UNIFORM:
        d = warp_uniform_hemisphere(u[0], u[1]);
        *a = 1 - d.z;
        break;
    case SPHERE:
        d = warp_uniform_sphere(u[0], u[1]);
        *a = (1 - (double)d.z) / 2;
        break;
    case CONE:
        d = warp_uniform_cone(u[0], u[1], omc);
        *a = (1 - (double)d.z) / omc;
        break;
    case DISK:
        warp_disk(u[0], u[1], &x, &y);
        *a = (double)x * x + (double)y * y;
        *b = turn(x, y);
        return;
    case TRIANGLE: /* P(b1 < t) = 1-(1-t)^2, and b2 uniform in [0, 1-b1] */
        warp_triangle(u[0], u[1], &x, &y);
        *a = 1 - (1 - (double)x) * (1 - (double)x);
        *b = y / (1 - (double)x);
        return;
    case NUM_WARPS: break;
    }
    assert_true(fabs((double)dot(d, d) - 1) < 1e-5);
    *b = turn(d.x, d.y);
}

TEST(warps_have_their_density)
{
    for (enum warp w = COSINE; w < NUM_WARPS; w++) {
        double count[BINS] = {0};
        for (uint32_t i = 0; i < SAMPLES; i++) {
            struct sample4 s = sampler_get(20260102, i, 0, (uint32_t)w, 0);
            double a, b;
            unwarp(w, s.u, &a, &b);
            count[bin(a, BINS_A) * BINS_B + bin(b, BINS_B)]++;
        }
        double p = chi2_p(count);
        if (p < 1e-6)
            fail_msg("warp %d: p = %g", (int)w, p);
    }
}

/* Negative control: uniform directions taken for cosine ones are found out. */
TEST(wrong_density_is_rejected)
{
    double count[BINS] = {0};
    for (uint32_t i = 0; i < SAMPLES; i++) {
        struct sample4 s = sampler_get(20260102, i, 0, 0, 0);
        vec3 d = warp_uniform_hemisphere(s.u[0], s.u[1]);
        count[bin(1 - (double)d.z * d.z, BINS_A) * BINS_B + bin(turn(d.x, d.y), BINS_B)]++;
    }
    assert_true(chi2_p(count) < 1e-6);
}

/* Pairs of neighbouring pixels, samples, vertices and purposes fill the square evenly: H0 no
 * dependence between streams, same test. */
TEST(streams_are_independent)
{
    for (uint32_t which = 0; which < 4; which++) {
        double count[BINS] = {0};
        for (uint32_t i = 0; i < SAMPLES; i++) {
            struct sample4 s = sampler_get(3, i, 5, 1, 1);
            struct sample4 t = sampler_get(3, i + (which == 0), 5 + (which == 1), 1 + (which == 2),
                                           1 + (which == 3));
            count[bin(s.u[0], BINS_A) * BINS_B + bin(t.u[0], BINS_B)]++;
        }
        assert_true(chi2_p(count) > 1e-6);
    }
}
