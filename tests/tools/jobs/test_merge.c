/* Shares of a made-up image of 4 x 2 pixels, put together, against all their samples added one by one. */
#include "renderer/transport/film.h"
#include "renderer/math/sampler.h"
#include "tools/jobs/merge.h"
#include "renderer/base/fs.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

enum { WIDTH = 4, HEIGHT = 2, MAX_SHARES = 4 };

static const char *part_path(int k)
{
    return test_path(fs_path("part%d.exr", k).s);
}

/* Sample k of channel c at column x, row y of the full image: skewed, with an offset. */
static double observation(int x, int y, uint32_t k, uint32_t c)
{
    return 0.5 - log(1 - sampler_get(9, (uint32_t)(y * WIDTH + x), k, c, 0).u[0]);
}

struct part {
    int x, y, w, h; /* origin at the bottom left */
    uint32_t first, last;
    const char *samples; /* the attribute; NULL: "first:last" */
    const char *seed, *adaptive;
    bool layers;
};

#define ALL .x = 0, 0, WIDTH, HEIGHT

static int num_parts(const struct part part[MAX_SHARES])
{
    int n = 0;
    while (n < MAX_SHARES && part[n].w > 0)
        n++;
    return n;
}

static void add_samples(struct moments *m, size_t pixel, int x, int row, uint32_t first,
                        uint32_t last)
{
    for (uint32_t k = first; k < last; k++)
        moments_add(m, pixel,
                    (double[3]){observation(x, row, k, 0), observation(x, row, k, 1),
                                observation(x, row, k, 2)});
}

/* Layers of a sample: it hits with depth k if its number k is odd, object 1 + its row. */
static void set_layers(float *px, const struct moments *m, size_t pixel, int row, uint32_t first,
                       uint32_t last)
{
    double depth = 0, hits = 0;
    for (uint32_t k = first; k < last; k++) {
        hits += k % 2;
        depth += k % 2 ? k : 0;
    }
    layers_of_moments(m, pixel, px);
    px[6] = hits > 0 ? (float)(depth / hits) : 1e10f;
    px[7] = (float)hits;
    for (int i = 8; i < 14; i++)
        px[i] = last > first ? (float)(hits / (last - first)) : 0;
    px[14] = first % 2 ? (float)(1 + row) : 0;
}

static void write_part(const char *path, const struct part *p)
{
    struct err e = {0};
    OWN(moments) m;
    OWN(image) layers;
    char cell[64], samples[64];
    assert_true(moments_alloc(&m, p->w, p->h, &e));
    assert_true(image_alloc(&layers, p->w, p->h, NUM_LAYERS, layer_names, &e));
    for (int y = 0; y < p->h; y++)
        for (int x = 0; x < p->w; x++) {
            size_t q = (size_t)(y * p->w + x);
            int row = HEIGHT - p->y - p->h + y;
            add_samples(&m, q, p->x + x, row, p->first, p->last);
            set_layers(layers.data + NUM_LAYERS * q, &m, q, row, p->first, p->last);
        }
    snprintf(cell, sizeof cell, "%d %d %d %d of %d %d", p->x, p->y, p->w, p->h, WIDTH, HEIGHT);
    snprintf(samples, sizeof samples, "%u:%u", p->first, p->last);
    const struct image_attr attrs[] = {{"assay:version", "1"},
                                       {"assay:scene", "s"},
                                       {"assay:settings", "t"},
                                       {"assay:adaptive", p->adaptive ? p->adaptive : "off"},
                                       {"assay:seed", p->seed ? p->seed : "1"},
                                       {"assay:cell", cell},
                                       {"assay:samples", p->samples ? p->samples : samples}};
    MUST(moments_write_layers(path, &m, p->layers ? &layers : NULL, attrs, 7, &e));
}

/* Writes the parts, reads and merges them in the order given. */
static bool merge(const struct part *part, int num, struct share *whole, struct err *e)
{
    struct share share[MAX_SHARES];
    bool ok = true;
    int n = 0;
    for (; ok && n < num; n++) {
        write_part(part_path(n), &part[n]);
        ok = share_read(part_path(n), &share[n], e);
        n -= !ok;
    }
    ok = ok && merge_shares(share, num, whole, e);
    for (int i = 0; i < n; i++)
        share_free(&share[i]);
    return ok;
}

static void check_close(double got, double expected, double tolerance, const char *what)
{
    if (!(fabs(got - expected) <= tolerance * (1 + fabs(expected))))
        fail_msg("%s: %.9g instead of %.9g", what, got, expected);
}

/* The float32 of the files is 6e-8 of a mean, of M2 and of M3; a wrong mean shifts M3 by 3 M2 times
 * that. Tolerance 2e-6. */
