/* Export to Cycles: materials, meshes and spheres. Microfacets that no BSDF of Cycles has
 * become random facets (cycles_material.py). */
#include "export_cycles_internal.h"
#include "reference/suite/features.h"

#include "renderer/scene/environment.h"

#include <math.h>

/* Shading normals this close to the geometric one count as equal to it: files have six digits. */
#define FLAT 1e-5

/* The Glossy BSDF of Blender 3.4 is GGX with separable Smith shadowing, one colour at all angles
 * and roughness up to 1; it treats small roughness as a mirror and loses precision already above
 * that. Every other microfacet is made of random facets (cycles_material.py). */
static bool needs_facets(const struct material *m)
{
    const bool shines = m->kind == MATERIAL_PLASTIC && !rgb_is_zero(m->specular);
    return (m->kind == MATERIAL_MICROFACET || shines) &&
           (m->microfacet != MICROFACET_GGX || !m->separable || m->conductor || m->alpha > 1 ||
            m->alpha < 0.01f);
}

static const char *unsampled_light(const struct scene *s)
{
    for (uint32_t i = 0; i < s->num_lights; i++)
        switch (s->lights[i].kind) {
        case LIGHT_POINT: return "a point light";
        case LIGHT_SPOT: return "a spot light";
        case LIGHT_DIRECTIONAL: return "a directional light";
        case LIGHT_ENVIRONMENT:
            if (environment_is_hidden(s->environment))
                return "the ambient light";
            break;
        case LIGHT_TRIANGLES:
        case LIGHT_SPHERE: break;
        }
    return NULL;
}

/* The kinds that cycles_material.py makes, by its names. */
static const char *const KIND[NUM_MATERIAL_KINDS] = {
    [MATERIAL_DIFFUSE] = "diffuse",       [MATERIAL_MIRROR] = "mirror",
    [MATERIAL_REFRACTION] = "refraction", [MATERIAL_GLASS] = "glass",
    [MATERIAL_MICROFACET] = "microfacet", [MATERIAL_PLASTIC] = "plastic"};

static json_t *material_json(const struct material *m)
{
    json_t *o = json_pack("{so,ss,so,so,sb}", "name", cycles_name(m->name), "kind", KIND[m->kind],
                          "reflectance", cycles_rgb(m->reflectance), "radiance",
                          cycles_rgb(m->radiance), "both_sides", m->radiance_both_sides);
    if (m->kind == MATERIAL_REFRACTION || m->kind == MATERIAL_GLASS)
        json_object_update_new(o, json_pack("{so,sf,sb}", "transmittance",
                                            cycles_rgb(m->transmittance), "ior", (double)m->ior,
                                            "schlick", m->schlick));
    if (m->kind == MATERIAL_MICROFACET || m->kind == MATERIAL_PLASTIC)
        json_object_update_new(o, json_pack("{ss,sf,sb,sb,so,so}", "distribution",
                                            m->microfacet == MICROFACET_GGX ? "ggx" : "beckmann",
                                            "alpha", (double)m->alpha, "separable", m->separable,
                                            "facets", needs_facets(m), "eta",
                                            m->conductor ? cycles_rgb(m->eta) : json_null(), "k",
                                            m->conductor ? cycles_rgb(m->k) : json_null()));
    if (m->kind == MATERIAL_PLASTIC)
        json_object_update_new(o, json_pack("{so,so}", "specular", cycles_rgb(m->specular),
                                            "mirror", cycles_rgb(m->mirror)));
    return o;
}

static bool set_map(json_t *material, const char *key, const struct scene *s, uint32_t map,
                    const char *dump, struct err *e)
{
    return map == 0 || json_object_set_new(material, key, cycles_map(s, map, dump, e)) == 0;
}

json_t *cycles_materials(const struct scene *s, const char *dump, struct err *e)
{
    json_t *out = json_array();
    const char *light = unsampled_light(s);
    bool ok = true;
    for (uint32_t i = 0; ok && i < s->num_materials; i++) {
        const struct material *m = &s->materials[i];
        if (KIND[m->kind] == NULL)
            ok = err_set(e, "Cycles does not have %s (material '%s')",
                         features_material_names[m->kind], m->name);
        else if (needs_facets(m) && light != NULL)
            ok = err_set(
                e,
                "Cycles: material '%s': %s cannot light a microfacet that is not GGX, separable, "
                "of constant reflectance and of alpha 0.01 to 1",
                m->name, light);
        if (!ok)
            break;
        json_t *material = material_json(m);
        json_array_append_new(out, material);
        ok = set_map(material, "reflectance_map", s, m->reflectance_map, dump, e) &&
             set_map(material, "radiance_map", s, m->radiance_map, dump, e);
    }
    if (ok)
        return out;
    json_decref(out);
    return NULL;
}

