/* Histories of runs made by hand: what moved is found with the z worked out in the comments, what did not is
 * left alone, and a file that is no run is an error. */
#include "tools/results/history.h"

#include "renderer/base/fs.h"
#include "tests/support/test.h"

struct place {
    char dir[64];
};

static struct place place_make(void)
{
    struct place p;
    strcpy(p.dir, "/tmp/test_history_XXXXXX");
    assert_non_null(mkdtemp(p.dir));
    return p;
}

static void place_free(const struct place *p)
{
    struct err e;
    assert_true(fs_remove_tree(p->dir, &e));
}

static void write_text(const struct place *p, const char *name, const char *text)
{
    char path[256];
    struct err e = {""};
    snprintf(path, sizeof path, "%s/%s", p->dir, name);
    assert_true(fs_make_parent_dirs(path, &e));
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fputs(text, f);
    assert_int_equal(fclose(f), 0);
}

/* A claim with that difference, an interval of +-0.004 at alpha 1e-4 and nothing else of interest. */
static json_t *claim_of(const char *scene, double difference)
{
    json_t *c = json_pack(
        "{ss ss ss ss ss ss sb sf sf sf si sf s[ff] s[fff] sf sf sf si ss sf sf sb si si s[] s[] s[]}",
        "scene", scene, "quantity", "mean", "a", "pathtracer", "b", "cycles", "expected",
        "EQUIVALENT", "verdict", "EQUIVALENT", "passed", 1, "alpha", 1e-4, "margin_global", 0.01,
        "margin_tile", 0.02, "tile", 16, "difference", difference, "ci", difference - 0.004,
        difference + 0.004, "channel_difference", 0.0, 0.0, 0.0, "log10_p", -0.3, "mdb_global",
        0.02, "mdb_tile", 0.03, "num_tests", 9, "reason", "as declared", "rms_bias", 0.0,
        "extra_factor", 1.0, "skew_limited", 0, "tiles_x", 1, "tiles_y", 1, "tile_log10_p",
        "tile_t", "statistics");
    assert_non_null(c);
    json_array_append_new(json_object_get(c, "tile_log10_p"), json_real(-0.1));
    json_array_append_new(json_object_get(c, "tile_t"), json_real(0.2));
    json_array_append_new(json_object_get(c, "statistics"),
                          json_pack("{ss sf si sf ss}", "name", "image", "share", 1.0, "num_tests",
                                    4, "log10_p", -0.1, "what", "the image"));
    json_object_set_new(c, "worst_tile",
                        json_pack("{si si sf s[ff] sf}", "x", 0, "y", 0, "difference", 0.0, "ci",
                                  0.0, 0.0, "t", 0.0));
    json_object_set_new(c, "worst",
                        json_pack("{si si si si si sf s[ff] sf}", "x", 0, "y", 0, "width", 1,
                                  "height", 1, "channel", 3, "difference", 0.0, "ci", 0.0, 0.0, "t",
                                  0.0));
    json_object_set_new(c, "files",
                        json_pack("{ss ss ss ss}", "a", "a", "b", "b", "z", "z", "relative", "r"));
    json_object_set_new(c, "n_a", json_real(64));
    json_object_set_new(c, "seconds_a", json_real(2));
    json_object_set_new(c, "variance_ratio", json_pack("{sf s[ff]}", "ratio", 1.6, "ci", 1.5, 1.7));
    return c;
}

/* Takes over the claims. */
static void write_run(const struct place *p, const char *name, const char *date, json_t *claims)
{
    json_t *root = json_pack("{si ss ss ss sf ss so}", "assay", 1, "command", "assay validate",
                             "version", "0.1 (commit abc123)", "date", date, "alpha", 1e-3,
                             "machine", "<b>2 x CPU</b>", "claims", claims);
    assert_non_null(root);
    char *text = json_dumps(root, 0);
    write_text(p, name, text);
    free(text);
    json_decref(root);
}

static void read_or_fail(const struct place *p, struct history *h)
{
    struct err e = {""};
    MUST(history_read(p->dir, 1e-3, h, &e));
}

/* Differences 0.001, 0.003 (mean 0.002), then 0.010. A standard error is 0.004 / 3.719016, the normal quantile
 * of 1e-4: 0.00107555. z = 0.008 / (0.00107555 sqrt(1 + 1/2)) = 6.0731. Critical for two series at 1e-3: the
 * quantile of 2.5e-4, 3.480756. The other series: 0.0025 after 0.002, z = 0.0005 / (0.00107555 sqrt 1.5). */
