/* Every allocation fails in turn, libraries included, in what reads and writes the documents of the harness: suites, engines,
 * rubrics, results, pages, histories, catalogues. jansson's memory: alloc_fail.h. */
#include "tests/support/alloc_fail.h"
#include "tests/support/simulate.h"

#include "reference/external/engine_description.h"
#include "reference/base/image_oiio.h"
#include "reference/suite/suite.h"
#include "renderer/base/fs.h"
#include "tools/results/claim_result.h"
#include "tools/validate/compare_job.h"
#include "tools/golden/export_job.h"
#include "tools/results/history.h"
#include "tools/report/report.h"
#include "tools/results/results.h"
#include "tools/grade/rubric.h"
#include "tools/base/hash_tree.h"

#include <libxml/xmlerror.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { SIDE = 16 };
#define RESULTS "tests/fuzz/seeds/results.json"

static char dir[] = "/tmp/test_memory_tools_XXXXXX";
static char path_text[4][256], json_output[256];

static const char *file(int slot, const char *name)
{
    snprintf(path_text[slot], sizeof path_text[slot], "%s/%s", dir, name);
    return path_text[slot];
}

static void copy(const char *from, const char *to)
{
    struct err e = {0};
    char bytes[65536];
    FILE *in = fopen(from, "rb"), *out = NULL;
    if (!fs_make_parent_dirs(to, &e) || (out = fopen(to, "wb")) == NULL || in == NULL)
        fail_msg("%s: cannot be copied to %s", from, to);
    size_t n = fread(bytes, 1, sizeof bytes, in);
    assert_int_equal(fwrite(bytes, 1, n, out), n);
    fclose(in);
    assert_int_equal(fclose(out), 0);
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

static bool load_suite(void *ctx, struct err *e)
{
    (void)ctx;
    struct suite s = {0};
    bool ok = suite_load(file(0, "scenes"), &s, e);
    alloc_fail_off();
    if (ok) {
        assert_int_equal(s.num_scenes, 2);
        assert_string_equal(s.scene[1].name, "41_cornell");
        suite_free(&s);
    }
    return ok;
}

static bool load_engine(void *ctx, struct err *e)
{
    struct engine en = {.json = NULL};
    bool ok = engine_load(ctx, &en, e);
    alloc_fail_off();
    assert_true(!ok || en.replicates > 0);
    if (ok)
        engine_free(&en);
    return ok;
}

static bool new_results(void *ctx, struct err *e)
{
    char *argv[] = {"compare", "a.exr", "b  c.exr", NULL};
    (void)ctx;
    json_t *root = claim_result_new_results(3, argv, 0.01, e);
    alloc_fail_off();
    assert_true(root == NULL ||
                strcmp(member_text(root, "command"), "assay compare a.exr 'b  c.exr'") == 0);
    json_decref(root);
    return root != NULL;
}

static bool read_rubric(void *ctx, struct err *e)
{
    static struct rubric r;
    static struct rubric_mistakes mistakes;
    bool ok = rubric_read("tests/end_to_end/quick.rubric", ctx, &r, &mistakes, e);
    alloc_fail_off();
    assert_true(!ok || (mistakes.num == 0 && rubric_points(&r) == 8));
    return ok;
}

static bool hash_a_tree(void *ctx, struct err *e)
{
    char hex[65], *right = ctx;
    bool ok = hash_tree(file(0, "scenes"), NULL, hex, e);
    alloc_fail_off();
    if (ok && right[0] == '\0')
        strcpy(right, hex);
    assert_true(!ok || strcmp(right, hex) == 0);
    return ok;
}

static void descriptions(void **state)
{
    (void)state;
    struct suite suite;
    struct err e = {0};
    char hex[65] = "";
    static const char *const name[] = {"12_point_plane", "41_cornell"};
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++) {
            char from[100], to[100];
            snprintf(from, sizeof from, "reference/scenes/%s.%s", name[i], k ? "dae" : "json");
            snprintf(to, sizeof to, "scenes/%s.%s", name[i], k ? "dae" : "json");
            copy(from, file(0, to));
        }
    alloc_fail_each("suite_load", ALLOC_ALL, load_suite, NULL);
    alloc_fail_each("tree_hash", ALLOC_ALL, hash_a_tree, hex);
    alloc_fail_each("engine_load", ALLOC_ALL, load_engine, "tests/fuzz/seeds/engine1.json");
    assert_true(suite_load(file(0, "scenes"), &suite, &e));
    alloc_fail_each("rubric_read", ALLOC_ALL, read_rubric, &suite);
    suite_free(&suite);
}

static bool read_results(void *ctx, struct err *e)
{
    (void)ctx;
    json_t *results = NULL;
    bool ok =
        results_read(RESULTS, &results, e) && junit_write(file(0, "out/junit.xml"), results, e);
    alloc_fail_off();
    alloc_fail_output(file(0, "out/junit.xml"), ok);
    json_decref(results);
    return ok;
}

static void results(void **state)
{
    (void)state;
    struct err e;
    assert_true(fs_make_parent_dirs(file(0, "out/x"), &e));
    alloc_json(ALLOC_JSON_FAILS, NULL);
    alloc_fail_each("results_new, jansson too", ALLOC_ALL, new_results, NULL);
    alloc_json(ALLOC_JSON_ENDS, NULL);
    alloc_fail_each("results_read, junit_write", ALLOC_OURS, read_results, NULL);
    /* libxml2's writer loses blocks where its lists fail. */
    alloc_fail_each("the same, libxml2 too", ALLOC_LOSSY, read_results, NULL);
}

