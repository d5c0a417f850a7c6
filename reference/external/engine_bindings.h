/* Binds the engines of engine_table.h to the code that writes their scene files and runs them. */
#ifndef ASSAY_ENGINE_BINDINGS_H
#define ASSAY_ENGINE_BINDINGS_H

#include "reference/replicates/engine_driver.h"

/* NULL if no engine of that name has a driver. */
const struct engine_driver *engine_driver_of(const char *engine);

/* Writes the scene for an engine of the table: first the files that it names, beside path and named after it, then path, by
 * rename. False with one line on a write error or on what the engine cannot express. */
NODISCARD bool engine_export(const struct engine_kind *kind, const struct scene *s,
                             const struct camera *c, int depth, const char *path, struct err *e);

#endif
