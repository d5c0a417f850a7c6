/* The drawings of studies: lines with error bars, as an SVG file of its own that is readable on light and on dark
 * ground. */
#ifndef ASSAY_DRAWING_H
#define ASSAY_DRAWING_H

#include "renderer/base/err.h"
#include "tools/plots/plot.h"

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
void drawing_add(struct drawing_series *s, double x, double y, double lo, double hi);
NODISCARD bool drawing_write(const char *path, const struct drawing *d, struct err *e);

#endif
