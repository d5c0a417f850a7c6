/* What a scene asks of a renderer, as names that an engine's description lists (tools/docs/formats/engine.md). Triangles
 * and a pinhole camera with square pixels are asked of every engine and have no name. */
#ifndef ASSAY_FEATURES_H
#define ASSAY_FEATURES_H

#include "renderer/math/mat4.h"
#include "renderer/scene/camera.h"

enum feature {
    FEATURE_DIFFUSE,     /* Lambert's law, on both sides */
    FEATURE_MIRROR,      /* reflectance independent of the angle */
    FEATURE_GLASS,       /* smooth dielectric with Fresnel's equations */
    FEATURE_REFRACTION,  /* a boundary that only refracts */
    FEATURE_SCHLICK,     /* glass with Schlick's approximation */
    FEATURE_MICROFACET,  /* rough metal, GGX */
    FEATURE_BECKMANN,    /* rough metal, Beckmann */
    FEATURE_PLASTIC,     /* diffuse surface with a highlight, Beckmann, one colour at all angles */
    FEATURE_AREA,        /* glowing triangles or spheres, on the front side alone */
    FEATURE_TWO_SIDED,   /* glowing on both sides */
    FEATURE_POINT,       /* point light, inverse square */
    FEATURE_SPOT,        /* spot light, inverse square */
    FEATURE_FALLOFF,     /* a point or spot light with another falloff */
    FEATURE_DIRECTIONAL, /* light from one direction */
    FEATURE_ENVIRONMENT, /* light from all directions */
    FEATURE_SPHERE,
    FEATURE_SMOOTH,  /* shading normals that are not the geometric ones */
    FEATURE_LENS,    /* thin lens */
    FEATURE_CLIP,    /* a near or far plane that may cut something off */
    FEATURE_TEXTURE, /* images on surfaces */
    NUM_FEATURES
};
/* Sets of features, of bits 1 << enum feature. */
enum {
    FEATURES_BOUNDARY = 1 << FEATURE_GLASS | 1 << FEATURE_REFRACTION | 1 << FEATURE_SCHLICK,
    FEATURES_SPECULAR = 1 << FEATURE_MIRROR | FEATURES_BOUNDARY,
    FEATURES_ROUGH_METAL = 1 << FEATURE_MICROFACET | 1 << FEATURE_BECKMANN
};

extern const char *const feature_names[NUM_FEATURES + 1]; /* ends with NULL */
extern const char *const feature_texts[NUM_FEATURES];     /* for people */

/* Bit 1 << enum feature of all that image needs. */
unsigned features_of_scene(const struct scene *s, const struct camera *c);

/* Does a shading normal of these triangles differ from the geometric one by more than the rounding of text? */
bool features_are_smooth(const struct scene *s, uint32_t first, uint32_t num);

/* Distances from the eye: no more than that of the nearest point of the scene (a triangle counts with
 * the larger of its plane's and its box's), and that of the furthest. */
void features_distances(const struct scene *s, const struct camera *c, double *nearest,
                        double *furthest);

/* The unit geometric normal of three corners. */
dvec3 features_normal(const vec3 *p);

/* What a kind of material is called in the line of an engine that does not have it. */
extern const char *const features_material_names[NUM_MATERIAL_KINDS];

/* For the writers of scene files; each fails with `engine` in front. Where the near or far plane may cut geometry, and
 * where there is none: */
NODISCARD bool features_check_clipping(const char *engine, const struct scene *s,
                                       const struct camera *c, struct err *e);
/* Planes for engines that clip by depth; ours clip by distance. They exist if each primitive in front of the camera lies
 * wholly before the near plane, between, or beyond the far one, and depths separate the same primitives; 0 and INFINITY
 * where a plane cuts nothing. Else fails as features_check_clipping(). */
NODISCARD bool features_clip_depths(const char *engine, const struct scene *s,
                                    const struct camera *c, double *near, double *far,
                                    struct err *e);
/* Where the camera's pixels are not square or its axes not orthogonal. */
NODISCARD bool features_check_axes(const char *engine, const struct camera *c, struct err *e);
/* Where a shading normal of a vertex is on the back of its triangle. */
NODISCARD bool features_check_normals(const char *engine, const struct scene *s, struct err *e);
/* Where a material has a texture. */
NODISCARD bool features_check_textures(const char *engine, const struct scene *s, struct err *e);
/* Axes, clipping, normals, textures; orthographic cameras, falloffs other than the inverse square, spot lights with an
 * exponent, the assignment's ambient light. */
NODISCARD bool features_check_exportable(const char *engine, const struct scene *s,
                                         const struct camera *c, struct err *e);

#endif
