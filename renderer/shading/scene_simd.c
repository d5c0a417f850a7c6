#include "scene_simd.h"

#include "renderer/base/huge_alloc.h"
#include "renderer/scene/shape.h"

#include <stdlib.h>
#include <string.h>

static void set3(float *to, vec3 v)
{
    to[0] = v.x;
    to[1] = v.y;
    to[2] = v.z;
}

static void set_rgb(float *to, rgb c)
{
    to[0] = c.r;
    to[1] = c.g;
    to[2] = c.b;
}

static void set_int(float *to, int32_t i)
{
    memcpy(to, &i, sizeof i);
}

static void fill_triangle(const struct scene *s, uint32_t i, float *r)
{
    const vec3 *p = s->position + 3 * (size_t)i;
    /* Whatever does not depend on the hit point is taken from surface_at() itself. */
    const ray none = {.d = {0, 0, 1}};
    const struct surface at = surface_at(s, i, &none, 0, 0, 0);
    set3(r + RECORD_P, p[0]);
    set3(r + RECORD_E1, sub(p[1], p[0]));
    set3(r + RECORD_E2, sub(p[2], p[0]));
    set3(r + RECORD_NG, at.ng);
    for (size_t k = 0; k < 3; k++)
        set3(r + RECORD_N + 3 * k, s->normal[3 * (size_t)i + k]);
    r[RECORD_EPS] = at.eps;
    set_int(r + RECORD_MATERIAL, (int32_t)s->tri_material[i]);
    set_int(r + RECORD_LIGHT, s->tri_light[i]);
}

static void fill_sphere(const struct scene *s, uint32_t i, float *r)
{
    const struct sphere *sp = &s->spheres[i];
    const ray towards = {.o = sp->centre, .d = {0, 0, 1}};
    set3(r + RECORD_CENTRE, sp->centre);
    r[RECORD_RADIUS] = sp->radius;
    r[RECORD_OUT] = sp->normal_out;
    r[RECORD_EPS] = surface_at(s, s->num_triangles + i, &towards, sp->radius, 0, 0).eps;
    set_int(r + RECORD_MATERIAL, (int32_t)s->sphere_material[i]);
    set_int(r + RECORD_LIGHT, s->sphere_light[i]);
}

/* A lobe is sampled in proportion to its largest channel, so that no sample weighs more than the three largest channels
 * together. */
static void set_plastic(const struct material *m, float r[MATERIAL_WORDS])
{
    const float highlight = rgb_max(m->specular), mirror = rgb_max(m->mirror);
    const float all = rgb_max(m->reflectance) + highlight + mirror;
    r[MATERIAL_MIRROR_SHARE] = all > 0 ? mirror / all : 0;
    r[MATERIAL_HIGHLIGHT_SHARE] = all > 0 ? highlight / all : 0;
    set_rgb(r + MATERIAL_SPECULAR, m->specular);
    set_rgb(r + MATERIAL_IMAGE, m->mirror);
}

void scene_simd_material(const struct material *m, float r[MATERIAL_WORDS])
{
    set_rgb(r + MATERIAL_REFLECTANCE, m->reflectance);
    set_rgb(r + MATERIAL_TRANSMITTANCE, m->transmittance);
    set_rgb(r + MATERIAL_ETA, m->eta);
    set_rgb(r + MATERIAL_K, m->k);
    r[MATERIAL_IOR] = m->ior;
    r[MATERIAL_ALPHA] = m->alpha;
    set_int(r + MATERIAL_BITS, 1 << m->kind | (material_is_black(m) ? MATERIAL_IS_BLACK : 0) |
                                   (m->schlick ? MATERIAL_IS_SCHLICK : 0) |
                                   (m->separable ? MATERIAL_IS_SEPARABLE : 0) |
                                   (m->conductor ? MATERIAL_IS_CONDUCTOR : 0) |
                                   (m->reflectance_map != 0 ? MATERIAL_IS_TEXTURED : 0));
    set_int(r + MATERIAL_FACETS, (int32_t)m->microfacet);
    if (m->kind == MATERIAL_PLASTIC)
        set_plastic(m, r);
}

struct scene_simd *scene_simd_build(const struct scene *s, struct err *e)
{
    struct scene_simd *l = calloc(1, sizeof *l);
    /* Lanes whose rays hit nothing read the first record, so there has to be one. */
    const size_t words = RECORD_WORDS * ((size_t)scene_num_primitives(s) + 1);
    if (l != NULL) {
        l->primitive = huge_alloc(words * sizeof *l->primitive);
        l->material = calloc(s->num_materials + 1, MATERIAL_WORDS * sizeof *l->material);
    }
    if (l == NULL || l->primitive == NULL || l->material == NULL) {
        scene_simd_free(l);
        err_set(e, "out of memory for the records of %u primitives", scene_num_primitives(s));
        return NULL;
    }
    memset(l->primitive, 0, words * sizeof *l->primitive);
    l->has_spheres = s->num_spheres > 0;
    l->only_diffuse = true;
    for (uint32_t i = 0; i < s->num_triangles; i++)
        fill_triangle(s, i, l->primitive + RECORD_WORDS * (size_t)i);
    for (uint32_t i = 0; i < s->num_spheres; i++)
        fill_sphere(s, i, l->primitive + RECORD_WORDS * (size_t)(s->num_triangles + i));
    for (uint32_t i = 0; i < s->num_materials; i++) {
        scene_simd_material(&s->materials[i], l->material + MATERIAL_WORDS * (size_t)i);
        l->has_textures |= s->materials[i].reflectance_map != 0;
        l->only_diffuse = l->only_diffuse && (s->materials[i].kind == MATERIAL_DIFFUSE ||
                                              material_is_black(&s->materials[i]));
    }
    return l;
}

void scene_simd_free(struct scene_simd *l)
{
    if (l == NULL)
        return;
    free(l->primitive);
    free(l->material);
    free(l);
}
