/* The drawings of the calibration's page: lines with error bars on linear or logarithmic axes, as an
 * SVG file of its own that is readable on light and on dark ground. */
#ifndef ASSAY_CALIBRATE_PLOT_H
#define ASSAY_CALIBRATE_PLOT_H

#include "renderer/base/err.h"

enum { PLOT_POINTS = 48, PLOT_SERIES = 8 };

struct plot_series {
    char name[64];
    int num;
    double x[PLOT_POINTS], y[PLOT_POINTS];
    double lo[PLOT_POINTS], hi[PLOT_POINTS]; /* of the error bar; equal: none */
};

struct plot {
    const char *title, *x_label, *y_label;
    bool is_log_x, is_log_y;
    double x0, x1, y0, y1; /* what is drawn: above 0 on a logarithmic axis */
    bool is_diagonal;      /* the line y = x */
    double mark_x, mark_y; /* dashed lines; 0: none */
    const char *mark_text; /* beside the first */
    int num;
    struct plot_series series[PLOT_SERIES];
};

/* Appends a point; what the axes cannot show is cut at their ends. */
void plot_add(struct plot_series *s, double x, double y, double lo, double hi);
bool plot_write(const char *path, const struct plot *p, struct err *e)
    __attribute__((warn_unused_result));

#endif
