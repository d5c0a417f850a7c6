#include "report_parts.h"

#include "report_colour.h"
#include "report_html.h"
#include "report_plot.h"
#include "report_statistics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { Z_RANGE = 4 };

static double interval_end(const json_t *object, size_t end)
{
    return json_number_value(json_array_get(json_object_get(object, "ci"), end));
}

void report_reference(FILE *f, const struct claim_ref *claim)
{
    html_text(f, member_text(claim->json, "b"));
    const char *quantity = member_text(claim->json, "quantity");
    if (quantity != NULL && strcmp(quantity, "mean") != 0) {
        fputs(", ", f);
        html_text(f, quantity);
    }
}

void report_badge(FILE *f, const struct claim_ref *claim)
{
    static const char *const style[] = {"error", "bad", "bad", "good"};
    static const char *const mark[] = {"!", "✗", "✗", "✓"};
    fprintf(f, "<span class=\"badge %s\"><span aria-hidden=\"true\">%s</span> ",
            style[claim->outcome], mark[claim->outcome]);
    if (claim->outcome == OUTCOME_NOT_JUDGED && !claim_lacks_time(claim->json))
        fputs("not judged", f);
    else
        html_text(f, member_text(claim->json, "verdict"));
    fputs("</span>", f);
}

void report_claim_error(struct page *p, const struct claim_ref *claim)
{
    FILE *f = p->f;
    fprintf(f, "<article class=\"claim\" id=\"claim-%zu\">\n<h3>", claim->index);
    html_text(f, member_text(claim->json, "a"));
    fputs(" against ", f);
    report_reference(f, claim);
    fputs(" ", f);
    report_badge(f, claim);
    fputs("</h3>\n<p class=\"error-line\">This claim could not be judged: ", f);
    html_text(f, member_text(claim->json, "error"));
    fputs(claim_lacks_time(claim->json)
              ? "</p>\n<p class=\"caption\">It counts as inconclusive. A larger budget would "
                "judge it.</p>\n"
              : "</p>\n<p class=\"caption\">That is neither a pass nor a failure of the "
                "renderer. It makes the exit code 3 until the cause is gone.</p>\n",
          f);
    const char *rerun = member_text(claim->json, "rerun");
    if (rerun != NULL) {
        fputs("<p>To judge this claim again:</p>\n<pre tabindex=\"0\"><code>", f);
        html_text(f, rerun);
        fputs("</code></pre>\n", f);
    }
    fputs("</article>\n", f);
}

static bool write_legend(FILE *f, const char *low, const char *middle, const char *high,
                         struct err *e)
{
    enum { STEPS = 129 };
    uint8_t ramp[3 * STEPS];
    for (int i = 0; i < STEPS; i++)
        diverging_rgb8(2.0 * i / (STEPS - 1) - 1, &ramp[3 * i]);
    fputs("<div class=\"legend\"><img width=\"129\" height=\"1\" alt=\"colour scale from blue over "
          "white to red\" src=\"",
          f);
    if (!html_png(f, STEPS, 1, ramp, e))
        return false;
    fprintf(f, "\"><span>%s</span><span>%s</span><span>%s</span></div>", low, middle, high);
    return true;
}

/* Outline of the reporting tile whose interval reaches furthest out. */
static void write_tile_mark(FILE *f, const json_t *claim, const struct image *map)
{
    const json_t *worst = json_object_get(claim, "worst_tile");
    double tile = member_number(claim, "tile"), x = member_number(worst, "x"),
           y = member_number(worst, "y");
    if (tile <= 0 || x + tile > map->width || y + tile > map->height)
        return;
    fprintf(
        f,
        "<span class=\"tile\" style=\"left:%.3f%%;top:%.3f%%;width:%.3f%%;height:%.3f%%\"></span>",
        100 * x / map->width, 100 * y / map->height, 100 * tile / map->width,
        100 * tile / map->height);
}

