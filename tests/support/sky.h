/* Sky maps made in C, and their radiance by another method than the renderer's: a sum of tent
 * functions on the grid of texels. */
#ifndef ASSAY_TEST_SKY_H
#define ASSAY_TEST_SKY_H

#include "renderer/scene/environment.h"

/* Values of one channel; all three channels get them times 1, 2 and 3. */
struct sky {
    int width, height;
    float value[64 * 32];
};

/* Pseudorandom values between 0.25 and 2.25, a black corner, and one texel of 60. */
struct sky sky_uneven(int width, int height);

/* The image; the caller frees it with image_free(). Fails the test on any trouble. */
struct image sky_image(const struct sky *s);
/* Its environment. The caller frees it, or the scene it is given to. */
struct environment *sky_environment(const struct sky *s);

/* First channel's radiance at map coordinates (x, y) in texels: sum over texels (i, j) of
 * value[i, j] tent(x - i - 1/2) tent(y - j - 1/2), periodic in x; beyond the middles of the first
 * and the last row y is that of the middle. */
double sky_on_map(const struct sky *s, double x, double y);

/* The same from the direction w, of any length. */
double sky_seen(const struct sky *s, const double w[3]);

/* Irradiance of the first channel on a plane with the unit normal n, which must be an axis:
 * Gauss-Legendre quadrature over quarters of texels, at whose edges cosine and radiance have their
 * kinks. width must be a multiple of 4, height of 2. */
double sky_irradiance(const struct sky *s, const double n[3]);

/* Map coordinates -> direction, as the assignment has it: theta = pi y/h from +Y down, phi = 2 pi
 * x/w, with phi = atan2(-z, x) + pi. */
void sky_direction(const struct sky *s, double x, double y, double w[3]);

#endif
