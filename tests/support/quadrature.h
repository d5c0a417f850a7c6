/* What the tests of closed forms share: adaptive quadrature by GSL, one tolerance, images. */
#ifndef ASSAY_TESTS_QUADRATURE_H
#define ASSAY_TESTS_QUADRATURE_H

#include "renderer/image/moments.h"

#include <stdbool.h>

/* Equal to 1e-9 of b: what closed forms have to reach, and what their negative controls must miss. */
bool same(double a, double b);

/* A fixed sequence of numbers in [0,1). */
double next_number(uint64_t *state);

/* Integral of f over x[0]..x[1] by z[0]..z[1], nested and adaptive (GSL's CQUAD, which tolerates
 * kinks), to a relative error of about 1e-11. Fails the test if it does not converge. */
double integrate_plane(double (*f)(double x, double z, const void *ctx), const void *ctx,
                       const double x[2], const double z[2]);

/* The closed form of a scene of the suite at another size. The caller frees. */
void render_truth(const char *name, int width, int height, struct moments *out);

/* Value of that channel of that pixel. */
double mean_at(const struct moments *m, int col, int row, int channel);

/* A scene of a horizontal plane seen from above: the image is the square of side 2 half at (left,
 * top), its top towards -Z. */
struct plane_scene {
    const char *name;
    double (*irradiance)(double x, double z, const void *); /* at a point, by another method than the closed form's */
    double source[3], albedo[3], left, top, half;
    int bright_col, bright_row; /* the pixel of 64 x 64 below the source's centre */
    bool symmetric;
};

/* Each of these pixels (of 64 x 64) has the mean over its area as value, and not that of its
 * centre. */
void expect_box_filter(const struct plane_scene *p, const int (*pixels)[2], size_t num);

/* An image of twice the resolution, averaged over 2 x 2 pixels, is the same: the quadrature over a
 * pixel has converged, and pixels tile the image. */
void expect_any_resolution(const char *name);

/* Renders the closed form `kind` at 4 x 4 pixels from `values` (JSON by test_json()) as scene 19_bad, lens of
 * radius .25 focused at 2. Passes if it is refused with a line that names the scene and holds
 * `message`, or if message is NULL and it is accepted. */
void expect_refusal(const char *kind, const char *values, int depth, const char *message);

#endif
