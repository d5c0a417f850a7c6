/* What is measured: BVH_WIDE and Embree 3 [Embree], one ray at a time, on one thread. All get the same batches
 * and write the same arrays. */
#ifndef ASSAY_BENCH_TRACERS_H
#define ASSAY_BENCH_TRACERS_H

#include "renderer/bvh/bvh.h"
#include "bench_sets.h"

#include "embree_mesh.h"

struct tracer {
    const char *name;
    struct bvh *bvh; /* ours; else Embree's */
    RTCDevice device;
    RTCScene scene;
    uint32_t num_triangles;
    double build_seconds;
    size_t bytes; /* without the caller's vertices and indices */
};

/* Geometry 0: the triangles; 1: the spheres. Aborts where Embree fails. */
struct tracer tracer_embree(const char *name, const struct scene *s, enum RTCSceneFlags flags);
/* Exits with status 3 and a line if it cannot be built. */
struct tracer tracer_ours(const struct scene *s, enum isa isa);
void tracer_free(struct tracer *t);

/* CPU seconds of tracing the set; answers into *a, what ours costs added to *stats. */
double tracer_run(const struct tracer *t, const struct ray_set *s, bool shadow,
                  struct answer_key *a, struct bvh_stats *stats);

#endif
