/* What tests of the POV-Ray driver share: a job for povray_driver, and our own image of it. */
#ifndef ASSAY_POVRAY_FIXTURE_H
#define ASSAY_POVRAY_FIXTURE_H

#include "reference/povray/export_povray.h"
#include "reference/replicates/engine_driver.h"

/* POV-Ray sleeps through most of the 0.7 s that a small image takes. */
enum { THREADS = 8 };

/* What povray_driver is given, in a directory that goes with it. */
struct fixture {
    char dir[64];
    struct scene s;
    struct camera c;
    struct suite_scene suite;
    struct suite_reference ref;
    struct reference_options opt;
    struct reference_job job;
};

/* Takes over the scene and completes it. Two replicates of subgrid 1. Aborts the test on failure. */
void fixture_init(struct fixture *f, struct scene s, int size, int depth);
void fixture_free(struct fixture *f);
/* POV-Ray's image, which the caller frees; fails the test if there is none. `manifest` may be NULL. */
struct moments must_render(struct fixture *f, json_t *manifest);
/* The scene as POV-Ray gets it; the caller frees. */
char *povray_text(const struct scene *s, const struct camera *c, int depth,
                  const struct povray_variant *v);
/* Looks straight down at the plane y = 0 from height h; the image is 2 h x 2 h wide. */
void look_down(struct scene *s, float h);
/* Skips the test, and says so, where there is none. */
void need_povray(void);
double image_mean(const struct moments *m, int channel);
/* Our own renderer: image means of paths of up to `depth` bounces, and their variances. */
void render_ours(struct fixture *f, int depth, double mean[3], double variance[3]);

enum { CALLS = 6 };
/* H0: x[.][channel], the image means of CALLS independent calls of POV-Ray, have our mean as their expectation:
 * t-test with CALLS - 1 degrees of freedom, alpha = 1e-3 two-sided. `variance`: of our mean. Prints the difference. */
bool means_agree(double x[CALLS][3], int channel, double ours, double variance);

#endif
