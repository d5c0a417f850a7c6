/* Textures as POV-Ray's own pigments over texture coordinates: a pigment_map of rows, each a color_map, without a file. Beyond its edges
 * the texture is written out as far as the material's triangles reach. */
#ifndef ASSAY_POVRAY_TEXTURE_H
#define ASSAY_POVRAY_TEXTURE_H

#include "export_povray_internal.h"

/* Fails with a line on more texels, edges written out, than a map has entries: 254 in each direction, 127 if nearest; and on
 * materials that reflect and glow where one of both has a texture. */
NODISCARD bool povray_check_textures(const struct scene *s, struct err *e);

/* "pigment { ... }" of factor times that map, for the triangles of a material. */
void povray_put_texture(const struct povray_writer *w, uint32_t material, uint32_t map, rgb factor);

#endif
