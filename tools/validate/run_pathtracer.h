/* One run of the program under test on a scene of the suite. */
#ifndef ASSAY_RUN_PATHTRACER_H
#define ASSAY_RUN_PATHTRACER_H

#include "reference/suite/suite.h"
#include "renderer/image/moments.h"

struct pathtracer_job {
    const char *program; /* pathtracer, or the program under test in its place */
    const struct suite_scene *scene;
    int first, spp; /* samples first .. spp-1 of each pixel; first 0: a whole render */
    uint64_t seed;
    const char *const *options; /* further ones, NULL at the end; NULL: none */
    int threads;
    double timeout_s;
    const char *files; /* writes files.exr and files.log; their directory exists */
    bool keep;         /* keep both; else only the log, and only if the program fails */
};

/* Ray and intersection counts from the image's attribute "assay:rays"; all 0 without it. In the wide hierarchy a
 * test is of a node or leaf of up to eight boxes or triangles (renderer/bvh/bvh.h). */
struct pathtracer_rays {
    double rays, box_tests, primitive_tests;
};

/* Renders and reads the image. *out: its moments, the caller's; *cpu_s: CPU seconds; *rays may be NULL. Fails with the
 * last line of the program if that fails, and on an image of another size. */
NODISCARD bool run_pathtracer(const struct pathtracer_job *job, struct moments *out, double *cpu_s,
                              struct pathtracer_rays *rays, struct err *e);

/* Renders with at most MAX_SEEDS different seeds in one process: out[k] is, to the bit, what run_pathtracer() gives for
 * seed[k]. *cpu_s: of all together; the timeout is num times the job's. Keeps no images. */
NODISCARD bool run_pathtracer_seeds(const struct pathtracer_job *job, const uint64_t *seed, int num,
                                    struct moments *out, double *cpu_s, struct err *e);

#endif
