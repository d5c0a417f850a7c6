/* The report page. Its images are decoded again (how they look is for tests/browser), its markup is read by libxml2's HTML parser, its drawings against brute force. */
#include "tools/report/report.h"

#include "renderer/base/fs.h"
#include "renderer/image/moments.h"
#include "tools/report/report_internal.h"
#include "tools/html/plot_colour.h"
#include "tools/html/html.h"
#include "tools/html/page_assets.h"
#include "tools/plots/plot_interval.h"
#include "tools/results/results.h"
#include "tests/tools/images/layer_reader.h"
#include "tests/support/own.h"
#include "tests/support/simulate.h"
#include "tests/support/test.h"

#include <sys/stat.h>

#include <libxml/HTMLparser.h>
#include <libxml/xpath.h>
#include <nettle/base64.h>
#include <nettle/sha2.h>

struct run {
    char dir[128], results[160], page[160]; /* a directory of its own */
    json_t *claims;
    int left; /* to be judged; 0: the run has ended */
};

static struct run run_make(void)
{
    static int runs;
    struct run r = {.claims = json_array()};
    snprintf(r.dir, sizeof r.dir, "%.120s", test_path(fs_path("%d", runs++).s));
    snprintf(r.results, sizeof r.results, "%s/results.json", r.dir);
    snprintf(r.page, sizeof r.page, "%s/out/report.html", r.dir);
    return r;
}

static void run_free(struct run *r)
{
    json_decref(r->claims);
}

static void run_write_results(const struct run *r)
{
    struct err e = {""};
    json_auto_t *root =
        json_pack("{si ss ss ss sf ss ss sf sO}", "assay", 1, "command", "assay validate suite",
                  "version", "0.1 (abc)", "date", "2026-01-02T03:04:05Z", "alpha", 1e-3, "machine",
                  "2 x CPU", "mode", "golden", "seconds", 98.0, "claims", r->claims);
    assert_non_null(root);
    if (r->left > 0) {
        json_object_set_new(root, "unfinished", json_integer(r->left));
        json_object_set_new(root, "page_every_s", json_real(2.5));
    }
    MUST(json_write(r->results, root, &e));
}

enum { SPECIAL_X = 3, SPECIAL_Y = 5 };

/* All pixels grey 0.25 (with relative noise), and one that is (0.1, 0.05, 0.2). */
static void write_radiance(const struct run *r, const char *file, const char *unit, int side,
                           double noise_level, uint64_t seed)
{
    struct err e = {""};
    OWN(moments) m = new_moments(side, side, unit);
    char path[256];
    snprintf(path, sizeof path, "%s/%s", r->dir, file);
    size_t pixels = (size_t)side * (size_t)side;
    bool exact = strcmp(unit, "exact") == 0;
    for (size_t i = 0; i < 3 * pixels; i++) {
        m.mean[i] = 0.25 * (1 + noise_level * (uniform(&seed) - 0.5));
        m.m2[i] = exact ? 0 : 1;
    }
    for (size_t i = 0; i < pixels; i++)
        m.n[i] = exact ? 1 : 64;
    static const double special[3] = {0.1, 0.05, 0.2};
    memcpy(&m.mean[3 * (size_t)(SPECIAL_Y * side + SPECIAL_X)], special, sizeof special);
    if (!fs_make_parent_dirs(path, &e) || !moments_write(path, &m, NULL, 0, &e))
        fail_msg("%s", e.msg);
}

static void add_claim(struct run *r, const char *scene, const char *b, const char *expected,
                      const char *verdict, const char *const files[4])
{
    json_t *c = json_load_file("tests/tools/results/claim.json", 0, NULL);
    json_t *more = json_pack("{ss ss ss ss ss sb s{ss ss ss ss}}", "scene", scene, "title", scene,
                             "b", b, "expected", expected, "verdict", verdict, "passed",
                             strcmp(expected, verdict) == 0, "files", "a", files[0], "b", files[1],
                             "z", files[2], "relative", files[3]);
    assert_int_equal(json_object_update_new(c, more), 0);
    json_array_append_new(r->claims, c);
}

static void add_error(struct run *r, const char *scene, const char *b, const char *error)
{
    json_array_append_new(r->claims,
                          json_pack("{ss ss ss ss sb ss}", "scene", scene, "a", "pathtracer", "b",
                                    b, "expected", "EQUIVALENT", "passed", 0, "error", error));
}

static const char *const small_files[4] = {"data/s/a.exr", "data/s/b.exr", "data/s/z.exr",
                                           "data/s/rel.exr"};

