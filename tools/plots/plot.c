#include "plot.h"

#include "tools/html/html.h"
#include "tools/html/page_assets.h"

#include <math.h>

struct plot plot_sized(FILE *f, double width, double height)
{
    return (struct plot){.f = f,
                         .style = "plot",
                         .left = 58,
                         .top = 10,
                         .width = width,
                         .height = height,
                         .right = 14,
                         .bottom = 40};
}

double plot_step(double range)
{
    double power = pow(10, floor(log10(range / 5))), lead = range / 5 / power;
    return power * (lead <= 1 ? 1 : lead <= 2 ? 2 : lead <= 5 ? 5 : 10);
}

/* Where a value lies between the ends, 0 to 1. */
static double share(const struct plot_axis *a, double v)
{
    double s = a->is_log ? (v > 0 ? log(v / a->lo) / log(a->hi / a->lo) : 0)
                         : (v - a->lo) / (a->hi - a->lo);
    return fmin(1, fmax(0, s));
}

double plot_x(const struct plot *p, double x)
{
    return p->left + p->width * share(&p->x, x);
}

double plot_y(const struct plot *p, double y)
{
    return p->top + p->height * (1 - share(&p->y, y));
}

static void write_tick(const struct plot *p, bool is_x, double v)
{
    const struct plot_axis *a = is_x ? &p->x : &p->y;
    double x = is_x ? plot_x(p, v) : p->left, y = is_x ? p->top : plot_y(p, v);
    if (a->has_grid)
        fprintf(p->f, "<path class=\"grid\" d=\"M%.1f %.1f%c%g\"/>", x, y, is_x ? 'v' : 'h',
                is_x ? p->height : p->width);
    fprintf(p->f, "<text x=\"%.1f\" y=\"%.1f\">%g", is_x ? x : x - 6,
            is_x ? p->top + p->height + 16 : y + 4, v);
    html_print(p->f, "%s</text>", a->unit);
}

/* The numbers of an axis; of a logarithmic one 1, 2 and 5 times powers of ten, or, over 2.2 decades, these alone. */
static void write_ticks(const struct plot *p, bool is_x)
{
    static const double digit[] = {1, 2, 5};
    const struct plot_axis *a = is_x ? &p->x : &p->y;
    if (!isfinite(a->hi - a->lo))
        return;
    double step = a->step > 0 ? a->step : plot_step(a->hi - a->lo);
    size_t digits = a->is_log && log10(a->hi / a->lo) < 2.2 ? 3 : 1;
    int first = a->is_log ? (int)floor(log10(a->lo)) : (int)ceil(a->lo / step - 1e-9);
    int last = a->is_log ? (int)ceil(log10(a->hi)) : (int)floor(a->hi / step + 1e-9);
    fprintf(p->f, "<g text-anchor=\"%s\">", is_x ? "middle" : "end");
    for (int i = first; i <= last; i++)
        for (size_t k = 0; k < digits; k++) {
            double v = a->is_log ? digit[k] * pow(10, i) : i * step;
            if (!a->is_log || (v >= a->lo * (1 - 1e-9) && v <= a->hi * (1 + 1e-9)))
                write_tick(p, is_x, v);
        }
    fputs("</g>", p->f);
}

static void write_label(const struct plot *p, bool is_x)
{
    if (is_x)
        fprintf(p->f, "<text text-anchor=\"middle\" x=\"%g\" y=\"%g\">", p->left + p->width / 2,
                p->top + p->height + 34);
    else
        fprintf(p->f, "<text text-anchor=\"middle\" transform=\"translate(11 %g) rotate(-90)\">",
                p->top + p->height / 2);
    html_print(p->f, "%s</text>", is_x ? p->x.label : p->y.label);
}

void plot_open(struct plot *p, const char *format, ...)
{
    double width = p->left + p->width + p->right, height = p->top + p->height + p->bottom;
    va_list values;
    fprintf(p->f,
            "<svg class=\"%s\"%s viewBox=\"0 0 %g %g\" width=\"%g\" height=\"%g\" role=\"img\" "
            "aria-label=\"",
            p->style, p->title != NULL ? " xmlns=\"http://www.w3.org/2000/svg\"" : "", width,
            height, width, height);
    va_start(values, format);
    html_vprint(p->f, format, values);
    va_end(values);
    fputs("\">", p->f);
    if (p->title != NULL) {
        fprintf(p->f, "\n<style>\n%s</style>\n<rect class=\"ground\" width=\"%g\" height=\"%g\"/>",
                plot_css, width, height);
        html_print(p->f, "<text class=\"title\" x=\"%g\" y=\"20\">%s</text>\n", p->left, p->title);
    }
    for (int is_x = 0; is_x < 2; is_x++)
        if ((is_x ? p->x : p->y).label != NULL) {
            write_ticks(p, is_x);
            write_label(p, is_x);
        }
}

void plot_close(struct plot *p)
{
    plot_series_end(p);
    if (p->x.label != NULL)
        fprintf(p->f, "<path class=\"axis\" d=\"M%g %gv%gh%g\"/>", p->left, p->top, p->height,
                p->width);
    fputs(p->title != NULL ? "</svg>\n" : "</svg>", p->f);
}

