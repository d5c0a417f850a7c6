/* FLIP and idiff on the page, beside the statistics: they judge nothing. */
#include "report_internal.h"

#include "tools/images/luminance.h"
#include "tools/images/idiff.h"
#include "tools/images/pixel_codec.h"
#include "tools/html/csv_link.h"
#include "tools/html/html.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool measure_flip(const struct moments *a, const struct moments *b, double white,
                         struct similarity *out, float *map, struct err *e)
{
    size_t pixels = (size_t)a->width * (size_t)a->height;
    double *shown = malloc(6 * pixels * sizeof *shown);
    if (shown == NULL)
        return err_set(e, "out of memory for FLIP");
    for (size_t i = 0; i < 3 * pixels; i++) {
        shown[i] = b->mean[i] / white;
        shown[3 * pixels + i] = a->mean[i] / white;
    }
    bool ok = flip_ldr(shown, shown + 3 * pixels, a->width, a->height, FLIP_PPD, map, e);
    free(shown);
    out->ldr = ok ? flip_mean(map, pixels) : 0;
    ok = ok && flip_hdr(b->mean, a->mean, a->width, a->height, FLIP_PPD, &out->exposures, map, e);
    out->hdr = ok ? flip_mean(map, pixels) : 0;
    return ok;
}

static bool measure_idiff(const struct moments *a, const struct moments *b, double white,
                          struct similarity *out, struct err *e)
{
    size_t pixels = (size_t)a->width * (size_t)a->height, count[256];
    uint8_t *rgb8 = malloc(6 * pixels);
    if (rgb8 == NULL)
        return err_set(e, "out of memory for the report");
    idiff_quantise(a, white, rgb8);
    idiff_quantise(b, white, rgb8 + 3 * pixels);
    idiff_histogram(rgb8, rgb8 + 3 * pixels, pixels, count);
    free(rgb8);
    out->idiff_percent = idiff_percent_score(count, pixels, BLENDER_FAIL);
    out->idiff_differs = idiff_differs(count, pixels, BLENDER_FAIL, BLENDER_PERCENT);
    return true;
}

/* No pixel has a positive luminance: flip_exposures() fails. */
static bool is_black(const struct moments *m)
{
    for (size_t i = 0; i < (size_t)m->width * (size_t)m->height; i++)
        if (luminance(m->mean + 3 * i) > 0)
            return false;
    return true;
}

bool report_similarity_measure(const struct moments *a, const struct moments *b, double white,
                               struct similarity *out, float *map, struct err *e)
{
    size_t pixels = (size_t)a->width * (size_t)a->height;
    *out = (struct similarity){.has_flip = !is_black(b)};
    return (!out->has_flip || (flip_exposures(b->mean, pixels, &out->exposures, e) &&
                               measure_flip(a, b, white, out, map, e))) &&
           measure_idiff(a, b, white, out, e);
}

static void write_line(FILE *f, const struct similarity *l)
{
    fputs("<p class=\"caption\"><b>Beside the statistics.</b> ", f);
    if (l->has_flip)
        fprintf(
            f,
            "Mean FLIP, what the eye would see on swapping the images (0 nothing, 1 all): %.4f over "
            "%d exposures from %s to %s stops (HDR), %.4f as shown here (LDR). ",
            l->hdr, l->exposures.num, html_number(l->exposures.start).s,
            html_number(l->exposures.stop).s, l->ldr);
    else
        fputs("FLIP is not defined, as the reference is black. ", f);
    fprintf(
        f,
        "idiff with Blender’s thresholds would say %s: %s\u00a0%% of the pixels differ by more than "
        "%g, where %g\u00a0%% may.</p>\n",
        l->idiff_differs ? "<b>FAIL</b>" : "<b>pass</b>", html_number(l->idiff_percent).s,
        BLENDER_FAIL, BLENDER_PERCENT);
}

bool report_similarity(struct page *p, const struct claim_ref *claim, const struct moments *a,
                       const struct moments *b, double white, struct err *e)
{
    struct page_alike *grown = realloc(p->alike, (p->num_alike + 1) * sizeof *grown);
    float *map = malloc((size_t)a->width * (size_t)a->height * sizeof *map);
    struct page_alike n = {.claim = *claim, .width = a->width, .height = a->height};
    const bool left_out = p->folded && claim->outcome == OUTCOME_AS_EXPECTED;
    if (grown != NULL)
        p->alike = grown;
    bool ok = (grown != NULL && map != NULL) || err_set(e, "out of memory for the report");
    ok = ok && report_similarity_measure(a, b, white, &n.is, map, e) &&
         (!n.is.has_flip || left_out ||
          pixel_codec_encode_map(map, a->width, a->height, &n.bytes, &n.size, e));
    if (ok) {
        grown[p->num_alike++] = n;
        write_line(p->f, &n.is);
    }
    free(map);
    return ok;
}

