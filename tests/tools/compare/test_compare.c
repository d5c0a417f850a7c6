/* tools/compare/pyramid.c and tools/compare/compare.c: small cases worked by hand, the guards one at a time, what must
 * be found, and what must be refused. Error rates: test_compare_rates.c. */

#include "tools/compare/pyramid.h"
#include "tools/compare/region.h"
#include "tools/compare/verdict.h"
#include "compare_must.h"

#include <gsl/gsl_cdf.h>

static enum verdict verdict_of(const struct moments *a, const struct moments *b,
                               struct compare_options opt)
{
    OWN(comparison) c = compare(a, b, opt);
    return c.verdict;
}

static void set_all(struct moments *m, double n, double mean, double m2, double m3)
{
    constant(m, mean, n);
    for (int i = 0; i < 3 * m->width * m->height; i++) {
        m->m2[i] = m2;
        m->m3[i] = m3;
    }
}

/* 8 x 8 pixels, all alike. A: n = 101, mean 1.01, M2 = 10100: v = M2/(101 100) = 1. B: n = 101,
 * mean 1, M2 = 30300: v = 3. M3 = 0.
 * Image: D = 0.64, unit 64, V = 64 4 = 256, SE = 16/64 = 0.25, relative difference 0.01, t = 0.04;
 * Welch-Satterthwaite: V^2 / (64 (1/100 + 9/100)) = 65536/6.4 = 10240.
 * p of |D| = 0.64 less the float tolerance 1e-5 64.64, from GSL; the interval at alpha = 0.05 is
 * 0.01 +- (1.645 0.25 + tolerance), wider by skewness: |g| <= sqrt(64 6 (1 + 27)/(100 99))/256^1.5
 * = 2.5e-4, a factor of 1.0004 on alpha.
 * The mean square of the pixels is 1e-4 - 4 < 0: no bias to report. */
TEST(test_by_hand)
{
    OWN(moments) a = new_moments(8, 8, "sample"), b = new_moments(8, 8, "replicate");
    set_all(&a, 101, 1.01, 10100, 0);
    set_all(&b, 101, 1, 30300, 0);
    struct comparison c = compare(&a, &b, (struct compare_options){0.05, 0, 0, 4, 0, 1, false});
    for (int i = 0; i < 4; i++) {
        const struct region *r = &c.global[i];
        assert_true(r->x == 0 && r->y == 0 && r->width == 8 && r->height == 8 && r->channel == i);
        assert_near(r->mean_a, 1.01, 1e-12);
        assert_near(r->mean_b, 1, 1e-12);
        assert_near(r->difference, 0.01, 1e-12);
        assert_near(r->std_error, 0.25, 1e-12);
        assert_near(r->dof, 10240, 1e-6);
        assert_near(r->t, 0.04, 1e-12);
        double t = (0.64 - 1e-5 * 64.64) / 16;
        assert_near(r->log10_p, log10(2 * gsl_cdf_tdist_Q(t, 10240)), 1e-9);
        double half = gsl_cdf_tdist_Qinv(0.05, 10240) * 0.25 + 1e-5 * 1.01;
        assert_near(r->ci_hi, 0.01 + half, 2e-4);
        assert_near(r->ci_lo, 0.01 - half, 2e-4);
        assert_true(r->ci_valid && r->margin == 0);
    }
    assert_int_equal(c.tiles_x, 2);
    assert_int_equal(c.tiles_y, 2);
    /* A tile: V = 16 4, D = 0.16, t = 0.16/8; no margin. */
    for (int i = 0; i < 4; i++) {
        assert_near(c.tile_t[i], 0.02, 1e-12);
        assert_near(c.tile_log10_p[i], log10(2 * gsl_cdf_tdist_Q(0.02, 2560)), 1e-3);
    }
    assert_near(c.z.data[5], 0.01 / 2, 1e-7);
    assert_near(c.relative.data[5], 0.01, 1e-7);
    assert_true(c.rms_bias == 0);
    /* MDB: (t at alpha share/(2 tests) + t at 0.05) SE + tolerance; the image is tested in 4 channels.
     */
    double level = 0.05 * c.statistic[STATISTIC_IMAGE].share / 4;
    double reach = gsl_cdf_tdist_Qinv(level / 2, 10240) + gsl_cdf_tdist_Qinv(0.05, 10240);
    assert_near(c.mdb_global, reach * 0.25 + 1e-5 * 1.01, 1e-4);
    assert_int_equal(c.verdict, VERDICT_NOTHING_FOUND);
    comparison_free(&c);

    /* Without noise the RMS is the root of the mean square: half the pixels off by 0.3 of mean 2. */
    constant(&a, 2, 1);
    constant(&b, 2, 1);
    strcpy(a.unit, "exact");
    strcpy(b.unit, "exact");
    for (int i = 0; i < 3 * 32; i++)
        a.mean[i] += 0.3;
    c = compare(&a, &b, (struct compare_options){0.05, 0, 0, 4, 0, 1, false});
    assert_near(c.rms_bias, 0.3 * sqrt(0.5) / 2, 1e-12);
    comparison_free(&c);
}

/* Sums of every region against a direct loop over its pixels, every level covers every pixel once, and
 * regions nest, for sizes that do not divide; a tile has from half to one and a half of its side, or all. Pixel values from a fixed generator; n differs by pixel. */