static struct run run_of_small_files(void)
{
    struct run r = run_make();
    write_radiance(&r, small_files[0], "sample", 32, 0, 1);
    write_radiance(&r, small_files[1], "replicate", 32, 0, 2);
    return r;
}

static void count_error(void *user, const xmlError *error)
{
    /* HTML 5 and SVG elements are unknown to a parser of HTML 4; everything else counts. */
    if (error->code == XML_HTML_UNKNOWN_TAG)
        return;
    (*(int *)user)++;
    print_message("line %d: %s", error->line, error->message);
}

static htmlDocPtr parse_page(const char *path)
{
    int errors = 0;
    xmlSetStructuredErrorFunc(&errors, (xmlStructuredErrorFunc)(void (*)(void))count_error);
    htmlDocPtr doc = htmlReadFile(path, "UTF-8", HTML_PARSE_NONET);
    xmlSetStructuredErrorFunc(NULL, NULL);
    assert_non_null(doc);
    assert_int_equal(errors, 0);
    return doc;
}

/* The page of the run, read again. */
static htmlDocPtr run_report(const struct run *r)
{
    struct err e = {""};
    run_write_results(r);
    MUST(report_write(r->results, r->page, &e));
    return parse_page(r->page);
}

/* The nodes that an XPath selects; the caller frees with xmlXPathFreeObject. */
static xmlXPathObject *select_nodes(htmlDocPtr doc, const char *xpath)
{
    xmlXPathContext *context = xmlXPathNewContext(doc);
    assert_non_null(context);
    xmlXPathObject *found = xmlXPathEvalExpression(BAD_CAST xpath, context);
    assert_non_null(found);
    xmlXPathFreeContext(context);
    return found;
}

static int count_nodes(htmlDocPtr doc, const char *xpath)
{
    xmlXPathObject *found = select_nodes(doc, xpath);
    int n = found->nodesetval != NULL ? found->nodesetval->nodeNr : 0;
    xmlXPathFreeObject(found);
    return n;
}

/* The text of the index-th node of an XPath; the caller frees. */
static char *text_of(htmlDocPtr doc, const char *xpath, int index)
{
    xmlXPathObject *found = select_nodes(doc, xpath);
    if (found->nodesetval == NULL || found->nodesetval->nodeNr <= index)
        fail_msg("no node %d of %s", index, xpath);
    xmlChar *text = xmlNodeGetContent(found->nodesetval->nodeTab[index]);
    assert_non_null(text);
    char *copy = strdup((const char *)text);
    xmlFree(text);
    xmlXPathFreeObject(found);
    return copy;
}

static void assert_text_has(htmlDocPtr doc, const char *xpath, int index, const char *wanted)
{
    OWN_TEXT text = text_of(doc, xpath, index);
    if (strstr(text, wanted) == NULL)
        fail_msg("%s [%d] is '%s', without '%s'", xpath, index, text, wanted);
}

static uint8_t *decode_base64(const char *text, size_t *size)
{
    struct base64_decode_ctx ctx;
    base64_decode_init(&ctx);
    uint8_t *bytes = malloc(BASE64_DECODE_LENGTH(strlen(text)) + 1);
    assert_non_null(bytes);
    *size = BASE64_DECODE_LENGTH(strlen(text));
    assert_true(base64_decode_update(&ctx, size, bytes, strlen(text), text));
    assert_true(base64_decode_final(&ctx));
    return bytes;
}

TEST(numbers_and_text)
{
    assert_string_equal(html_percent_column(0.0123).s, "+1.230");
    assert_string_equal(html_percent_column(-0.25).s, "\u221225.000");
    assert_string_equal(html_percent_column(-0.000001).s, "0.000");
    assert_string_equal(html_percent_prose(-0.012345).s, "\u22121.23\u00a0%");
    assert_string_equal(html_percent_plain(0.005).s, "0.5\u00a0%");
    assert_string_equal(html_number(-22.44).s, "\u221222.4");
    assert_string_equal(html_duration(0.52).s, "0.5 s");
    assert_string_equal(html_duration(98.1).s, "1 min 38 s");
    assert_string_equal(html_duration(7380).s, "2 h 3 min");

    char *text = NULL;
    size_t size;
    PRINTED(text, html_text(f, "<a href=\"x\">'&\x1b\n\xc3\xa4"), html_text(f, NULL));
    assert_string_equal(text, "&lt;a href=&quot;x&quot;&gt;&#39;&amp; \n\xc3\xa4");
    free(text);

    /* RFC 4648 section 10, and a length beyond one chunk. */
    static const char *const vector[][2] = {
        {"f", "Zg=="}, {"fo", "Zm8="}, {"foo", "Zm9v"}, {"foob", "Zm9vYg=="}};
    for (size_t i = 0; i < 4; i++) {
        PRINTED(text, html_base64(f, vector[i][0], strlen(vector[i][0])));
        assert_string_equal(text, vector[i][1]);
        free(text);
    }
    enum { LONG = 10001 };
    uint8_t *bytes = malloc(LONG);
    assert_non_null(bytes);
    for (size_t i = 0; i < LONG; i++)
        bytes[i] = (uint8_t)(i * 37);
    PRINTED(text, html_base64(f, bytes, LONG));
    uint8_t *back = decode_base64(text, &size);
    assert_int_equal(size, LONG);
    assert_memory_equal(back, bytes, LONG);
    free(back);
    free(text);
    free(bytes);
}