static void write_row(FILE *f, const struct page_alike *n)
{
    const json_t *c = n->claim.json;
    html_print(f,
               "<tr><th scope=\"row\"><a href=\"#claim-%zu\">%s</a></th><td "
               "class=\"name\">%s</td><td class=\"name\">",
               n->claim.index, member_text(c, "scene"), member_text(c, "a"));
    report_reference(f, &n->claim);
    html_print(f, "</td><td>%s", member_text(c, "verdict"));
    if (n->is.has_flip)
        fprintf(f, "</td><td class=\"num\">%.4f</td><td class=\"num\">%.4f", n->is.hdr, n->is.ldr);
    else
        fputs("</td><td class=\"num\">none</td><td class=\"num\">none", f);
    fprintf(f, "</td><td class=\"num\">%.2f</td><td>%s</td></tr>\n", n->is.idiff_percent,
            n->is.idiff_differs ? "FAIL" : "pass");
}

static void write_csv(const struct page *p)
{
    struct csv csv = csv_link_open(
        p->f, "alike.csv", "scene,tested,against,verdict,flip_hdr,flip_ldr,idiff_percent,idiff");
    for (size_t i = 0; i < p->num_alike; i++) {
        const struct page_alike *n = &p->alike[i];
        const json_t *c = n->claim.json;
        csv_link_row(&csv, "ttttnnnt", member_text(c, "scene"), member_text(c, "a"),
                     member_text(c, "b"), member_text(c, "verdict"),
                     n->is.has_flip ? n->is.hdr : NAN, n->is.has_flip ? n->is.ldr : NAN,
                     n->is.idiff_percent, n->is.idiff_differs ? "FAIL" : "pass");
    }
    csv_link_close(&csv);
}

void report_similarity_table(const struct page *p)
{
    FILE *f = p->f;
    size_t equal_fail = 0, equal = 0, different_pass = 0, different = 0;
    if (p->num_alike == 0)
        return;
    for (size_t i = 0; i < p->num_alike; i++) {
        const char *verdict = member_text(p->alike[i].claim.json, "verdict");
        bool differs = p->alike[i].is.idiff_differs;
        equal += strcmp(verdict, "EQUIVALENT") == 0;
        equal_fail += strcmp(verdict, "EQUIVALENT") == 0 && differs;
        different += strcmp(verdict, "DIFFERENT") == 0;
        different_pass += strcmp(verdict, "DIFFERENT") == 0 && !differs;
    }
    fputs(
        "<section id=\"alike\">\n<h2>Beside the statistics</h2>\n"
        "<p>What two measures that know nothing of noise say of the same images. They are quoted to compare, and "
        "have no part in any verdict.</p>\n",
        f);
    html_table_open(f, NULL, "Table of FLIP and idiff",
                    "Scene|Tested|Against|Verdict|>FLIP, HDR|>FLIP, LDR|>idiff: % of pixels|idiff");
    for (size_t i = 0; i < p->num_alike; i++)
        write_row(f, &p->alike[i]);
    html_table_close(f);
    fputs("<p class=\"caption\">The table as a file: ", f);
    write_csv(p);
    fprintf(
        f,
        "</p>\n<p class=\"caption\"><b>FLIP</b> (Andersson et al. 2020, 2021) is how much an eye sees "
        "when the two images are swapped in place, %.0f pixels to a degree of sight, from 0, nothing, to 1, "
        "as green against blue; here its mean over the image. <b>HDR</b>: the most that is seen at any "
        "exposure that the reference asks for; <b>LDR</b>: at 0 stops as this page shows it. It counts noise as "
        "it counts error, so that a right but noisy image has a FLIP too. <b>idiff</b> (OpenImageIO) with the "
        "thresholds of Blender’s own tests, -fail %g -failpercent %g, on the 8-bit sRGB images at 0 stops: it "
        "fails where more than %g\u00a0%% of the pixels differ by more than 4 of 255 steps. Of %zu EQUIVALENT "
        "pairs it would fail %zu, of %zu DIFFERENT ones pass %zu.</p>\n</section>\n",
        FLIP_PPD, BLENDER_FAIL, BLENDER_PERCENT, BLENDER_PERCENT, equal, equal_fail, different,
        different_pass);
}
