/* Blender run without its window. */
#ifndef ASSAY_BLENDER_H
#define ASSAY_BLENDER_H

#include "renderer/base/err.h"

/* The words before "--" of every command. */
#define BLENDER_RUN "blender -b --factory-startup -noaudio --python-exit-code 3 -P "

/* Runs a command in dir, output to dir/blender.log. The base name of `script` in it becomes the full path of
 * share_dir/script. Fails as process_run(). */
NODISCARD bool blender_run(const char *command, const char *share_dir, const char *script,
                           const char *dir, double timeout_s, struct err *e);

#endif
