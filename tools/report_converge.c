#include "report_converge.h"

#include "convergence.h"
#include "report_csv.h"
#include "report_html.h"
#include "report_parts.h"

#include <math.h>
#include <string.h>

enum { LEFT = 58, TOP = 10, PLOT_WIDTH = 340, PLOT_HEIGHT = 240, BOTTOM = TOP + PLOT_HEIGHT };

/* One plot: relative RMSE of every engine against x, both logarithmic. */
struct axes {
    double x0, x1, y0, y1; /* log10 of the ends */
    bool against_time;     /* x is CPU seconds, else samples */
};

static double end(const json_t *object, const char *name, size_t i)
{
    return json_number_value(json_array_get(json_object_get(object, name), i));
}

/* x of a rung; 0 where time is not known. */
static double rung_x(const json_t *engine, const json_t *rung, bool against_time)
{
    double spp = member_number(rung, "spp");
    return against_time ? fmax(0, spp * member_number(engine, "cpu_s_per_spp")) : spp;
}

static struct axes axes_of(const json_t *scene, bool against_time)
{
    struct axes a = {INFINITY, -INFINITY, INFINITY, -INFINITY, against_time};
    const json_t *engines = json_object_get(scene, "engines");
    for (size_t k = 0; k < json_array_size(engines); k++) {
        const json_t *j = json_array_get(engines, k), *rungs = json_object_get(j, "rungs");
        for (size_t i = 0; i < json_array_size(rungs); i++) {
            const json_t *g = json_array_get(rungs, i);
            double x = rung_x(j, g, against_time), y = log10(member_number(g, "rmse"));
            if (!(x > 0))
                continue;
            a.x0 = fmin(a.x0, log10(x));
            a.x1 = fmax(a.x1, log10(x));
            a.y0 = fmin(a.y0, y);
            a.y1 = fmax(a.y1, y);
        }
    }
    double px = 0.06 * (a.x1 - a.x0) + 1e-3, py = 0.06 * (a.y1 - a.y0) + 1e-3;
    a.x0 -= px;
    a.x1 += px;
    a.y0 -= py;
    a.y1 += py;
    return a;
}

static double at_x(const struct axes *a, double x)
{
    return LEFT + PLOT_WIDTH * (log10(x) - a->x0) / (a->x1 - a->x0);
}

static double at_y(const struct axes *a, double y)
{
    return BOTTOM - PLOT_HEIGHT * (log10(y) - a->y0) / (a->y1 - a->y0);
}

/* Ticks at 1, 2, 5 times powers of ten, or only at these where more than three decades are shown. */
static void write_ticks(FILE *f, const struct axes *a, bool vertical)
{
    static const double digit[] = {1, 2, 5};
    double lo = vertical ? a->y0 : a->x0, hi = vertical ? a->y1 : a->x1;
    size_t digits = hi - lo > 2.2 ? 1 : 3;
    for (int decade = (int)floor(lo); decade <= (int)ceil(hi); decade++)
        for (size_t i = 0; i < digits; i++) {
            double v = digit[i] * pow(10, decade);
            if (log10(v) < lo || log10(v) > hi)
                continue;
            if (vertical)
                fprintf(f,
                        "<path class=\"grid\" d=\"M%d %.1fh%d\"/>"
                        "<text x=\"%d\" y=\"%.1f\" text-anchor=\"end\">%g\u00a0%%</text>",
                        LEFT, at_y(a, v), PLOT_WIDTH, LEFT - 6, at_y(a, v) + 4, 100 * v);
            else
                fprintf(f,
                        "<path class=\"grid\" d=\"M%.1f %dv%d\"/>"
                        "<text x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">%g</text>",
                        at_x(a, v), TOP, PLOT_HEIGHT, at_x(a, v), BOTTOM + 16, v);
        }
}

/* Circle, square, triangle, diamond: engines can be told apart without colours. */
static void write_marker(FILE *f, size_t index, double x, double y, double r)
{
    switch (index % 4) {
    case 0:
        fprintf(f, "<circle class=\"dot\" cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\"/>", x, y, r);
        return;
    case 1:
        fprintf(f, "<path class=\"dot\" d=\"M%.1f %.1fh%.1fv%.1fh-%.1fz\"/>", x - r, y - r, 2 * r,
                2 * r, 2 * r);
        return;
    case 2:
        fprintf(f, "<path class=\"dot\" d=\"M%.1f %.1fl%.1f %.1fh-%.1fz\"/>", x, y - 1.2 * r,
                1.2 * r, 2.2 * r, 2.4 * r);
        return;
    default:
        fprintf(f, "<path class=\"dot\" d=\"M%.1f %.1fl%.1f %.1fl-%.1f %.1fl-%.1f -%.1fz\"/>", x,
                y - 1.4 * r, 1.4 * r, 1.4 * r, 1.4 * r, 1.4 * r, 1.4 * r, 1.4 * r);
    }
}