/* 200 values 1, 2, ..., 200: at least 99 % do not exceed 198; the median is 101 (index 100). */
TEST(exposure)
{
    double v[200];
    bool capped;
    for (size_t i = 0; i < 200; i++)
        v[i] = 200 - (double)i;
    assert_float_equal(plot_display_white(v, 200, &capped), 198 / 0.8, 1e-12);
    assert_false(capped);

    /* A lamp of 5 % of the pixels: 6 times the median, not the lamp, is at 0.8 of white. */
    for (size_t i = 0; i < 200; i++)
        v[i] = i < 10 ? 1000 : 2;
    assert_float_equal(plot_display_white(v, 200, &capped), 12 / 0.8, 1e-12);
    assert_true(capped);

    /* Mostly black: the median is over what is not black. One pixel of 200 is under 1 %. */
    memset(v, 0, sizeof v);
    v[7] = 3;
    assert_float_equal(plot_display_white(v, 200, &capped), 6 * 3 / 0.8, 1e-12);
    memset(v, 0, sizeof v);
    assert_float_equal(plot_display_white(v, 200, &capped), 1, 0);
}

/* sRGB bytes to CIE L*a*b*: the inverse of what the map does, written from the definitions. */
static void lab_of(const uint8_t rgb8[3], double lab[3])
{
    static const double to_xyz[3][3] = {{0.4124564, 0.3575761, 0.1804375},
                                        {0.2126729, 0.7151522, 0.0721750},
                                        {0.0193339, 0.1191920, 0.9503041}};
    static const double white[3] = {0.95047, 1, 1.08883};
    double linear[3], f[3];
    for (size_t i = 0; i < 3; i++) {
        double v = rgb8[i] / 255.0;
        linear[i] = v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
    }
    for (size_t i = 0; i < 3; i++) {
        double t =
            (to_xyz[i][0] * linear[0] + to_xyz[i][1] * linear[1] + to_xyz[i][2] * linear[2]) /
            white[i];
        f[i] = t > 216.0 / 24389 ? cbrt(t) : (24389.0 / 27 * t + 16) / 116;
    }
    lab[0] = 116 * f[1] - 16;
    lab[1] = 500 * (f[0] - f[1]);
    lab[2] = 200 * (f[1] - f[2]);
}

/* Steps of 1/16 are 5.75 units of Lab long (46 / 8) but for rounding to bytes, and L* is the same at
 * -t and +t: neither sign looks stronger. */
TEST(diverging_map)
{
    enum { STEPS = 32 };
    double lab[STEPS + 1][3];
    for (int i = 0; i <= STEPS; i++) {
        uint8_t c[3];
        plot_diverging_rgb8(2.0 * i / STEPS - 1, c);
        lab_of(c, lab[i]);
    }
    for (int i = 0; i < STEPS; i++) {
        double step = 0;
        for (int k = 0; k < 3; k++)
            step += (lab[i + 1][k] - lab[i][k]) * (lab[i + 1][k] - lab[i][k]);
        assert_float_equal(sqrt(step), 5.75, 0.75);
        assert_float_equal(lab[i][0], lab[STEPS - i][0], 0.6);
    }
    assert_float_equal(lab[STEPS / 2][0], 97, 0.5);
    assert_true(lab[0][2] < -40);    /* blue */
    assert_true(lab[STEPS][1] > 40); /* red */

    uint8_t c[3], end[3];
    plot_diverging_rgb8(NAN, c);
    assert_true(c[0] == 128 && c[1] == 128 && c[2] == 128);
    plot_diverging_rgb8(INFINITY, c);
    plot_diverging_rgb8(1, end);
    assert_memory_equal(c, end, 3);
}

/* 32 steps of equal length in Lab, but for the corners of the path and rounding to bytes, and L* that
 * never falls. */
