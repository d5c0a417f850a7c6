/* What a scene requires of a renderer, by the names that an engine's description lists (tools/docs/formats/engine.md).
 * Triangles and a pinhole camera with square pixels are required of every engine and have no name. */
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

/* All features that the image needs, as bits 1 << enum feature. */
unsigned features_of_scene(const struct scene *s, const struct camera *c);

/* Does a shading normal of these triangles differ from the geometric one by more than the rounding of text? */
bool features_are_smooth(const struct scene *s, uint32_t first, uint32_t num);

/* Distances from the eye: a lower bound for the nearest point of the scene (of a triangle, the larger of
 * the distances to its plane and to its bounding box), and that of the furthest point. */
void features_distances(const struct scene *s, const struct camera *c, double *nearest,
                        double *furthest);

/* The unit geometric normal of three corners. */
dvec3 features_normal(const vec3 *p);

/* Names of the kinds of material, for the error lines of engines that lack them. */
extern const char *const features_material_names[NUM_MATERIAL_KINDS];

/* For exporters; error lines begin with `engine`. This one fails if the near or far plane may cut geometry, or if there
 * is no geometry. */
NODISCARD bool features_check_clipping(const char *engine, const struct scene *s,
                                       const struct camera *c, struct err *e);
/* Clipping planes for engines that clip by depth, whereas ours clip by distance. They exist if each primitive in front
 * of the camera lies wholly before the near plane, between the planes, or beyond the far one, and depths separate the
 * same primitives. 0 and INFINITY if a plane cuts nothing. Otherwise fails as features_check_clipping() does. */
NODISCARD bool features_clip_depths(const char *engine, const struct scene *s,
                                    const struct camera *c, double *near, double *far,
                                    struct err *e);
/* Fails if the camera's pixels are not square or its axes not orthogonal. */
NODISCARD bool features_check_axes(const char *engine, const struct camera *c, struct err *e);
/* Fails if a vertex has a shading normal on the back of its triangle. */
NODISCARD bool features_check_normals(const char *engine, const struct scene *s, struct err *e);
/* Fails if a material has a texture. */
NODISCARD bool features_check_textures(const char *engine, const struct scene *s, struct err *e);
/* All of these (axes, clipping, normals, textures); fails also on orthographic cameras, falloffs other than the inverse
 * square, spot lights with an exponent, and the assignment's ambient light. */
NODISCARD bool features_check_exportable(const char *engine, const struct scene *s,
                                         const struct camera *c, struct err *e);

#endif
