/* How noisy one sample of our renderer is, where that has a closed form: so that samples which are
 * wasted, and estimators that are right but not the ones they are said to be, can be told from good
 * ones. All leave the mean right, and the error that they state too.
 *
 * kind of truth          estimator
 * rectangle_over_plane   a place in the pixel by the box filter, one light sample uniform in the
 *                        rectangle's area, one BSDF sample by the cosine; weighted by the power
 *                        heuristic (beta = 2) [Veach97 9.2.3] */
#ifndef ASSAY_TRUTH_NOISE_H
#define ASSAY_TRUTH_NOISE_H

#include "reference/suite/suite.h"

struct truth_lamp {
    double height, ex[2], ez[2]; /* as of truth_rectangle_irradiance */
};

/* First and second moment of one sample at the point (x, 0, z) of a plane of albedo 1 under that
 * rectangle of radiance 1: in units of radiance and its square. `order` points of Gauss and Legendre
 * (even, 2..64) along each side of the rectangle. */
void truth_sample_moments(const struct truth_lamp *lamp, double x, double z, int order,
                          double moment[2]);

/* Variance of one sample of each pixel and channel, 3 width height numbers that the caller frees.
 * Fails on another kind, on a depth that is not 1, and where rules of two orders disagree by more
 * than 1e-3 of the sum over the image. */
NODISCARD bool truth_noise(const struct suite_scene *scene, const struct suite_reference *ref,
                           double **variance, struct err *e);

#endif
