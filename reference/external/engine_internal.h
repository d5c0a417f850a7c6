/* Shared by engine_run.c, engine_scene.c and engine_manifest.c only. */
#ifndef ASSAY_ENGINE_INTERNAL_H
#define ASSAY_ENGINE_INTERNAL_H

#include "engine_description.h"

enum { PATH_SIZE = 4096 + 128 };

/* One rendering job: everything that is the same for all its processes. */
struct engine_job {
    const struct engine *en;
    const struct suite_scene *suite;
    const struct engine_options *opt;
    const char *dir; /* absolute */
    char scene[3][PATH_SIZE],
        program[4096]; /* scene: one per channel; with channels together, only the first */
    int channel;       /* the channel being rendered */
    int spp, replicates;
    bool half; /* some image had fewer than 32 bits */
    double cpu_s;
    json_t *images, *independence,
        *blocks; /* what the manifest gets of "output": "mean": hashes, independence_check(), block_means.h */
};

/* Checks the features and writes the scene to paths[0], or a grey scene for each channel. For "dae" and "file" it only
 * sets paths[0] to the scene's own file ("file": without checks). */
NODISCARD bool engine_write_scene(const struct engine *en, const struct suite_scene *suite,
                                  const char *dir, char paths[3][PATH_SIZE], struct err *e);

/* Full path of the program of a key ("command", "version"). A name with a slash is relative to the
 * description, not to where we run. */
NODISCARD bool engine_program(const struct engine *en, const char *key, char *path, size_t size,
                              struct err *e);

/* The manifest of what was rendered, a new reference. */
NODISCARD bool engine_describe(const struct engine_job *j, const struct moments *m, double wall_s,
                               json_t **manifest, struct err *e);

#endif