TEST(test_pyramid_brute_force)
{
    const int sizes[][3] = {{5, 3, 1}, {12, 18, 6}, {16, 16, 4}, {1, 1, 1},    {40, 10, 10},
                            {7, 7, 7}, {17, 5, 5},  {37, 29, 8}, {33, 48, 16}, {41, 9, 4}};
    uint64_t seed = 5;
    for (size_t s = 0; s < COUNT(sizes); s++) {
        int w = sizes[s][0], h = sizes[s][1], tile = sizes[s][2];
        OWN(moments) a = new_moments(w, h, "sample"), b = new_moments(w, h, "sample");
        simulate(&a, LAW_EXPONENTIAL, 1, 7, false, &seed);
        simulate(&b, LAW_EXPONENTIAL, 2, 9, false, &seed);
        for (int channel = 0; channel < 4; channel++) {
            OWN(pyramid) p = {0};
            struct err e;
            assert_true(pyramid_build(&a, &b, channel, NULL, tile, &p, &e));
            assert_int_equal(p.level[p.tile_level].side, tile);
            assert_int_equal(p.level[0].side, 1);
            assert_true(p.level[p.num_levels - 1].nx == 1 && p.level[p.num_levels - 1].ny == 1);
            for (int l = 0; l < p.num_levels; l++) {
                int covered = 0;
                for (int i = 0; i < p.level[l].nx * p.level[l].ny; i++) {
                    struct rect r = pyramid_rect(&p, l, (size_t)i);
                    if (l == p.tile_level) {
                        assert_true(2 * r.width < 3 * tile && 2 * r.height < 3 * tile);
                        assert_true(2 * r.width >= (w < tile ? w : tile));
                        assert_true(2 * r.height >= (h < tile ? h : tile));
                    }
                    for (int up = p.tile_level; up < p.num_levels && l >= p.tile_level; up++) {
                        if (up < l)
                            continue;
                        struct rect q = pyramid_rect(&p, up, pyramid_parent(&p, l, up, (size_t)i));
                        assert_true(q.x <= r.x && q.x + q.width >= r.x + r.width);
                        assert_true(q.y <= r.y && q.y + q.height >= r.y + r.height);
                    }
                    const struct cell *got = &p.level[l].cell[i];
                    double sa = 0, vb = 0, k3 = 0;
                    for (int y = r.y; y < r.y + r.height; y++)
                        for (int x = r.x; x < r.x + r.width; x++, covered++) {
                            size_t px = (size_t)y * (size_t)w + (size_t)x;
                            struct pixel_estimate ea = pyramid_pixel_estimate(&a, px, channel);
                            struct pixel_estimate eb = pyramid_pixel_estimate(&b, px, channel);
                            sa += ea.mean;
                            vb += eb.v;
                            k3 += ea.k3 - eb.k3;
                        }
                    assert_near(got->a, sa, 1e-9);
                    assert_near(got->vb, vb, 1e-9);
                    assert_near(got->k3, k3, 1e-9);
                }
                assert_int_equal(covered, w * h);
            }
        }
    }
}

/* A pyramid built from bands has the cells of the whole image's pyramid, bit for bit, and the levels above tiles
 * built from their tiles are the image's too; from the floats of a file as from doubles. */
TEST(test_pyramid_of_bands)
{
    const int sizes[][3] = {{37, 100, 16}, {21, 153, 16}, {33, 71, 4}, {9, 200, 32}, {50, 90, 10}};
    uint64_t seed = 6;
    for (size_t s = 0; s < COUNT(sizes); s++) {
        int w = sizes[s][0], h = sizes[s][1], tile = sizes[s][2];
        OWN(moments) a = new_moments(w, h, "sample"), file;
        simulate(&a, LAW_EXPONENTIAL, 1, 7, false, &seed);
        struct err e;
        MUST(moments_write(test_path("bands.exr"), &a, NULL, 0, &e));
        MUST(moments_read_packed(test_path("bands.exr"), &file, &e));
        moments_free(&a);
        MUST(moments_read(test_path("bands.exr"), &a, NULL, &e));
        OWN(pyramid) whole = {0}, above, p = {0};
        MUST(pyramid_build(&a, &a, 3, NULL, tile, &whole, &e));
        const struct pyramid levels = pyramid_levels(w, h, tile);
        MUST(pyramid_above(&levels, &above, &e));
        int band = pyramid_band(&levels), bands = h / band;
        assert_int_equal(bands > 1, s < 4);
        for (int k = 0; k < bands; k++) {
            struct moments part =
                moments_rows(&file, k * band, k + 1 < bands ? band : h - k * band);
            MUST(pyramid_build(&part, &part, 3, NULL, tile, &p, &e));
            for (int l = 0; l < whole.num_levels && (bands == 1 || l < p.tile_level + 2); l++) {
                const struct pyramid_level *level = &p.level[l];
                size_t num = (size_t)level->nx * (size_t)level->ny,
                       first = (size_t)(k * band / level->side) * (size_t)level->nx;
                assert_memory_equal(level->cell, whole.level[l].cell + first,
                                    num * sizeof *level->cell);
                if (l == p.tile_level)
                    memcpy(above.level[0].cell + first, level->cell, num * sizeof *level->cell);
            }
        }
        pyramid_sum_up(&above);
        for (int l = 0; l < above.num_levels; l++)
            assert_memory_equal(above.level[l].cell, whole.level[whole.tile_level + l].cell,
                                (size_t)above.level[l].nx * (size_t)above.level[l].ny *
                                    sizeof *p.cells);
    }
}

/* Tiles of 16 at every size, counted by hand: the remainder is a tile of its own from 8 pixels on. Where
 * an image is compared, tiles of no less than half the pixels pass (1e-3: 3.1 sqrt(2 v/128) = 0.025 of
 * 0.04), which a strip of 1 x 16 could not (0.07). Half the light gone in what is left at the border is found there. */
TEST(test_every_size)
{
    static const struct {
        int width, height, tiles_x, tiles_y;
        bool compared;
    } sizes[] = {{480, 360, 30, 23, true}, {800, 600, 50, 38, false}, {1920, 1080, 120, 68, false},
                 {1, 1, 1, 1, false},      {17, 5, 1, 1, false},      {97, 61, 6, 4, true},
                 {251, 7, 16, 1, false},   {113, 127, 7, 8, true}};
    const struct compare_options opt = {
        .alpha = 1e-3, .margin_global = 0.01, .margin_tile = 0.04, .tile = 16};
    for (size_t s = 0; s < COUNT(sizes); s++) {
        int w = sizes[s].width, h = sizes[s].height;
        assert_int_equal(pyramid_tiles(w, 16), sizes[s].tiles_x);
        assert_int_equal(pyramid_tiles(h, 16), sizes[s].tiles_y);
        if (w * h > 480 * 360)
            continue;
        double v = sizes[s].compared ? 0.004 : 1e-7;
        OWN(moments) a = new_moments(w, h, "sample"), b = new_moments(w, h, "sample");
        set_all(&a, 1001, 1, v * 1001 * 1000, 0);
        set_all(&b, 1001, 1, 1.001 * v * 1001 * 1000, 0); /* no pixel is the same on both sides */
        OWN(comparison) c = compare(&a, &b, opt);
        assert_int_equal(c.verdict, VERDICT_EQUIVALENT);
        assert_int_equal(c.tiles_x, sizes[s].tiles_x);
        assert_int_equal(c.tiles_y, sizes[s].tiles_y);
        if (!sizes[s].compared)
            continue;
        int x = 16 * (sizes[s].tiles_x - 1), y = 16 * (sizes[s].tiles_y - 1);
        for (int i = 0; i < 3 * w * h; i++)
            if (i / 3 % w >= x && i / 3 / w >= y)
                a.mean[i] = 0.5;
        OWN(comparison) d = compare(&a, &b, opt);
        assert_int_equal(d.verdict, VERDICT_DIFFERENT);
        assert_true(d.worst_tile.x == x && d.worst_tile.y == y);
        assert_true(d.worst_tile.width == w - x && d.worst_tile.height == h - y);
    }
}