TEST(sequential_map)
{
    enum { STEPS = 32 };
    double lab[STEPS + 1][3], length[STEPS], mean = 0;
    for (int i = 0; i <= STEPS; i++) {
        uint8_t c[3];
        plot_sequential_rgb8((double)i / STEPS, c);
        lab_of(c, lab[i]);
    }
    for (int i = 0; i < STEPS; i++) {
        double sum = 0;
        for (int k = 0; k < 3; k++)
            sum += (lab[i + 1][k] - lab[i][k]) * (lab[i + 1][k] - lab[i][k]);
        length[i] = sqrt(sum);
        mean += length[i] / STEPS;
        assert_true(lab[i + 1][0] > lab[i][0]);
    }
    for (int i = 0; i < STEPS; i++)
        assert_float_equal(length[i] / mean, 1, 0.15);
    assert_true(lab[0][0] < 20 && lab[STEPS][0] > 85);
    uint8_t c[3], end[3];
    plot_sequential_rgb8(NAN, c);
    assert_true(c[0] == 128 && c[1] == 128 && c[2] == 128);
    plot_sequential_rgb8(7, c);
    plot_sequential_rgb8(1, end);
    assert_memory_equal(c, end, 3);
}

TEST(p_histogram)
{
    /* p = 10^-0.01 = 0.977, 10^-1.5 = 0.032, 10^-0.3 = 0.501, 10^-300 and 1: bins 9, 0, 5, 0, 9. */
    json_t *claim = json_pack("{s[f f f f f n]}", "tile_log10_p", -0.01, -1.5, -0.3, -300.0, 0.0);
    int count[20];
    struct p_histogram h = plot_p_histogram(claim, count);
    static const int wanted[10] = {2, 0, 0, 0, 0, 1, 0, 0, 0, 2};
    assert_int_equal(h.num_tiles, 5);
    assert_int_equal(h.bins, 10);
    assert_memory_equal(count, wanted, sizeof wanted);
    assert_int_equal(h.below_5_percent, 2);
    json_decref(claim);

    /* 400 tiles in 20 bins; the band from the sum of the probabilities of Binomial(400, 1/20). */
    claim = json_pack("{s[]}", "tile_log10_p");
    for (int i = 0; i < 400; i++)
        json_array_append_new(json_object_get(claim, "tile_log10_p"), json_real(-0.5));
    h = plot_p_histogram(claim, count);
    assert_int_equal(h.bins, 20);
    assert_float_equal(h.expected, 20, 0);
    int low = -1, high = -1;
    double sum = 0;
    for (int k = 0; k <= 400; k++) {
        sum += exp(lgamma(401) - lgamma(k + 1) - lgamma(401 - k) + k * log(0.05) +
                   (400 - k) * log(0.95));
        if (low < 0 && sum >= 0.005)
            low = k;
        if (high < 0 && sum >= 0.995)
            high = k;
    }
    assert_int_equal(h.band_low, low);
    assert_int_equal(h.band_high, high);
    json_decref(claim);
}

TEST(page_files_are_safe_to_embed)
{
    assert_non_null(strstr(page_css, "prefers-color-scheme: dark"));
    assert_non_null(strstr(page_js, "use strict"));
    assert_null(strstr(page_css, "</"));
    assert_null(strstr(page_css, "url("));
    assert_null(strstr(page_css, "@import"));
    assert_null(strstr(page_js, "</"));
    assert_null(strstr(page_js, "<!--"));
    assert_null(strstr(page_js, "innerHTML"));
}

