/* Environments by themselves: where a map's texels are in the sky, whether sampled directions have the pdf
 * that is returned, which files are accepted. */
#include "renderer/math/discrete.h"
#include "renderer/scene/environment_simd.h"
#include "renderer/math/sampler.h"
#include "renderer/math/warp.h"
#include "tests/support/sky.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <gsl/gsl_cdf.h>

/* All 2^24 numbers of the sampler are counted: each thing is picked as often as it says. */
TEST(choice_is_exact)
{
    enum { N = 7 };
    const double weight[N] = {0, 1e-12, 3, 0, 1, 1e-30, 0};
    uint32_t end[N];
    uint32_t *count = calloc(N, sizeof *count);
    assert_non_null(count);
    assert_true(fabs(discrete_build(weight, N, end) - 4) < 1e-9);
    for (uint32_t step = 0; step < DISCRETE_STEPS; step++)
        count[discrete_pick(end, N, (float)step / DISCRETE_STEPS)]++;
    for (uint32_t i = 0; i < N; i++) {
        assert_true(discrete_probability(end, i) == (float)count[i] / DISCRETE_STEPS);
        assert_int_equal(count[i] > 0, weight[i] > 0);
        assert_true(fabs(count[i] / (double)DISCRETE_STEPS - weight[i] / 4) < 1e-6);
    }
    free(count);
    const double nothing[2] = {0, 0};
    assert_true(discrete_build(nothing, 2, end) == 0);
    assert_int_equal(end[1], 0);
}

/* The left edge of the map is -X, and columns go from there by +Z, +X and -Z. 4 x 2 texels, so the
 * middle of column 0 faces between -X and +Z, at 45 degrees above the horizon in row 0; towards an
 * axis all texels around it have equal parts. */
TEST(orientation)
{
    const struct sky s = {.width = 4, .height = 2, .value = {1, 2, 4, 8, 16, 32, 64, 128}};
    static const float signs[4][2] = {{-1, 1}, {1, 1}, {1, -1}, {-1, -1}}; /* of x and z */
    static const struct {
        float x, z;
        int left, right;
    } horizon[4] = {{-1, 0, 3, 0}, {0, 1, 0, 1}, {1, 0, 1, 2}, {0, -1, 2, 3}};
    struct environment *env = sky_environment(&s);
    for (int row = 0; row < 2; row++)
        for (int c = 0; c < 4; c++) {
            vec3 w =
                v3(0.5f * signs[c][0], row == 0 ? 0.70710678f : -0.70710678f, 0.5f * signs[c][1]);
            rgb le = environment_radiance(env, w);
            float expected = s.value[4 * row + c];
            assert_true(fabsf(le.r - expected) < 1e-4f * 128);
            assert_true(fabsf(le.b - 3 * expected) < 3e-4f * 128);
        }
    for (int k = 0; k < 4; k++) {
        rgb le = environment_radiance(env, v3(horizon[k].x, 0, horizon[k].z));
        int l = horizon[k].left, r = horizon[k].right;
        float expected = (s.value[l] + s.value[r] + s.value[4 + l] + s.value[4 + r]) / 4;
        assert_true(fabsf(le.r - expected) < 1e-4f * expected);
    }
    environment_free(env);
}

static float pdf_w(const struct environment *env, vec3 n, vec3 w)
{
    float density = 0;
    look_up_environment(env, &n, w, 1, &density);
    return density;
}

static struct sample4 draw(uint32_t i)
{
    return sampler_get(7, 0, i, 0, PURPOSE_LIGHT);
}

static vec3 random_direction(uint32_t i)
{
    struct sample4 u = sampler_get(8, 0, i, 0, 0);
    return warp_uniform_sphere(u.u[0], u.u[1]);
}

