/* Every allocation fails in turn in what reads the sides of a comparison and puts shares of a picture together. */
#include "tests/support/alloc_fail.h"
#include "tests/support/simulate.h"

#include "reference/base/image_oiio.h"
#include "renderer/base/fs.h"
#include "tools/input/input.h"
#include "tools/jobs/merge.h"
#include "tools/images/replicate_dir.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { SIDE = 32 };

static char dir[] = "/tmp/test_memory_inputs_XXXXXX";
static char path_text[4][128];

static const char *file(int slot, const char *name)
{
    snprintf(path_text[slot], sizeof path_text[slot], "%s/%s", dir, name);
    return path_text[slot];
}

static int make_place(void **state)
{
    struct err e;
    (void)state;
    alloc_json(ALLOC_JSON_ENDS, NULL);
    /* OpenImageIO is loaded once and for good, and keeps what it then asks for. */
    return mkdtemp(dir) == NULL || image_oiio_version(&e) == NULL;
}

static int remove_place(void **state)
{
    struct err e;
    alloc_fail_sum(state);
    return !fs_remove_tree(dir, &e);
}

static void hold(double *right, double sum)
{
    if (*right == 0)
        *right = sum;
    assert_true(sum == *right);
}

struct side {
    const char *path;
    struct input_options opt;
    double sum;
};

static bool read_side(void *ctx, struct err *e)
{
    struct side *s = ctx;
    struct input in = {0};
    struct notes notes = {0};
    bool ok = input_read(s->path, 'a', &s->opt, &in, &notes, e);
    alloc_fail_off();
    if (ok) {
        hold(&s->sum, 1 + in.m.mean[0] + in.m.mean[4] + notes.num);
        input_free(&in);
    }
    return ok;
}

static bool pair_sides(void *ctx, struct err *e)
{
    struct side *s = ctx;
    struct input a = {0}, b = {0};
    struct notes notes = {0};
    alloc_fail_off();
    assert_true(input_read(file(0, "one.pfm"), 'a', &s->opt, &a, &notes, e) &&
                input_read(file(1, "two.pfm"), 'b', &s->opt, &b, &notes, e));
    alloc_fail_on();
    bool ok = input_pair(&a, &b, &notes, e);
    alloc_fail_off();
    if (ok)
        hold(&s->sum, a.m.m2[7] + b.m.m3[8]);
    input_free(&a);
    input_free(&b);
    return ok;
}

static bool read_renders(void *ctx, struct err *e)
{
    double *right = ctx;
    struct replicate_dir r = {0};
    struct moments m = {0};
    bool ok = replicate_dir_read(file(0, "replicates"), &r, e) && replicate_dir_moments(&r, &m, e);
    alloc_fail_off();
    if (ok)
        hold(right, m.mean[5] + m.m2[6] + r.num);
    replicate_dir_free(&r);
    moments_free(&m);
    return ok;
}

static void write_pfm(const char *path, uint64_t seed)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fprintf(f, "PF\n%d %d\n-1\n", SIDE, SIDE);
    for (int i = 0; i < 3 * SIDE * SIDE; i++) {
        float v = (float)draw(LAW_EXPONENTIAL, &seed);
        fwrite(&v, sizeof v, 1, f);
    }
    assert_int_equal(fclose(f), 0);
}

/* OpenImageIO looks at all but our own moments; where its own memory is out it may end the program. So only our allocations fail. */
static void inputs(void **state)
{
    (void)state;
    struct err e;
    struct moments m = new_moments(SIDE, SIDE, "sample");
    uint64_t seed = 5;
    simulate(&m, LAW_EXPONENTIAL, 1, 16, false, &seed);
    assert_true(moments_write(file(0, "m.exr"), &m, NULL, 0, &e) &&
                fs_make_parent_dirs(file(1, "replicates/x"), &e));
    moments_free(&m);
    write_pfm(file(1, "one.pfm"), 1);
    write_pfm(file(1, "two.pfm"), 2);
    write_pfm(file(1, "replicates/1.pfm"), 3);
    write_pfm(file(1, "replicates/2.pfm"), 4);
    write_pfm(file(1, "replicates/3.pfm"), 5);
    struct side side[] = {{file(2, "m.exr"), {0}, 0},
                          {file(3, "one.pfm"), {0}, 0},
                          {"tests/fuzz/seeds/picture.png", {.curve = "srgb"}, 0}};
    for (size_t i = 0; i < sizeof side / sizeof side[0]; i++)
        alloc_fail_each(strrchr(side[i].path, '/') + 1, i == 0 ? ALLOC_ALL : ALLOC_OURS, read_side,
                        &side[i]);
    struct side pair = {.sum = 0};
    alloc_fail_each("input_pair", ALLOC_OURS, pair_sides, &pair);
    double right = 0;
    alloc_fail_each("renders_read, replicate_dir_moments", ALLOC_OURS, read_renders, &right);
}

static void write_share(const char *path, const char *cell, const char *samples, uint64_t seed)
{
    struct moments m = new_moments(4, 2, "sample");
    struct err e = {0};
    simulate(&m, LAW_EXPONENTIAL, 1, 4, false, &seed);
    const struct image_attr attrs[] = {{"assay:version", "1"},   {"assay:scene", "s"},
                                       {"assay:settings", "t"},  {"assay:seed", "1"},
                                       {"assay:cell", cell},     {"assay:samples", samples},
                                       {"assay:adaptive", "off"}};
    assert_true(moments_write(path, &m, attrs, sizeof attrs / sizeof attrs[0], &e));
    moments_free(&m);
}

static bool merge(void *ctx, struct err *e)
{
    double *right = ctx;
    struct share share[3] = {{0}}, whole = {0};
    bool ok = share_read(file(0, "s0.exr"), &share[0], e) &&
              share_read(file(1, "s1.exr"), &share[1], e) && merge_shares(share, 2, &whole, e) &&
              share_write(file(2, "merged/m.exr"), &whole, "assay merge", e);
    alloc_fail_off();
    if (ok) {
        assert_true(share_read(file(3, "merged/m.exr"), &share[2], e));
        hold(right, share[2].m.mean[5] + share[2].m.m2[6] + share[2].num_parts);
    }
    alloc_fail_output(file(2, "merged/m.exr"), ok);
    share_free(&share[0]);
    share_free(&share[1]);
    share_free(&share[2]);
    share_free(&whole);
    return ok;
}

static void merging(void **state)
{
    (void)state;
    struct err e;
    double right = 0;
    assert_true(fs_make_parent_dirs(file(0, "merged/x"), &e));
    write_share(file(0, "s0.exr"), "0 0 4 2 of 4 2", "0:4", 1);
    write_share(file(0, "s1.exr"), "0 0 4 2 of 4 2", "4:8", 2);
    alloc_fail_each("share_read, merge_shares, share_write", ALLOC_ALL, merge, &right);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(inputs, alloc_fail_tell),
        cmocka_unit_test_teardown(merging, alloc_fail_tell),
    };
    return cmocka_run_group_tests(tests, make_place, remove_place);
}