TEST(page_is_whole)
{
    OWN(run) r = run_of_small_files();
    add_claim(&r, "41_cornell", "cycles", "EQUIVALENT", "EQUIVALENT", small_files);
    add_claim(&r, "91_wrong", "cycles", "EQUIVALENT", "DIFFERENT", small_files);
    add_error(&r, "12_furnace", "povray", "povray: not installed");
    htmlDocPtr doc = run_report(&r);

    assert_text_has(doc, "//h1", 0, "Of 3 claims, 1 could not be judged and 1 did not come out");
    assert_int_equal(count_nodes(doc, "//h1"), 1);
    assert_int_equal(count_nodes(doc, "//table[@id='claims']/tbody/tr"), 3);
    assert_int_equal(count_nodes(doc, "//table[@id='claims']/tbody/tr[@class='bad']"), 2);
    /* What could not be judged is first, then what came out wrong. */
    assert_text_has(doc, "//table[@id='claims']/tbody/tr", 0, "povray: not installed");
    assert_text_has(doc, "//table[@id='claims']/tbody/tr", 1, "91_wrong");
    assert_text_has(doc, "//table[@id='claims']/tbody/tr", 1, "\u22120.100 to +0.200");
    assert_text_has(doc, "//table[@id='claims']/tbody/tr", 2, "41_cornell");
    assert_int_equal(count_nodes(doc, "//section[@class='scene']"), 3);
    assert_int_equal(count_nodes(doc, "//article"), 3);
    /* Every link of the page leads to one element of it. */
    for (int i = 0; i < 3; i++) {
        char xpath[64];
        snprintf(xpath, sizeof xpath, "//article[@id='claim-%d']", i);
        assert_int_equal(count_nodes(doc, xpath), 1);
        snprintf(xpath, sizeof xpath, "//table[@id='claims']//th/a[@href='#claim-%d']", i);
        assert_int_equal(count_nodes(doc, xpath), 1);
    }
    static const char claim[] = "//article[@id='claim-0']";
    static const char *const in_claim[] = {
        "assay validate --only this",   "7, 8",
        "shift by x of 0.48 px",        "removes 93",
        "1.9 times that of B [1.8, 2]", "assay golden approve 41_cornell/cycles"};
    for (size_t i = 0; i < COUNT(in_claim); i++)
        assert_text_has(doc, claim, 0, in_claim[i]);
    assert_text_has(doc, "//article[@id='claim-0']//table", 0, "the image <red>");
    assert_text_has(doc, "//article[@id='claim-0']//tr[@class='bad']", 0, "2 x 2 pixels at 4,6");
    assert_text_has(doc, "//article[@id='claim-0']//table", 0, "not asked for");
    assert_text_has(doc, "//section[@class='scene']", 1, "64 replicates of 1 samples per pixel");

    /* Two scenes share two images, which are there once. */
    assert_int_equal(count_nodes(doc, "//div[@class='viewer']"), 2);
    assert_int_equal(count_nodes(doc, "//div[@class='viewer']//li"), 4);
    assert_int_equal(count_nodes(doc, "//script[starts-with(@id, 'layer-')]"), 2);
    assert_int_equal(count_nodes(doc, "//article[@data-a='0' and @data-b='1']"), 2);
    /* The matrix: a row for each scene, thumbnails of the two that were judged, marks that need no colour. */
    assert_int_equal(count_nodes(doc, "//section[@id='matrix']//tbody/tr"), 3);
    assert_int_equal(count_nodes(doc, "//section[@id='matrix']//img[@alt='']"), 2);
    assert_int_equal(count_nodes(doc, "//img"), 2);
    assert_text_has(doc, "//section[@id='matrix']//tbody/tr", 0, "!not judged");
    assert_text_has(doc, "//section[@id='matrix']//tbody/tr", 1, "✗wrong");
    assert_text_has(doc, "//section[@id='matrix']//tbody/tr", 2, "✓as it should be");
    for (int i = 0; i < 3; i++) {
        char xpath[96];
        snprintf(xpath, sizeof xpath, "//section[@id='matrix']//td/a[@href='#claim-%d']", i);
        assert_int_equal(count_nodes(doc, xpath), 1);
    }
    assert_int_equal(count_nodes(doc, "//svg[@role='img' and string-length(@aria-label) > 5]"),
                     count_nodes(doc, "//svg"));
    /* An interval, the histogram and the power of each judged claim; three tiles are too few for a QQ plot. */
    assert_int_equal(count_nodes(doc, "//svg"), 6);
    assert_int_equal(count_nodes(doc, "//*[@src][not(starts-with(@src, 'data:'))]"), 0);
    assert_int_equal(
        count_nodes(
            doc, "//*[@href][not(starts-with(@href, '#') or starts-with(@href, 'data:text/csv'))]"),
        0);
    assert_int_equal(count_nodes(doc, "//link | //iframe | //object | //embed"), 0);
    OWN_TEXT text = test_read(r.page);
    assert_null(strstr(text, "http://"));
    assert_null(strstr(text, "https://"));
    xmlFreeDoc(doc);
}

/* The layer with that number, as its reader sees it. The caller frees. */
static struct layer_numbers page_layer(htmlDocPtr doc, int index, int side)
{
    char xpath[64];
    snprintf(xpath, sizeof xpath, "//script[@id='layer-%d']", index);
    OWN_TEXT text = text_of(doc, xpath, 0);
    size_t size;
    uint8_t *bytes = decode_base64(text, &size);
    struct layer_numbers l = layer_read(bytes, size, side, side);
    free(bytes);
    return l;
}

/* White is 0.25 / 0.8 = 0.3125, since at least 99 % of the reference is 0.25. M2 is 1 and n 64, so a
 * standard error is sqrt(1/(64 x 63)) = 0.01575. */
