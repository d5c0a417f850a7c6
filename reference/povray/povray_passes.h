/* The passes in which POV-Ray renders a scene, and whether it can render it at all.
 *
 * Light gets into the image in two ways:
 * - from light sources: point, spot and directional lights, and lamps (povray_lamp.h), each of which
 *   becomes a quadrature of spotlights;
 * - from what glows: any other emitter, the environment, and lamps where a mirror or glass shows
 *   them. Rays from diffuse surfaces find it (POV-Ray's radiosity).
 * A path of k bounces has k surfaces if a light source ends it and k + 1 if something that glows does, so
 * the two need different limits: they are two passes, whose images are added. */
#ifndef ASSAY_POVRAY_PASSES_H
#define ASSAY_POVRAY_PASSES_H

#include "renderer/scene/camera.h"

/* One POV-Ray image. */
struct povray_pass {
    bool sources;  /* light sources shine */
    bool glow;     /* emitters and the environment are seen */
    int recursion; /* radiosity recursion_limit for all bounces; 0: radiosity is not needed */
    /* max_trace_level, the number of surfaces along mirrors and glass. Exact without radiosity; with
     * it, large enough to include every path of allowed length. */
    int levels, levels_indirect;
    /* adc_bailout with radiosity. POV-Ray halves a ray's weight with each diffuse surface, however
     * much it reflects; mirrors and glass multiply it by their share. Glass splits rays, so negligible
     * shares must be dropped: those below 1e-4 and below a fifth of the weight after the last diffuse
     * surface. */
    double bailout_indirect;
};

struct povray_passes {
    struct povray_pass pass[2];
    int num_passes; /* 1 or 2 */
    bool specular;  /* there is a mirror, glass or refraction */
    bool constant;  /* the camera is inside one sphere that emits and reflects the same everywhere:
                       every path returns the same value, so indirect light has no noise */
    double extent;  /* length: diagonal of the scene's bounding box */
    /* Order of magnitude of the brightest emitter or lit surface, > 0; 1 if there is no light. */
    double radiance;
    int num_lamps;
};

/* Plans the passes for images with paths of 0 .. depth bounces. Fails if POV-Ray cannot express the
 * scene: lens, orthographic camera, pixel filter, clipping planes that cut, metals, plastic,
 * falloffs neither constant nor quadratic, the assignment's hidden ambient light,
 * environment images of more than POVRAY_MOST_TEXELS rows or columns, textures that povray_texture.h
 * refuses, a reflecting emitter that emits
 * in a channel in which it reflects nothing, glass that povray_glass.h refuses, a depth beyond what is
 * verified, shading normals behind their triangle, and sizes at which POV-Ray's fixed tolerances matter. */
NODISCARD bool povray_passes(const struct scene *s, const struct camera *c, int depth,
                             struct povray_passes *out, struct err *e);

/* Some pass has indirect light that is not constant: the images have noise. */
bool povray_passes_are_noisy(const struct povray_passes *p);

enum {
    POVRAY_MOST_TEXELS = 254, /* POV-Ray's maps hold 256 entries, two of which close the circle */
    /* POV-Ray counts mirrors and diffuse surfaces separately, so paths that mix them cannot end exactly
     * at our depth, which must therefore be so large that longer paths do not matter. */
    POVRAY_LEAST_MIXED_DEPTH = 8
};

#endif