/* One pixel of the observations 1, 2, 6 (times 1, .5, .25 in R, G, B): mean 3, M2 = 4+1+9 = 14,
 * M3 = -8-1+27 = 18; v = 14/(3 2), k3 = 18/(3 2 1); var v = max(2 v^2/2, k3^2/v). Perfectly
 * correlated, so luminance is the same observations times .2126 + .7152/2 + .0722/4. */
TEST(test_estimate_by_hand)
{
    OWN(moments) m = new_moments(1, 1, "sample");
    const double x[3] = {1, 2, 6};
    for (int i = 0; i < 3; i++)
        moments_add(&m, 0, (double[3]){x[i], 0.5 * x[i], 0.25 * x[i]});
    for (int channel = 0; channel < 4; channel++) {
        const double scales[4] = {1, 0.5, 0.25, 0.2126 + 0.7152 / 2 + 0.0722 / 4};
        double s = scales[channel], v = s * s * 14 / 6, k3 = s * s * s * 3;
        struct pixel_estimate est = pyramid_pixel_estimate(&m, 0, channel);
        assert_near(est.mean, 3 * s, 1e-12);
        assert_near(est.v, v, 1e-12);
        assert_near(est.k3, k3, 1e-12);
        assert_near(est.var_v, fmax(v * v, k3 * k3 / v), 1e-12);
        assert_near(est.var_k3, 6 * v * v * v / 2, 1e-12);
    }
}

/* The luminance bound against the luminance variance of the very same observations: never below it,
 * and for independent channels of equal variance above it by 1/sum w^2 = 1.78, in expectation. 400
 * pixels of n = 64 put the ratio of means within 5 % (its standard error is below 1.5 %). */
TEST(test_luminance_bound)
{
    OWN(moments) m = new_moments(400, 1, "sample"), lum = new_moments(400, 1, "sample");
    uint64_t seed = 9;
    double bound = 0, truth = 0;
    for (size_t p = 0; p < 400; p++) {
        for (int i = 0; i < 64; i++) {
            double x[3], y = 0;
            for (int c = 0; c < 3; c++) {
                x[c] = draw(LAW_NORMAL, &seed);
                y += luminance_weight[c] * x[c];
            }
            moments_add(&m, p, x);
            moments_add(&lum, p, (double[3]){y, y, y});
        }
        double upper = pyramid_pixel_estimate(&m, p, CHANNEL_LUMINANCE).v;
        double exact = pyramid_pixel_estimate(&lum, p, 0).v;
        assert_true(upper >= exact);
        bound += upper;
        truth += exact;
    }
    double w2 = 0.2126 * 0.2126 + 0.7152 * 0.7152 + 0.0722 * 0.0722;
    assert_near(bound / truth * w2, 1, 0.05);
}

/* A bright strip, 1 on 0.2, of columns 4 to 11; noise sd 20 % of each observation, n = 64. Shifted by
 * half a pixel, column 4 and column 12 become 0.6 and the image's mean stays. An 8 x 8 square around
 * one edge differs by 8 0.4 with a standard error of sqrt(2 32 (1 + 0.04)) 0.2/8 = 0.2: t = 16, so it is
 * found (power above 1 - 1e-9) and the worst region holds one edge, not both. Negative control: the
 * same strip on both sides is not DIFFERENT (alpha = 1e-3, one claim). */
TEST(test_half_pixel_shift)
{
    enum { SIDE = 16, N = 64 };
    struct moments m[3];
    uint64_t seed = 11;
    for (int i = 0; i < 3; i++) {
        m[i] = new_moments(SIDE, SIDE, "sample");
        double shift = i == 2 ? 0.5 : 0;
        for (int p = 0; p < SIDE * SIDE; p++)
            for (int s = 0; s < N; s++) {
                double x = p % SIDE + uniform(&seed) - shift;
                double value = x >= 4 && x < 12 ? 1 : 0.2;
                value *= 1 + 0.2 * (draw(LAW_NORMAL, &seed) - 1) / 0.3;
                moments_add(&m[i], (size_t)p, (double[3]){value, value, value});
            }
    }
    struct compare_options opt = {1e-3, 0, 0, 4, 0, 1, false};
    assert_int_equal(verdict_of(&m[0], &m[1], opt), VERDICT_NOTHING_FOUND);
    OWN(comparison) c = compare(&m[2], &m[0], opt);
    assert_int_equal(c.verdict, VERDICT_DIFFERENT);
    assert_near(c.global[3].difference, 0, 0.01);
    assert_true(c.worst.width <= 8);
    assert_true((c.worst.x <= 4 && c.worst.x + c.worst.width > 4) ||
                (c.worst.x <= 12 && c.worst.x + c.worst.width > 12));
    /* Inside the margins of an approximate engine the same shift is no EQUIVALENT either: a tile on
     * an edge differs by 10 % or more. */
    assert_int_not_equal(
        verdict_of(&m[2], &m[0], (struct compare_options){1e-3, 0.05, 0.06, 4, 0, 1, false}),
        VERDICT_EQUIVALENT);
    for (int i = 0; i < 3; i++)
        moments_free(&m[i]);
}

/* Pixels without noise: float32 rounding is no difference, more than that is; and a difference needs
 * more observations than could all have missed something as bright as what is seen. */
TEST(test_noise_free)
{
    OWN(moments) a = new_moments(8, 8, "sample"), b = new_moments(8, 8, "sample");
    struct compare_options opt = {1e-3, 0, 0, 4, 0, 1, false},
                           margin = {1e-3, 0.01, 0.02, 4, 0, 1, false};
    constant(&a, 15, 64);
    constant(&b, 15 * (1 + 3e-6), 64);
    assert_int_equal(verdict_of(&a, &b, opt), VERDICT_NOTHING_FOUND);
    assert_int_equal(verdict_of(&a, &b, margin), VERDICT_EQUIVALENT);
    constant(&b, 15.1, 64); /* 0.7 %: inside the margins */
    assert_int_equal(verdict_of(&a, &b, margin), VERDICT_EQUIVALENT);
    constant(&b, 17, 64); /* 12 % */
    assert_int_equal(verdict_of(&a, &b, opt), VERDICT_DIFFERENT);
    assert_int_equal(verdict_of(&a, &b, margin), VERDICT_DIFFERENT);

    /* One pixel black instead of 0.1 beside pixels of 1, against a closed form. 64 observations expect
     * 6.4 sightings of something of brightness 1: e^-6.4 = 1.7e-3 to miss them all, no proof at
     * 1e-3 over 340 tests. 1024 expect 102: proof. */
    for (int n = 64; n <= 1024; n *= 16) {
        constant(&a, 1, n);
        constant(&b, 1, 1);
        strcpy(b.unit, "exact");
        for (int c = 0; c < 3; c++) {
            a.mean[c] = 0;
            b.mean[c] = 0.1;
        }
        OWN(comparison) c = compare(&a, &b, opt);
        /* event 1, a luminance of 0.1 in one pixel, tolerance 1e-5 0.1 */
        assert_near(c.worst.log10_p * log(10), -n * (0.1 - 1e-6), 0.02 * n * 0.1);
        assert_int_equal(c.verdict, n == 64 ? VERDICT_NOTHING_FOUND : VERDICT_DIFFERENT);
    }
}