TEST(images_have_the_values)
{
    OWN(run) r = run_of_small_files();
    add_claim(&r, "41_cornell", "cycles", "EQUIVALENT", "EQUIVALENT", small_files);
    htmlDocPtr doc = run_report(&r);
    assert_text_has(doc, "//h1", 0, "The claim came out as expected.");
    assert_text_has(doc, "//header/p", 1, "EQUIVALENT: All intervals lie");
    assert_text_has(doc, "//section[@class='scene']/@data-white", 0, "0.3125");
    assert_text_has(doc, "//section[@class='scene']/p[@class='caption']", 0, "radiance 0.312 and");
    static const double special[3] = {0.1, 0.05, 0.2};
    for (int i = 0; i < 2; i++) {
        OWN(layer_numbers) l = page_layer(doc, i, 32);
        assert_null(l.n);
        for (size_t c = 0; c < 3; c++) {
            double error = sqrt(1.0 / (64 * 63));
            size_t at = 3 * (SPECIAL_Y * 32 + SPECIAL_X) + c;
            assert_float_equal(l.value[c], 0.25, error / 16 * 1.03);
            assert_float_equal(l.value[at], special[c], error / 16 * 1.03);
            assert_float_equal(l.error[at], error, 0.03 * error);
        }
    }
    assert_text_has(doc, "//script[@id='layer-0']/@data-n", 0, "64");
    assert_text_has(doc, "//script[@id='layer-0']/@data-unit", 0, "sample");
    assert_text_has(doc, "//script[@id='layer-1']/@data-unit", 0, "replicate");

    /* The colours of maps: 257 of the diverging one, 256 of the sequential one. */
    OWN_TEXT text = text_of(doc, "//script[@id='colours']", 0);
    size_t size;
    uint8_t *bytes = decode_base64(text, &size), c[3];
    assert_int_equal(size, 3 * (257 + 256));
    plot_diverging_rgb8(-0.5, c);
    assert_memory_equal(bytes + 3 * 64, c, 3);
    plot_sequential_rgb8(1, c);
    assert_memory_equal(bytes + size - 3, c, 3);
    free(bytes);
    xmlFreeDoc(doc);
}

/* With many claims the evidence of those that came out as expected is folded. */
TEST(much_evidence_is_folded)
{
    OWN(run) r = run_of_small_files();
    for (int i = 0; i < 8; i++)
        add_claim(&r, "41_cornell", "cycles", "EQUIVALENT", "EQUIVALENT", small_files);
    htmlDocPtr doc = run_report(&r);
    assert_int_equal(count_nodes(doc, "//details[@class='evidence' and @open]"), 8);
    assert_int_equal(count_nodes(doc, "//a[@class='up']"), 0);
    assert_int_equal(count_nodes(doc, "//p[@class='error-line']"), 1); /* without a script */
    assert_int_equal(count_nodes(doc, "//meta[@http-equiv='refresh']"), 0);
    xmlFreeDoc(doc);

    add_claim(&r, "91_wrong", "cycles", "EQUIVALENT", "DIFFERENT", small_files);
    r.left = 31;
    doc = run_report(&r);
    assert_int_equal(count_nodes(doc, "//details[@class='evidence']"), 9);
    assert_int_equal(count_nodes(doc, "//details[@class='evidence' and @open]"), 1);
    assert_text_has(doc, "//details[@class='evidence' and @open]/../@id", 0, "claim-8");
    assert_int_equal(count_nodes(doc, "//a[@class='up' and @href='#table']"), 2);
    assert_text_has(doc, "//meta[@http-equiv='refresh']/@content", 0, "3");
    assert_text_has(doc, "//header/p[@class='error-line']", 0, "31 more are to be judged");
    assert_text_has(doc, "//h1", 0, "So far 1 of 9 claims did not come out as expected.");
    xmlFreeDoc(doc);
}

/* The policy in the page lets exactly the embedded script run. */
TEST(policy_admits_the_script)
{
    OWN(run) r = run_of_small_files();
    add_claim(&r, "41_cornell", "cycles", "EQUIVALENT", "EQUIVALENT", small_files);
    xmlFreeDoc(run_report(&r));
    OWN_TEXT text = test_read(r.page);
    char *begin = strstr(text, "<script>");
    assert_non_null(begin);
    begin += strlen("<script>");
    char *end = strstr(begin, "</script>");
    assert_non_null(end);
    struct sha256_ctx ctx;
    uint8_t digest[SHA256_DIGEST_SIZE];
    sha256_init(&ctx);
    sha256_update(&ctx, (size_t)(end - begin), (const uint8_t *)begin);
    sha256_digest(&ctx, sizeof digest, digest);
    char wanted[128] = "script-src 'sha256-";
    size_t n = strlen(wanted);
    base64_encode_raw(wanted + n, sizeof digest, digest);
    strcpy(wanted + n + BASE64_ENCODE_RAW_LENGTH(sizeof digest), "'");
    assert_non_null(strstr(text, wanted));
    assert_non_null(strstr(text, "default-src 'none'"));
}

