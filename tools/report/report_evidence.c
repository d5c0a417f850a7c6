/* The evidence of a claim on the page: numbers, statistics, provenance, the command that runs
 * it again. */
#include "report_internal.h"

#include "tools/compare/region.h"
#include "tools/html/html.h"
#include "tools/results/plain_words.h"

#include <math.h>
#include <string.h>

static void fact_open(FILE *f, const char *label)
{
    fprintf(f, "<div><dt>%s</dt><dd>", label);
}

static void fact_close(FILE *f)
{
    fputs("</dd></div>\n", f);
}

static __attribute__((format(printf, 3, 4))) void write_fact(FILE *f, const char *label,
                                                             const char *text, ...)
{
    va_list values;
    va_start(values, text);
    fact_open(f, label);
    html_vprint(f, text, values);
    fact_close(f);
    va_end(values);
}

static void write_numbers(FILE *f, const json_t *claim)
{
    double alpha = results_interval_alpha(claim);
    char image[32], tile[32];
    write_fact(f, "Difference of the image mean", "%s, %.6g\u00a0%% interval %s to %s",
               html_percent_prose(member_number(claim, "difference")).s, 100 * (1 - 2 * alpha),
               html_percent_prose(member_end(claim, "ci", 0)).s,
               html_percent_prose(member_end(claim, "ci", 1)).s);
    const json_t *channels = json_object_get(claim, "channel_difference");
    write_fact(f, "In red, green, blue", "%s, %s, %s",
               html_percent_prose(json_number_value(json_array_get(channels, 0))).s,
               html_percent_prose(json_number_value(json_array_get(channels, 1))).s,
               html_percent_prose(json_number_value(json_array_get(channels, 2))).s);
    if (member_number(claim, "margin_tile") > 0)
        write_fact(f, "Margin (counts as equal)", "±%s for the image, ±%s for a tile",
                   html_percent_plain(member_number(claim, "margin_global")).s,
                   html_percent_plain(member_number(claim, "margin_tile")).s);
    else
        write_fact(f, "Margin (counts as equal)", "none declared");
    if (member_number(claim, "margin_variance") > 0)
        write_fact(f, "Margin of the variance", "%s, either way",
                   html_percent_plain(member_number(claim, "margin_variance")).s);
    write_fact(f, "Smallest bias this run would find", "%s of the image mean, %s of a tile",
               region_mdb_text(member_number(claim, "mdb_global"), image),
               region_mdb_text(member_number(claim, "mdb_tile"), tile));
    fact_open(f, "p of “no difference beyond the margin”");
    html_p_value(f, member_number(claim, "log10_p"));
    fact_close(f);
    write_fact(f, "Error rate (alpha)", "%.3g for this claim, divided over %.0f tests", alpha,
               member_number(claim, "num_tests"));
    write_fact(f, "Error of single pixels, noise removed",
               "%s of the mean radiance (root mean square)",
               html_percent_plain(member_number(claim, "rms_bias")).s);
}

