/* Images of built scenes against closed forms. H0 of every z-test: the mean of the image's
 * samples is the expected value. Two-sided at alpha = 1e-6 (|z| < 4.89), one seed, fixed n, no
 * retry. */
#ifndef ASSAY_RENDER_CHECK_H
#define ASSAY_RENDER_CHECK_H

#include "renderer/transport/render.h"
#include "build_scene.h"

/* A camera whose pinhole is so narrow that the image is one direction. */
void check_aim(struct scene *s, vec3 eye, vec3 backward, vec3 up);
/* A plate 6 x 6 around the origin with the unit normal n, seen at 45 degrees through such a camera: irradiance is
 * constant over the image. */
struct scene check_plate(vec3 n, float albedo);
/* Irradiance at the origin, normal +Y, of a polygon of unit radiance above the horizon: Lambert's formula
 * E = 1/2 sum_i angle(v_i, v_i+1) n . (v_i x v_i+1)/|..|, orientation by the sign. */
double check_irradiance(const double (*v)[3], int n);

/* scene_finish(), or the test fails with its line. */
void check_finish(struct scene *s);

/* Two-sided at alpha = 1e-6. */
#define CHECK_Z_LIMIT 4.89

/* Paths of up to that many bounces, one sample of light, roulette by throughput, independent samples. */
struct integrator_options check_options(int direct, int depth, uint64_t seed);

/* render() by a hierarchy of that kind; stats may be NULL. The caller frees the moments. */
struct moments check_render_all(const struct scene *s, const struct camera *c,
                                const struct render_options *o, enum bvh_kind kind,
                                struct render_stats *stats);
/* width x height pixels of spp paths, on one thread. */
struct moments check_render(const struct scene *s, struct integrator_options io, int width,
                            int height, int spp);

/* The mean over all pixels, each an equal estimate of the same number, and its standard error. */
struct check_result {
    double mean[3], std_error[3];
};
struct check_result check_pool(const struct moments *m);
/* Of an image of size x size pixels. */
struct check_result check_look(const struct scene *s, struct integrator_options io, int size,
                               int spp);
/* Is it the expected one? Float rounding along a path is allowed 2e-5 relative where there is no noise at all. */
bool check_agrees(const struct check_result *r, int channel, double expected);
/* It is, or the test fails and says `what`. */
void check_mean(const struct check_result *r, int channel, double expected, const char *what);
/* Difference of the means of two independent images, in units of its standard error. */
double check_z(const struct moments *a, const struct moments *b, int channel);

#endif