TEST(names_cannot_inject_markup)
{
    static const char evil[] = "</title></script><script>alert(1)</script>";
    static const char quote[] = "\"'><img src=x onerror=alert(2)>";
    OWN(run) r = run_of_small_files();
    add_claim(&r, evil, quote, "EQUIVALENT", "EQUIVALENT", small_files);
    json_t *claim = json_array_get(r.claims, 0);
    static const char *const member[] = {"title", "detects",  "blind_to",  "reason",
                                         "a",     "rerun",    "version_b", "unit_b",
                                         "class", "quantity", "renew",     "version_a"};
    for (size_t i = 0; i < COUNT(member); i++)
        json_object_set_new(claim, member[i], json_string(i % 2 ? evil : quote));
    json_object_set_new(claim, "notes", json_pack("[s]", evil));
    add_error(&r, quote, evil, evil);
    htmlDocPtr doc = run_report(&r);
    assert_int_equal(count_nodes(doc, "//script[not(@type)]"), 1);
    assert_int_equal(count_nodes(doc, "//img[not(starts-with(@src, 'data:'))]"), 0);
    assert_int_equal(count_nodes(doc, "//@onerror"), 0);
    assert_text_has(doc, "//div[@class='viewer']//li/@data-name", 1, quote);
    assert_text_has(doc, "//article[@id='claim-0']//ul[@class='notes']/li", 0, evil);
    assert_text_has(doc, "//table[@id='claims']/tbody/tr/th", 1, evil);
    assert_text_has(doc, "//article[@id='claim-1']/p", 0, evil);
    xmlFreeDoc(doc);
}

/* Ten claims on five scenes of 256 x 256 pixels of pure noise, 13 standard errors high. */
TEST(page_stays_small)
{
    OWN(run) r = run_make();
    for (int scene = 0; scene < 5; scene++)
        for (int k = 0; k < 2; k++) {
            char name[32], file[4][64];
            const char *files[4] = {file[0], file[1], file[2], file[3]};
            uint64_t seed = (uint64_t)(10 * scene + 4 * k);
            snprintf(name, sizeof name, "4%d_scene", scene);
            snprintf(file[0], sizeof file[0], "data/%d/a.exr", scene);
            for (int i = 1; i < 4; i++)
                snprintf(file[i], sizeof file[i], "data/%d/%c%d.exr", scene, "abzr"[i], k);
            if (k == 0)
                write_radiance(&r, file[0], "sample", 256, 1, seed);
            write_radiance(&r, file[1], "exact", 256, 1, seed + 1);
            add_claim(&r, name, k == 0 ? "cycles" : "truth", "EQUIVALENT", "EQUIVALENT", files);
        }
    htmlDocPtr doc = run_report(&r);
    struct stat st;
    assert_int_equal(stat(r.page, &st), 0);
    assert_true(st.st_size > 1000000);
    assert_true(st.st_size < 3000000);
    assert_text_has(doc, "//h1", 0, "All 10 claims came out as expected.");
    assert_int_equal(count_nodes(doc, "//table[@id='claims']/tbody/tr"), 10);
    assert_int_equal(count_nodes(doc, "//section[@class='scene']"), 5);
    /* A scene's own image is there once: 5 x 3. An exact value has 20 bits, a noisy one 5: the ten
     * exact images alone are 10 x 65536 x 3 x 20/8 bytes and a third more. The page says what is not
     * there. */
    int layers = count_nodes(doc, "//script[starts-with(@id, 'layer-')]");
    assert_int_equal(count_nodes(doc, "//div[@class='viewer']//li"), 15);
    assert_true(layers > 0 && layers < 15);
    char said[64];
    snprintf(said, sizeof said, "the numbers of %d of its 15 images", 15 - layers);
    assert_text_has(doc, "//main", 0, said);
    xmlFreeDoc(doc);
}

static void expect_failure(const struct run *r, const char *wanted)
{
    struct err e;
    run_write_results(r);
    REFUSES(report_write(r->results, r->page, &e), wanted);
}