static void write_series(FILE *f, const struct axes *a, const json_t *engine, size_t index)
{
    const json_t *rungs = json_object_get(engine, "rungs");
    fprintf(f, "<g class=\"e%zu\"><path class=\"line\" d=\"", index);
    const char *op = "M";
    for (size_t i = 0; i < json_array_size(rungs); i++) {
        const json_t *g = json_array_get(rungs, i);
        double x = rung_x(engine, g, a->against_time);
        if (!(x > 0))
            continue;
        fprintf(f, "%s%.1f %.1f", op, at_x(a, x), at_y(a, member_number(g, "rmse")));
        op = "L";
    }
    fputs("\"/>", f);
    for (size_t i = 0; i < json_array_size(rungs); i++) {
        const json_t *g = json_array_get(rungs, i);
        double x = rung_x(engine, g, a->against_time);
        if (!(x > 0))
            continue;
        if (json_array_size(json_object_get(g, "rmse_ci")) == 2)
            fprintf(f, "<path class=\"line\" d=\"M%.1f %.1fV%.1f\"/>", at_x(a, x),
                    fmin(BOTTOM, at_y(a, end(g, "rmse_ci", 0))),
                    fmax(TOP, at_y(a, end(g, "rmse_ci", 1))));
        fputs("<g>", f);
        write_marker(f, index, at_x(a, x), at_y(a, member_number(g, "rmse")), 3.2);
        fputs("<title>", f);
        html_text(f, member_text(engine, "engine"));
        fprintf(f, ", %g samples: %.4g %%, %.3g s</title></g>", member_number(g, "spp"),
                100 * member_number(g, "rmse"), member_number(g, "cpu_s"));
    }
    fputs("</g>", f);
}

/* A dashed line of slope -1/2 through the first engine's first point. */
static void write_guide(FILE *f, const struct axes *a, const json_t *scene)
{
    const json_t *engine = json_array_get(json_object_get(scene, "engines"), 0);
    const json_t *g = json_array_get(json_object_get(engine, "rungs"), 0);
    double x = g != NULL ? rung_x(engine, g, a->against_time) : 0;
    if (!(x > 0))
        return;
    double x0 = log10(x), y0 = log10(member_number(g, "rmse"));
    double x1 = fmin(a->x1, x0 + 2 * (y0 - a->y0));
    fprintf(f, "<path class=\"expected\" d=\"M%.1f %.1fL%.1f %.1f\"/>", at_x(a, x),
            at_y(a, pow(10, y0)), at_x(a, pow(10, x1)), at_y(a, pow(10, y0 - (x1 - x0) / 2)));
}

static void write_legend(FILE *f, const json_t *engines)
{
    double y = TOP + 16;
    for (size_t k = 0; k < json_array_size(engines); k++) {
        const json_t *j = json_array_get(engines, k);
        if (json_object_get(j, "error") != NULL)
            continue;
        fprintf(f, "<g class=\"e%zu\"><text x=\"%d\" y=\"%.1f\">", k, LEFT + PLOT_WIDTH - 118, y);
        html_text(f, member_text(j, "engine"));
        fputs("</text>", f);
        write_marker(f, k, LEFT + PLOT_WIDTH - 128, y - 4, 4);
        fputs("</g>", f);
        y += 17;
    }
}

static void write_plot_csv(FILE *f, const json_t *engines, bool against_time)
{
    struct csv csv =
        against_time ? csv_open(f, "error_time.csv", "engine,cpu_seconds,rmse,rmse_low,rmse_high")
                     : csv_open(f, "error_samples.csv", "engine,samples,rmse,rmse_low,rmse_high");
    for (size_t k = 0; k < json_array_size(engines); k++) {
        const json_t *j = json_array_get(engines, k), *rungs = json_object_get(j, "rungs");
        for (size_t i = 0; i < json_array_size(rungs); i++) {
            const json_t *g = json_array_get(rungs, i);
            bool has_ci = json_array_size(json_object_get(g, "rmse_ci")) == 2;
            csv_text(&csv, member_text(j, "engine"));
            csv_number(&csv, rung_x(j, g, against_time));
            csv_number(&csv, member_number(g, "rmse"));
            for (size_t n = 0; n < 2; n++)
                csv_number(&csv, has_ci ? end(g, "rmse_ci", n) : NAN);
            csv_line(&csv);
        }
    }
    csv_close(&csv);
}

