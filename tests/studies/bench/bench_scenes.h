/* The scenes that are measured: the suite's, the course's where ASSAY_CS184 (or ../shared/scenes/cs184)
 * has them, and generated balls and terrains. Run in the repository's root. */
#ifndef ASSAY_BENCH_SCENES_H
#define ASSAY_BENCH_SCENES_H

#include "renderer/scene/scene.h"

struct bench_scene {
    char name[64];
    char path[4096]; /* of the .dae; empty: generated */
    struct scene scene;
    bool framed; /* the file has a camera; else one looks at the mesh from outside */
};

enum { BENCH_NUM_SCENES = 16 };
const char *bench_scene_name(int i);

/* Loads the one of that name; scene_free(&out->scene). False, saying so on standard output, if it is the course's
 * and not here; exits with status 3 and a line where it cannot be read. */
NODISCARD bool bench_scene_load(const char *name, struct bench_scene *out);

/* Smallest box around all primitives; generated scenes have no bounds of their own. */
void bench_scene_bounds(const struct scene *s, vec3 *lo, vec3 *hi);

#endif
