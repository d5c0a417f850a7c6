/* The scene as a neutral dump that cycles.py builds in Blender: world space, linear Rec. 709, our
 * units, nothing left to interpret. Why each of its numbers gives the same image in Cycles, and
 * the probe that shows it, is in README.md.
 *
 * JSON, in one object:
 *   "assay_cycles": 2           version of this format
 *   "depth": m                  as the assignment counts: 0 = emission seen directly
 *   "width", "height"           pixels
 *   "extent"                    diagonal of the box around the scene
 *   "filter_width"              pixels: 4 sigma of a Gauss filter; absent: the box of one pixel
 *   "camera": {"right", "up", "backward", "eye": [x,y,z],
 *              "tan_h": half width of the image plane at distance 1,
 *              "clip": [near, far],     depths; no primitive lies on both sides of one
 *              "lens_radius" (0: pinhole), "focal_distance"}
 *   "materials": [{"name", "kind": "diffuse", "mirror", "refraction", "glass", "microfacet" or "plastic",
 *                  "reflectance": [r,g,b] (of both sides), "radiance": [r,g,b],
 *                  "both_sides": emits from the back too,
 *                  "reflectance_map", "radiance_map" (only if there is one; it multiplies the colour): {"file": an EXR
 *                         of linear texels beside the dump, "sha256" of it, "size": [w, h], "pad": [x, y] black
 *                         texels on each side, "wrap": [u, v], each "repeat", "mirror" or "clamp", "nearest"},
 *                  refraction and glass: "transmittance": [r,g,b], "ior" (as struct material has it),
 *                                        "schlick",
 *                  microfacet: "distribution": "ggx" or "beckmann", "alpha", "separable",
 *                              "eta", "k": [r,g,b] or null (then reflectance at any angle),
 *                              "facets": true: made of random facets; false: Blender's closure is exact,
 *                  plastic: the same for its highlight, and "specular", "mirror": [r,g,b]}]
 *   "meshes": [{"name", "material": index, "positions": [9 numbers a triangle],
 *               "normals": [9 numbers a triangle], on the geometric normal's side, or null: flat,
 *               "uv": [6 numbers a triangle], only if the material has a map}]
 *   "spheres": [{"name", "material", "centre": [x,y,z], "radius", "normal_out": +1 or -1,
 *                "exact": true: opaque, not emitting and seen from outside only, so a Blender point
 *                         (an analytic sphere) serves; false: needs a mesh}]
 *   "lights": [{"kind": "point", "position", "value": [r,g,b], "attenuation": [a,b,c]} |
 *              {"kind": "spot", as point, "axis", "cos_cutoff", "exponent"} |
 *              {"kind": "directional", "to_light", "irradiance": [r,g,b] (W/m2)}]
 *   "environment": null | {"kind": "constant" or "upper_half", "radiance": [r,g,b]} |
 *                  {"kind": "image", "file": a float32 EXR beside the dump}
 * Emitting meshes and spheres are lights by their material. */
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
