/* Materials and triangles as records of eight-word rows, for lanes to gather. */
#ifndef ASSAY_SCENE_SIMD_H
#define ASSAY_SCENE_SIMD_H

#include "renderer/scene/scene.h"

/* Words of a primitive's record. A triangle has RECORD_P .. RECORD_N: first corner, the two edges from
 * it, geometric normal, three shading normals; a sphere RECORD_CENTRE .. RECORD_OUT. */
enum {
    RECORD_P = 0,
    RECORD_E1 = 3,
    RECORD_E2 = 6,
    RECORD_NG = 9,
    RECORD_N = 12,
    RECORD_CENTRE = 0,
    RECORD_RADIUS = 3,
    RECORD_OUT = 4,
    RECORD_EPS = 21,
    RECORD_MATERIAL = 22, /* number, as an integer's bits */
    RECORD_LIGHT = 23,    /* likewise; -1: none */
    RECORD_WORDS = 24
};

/* Words of a material's record. */
enum {
    MATERIAL_REFLECTANCE = 0,
    MATERIAL_IOR = 3,
    MATERIAL_TRANSMITTANCE = 4,
    MATERIAL_BITS = 7, /* 1 << enum material_kind, and the following, as an integer's bits */
    MATERIAL_ALPHA = 8,
    MATERIAL_ETA = 9,
    MATERIAL_K = 12,
    MATERIAL_FACETS = 15, /* enum microfacet_kind, as an integer's bits */
    MATERIAL_WORDS = 16,
    /* Of plastic, in words that it does not use otherwise. Shares: probabilities of sampling the lobe. */
    MATERIAL_MIRROR_SHARE = MATERIAL_IOR,
    MATERIAL_HIGHLIGHT_SHARE = MATERIAL_TRANSMITTANCE,
    MATERIAL_SPECULAR = MATERIAL_ETA,
    MATERIAL_IMAGE = MATERIAL_K /* factor of the mirror ray */
};
enum {
    MATERIAL_IS_BLACK = 1 << 8,
    MATERIAL_IS_SCHLICK = 1 << 9,
    MATERIAL_IS_SEPARABLE = 1 << 10,
    MATERIAL_IS_CONDUCTOR = 1 << 11,
    MATERIAL_IS_TEXTURED = 1 << 12 /* its reflectance */
};

struct scene_simd {
    float *primitive; /* RECORD_WORDS of each; triangles, then spheres */
    float *material;  /* MATERIAL_WORDS of each */
    bool only_diffuse, has_spheres, has_textures;
};

/* Fills the record of a material. */
void scene_simd_material(const struct material *m, float record[MATERIAL_WORDS]);
/* NULL if out of memory. Keeps no reference to the scene. */
NODISCARD struct scene_simd *scene_simd_build(const struct scene *s, struct err *e);
void scene_simd_free(struct scene_simd *l);

#endif
