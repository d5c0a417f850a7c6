#include "calibrate_plot.h"

#include "renderer/base/fs.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>

enum { LEFT = 84, TOP = 40, WIDTH = 430, HEIGHT = 330, RIGHT = 210, BELOW = 52 };

static const char style[] =
    "<style>\n"
    "svg { font: 13px system-ui, sans-serif; }\n"
    ".g { fill: #ffffff; } text { fill: #1c1f23; } .axis { stroke: #5b626b; fill: none; }\n"
    ".grid { stroke: #dcdfe2; } .mark { stroke: #5b626b; stroke-dasharray: 5 4; fill: none; }\n"
    ".s { fill: none; stroke-width: 1.8; } .d { stroke: none; }\n"
    ".c0 { --c: #0b5fa5; } .c1 { --c: #b8420f; } .c2 { --c: #00734d; } .c3 { --c: #9c3a78; }\n"
    ".c4 { --c: #8a6100; } .c5 { --c: #4a4f55; } .c6 { --c: #6a3fb5; } .c7 { --c: #00727d; }\n"
    "@media (prefers-color-scheme: dark) {\n"
    ".g { fill: #14171a; } text { fill: #e7e8e6; } .axis, .mark { stroke: #a2aab3; }\n"
    ".grid { stroke: #343a41; }\n"
    ".c0 { --c: #6fb4f0; } .c1 { --c: #ff9a6b; } .c2 { --c: #63d2a6; } .c3 { --c: #eb9bd0; }\n"
    ".c4 { --c: #e9b949; } .c5 { --c: #c3c8ce; } .c6 { --c: #b79bf2; } .c7 { --c: #5fd0dc; }\n"
    "}\n"
    ".s { stroke: var(--c); } .d { fill: var(--c); }\n"
    "</style>\n";
static const char *const dash[PLOT_SERIES] = {"",    "7 3", "2 3",  "9 3 2 3",
                                              "4 4", "1 2", "12 4", "3 1"};

void plot_add(struct plot_series *s, double x, double y, double lo, double hi)
{
    assert(s->num < PLOT_POINTS);
    s->x[s->num] = x;
    s->y[s->num] = y;
    s->lo[s->num] = lo;
    s->hi[s->num++] = hi;
}

/* Where a value lies between the ends of an axis, 0 to 1. */
static double place(double v, double v0, double v1, bool is_log)
{
    double f = is_log ? (v > 0 ? log(v / v0) / log(v1 / v0) : 0) : (v - v0) / (v1 - v0);
    return fmin(1, fmax(0, f));
}

static double at_x(const struct plot *p, double x)
{
    return LEFT + WIDTH * place(x, p->x0, p->x1, p->is_log_x);
}

static double at_y(const struct plot *p, double y)
{
    return TOP + HEIGHT * (1 - place(y, p->y0, p->y1, p->is_log_y));
}

/* The next tick above v: a power of ten, or a step of 1, 2 or 5 that gives about five. */
static double tick_step(double range)
{
    double decade = pow(10, floor(log10(range / 5)));
    double lead = range / 5 / decade;
    return decade * (lead <= 1 ? 1 : lead <= 2 ? 2 : lead <= 5 ? 5 : 10);
}

static void ticks(FILE *f, const struct plot *p, bool is_x)
{
    bool is_log = is_x ? p->is_log_x : p->is_log_y;
    double v0 = is_x ? p->x0 : p->y0, v1 = is_x ? p->x1 : p->y1, step = tick_step(v1 - v0);
    int num = is_log ? (int)round(log10(v1 / v0)) : (int)floor((v1 - v0) / step + 1e-9);
    for (int i = 0; i <= num; i++) {
        double v = is_log ? v0 * pow(10, i) : v0 + i * step;
        if (is_x)
            fprintf(f,
                    "<path class=\"grid\" d=\"M%.1f %dV%d\"/><text x=\"%.1f\" y=\"%d\" "
                    "text-anchor=\"middle\">%g</text>\n",
                    at_x(p, v), TOP, TOP + HEIGHT, at_x(p, v), TOP + HEIGHT + 18, v);
        else
            fprintf(f,
                    "<path class=\"grid\" d=\"M%d %.1fH%d\"/><text x=\"%d\" y=\"%.1f\" "
                    "text-anchor=\"end\">%g</text>\n",
                    LEFT, at_y(p, v), LEFT + WIDTH, LEFT - 6, at_y(p, v) + 4, v);
    }
}