static bool compare_files(void *ctx, struct err *e)
{
    (void)ctx;
    char *argv[] = {"compare", "a.exr", "b.exr", NULL};
    struct compare_job job = {
        .path = {file(0, "a.exr"), file(1, "b.exr")},
        .opt = {.alpha = 1e-3, .margin_global = 0.2, .margin_tile = 0.9, .tile = SIDE}};
    struct compared c = {0};
    bool ok = compare_job_run(&job, &c, e);
    ok = ok &&
         compare_job_write_json(&job, &c, VERDICT_EQUIVALENT, file(2, "json/c.json"), 3, argv, e);
    alloc_fail_off();
    compare_job_free(&c);
    unlink(file(3, "json/c.json.z.exr"));
    unlink(file(3, "json/c.json.relative.exr"));
    if (ok) {
        json_t *r = NULL;
        assert_true(results_read(file(2, "json/c.json"), &r, e));
        json_decref(r);
    }
    alloc_fail_output(file(2, "json/c.json"), ok);
    return ok;
}

static bool write_report(void *ctx, struct err *e)
{
    long *right = ctx;
    bool ok = report_write(file(0, "report/c.json"), file(1, "page/index.html"), e);
    alloc_fail_off();
    if (ok) {
        FILE *f = fopen(file(1, "page/index.html"), "rb");
        assert_non_null(f);
        fseek(f, 0, SEEK_END);
        if (*right == 0)
            *right = ftell(f);
        assert_int_equal(*right, ftell(f));
        fclose(f);
    }
    alloc_fail_output(file(1, "page/index.html"), ok);
    return ok;
}

static void write_side(const char *path, uint64_t seed)
{
    struct err e;
    struct moments m = new_moments(SIDE, SIDE, "sample");
    simulate(&m, LAW_EXPONENTIAL, 1, 64, false, &seed);
    assert_true(moments_write(path, &m, NULL, 0, &e));
    moments_free(&m);
}

static void comparisons_and_reports(void **state)
{
    (void)state;
    struct err e = {0};
    long size = 0;
    char *argv[] = {"compare", "a.exr", "b.exr", NULL};
    write_side(file(0, "a.exr"), 1);
    write_side(file(0, "b.exr"), 2);
    assert_true(fs_make_parent_dirs(file(0, "json/x"), &e) &&
                fs_make_parent_dirs(file(0, "page/x"), &e));
    snprintf(json_output, sizeof json_output, "%s", file(0, "json/c.json"));
    alloc_json(ALLOC_JSON_ENDS, json_output);
    alloc_fail_each("compared_run, compare_job_write_json", ALLOC_ALL, compare_files, NULL);
    alloc_json(ALLOC_JSON_ENDS, NULL);
    struct compare_job job = {
        .path = {file(0, "a.exr"), file(1, "b.exr")},
        .opt = {.alpha = 1e-3, .margin_global = 0.2, .margin_tile = 0.9, .tile = SIDE}};
    struct compared c;
    assert_true(compare_job_run(&job, &c, &e) &&
                compare_job_write_json(&job, &c, VERDICT_EQUIVALENT, file(2, "report/c.json"), 3,
                                       argv, &e));
    compare_job_free(&c);
    snprintf(json_output, sizeof json_output, "%s", file(0, "page/index.html"));
    alloc_json(ALLOC_JSON_ENDS, json_output);
    alloc_fail_each("report_write", ALLOC_ALL, write_report, &size);
    alloc_json(ALLOC_JSON_ENDS, NULL);
}

static bool read_history(void *ctx, struct err *e)
{
    (void)ctx;
    struct history h = {0};
    bool ok = history_read(file(0, "history"), 0.01, &h, e);
    alloc_fail_off();
    assert_true(!ok || (h.num_runs == 2 && h.num_series == 2));
    alloc_fail_on();
    ok = ok && report_history(&h, file(1, "page/history.html"), e);
    alloc_fail_off();
    alloc_fail_output(file(1, "page/history.html"), ok);
    history_free(&h);
    return ok;
}

static void histories(void **state)
{
    (void)state;
    copy(RESULTS, file(0, "history/one/results.json"));
    copy(RESULTS, file(0, "history/two/results.json"));
    alloc_fail_each("history_read, report_history", ALLOC_ALL, read_history, NULL);
}

static bool export_scene(void *ctx, struct err *e)
{
    const char *out = ctx;
    char *argv[] = {"export", "-o", ctx, "reference/scenes/12_point_plane.dae", NULL};
    struct export_job s;
    bool ok = export_job_parse(4, argv, &s, e) && export_job_run(&s, e);
    alloc_fail_off();
    xmlResetLastError();
    alloc_fail_output(out, ok);
    return ok;
}

static void exports(void **state)
{
    (void)state;
    static const char *const name[] = {"exports/x.json", "exports/x.pov", "exports/x.pbrt"};
    struct err e = {0};
    assert_true(fs_make_parent_dirs(file(0, name[0]), &e));
    alloc_json(ALLOC_JSON_ENDS, NULL);
    for (int i = 0; i < 3; i++)
        alloc_fail_each("exporting_run", ALLOC_ALL, export_scene, (void *)file(0, name[i]));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(descriptions, alloc_fail_tell),
        cmocka_unit_test_teardown(results, alloc_fail_tell),
        cmocka_unit_test_teardown(comparisons_and_reports, alloc_fail_tell),
        cmocka_unit_test_teardown(histories, alloc_fail_tell),
        cmocka_unit_test_teardown(exports, alloc_fail_tell),
    };
    return cmocka_run_group_tests(tests, make_place, remove_place);
}
