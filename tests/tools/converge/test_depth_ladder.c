/* The depth ladder of a furnace, whose radiance at depth d is E (1 - rho^(d+1))/(1 - rho), rendered by the program
 * beside this test; and its plot, read back by libxml2. */
#include "reference/suite/suite.h"
#include "renderer/base/fs.h"
#include "tools/converge/depth_ladder.h"
#include "tests/support/suite_files.h"
#include "tests/support/own.h"
#include "tests/support/test.h"
#include "tools/plots/plot_convergence.h"
#include "tools/results/convergence_results.h"

#include <libgen.h>

#include <libxml/HTMLparser.h>
#include <libxml/xpath.h>

static double number(const json_t *rungs, size_t i, const char *name)
{
    const json_t *v = json_object_get(json_array_get(rungs, i), name);
    assert_true(json_is_number(v));
    return json_number_value(v);
}

/* H0: the mean luminance at each depth is the closed form of the suite's 11_furnace, within its standard error (an
 * upper bound) and 1e-5 for single precision. alpha 1e-6 two-sided over 6 depths: 5.2 standard errors. n: 16 x 16
 * pixels of 16 samples, one seed. Control: one bounce more or fewer, at least 0.8^6/2 in red (0.04 in luminance), is
 * always rejected. */
TEST(furnace)
{
    struct err e = {""};
    char self[4096], program[4200];
    ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    assert_true(n > 0);
    self[n] = '\0';
    snprintf(program, sizeof program, "%.4000s/../pathtracer", dirname(self));
    assert_true(fs_make_dirs(test_path("work"), &e));
    const struct suite_scene *scene = suite_shipped_scene("11_furnace");
    struct suite_scene small = *scene;
    small.width = small.height = 16;
    const struct converge_job job = {.scene = &small,
                                     .pathtracer = program,
                                     .dir = test_path("work"),
                                     .seed = 1,
                                     .threads = 1,
                                     .timeout_s = 60};
    json_t *depths;
    MUST(depth_ladder_measure(&job, suite_reference_of(scene, "truth"), 16, &depths, &e));
    assert_true(convergence_results_check_depths(depths, "x", &e));
    const json_t *rungs = json_object_get(depths, "rungs");
    assert_int_equal(json_array_size(rungs), 6);
    /* Emission 0.5, 1, 2 and albedo 0.8, 0.5, 0.2 (11_furnace.json). */
    static const double emission[3] = {0.5, 1, 2}, albedo[3] = {0.8, 0.5, 0.2};
    static const double luma[3] = {0.2126, 0.7152, 0.0722};
    double want[7];
    for (int d = 0; d < 7; d++) {
        want[d] = 0;
        for (int c = 0; c < 3; c++)
            want[d] += luma[c] * emission[c] * (1 - pow(albedo[c], d + 1)) / (1 - albedo[c]);
    }
    for (size_t d = 0; d < 6; d++) {
        double mean = number(rungs, d, "mean"),
               allowed = 5.2 * number(rungs, d, "se") + 1e-5 * want[d];
        assert_int_equal(number(rungs, d, "depth"), d);
        assert_true(fabs(number(rungs, d, "truth") - want[d]) < 1e-9);
        if (!(fabs(mean - want[d]) <= allowed))
            fail_msg("depth %zu: %g instead of %g, %g allowed", d, mean, want[d], allowed);
        assert_true(fabs(mean - want[d + 1]) > allowed);
        assert_true(d == 0 || fabs(mean - want[d - 1]) > allowed);
    }
    json_decref(depths);

    struct converge_job none = job;
    none.pathtracer = "/nonexistent";
    assert_false(depth_ladder_measure(&none, NULL, 16, &depths, &e));
}

