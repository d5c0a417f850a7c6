/* The variance of one sample of our renderer, where it has a closed form: it exposes wasted samples and
 * unbiased estimators other than the documented one, which leave the mean right and the stated error, too.
 *
 * kind of truth          estimator
 * rectangle_over_plane   a point in the pixel by the box filter, one light sample uniform over the
 *                        rectangle's area, one cosine-weighted BSDF sample; combined by the power
 *                        heuristic (beta = 2) [Veach97 9.2.3] */
#ifndef ASSAY_TRUTH_NOISE_H
#define ASSAY_TRUTH_NOISE_H

#include "reference/suite/suite.h"

struct truth_lamp {
    double height, ex[2], ez[2]; /* as of truth_rectangle_irradiance */
};

/* First and second moment of one sample at the point (x, 0, z) of a plane of albedo 1 under that
 * rectangle of radiance 1: in units of radiance and its square. `order` Gauss-Legendre points (2..48)
 * along each side of the rectangle. NAN if out of memory. */
void truth_sample_moments(const struct truth_lamp *lamp, double x, double z, int order,
                          double moment[2]);

/* Variance of one sample of each pixel and channel, 3 width height numbers that the caller frees.
 * Fails on another kind, on a depth that is not 1, and where rules of two orders disagree by more
 * than 1e-3 of the sum over the image. */
NODISCARD bool truth_noise(const struct suite_scene *scene, const struct suite_reference *ref,
                           double **variance, struct err *e);

#endif
