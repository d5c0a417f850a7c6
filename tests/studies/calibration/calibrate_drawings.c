/* Plots of the calibration: error rates and power against samples, with error bars. */
#include "calibrate.h"

#include "tests/support/rates.h"

#include "renderer/base/fs.h"
#include "tools/plots/plot.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const enum law laws[] = {LAW_NORMAL, LAW_EXPONENTIAL, LAW_BLACK, LAW_PARETO, LAW_LOGNORMAL};
enum { NUM_LAWS = sizeof laws / sizeof *laws };

/* Lines with error bars. */
enum { DRAWING_POINTS = 48, DRAWING_SERIES = 8 };

struct drawing_series {
    char name[64];
    int num;
    double x[DRAWING_POINTS], y[DRAWING_POINTS];
    double lo[DRAWING_POINTS], hi[DRAWING_POINTS]; /* of the error bar; equal: none */
};

struct drawing {
    const char *title;
    struct plot_axis x, y;
    bool is_diagonal;      /* the line y = x */
    double mark_x, mark_y; /* dashed lines; 0: none */
    const char *mark_text; /* beside the first */
    int num;
    struct drawing_series series[DRAWING_SERIES];
};

/* Appends a point; what the axes cannot show is cut at their ends. */
static void drawing_add(struct drawing_series *s, double x, double y, double lo, double hi)
{
    assert(s->num < DRAWING_POINTS);
    s->x[s->num] = x;
    s->y[s->num] = y;
    s->lo[s->num] = lo;
    s->hi[s->num++] = hi;
}

static void draw_series(struct plot *p, const struct drawing_series *s, size_t number)
{
    plot_series(p, number, s->name);
    for (int i = 0; i < s->num; i++) {
        plot_line_to(p, s->x[i], s->y[i]);
        if (s->hi[i] > s->lo[i]) {
            plot_segment(p, "line", s->x[i], s->lo[i], s->x[i], s->hi[i]);
            plot_point(p, number, s->x[i], s->y[i], "%s: %.3g at %.3g, %.3g to %.3g", s->name,
                       s->y[i], s->x[i], s->lo[i], s->hi[i]);
        } else {
            plot_point(p, number, s->x[i], s->y[i], "%s: %.3g at %.3g", s->name, s->y[i], s->x[i]);
        }
    }
    plot_series_end(p);
}

/* A file of its own, readable on light and on dark ground. */
static bool save(const char *dir, const char *name, const struct drawing *d, struct err *e)
{
    struct out_file out;
    if (!out_open(&out, fs_path("%s/%s.svg", dir, name).s, e))
        return false;
    struct plot p = plot_sized(out.f, 430, 330);
    p.title = d->title;
    p.top = 40;
    p.right = 210;
    p.x = d->x;
    p.y = d->y;
    p.x.has_grid = p.y.has_grid = true;
    plot_open(&p, "%s", d->title);
    if (d->is_diagonal) {
        double lo = fmax(d->x.lo, d->y.lo), hi = fmin(d->x.hi, d->y.hi);
        plot_segment(&p, "expected", lo, lo, hi, hi);
    }
    if (d->mark_x > 0) {
        plot_segment(&p, "expected", d->mark_x, d->y.lo, d->mark_x, d->y.hi);
        plot_text(&p, d->mark_x, d->y.lo, -5, -8, "end", "%s", d->mark_text);
    }
    if (d->mark_y > 0)
        plot_segment(&p, "expected", d->x.lo, d->mark_y, d->x.hi, d->mark_y);
    for (int i = 0; i < d->num; i++)
        draw_series(&p, &d->series[i], (size_t)i);
    plot_close(&p);
    return out_commit(&out, e);
}

/* Observed rate against p, from a pool of results, down to where one pair in the pool is left. */
static void add_curve(struct drawing_series *s, const struct null_result *pool, int column,
                      const char *name)
{
    snprintf(s->name, sizeof s->name, "%s", name);
    for (int i = 0; i < CURVE_POINTS; i++) {
        double rate = pool->curve[column][i];
        if (rate > 0)
            drawing_add(s, pow(10, -i / 8.0), rate, 0, 0);
    }
}

/* A drawing of observed rates against the levels asked for, on logarithmic axes. */
static struct drawing rates_drawing(void)
{
    return (struct drawing){.x.is_log = true,
                            .y.is_log = true,
                            .x.lo = 1e-4,
                            .x.hi = 1,
                            .y.lo = 1e-5,
                            .y.hi = 1,
                            .is_diagonal = true};
}

