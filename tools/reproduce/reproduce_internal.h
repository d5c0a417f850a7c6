/* What `assay reproduce` (reproduce.h) does with each kind of file. `dir` is a directory of its own, which exists. */
#ifndef ASSAY_REPRODUCE_INTERNAL_H
#define ASSAY_REPRODUCE_INTERNAL_H

#include "reproduce.h"

/* Sets out->command to NULL-terminated words. False with a line out of memory. */
NODISCARD bool reproduced_command(struct reproduced *out, const char *const *word, struct err *e);

/* An EXR: renders again what pathtracer made, whose scene has to have the hash that it says, and the shares that `assay merge` put
 * together; a golden, SCENE/ENGINE.exr with the scene's manifest.json beside it, by its engine with the seed of the manifest, the
 * scene that of the suite. Compares every channel bit by bit, and first the metadata that says what was rendered. */
NODISCARD bool rerender(const char *path, const struct reproduce_options *opt, const char *dir,
                        struct reproduced *out, struct err *e);

/* The JSON that validate, compare and converge write: runs its command again from the current directory, with its outputs in `dir`, and
 * compares every value but those of the run itself: command, date, machine, version, and what was timed. False also where its
 * --budget was over before all was decided, then or now, and where the command runs a program that is not ours without
 * opt->run_foreign. */
NODISCARD bool reproduce_results(const char *path, const struct reproduce_options *opt,
                                 const char *dir, struct reproduced *out, struct err *e);

#endif
