/* The programs that `make bench` compares, behind one call: images of one view with distinct seeds, and their
 * CPU time. */
#ifndef ASSAY_BENCH_ENGINES_H
#define ASSAY_BENCH_ENGINES_H

#include "renderer/bvh/bvh.h"
#include "renderer/scene/camera.h"
#include "embree_tracer.h"

enum bench_engine {
    BENCH_LIGHT,  /* ours, --direct light: as the tracer on Embree */
    BENCH_MIS,    /* ours, --direct mis, the default: as Cycles */
    BENCH_SOBOL,  /* the same with --sampler sobol */
    BENCH_GUIDED, /* and with --guiding on */
    BENCH_EMBREE, /* embree_tracer.h */
    BENCH_CYCLES,
    BENCH_POVRAY, /* bench_povray.c; spp is a square */
    BENCH_NUM_ENGINES
};
extern const char *const bench_engine_names[BENCH_NUM_ENGINES];

struct bench_view {
    const char *name;
    struct scene scene;
    struct camera camera;
    int depth;
    enum isa isa; /* of the rays and of the paths */
    struct bvh *bvh;
    struct embree_tracer *embree; /* NULL: cannot */
};

/* Renders count >= 3 images of spp samples a pixel on one thread, one after the other into images (3 floats
 * a pixel). *cpu_s: total CPU seconds, with child processes, their start and the writing of their input.
 * work_dir must exist. */
NODISCARD bool bench_engine_render(enum bench_engine engine, const struct bench_view *v, int spp,
                                   int count, uint32_t seed, const char *work_dir, float *images,
                                   double *cpu_s, struct err *e);

#endif
