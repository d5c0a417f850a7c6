/* A stored reference rendered again (reproduce.h). */
#ifndef ASSAY_REPRODUCE_GOLDEN_H
#define ASSAY_REPRODUCE_GOLDEN_H

#include "renderer/image/image.h"
#include "reproduce.h"

/* path: SCENE/ENGINE.exr of a directory of references, with the scene's manifest.json beside it; im: what it holds. Renders it with
 * the engine and the seed of the manifest, the scene that of the suite, into the file `to`, working in `dir`. False with a line if
 * the scene is not what it was, or the engine not here. */
bool reproduce_golden(const char *path, const struct image *im, const struct reproduce_options *opt,
                      const char *dir, const char *to, struct reproduced *out, struct err *e)
    __attribute__((warn_unused_result));

#endif