/* The most that p^(n-1) (1 - p)^m can be, by trying. */
static double most_likely(double n, double m)
{
    double most = 0;
    for (int i = 1; i < 100000; i++)
        most = fmax(most, pow(i / 1e5, n - 1) * pow(1 - i / 1e5, m));
    return most;
}

/* One pixel whose 64 samples are all 1.0002 here and whose 20 are all 1 there, in an image where a rare
 * event of brightness 1000 was seen elsewhere. Missed events could explain it (0.0002 * 20 / 1000 of one
 * is expected); one law for both sides cannot. Where a side is black, or not observed but exact, rare
 * events may make up for it, and nothing is said; nor where samples differ, or inside the margin. */
TEST(test_one_value_each)
{
    struct compare_options opt = {1e-6, 0, 0, 4, 0, 1, false},
                           margin = {1e-6, 0.01, 0.02, 4, 0, 1, false};
    enum { SEEN, BLACK, EXACT, VARIED, INSIDE, FEW, CASES };
    for (int k = 0; k < CASES; k++) {
        OWN(moments) a = new_moments(8, 8, "sample"), b = new_moments(8, 8, "sample");
        int few = k == FEW ? 4 : 20;
        constant(&a, 1, 64);
        constant(&b, 1, k == EXACT ? 1 : few);
        if (k == EXACT)
            strcpy(b.unit, "exact");
        for (int c = 0; c < 3; c++) {
            a.mean[c] = 1.0002;
            a.m2[c] = k == VARIED ? 64 * 9e-10 : 0;
            /* sixty-three zeros and a thousand, less their mean */
            double x = 1000, mean = x / 64;
            a.mean[180 + c] = mean;
            a.m2[180 + c] = 63 * mean * mean + (x - mean) * (x - mean);
            a.m3[180 + c] = pow(x - mean, 3) - 63 * pow(mean, 3);
            b.mean[180 + c] = mean;
            if (k == BLACK)
                b.mean[c] = 0;
        }
        OWN(comparison) c = compare(&a, &b, k == INSIDE ? margin : opt);
        if (k == SEEN) {
            assert_int_equal(c.verdict, VERDICT_DIFFERENT);
            assert_near(c.worst.log10_p, log10(2 * fmin(most_likely(64, 20), most_likely(20, 64))),
                        1e-3);
            assert_int_equal(c.worst.width, 1);
            assert_near(c.worst.mdb, 1e-5 * 1.0002, 1e-9);
        } else {
            assert_int_not_equal(c.verdict, VERDICT_DIFFERENT);
        }
    }
}

/* Rounding noise (relative sd 1e-8 of an observation) around values 1e-7 apart: hundreds of standard
 * errors, yet no difference. Control: 1e-3 apart is DIFFERENT. */
TEST(test_rounding_noise)
{
    OWN(moments) a = new_moments(4, 4, "sample"), b = new_moments(4, 4, "sample");
    struct compare_options opt = {1e-3, 0, 0, 2, 0, 1, false};
    set_all(&a, 1000, 0.5, 1000 * 2.5e-17, 0);
    set_all(&b, 1000, 0.5 * (1 + 1e-7), 1000 * 2.5e-17, 0);
    assert_int_equal(verdict_of(&a, &b, opt), VERDICT_NOTHING_FOUND);
    set_all(&b, 1000, 0.5 * (1 + 1e-3), 1000 * 2.5e-17, 0);
    assert_int_equal(verdict_of(&a, &b, opt), VERDICT_DIFFERENT);
}

/* Skewness: the same mean, variance and n, |g| = |k3|/V^1.5 of the image set by M3. 8 x 8 pixels,
 * n = 1000 against the exact value: V = 64 v, g = 64 k3/(64 v)^1.5 = k/8 with k = k3/v^1.5 the
 * skewness of a pixel's mean. k = 0.001: tested. k = 2: |g| = 0.25, at x > 3 a factor of e^2: no test, and an
 * interval at least twice as wide, so INCONCLUSIVE although the means differ by 8 standard errors. */
TEST(test_skew_guard)
{
    OWN(moments) a = new_moments(8, 8, "sample"), b = new_moments(8, 8, "exact");
    const double n = 1000, v = 0.01 * 0.01;
    double m2 = v * n * (n - 1);
    constant(&b, 1, 1);
    for (int margin = 0; margin < 2; margin++)
        for (int skewed = 0; skewed < 2; skewed++) {
            double k3 = (skewed ? 2 : 0.001) * v * sqrt(v);
            set_all(&a, n, 1.01, m2, k3 * n * (n - 1) * (n - 2));
            struct compare_options opt = {1e-3, margin ? 0.001 : 0, margin ? 0.002 : 0, 4, 0, 1,
                                          false};
            OWN(comparison) c = compare(&a, &b, opt);
            assert_true(c.skew_limited == (skewed == 1));
            if (skewed) {
                assert_int_equal(c.verdict, VERDICT_INCONCLUSIVE);
                assert_int_equal(c.num_tests, 0);
                assert_non_null(strstr(c.reason, "skewed"));
                assert_true(c.extra_factor > 1);
                assert_true(c.mdb_global == 1e6 && c.mdb_tile == 1e6);
                assert_true(c.global[3].ci_valid && c.global[3].ci_scale > 2);
            } else {
                assert_int_equal(c.verdict, VERDICT_DIFFERENT);
            }
        }
}

/* Where p has to be raised for skewness, a pixel is trusted only as far as the regions around it. 16 x 16 pixels, n
 * = 1000 against the exact value, one pixel 8 standard errors too dark with |g| = 0.01: x is about 5, so |g| x^3/3 =
 * 0.4. If all pixels have this |g|, it is tested and DIFFERENT. Among pixels with |g| = 1 its small |g| must be
 * luck: no test there, nor in the regions around it, whose |g| is at least 0.25; in the image the pixel is only 8/16
 * standard errors. */
TEST(test_harmless_by_luck)
{
    OWN(moments) a = new_moments(16, 16, "sample"), b = new_moments(16, 16, "exact");
    const double n = 1000, v = 1e-4, scale = n * (n - 1) * (n - 2);
    constant(&b, 1, 1);
    for (int lucky = 0; lucky < 2; lucky++) {
        set_all(&a, n, 1, v * n * (n - 1), (lucky ? 1 : 0.01) * v * sqrt(v) * scale);
        for (int c = 0; c < 3; c++) {
            a.mean[3 * 100 + c] = 1 - 8 * sqrt(v);
            a.m3[3 * 100 + c] = 0.01 * v * sqrt(v) * scale;
        }
        OWN(comparison) c = compare(&a, &b, (struct compare_options){1e-3, 0, 0, 8, 0, 1, false});
        assert_int_equal(c.verdict, lucky ? VERDICT_NOTHING_FOUND : VERDICT_DIFFERENT);
        assert_true(lucky || (c.worst.width == 1 &&
                              c.worst.log10_p > log10(2) + log10(gsl_cdf_ugaussian_Q(8))));
    }
}