static void draw_series(FILE *f, const struct plot *p, int index)
{
    const struct plot_series *s = &p->series[index];
    fprintf(f, "<g class=\"c%d\"><path class=\"s\" stroke-dasharray=\"%s\" d=\"", index,
            dash[index]);
    for (int i = 0; i < s->num; i++)
        fprintf(f, "%c%.1f %.1f", i == 0 ? 'M' : 'L', at_x(p, s->x[i]), at_y(p, s->y[i]));
    fputs("\"/>\n", f);
    for (int i = 0; i < s->num; i++) {
        if (s->hi[i] > s->lo[i])
            fprintf(f, "<path class=\"s\" d=\"M%.1f %.1fV%.1f\"/>", at_x(p, s->x[i]),
                    at_y(p, s->lo[i]), at_y(p, s->hi[i]));
        fprintf(f, "<circle class=\"d\" cx=\"%.1f\" cy=\"%.1f\" r=\"2.5\"/>\n", at_x(p, s->x[i]),
                at_y(p, s->y[i]));
    }
    int y = TOP + 14 + 20 * index;
    fprintf(f,
            "<path class=\"s\" stroke-dasharray=\"%s\" d=\"M%d %dh26\"/><text x=\"%d\" "
            "y=\"%d\">%s</text></g>\n",
            dash[index], LEFT + WIDTH + 12, y, LEFT + WIDTH + 44, y + 4, s->name);
}

static void draw_marks(FILE *f, const struct plot *p)
{
    if (p->is_diagonal) {
        double lo = fmax(p->x0, p->y0), hi = fmin(p->x1, p->y1);
        fprintf(f, "<path class=\"mark\" d=\"M%.1f %.1fL%.1f %.1f\"/>\n", at_x(p, lo), at_y(p, lo),
                at_x(p, hi), at_y(p, hi));
    }
    if (p->mark_x > 0)
        fprintf(f,
                "<path class=\"mark\" d=\"M%.1f %dV%d\"/><text x=\"%.1f\" y=\"%d\" "
                "text-anchor=\"end\">%s</text>\n",
                at_x(p, p->mark_x), TOP, TOP + HEIGHT, at_x(p, p->mark_x) - 5, TOP + HEIGHT - 8,
                p->mark_text);
    if (p->mark_y > 0)
        fprintf(f, "<path class=\"mark\" d=\"M%d %.1fH%d\"/>\n", LEFT, at_y(p, p->mark_y),
                LEFT + WIDTH);
}

bool plot_write(const char *path, const struct plot *p, struct err *e)
{
    struct out_file out;
    if (!out_open(&out, path, e))
        return false;
    FILE *f = out.f;
    int width = LEFT + WIDTH + RIGHT, height = TOP + HEIGHT + BELOW;
    fprintf(f,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" "
            "height=\"%d\" role=\"img\">\n<title>%s</title>\n%s"
            "<rect class=\"g\" width=\"%d\" height=\"%d\"/>\n<text x=\"%d\" y=\"22\" "
            "font-weight=\"600\">%s</text>\n",
            width, height, width, height, p->title, style, width, height, LEFT, p->title);
    ticks(f, p, true);
    ticks(f, p, false);
    fprintf(f, "<path class=\"axis\" d=\"M%d %dV%dH%d\"/>\n", LEFT, TOP, TOP + HEIGHT,
            LEFT + WIDTH);
    draw_marks(f, p);
    for (int i = 0; i < p->num; i++)
        draw_series(f, p, i);
    fprintf(
        f,
        "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">%s</text><text transform=\"translate(20 "
        "%d) rotate(-90)\" text-anchor=\"middle\">%s</text>\n</svg>\n",
        LEFT + WIDTH / 2, TOP + HEIGHT + 40, p->x_label, TOP + HEIGHT / 2, p->y_label);
    return out_commit(&out, e);
}
