/* Scenes built in C, rendered by the Cycles driver and compared with closed forms. Tests that use this skip where
 * there is no Blender. */
#ifndef ASSAY_CYCLES_PROBE_H
#define ASSAY_CYCLES_PROBE_H

#include "tests/support/build_scene.h"
#include "tests/support/sky.h"

#include "reference/replicates/engine_driver.h"

/* A job for an empty scene, with directories for its work and for stand-ins of Blender. */
struct probe {
    char dir[64], work[80], bin[80], path[4096];
    struct scene s;
    struct camera c;
    struct suite_scene suite;
    struct suite_reference ref;
    struct reference_options opt;
    struct reference_job job;
};

/* cmocka's setup and teardown; *state is the probe: 3 replicates of 4 x 4 pixels, depth 1. */
int probe_setup(void **state);
int probe_teardown(void **state);
#define PROBE(name) TEST_OF(probe, name, probe_setup, probe_teardown)

/* For a test of Blender itself: sets the size of the image, or skips the test, and says so, where there is no Blender. */
void probe_size(struct probe *f, int width, int height);

/* The sky as environment and light of the scene. */
void probe_sky(struct probe *f, const struct sky *sky);

/* scene_finish() and camera_init(); the test fails with their error message if they do. */
void probe_finish(struct probe *f);

/* Radiance that arrives at the eye from direction d, which is not of unit length: at distance 1 along
 * the camera's axis it is (x, y, -1). */
typedef void probe_radiance(const double d[3], double out[3], const void *data);

/* The same from everywhere; data: the three channels. */
probe_radiance probe_uniform;

/* Mean of f over each pixel, midpoint rule with sub x sub points. The ray is formed here, not by the
 * renderer's camera. The caller frees. */
double *probe_expect(const struct probe *f, double tan_h, int sub, probe_radiance *radiance,
                     const void *data);

/* 8 replicates of spp samples per pixel. */
void probe_run(struct probe *f, int spp, struct moments *m);
/* probe_finish() and 8 replicates of 64 samples per pixel. */
void probe_render(struct probe *f, struct moments *m);

/* H0: each quadrant's mean radiance is the closed form's, up to a relative error of `allowed` that a
 * comment beside each number explains. 12 Student tests of K - 1 = 7 degrees of freedom at 1e-6
 * each, two-sided: alpha < 1.2e-5. */
bool probe_agrees(const struct moments *m, const double *truth, double allowed);

/* It agrees, and the negative controls do not: 1 % brighter, and left and right exchanged unless the
 * image is symmetric. Prints the figures, frees both. */
void probe_judge(struct probe *f, struct moments *m, double *truth, double allowed, bool symmetric);
/* probe_render(), and its judgement by what probe_expect() gives. */
void probe_check(struct probe *f, double tan_h, int sub, probe_radiance *radiance, const void *data,
                 double allowed, bool symmetric);

#endif