/* A sample carries the radiance of its direction (bilinear in the map) and the pdf of its direction; at most 1 in
 * 1000 may differ in the pdf, where float32 rounds the direction into the next cell. At most 1 in 15 is behind the
 * surface: normals are rounded by up to 17 degrees and regions have half widths of 12, within which less than 6 % of
 * a cosine's weight lies. */
TEST(samples_are_what_they_say)
{
    enum { N = 20000 };
    struct sky s = sky_uneven(64, 32);
    struct environment *env = sky_environment(&s);
    int other_cell = 0, behind = 0;
    for (uint32_t i = 0; i < N; i++) {
        struct sample4 u = draw(i);
        vec3 n = random_direction(i);
        vec3 wi;
        rgb radiance;
        float density;
        sample_environment_from(env, n, u.u, 1, &wi, &radiance, &density);
        behind += dot(wi, n) <= 0;
        assert_true(fabsf(length(wi) - 1) < 1e-6f);
        assert_true(density > 0);
        double theta = acos((double)wi.y), phi = atan2(-(double)wi.z, wi.x) + M_PI;
        double expected = sky_on_map(&s, phi / (2 * M_PI) * 64, theta / M_PI * 32);
        assert_true(fabs((double)radiance.r - expected) < 1e-3 * (expected + 0.01));
        assert_true(fabs((double)environment_radiance(env, wi).g - 2 * expected) <
                    2e-3 * (expected + 0.01));
        other_cell += pdf_w(env, n, wi) != density;
    }
    assert_true(behind < N / 15);
    assert_true(other_cell <= N / 1000);
    environment_free(env);
}

enum { HEIGHTS = 12, TURNS = 24, BINS = HEIGHTS * TURNS };

/* Probability of each bin (equal in height and in azimuth) by the density, 64 x 64 points each. */
static void expect_bins(const struct environment *env, vec3 n, double p[BINS])
{
    enum { FINE = 64 };
    for (int i = 0; i < BINS; i++) {
        p[i] = 0;
        for (int a = 0; a < FINE; a++)
            for (int b = 0; b < FINE; b++) {
                double y = 1 - 2 * (i / TURNS + (a + 0.5) / FINE) / HEIGHTS;
                double phi = 2 * M_PI * (i % TURNS + (b + 0.5) / FINE) / TURNS;
                double r = sqrt(1 - y * y);
                vec3 w = v3((float)(r * cos(phi)), (float)y, (float)(r * sin(phi)));
                p[i] += (double)pdf_w(env, n, w) * 4 * M_PI / (BINS * FINE * FINE);
            }
    }
}

/* p-value of Pearson's chi-square; bins that expect fewer than 10 are pooled. */
static double chi_square(const double *p, const uint32_t *count, uint32_t n)
{
    double sum = 0, rest = 0, rest_count = 0;
    int bins = 0;
    for (int i = 0; i < BINS; i++) {
        double expected = p[i] * n;
        if (expected < 10) {
            rest += expected;
            rest_count += count[i];
            continue;
        }
        sum += (count[i] - expected) * (count[i] - expected) / expected;
        bins++;
    }
    if (rest > 0) {
        sum += (rest_count - rest) * (rest_count - rest) / rest;
        bins++;
    } else if (rest_count > 0) {
        return 0;
    }
    return gsl_cdf_chisq_Q(sum, bins - 1);
}

/* H0: directions have the pdf that is returned, for four environments and three normals. Pearson's chi-square, up to
 * 288 bins, n = 50000, alpha = 1e-5 for each of the 12 tests, fixed numbers. Power: a map turned by one texel of 32,
 * another normal, and a pdf that forgets the sine of theta, are rejected. */
