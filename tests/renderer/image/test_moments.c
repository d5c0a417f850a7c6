/* Moments against two passes over the same numbers, and their files. */
#include "renderer/image/moments.h"
#include "renderer/math/sampler.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

enum { N = 1000 };

/* A skewed distribution with a large offset, on which naive sums of squares lose digits. */
static double observation(uint32_t i, int c)
{
    return 1e4 * c - log(1 - sampler_get(5, i, (uint32_t)c, 0, 0).u[0]);
}

static void two_pass(uint32_t first, uint32_t last, int c, double out[3])
{
    double sum = 0, n = last - first;
    for (uint32_t i = first; i < last; i++)
        sum += observation(i, c);
    out[0] = sum / n;
    out[1] = out[2] = 0;
    for (uint32_t i = first; i < last; i++) {
        double d = observation(i, c) - out[0];
        out[1] += d * d;
        out[2] += d * d * d;
    }
}

static void add_range(struct moments *m, uint32_t first, uint32_t last)
{
    for (uint32_t i = first; i < last; i++)
        moments_add(m, 0, (double[3]){observation(i, 0), observation(i, 1), observation(i, 2)});
}

static void check(const struct moments *m, uint32_t first, uint32_t last)
{
    for (int c = 0; c < 3; c++) {
        double expected[3];
        two_pass(first, last, c, expected);
        assert_true(fabs(m->mean[c] - expected[0]) < 1e-12 * (1 + fabs(expected[0])));
        assert_true(fabs(m->m2[c] - expected[1]) < 1e-8 * expected[1]);
        assert_true(fabs(m->m3[c] - expected[2]) < 1e-7 * fabs(expected[2]));
        double n = last - first;
        assert_true(fabs(moments_var_of_mean(m, 0, c) - expected[1] / (n - 1) / n) <
                    1e-8 * expected[1]);
    }
}

TEST(online_equals_two_pass)
{
    struct err e;
    OWN(moments) m;
    assert_true(moments_alloc(&m, 1, 1, &e));
    assert_true(isnan(moments_var_of_mean(&m, 0, 0)));
    add_range(&m, 0, N);
    check(&m, 0, N);
}

TEST(merged_in_any_grouping)
{
    struct err e;
    static const uint32_t cuts[][4] = {
        {0, 1, 2, N}, {0, 500, 999, N}, {0, 0, 0, N}, {0, N, N, N}, {0, 333, 666, N}};
    for (size_t k = 0; k < sizeof cuts / sizeof cuts[0]; k++) {
        struct moments part[3];
        for (int i = 0; i < 3; i++) {
            assert_true(moments_alloc(&part[i], 1, 1, &e));
            add_range(&part[i], cuts[k][i], cuts[k][i + 1]);
        }
        assert_true(moments_merge(&part[1], &part[2], &e));
        assert_true(moments_merge(&part[0], &part[1], &e));
        assert_true(part[0].n[0] == N);
        check(&part[0], 0, N);
        for (int i = 0; i < 3; i++)
            moments_free(&part[i]);
    }
}

TEST(write_and_read)
{
    struct err e = {0};
    OWN(moments) m, back;
    OWN(image) im;
    const char *path = test_path("m.exr");
    assert_true(moments_alloc(&m, 3, 2, &e));
    for (size_t p = 0; p < 6; p++)
        for (uint32_t i = 0; i < 10 + p; i++)
            moments_add(&m, p, (double[3]){observation(i, 0) + (double)p, 1, observation(i, 2)});
    strcpy(m.unit, "replicate");
    m.spp = 256;
    m.sharing = 2.25;
    const struct image_attr attr = {"assay:seed", "17"};
    MUST(moments_write(path, &m, &attr, 1, &e) && moments_read(path, &back, &im, &e));
    assert_string_equal(back.unit, "replicate");
    assert_true(back.spp == 256 && back.sharing == 2.25 && back.width == 3 && back.height == 2);
    assert_string_equal(image_get_attr(&im, "assay:seed"), "17");
    for (size_t p = 0; p < 6; p++) {
        assert_true(back.n[p] == m.n[p]);
        for (size_t c = 3 * p; c < 3 * p + 3; c++) {
            assert_true((float)m.mean[c] == back.mean[c]);
            assert_true((float)m.m2[c] == back.m2[c]);
            assert_true((float)m.m3[c] == back.m3[c]);
        }
    }
    /* Read packed, and then unpacked, the values are the same. */
    OWN(moments) packed;
    MUST(moments_read_packed(path, &packed, &e));
    assert_true(packed.n == NULL);
    for (int pass = 0; pass < 2; pass++) {
        for (size_t i = 0; i < 18; i++)
            assert_true(
                moments_mean(&packed, i) == back.mean[i] && moments_m2(&packed, i) == back.m2[i] &&
                moments_m3(&packed, i) == back.m3[i] && moments_n(&packed, i / 3) == back.n[i / 3]);
        MUST(moments_unpack(&packed, &e));
        assert_true(packed.n != NULL && packed.packed.n == NULL);
    }
}

