/* What a scene asks of POV-Ray, and whether POV-Ray can do it at all.
 *
 * Light gets into the picture in one of two ways, for the whole scene:
 * - by light sources: point lights, directional lights, and rectangular lamps (two triangles that
 *   form a parallelogram, emitting on one side, reflecting nothing), each of which becomes a
 *   quadrature of spotlights behind a glowing quad that only the camera sees;
 * - by geometry: any other emitter just glows and is found by POV-Ray's radiosity rays. No light
 *   source can then be mixed in, because POV-Ray counts their bounces differently. */
#ifndef ASSAY_POVRAY_PLAN_H
#define ASSAY_POVRAY_PLAN_H

#include "../renderer/camera.h"

/* What the scene asks of POV-Ray. */
struct povray_plan {
    bool sources;  /* lit by light sources, else by geometry */
    int recursion; /* radiosity recursion_limit for all bounces; 0: radiosity is not needed */
    bool constant; /* the camera is inside one sphere that emits and reflects the same everywhere:
                      every path returns the same value, so indirect light has no noise */
    double extent; /* length: diagonal of the scene's bounding box */
    /* Of the order of the brightest emitter or lit surface, > 0; 1 if there is no light. */
    double radiance;
};

/* Looks the scene over for pictures with paths of 0 .. depth bounces. Fails if POV-Ray cannot
 * express it: lens, clipping planes that cut geometry, spot lights, an environment, point lights
 * whose falloff is neither constant nor purely quadratic, light sources together with emitters that
 * need radiosity, an emitter that reflects no red, green or blue but emits it while reflecting
 * others, depth beyond what is verified, shading normals behind their triangle, and sizes at which
 * POV-Ray's fixed tolerances show. */
bool povray_plan(const struct scene *s, const struct camera *c, int depth, struct povray_plan *out,
                 struct err *e) __attribute__((warn_unused_result));

/* A one-sided parallelogram that reflects nothing. */
struct povray_lamp {
    vec3 corner, edge1, edge2;
    vec3 normal; /* unit, to the side that emits */
    rgb radiance;
    float area;
};

/* True if the light is one; fills *out. */
bool povray_lamp(const struct scene *s, const struct light *l, struct povray_lamp *out);

#endif