TEST(directions_have_their_density)
{
    enum { N = 50000 };
    struct err e;
    struct sky uneven = sky_uneven(32, 16), turned = uneven;
    memmove(turned.value + 1, turned.value, (32 * 16 - 1) * sizeof turned.value[0]);
    struct environment *env[] = {environment_constant(grey(1), &e),
                                 environment_upper_half(grey(1), &e), sky_environment(&uneven),
                                 sky_environment(&turned)};
    const vec3 normals[3] = {{0, 1, 0}, {0.48f, -0.6f, 0.64f}, {-0.8f, 0.6f, 0}};
    for (int j = 0; j < 12; j++) {
        const int k = j % 4;
        const vec3 n = normals[j / 4];
        uint32_t count[BINS] = {0};
        double p[BINS], total = 0, wrong[BINS], wrong_total = 0;
        for (uint32_t i = 0; i < N; i++) {
            struct sample4 u = draw(i);
            vec3 w;
            rgb radiance;
            float density;
            sample_environment_from(env[k], n, u.u, 1, &w, &radiance, &density);
            int height = (int)((1 - (double)w.y) / 2 * HEIGHTS);
            double phi = atan2((double)w.z, w.x);
            int turn = (int)((phi < 0 ? phi + 2 * M_PI : phi) / (2 * M_PI) * TURNS);
            count[(height < HEIGHTS ? height : HEIGHTS - 1) * TURNS +
                  (turn < TURNS ? turn : TURNS - 1)]++;
        }
        expect_bins(env[k], n, p);
        for (int i = 0; i < BINS; i++)
            total += p[i];
        /* The pdf integrates to 1, up to the quadrature's small error at edges of cells. */
        if (fabs(total - 1) > 2e-3)
            fail_msg("environment %d: density integrates to %.6f", k, total);
        double p_value = chi_square(p, count, N);
        if (p_value < 1e-5)
            fail_msg("environment %d: p = %.3g", k, p_value);
        for (int i = 0; i < BINS; i++) {
            double y = 1 - (2 * (i / TURNS) + 1.0) / HEIGHTS;
            wrong[i] = p[i] / sqrt(1 - y * y);
            wrong_total += wrong[i];
        }
        for (int i = 0; i < BINS; i++)
            wrong[i] /= wrong_total;
        assert_true(chi_square(wrong, count, N) < 1e-5);
        if (k == 2) {
            expect_bins(env[3], n, p);
            assert_true(chi_square(p, count, N) < 1e-5);
            expect_bins(env[2], normals[(j / 4 + 1) % 3], p);
            assert_true(chi_square(p, count, N) < 1e-5);
        }
    }
    for (int k = 0; k < 4; k++)
        environment_free(env[k]);
}

/* Where light comes from the side of the normal, there is a density: maps of many sizes, those of a single row or column
 * too. Control: without the condition that it is on that side. */
TEST(no_direction_is_left_out)
{
    static const int sizes[][2] = {{64, 32}, {32, 16}, {7, 5}, {4, 2},
                                   {3, 9},   {2, 1},   {1, 1}, {1, 8}};
    int left_out = 0;
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        struct sky s = sky_uneven(sizes[k][0], sizes[k][1]);
        struct environment *env = sky_environment(&s);
        for (uint32_t i = 0; i < 40000; i++) {
            const vec3 n = random_direction(i), w = random_direction(i + 40000);
            if (environment_radiance(env, w).r == 0)
                continue;
            const float density = pdf_w(env, n, w);
            if (dot(n, w) > 0 && !(density > 0))
                fail_msg("%d x %d: direction %u is left out", s.width, s.height, i);
            left_out += !(density > 0);
        }
        environment_free(env);
    }
    assert_true(left_out > 10000);
}

/* The integral of luminance over all directions: 4 pi and 2 pi for luminance 1; for a map, within 1 % that of
 * the bilinear map summed over 128 x 128 pieces of the sphere. */
