/* Images of built scenes against closed forms. H0 of every z-test: the mean of the image's
 * samples is the expected value. Two-sided at alpha = 1e-6 (|z| < 4.89), one seed, fixed n, no
 * retry. */
#ifndef ASSAY_RENDER_CHECK_H
#define ASSAY_RENDER_CHECK_H

#include "renderer/transport/render.h"
#include "build_scene.h"

/* scene_finish(), or the test fails with its line. */
void check_finish(struct scene *s);

/* width x height pixels of spp paths, one thread. The caller frees the moments. */
struct moments check_render(const struct scene *s, struct integrator_options io, int width,
                            int height, int spp);
struct moments check_render_with(const struct scene *s, struct integrator_options io, int width,
                                 int height, int spp, int threads, enum bvh_kind kind);

/* The mean over all pixels, each an equal estimate of the same number, and its standard error. */
struct check_result {
    double mean[3], std_error[3];
};
struct check_result check_pool(const struct moments *m);
bool check_result_agrees(const struct check_result *r, int channel, double expected);
/* The same, or the test fails and says `what`. */
void check_result_mean(const struct check_result *r, int channel, double expected,
                       const char *what);

/* Is the mean over all pixels, each an equal estimate of the same number, the expected one? Float
 * rounding along a path is allowed 2e-5 relative where there is no noise at all. */
bool check_agrees(const struct moments *m, int channel, double expected);
/* The same, or the test fails and says `what`. */
void check_mean(const struct moments *m, int channel, double expected, const char *what);
/* Standard error of that mean. */
double check_std_error(const struct moments *m, int channel);
/* Difference of the means of two independent images, in units of its standard error. */
double check_z(const struct moments *a, const struct moments *b, int channel);

#endif