/* n observations a pixel of 1/0.95 with 0.95, else 0, as a path that roulette ends once in twenty; by `bright`. */
static struct moments survivors(int n, double bright, uint64_t *seed)
{
    struct moments m = new_moments(32, 32, "sample");
    for (size_t p = 0; p < 32 * 32; p++)
        for (int k = 0; k < n; k++) {
            double x = uniform(seed) < 0.95 ? bright / 0.95 : 0;
            moments_add(&m, p, (double[]){x, x, x});
        }
    return m;
}

/* 1024 replicates a pixel of another program, which ends no path: normal, mean 1, standard deviation 1 %. */
static struct moments others(uint64_t *seed)
{
    struct moments m = new_moments(32, 32, "replicate");
    for (size_t p = 0; p < 32 * 32; p++)
        for (int k = 0; k < 1024; k++) {
            double x = 1 + 0.01 * draw_normal(uniform(seed), seed);
            moments_add(&m, p, (double[]){x, x, x});
        }
    return m;
}

/* H0: 16 samples against replicates of the same mean. In 0.95^16 = 44 % of the pixels all 16 are equal, so that A
 * shows no noise there and is 5 % too bright, 160 standard errors of B. None of 10 pairs at alpha 1e-3 may be
 * DIFFERENT (one would have a probability of 1 %; before such regions were recognized all were). Controls: an exact
 * A of 1/0.95 everywhere, and 5 % more light, 28 standard errors of the image's mean, are found. */
TEST(test_all_alike_by_luck)
{
    uint64_t seed = 11;
    const struct compare_options o = {.alpha = 1e-3, .tile = 16};
    int alarms = 0;
    for (int i = 0; i < 10; i++) {
        OWN(moments) a = survivors(16, 1, &seed), b = others(&seed);
        alarms += verdict_of(&a, &b, o) == VERDICT_DIFFERENT;
        if (i > 0)
            continue;
        OWN(moments) bright = survivors(16, 1.05, &seed), exact = new_moments(32, 32, "exact");
        assert_int_equal(verdict_of(&bright, &b, o), VERDICT_DIFFERENT);
        constant(&exact, 1 / 0.95, 1);
        assert_int_equal(verdict_of(&exact, &b, o), VERDICT_DIFFERENT);
    }
    assert_int_equal(alarms, 0);
}

/* The image's |g| is 0.156: 64 pixels of k3 = 1.25 v^1.5. With x = 3.375, the normal quantile of 1e-3/e, the
 * factor f = g x^3/3 is 2, and half of the interval is x f^1.25 = 8.0 SE, SE = 1.25e-4: 1e-3. (The variance of v
 * is k3^2/v at least, so there are 2 x 64/1.25^2 = 82 degrees of freedom, whose quantile is 3.5: 2.3 times as
 * wide.) Within 0.11 %, and not within 0.05 %. Both factors fall as 1/sqrt n until the latter is 1, and equal
 * engines need z = 2.58 (1 in 40 over 5 intervals) SE more, 3.2e-4: of c times as many samples 1e-3/c +
 * 3.2e-4/sqrt c = 5e-4, so c = 3.2. Then 32 times as skewed: f is 64, beyond any interval, so 4 (64/32)^2 times
 * the samples. */
TEST(test_samples_that_skewness_needs)
{
    OWN(moments) a = new_moments(8, 8, "sample"), b = new_moments(8, 8, "exact");
    const double n = 1000, v = 1e-6, m3 = 1.25 * v * sqrt(v) * n * (n - 1) * (n - 2);
    constant(&b, 1, 1);
    set_all(&a, n, 1, v * n * (n - 1), m3);
    OWN(comparison)
    wide = compare(&a, &b, (struct compare_options){1e-3, 1.1e-3, 1.1e-3, 8, 0, 1, false});
    assert_int_equal(wide.verdict, VERDICT_EQUIVALENT);
    assert_near(wide.global[3].ci_hi, 1e-3, 3e-5);
    OWN(comparison) c = compare(&a, &b, (struct compare_options){1e-3, 5e-4, 5e-4, 8, 0, 1, false});
    assert_int_equal(c.verdict, VERDICT_INCONCLUSIVE);
    assert_non_null(strstr(c.reason, "2.3 times as wide as samples are skewed"));
    assert_near(c.extra_factor, 3.2, 0.15);
    set_all(&a, n, 1, v * n * (n - 1), 32 * m3);
    OWN(comparison)
    none = compare(&a, &b, (struct compare_options){1e-3, 0.01, 0.02, 8, 0, 1, false});
    assert_int_equal(none.verdict, VERDICT_INCONCLUSIVE);
    assert_near(none.extra_factor, 16, 0.2);
}

/* A lamp in view, 1000 in 16 of 1024 pixels, and walls of 0.1, 30 % too bright in A. In units of 5 % of the mean, 0.79,
 * they would be 3.8 % off, within 8 %; of what counts as at most ten times the mean they are 30 % off. Control: where a
 * quarter of the image is the lamp, its walls are what does not matter. */
TEST(test_lamp_in_view)
{
    for (int side = 4; side <= 16; side += 12) {
        OWN(moments) a = new_moments(32, 32, "exact"), b = new_moments(32, 32, "exact");
        constant(&a, 0.13, 1);
        constant(&b, 0.1, 1);
        for (int i = 0; i < 3 * side * side; i++) {
            size_t at = (size_t)(i / (3 * side) * 3 * 32 + i % (3 * side));
            a.mean[at] = b.mean[at] = 1000;
        }
        enum verdict v =
            verdict_of(&a, &b, (struct compare_options){1e-3, 0.02, 0.08, 8, 0, 1, false});
        assert_int_equal(v, side == 4 ? VERDICT_DIFFERENT : VERDICT_EQUIVALENT);
    }
}

/* A lit thing in 16 of 1024 pixels, all else black: it is what the image shows, and no lamp. 5 % of the mean, 1/64, is then
 * the unit of a black tile in which A has 1e-5 everywhere: 1.3 %, within 8 %; ten times as much is not. */
