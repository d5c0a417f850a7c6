#include "aov.h"

#include "renderer/scene/shape.h"
#include "renderer/shading/fresnel.h"

static rgb albedo_of(const struct material *m)
{
    rgb mirror = m->reflectance;
    float cos_t, back = 1;
    if (m->conductor)
        mirror =
            (rgb){fresnel_conductor(1, m->eta.r, m->k.r), fresnel_conductor(1, m->eta.g, m->k.g),
                  fresnel_conductor(1, m->eta.b, m->k.b)};
    if (1 << m->kind & MATERIAL_REFRACTS)
        back = m->kind == MATERIAL_REFRACTION ? 0 : fresnel_dielectric(1, m->ior, &cos_t);
    return rgb_add(rgb_scale(mirror, back), rgb_scale(m->transmittance, 1 - back));
}

static rgb albedo_at(const struct scene *s, const struct material *m, uint32_t prim, float u,
                     float v)
{
    rgb albedo = albedo_of(m);
    if (m->reflectance_map != 0)
        albedo = rgb_mul(albedo, scene_map_at(s, m->reflectance_map, prim, u, v));
    return rgb_add(albedo, rgb_add(m->specular, m->mirror));
}

void first_hits_record(const struct integrator *it, struct batch *b, int num_active)
{
    const struct scene *s = it->scene;
    const struct camera *c = it->camera;
    for (int k = 0; k < num_active; k++) {
        int i = b->active[k];
        uint32_t prim = b->hit.prim[i];
        b->first.object[i] = NO_HIT;
        if (prim == NO_HIT)
            continue;
        ray r = rays_get(&b->ray, i);
        struct surface at = surface_at(s, prim, &r, b->hit.t[i], b->hit.u[i], b->hit.v[i]);
        bool is_triangle = prim < s->num_triangles;
        uint32_t sphere = is_triangle ? 0 : prim - s->num_triangles;
        uint32_t material = is_triangle ? s->tri_material[prim] : s->sphere_material[sphere];
        b->first.object[i] = is_triangle ? s->tri_object[prim] : s->sphere_object[sphere];
        b->first.depth[i] = -dot(sub(at.p, c->eye), c->backward);
        vec3s_set(&b->first.normal, i, at.ns);
        rgbs_set(&b->first.albedo, i,
                 albedo_at(s, &s->materials[material], prim, b->hit.u[i], b->hit.v[i]));
    }
}
