/* The page's section on convergence: slope, bias, variance, efficiency. */
#include "report_internal.h"

#include "tools/results/convergence_results.h"
#include "tools/plots/plot_convergence.h"
#include "tools/html/csv_link.h"
#include "tools/html/html.h"

#include <string.h>

static void write_badge(FILE *f, const char *verdict, enum outcome outcome)
{
    static const char *const style[] = {"error", "bad", "bad", "good"};
    if (strcmp(verdict, "MEASURED") == 0) {
        fputs("measured", f);
        return;
    }
    html_print(f, "<span class=\"badge %s\">%s</span>", style[outcome], verdict);
}

static void write_row(void *ctx, const struct convergence_row *r)
{
    FILE *f = ctx;
    html_row_open(f, r->outcome != OUTCOME_AS_EXPECTED, r->engine);
    html_print(f, "<td>%s</td><td class=\"%s\">%s</td><td>", r->quantity,
               r->outcome == OUTCOME_NOT_JUDGED ? "error-cell" : "num", r->value);
    write_badge(f, r->verdict, r->outcome);
    fputs("</td></tr>\n", f);
}

static void write_number(FILE *f, const json_t *object, const char *name, double factor)
{
    const json_t *v = json_object_get(object, name);
    fputs("<td class=\"num\">", f);
    if (json_is_number(v))
        fputs(html_number(factor * json_number_value(v)).s, f);
    fputs("</td>", f);
}

static void write_csv(FILE *f, const json_t *engines)
{
    struct csv csv =
        csv_link_open(f, "convergence.csv",
                      "engine,samples,rmse,variance,bias,cpu_s,efficiency,rmse_low,rmse_high");
    json_each(j, engines)
        json_each(g, json_object_get(j, "rungs"))
            csv_link_row(&csv, "tmmmmmmi", member_text(j, "engine"), g, "spp", g, "rmse", g,
                         "variance", g, "bias", g, "cpu_s", g, "efficiency", g, "rmse_ci");
    csv_link_close(&csv);
}

static void write_rungs(FILE *f, const json_t *scene)
{
    fputs("<h3>The rungs</h3>\n", f);
    html_table_open(f, NULL, "Table of rungs",
                    "Engine|>Samples|>RMSE %|>Variance|>RMS bias %|>CPU s|>Efficiency 1/s");
    const json_t *engines = json_object_get(scene, "engines");
    json_each(j, engines) {
        const json_t *rungs = json_object_get(j, "rungs");
        json_each(g, rungs) {
            html_row_open(f, false, member_text(j, "engine"));
            fprintf(f, "<td class=\"num\">%.0f</td>", member_number(g, "spp"));
            write_number(f, g, "rmse", 100);
            write_number(f, g, "variance", 1);
            write_number(f, g, "bias", 100);
            write_number(f, g, "cpu_s", 1);
            write_number(f, g, "efficiency", 1);
            fputs("</tr>\n", f);
        }
    }
    html_table_close(f);
    fputs("<p class=\"caption\"><b>Variance</b>: of one image, relative, mean over "
          "the pixels. <b>RMS bias</b>: what is left of the "
          "error when noise is taken out; negative where the noise, by chance, was more. "
          "<b>CPU s</b>: of one image, its share of the engine's start included. "
          "<b>Efficiency</b>: 1/(variance × CPU seconds), start left out. ",
          f);
    write_csv(f, engines);
    fputs("</p>\n", f);
}

static void write_scene(FILE *f, const json_t *scene)
{
    const char *title = member_text(scene, "title");
    html_print(f,
               "<section class=\"scene\">\n<h2>Convergence: %s <code>%s</code></h2>\n"
               "<p class=\"lede\">%.0f × %.0f pixels, depth %.0f, %.0f images with seeds of "
               "their own for each number of samples. Errors are against %s (RMS noise %s). Each "
               "interval has the level %.6g\u00a0%%.</p>\n",
               title != NULL ? title : member_text(scene, "scene"), member_text(scene, "scene"),
               member_number(scene, "width"), member_number(scene, "height"),
               member_number(scene, "depth"), member_number(scene, "replicates"),
               member_text(scene, "reference"),
               html_percent_plain(member_number(scene, "reference_noise")).s,
               100 * (1 - member_number(scene, "alpha")));
    fputs("<div class=\"maps\">\n", f);
    plot_convergence(f, scene, false);
    plot_convergence(f, scene, true);
    plot_depths(f, json_object_get(scene, "depths"));
    fputs("</div>\n", f);
    html_table_open(f, NULL, "Table of quantities", "Engine|Quantity|>Value and interval|Verdict");
    convergence_results_rows(scene, write_row, f);
    html_table_close(f);
    json_each(j, json_object_get(scene, "engines"))
        if (convergence_results_reason(j) != NULL)
            html_print(f, "<p class=\"caption\"><b>%s</b>: %s.</p>\n", member_text(j, "engine"),
                       convergence_results_reason(j));
    write_rungs(f, scene);
    fputs("</section>\n", f);
}

void report_convergence_headline(FILE *f, const json_t *results, bool alone)
{
    size_t count[OUTCOME_AS_EXPECTED + 1] = {0}, num = 0, judged = 0;
    struct results_walk w = {.results = results, .kind = JUDGED_CONVERGENCE};
    for (; results_next(&w); num++) {
        count[w.outcome]++;
        judged += json_is_true(json_object_get(w.json, "judged"));
    }
    if (num == 0)
        return;
    const size_t errors = count[OUTCOME_NOT_JUDGED], wrong = count[OUTCOME_OPPOSITE],
                 undecided = count[OUTCOME_UNDECIDED];
    const char *tag = alone ? "h1" : "p";
    fprintf(f, "<%s class=\"%s\">", tag,
            !alone                              ? "lede"
            : count[OUTCOME_AS_EXPECTED] == num ? "good"
                                                : "bad");
    if (errors > 0)
        fprintf(f, "Convergence: %zu of %zu engines could not be judged, %zu failed.", errors, num,
                wrong);
    else if (wrong > 0)
        fprintf(f, "Convergence: %zu of %zu judged engines are not as they must be.", wrong,
                judged);
    else if (undecided > 0)
        fprintf(f,
                "Convergence: of %zu judged engines %zu stayed undecided; more replicates "
                "(--replicates) or samples would tell.",
                judged, undecided);
    else
        fprintf(f, "Convergence: %zu of %zu judged engines converge as they must.", judged, judged);
    fprintf(f, "</%s>\n", tag);
}

void report_convergence(FILE *f, const json_t *convergence)
{
    for (size_t i = 0; i < json_array_size(convergence); i++)
        write_scene(f, json_array_get(convergence, i));
}
