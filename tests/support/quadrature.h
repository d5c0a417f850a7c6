/* What the tests of closed forms share: adaptive quadrature by GSL, one tolerance, images. */
#ifndef ASSAY_TESTS_QUADRATURE_H
#define ASSAY_TESTS_QUADRATURE_H

#include "renderer/image/moments.h"

#include <stdbool.h>

/* Equal to 1e-9 of b: what closed forms have to reach, and what their negative controls must miss. */
bool same(double a, double b);

/* Integral of f over x[0]..x[1] by z[0]..z[1], nested and adaptive (GSL's CQUAD, which stands
 * kinks), to about 1e-11.
 * Fails the test where it does not converge. */
double integrate_plane(double (*f)(double x, double z, const void *ctx), const void *ctx,
                       const double x[2], const double z[2]);

/* The closed form of a scene of the suite at another size. The caller frees. */
void render_truth(const char *name, int width, int height, struct moments *out);

/* Value of that channel of that pixel. */
double mean_at(const struct moments *m, int col, int row, int channel);

/* Renders the closed form `kind` at 4 x 4 pixels from `values` (JSON text) as scene 19_bad, lens of
 * radius .25 focused at 2. Passes if it is refused with a line that names the scene and holds
 * `message`, or if message is NULL and it is accepted. */
void expect_refusal(const char *kind, const char *values, int depth, const char *message);

#endif
