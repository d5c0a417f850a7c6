/* COLLADA 1.4/1.5 -> scene, through libxml2. What is read, the assignment's profile="CGL" extras
 * and our own profile="ASSAY" extras are listed in renderer/docs/dialect.md. Whatever is not understood
 * is an error that names file and line; nothing is skipped in silence. */
#ifndef ASSAY_COLLADA_H
#define ASSAY_COLLADA_H

#include "renderer/scene/scene.h"

/* Loads path into *out (which the caller frees with scene_free()). dialect AUTO decides from the
 * file (xml_open() in collada_xml.c).
 * On failure *out is untouched and e has "path:line: what" (without a line where the whole
 * file is meant). */
NODISCARD bool collada_load(const char *path, enum dialect dialect, struct scene *out,
                            struct err *e);

/* The same for a document of `size` bytes in memory, or up to its first zero. It must not refer to other documents.
 * path: its name in error lines; images are looked for beside it. */
NODISCARD bool collada_parse(const char *text, size_t size, const char *path, enum dialect dialect,
                             struct scene *out, struct err *e);

#endif
