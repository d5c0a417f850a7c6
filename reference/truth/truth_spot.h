/* A spot light over the plane y = 0: the closed form of its irradiance and its mean over rectangles,
 * also those that the edge of the cone crosses. */
#ifndef ASSAY_TRUTH_SPOT_H
#define ASSAY_TRUTH_SPOT_H

#include "renderer/base/err.h"

/* light[1] > 0; axis, where it shines, of unit length; 0 < cos_cutoff < 1; exponent >= 0. */
struct truth_spot {
    double light[3], axis[3], exponent, cos_cutoff;
};

/* Irradiance [W m^-2] at the point (x, 0, z), normal +Y, from an intensity [W/sr] of
 * cos(angle to the axis)^exponent, and of 0 where that cosine is not above cos_cutoff. */
double truth_spot_irradiance(const struct truth_spot *s, double x, double z);

/* True if the whole cone ends on the plane, so that its edge is an ellipse there. */
bool truth_spot_is_ellipse(const struct truth_spot *s);

/* Mean irradiance over x[0]..x[1] by z[0]..z[1] (either order), of a spot that is an ellipse. Fails
 * where the quadrature has not converged to 1e-10 of the value. */
NODISCARD bool truth_spot_mean(const struct truth_spot *s, const double x[2], const double z[2],
                               double *mean, struct err *e);

#endif
