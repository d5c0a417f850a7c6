/* One run of the program under test on a scene of the suite. */
#ifndef ASSAY_RUN_PATHTRACER_H
#define ASSAY_RUN_PATHTRACER_H

#include "reference/suite/suite.h"
#include "renderer/image/moments.h"

struct pathtracer_job {
    const char *program; /* pathtracer, or what stands in for it */
    const struct suite_scene *scene;
    int first, spp; /* samples first .. spp-1 of each pixel; 0 and spp: one render */
    uint64_t seed;
    const char *const *options; /* further ones, NULL at the end; NULL: none */
    int threads;
    double timeout_s;
    const char *files; /* writes files.exr and files.log; their directory exists */
    bool keep;         /* both stay; else the log does where the program fails */
};

/* What tracing took, as the image says ("assay:rays"); all 0 where it does not. The wide hierarchy counts nodes and
 * leaves, of up to eight boxes or triangles each (renderer/bvh/bvh.h). */
struct pathtracer_rays {
    double rays, box_tests, primitive_tests;
};

/* The image's moments, the CPU time it took and its rays (may be NULL). Fails with the program's last line if it
 * fails, and on an image of another size. */
NODISCARD bool run_pathtracer(const struct pathtracer_job *job, struct moments *out, double *cpu_s,
                              struct pathtracer_rays *rays, struct err *e);

/* One start for at most MAX_SEEDS seeds, each another: out[k] is of seed[k], to the bit what run_pathtracer() reads with it
 * alone. *cpu_s of all together; each has the timeout. Keeps no images. */
NODISCARD bool run_pathtracer_seeds(const struct pathtracer_job *job, const uint64_t *seed, int num,
                                    struct moments *out, double *cpu_s, struct err *e);

#endif
