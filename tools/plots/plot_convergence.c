#include "plot_convergence.h"

#include "plot.h"

#include "tools/html/csv_link.h"
#include "tools/results/results.h"

#include <math.h>

/* x of a rung; 0 where time is not known. */
static double rung_x(const json_t *engine, const json_t *rung, bool against_time)
{
    double spp = member_number(rung, "spp");
    return against_time ? fmax(0, spp * member_number(engine, "cpu_s_per_spp")) : spp;
}

/* The ends of both axes: 6 % beyond all rungs. False if no rung has a point on logarithmic axes. */
static bool find_ends(const json_t *engines, bool against_time, struct plot *p)
{
    double x0 = INFINITY, x1 = -INFINITY, y0 = INFINITY, y1 = -INFINITY;
    json_each(j, engines)
        json_each(g, json_object_get(j, "rungs")) {
            double x = log10(rung_x(j, g, against_time)), y = log10(100 * member_number(g, "rmse"));
            if (!isfinite(x) || !isfinite(y))
                continue;
            x0 = fmin(x0, x);
            x1 = fmax(x1, x);
            y0 = fmin(y0, y);
            y1 = fmax(y1, y);
        }
    double dx = 0.06 * (x1 - x0) + 1e-3, dy = 0.06 * (y1 - y0) + 1e-3;
    p->x.lo = pow(10, x0 - dx);
    p->x.hi = pow(10, x1 + dx);
    p->y.lo = pow(10, y0 - dy);
    p->y.hi = pow(10, y1 + dy);
    return x1 >= x0;
}

static void draw_engine(struct plot *p, const json_t *engine, size_t number, bool against_time)
{
    plot_series(p, number, member_text(engine, "engine"));
    json_each(g, json_object_get(engine, "rungs")) {
        double x = rung_x(engine, g, against_time), y = 100 * member_number(g, "rmse");
        if (!(x > 0))
            continue;
        plot_line_to(p, x, y);
        if (json_array_size(json_object_get(g, "rmse_ci")) == 2)
            plot_segment(p, "line", x, 100 * member_end(g, "rmse_ci", 0), x,
                         100 * member_end(g, "rmse_ci", 1));
        plot_point(p, number, x, y, "%s, %g samples: %.4g %%, %.3g s",
                   member_text(engine, "engine"), member_number(g, "spp"), y,
                   member_number(g, "cpu_s"));
    }
    plot_series_end(p);
}

/* A dashed line of slope -1/2 through the first engine's first point. */
static void draw_guide(struct plot *p, const json_t *engine, bool against_time)
{
    const json_t *g = json_array_get(json_object_get(engine, "rungs"), 0);
    double x = g != NULL ? rung_x(engine, g, against_time) : 0, y = 100 * member_number(g, "rmse");
    double end = fmin(p->x.hi, x * pow(y / p->y.lo, 2));
    if (x > 0)
        plot_segment(p, "expected", x, y, end, y * sqrt(x / end));
}

static void write_plot_csv(FILE *f, const json_t *engines, bool against_time)
{
    struct csv csv =
        against_time
            ? csv_link_open(f, "error_time.csv", "engine,cpu_seconds,rmse,rmse_low,rmse_high")
            : csv_link_open(f, "error_samples.csv", "engine,samples,rmse,rmse_low,rmse_high");
    json_each(j, engines)
        json_each(g, json_object_get(j, "rungs"))
            csv_link_row(&csv, "tnmi", member_text(j, "engine"), rung_x(j, g, against_time), g,
                         "rmse", g, "rmse_ci");
    csv_link_close(&csv);
}

void plot_convergence(FILE *f, const json_t *scene, bool against_time)
{
    const json_t *engines = json_object_get(scene, "engines"), *j;
    const char *what =
        against_time ? "CPU seconds of an image, without the engine's start" : "samples per pixel";
    struct plot p = plot_sized(f, 340, 240);
    size_t k;
    p.x = (struct plot_axis){.label = what, .is_log = true, .has_grid = true};
    p.left = 70; /* for "0.001 %" */
    p.y = (struct plot_axis){.label = "relative RMS error of an image",
                             .is_log = true,
                             .has_grid = true,
                             .unit = "\u00a0%"};
    if (!find_ends(engines, against_time, &p))
        return;
    fputs("<figure class=\"map\">", f);
    plot_open(&p, "RMSE against %s, both axes logarithmic", what);
    draw_guide(&p, json_array_get(engines, 0), against_time);
    json_array_foreach(engines, k, j) {
        if (json_object_get(j, "error") == NULL)
            draw_engine(&p, j, k, against_time);
    }
    plot_close(&p);
    fputs(against_time
              ? "<figcaption><b>Error against time.</b> Further left is better: the same error for "
                "less work. Times are this machine's. "
              : "<figcaption><b>Error against samples.</b> The RMS over the pixels of the relative "
                "error of one image, with the noise of the reference taken out. The dashed line "
                "falls as the square root of the samples does, which is what independent samples "
                "must do; stratified ones may fall faster. A line that bends flat has a bias. "
                "Upright strokes are intervals. ",
          f);
    write_plot_csv(f, engines, against_time);
    fputs("</figcaption></figure>\n", f);
}