static bool write_map(struct page *p, const struct claim_ref *claim, const struct image *map,
                      const char *what, double range, const char *const legend[3], struct err *e)
{
    size_t pixels = (size_t)map->width * (size_t)map->height, layer;
    uint8_t *rgb8 = malloc(3 * pixels);
    double *value = malloc(pixels * sizeof *value);
    bool ok = rgb8 != NULL && value != NULL;
    if (!ok)
        err_set(e, "out of memory for the report");
    for (size_t i = 0; ok && i < pixels; i++) {
        value[i] = map->data[i];
        diverging_rgb8(value[i] / range, &rgb8[3 * i]);
    }
    ok = ok && page_add_layer(p, map->width, map->height, 1, value, &layer, e);
    if (ok) {
        const char *b = member_text(claim->json, "b");
        fputs("<figure class=\"map\"", p->f);
        report_scale(p->f, map->width);
        fprintf(p->f, "><div class=\"frame\" data-layer=\"%zu\">", layer);
        fprintf(p->f, "<img width=\"%d\" height=\"%d\" alt=\"Map of the %s, ", map->width,
                map->height, what);
        html_text(p->f, member_text(claim->json, "a"));
        fputs(" against ", p->f);
        html_text(p->f, b);
        fprintf(p->f, ", from %s to %s\" src=\"", legend[0], legend[2]);
        ok = html_png(p->f, map->width, map->height, rgb8, e);
        fputs("\">", p->f);
        write_tile_mark(p->f, claim->json, map);
        fputs("</div>", p->f);
        ok = ok && write_legend(p->f, legend[0], legend[1], legend[2], e);
    }
    free(rgb8);
    free(value);
    return ok;
}

static bool write_relative(struct page *p, const struct claim_ref *claim, const struct image *map,
                           double range, struct err *e)
{
    struct number_text low = percent_prose(-range), high = percent_prose(range);
    const char *const legend[3] = {low.s, "equal", high.s};
    if (!write_map(p, claim, map, "relative difference", range, legend, e))
        return false;
    const json_t *worst = json_object_get(claim->json, "worst_tile");
    const char *a = member_text(claim->json, "a");
    fputs("<figcaption><b>Relative difference, pixel by pixel.</b> Red: ", p->f);
    html_text(p->f, a);
    fputs(" is brighter than ", p->f);
    html_text(p->f, member_text(claim->json, "b"));
    fprintf(
        p->f,
        ". Blue: darker. White: equal. In per cent of the reference, or, where it is darker than "
        "that, of 5 %% of its mean. Single pixels are noisy; only a patch of one colour matters. "
        "The outlined tile, at x %.0f, y %.0f, reaches furthest from equal: %s, "
        "interval %s to %s.</figcaption></figure>\n",
        member_number(worst, "x"), member_number(worst, "y"),
        percent_prose(member_number(worst, "difference")).s,
        percent_prose(interval_end(worst, 0)).s, percent_prose(interval_end(worst, 1)).s);
    return true;
}

static bool write_z(struct page *p, const struct claim_ref *claim, const struct image *map,
                    struct err *e)
{
    static const char *const legend[3] = {"−4", "0", "+4"};
    if (!write_map(p, claim, map, "z value", Z_RANGE, legend, e))
        return false;
    size_t pixels = (size_t)map->width * (size_t)map->height, noisy = 0, beyond = 0;
    for (size_t i = 0; i < pixels; i++) {
        double z = fabs((double)map->data[i]);
        noisy += z > 0;
        beyond += z > 2;
    }
    fputs("<figcaption><b>The same difference in units of its noise (z map).</b> One unit is one "
          "standard error: the size a difference has by chance alone. If the engines agree, this "
          "is an even mix of pale red and blue, and about 5 of 100 pixels lie beyond ±2",
          p->f);
    if (noisy > 0)
        fprintf(p->f, " (here %.1f)", 100 * (double)beyond / (double)noisy);
    fputs(
        ". A shape or an edge that you can recognise is a real difference.</figcaption></figure>\n",
        p->f);
    return true;
}

static void write_histogram(FILE *f, const json_t *claim)
{
    int count[20];
    struct p_histogram h = p_histogram_of(claim, count);
    fputs("<figure class=\"map\">", f);
    if (h.num_tiles == 0) {
        fputs("<figcaption><b>No p-values.</b> No tile has any noise, so there is nothing to test; "
              "the differences are exact.</figcaption></figure>\n",
              f);
        return;
    }
    plot_p_values(f, &h, count);
    fprintf(
        f,
        "<figcaption><b>p-values of the %d tiles.</b> A p-value says how often noise alone would "
        "make a difference this large, if both engines had exactly the same mean. If they have, "
        "every p-value is as likely as any other: the bars stay near the dashed line (%.3g tiles), "
        "each inside the shaded band 99 times of 100. A pile at the left is a real difference. It "
        "may still be far smaller than the margin, and then it does not change the verdict. Here "
        "%d of %d tiles are below 0.05; %.1f would be by chance.</figcaption></figure>\n",
        h.num_tiles, h.expected, h.below_5_percent, h.num_tiles, 0.05 * h.num_tiles);
}

