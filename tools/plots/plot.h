/* Static plots as SVG: axes with numbers and units, and on them bars, bands, lines and marks that say their value when
 * pointed at. Coloured by the pages' style sheet (tools/html/page_plot.css), in which all classes are. */
#ifndef ASSAY_PLOT_H
#define ASSAY_PLOT_H

#include <stdbool.h>
#include <stdio.h>

struct plot_axis {
    const char *label; /* with its unit; NULL: neither label nor numbers */
    double lo, hi;     /* what is beyond is drawn at the end; above 0 if logarithmic */
    bool is_log, has_grid;
    double
        step; /* between numbers of a linear axis; 0: 1, 2 or 5 times a power of ten, at most six numbers */
    const char *unit; /* behind each number, or NULL */
};

/* To be filled in before plot_open(): the stream, the space between the axes and what is left around it, in pixels of
 * the drawing. The x axis has its numbers and label in the `bottom`, at least 40 if it has any. */
struct plot {
    FILE *f;
    const char *style; /* class of the drawing */
    double left, top, width, height, right, bottom;
    struct plot_axis x, y;
    const char *
        title; /* not NULL: a file of its own, with this title and the style sheet within; top is at least 30 */

    int num_series; /* from here on: plot.c's */
    double pen_x, pen_y;
    bool is_down, in_series;
};

/* Of a page: between axes of that size in pixels, with room for labels. */
struct plot plot_sized(FILE *f, double width, double height);

/* The step of a linear axis of that length: 1, 2 or 5 times a power of ten. */
double plot_step(double range);

/* <svg> with grid and numbers; the text, printf's, tells what is shown to those who do not see it. Here and below the
 * text of %s is escaped, as html_print() does. */
void plot_open(struct plot *p, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* The axes, above all else, and </svg>. */
void plot_close(struct plot *p);

/* Where a value stands in the drawing. */
double plot_x(const struct plot *p, double x);
double plot_y(const struct plot *p, double y);

/* A series has a colour and a kind of mark of its own, number 0 to 7, and a line in the legend unless name is NULL. It
 * lasts to the next one or to plot_series_end(). */
void plot_series(struct plot *p, size_t number, const char *name);
void plot_series_end(struct plot *p);

/* A mark of the series; `hover` is printf's. */
void plot_point(struct plot *p, size_t number, double x, double y, const char *hover, ...)
    __attribute__((format(printf, 5, 6)));
/* A rectangle between two corners; hover may be NULL. */
void plot_bar(struct plot *p, const char *style, double x0, double y0, double x1, double y1,
              const char *hover, ...) __attribute__((format(printf, 7, 8)));
void plot_segment(struct plot *p, const char *style, double x0, double y0, double x1, double y1);
/* From where the last one ended; the first of a series only begins. */
void plot_line_to(struct plot *p, double x, double y);
/* An arrow head that ends in the left or right end of the x axis. */
void plot_arrow(struct plot *p, bool right, double y, const char *hover, ...)
    __attribute__((format(printf, 4, 5)));
/* Lines through many points, the last one joined to the first if `closed`. */
void plot_path_open(struct plot *p, const char *style);
void plot_path_to(struct plot *p, double x, double y);
void plot_path_close(struct plot *p, bool closed);
/* Beside a place; anchor: start, middle or end. dx, dy: pixels. */
void plot_text(struct plot *p, double x, double y, double dx, double dy, const char *anchor,
               const char *format, ...) __attribute__((format(printf, 7, 8)));

#endif
