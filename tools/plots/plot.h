/* Static plots as SVG: axes with numbers and units, and on them bars, bands, lines and marks that say their value when
 * pointed at. Coloured by the pages' style sheet (tools/html/page_plot.css), in which all classes are. */
#ifndef ASSAY_PLOT_H
#define ASSAY_PLOT_H

#include <stdbool.h>
#include <stdio.h>

struct plot_axis {
    const char *label; /* with its unit; NULL: neither label nor numbers */
    double lo, hi;     /* values beyond are drawn at the end; above 0 if logarithmic */
    bool is_log, has_grid;
    double
        step; /* between numbers of a linear axis; 0: 1, 2 or 5 times a power of ten, at most six numbers */
    const char *unit; /* behind each number, or NULL */
};

/* To be filled in before plot_open(): the stream, the plot area (width x height) and the borders around it, in units of
 * the SVG. Numbers and label of the x axis are in the bottom border, which then is at least 40. */
struct plot {
    FILE *f;
    const char *style; /* CSS class of the <svg> */
    double left, top, width, height, right, bottom;
    struct plot_axis x, y;
    const char *
        title; /* not NULL: a file of its own, with this title and the style sheet within; top is at least 30 */

    int num_series; /* from here on private to plot.c */
    double pen_x, pen_y;
    bool is_down, in_series;
};

/* A plot for a page: a plot area of that size, with room for labels. The axes are the caller's to fill in. */
struct plot plot_sized(FILE *f, double width, double height);

/* The step between numbers of a linear axis: 1, 2 or 5 times a power of ten, at most five steps. */
double plot_step(double range);

/* Writes <svg>, grid and numbers. The printf-style text describes the plot for screen readers. Here and below the text
 * of %s is escaped, as by html_print(). */
void plot_open(struct plot *p, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Writes the axes, on top of all else, and </svg>. */
void plot_close(struct plot *p);

/* A value's coordinate in the drawing, clamped to the plot area. */
double plot_x(const struct plot *p, double x);
double plot_y(const struct plot *p, double y);

/* Begins a series: number selects its colour (mod 8) and its mark (mod 4); name: its line in the legend, or NULL. It
 * lasts until the next series or plot_series_end(). */
void plot_series(struct plot *p, size_t number, const char *name);
void plot_series_end(struct plot *p);

/* A mark of the series; hover: the tooltip, printf-style. */
void plot_point(struct plot *p, size_t number, double x, double y, const char *hover, ...)
    __attribute__((format(printf, 5, 6)));
/* A rectangle between two corners; hover may be NULL. */
void plot_bar(struct plot *p, const char *style, double x0, double y0, double x1, double y1,
              const char *hover, ...) __attribute__((format(printf, 7, 8)));
void plot_segment(struct plot *p, const char *style, double x0, double y0, double x1, double y1);
/* A line from the series' previous point; the first call of a series only sets the start. */
void plot_line_to(struct plot *p, double x, double y);
/* An arrow head at the left or right end of the x axis. */
void plot_arrow(struct plot *p, bool right, double y, const char *hover, ...)
    __attribute__((format(printf, 4, 5)));
/* Lines through many points, the last one joined to the first if `closed`. */
void plot_path_open(struct plot *p, const char *style);
void plot_path_to(struct plot *p, double x, double y);
void plot_path_close(struct plot *p, bool closed);
/* Text at (x, y), moved by dx, dy in units of the SVG; anchor: start, middle or end. */
void plot_text(struct plot *p, double x, double y, double dx, double dy, const char *anchor,
               const char *format, ...) __attribute__((format(printf, 7, 8)));

#endif