static void write_plot(FILE *f, const json_t *scene, bool against_time)
{
    struct axes a = axes_of(scene, against_time);
    if (!(a.x1 > a.x0))
        return;
    const json_t *engines = json_object_get(scene, "engines");
    const char *what =
        against_time ? "CPU seconds of a picture, without the engine's start" : "samples per pixel";
    fprintf(f,
            "<figure class=\"map\"><svg class=\"plot\" viewBox=\"0 0 %d %d\" role=\"img\" "
            "aria-label=\"RMSE against %s, both axes logarithmic\">",
            LEFT + PLOT_WIDTH + 14, BOTTOM + 40, what);
    write_ticks(f, &a, true);
    write_ticks(f, &a, false);
    fprintf(f, "<path class=\"axis\" d=\"M%d %dV%dH%d\"/>", LEFT, TOP, BOTTOM, LEFT + PLOT_WIDTH);
    write_guide(f, &a, scene);
    for (size_t k = 0; k < json_array_size(engines); k++)
        if (json_object_get(json_array_get(engines, k), "error") == NULL)
            write_series(f, &a, json_array_get(engines, k), k);
    write_legend(f, engines);
    fprintf(
        f,
        "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">%s</text><text transform=\"translate(11 %d) "
        "rotate(-90)\" text-anchor=\"middle\">relative RMS error of a picture</text></svg>",
        LEFT + PLOT_WIDTH / 2, BOTTOM + 34, what, TOP + PLOT_HEIGHT / 2);
    fputs(against_time
              ? "<figcaption><b>Error against time.</b> Further left is better: the same error for "
                "less work. Times are this machine's. "
              : "<figcaption><b>Error against samples.</b> The RMS over the pixels of the relative "
                "error of one picture, with the noise of the reference taken out. The dashed line "
                "falls as the square root of the samples does, which is what independent samples "
                "must do; stratified ones may fall faster. A line that bends flat has a bias. "
                "Upright strokes are intervals. ",
          f);
    write_plot_csv(f, engines, against_time);
    fputs("</figcaption></figure>\n", f);
}

static void write_badge(FILE *f, const char *verdict, enum outcome outcome)
{
    static const char *const style[] = {"error", "bad", "bad", "good"};
    if (strcmp(verdict, "MEASURED") == 0) {
        fputs("measured", f);
        return;
    }
    fprintf(f, "<span class=\"badge %s\">", style[outcome]);
    html_text(f, verdict);
    fputs("</span>", f);
}

static void write_row(void *ctx, const struct convergence_row *r)
{
    FILE *f = ctx;
    fprintf(f, "<tr%s><th scope=\"row\">",
            r->outcome == OUTCOME_AS_EXPECTED ? "" : " class=\"bad\"");
    html_text(f, r->engine);
    fputs("</th><td>", f);
    html_text(f, r->quantity);
    fprintf(f, "</td><td class=\"%s\">", r->outcome == OUTCOME_NOT_JUDGED ? "error-cell" : "num");
    html_text(f, r->value);
    fputs("</td><td>", f);
    write_badge(f, r->verdict, r->outcome);
    fputs("</td></tr>\n", f);
}

static void write_number(FILE *f, const json_t *object, const char *name, double factor)
{
    const json_t *v = json_object_get(object, name);
    fputs("<td class=\"num\">", f);
    if (json_is_number(v))
        fputs(plain_number(factor * json_number_value(v)).s, f);
    fputs("</td>", f);
}

static void write_csv(FILE *f, const json_t *engines)
{
    static const char *const number[] = {"spp", "rmse", "variance", "bias", "cpu_s", "efficiency"};
    struct csv csv =
        csv_open(f, "convergence.csv",
                 "engine,samples,rmse,variance,bias,cpu_s,efficiency,rmse_low,rmse_high");
    for (size_t k = 0; k < json_array_size(engines); k++) {
        const json_t *j = json_array_get(engines, k), *rungs = json_object_get(j, "rungs");
        for (size_t i = 0; i < json_array_size(rungs); i++) {
            const json_t *g = json_array_get(rungs, i);
            bool has_ci = json_array_size(json_object_get(g, "rmse_ci")) == 2;
            csv_text(&csv, member_text(j, "engine"));
            for (size_t n = 0; n < sizeof number / sizeof *number; n++)
                csv_number(&csv, json_is_number(json_object_get(g, number[n]))
                                     ? member_number(g, number[n])
                                     : NAN);
            for (size_t n = 0; n < 2; n++)
                csv_number(&csv, has_ci ? end(g, "rmse_ci", n) : NAN);
            csv_line(&csv);
        }
    }
    csv_close(&csv);
}

