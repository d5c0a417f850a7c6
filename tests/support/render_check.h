/* Images of built scenes against closed forms. H0 of every z-test: the mean of the image's
 * samples is the expected value. Two-sided at alpha = 1e-6 (|z| < 4.89), one seed, fixed n, no
 * retry. */
#ifndef ASSAY_RENDER_CHECK_H
#define ASSAY_RENDER_CHECK_H

#include "renderer/transport/render.h"
#include "build_scene.h"

/* Sets a camera whose field of view (0.02 degrees) is so narrow that the image is one direction. */
void check_aim(struct scene *s, vec3 eye, vec3 backward, vec3 up);
/* A plate 6 x 6 around the origin with the unit normal n, seen at 45 degrees through such a camera: irradiance is
 * constant over the image. */
struct scene check_plate(vec3 n, float albedo);
/* Irradiance at the origin, normal n = +Y, from a polygon of unit radiance above the horizon, of
 * either orientation: Lambert's formula E = 1/2 |sum_i angle(v_i, v_i+1) n . c_i|, c_i the unit
 * vector along v_i x v_i+1. */
double check_irradiance(const double (*v)[3], int n);

/* scene_finish(), or the test fails with its line. */
void check_finish(struct scene *s);

/* Two-sided at alpha = 1e-6. */
#define CHECK_Z_LIMIT 4.89

/* Paths of at most `depth` bounces, one light sample, roulette by throughput, independent samples.
 * direct: enum direct_kind. */
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
/* check_pool() of an image of size x size pixels of spp paths. */
struct check_result check_look(const struct scene *s, struct integrator_options io, int size,
                               int spp);
/* Is the mean the expected one? 2e-5 of it is allowed for float rounding along a path, besides
 * noise. */
bool check_agrees(const struct check_result *r, int channel, double expected);
/* Fails the test, naming `what`, unless check_agrees(). */
void check_mean(const struct check_result *r, int channel, double expected, const char *what);
/* Difference of the means of two independent images, in units of its standard error. */
double check_z(const struct moments *a, const struct moments *b, int channel);

#endif
