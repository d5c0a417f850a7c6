/* Histories of runs made by hand: what moved is found with the z worked out in the comments, what did not is
 * left alone, and a file that is no run is an error. */
#include "tools/results/history.h"

#include "reference/base/json_file.h"
#include "renderer/base/fs.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

static const char *in_dir(const char *dir, const char *name)
{
    return test_path(fs_path("%s/%s", dir, name).s);
}

/* A claim with that difference, an interval of +-0.004 at alpha 1e-4. */
static json_t *claim_of(const char *scene, double difference)
{
    json_t *c = json_load_file("tests/tools/results/claim.json", 0, NULL);
    assert_non_null(c);
    json_t *more = json_pack("{ss sf s[ff] sf sf s{sf s[ff]}}", "scene", scene, "difference",
                             difference, "ci", difference - 0.004, difference + 0.004, "n_a", 64.0,
                             "seconds_a", 2.0, "variance_ratio", "ratio", 1.6, "ci", 1.5, 1.7);
    assert_int_equal(json_object_update_new(c, more), 0);
    return c;
}

/* Takes over the claims. */
static void write_run(const char *dir, const char *name, const char *date, json_t *claims)
{
    struct err e;
    json_auto_t *root = json_pack("{si ss ss ss sf ss so}", "assay", 1, "command", "assay validate",
                                  "version", "0.1 (commit abc123)", "date", date, "alpha", 1e-3,
                                  "machine", "<b>2 x CPU</b>", "claims", claims);
    MUST(json_write(in_dir(dir, name), root, &e));
}

static void read_or_fail(const char *dir, struct history *h)
{
    struct err e;
    MUST(history_read(test_path(dir), 1e-3, h, &e));
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
    for (size_t i = 0; i < 3; i++) {
        write_run(
            "three", name[i], date[i],
            json_pack("[oo]", claim_of("10_still", still[i]), claim_of("20_<i>moves", moving[i])));
    }
    test_write(in_dir("three", "b/other.json"), "not a run", 9);
    OWN(history) h;
    read_or_fail("three", &h);
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
    history_version(&h.run[0], commit, sizeof commit);
    assert_string_equal(commit, "abc123");

    struct err e;
    MUST(report_history(&h, test_path("history.html"), &e));
    OWN_TEXT text = test_read(test_path("history.html"));
    assert_non_null(strstr(text, "1 of 2 claims have moved in the last of 3 runs."));
    assert_null(strstr(text, "<i>moves"));
    assert_null(strstr(text, "<b>2 x CPU"));
    assert_null(strstr(text, "<script"));
    assert_non_null(strstr(text, "20_&lt;i&gt;moves"));
}

/* The runs of an engine that states its version, which the last could not compare the variances of. */
TEST(the_version_is_that_of_what_is_tested)
{
    json_t *first = claim_of("10_it", 0.001), *last = claim_of("10_it", 0.001);
    json_object_set_new(first, "version_a", json_string("1.4-2-gabc"));
    json_object_set_new(last, "version_a", json_string("1.5"));
    json_object_del(last, "variance_ratio");
    write_run("versions", "1/results.json", "2026-01-01T00:00:00Z", json_pack("[o]", first));
    write_run("versions", "2/results.json", "2026-01-02T00:00:00Z", json_pack("[o]", last));
    OWN(history) h;
    read_or_fail("versions", &h);
    struct err e;
    MUST(report_history(&h, test_path("versions.html"), &e));
    OWN_TEXT text = test_read(test_path("versions.html"));
    assert_non_null(strstr(text, "<td>1.4-2-gabc</td>"));
    assert_non_null(strstr(text, "<td>1.5</td>"));
    assert_non_null(strstr(text, "last not known"));
    assert_null(strstr(text, "nan"));
    assert_null(strstr(text, "abc123"));
}

/* A series that the last run lacks, or that has only one run, has not moved. */
TEST(no_move_without_two_points)
{
    write_run("two", "1/results.json", "2026-01-01T00:00:00Z",
              json_pack("[o]", claim_of("10_gone", 0.5)));
    write_run("two", "2/results.json", "2026-01-02T00:00:00Z",
              json_pack("[o]", claim_of("20_new", -0.5)));
    OWN(history) h;
    read_or_fail("two", &h);
    assert_int_equal(h.num_series, 2);
    assert_int_equal(h.moved, 0);
    assert_float_equal(h.series[0].z, 0, 0);
}

TEST(bad_input_is_named)
{
    struct history h;
    struct err e = {""};
    assert_true(fs_make_parent_dirs(test_path("bad/x/results.json"), &e));
    REFUSES(history_read(test_path("bad"), 1e-3, &h, &e), "no results.json");
    test_write(test_path("bad/x/results.json"), "{\"score\": 3}", 12);
    REFUSES(history_read(test_path("bad"), 1e-3, &h, &e), "x/results.json");
    REFUSES(history_read("/nowhere/at-all", 1e-3, &h, &e), "/nowhere/at-all");
    write_run("same", "results.json", "2026-01-01T00:00:00Z",
              json_pack("[oo]", claim_of("10_same", 0.1), claim_of("10_same", 0.2)));
    REFUSES(history_read(test_path("same"), 1e-3, &h, &e), "is there twice");
}