TEST(bad_input_is_named)
{
    struct err e = {""};
    for (size_t i = 0; i < 2; i++) {
        OWN(run) r = run_of_small_files();
        add_claim(&r, "41_cornell", "cycles", "EQUIVALENT", "EQUIVALENT", small_files);
        /* An older page must survive a failure. */
        assert_true(fs_make_parent_dirs(r.page, &e));
        test_write(r.page, "old", 3);
        char path[256];
        snprintf(path, sizeof path, "%s/%s", r.dir, small_files[i]);
        assert_int_equal(remove(path), 0);
        expect_failure(&r, path);
        OWN_TEXT text = test_read(r.page);
        assert_string_equal(text, "old");
    }

    OWN(run) r = run_of_small_files();
    add_claim(&r, "41_cornell", "cycles", "EQUIVALENT", "EQUIVALENT", small_files);
    write_radiance(&r, small_files[1], "exact", 16, 0, 1);
    expect_failure(&r, "data/s/b.exr: 16 x 16 pixels, but data/s/a.exr has 32 x 32");
    assert_int_equal(access(r.page, F_OK), -1);

    assert_int_equal(remove(r.results), 0);
    REFUSES(report_write(r.results, r.page, &e), r.results);
}

static double redistributed(double hyab)
{
    /* Of green and blue, whose L*a*b* are in tests/tools/images/test_flip.c, the distance is 203.2. */
    double knee = 0.4 * pow(203.2, 0.7), d = pow(hyab, 0.7);
    return d < knee ? 0.95 * d / knee : 0.95 + 0.05 * (d - knee) / (1.5 * knee);
}

static double lightness(double y)
{
    return 116 * cbrt(y) - 16;
}

/* Flat greys, whose FLIP depends on their two lightnesses alone: here a reference of L* 50 (18.42 % of white) against
 * white; for HDR, a reference at 0.85 of the tone curve against 1/0.1842 times its light. */
TEST(alike)
{
    enum { SIDE = 12, PIXELS = SIDE * SIDE };
    const double grey = 0.18418651851, white = 3;
    struct err e = {""};
    OWN(moments) a, b;
    struct similarity l;
    float map[PIXELS];
    assert_true(moments_alloc(&a, SIDE, SIDE, &e) && moments_alloc(&b, SIDE, SIDE, &e));
    for (size_t i = 0; i < 3 * PIXELS; i++) {
        a.mean[i] = white;
        b.mean[i] = white * grey;
    }
    assert_true(report_similarity_measure(&a, &b, white, &l, map, &e));
    assert_true(l.has_flip);
    assert_float_equal(l.ldr, redistributed(50), 1e-3);
    assert_int_equal(l.exposures.num, 2);
    double gain = exp2(l.exposures.start);
    assert_float_equal(flip_tone(gain * white * grey), 0.85, 1e-9);
    assert_float_equal(l.hdr, redistributed(lightness(flip_tone(gain * white)) - lightness(0.85)),
                       1e-3);
    assert_float_equal((double)map[PIXELS / 2], l.hdr, 1e-6);
    assert_true(l.idiff_differs);
    assert_float_equal(l.idiff_percent, 100, 0);

    assert_true(report_similarity_measure(&b, &b, white, &l, map, &e));
    assert_float_equal(l.ldr + l.hdr + l.idiff_percent, 0, 0);
    assert_false(l.idiff_differs);
    memset(b.mean, 0, 3 * PIXELS * sizeof *b.mean);
    assert_true(report_similarity_measure(&a, &b, white, &l, map, &e));
    assert_false(l.has_flip);
}

/* Identical images, and a table that names who disagrees. */
TEST(alike_on_the_page)
{
    OWN(run) r = run_of_small_files();
    add_claim(&r, "same", "truth", "EQUIVALENT", "EQUIVALENT", small_files);
    add_claim(&r, "wrong", "truth", "DIFFERENT", "DIFFERENT", small_files);
    htmlDocPtr doc = run_report(&r);
    assert_int_equal(count_nodes(doc, "//section[@id='alike']//tbody/tr"), 2);
    assert_text_has(doc, "//section[@id='alike']//tbody/tr", 0, "0.0000");
    assert_text_has(doc, "//section[@id='alike']", 0,
                    "Of 1 EQUIVALENT pairs it would fail 0, of 1 DIFFERENT ones pass 1.");
    assert_text_has(doc, "//article[@id='claim-0']", 0, "Mean FLIP");
    assert_int_equal(count_nodes(doc, "//script[starts-with(@id, 'flip-')]"), 2);
    assert_int_equal(count_nodes(doc, "//a[@download='alike.csv']"), 1);
    xmlFreeDoc(doc);
}

static int clean_parser(void **state)
{
    (void)state;
    xmlCleanupParser();
    return 0;
}

TEST_GROUP(NULL, clean_parser)