TEST(test_black_background)
{
    for (int times = 1; times <= 10; times += 9) {
        OWN(moments) a = new_moments(32, 32, "exact"), b = new_moments(32, 32, "exact");
        constant(&a, 0, 1);
        constant(&b, 0, 1);
        for (int i = 0; i < 3 * 4 * 4; i++) {
            size_t at = (size_t)(i / (3 * 4) * 3 * 32 + i % (3 * 4));
            a.mean[at] = b.mean[at] = 1;
        }
        for (int i = 0; i < 3 * 8 * 8; i++)
            a.mean[(24 + i / (3 * 8)) * 3 * 32 + 3 * 24 + i % (3 * 8)] = 1e-5 * times;
        enum verdict v =
            verdict_of(&a, &b, (struct compare_options){1e-3, 0.02, 0.08, 8, 0, 1, false});
        assert_int_equal(v, times == 1 ? VERDICT_EQUIVALENT : VERDICT_DIFFERENT);
    }
}

/* A tile that is too skewed is judged within what is around it: its MDB is that of the image times
 * their ratio of radiance. And a moderately skewed interval is widened, never narrowed. */
TEST(test_skewed_tile)
{
    OWN(moments) a = new_moments(8, 8, "sample"), b = new_moments(8, 8, "exact");
    const double n = 1000, v = 1e-6;
    double m2 = v * n * (n - 1);
    constant(&b, 1, 1);
    set_all(&a, n, 1, m2, 0);
    struct compare_options opt = {1e-3, 0.01, 0.02, 4, 0, 1, false};
    OWN(comparison) plain = compare(&a, &b, opt);
    for (int y = 0; y < 4; y++)
        for (int x = 0; x < 4; x++)
            for (int c = 0; c < 3; c++)
                a.m3[3 * (8 * y + x) + c] = 0.05 * v * sqrt(v) * n * (n - 1) * (n - 2);
    OWN(comparison) skewed = compare(&a, &b, opt);
    assert_true(!skewed.skew_limited && !plain.skew_limited);
    assert_int_equal(skewed.verdict, VERDICT_EQUIVALENT);
    double g = 0.05 / 4, x = 3.09; /* of the tile: 16 k3/(16 v)^1.5; x of alpha = 1e-3 */
    assert_true(skewed.worst_tile.ci_hi > plain.worst_tile.ci_hi);
    /* -ln alpha grows by g x^3/3; ln Q falls by x + 1/x per unit of x near there. */
    double wider = g * x * x * x / 3 / (x + 1 / x) * sqrt(v) / 4;
    assert_near(skewed.worst_tile.ci_hi - plain.worst_tile.ci_hi, wider, 0.15 * wider);
    /* Its test is raised: 1e-3 x 0.44 over its regions is x = 4, so by 0.27 of ln p, 0.06 of x + 1.65. */
    assert_true(skewed.mdb_tile > plain.mdb_tile && skewed.mdb_tile < 1.03 * plain.mdb_tile);
    /* Seven times as skewed: |g| x = 0.0875 x 4 is beyond 0.3. The image: 4 times the unit, so 4 times the MDB. */
    for (size_t i = 0; i < 3 * 64; i++)
        a.m3[i] *= 7;
    OWN(comparison) more = compare(&a, &b, opt);
    assert_true(more.skew_limited && more.global[0].ci_valid);
    assert_near(more.mdb_tile, 4 * more.mdb_global, 1e-6);
}

/* Dark regions are measured against 5 % of the mean luminance: the left half of the image is black in
 * B and 0.0004 in A, beside 0.5: mean 0.25, unit 0.0125, so 3.2 %. */
TEST(test_floor)
{
    OWN(moments) a = new_moments(8, 8, "exact"), b = new_moments(8, 8, "exact");
    constant(&a, 0.5, 1);
    constant(&b, 0.5, 1);
    for (int p = 0; p < 64; p++)
        for (int c = 0; p % 8 < 4 && c < 3; c++) {
            a.mean[3 * p + c] = 0.0004;
            b.mean[3 * p + c] = 0;
        }
    OWN(comparison) c = compare(&a, &b, (struct compare_options){1e-3, 0.04, 0.04, 4, 0, 1, false});
    assert_near(c.worst_tile.difference, 0.032, 1e-12);
    assert_near(c.relative.data[0], 0.032, 1e-7);
    assert_int_equal(c.verdict, VERDICT_EQUIVALENT);
    assert_int_equal(verdict_of(&a, &b, (struct compare_options){1e-3, 0.03, 0.03, 4, 0, 1, false}),
                     VERDICT_DIFFERENT);
}

/* Margins: the image's for the image, the tile's up to a tile, between them linear in the logarithm
 * of the side. 16 x 16, tile 4, margins 1 % and 3 %: an 8 x 8 square has 2 %. Exact sides; in the
 * top left 8 x 8 the difference is 1.9 % or 2.1 %; neither any tile nor the image is beyond its own
 * margin. */
TEST(test_margin_between)
{
    OWN(moments) a = new_moments(16, 16, "exact"), b = new_moments(16, 16, "exact");
    constant(&b, 1, 1);
    for (int over = 0; over < 2; over++) {
        constant(&a, 1, 1);
        for (int p = 0; p < 256; p++)
            for (int c = 0; p % 16 < 8 && p / 16 < 8 && c < 3; c++)
                a.mean[3 * p + c] = over ? 1.021 : 1.019;
        OWN(comparison)
        c = compare(&a, &b, (struct compare_options){1e-3, 0.01, 0.03, 4, 0, 1, false});
        assert_int_equal(c.verdict, over ? VERDICT_DIFFERENT : VERDICT_EQUIVALENT);
        if (over) {
            assert_near(c.worst.margin, 0.02, 1e-12);
            assert_int_equal(c.worst.width, 8);
        }
    }
}

/* A claim that is INCONCLUSIVE with few samples becomes EQUIVALENT with the factor it asks for. Planned for
 * 95 %; 60 claims, of which fewer than 51 have a probability of 7e-4 at 95 %. Control: a quarter of that
 * factor leaves most INCONCLUSIVE. Normal law sd 0.3, n = 8 on 16 x 16, margins 2 % and 10 %. */
TEST(test_extra_factor)
{
    OWN(moments) a = new_moments(16, 16, "sample"), b = new_moments(16, 16, "sample");
    struct compare_options opt = {1e-3, 0.02, 0.1, 8, 0, 1, false};
    uint64_t seed = 21;
    simulate_pair(&a, &b, LAW_NORMAL, 8, true, &seed);
    OWN(comparison) c = compare(&a, &b, opt);
    assert_int_equal(c.verdict, VERDICT_INCONCLUSIVE);
    double factor = c.extra_factor;
    assert_true(factor > 1 && factor < 200);
    assert_non_null(strstr(c.reason, "margin"));
    int equivalent[2] = {0};
    for (int quarter = 0; quarter < 2; quarter++)
        for (int i = 0; i < 60; i++) {
            int n = (int)ceil(8 * factor / (quarter ? 4 : 1));
            simulate_pair(&a, &b, LAW_NORMAL, n, true, &seed);
            equivalent[quarter] += verdict_of(&a, &b, opt) == VERDICT_EQUIVALENT;
        }
    print_message("asked for %.1f times: EQUIVALENT %d of 60; a quarter of that: %d\n", factor,
                  equivalent[0], equivalent[1]);
    assert_true(equivalent[0] >= 51);
    assert_true(equivalent[1] < 30);
}