/* Opens a mark and returns its tag: circle, square, triangle, diamond, so that series can be told apart without
 * colours. */
static const char *open_mark(FILE *f, size_t number, double x, double y, double r)
{
    double t = 1.2 * r, d = 1.4 * r;
    switch (number % 4) {
    case 0:
        fprintf(f, "<circle class=\"dot\" cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\">", x, y, r);
        return "circle";
    case 1:
        fprintf(f, "<path class=\"dot\" d=\"M%.1f %.1fh%.1fv%.1fh-%.1fz\">", x - r, y - r, 2 * r,
                2 * r, 2 * r);
        return "path";
    case 2:
        fprintf(f, "<path class=\"dot\" d=\"M%.1f %.1fl%.1f %.1fh-%.1fz\">", x, y - t, t, 2 * t,
                2 * t);
        return "path";
    default:
        fprintf(f, "<path class=\"dot\" d=\"M%.1f %.1fl%.1f %.1fl-%.1f %.1fl-%.1f -%.1fz\">", x,
                y - d, d, d, d, d, d, d);
        return "path";
    }
}

/* The legend stands right of the axes where there is room, else in their upper right corner. */
void plot_series(struct plot *p, size_t number, const char *name)
{
    plot_series_end(p);
    p->in_series = true;
    fprintf(p->f, "<g class=\"e%zu\">", number % 8);
    if (name == NULL)
        return;
    double x = p->left + p->width + (p->right > 100 ? 16 : -128),
           y = p->top + 12 + 17 * p->num_series++;
    fprintf(p->f, "</%s>", open_mark(p->f, number, x, y, 4));
    html_print(p->f, "<text x=\"%.1f\" y=\"%.1f\">%s</text>", x + 10, y + 4, name);
}

void plot_series_end(struct plot *p)
{
    if (p->in_series)
        fputs("</g>\n", p->f);
    p->in_series = p->is_down = false;
}

static void write_hover(FILE *f, const char *hover, va_list values)
{
    if (hover == NULL)
        return;
    fputs("<title>", f);
    html_vprint(f, hover, values);
    fputs("</title>", f);
}

void plot_point(struct plot *p, size_t number, double x, double y, const char *hover, ...)
{
    const char *tag = open_mark(p->f, number, plot_x(p, x), plot_y(p, y), 3.2);
    va_list values;
    va_start(values, hover);
    write_hover(p->f, hover, values);
    va_end(values);
    fprintf(p->f, "</%s>", tag);
}

void plot_bar(struct plot *p, const char *style, double x0, double y0, double x1, double y1,
              const char *hover, ...)
{
    double left = plot_x(p, x0), right = plot_x(p, x1), low = plot_y(p, y0), high = plot_y(p, y1);
    va_list values;
    fprintf(p->f, "<rect class=\"%s\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\">", style,
            fmin(left, right), fmin(low, high), fabs(right - left), fabs(high - low));
    va_start(values, hover);
    write_hover(p->f, hover, values);
    va_end(values);
    fputs("</rect>", p->f);
}

void plot_arrow(struct plot *p, bool right, double y, const char *hover, ...)
{
    va_list values;
    fprintf(p->f, "<path class=\"arrow\" d=\"M%.1f %.1fl%d -5v10z\">",
            p->left + (right ? p->width : 0), plot_y(p, y), right ? -8 : 8);
    va_start(values, hover);
    write_hover(p->f, hover, values);
    va_end(values);
    fputs("</path>", p->f);
}

void plot_segment(struct plot *p, const char *style, double x0, double y0, double x1, double y1)
{
    fprintf(p->f, "<path class=\"%s\" d=\"M%.1f %.1fL%.1f %.1f\"/>", style, plot_x(p, x0),
            plot_y(p, y0), plot_x(p, x1), plot_y(p, y1));
}

void plot_line_to(struct plot *p, double x, double y)
{
    if (p->is_down)
        plot_segment(p, "line", p->pen_x, p->pen_y, x, y);
    p->is_down = true;
    p->pen_x = x;
    p->pen_y = y;
}

void plot_path_open(struct plot *p, const char *style)
{
    fprintf(p->f, "<path class=\"%s\" d=\"", style);
    p->is_down = false;
}

void plot_path_to(struct plot *p, double x, double y)
{
    fprintf(p->f, "%c%.1f %.1f", p->is_down ? 'L' : 'M', plot_x(p, x), plot_y(p, y));
    p->is_down = true;
}

void plot_path_close(struct plot *p, bool closed)
{
    fputs(closed ? "Z\"/>" : "\"/>", p->f);
    p->is_down = false;
}

void plot_text(struct plot *p, double x, double y, double dx, double dy, const char *anchor,
               const char *format, ...)
{
    va_list values;
    va_start(values, format);
    fprintf(p->f, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", plot_x(p, x) + dx,
            plot_y(p, y) + dy, anchor);
    html_vprint(p->f, format, values);
    fputs("</text>", p->f);
    va_end(values);
}