static void write_regions(FILE *f, const json_t *claim)
{
    static const char *const channel[] = {"red", "green", "blue", "luminance"};
    const json_t *tile = json_object_get(claim, "worst_tile");
    const json_t *worst = json_object_get(claim, "worst");
    write_fact(
        f, "Tile that reaches furthest out",
        "x %.0f, y %.0f, %.0f × %.0f pixels: %s, interval %s to %s, t = %s",
        member_number(tile, "x"), member_number(tile, "y"), member_number(tile, "width"),
        member_number(tile, "height"), html_percent_prose(member_number(tile, "difference")).s,
        html_percent_prose(member_end(tile, "ci", 0)).s,
        html_percent_prose(member_end(tile, "ci", 1)).s, html_number(member_number(tile, "t")).s);
    write_fact(f, "Smallest p of all regions",
               "x %.0f, y %.0f, %.0f × %.0f pixels in %s: %s, t = %s", member_number(worst, "x"),
               member_number(worst, "y"), member_number(worst, "width"),
               member_number(worst, "height"), channel[(size_t)member_number(worst, "channel")],
               html_percent_prose(member_number(worst, "difference")).s,
               html_number(member_number(worst, "t")).s);
    fact_open(f, "Very skewed regions");
    fputs(json_is_true(json_object_get(claim, "skew_limited"))
              ? "some small ones were merged into larger ones, where the t test holds"
              : "none",
          f);
    fact_close(f);
    const struct plain_words more = plain_words_more_samples(claim);
    if (more.s[0] != '\0')
        write_fact(f, "More samples", "%s", more.s);
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
    if (version != NULL)
        html_print(f, " (%s)", version);
    if (unit == NULL || strcmp(unit, "sample") == 0) {
        write_optional_number(f, claim, n, ", %.0f samples per pixel");
    } else if (strcmp(unit, "exact") == 0) {
        fputs(", without noise", f);
    } else {
        write_optional_number(f, claim, n, ", %.0f ");
        html_print(f, "%ss", unit);
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
        fprintf(f, ", %s", html_duration(member_number(claim, "seconds_a")).s);
    fact_close(f);

    fact_open(f, "Reference (B)");
    write_side(f, claim, "b");
    if (member_number(claim, "seconds_b") > 0)
        fprintf(f, ", %s when it was made", html_duration(member_number(claim, "seconds_b")).s);
    const char *fidelity = member_text(claim, "class");
    if (fidelity != NULL)
        html_print(f, ", class %s", fidelity);
    fact_close(f);

    const json_t *seeds = json_object_get(claim, "seeds_b");
    if (json_array_size(seeds) > 0) {
        fputs("<div class=\"row\"><dt>Seeds of the reference</dt><dd>", f);
        for (size_t i = 0; i < json_array_size(seeds); i++)
            fprintf(f, "%s%" JSON_INTEGER_FORMAT, i > 0 ? ", " : "",
                    json_integer_value(json_array_get(seeds, i)));
        fact_close(f);
    }
}

static void write_statistic(FILE *f, const json_t *s, double alpha)
{
    double share = member_number(s, "share"), log10_p = member_number(s, "log10_p");
    bool tested = member_number(s, "num_tests") > 0;
    bool rejects = tested && log10_p <= log10(alpha * share);
    html_row_open(f, rejects, member_text(s, "name"));
    if (!(share > 0)) {
        fputs("<td colspan=\"5\">not asked for</td></tr>\n", f);
        return;
    }
    fprintf(f, "<td class=\"num\">%.3g</td><td class=\"num\">%.0f</td>", alpha * share,
            member_number(s, "num_tests"));
    if (!tested) {
        fputs("<td colspan=\"3\">too skewed, or no noise</td></tr>\n", f);
        return;
    }
    fputs("<td class=\"num\">", f);
    html_p_value(f, log10_p);
    fprintf(f, "</td><td>%s</td><td>", rejects ? "<strong>DIFFERENT</strong>" : "nothing");
    if (log10_p < 0) /* else nothing stands out, and there is no place to name */
        html_text(f, member_text(s, "what"));
    fputs("</td></tr>\n", f);
}

static void write_hint(FILE *f, const json_t *h)
{
    const char *unit = member_text(h, "unit");
    html_print(f, "It looks like <b>%s</b>", member_text(h, "name"));
    if (unit[0] != '\0')
        html_print(f, " of %s %s", html_number(member_number(h, "amount")).s, unit);
    fprintf(f, ": made to B, that removes %.0f\u00a0%% of the difference. ",
            100 * member_number(h, "removed"));
}

/* The share of alpha of each statistic and what it found; what the difference resembles; the ratio of the variances. */
static void write_statistics(FILE *f, const json_t *claim)
{
    const json_t *all = json_object_get(claim, "statistics");
    const json_t *hint = json_object_get(claim, "hint");
    const json_t *ratio = json_object_get(claim, "variance_ratio");
    fputs("<h4>Which statistic looked</h4>\n", f);
    char label[160];
    snprintf(label, sizeof label, "Statistics of %.40s against %.40s on %.40s",
             member_or_empty(claim, "a"), member_or_empty(claim, "b"),
             member_or_empty(claim, "scene"));
    html_table_open(f, NULL, label,
                    "Statistic|>Part of alpha|>Tests|>Smallest p × tests|Found|Where or what");
    for (size_t i = 0; i < json_array_size(all); i++)
        write_statistic(f, json_array_get(all, i), member_number(claim, "alpha"));
    html_table_close(f);
    if (hint == NULL && ratio == NULL)
        return;
    fputs("<p class=\"caption\">", f);
    if (hint != NULL)
        write_hint(f, hint);
    if (ratio != NULL)
        fprintf(f, "The variance of one %s of A is %s times that of B [%s, %s].",
                member_number(claim, "spp_a") > 0 && member_number(claim, "spp_b") > 0 ? "path"
                                                                                       : "render",
                html_number(member_number(ratio, "ratio")).s,
                html_number(member_end(ratio, "ci", 0)).s,
                html_number(member_end(ratio, "ci", 1)).s);
    fputs("</p>\n", f);
}

/* How to replace the reference, if it is a stored one. */
static void write_approval(FILE *f, const json_t *claim)
{
    const char *commands = member_text(claim, "renew");
    if (commands != NULL)
        html_print(
            f,
            "<p class=\"caption\">If it is the stored reference that has to change: render it anew, look "
            "at it, then approve it, which asks for a reason where it differs:</p>\n<pre "
            "tabindex=\"0\"><code>%s</code></pre>\n",
            commands);
}

void report_evidence(FILE *f, const json_t *claim, bool open)
{
    fprintf(f,
            "<details%s>\n<summary>Everything needed to doubt it</summary>\n<dl class=\"facts\">\n",
            open ? " open" : "");
    write_numbers(f, claim);
    write_regions(f, claim);
    write_provenance(f, claim);
    fputs("</dl>\n", f);
    write_statistics(f, claim);
    if (member_text(claim, "rerun") != NULL)
        html_print(f,
                   "<p class=\"caption\">To run this claim again:</p>\n<pre "
                   "tabindex=\"0\"><code>%s</code></pre>\n",
                   member_text(claim, "rerun"));
    write_approval(f, claim);
    fputs("</details>\n", f);
}

enum { SHOWN = 8 };

struct tile {
    size_t index;
    double log10_p;
};

/* Inserts `one` into the sorted list of the SHOWN smallest p after equal ones; num: how many were inserted before. */
static void keep_smallest(struct tile tile[SHOWN], size_t num, struct tile one)
{
    size_t i = num < SHOWN ? num : SHOWN;
    if (i == SHOWN && one.log10_p >= tile[SHOWN - 1].log10_p)
        return;
    i -= i == SHOWN;
    for (; i > 0 && tile[i - 1].log10_p > one.log10_p; i--)
        tile[i] = tile[i - 1];
    tile[i] = one;
}

void report_evidence_tiles(FILE *f, const json_t *claim)
{
    const json_t *log10_p = json_object_get(claim, "tile_log10_p"),
                 *t = json_object_get(claim, "tile_t");
    size_t num = 0, size = json_array_size(log10_p),
           columns = (size_t)member_number(claim, "tiles_x");
    double side = member_number(claim, "tile");
    struct tile tile[SHOWN] = {{0}};
    for (size_t i = 0; i < size; i++) {
        const json_t *p = json_array_get(log10_p, i);
        if (json_is_number(p))
            keep_smallest(tile, num++, (struct tile){i, json_number_value(p)});
    }
    if (num > 0 && columns > 0) {
        fprintf(f,
                "<div class=\"tiles\"><h4>The tiles of smallest p, of %zu</h4>\n<div "
                "class=\"tabs\">\n",
                num);
        for (size_t i = 0; i < num && i < SHOWN; i++) {
            const struct tile *k = &tile[i];
            fprintf(f,
                    "<button type=\"button\" data-x=\"%.0f\" data-y=\"%.0f\">%.0f, %.0f: p %s%.2g, "
                    "t %s</button>\n",
                    side * (double)(k->index % columns), side * (double)(k->index / columns),
                    side * (double)(k->index % columns), side * (double)(k->index / columns),
                    k->log10_p < -12 ? "&lt; " : "", pow(10, fmin(fmax(k->log10_p, -12), 0)),
                    html_number(json_number_value(json_array_get(t, k->index))).s);
        }
        fputs(
            "</div>\n<p class=\"caption tile-reading\" aria-live=\"polite\">Each is x, y of its "
            "corner; p asks if the tile's means are equal, without a margin. The first is outlined "
            "in the maps. Press one to mark and enlarge it, or a tile in any image to mark "
            "it.</p></div>\n",
            f);
    }
}
