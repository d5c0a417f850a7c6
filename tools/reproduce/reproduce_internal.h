/* What `assay reproduce` (reproduce.h) does with each kind of file. `dir` is a directory of its own, which exists. */
#ifndef ASSAY_REPRODUCE_INTERNAL_H
#define ASSAY_REPRODUCE_INTERNAL_H

#include "reproduce.h"

/* Sets out->command to the words (NULL at the end), quoted for a shell. False with a line if out of memory. */
NODISCARD bool reproduced_command(struct reproduced *out, const char *const *word, struct err *e);

/* Makes an EXR again: a render of pathtracer, whose scene file must have the hash stated in it; the shares that
 * `assay merge` put together; a golden, SCENE/ENGINE.exr with manifest.json beside it, with its engine, the seed of
 * the manifest and the scene of the suite. Compares first the metadata that says what was rendered, then every
 * channel bit by bit. */
NODISCARD bool rerender(const char *path, const struct reproduce_options *opt, const char *dir,
                        struct reproduced *out, struct err *e);

/* Makes a results.json of validate, compare or converge again: runs its command from the current directory, with
 * outputs in `dir`, and compares every value but those of the run itself: command, date, machine, version, and
 * times. False also if its --budget was over before all was decided, then or now, and if the command runs a program
 * that is not ours without opt->run_foreign. */
NODISCARD bool reproduce_results(const char *path, const struct reproduce_options *opt,
                                 const char *dir, struct reproduced *out, struct err *e);

#endif