TEST(a_move_is_found)
{
    static const double moving[] = {0.010, 0.001, 0.003}, still[] = {0.0025, 0.002, 0.002};
    static const char *const name[] = {"late/results.json", "a/deep/results.json",
                                       "b/results.json"};
    static const char *const date[] = {"2026-03-01T00:00:00Z", "2026-01-01T00:00:00Z",
                                       "2026-02-01T00:00:00Z"};
    struct place p = place_make();
    for (size_t i = 0; i < 3; i++) {
        json_t *claims = json_array();
        json_array_append_new(claims, claim_of("10_still", still[i]));
        json_array_append_new(claims, claim_of("20_<i>moves", moving[i]));
        write_run(&p, name[i], date[i], claims);
    }
    write_text(&p, "b/other.json", "not a run");
    struct history h;
    read_or_fail(&p, &h);
    assert_int_equal(h.num_runs, 3);
    assert_string_equal(h.run[0].path, "a/deep/results.json");
    assert_string_equal(h.run[2].path, "late/results.json");
    assert_int_equal(h.num_series, 2);
    assert_int_equal(h.moved, 1);
    assert_float_equal(h.critical, 3.480756, 1e-5);
    assert_string_equal(h.series[0].scene, "20_<i>moves");
    assert_float_equal(h.series[0].z, 6.0731, 1e-3);
    assert_float_equal(h.series[0].earlier, 0.002, 1e-12);
    assert_float_equal(h.series[1].z, 0.0005 / (0.00107555 * sqrt(1.5)), 1e-3);
    /* 64 paths in 2 s, each worth 1/1.6 of one of B. */
    assert_float_equal(h.series[0].point[1].efficiency, 64 / (2 * 1.6), 1e-9);
    char commit[32];
    history_commit(&h.run[0], commit, sizeof commit);
    assert_string_equal(commit, "abc123");

    char page[128], *text = calloc(1, 1 << 20);
    struct err e = {""};
    snprintf(page, sizeof page, "%s/history.html", p.dir);
    assert_true(report_history(&h, page, &e));
    FILE *f = fopen(page, "rb");
    assert_true(f != NULL && text != NULL);
    assert_true(fread(text, 1, (1 << 20) - 1, f) > 1000);
    fclose(f);
    assert_non_null(strstr(text, "1 of 2 claims have moved in the last of 3 runs."));
    assert_null(strstr(text, "<i>moves"));
    assert_null(strstr(text, "<b>2 x CPU"));
    assert_null(strstr(text, "<script"));
    assert_non_null(strstr(text, "20_&lt;i&gt;moves"));
    free(text);
    history_free(&h);
    place_free(&p);
}

/* What the last run does not have, and one run alone, moved nowhere. */
TEST(no_move_without_two_points)
{
    struct place p = place_make();
    json_t *first = json_array(), *last = json_array();
    json_array_append_new(first, claim_of("10_gone", 0.5));
    json_array_append_new(last, claim_of("20_new", -0.5));
    write_run(&p, "1/results.json", "2026-01-01T00:00:00Z", first);
    write_run(&p, "2/results.json", "2026-01-02T00:00:00Z", last);
    struct history h;
    read_or_fail(&p, &h);
    assert_int_equal(h.num_series, 2);
    assert_int_equal(h.moved, 0);
    assert_float_equal(h.series[0].z, 0, 0);
    history_free(&h);
    place_free(&p);
}

TEST(bad_input_is_named)
{
    struct place p = place_make();
    struct history h;
    struct err e = {""};
    assert_false(history_read(p.dir, 1e-3, &h, &e));
    assert_non_null(strstr(e.msg, "no results.json"));
    write_text(&p, "x/results.json", "{\"score\": 3}");
    assert_false(history_read(p.dir, 1e-3, &h, &e));
    assert_non_null(strstr(e.msg, "x/results.json"));
    assert_false(history_read("/nowhere/at-all", 1e-3, &h, &e));
    assert_non_null(strstr(e.msg, "/nowhere/at-all"));
    place_free(&p);

    p = place_make();
    json_t *twice = json_array();
    json_array_append_new(twice, claim_of("10_same", 0.1));
    json_array_append_new(twice, claim_of("10_same", 0.2));
    write_run(&p, "results.json", "2026-01-01T00:00:00Z", twice);
    assert_false(history_read(p.dir, 1e-3, &h, &e));
    assert_non_null(strstr(e.msg, "is there twice"));
    place_free(&p);
}