static htmlDocPtr page_of(const char *json)
{
    json_auto_t *depths = json_loads(json, 0, NULL);
    OWN_TEXT text = NULL;
    struct err e = {""};
    assert_non_null(depths);
    assert_true(convergence_results_check_depths(depths, "x", &e));
    PRINTED(text, plot_depths(f, depths));
    htmlDocPtr doc = htmlReadMemory(text, (int)strlen(text), "x", "utf-8",
                                    HTML_PARSE_NOERROR | HTML_PARSE_NOWARNING);
    assert_non_null(doc);
    return doc;
}

static double evaluate(htmlDocPtr doc, const char *xpath)
{
    xmlXPathContext *c = xmlXPathNewContext(doc);
    xmlXPathObject *o = xmlXPathEvalExpression((const xmlChar *)xpath, c);
    assert_non_null(o);
    double v = xmlXPathCastToNumber(o);
    xmlXPathFreeObject(o);
    xmlXPathFreeContext(c);
    return v;
}

TEST(plot)
{
    htmlDocPtr doc = page_of(
        "{\"samples\": 64, \"rungs\": [{\"depth\": 0, \"mean\": 0, \"se\": 0, \"truth\": 0}, "
        "{\"depth\": 1, \"mean\": 1, \"se\": 0.1, \"truth\": 0.8}, "
        "{\"depth\": 3, \"mean\": 2, \"se\": 0.1}]}");
    assert_int_equal(evaluate(doc, "count(//circle[title])"), 3);
    /* In proportion: depth 1 at a third of the way to 3, mean 1 at half the way to 2. */
    double x[3], y[3];
    for (int i = 0; i < 3; i++) {
        char path[64];
        snprintf(path, sizeof path, "//circle[%d]/@cx", i + 1);
        x[i] = evaluate(doc, path);
        snprintf(path, sizeof path, "//circle[%d]/@cy", i + 1);
        y[i] = evaluate(doc, path);
    }
    assert_true(fabs((x[1] - x[0]) - (x[2] - x[0]) / 3) < 0.11 && x[2] - x[0] > 100);
    assert_true(fabs((y[0] - y[1]) - (y[0] - y[2]) / 2) < 0.11 && y[0] - y[2] > 100);
    /* (1 - 0.8)/0.1 */
    assert_int_equal(
        evaluate(doc, "count(//figcaption[contains(., 'known at 2 of 3 depths, at most 2 ')])"), 1);
    assert_int_equal(evaluate(doc, "count(//a[@download='depths.csv'])"), 1);
    xmlFreeDoc(doc);
    doc = page_of("{\"error\": \"<b>no\"}");
    assert_int_equal(evaluate(doc, "count(//p[contains(., '<b>no')])"), 1);
    xmlFreeDoc(doc);
}

TEST(bad_ladders)
{
    static const char *const bad[] = {
        "{}",
        "{\"samples\": 1, \"rungs\": []}",
        "{\"samples\": 1.5, \"rungs\": [{\"depth\": 0, \"mean\": 1, \"se\": 0}]}",
        "{\"samples\": 1, \"rungs\": [{\"depth\": -1, \"mean\": 1, \"se\": 0}]}",
        "{\"samples\": 1, \"rungs\": [{\"depth\": 0, \"mean\": 1, \"se\": -1}]}",
        "{\"samples\": 1, \"rungs\": [{\"depth\": 0, \"mean\": \"1\", \"se\": 0}]}",
        "{\"samples\": 1, \"rungs\": [{\"depth\": 0, \"mean\": 1, \"se\": 0, \"truth\": null}]}",
        "{\"samples\": 1, \"rungs\": [{\"depth\": 2, \"mean\": 1, \"se\": 0}, {\"depth\": 2, \"mean\": 1, \"se\": 0}]}",
    };
    for (size_t i = 0; i < COUNT(bad); i++) {
        struct err e = {""};
        json_auto_t *j = json_loads(bad[i], 0, NULL);
        assert_non_null(j);
        REFUSES(convergence_results_check_depths(j, "file: scene", &e), "file: scene: 'depths'");
    }
}
