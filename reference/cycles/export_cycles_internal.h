/* What the files of the Cycles exporter share. */
#ifndef ASSAY_EXPORT_CYCLES_INTERNAL_H
#define ASSAY_EXPORT_CYCLES_INTERNAL_H

#include "renderer/base/err.h"
#include "renderer/scene/scene.h"

#include <jansson.h>

json_t *cycles_vec3(vec3 v);
json_t *cycles_rgb(rgb c);
/* Names are only labels here; bytes outside printable ASCII become '?'. */
json_t *cycles_name(const char *name);

/* Parts of the dump (new references); NULL with a line in *e if Cycles cannot express them. */
json_t *cycles_materials(const struct scene *s, const char *dump, struct err *e);
json_t *cycles_meshes(const struct scene *s, struct err *e);
json_t *cycles_spheres(const struct scene *s, vec3 eye);
json_t *cycles_lights(const struct scene *s);
/* Writes each texture as an EXR of linear texels beside the dump; *written: how many, also on failure. */
bool cycles_write_textures(const struct scene *s, const char *dump, uint32_t *written,
                           struct err *e);
void cycles_remove_textures(const char *dump, uint32_t written);
/* The dump's entry for a map (1 + index of the texture) whose image has been written. */
json_t *cycles_map(const struct scene *s, uint32_t map, const char *dump, struct err *e);
/* An image environment is written to image_path, by rename; *image_written tells whether one was. */
json_t *cycles_environment(const struct scene *s, const char *image_path, bool *image_written,
                           struct err *e);

#endif