static void write_rungs(FILE *f, const json_t *scene)
{
    fputs("<h4>The rungs</h4>\n<div class=\"wide\" tabindex=\"0\" role=\"region\" "
          "aria-label=\"Table of rungs\">\n<table><thead><tr><th scope=\"col\">Engine</th>"
          "<th scope=\"col\" class=\"num\">Samples</th><th scope=\"col\" class=\"num\">RMSE %</th>"
          "<th scope=\"col\" class=\"num\">Variance</th><th scope=\"col\" class=\"num\">RMS bias "
          "%</th><th scope=\"col\" class=\"num\">CPU s</th><th scope=\"col\" "
          "class=\"num\">Efficiency 1/s</th></tr></thead>\n<tbody>\n",
          f);
    const json_t *engines = json_object_get(scene, "engines");
    for (size_t k = 0; k < json_array_size(engines); k++) {
        const json_t *j = json_array_get(engines, k), *rungs = json_object_get(j, "rungs");
        for (size_t i = 0; i < json_array_size(rungs); i++) {
            const json_t *g = json_array_get(rungs, i);
            fputs("<tr><th scope=\"row\">", f);
            html_text(f, member_text(j, "engine"));
            fprintf(f, "</th><td class=\"num\">%.0f</td>", member_number(g, "spp"));
            write_number(f, g, "rmse", 100);
            write_number(f, g, "variance", 1);
            write_number(f, g, "bias", 100);
            write_number(f, g, "cpu_s", 1);
            write_number(f, g, "efficiency", 1);
            fputs("</tr>\n", f);
        }
    }
    fputs(
        "</tbody></table>\n</div>\n<p class=\"caption\"><b>Variance</b>: of one picture, relative, mean over "
        "the pixels. <b>RMS bias</b>: what is left of the "
        "error when noise is taken out; negative where the noise, by chance, was more. "
        "<b>CPU s</b>: of one picture, its share of the engine's start included. "
        "<b>Efficiency</b>: 1/(variance × CPU seconds), start left out. ",
        f);
    write_csv(f, engines);
    fputs("</p>\n", f);
}

static void write_scene(FILE *f, const json_t *scene)
{
    const char *title = member_text(scene, "title");
    fputs("<section class=\"scene\">\n<h2>Convergence: ", f);
    html_text(f, title != NULL ? title : member_text(scene, "scene"));
    fputs(" <code>", f);
    html_text(f, member_text(scene, "scene"));
    fprintf(f,
            "</code></h2>\n<p class=\"lede\">%.0f × %.0f pixels, %.0f bounces, %.0f pictures with "
            "seeds of their own for each number of samples. Errors are against ",
            member_number(scene, "width"), member_number(scene, "height"),
            member_number(scene, "depth"), member_number(scene, "replicates"));
    html_text(f, member_text(scene, "reference"));
    fprintf(f, " (RMS noise %s). Each interval has the level %.6g\u00a0%%.</p>\n",
            percent_plain(member_number(scene, "reference_noise")).s,
            100 * (1 - member_number(scene, "alpha")));
    fputs("<div class=\"maps\">\n", f);
    write_plot(f, scene, false);
    write_plot(f, scene, true);
    fputs("</div>\n<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"Table of "
          "quantities\">\n<table><thead><tr><th scope=\"col\">Engine</th><th "
          "scope=\"col\">Quantity</th><th scope=\"col\" class=\"num\">Value and interval</th><th "
          "scope=\"col\">Verdict</th></tr></thead>\n<tbody>\n",
          f);
    convergence_rows(scene, write_row, f);
    fputs("</tbody></table>\n</div>\n", f);
    write_rungs(f, scene);
    fputs("</section>\n", f);
}

void report_convergence_headline(FILE *f, const json_t *convergence, bool alone)
{
    size_t num = 0, judged = 0, wrong = 0, errors = 0;
    if (convergence == NULL)
        return;
    for (size_t i = 0; i < json_array_size(convergence); i++) {
        const json_t *engines = json_object_get(json_array_get(convergence, i), "engines");
        num += json_array_size(engines);
        for (size_t k = 0; k < json_array_size(engines); k++) {
            const json_t *j = json_array_get(engines, k);
            enum outcome o = convergence_outcome(j);
            errors += o == OUTCOME_NOT_JUDGED;
            wrong += o == OUTCOME_OPPOSITE || o == OUTCOME_UNDECIDED;
            judged += json_is_true(json_object_get(j, "judged"));
        }
    }
    const char *tag = alone ? "h1" : "p";
    fprintf(f, "<%s class=\"%s\">", tag, !alone ? "lede" : errors + wrong == 0 ? "good" : "bad");
    if (errors > 0)
        fprintf(f, "Convergence: %zu of %zu engines could not be judged, %zu failed.", errors, num,
                wrong);
    else if (wrong > 0)
        fprintf(f, "Convergence: %zu of %zu judged engines did not converge as they must.", wrong,
                judged);
    else
        fprintf(f, "Convergence: %zu of %zu judged engines converge as they must.", judged, judged);
    fprintf(f, "</%s>\n", tag);
}

void report_convergence(FILE *f, const json_t *convergence)
{
    for (size_t i = 0; i < json_array_size(convergence); i++)
        write_scene(f, json_array_get(convergence, i));
}
