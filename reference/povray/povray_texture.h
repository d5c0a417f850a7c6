/* Textures as POV-Ray pigments over texture coordinates: a pigment_map of rows, each a color_map, without an image
 * file. Beyond its edges the texture is written out as far as the material's triangles reach. */
#ifndef ASSAY_POVRAY_TEXTURE_H
#define ASSAY_POVRAY_TEXTURE_H

#include "export_povray_internal.h"

/* Fails if a texture, written out beyond its edges, has more texels than a map has entries (254 in each direction, 127
 * if nearest), and on materials that both reflect and glow, one of these with a texture. */
NODISCARD bool povray_check_textures(const struct scene *s, struct err *e);

/* Prints "pigment { ... }": factor times the texture map (1 + its index), for the triangles of a material. */
void povray_put_texture(const struct povray_writer *w, uint32_t material, uint32_t map, rgb factor);

#endif