static const char *const names[10] = {"R",    "G",    "B",    "M2.R", "M2.G",
                                      "M2.B", "M3.R", "M3.G", "M3.B", "n"};

/* Each fault has its own line and no moments. */
TEST(bad_files)
{
    static const struct {
        int channels;
        const char *unit, *spp;
        int at;
        float value;
        const char *expect;
    } fault[] = {{10, "sample", "1", 0, NAN, "not finite"},
                 {10, "sample", "1", 4, -1, "negative M2"},
                 {10, "sample", "1", 9, 1.5f, "count"},
                 {10, "sample", "1", 8, INFINITY, "not finite"},
                 {9, "sample", "1", 0, 1, "not a moments EXR"},
                 {10, NULL, "1", 0, 1, "not a moments EXR"},
                 {10, "sample", NULL, 0, 1, "not a moments EXR"},
                 {10, "fortnight", "1", 0, 1, "unknown unit"},
                 {10, "sample", "-2", 0, 1, "spp"},
                 {10, "sample", "many", 0, 1, "spp"}};
    const char *path = test_path("bad.exr");
    for (size_t k = 0; k < sizeof fault / sizeof fault[0]; k++) {
        struct err e = {0};
        OWN(image) im;
        struct moments m;
        assert_true(image_alloc(&im, 2, 2, fault[k].channels, names, &e));
        im.data[(size_t)fault[k].channels * 3 + (size_t)fault[k].at] = fault[k].value;
        if (fault[k].unit)
            assert_true(image_set_attr(&im, "assay:unit", fault[k].unit, &e));
        if (fault[k].spp)
            assert_true(image_set_attr(&im, "assay:spp", fault[k].spp, &e));
        assert_true(image_write_exr(path, &im, &e));
        REFUSES(moments_read(path, &m, NULL, &e), fault[k].expect);
        assert_memory_equal(e.msg, path, strlen(path));
    }
    /* Cut off in the middle, and not an image at all. */
    FILE *f = fopen(path, "r+b");
    assert_non_null(f);
    assert_int_equal(ftruncate(fileno(f), 200), 0);
    fclose(f);
    struct err e = {0};
    struct moments m;
    assert_false(moments_read(path, &m, NULL, &e));
    unlink(path);
    REFUSES(moments_read(path, &m, NULL, &e), "No such file");
}

/* Zeros are moments: no sample, no variance. Of the last pixel of 3 x 2 each channel is looked at. */
TEST(every_channel_of_the_last_pixel)
{
    static const char *const units[] = {"sample", "replicate", "exact", "stratified", "picture"};
    static const float values[] = {0, NAN, INFINITY, -1, 0.5f};
    const char *path = test_path("last.exr");
    struct err e = {0};
    for (int c = 0; c < 10; c++)
        for (size_t v = 0; v < COUNT(values); v++) {
            bool is_m2 = c >= 3 && c < 6, is_n = c == 9;
            bool good = isfinite(values[v]) && !((is_m2 || is_n) && values[v] < 0) &&
                        !(is_n && values[v] == 0.5f);
            struct moments m;
            OWN(image) im;
            assert_true(image_alloc(&im, 3, 2, 10, names, &e));
            im.data[5 * 10 + c] = values[v];
            assert_true(image_set_attr(&im, "assay:spp", "0", &e));
            assert_true(image_set_attr(&im, "assay:unit", units[(size_t)c % COUNT(units)], &e));
            assert_true(image_write_exr(path, &im, &e));
            assert_int_equal(moments_read(path, &m, NULL, &e), good);
            if (good)
                moments_free(&m);
            else if (strstr(e.msg, "pixel (2, 1)") == NULL)
                fail_msg("'%s' names another pixel", e.msg);
        }
}