TEST(totals)
{
    struct err e;
    struct environment *all = environment_constant(grey(1), &e);
    struct environment *half = environment_upper_half(grey(1), &e);
    assert_true(fabs(environment_total(all) - 4 * M_PI) < 1e-6);
    assert_true(fabs(environment_total(half) - 2 * M_PI) < 1e-6);
    assert_true(environment_is_hidden(half) && !environment_is_hidden(all));
    assert_true(environment_radiance(half, v3(0.6f, -0.8f, 0)).r == 0);
    assert_true(pdf_w(half, v3(0.8f, 0.6f, 0), v3(0.6f, -0.8f, 0)) == 0);
    environment_free(all);
    environment_free(half);

    struct sky s = sky_uneven(32, 16);
    struct environment *env = sky_environment(&s);
    double sum = 0, luminance_factor = 0.2126 * 1 + 0.7152 * 2 + 0.0722 * 3;
    for (int j = 0; j < 8 * 16; j++)
        for (int i = 0; i < 4 * 32; i++)
            sum += sky_on_map(&s, (i + 0.5) / 4, (j + 0.5) / 8) *
                   (cos(M_PI * j / 128) - cos(M_PI * (j + 1) / 128)) * 2 * M_PI / 128;
    assert_true(fabs(environment_total(env) / (sum * luminance_factor) - 1) < 1e-2);
    environment_free(env);
}

static void must_refuse(const struct sky *s, const char *drop, const char *keyword)
{
    struct err e = {""};
    OWN(image) im = sky_image(s);
    if (drop != NULL)
        strcpy(im.names[image_channel(&im, drop)], "Z");
    REFUSES(environment_from_image(&im, "x.exr", &e) != NULL, keyword);
    assert_memory_equal(e.msg, "x.exr: ", 7);
}

TEST(bad_texels_are_named)
{
    const struct sky good = {.width = 4, .height = 2, .value = {1, 2, 4, 8, 16, 32, 64, 128}};
    struct sky s = good;
    s.value[6] = NAN;
    must_refuse(&s, NULL, "pixel (2, 1) from the top left: channel R is");
    s.value[6] = INFINITY;
    must_refuse(&s, NULL, "pixel (2, 1) from the top left: channel R is inf");
    s.value[3] = -0.5f;
    must_refuse(&s, NULL, "pixel (3, 0) from the top left: channel R is -0.5");
    must_refuse(&good, "G", "no channel G");
    memset(s.value, 0, sizeof s.value);
    must_refuse(&s, NULL, "black everywhere");
    environment_free(sky_environment(&good));
}

/* Column 0 of a map of 2 x 1 faces +Z, column 1 faces -Z. */
static void check_two_texels(const char *path)
{
    struct err e = {""};
    struct environment *env = environment_read(path, &e);
    MUST(env != NULL);
    rgb front = environment_radiance(env, v3(0, 0, 1));
    rgb back = environment_radiance(env, v3(0, 0, -1));
    environment_free(env);
    assert_true(fabsf(front.r - 1) < 1e-5f && fabsf(front.g - 2) < 1e-5f);
    assert_true(fabsf(front.b - 3) < 1e-5f && fabsf(back.r - 0.5f) < 1e-5f);
    assert_true(fabsf(back.g - 1) < 1e-5f && fabsf(back.b - 1.5f) < 1e-5f);
}

/* RGBE: m 2^(e-136), so (64, 128, 192) with e = 130 is 1 2 3. Halves: tests/renderer/image/test_image.c. */
TEST(files)
{
    static const char hdr[] = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n"
                              "\x40\x80\xc0\x82\x20\x40\x60\x82";
    struct err e = {""};
    test_write(test_path("light.hdr"), hdr, sizeof hdr - 1);
    check_two_texels(test_path("light.hdr"));
    const struct sky s = {.width = 2, .height = 1, .value = {1, 0.5f}};
    OWN(image) im = sky_image(&s);
    MUST(image_write_exr(test_path("float.exr"), &im, &e));
    check_two_texels(test_path("float.exr"));
    REFUSES(environment_read(test_path("none.exr"), &e) != NULL, "none.exr: cannot read");
    REFUSES(environment_read(test_path("sky.png"), &e) != NULL,
            "sky.png: an environment map must be an .exr or .hdr file");
}