/* The image's standard error is 0.05 %: v = 3.2e-5 a pixel and side, sqrt(256 (v + v))/256. With Student's 3.1 for alpha
 * 1e-3 its interval is +-0.155 %; a tile's, of 64 pixels, is twice that, far inside 8 %. Of the margin of 2 %: a bias of
 * 1.5 % is inside, and 30 standard errors are not noise; 1.95 % reaches over it; so does nothing in noise of 1 %,
 * which is 20 times as large; 0.25 % is 5 standard errors, but less than 0.2 % with the noise taken off; without a bias (1e-5, as equal bits are refused)
 * there is nothing. */
TEST(test_a_difference_that_is_not_noise)
{
    const struct {
        double bias, noise;
        enum verdict verdict;
        bool is_significant;
        const char *says;
    } cases[] = {
        {0.015, 1, VERDICT_EQUIVALENT, true,
         "each of 4 tiles within 8 %; the image (red): +1.34 % to +1.66 % is not noise"},
        {0.0195, 1, VERDICT_INCONCLUSIVE, true,
         "+1.79 % to +2.11 %, which is not noise, is not inside the margin of 2 %"},
        {1e-5, 20, VERDICT_INCONCLUSIVE, false, "interval -3.12 % to +3.12 % is not inside"},
        {0.0025, 1, VERDICT_EQUIVALENT, false, "each of 4 tiles within 8 %"},
        {1e-5, 1, VERDICT_EQUIVALENT, false, "each of 4 tiles within 8 %"},
    };
    OWN(moments) a = new_moments(16, 16, "sample"), b = new_moments(16, 16, "sample");
    for (size_t i = 0; i < COUNT(cases); i++) {
        const double v = 3.2e-5 * cases[i].noise * cases[i].noise;
        set_all(&a, 101, 1 + cases[i].bias, v * 101 * 100, 0);
        set_all(&b, 101, 1, v * 101 * 100, 0);
        OWN(comparison)
        c = compare(&a, &b, (struct compare_options){1e-3, 0.02, 0.08, 8, 0, 1, false});
        print_message("%s: %s\n", verdict_name(c.verdict), c.reason);
        assert_int_equal(c.verdict, cases[i].verdict);
        assert_non_null(strstr(c.reason, cases[i].says));
        assert_int_equal(c.significant.width, cases[i].is_significant ? 16 : 0);
        assert_int_equal(strstr(c.reason, "noise") != NULL, cases[i].is_significant);
        assert_int_equal(verdict_is_near_margin(&c),
                         cases[i].is_significant && c.verdict == VERDICT_INCONCLUSIVE);
        char more[128];
        verdict_more_samples(100, "samples", verdict_is_near_margin(&c), more);
        assert_int_equal(strstr(more, "choose another margin") != NULL, verdict_is_near_margin(&c));
    }
}

/* What skewness forbids to test has no small p, wherever t is: 8 samples against 64 of a law that is black in 9 of 10. */
TEST(test_worst_tile_that_cannot_be_tested)
{
    OWN(moments) a = new_moments(16, 16, "sample"), b = new_moments(16, 16, "sample");
    uint64_t seed = 8;
    simulate(&a, LAW_BLACK, 1, 8, true, &seed);
    simulate(&b, LAW_BLACK, 1, 64, true, &seed);
    OWN(comparison) c = compare(&a, &b, (struct compare_options){1e-3, 0.9, 0.9, 8, 0, 1, false});
    assert_true(c.skew_limited);
    assert_true(c.worst_tile.log10_p > -3);
}

/* No margin, no EQUIVALENT: with too few samples to see half the light gone in a tile, what is said is
 * that a tile could hide more than that. 32 x 32 pixels, v = 1 a pixel and side: a tile's standard error is
 * sqrt(512)/256 = 0.088; x is 6.55 at 0.44e-6 over at most 4 x 1365 tests, and 1.65 for the 95 %. */
TEST(test_nothing_found)
{
    OWN(moments) a = new_moments(32, 32, "sample"), b = new_moments(32, 32, "replicate");
    set_all(&a, 101, 1, 10100, 0);
    set_all(&b, 101, 1, 10110, 0);
    for (int i = 0; i < 3 * 32 * 32; i++)
        if (i / 3 % 32 < 16 && i / 3 / 32 < 16)
            a.mean[i] = 0.7;
    OWN(comparison) c = compare(&a, &b, (struct compare_options){1e-6, 0, 0, 16, 0, 1, false});
    assert_int_equal(c.verdict, VERDICT_NOTHING_FOUND);
    assert_true(c.mdb_tile > 0.3 && c.mdb_tile < 8.3 * 0.088);
    char image[32], tile[32], wanted[256];
    snprintf(wanted, sizeof wanted, "an error of %s of the image or of %s of a tile",
             region_mdb_text(c.mdb_global, image), region_mdb_text(c.mdb_tile, tile));
    assert_non_null(strstr(c.reason, wanted));
    /* 1 % of the image needs (3.1 0.044/0.01)^2 = 190 times the samples: more than is said in numbers. */
    OWN(comparison) d = compare(&a, &b, (struct compare_options){1e-3, 0.01, 0.9, 16, 0, 1, false});
    assert_int_equal(d.verdict, VERDICT_INCONCLUSIVE);
    assert_true(d.extra_factor == 100);
    char more[128];
    verdict_more_samples(d.extra_factor, "samples", false, more);
    assert_non_null(strstr(more, "more than 100 times the samples"));
    verdict_more_samples(99.94, "samples", false, more);
    assert_string_equal(more, "about 99.9 times the samples would decide");
}

/* A margin of the variance that was asked for stands in every verdict: 3 times the variance, in a few pixels
 * too skewed to be tested; within the margin, and not known well enough for it; a side without noise. */