static bool draw_false_alarms(const char *dir, const struct settings *s, const struct results *r,
                              struct err *e)
{
    struct drawing p = rates_drawing();
    p.title = "False alarms of the gate";
    p.x.label = "alpha asked for";
    p.y.label = "rate of DIFFERENT at equal means";
    for (int k = 0; k < NUM_LAWS; k++) {
        struct null_result part[MAX_SYNTHETIC], pool;
        int num = 0;
        for (int i = 0; i < s->num_synthetic; i++)
            if (s->synthetic[i].law == laws[k])
                part[num++] = r->synthetic[i];
        null_pool(part, num, "", &pool);
        add_curve(&p.series[p.num++], &pool, COLUMN_GATE, law_name[laws[k]]);
    }
    struct null_result pool;
    null_pool(r->render, s->num_render, "", &pool);
    add_curve(&p.series[p.num++], &pool, COLUMN_GATE, "renders");
    return save(dir, "false_alarms", &p, e);
}

static bool draw_statistics(const char *dir, const struct settings *s, const struct results *r,
                            struct err *e)
{
    struct drawing p = rates_drawing();
    p.title = "p-values at equal means, all laws together";
    p.x.label = "p";
    p.y.label = "share of pairs with a smaller p";
    struct null_result pool;
    null_pool(r->synthetic, s->num_synthetic, "", &pool);
    for (int c = 0; c < NUM_COLUMNS; c++)
        if (pool.tested[c][LEVEL_SHAPE] > 0)
            add_curve(&p.series[p.num++], &pool, c, column_name[c]);
    return save(dir, "statistics", &p, e);
}

static bool draw_tail(const char *dir, const struct settings *s, const struct results *r,
                      struct err *e)
{
    struct drawing p = {.title = "Far tails of single regions",
                        .x.label = "p",
                        .y.label = "rate over p, with 99.9 % intervals",
                        .x.is_log = true,
                        .x.lo = 1e-7,
                        .x.hi = 1e-3,
                        .y.lo = 0,
                        .y.hi = 2,
                        .mark_y = 1};
    for (int i = 0; i < s->num_tail && p.num < DRAWING_SERIES; i++) {
        const struct tail_result *t = &r->tail[i];
        if (t->tested < 1e5) /* less than ten expected at 1e-4: a bar over all of the drawing */
            continue;
        struct drawing_series *series = &p.series[p.num++];
        snprintf(series->name, sizeof series->name, "%s", t->name);
        for (int l = 0; l < 3; l++) /* side by side, not on top of each other */
            drawing_add(series, tail_level[l] * pow(10, 0.06 * (i - 3.5)),
                        t->rejected[l] / t->tested / tail_level[l],
                        rate_lower(t->rejected[l], t->tested, check_tail) / tail_level[l],
                        rate_upper(t->rejected[l], t->tested, check_tail) / tail_level[l]);
    }
    return save(dir, "tail", &p, e);
}

static bool draw_power(const char *dir, const struct settings *s, const struct results *r,
                       struct err *e)
{
    struct drawing p = {.title = "Power against the printed MDB",
                        .x.label = "bias, in units of the MDB",
                        .y.label = "rate of DIFFERENT",
                        .x.lo = 0,
                        .x.hi = 1.25,
                        .y.lo = 0,
                        .y.hi = 1,
                        .mark_x = 1,
                        .mark_text = "MDB",
                        .mark_y = 0.95};
    for (int i = 0; i < s->num_power; i++) {
        const struct power_result *w = &r->power[i];
        struct drawing_series *series = &p.series[p.num++];
        const char *colon = strchr(w->name, ';');
        snprintf(series->name, sizeof series->name, "%.*s%s",
                 colon != NULL ? (int)(colon - w->name) : 63, w->name,
                 s->power[i].one_tile          ? ", a tile"
                 : s->power[i].margin_tile > 0 ? ", margins"
                 : !s->power[i].is_grey        ? ", colour"
                                               : "");
        for (int k = 0; k < POWER_POINTS; k++)
            drawing_add(series, power_bias[k], w->found[k] / w->pairs,
                        rate_lower(w->found[k], w->pairs, check_tail),
                        rate_upper(w->found[k], w->pairs, check_tail));
    }
    return save(dir, "power", &p, e);
}

bool page_draw(const char *dir, const struct settings *s, const struct results *r, struct err *e)
{
    return draw_false_alarms(dir, s, r, e) && draw_statistics(dir, s, r, e) &&
           draw_tail(dir, s, r, e) && draw_power(dir, s, r, e);
}