static void push(json_t *array, const float *v, int num, float sign)
{
    for (int k = 0; k < num; k++)
        json_array_append_new(array, json_real((double)(sign * v[k])));
}

/* A triangle's shading normals: +1 all on the geometric normal's side, -1 all on the other (the
 * renderer turns them), 0 mixed. *flat: all equal the geometric normal or all its opposite. */
static int normals_side(const vec3 *p, const vec3 *n, bool *flat)
{
    dvec3 ng = features_normal(p);
    int positive = 0;
    double worst = 0;
    for (int k = 0; k < 3; k++) {
        double cosine = d3_dot(d3_of(n[k]), ng);
        positive += cosine > 0;
        worst = fmax(worst, d3_length(d3_sub(d3_of(n[k]), d3_scale(ng, cosine > 0 ? 1 : -1))));
    }
    *flat = worst < FLAT && positive % 3 == 0;
    return positive == 3 ? 1 : positive == 0 ? -1 : 0;
}

/* Appends the flat or the smooth triangles of one object as a mesh, if there are any. */
static bool push_mesh(json_t *out, const struct scene *s, const struct object *o, bool smooth,
                      struct err *e)
{
    json_t *positions = json_array(), *normals = json_array(), *uvs = json_array();
    const bool has_map = material_has_map(&s->materials[o->material]);
    bool ok = true;
    for (uint32_t i = o->first_triangle; ok && i < o->first_triangle + o->num_triangles; i++) {
        const vec3 *p = s->position + 3 * (size_t)i, *n = s->normal + 3 * (size_t)i;
        bool flat;
        int side = normals_side(p, n, &flat);
        if (side == 0)
            ok = err_set(
                e, "Cycles: object '%s': triangle %u has shading normals on both of its sides",
                o->name, i - o->first_triangle);
        for (int k = 0; ok && flat != smooth && k < 3; k++) {
            push(positions, &p[k].x, 3, 1);
            push(normals, &n[k].x, smooth ? 3 : 0, (float)side);
            if (has_map)
                push(uvs, &s->uv[3 * (size_t)i + (size_t)k].u, 2, 1);
        }
    }
    if (ok && json_array_size(positions) > 0)
        json_array_append_new(out, json_pack("{so,si,sO,sO,sO*}", "name", cycles_name(o->name),
                                             "material", (int)o->material, "positions", positions,
                                             "normals", smooth ? normals : json_null(), "uv",
                                             has_map ? uvs : NULL));
    json_decref(uvs);
    json_decref(positions);
    json_decref(normals);
    return ok;
}

json_t *cycles_meshes(const struct scene *s, struct err *e)
{
    json_t *out = json_array();
    for (uint32_t i = 0; i < s->num_objects; i++)
        if (!push_mesh(out, s, &s->objects[i], false, e) ||
            !push_mesh(out, s, &s->objects[i], true, e)) {
            json_decref(out);
            return NULL;
        }
    return out;
}

json_t *cycles_spheres(const struct scene *s, vec3 eye)
{
    json_t *out = json_array();
    for (uint32_t i = 0; i < s->num_spheres; i++) {
        const struct sphere *sp = &s->spheres[i];
        const struct material *m = &s->materials[s->sphere_material[i]];
        /* Analytic spheres are invisible from inside and cannot be lights; an opaque sphere is seen
         * from inside only if the eye is inside. */
        bool opaque = m->kind != MATERIAL_REFRACTION && m->kind != MATERIAL_GLASS;
        bool inside = d3_length(d3_sub(d3_of(eye), d3_of(sp->centre))) < sp->radius;
        bool dark = rgb_is_zero(m->radiance);
        json_array_append_new(out, json_pack("{so,si,so,sf,si,sb}", "name",
                                             cycles_name(s->objects[s->sphere_object[i]].name),
                                             "material", (int)s->sphere_material[i], "centre",
                                             cycles_vec3(sp->centre), "radius", (double)sp->radius,
                                             "normal_out", sp->normal_out > 0 ? 1 : -1, "exact",
                                             opaque && dark && !inside));
    }
    return out;
}
