/* Runs Blender in background mode. */
#ifndef ASSAY_BLENDER_H
#define ASSAY_BLENDER_H

#include "renderer/base/err.h"

/* The start of every command; a script's name, "--" and the script's arguments follow. */
#define BLENDER_RUN "blender -b --factory-startup -noaudio --python-exit-code 3 -P "

/* Runs a command that begins with BLENDER_RUN in dir, with its output in dir/blender.log. A word of the command that
 * equals the base name of `script` is replaced by the full path of share_dir/script. Fails as process_run() does. */
NODISCARD bool blender_run(const char *command, const char *share_dir, const char *script,
                           const char *dir, double timeout_s, struct err *e);

#endif