static void fact_open(FILE *f, const char *label)
{
    fprintf(f, "<div><dt>%s</dt><dd>", label);
}

static void fact_close(FILE *f)
{
    fputs("</dd></div>\n", f);
}

static void write_numbers(FILE *f, const json_t *claim)
{
    double alpha = member_number(claim, "alpha");
    fact_open(f, "Difference of the image mean");
    fprintf(f, "%s, %.6g\u00a0%% interval %s to %s",
            percent_prose(member_number(claim, "difference")).s, 100 * (1 - 2 * alpha),
            percent_prose(interval_end(claim, 0)).s, percent_prose(interval_end(claim, 1)).s);
    fact_close(f);
    const json_t *channels = json_object_get(claim, "channel_difference");
    fact_open(f, "In red, green, blue");
    fprintf(f, "%s, %s, %s", percent_prose(json_number_value(json_array_get(channels, 0))).s,
            percent_prose(json_number_value(json_array_get(channels, 1))).s,
            percent_prose(json_number_value(json_array_get(channels, 2))).s);
    fact_close(f);
    fact_open(f, "Margin (counts as equal)");
    fprintf(f, "±%s for the image, ±%s for a tile",
            percent_plain(member_number(claim, "margin_global")).s,
            percent_plain(member_number(claim, "margin_tile")).s);
    fact_close(f);
    fact_open(f, "Smallest bias this run would find");
    fprintf(f, "%s of the image mean, %s of a tile",
            percent_plain(member_number(claim, "mdb_global")).s,
            percent_plain(member_number(claim, "mdb_tile")).s);
    fact_close(f);
    double log10_p = member_number(claim, "log10_p");
    fact_open(f, "p of “no difference beyond the margin”");
    if (log10_p > -4)
        fprintf(f, "%.3g", pow(10, log10_p));
    else
        fprintf(f, "10<sup>%s</sup>", plain_number(log10_p).s);
    fact_close(f);
    fact_open(f, "Error rate (alpha)");
    fprintf(f, "%.3g for this claim, divided over %.0f tests", alpha,
            member_number(claim, "num_tests"));
    fact_close(f);
    fact_open(f, "Error of single pixels, noise removed");
    fprintf(f, "%s of the mean radiance (root mean square)",
            percent_plain(member_number(claim, "rms_bias")).s);
    fact_close(f);
}

static void write_regions(FILE *f, const json_t *claim)
{
    static const char *const channel[] = {"red", "green", "blue", "luminance"};
    const json_t *tile = json_object_get(claim, "worst_tile");
    const json_t *worst = json_object_get(claim, "worst");
    fact_open(f, "Tile that reaches furthest out");
    fprintf(f, "x %.0f, y %.0f, %.0f × %.0f pixels: %s, interval %s to %s, t = %s",
            member_number(tile, "x"), member_number(tile, "y"), member_number(claim, "tile"),
            member_number(claim, "tile"), percent_prose(member_number(tile, "difference")).s,
            percent_prose(interval_end(tile, 0)).s, percent_prose(interval_end(tile, 1)).s,
            plain_number(member_number(tile, "t")).s);
    fact_close(f);
    fact_open(f, "Smallest p of all regions");
    fprintf(f, "x %.0f, y %.0f, %.0f × %.0f pixels in %s: %s, t = %s", member_number(worst, "x"),
            member_number(worst, "y"), member_number(worst, "width"),
            member_number(worst, "height"), channel[(size_t)member_number(worst, "channel")],
            percent_prose(member_number(worst, "difference")).s,
            plain_number(member_number(worst, "t")).s);
    fact_close(f);
    fact_open(f, "Very skewed regions");
    fputs(json_is_true(json_object_get(claim, "skew_limited"))
              ? "some small ones were merged into larger ones, where the t test holds"
              : "none",
          f);
    fact_close(f);
    if (member_number(claim, "extra_factor") > 1) {
        fact_open(f, "Samples that would decide");
        fprintf(f, "about %s times as many", plain_number(member_number(claim, "extra_factor")).s);
        fact_close(f);
    }
}

