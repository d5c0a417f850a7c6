#include "anchors.h"

#include "renderer/base/fs.h"

#include <math.h>
#include <string.h>

enum { LEFT = 150, WIDTH = 760, RIGHT = WIDTH - 24, TOP = 92, LANE = 13, GAP = 14 };

/* The rules drawn, from above in each scene. idiff as published calls noise a difference, so what is
 * drawn is the better of its two thresholds set to the false-alarm rate that the page states. */
static const struct {
    enum anchor_rule rule;
    const char *class, *label;
} lanes[] = {
    {RULE_GATE_STRICT, "ours", "ours, alpha 1e-6"},
    {RULE_MITSUBA, "mitsuba", "Mitsuba 3 as published"},
    {RULE_WELCH, "welch", "Welch per pixel, 0.01"},
    {RULE_IDIFF_FAIL_TUNED, "idiff", "idiff, set to 1 % false alarms"},
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

struct axis {
    double lo, hi; /* log10 */
};

/* Whole decades around everything finite. */
static struct axis axis_of(const struct anchor_results *r, enum anchor_error kind)
{
    struct axis a = {INFINITY, -INFINITY};
    for (int s = 0; s < r->num_scenes; s++)
        for (int l = 0; l < NUM_LANES; l++) {
            const struct anchor_outcome *o = outcome_of(&r->scene[s], l, kind);
            const struct anchor_bias *b = &o->bias[kind];
            if (anchors_useless(r, o) || !isfinite(b->b))
                continue;
            a.lo = fmin(a.lo, log10(b->lo));
            a.hi = fmax(a.hi, log10(isfinite(b->hi) ? b->hi : b->b));
        }
    if (!(a.lo <= a.hi))
        return (struct axis){-3, 0};
    return (struct axis){floor(a.lo), fmax(floor(a.lo) + 1, ceil(a.hi))};
}

static double at(const struct axis *a, double b)
{
    return LEFT + (RIGHT - LEFT) * (fmin(a->hi, log10(b)) - a->lo) / (a->hi - a->lo);
}

static void mark(FILE *f, int lane, double x, double y)
{
    const char *class = lanes[lane].class;
    switch (lane) {
    case 0:
        fprintf(f, "<circle class=\"%s\" cx=\"%.1f\" cy=\"%.1f\" r=\"4.5\"/>", class, x, y);
        break;
    case 1:
        fprintf(f, "<rect class=\"%s\" x=\"%.1f\" y=\"%.1f\" width=\"8\" height=\"8\"/>", class,
                x - 4, y - 4);
        break;
    case 2:
        fprintf(f, "<path class=\"%s\" d=\"M%.1f %.1fl5 5-5 5-5-5z\"/>", class, x, y - 5);
        break;
    default: fprintf(f, "<path class=\"%s\" d=\"M%.1f %.1fl5 8.5h-10z\"/>", class, x, y - 5); break;
    }
}

static void draw_scene(FILE *f, const struct anchor_results *r, int scene, enum anchor_error kind,
                       const struct axis *a, double top)
{
    const struct anchor_scene_result *s = &r->scene[scene];
    fprintf(f, "<text x=\"%d\" y=\"%.1f\" text-anchor=\"end\">%s</text>\n", LEFT - 12,
            top + NUM_LANES * LANE / 2.0 + 4, s->scene);
    for (int l = 0; l < NUM_LANES; l++) {
        const struct anchor_outcome *o = outcome_of(s, l, kind);
        const struct anchor_bias *b = &o->bias[kind];
        double y = top + (l + 0.5) * LANE;
        char value[32];
        if (anchors_useless(r, o)) {
            fprintf(
                f,
                "<text class=\"soft\" x=\"%d\" y=\"%.1f\">calls equal pictures different</text>\n",
                LEFT + 6, y + 4);
            continue;
        }
        snprintf(value, sizeof value, "%.2g %%", 100 * b->b);
        fprintf(f, "<g><title>%s, %s: %s</title>", s->scene, lanes[l].label,
                isfinite(b->b) ? value : "not found");
        if (!isfinite(b->b)) {
            fprintf(f, "<path class=\"%s\" d=\"M%d %.1fl8 4-8 4z\"/></g>\n", lanes[l].class, RIGHT,
                    y - 4);
            continue;
        }
        fprintf(f, "<path class=\"%s line\" d=\"M%.1f %.1fH%.1f\"/>", lanes[l].class, at(a, b->lo),
                y, at(a, b->hi));
        mark(f, l, at(a, b->b), y);
        fputs("</g>\n", f);
    }
}

static void draw(FILE *f, const struct anchor_results *r, enum anchor_error kind, const char *title)
{
    struct axis a = axis_of(r, kind);
    double block = NUM_LANES * LANE + GAP, bottom = TOP + r->num_scenes * block;
    fprintf(f,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %.0f\" width=\"%d\" "
            "height=\"%.0f\" role=\"img\" aria-label=\"%s\">\n<style>\n"
            "text { font: 13px system-ui, sans-serif; fill: #1c1f23; }\n"
            ".title { font-weight: 600; font-size: 15px; }\n.soft { fill: #5b626b; }\n"
            ".grid { stroke: #dcdfe2; fill: none; }\n.line { fill: none; stroke-width: 2; }\n"
            ".ours { fill: #0b57a4; stroke: #0b57a4; }\n"
            ".mitsuba { fill: #c4570a; stroke: #c4570a; }\n"
            ".welch { fill: #7a3fa0; stroke: #7a3fa0; }\n"
            ".idiff { fill: #5f6b76; stroke: #5f6b76; }\n"
            "@media (prefers-color-scheme: dark) {\n"
            "text { fill: #e7e8e6; } .soft { fill: #a2aab3; } .grid { stroke: #343a41; }\n"
            ".ours { fill: #6fb0ff; stroke: #6fb0ff; }\n"
            ".mitsuba { fill: #ffab66; stroke: #ffab66; }\n"
            ".welch { fill: #cf9df0; stroke: #cf9df0; }\n"
            ".idiff { fill: #a2aab3; stroke: #a2aab3; }\n}\n</style>\n",
            WIDTH, bottom + 46, WIDTH, bottom + 46, title);
    fprintf(f, "<text class=\"title\" x=\"12\" y=\"22\">%s</text>\n", title);
    for (int l = 0; l < NUM_LANES; l++) {
        double x = 20 + l % 2 * 300.0, y = 44 + l / 2 * 20.0;
        mark(f, l, x, y);
        fprintf(f, "<text x=\"%.1f\" y=\"%.1f\">%s</text>\n", x + 12, y + 4, lanes[l].label);
    }
    for (double d = a.lo; d <= a.hi; d++) {
        char value[32];
        double x = LEFT + (RIGHT - LEFT) * (d - a.lo) / (a.hi - a.lo);
        snprintf(value, sizeof value, "%g %%", 100 * pow(10, d));
        fprintf(
            f,
            "<path class=\"grid\" d=\"M%.1f %dV%.1f\"/><text class=\"soft\" x=\"%.1f\" y=\"%.1f\" "
            "text-anchor=\"middle\">%s</text>\n",
            x, TOP - 6, bottom, x, bottom + 16, value);
    }
    fprintf(f,
            "<text class=\"soft\" x=\"%d\" y=\"%.1f\" text-anchor=\"middle\">smallest error found "
            "in 95 %% of the pairs (left is better)</text>\n",
            (LEFT + RIGHT) / 2, bottom + 37);
    for (int s = 0; s < r->num_scenes; s++)
        draw_scene(f, r, s, kind, &a, TOP + s * block);
    fputs("</svg>\n", f);
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
