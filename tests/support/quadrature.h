/* What the tests of closed forms share: adaptive quadrature by GSL, one tolerance, images. */
#ifndef ASSAY_TESTS_QUADRATURE_H
#define ASSAY_TESTS_QUADRATURE_H

#include "renderer/image/moments.h"

#include <stdbool.h>

/* Equal to 1e-9 of b: what closed forms have to reach, and what their negative controls must miss. */
bool same(double a, double b);

/* A fixed sequence of numbers in [0,1). */
double next_number(uint64_t *state);

/* Integral of f over x[0]..x[1] by z[0]..z[1], nested and adaptive (GSL's CQUAD, which stands
 * kinks), to about 1e-11.
 * Fails the test where it does not converge. */
double integrate_plane(double (*f)(double x, double z, const void *ctx), const void *ctx,
                       const double x[2], const double z[2]);

/* The closed form of a scene of the suite at another size. The caller frees. */
void render_truth(const char *name, int width, int height, struct moments *out);

/* Value of that channel of that pixel. */
double mean_at(const struct moments *m, int col, int row, int channel);

/* A plane as such a scene shows it, 2 `half` wide from the point (left, top) on; the image's top is -Z. */
struct plane_scene {
    const char *name;
    double (*irradiance)(double x, double z, const void *); /* by another route */
    double source[3], albedo[3], left, top, half;
    int bright_col, bright_row; /* the pixel of 64 x 64 below the source's centre */
    bool symmetric;
};

/* The mean over each of those pixels of 64 x 64 is the image's value, and that of its centre is not. */
void expect_box_filter(const struct plane_scene *p, const int (*pixels)[2], size_t num);

/* An image of twice the resolution, averaged 2 x 2, is the same image: the quadrature over a pixel has converged, and
 * pixels tile the footprint. */
void expect_any_resolution(const char *name);

/* Renders the closed form `kind` at 4 x 4 pixels from `values` (JSON by test_json()) as scene 19_bad, lens of
 * radius .25 focused at 2. Passes if it is refused with a line that names the scene and holds
 * `message`, or if message is NULL and it is accepted. */
void expect_refusal(const char *kind, const char *values, int depth, const char *message);

#endif