static void write_optional_number(FILE *f, const json_t *claim, const char *name,
                                  const char *format)
{
    const json_t *v = json_object_get(claim, name);
    if (v != NULL)
        fprintf(f, format, json_number_value(v));
}

/* Who rendered it, its version, and how often each pixel was observed. side is "a" or "b". */
static void write_side(FILE *f, const json_t *claim, const char *side)
{
    char n[8], spp[8], unit_key[8], version_key[16];
    snprintf(n, sizeof n, "n_%s", side);
    snprintf(spp, sizeof spp, "spp_%s", side);
    snprintf(unit_key, sizeof unit_key, "unit_%s", side);
    snprintf(version_key, sizeof version_key, "version_%s", side);
    const char *unit = member_text(claim, unit_key), *version = member_text(claim, version_key);
    html_text(f, member_text(claim, side));
    if (version != NULL) {
        fputs(" (", f);
        html_text(f, version);
        fputs(")", f);
    }
    if (unit == NULL || strcmp(unit, "sample") == 0) {
        write_optional_number(f, claim, n, ", %.0f samples per pixel");
    } else if (strcmp(unit, "exact") == 0) {
        fputs(", without noise", f);
    } else {
        write_optional_number(f, claim, n, ", %.0f ");
        html_text(f, unit);
        fputs("s", f);
        if (member_number(claim, spp) > 0)
            write_optional_number(f, claim, spp, " of %.0f samples per pixel");
    }
}

static void write_provenance(FILE *f, const json_t *claim)
{
    fact_open(f, "First image (A)");
    write_side(f, claim, "a");
    write_optional_number(f, claim, "seed_a", ", seed %.0f");
    if (member_number(claim, "seconds_a") > 0)
        fprintf(f, ", %s", duration_text(member_number(claim, "seconds_a")).s);
    fact_close(f);

    fact_open(f, "Reference (B)");
    write_side(f, claim, "b");
    if (member_number(claim, "seconds_b") > 0)
        fprintf(f, ", %s when it was made", duration_text(member_number(claim, "seconds_b")).s);
    const char *fidelity = member_text(claim, "class");
    if (fidelity != NULL) {
        fputs(", class ", f);
        html_text(f, fidelity);
    }
    fact_close(f);

    const json_t *seeds = json_object_get(claim, "seeds_b");
    if (json_array_size(seeds) > 0) {
        fact_open(f, "Seeds of the reference");
        for (size_t i = 0; i < json_array_size(seeds); i++)
            fprintf(f, "%s%" JSON_INTEGER_FORMAT, i > 0 ? ", " : "",
                    json_integer_value(json_array_get(seeds, i)));
        fact_close(f);
    }
}

bool report_claim(struct page *p, const struct claim_ref *claim, const struct image *relative,
                  const struct image *z, double range, struct err *e)
{
    FILE *f = p->f;
    const json_t *json = claim->json;
    fprintf(f, "<article class=\"claim\" id=\"claim-%zu\" data-name=\"against ", claim->index);
    report_reference(f, claim);
    fputs("\">\n<h3>", f);
    html_text(f, member_text(json, "a"));
    fputs(" against ", f);
    report_reference(f, claim);
    fputs(" ", f);
    report_badge(f, claim);
    if (claim->outcome == OUTCOME_AS_EXPECTED) {
        fputs(" <small>as expected</small>", f);
    } else {
        fputs(" <small>expected ", f);
        html_text(f, member_text(json, "expected"));
        fputs("</small>", f);
    }
    fputs("</h3>\n<p class=\"reason\">", f);
    html_text(f, member_text(json, "reason"));
    fputs("</p>\n<div class=\"maps\">\n", f);
    if (!write_relative(p, claim, relative, range, e) || !write_z(p, claim, z, e))
        return false;
    write_histogram(f, json);
    fputs("</div>\n<h4>Everything needed to doubt it</h4>\n<dl class=\"facts\">\n", f);
    write_numbers(f, json);
    write_regions(f, json);
    write_provenance(f, json);
    fputs("</dl>\n", f);
    report_statistics(f, json);
    const char *rerun = member_text(json, "rerun");
    if (rerun != NULL) {
        fputs("<p class=\"caption\">To run this claim again:</p>\n<pre tabindex=\"0\"><code>", f);
        html_text(f, rerun);
        fputs("</code></pre>\n", f);
    }
    fputs("</article>\n", f);
    return true;
}