static void check_whole(const struct share *whole, uint32_t first, uint32_t last, bool layers)
{
    OWN(moments) m;
    struct err e;
    float expected[NUM_LAYERS];
    assert_true(moments_alloc(&m, WIDTH, HEIGHT, &e));
    assert_true(whole->m.width == WIDTH && whole->m.height == HEIGHT);
    assert_true(whole->num_ranges == 1 && whole->range[0][0] == first &&
                whole->range[0][1] == last);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            size_t p = (size_t)(y * WIDTH + x);
            add_samples(&m, p, x, y, first, last);
            assert_true(whole->m.n[p] == last - first);
            for (size_t i = 3 * p; i < 3 * p + 3; i++) {
                check_close(whole->m.mean[i], m.mean[i], 2e-6, "mean");
                check_close(whole->m.m2[i], m.m2[i], 2e-6, "M2");
                check_close(whole->m.m3[i], m.m3[i], 2e-6, "M3");
            }
            if (!layers)
                continue;
            set_layers(expected, &m, p, y, first, last);
            for (size_t i = 0; i < NUM_LAYERS; i++)
                check_close(whole->im.data[(size_t)whole->im.channels * p + i], expected[i], 2e-6,
                            layer_names[i]);
        }
    assert_true(layers == (image_channel(&whole->im, layer_names[0]) == 0));
}

TEST(parts_make_the_whole)
{
    static const struct {
        struct part part[MAX_SHARES];
        uint32_t first, last;
        bool layers;
    } cases[] = {
        {{{.layers = true, ALL, 7, 40}, {.layers = true, ALL, 0, 7}}, 0, 40, true},
        {{{ALL, 5, 6}, {.layers = true, ALL, 3, 5}, {ALL, 6, 90}}, 3, 90, false},
        {{{.layers = true, .x = 0, 0, 1, 2, 2, 9},
          {.layers = true, .x = 1, 0, 3, 1, 2, 9},
          {.layers = true, .x = 1, 1, 3, 1, 2, 9}},
         2,
         9,
         true},
        {{{.x = 0, 1, 4, 1, 0, 9}, {.x = 0, 0, 4, 1, 4, 9}, {.x = 0, 0, 4, 1, 0, 4}}, 0, 9, false},
        /* An interrupted share may have no sample yet. */
        {{{.layers = true, ALL, 0, 9}, {.layers = true, ALL, 9, 9}}, 0, 9, true},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        OWN(share) whole = {0}, again = {0};
        struct err e = {0};
        const char *path = test_path("whole.exr");
        if (!merge(cases[i].part, num_parts(cases[i].part), &whole, &e))
            fail_msg("case %zu: %s", i, e.msg);
        check_whole(&whole, cases[i].first, cases[i].last, cases[i].layers);
        /* What is written can be merged again. */
        assert_true(share_write(path, &whole, "test", &e));
        if (!share_read(path, &again, &e))
            fail_msg("case %zu: %s", i, e.msg);
        assert_true(again.num_ranges == 1 && again.range[0][1] == cases[i].last);
    }
}

/* All floats of a written merge, as its file has them: sorted by name. */
static void read_floats(const char *path, struct image *im)
{
    struct err e;
    bool half;
    MUST(image_read_exr(path, im, &half, &e));
}

/* Merges the files `of`, a digit each, into one that takes the number `to`. */
static void merge_files(const char *of, int to)
{
    struct share share[MAX_SHARES] = {0}, whole = {0};
    struct err e = {0};
    int num = (int)strlen(of);
    for (int i = 0; i < num; i++)
        MUST(share_read(part_path(of[i] - '0'), &share[i], &e));
    MUST(merge_shares(share, num, &whole, &e) && share_write(part_path(to), &whole, "test", &e));
    for (int i = 0; i < num; i++)
        share_free(&share[i]);
    share_free(&whole);
}

/* Groupings of the same four shares; numbers 4, 5, .. are the results of earlier merges, the last of each is the
 * whole image. Its file is compared bit by bit with that of all four merged at once. The shares are of one cell, of
 * two cells with the same sample ranges, and of two cells with different ones. */
