/* The plot of the anchors: the smallest error that each rule finds, for each scene. */
#include "anchors.h"

#include "renderer/base/fs.h"
#include "tools/plots/plot.h"

#include <math.h>
#include <string.h>

/* The rules drawn, from above in each scene. idiff as published calls noise a difference, so what is
 * drawn is the better of its two thresholds set to the false-alarm rate that the page states. */
static const struct {
    enum anchor_rule rule;
    const char *label;
} lanes[] = {
    {RULE_GATE_STRICT, "ours, alpha 1e-6"},
    {RULE_SAME_STRICT, "ours, same program, 1e-6"},
    {RULE_TILES, "z of 16 x 16 tiles, 1e-6"},
    {RULE_MITSUBA, "Mitsuba 3 as published"},
    {RULE_WELCH, "Welch per pixel, 0.01"},
    {RULE_FLIP_TUNED, "FLIP, set to 1 % false alarms"},
    {RULE_IDIFF_FAIL_TUNED, "idiff, set to 1 % false alarms"},
};
enum { NUM_LANES = sizeof lanes / sizeof lanes[0] };

static const struct anchor_outcome *outcome_of(const struct anchor_scene_result *s, int lane,
                                               enum anchor_error kind)
{
    const struct anchor_outcome *fail = &s->rule[RULE_IDIFF_FAIL_TUNED],
                                *percent = &s->rule[RULE_IDIFF_PERCENT_TUNED];
    if (lanes[lane].rule != RULE_IDIFF_FAIL_TUNED)
        return &s->rule[lanes[lane].rule];
    return percent->bias[kind].b < fail->bias[kind].b ? percent : fail;
}

/* A logarithmic axis in per cent, of whole decades, that holds all finite estimates and intervals. */
static struct plot_axis axis_of(const struct anchor_results *r, enum anchor_error kind)
{
    double lo = INFINITY, hi = -INFINITY;
    for (int s = 0; s < r->num_scenes; s++)
        for (int l = 0; l < NUM_LANES; l++) {
            const struct anchor_outcome *o = outcome_of(&r->scene[s], l, kind);
            const struct anchor_bias *b = &o->bias[kind];
            if (anchors_useless(r, o) || !isfinite(b->b))
                continue;
            lo = fmin(lo, log10(100 * b->lo));
            hi = fmax(hi, log10(100 * (isfinite(b->hi) ? b->hi : b->b)));
        }
    struct plot_axis a = {.label = "smallest error found in 95 % of the pairs (left is better)",
                          .lo = 0.1,
                          .hi = 100,
                          .is_log = true,
                          .has_grid = true,
                          .unit = "\u00a0%"};
    if (lo <= hi) {
        a.lo = pow(10, floor(lo));
        a.hi = pow(10, fmax(floor(lo) + 1, ceil(hi)));
    }
    return a;
}

static void draw_outcome(struct plot *p, const struct anchor_results *r, int lane, double y,
                         enum anchor_error kind, const struct anchor_scene_result *s)
{
    const struct anchor_outcome *o = outcome_of(s, lane, kind);
    const struct anchor_bias *b = &o->bias[kind];
    if (anchors_useless(r, o)) {
        plot_text(p, p->x.lo, y, 6, 4, "start", "calls equal pictures different");
    } else if (!isfinite(b->b)) {
        plot_arrow(p, true, y, "%s, %s: not found", s->scene, lanes[lane].label);
    } else {
        plot_segment(p, "line", 100 * b->lo, y, 100 * b->hi, y);
        plot_point(p, (size_t)lane, 100 * b->b, y, "%s, %s: %.2g %%", s->scene, lanes[lane].label,
                   100 * b->b);
    }
}

/* A block of lanes for each scene, from above. */
static void draw(FILE *f, const struct anchor_results *r, enum anchor_error kind, const char *title)
{
    int block = NUM_LANES + 1;
    double lines = r->num_scenes * block;
    struct plot p = plot_sized(f, 470, 13 * lines);
    p.title = title;
    p.top = 40;
    p.left = 140;
    p.right = 210;
    p.x = axis_of(r, kind);
    p.y.hi = lines;
    plot_open(&p, "%s", title);
    for (int s = 0; s < r->num_scenes; s++)
        plot_text(&p, p.x.lo, lines - s * block - NUM_LANES / 2.0 - 0.5, -8, 4, "end", "%s",
                  r->scene[s].scene);
    for (int l = 0; l < NUM_LANES; l++) {
        plot_series(&p, (size_t)l, lanes[l].label);
        for (int s = 0; s < r->num_scenes; s++)
            draw_outcome(&p, r, l, lines - s * block - l - 1, kind, &r->scene[s]);
    }
    plot_close(&p);
}

bool anchors_write_plot(const char *path, const struct anchor_results *r, enum anchor_error kind,
                        const char *title, struct err *e)
{
    struct out_file o;
    if (!out_open(&o, path, e))
        return false;
    draw(o.f, r, kind, title);
    return out_commit(&o, e);
}
