#include "plot_convergence.h"

#include "tools/html/csv_link.h"
#include "tools/html/html.h"
#include "tools/results/results.h"

#include <math.h>

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

/* Opens a mark and returns its tag: circle, square, triangle, diamond, so that engines can be told apart without
 * colours. */
static const char *open_mark(FILE *f, size_t index, double x, double y, double r)
{
    if (index % 4 == 0) {
        fprintf(f, "<circle class=\"dot\" cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\">", x, y, r);
        return "circle";
    }
    double t = 1.2 * r, d = 1.4 * r;
    if (index % 4 == 1)
        fprintf(f, "<path class=\"dot\" d=\"M%.1f %.1fh%.1fv%.1fh-%.1fz\">", x - r, y - r, 2 * r,
                2 * r, 2 * r);
    else if (index % 4 == 2)
        fprintf(f, "<path class=\"dot\" d=\"M%.1f %.1fl%.1f %.1fh-%.1fz\">", x, y - t, t, 2 * t,
                2 * t);
    else
        fprintf(f, "<path class=\"dot\" d=\"M%.1f %.1fl%.1f %.1fl-%.1f %.1fl-%.1f -%.1fz\">", x,
                y - d, d, d, d, d, d, d);
    return "path";
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
        const char *tag = open_mark(f, index, at_x(a, x), at_y(a, member_number(g, "rmse")), 3.2);
        fputs("<title>", f);
        html_text(f, member_text(engine, "engine"));
        fprintf(f, ", %g samples: %.4g %%, %.3g s</title></%s>", member_number(g, "spp"),
                100 * member_number(g, "rmse"), member_number(g, "cpu_s"), tag);
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
        fprintf(f, "</%s>", open_mark(f, k, LEFT + PLOT_WIDTH - 128, y - 4, 4));
        fputs("</g>", f);
        y += 17;
    }
}

static void write_plot_csv(FILE *f, const json_t *engines, bool against_time)
{
    struct csv csv =
        against_time
            ? csv_link_open(f, "error_time.csv", "engine,cpu_seconds,rmse,rmse_low,rmse_high")
            : csv_link_open(f, "error_samples.csv", "engine,samples,rmse,rmse_low,rmse_high");
    for (size_t k = 0; k < json_array_size(engines); k++) {
        const json_t *j = json_array_get(engines, k), *rungs = json_object_get(j, "rungs");
        for (size_t i = 0; i < json_array_size(rungs); i++) {
            const json_t *g = json_array_get(rungs, i);
            csv_link_text(&csv, member_text(j, "engine"));
            csv_link_number(&csv, rung_x(j, g, against_time));
            csv_link_number(&csv, member_number(g, "rmse"));
            csv_link_interval(&csv, g, "rmse_ci");
            csv_link_line(&csv);
        }
    }
    csv_link_close(&csv);
}

void plot_convergence(FILE *f, const json_t *scene, bool against_time)
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
