/* The scene as a neutral dump that cycles.py builds in Blender: world space, linear Rec. 709, our units, nothing left to
 * interpret. Its keys: tools/docs/formats/scene-json.md. Why each of its numbers gives the same image in Cycles, and the
 * probe that shows it, is in README.md. */
#ifndef ASSAY_EXPORT_CYCLES_H
#define ASSAY_EXPORT_CYCLES_H

#include "renderer/scene/camera.h"

/* Writes the dump, an environment's image to <path>.exr and texture N to <path>.textureN.exr, each by rename. Fails on
 * a write error, and with a line that starts with "Cycles: " on what cannot be expressed in Cycles: an orthographic
 * camera, a lens without a positive focal distance, non-square pixels, an angle of view beyond Blender's range,
 * clipping planes that cut through a primitive, pixel filters other than the box of one pixel and a Gauss of radius
 * 6 sigma with sigma up to 2.5, a depth above 1025, shading normals of one triangle on both of its sides, and a
 * microfacet or highlight that needs facets (all but GGX, separable, of constant reflectance, alpha 0.01 to 1) if there
 * are lights that no ray can hit: point, spot, directional, the assignment's ambient light. */
NODISCARD bool export_cycles(const struct scene *s, const struct camera *c, int depth,
                             const char *path, struct err *e);

#endif