/* Nothing appears where a write fails, and no temporary stays. */
TEST(failed_write_leaves_nothing)
{
    struct err e = {0};
    OWN(moments) m;
    assert_true(moments_alloc(&m, 2, 2, &e));
    assert_false(moments_write("/nonexistent/m.exr", &m, NULL, 0, &e));
    assert_true(strncmp(e.msg, "/nonexistent/m.exr", 18) == 0);
}

/* A copy holds all of it and shares nothing. */
TEST(copies)
{
    struct err e = {0};
    struct moments m, copy;
    MUST(moments_alloc(&m, 3, 2, &e));
    for (size_t p = 0; p < 6; p++)
        for (uint32_t i = 0; i < 5 + p; i++)
            moments_add(
                &m, p,
                (double[3]){observation(i, 0) + (double)p, observation(i, 1), observation(i, 2)});
    strcpy(m.unit, "replicate");
    m.spp = 9;
    MUST(moments_copy(&m, &copy, &e));
    assert_int_equal(copy.width, 3);
    assert_int_equal(copy.height, 2);
    assert_string_equal(copy.unit, "replicate");
    assert_true(copy.spp == 9 && copy.tolerance == NULL);
    const double n = m.n[5], last[3] = {m.mean[17], m.m2[17], m.m3[17]};
    assert_true(n == 10 && last[0] > 0 && last[1] > 0 && last[2] != 0);
    assert_memory_equal(copy.n, m.n, 6 * sizeof *m.n);
    assert_memory_equal(copy.mean, m.mean, 18 * sizeof *m.mean);
    assert_memory_equal(copy.m2, m.m2, 18 * sizeof *m.m2);
    assert_memory_equal(copy.m3, m.m3, 18 * sizeof *m.m3);
    moments_free(&m);
    assert_true(copy.n[5] == n && copy.mean[17] == last[0] && copy.m2[17] == last[1] &&
                copy.m3[17] == last[2]);
    moments_free(&copy);
}

TEST(what_cannot_be_moments)
{
    struct err e = {0};
    struct moments a, b;
    REFUSES(moments_alloc(&a, 0, 1, &e), "0 x 1 pixels");
    REFUSES(moments_alloc(&a, 1, 0, &e), "1 x 0 pixels");
    REFUSES(moments_alloc(&a, -1, 1, &e), "-1 x 1 pixels");
    for (int which = 0; which < 2; which++) {
        MUST(moments_alloc(&a, 1, 1, &e));
        MUST(moments_alloc(&b, 1, 1, &e));
        double *rounded = calloc(3, sizeof *rounded);
        (which == 0 ? &a : &b)->tolerance = rounded;
        REFUSES(moments_merge(&a, &b, &e), "rounded numbers");
        moments_free(&a);
        moments_free(&b);
    }
    MUST(moments_alloc(&a, 2, 2, &e));
    MUST(moments_alloc(&b, 1, 2, &e));
    REFUSES(moments_merge(&a, &b, &e), "2 x 2 and 1 x 2");
    moments_free(&b);
    MUST(moments_alloc(&b, 2, 1, &e));
    REFUSES(moments_merge(&a, &b, &e), "2 x 2 and 2 x 1");
    moments_free(&b);
    MUST(moments_alloc(&b, 2, 2, &e));
    strcpy(b.unit, "replicate");
    assert_false(moments_merge(&a, &b, &e));
    strcpy(b.unit, a.unit);
    b.spp = 2;
    REFUSES(moments_merge(&a, &b, &e), "of 1 spp and a sample of 2 spp");
    b.spp = 1;
    b.sharing = 2;
    REFUSES(moments_merge(&a, &b, &e), "share noise in different ways");
    b.sharing = 0;
    moments_free(&a);
    moments_free(&b);
}