TEST(any_grouping_has_the_same_bits)
{
    static const struct part cases[][MAX_SHARES] = {{{.layers = true, ALL, 0, 7},
                                                     {.layers = true, ALL, 7, 40},
                                                     {.layers = true, ALL, 40, 41},
                                                     {.layers = true, ALL, 41, 97}},
                                                    {{.x = 0, 0, 1, 2, 0, 7},
                                                     {.x = 1, 0, 3, 2, 0, 7, .layers = true},
                                                     {.x = 0, 0, 1, 2, 7, 33},
                                                     {.x = 1, 0, 3, 2, 7, 33}},
                                                    {{.x = 0, 0, 4, 1, 0, 7, .layers = true},
                                                     {.x = 0, 1, 4, 1, 0, 11, .layers = true},
                                                     {.x = 0, 0, 4, 1, 7, 33, .layers = true},
                                                     {.x = 0, 1, 4, 1, 11, 33, .layers = true}}};
    static const char *const grouping[][4] = {
        {"3210"}, {"01", "24", "35"}, {"31", "20", "54"}, {"23", "14", "50"}};
    /* Of the third case only cells that have been made whole can be put beside each other. */
    static const char *const by_cell[][4] = {{"3210"}, {"02", "31", "45"}, {"13", "240"}};
    for (size_t c = 0; c < COUNT(cases); c++) {
        size_t num = c == 0 ? 4 : 3;
        OWN(image) first = {0};
        for (int k = 0; k < MAX_SHARES; k++)
            write_part(part_path(k), &cases[c][k]);
        for (size_t g = 0; g < num; g++) {
            int last = MAX_SHARES - 1;
            const char *const *steps = c == 0 ? grouping[g] : by_cell[g];
            for (int i = 0; i < 4 && steps[i] != NULL; i++)
                merge_files(steps[i], ++last);
            struct image im;
            read_floats(part_path(last), &im);
            size_t bytes = (size_t)im.width * (size_t)im.height * (size_t)im.channels * 4;
            if (g == 0)
                first = im;
            else if (im.channels != first.channels || memcmp(im.data, first.data, bytes) != 0)
                fail_msg("case %zu, grouping %zu: other bits", c, g);
            if (g > 0)
                image_free(&im);
        }
    }
}

/* Control for the test above: a merge stored without its parts is merged further from rounded sums, and the bits
 * differ. */
TEST(rounded_sums_have_other_bits)
{
    struct share whole[2] = {{0}, {0}}, share[MAX_SHARES] = {0};
    struct err e;
    for (int k = 0; k < 3; k++)
        write_part(
            part_path(k),
            &(struct part){.x = 0, 0, 4, 2, (uint32_t)(k * k), (uint32_t)((k + 1) * (k + 1))});
    for (int g = 0; g < 2; g++) {
        if (g == 1) {
            merge_files("01", 3);
            OWN(image) im;
            read_floats(part_path(3), &im);
            for (int i = 0; i < im.num_attrs; i++)
                if (strcmp(im.attr[2 * i], "assay:parts") == 0)
                    im.attr[2 * i][0] = 'x';
            MUST(image_write_exr(part_path(3), &im, &e));
        }
        for (int i = 0; i < 3 - g; i++)
            MUST(share_read(part_path(g == 0 ? i : 3 - i), &share[i], &e));
        assert_true(merge_shares(share, 3 - g, &whole[g], &e));
        for (int i = 0; i < 3 - g; i++)
            share_free(&share[i]);
    }
    size_t values = 3 * WIDTH * HEIGHT;
    assert_memory_not_equal(whole[0].m.m3, whole[1].m.m3, values * sizeof(double));
    share_free(&whole[0]);
    share_free(&whole[1]);
}

TEST(refusals)
{
    static const struct {
        const char *why;
        struct part part[MAX_SHARES];
    } cases[] = {
        {"both have samples 6:7", {{ALL, 0, 7}, {ALL, 6, 9}}},
        {"samples 5:6", {{ALL, 0, 2, "0:1,5:6"}, {ALL, 3, 9}}},
        {"different seed: '1' and '2'", {{ALL, 0, 7}, {ALL, 7, 9, .seed = "2"}}},
        {"different adaptive", {{ALL, 0, 7}, {ALL, 7, 9, .adaptive = "rule 2 1"}}},
        {"do not add up",
         {{ALL, 0, 7, .adaptive = "rule 2 1"}, {ALL, 7, 9, .adaptive = "rule 2 1"}}},
        {"overlap without", {{.x = 0, 0, 3, 2, 0, 7}, {.x = 2, 0, 2, 2, 0, 7}}},
        {"open", {{.x = 0, 0, 1, 2, 0, 7}, {.x = 2, 0, 2, 2, 0, 7}}},
        {"same samples in all", {{.x = 0, 0, 2, 2, 0, 7}, {.x = 2, 0, 2, 2, 0, 8}}},
        {"not sample ranges", {{ALL, 0, 7, "7:0"}, {ALL, 7, 9}}},
        {"not sample ranges", {{ALL, 0, 7, "0:7x"}, {ALL, 7, 9}}},
        {"not sample ranges", {{ALL, 0, 7, ":"}, {ALL, 7, 9}}},
        {"which part of which image", {{.x = 1, 0, 4, 2, 0, 7}, {ALL, 7, 9}}},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        struct share whole = {0};
        struct err e = {0};
        REFUSES(merge(cases[i].part, num_parts(cases[i].part), &whole, &e), cases[i].why);
    }
}