TEST(test_margin_of_variance)
{
    const struct {
        double times, margin;
        bool in_few, exact;
        enum verdict verdict;
        const char *says;
    } cases[] = {
        {3, 0.5, true, false, VERDICT_INCONCLUSIVE, "too skewed"},
        {1.02, 0.2, false, false, VERDICT_EQUIVALENT, "; the variance is "},
        {1.02, 0.02, false, false, VERDICT_INCONCLUSIVE, "not inside the margin of 2 %"},
        {3, 0.5, false, false, VERDICT_DIFFERENT, "beyond the margin of 50 %"},
        {1, 0.5, false, true, VERDICT_INCONCLUSIVE, "could not be tested, as a side has none"},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        OWN(moments) a = new_moments(16, 16, "sample"), b = new_moments(16, 16, "sample");
        uint64_t seed = 3;
        set_all(&b, 101, 1, 1e-4, 0);
        set_all(&a, 101, 1, cases[i].times * 1e-4, 0);
        for (int p = 0; p < 16 * 16; p++)
            for (int c = 0; c < 3; c++) {
                double few = p < 2 ? 100 : 1e-3;
                a.m2[3 * p + c] *= cases[i].in_few ? few : 0.5 + uniform(&seed);
                b.m2[3 * p + c] *= cases[i].in_few ? few : 0.5 + uniform(&seed);
            }
        if (cases[i].exact) {
            constant(&b, 1, 1);
            strcpy(b.unit, "exact");
        }
        const struct compare_options opt = {1e-3, 0.1, 0.4, 16, cases[i].margin, 1, false};
        OWN(comparison) c = compare(&a, &b, opt);
        print_message("%s: %s\n", verdict_name(c.verdict), c.reason);
        assert_int_equal(c.verdict, cases[i].verdict);
        assert_non_null(strstr(c.reason, cases[i].says));
    }
}

/* A channel swap that keeps luminance: caught in R, G and B. */
TEST(test_channels)
{
    OWN(moments) a = new_moments(8, 8, "exact"), b = new_moments(8, 8, "exact");
    constant(&a, 1, 1);
    constant(&b, 1, 1);
    for (int p = 0; p < 64; p++) {
        a.mean[3 * p] = 1 + 0.1 / 0.2126;
        a.mean[3 * p + 1] = 1 - 0.1 / 0.7152;
    }
    OWN(comparison) c = compare(&a, &b, (struct compare_options){1e-3, 0.01, 0.02, 4, 0, 1, false});
    assert_near(c.global[3].difference, 0, 1e-12);
    assert_int_equal(c.verdict, VERDICT_DIFFERENT);
    assert_true(c.worst.channel < 3);
}

/* Pixels below 0, as filters with negative lobes and spectra outside sRGB's triangle make them: a column of -0.1 in a
 * grey image. Exact images of the same numbers are the same; one whose column is 0, as a renderer makes it that clips,
 * differs there. */
TEST(test_below_zero)
{
    OWN(moments) a = new_moments(8, 8, "exact"), b = new_moments(8, 8, "exact");
    constant(&a, 1, 1);
    constant(&b, 1, 1);
    for (int i = 0; i < 3 * 64; i += 3 * 8)
        for (int c = 0; c < 3; c++)
            a.mean[i + c] = b.mean[i + c] = -0.1;
    const struct compare_options opt = {1e-3, 0.001, 0.004, 8, 0, 1, false};
    OWN(comparison) same = compare(&a, &b, opt);
    assert_int_equal(same.verdict, VERDICT_EQUIVALENT);
    assert_near(same.global[3].difference, 0, 1e-12);
    for (int i = 0; i < 3 * 64; i += 3 * 8)
        for (int c = 0; c < 3; c++)
            a.mean[i + c] = 0;
    OWN(comparison) clipped = compare(&a, &b, opt);
    assert_int_equal(clipped.verdict, VERDICT_DIFFERENT);
    /* Means: A 7/8, B (7 - 0.1)/8. */
    assert_near(clipped.global[3].difference, 0.1 / 6.9, 1e-12);
}

static void expect(const struct moments *b, struct compare_options opt, const char *line)
{
    OWN(moments) a = new_moments(4, 4, "sample");
    struct comparison c;
    struct err e = {"untouched"};
    set_all(&a, 64, 1, 0.5, 0);
    bool judged = compare_moments(&a, b, &opt, &c, &e);
    assert_true(judged == (line == NULL));
    assert_string_equal(e.msg, judged ? "untouched" : line);
    if (judged)
        comparison_free(&c);
}

/* Each fault on its own, in B: refused with its own line. Control: without it, judged. */
TEST(test_hygiene)
{
    const struct compare_options right = {1e-3, 0.01, 0.02, 2, 0, 1, false};
    struct compare_options opt = right;
    OWN(moments) b = new_moments(4, 4, "replicate"), tall = new_moments(4, 8, "replicate");
    const struct {
        double *at, value;
        const char *line;
    } cases[] = {
        {&b.mean[16], NAN, "B: pixel 1,1 is not a number"},
        {&b.m3[16], NAN, "B: pixel 1,1 is not a number"},
        {&b.m2[16], INFINITY, "B: pixel 1,1 is infinite"},
        {&b.m2[17], -1, "B: pixel 1,1 has a negative sum of squares -1"},
        {&b.n[5], 2, "B: pixel 1,1 has 2 observations, at least 3 are needed"},
        {&b.n[5], 0, "B: pixel 1,1 has 0 observations, at least 3 are needed"},
        {&opt.alpha, 0.5, "alpha is 0.5, must lie in (0, 0.5)"},
        {&opt.alpha, NAN, "alpha is nan, must lie in (0, 0.5)"},
        {&opt.margin_global, 0.5,
         "margins 0.5 (image) and 0.02 (tile): must be 0 <= image <= tile < 1"},
        {&opt.margin_global, 0, "margins 0 (image) and 0.02 (tile): both or none must be 0"},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        set_all(&b, 8, 1, 0.5, 0);
        opt = right;
        *cases[i].at = cases[i].value;
        expect(&b, opt, cases[i].line);
    }
    set_all(&b, 8, 1, 0.5, 0);
    expect(&b, right, NULL);
    opt = right;
    opt.tile = 3; /* a strip of one pixel is left */
    expect(&b, opt, NULL);
    opt.tile = 0;
    expect(&b, opt, "tile side is 0, must be 1 or more");
    set_all(&tall, 8, 1, 0.5, 0);
    expect(&tall, right, "A is 4 x 4 pixels, B is 4 x 8");
    static const char *const units[][2] = {
        {"frame", "B: unknown unit 'frame' of an observation"},
        {"stratified",
         "B: its samples depend on each other (--sampler sobol), so its variance "
         "is unknown: compare directories of 16 renders each, made with --seed 1 to 16"},
        {"exact", "B: pixel 0,0 is called exact but has variance"}};
    for (size_t i = 0; i < COUNT(units); i++) {
        strcpy(b.unit, units[i][0]);
        expect(&b, right, units[i][1]);
    }
    strcpy(b.unit, "replicate");
    set_all(&b, 8, 1, 0, 0);
    expect(&b, right, "B: 8 replicates without any variance: was the seed ignored?");
    set_all(&b, 8, 0, 0, 0);
    b.m2[0] = 1e-30;
    expect(&b, right, "B is black: relative differences have no unit");
}
