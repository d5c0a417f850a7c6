/* Every allocation fails in turn in what keeps the catalogue of known bugs and names one. */
#include "tests/support/alloc_fail.h"

#include "renderer/base/fs.h"
#include "tools/diagnose/catalogue.h"
#include "tools/diagnose/diagnose.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char dir[] = "/tmp/test_memory_bugs_XXXXXX";
static char path_text[4][128];

static const char *file(int slot, const char *name)
{
    snprintf(path_text[slot], sizeof path_text[slot], "%s/%s", dir, name);
    return path_text[slot];
}

static int make_place(void **state)
{
    (void)state;
    alloc_json(ALLOC_JSON_ENDS, NULL);
    return mkdtemp(dir) == NULL;
}

static int remove_place(void **state)
{
    struct err e;
    alloc_fail_sum(state);
    return !fs_remove_tree(dir, &e);
}

/* Two bugs seen in one view of 16 x 12 cells: one brightens all, one the left half. */
static void make_catalogue(struct catalogue *c)
{
    static struct bug bug[2] = {{"all", "all is brighter", "Part 1", "0"},
                                {"half", "the left half is brighter", "Part 2", "1"}};
    static struct effect effect[2], *effects[2] = {&effect[0], &effect[1]};
    static struct view view = {.name = "a_view",
                               .scene = "12_point_plane",
                               .scene_sha256 = "0",
                               .width = 64,
                               .height = 48,
                               .spp = 64,
                               .renders = 1,
                               .correct = {.columns = 16, .rows = 12, .cell = 4, .n = 1024}};
    for (int i = 0; i < 3 * 16 * 12; i++) {
        view.correct.mean[i] = 1 + i % 16 / 3 * 0.1;
        view.correct.var[i] = 1e-6;
        view.correct.spread[i / 3] = 0.1;
        effect[0].mean[i] = 0.05f;
        effect[1].mean[i] = i / 3 % 16 < 8 ? 0.05f : 0;
        effect[0].var[i] = effect[1].var[i] = 1e-6f;
    }
    for (int f = 0; f < NUM_FACTS; f++)
        view.correct.fact[f] = effect[0].fact[f] = effect[1].fact[f] = NAN;
    effect[0].pixels = effect[1].pixels = true;
    view.effect = effects;
    *c = (struct catalogue){bug, 2, &view, 1};
}

static bool keep_catalogue(void *ctx, struct err *e)
{
    struct catalogue back = {0};
    bool ok = catalogue_write(file(0, "catalogue"), ctx, e) &&
              catalogue_read(file(1, "catalogue"), &back, e);
    alloc_fail_off();
    if (ok) {
        assert_int_equal(back.num_bugs, 2);
        assert_true(back.view[0].effect[1]->mean[0] > 0.04f);
        catalogue_free(&back);
    }
    unlink(file(2, "catalogue/a_view.exr"));
    alloc_fail_output(file(2, "catalogue/manifest.json"),
                      access(file(2, "catalogue/manifest.json"), F_OK) == 0);
    return ok;
}

static bool name_bug(void *ctx, struct err *e)
{
    const struct catalogue *c = ctx;
    const struct diagnose_options opt = {.alpha = 1e-6};
    struct observation clue = {
        .view = &c->view[0], .seen = c->view[0].correct, .is_consistent = true};
    struct diagnosis d;
    for (int i = 0; i < 3 * 16 * 12; i++) {
        clue.seen.mean[i] += (double)c->view[0].effect[1]->mean[i];
        clue.seen.var[i] = 1e-5;
    }
    bool ok = diagnose(c, &clue, 1, &opt, &d, e);
    alloc_fail_off();
    if (ok) {
        assert_int_equal(d.finding, FINDING_BUG);
        assert_int_equal(d.candidate[0].bug, 1);
    }
    return ok;
}

static void bugs(void **state)
{
    (void)state;
    struct err e;
    struct catalogue c;
    make_catalogue(&c);
    assert_true(fs_make_parent_dirs(file(0, "catalogue/x"), &e));
    alloc_fail_each("catalogue_write, catalogue_read", ALLOC_ALL, keep_catalogue, &c);
    alloc_fail_each("diagnose", ALLOC_ALL, name_bug, &c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(bugs, alloc_fail_tell),
    };
    return cmocka_run_group_tests(tests, make_place, remove_place);
}
