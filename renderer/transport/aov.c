#include "aov.h"

#include "renderer/shading/fresnel.h"

static rgb albedo_of(const struct material *m)
{
    switch (m->kind) {
    case MATERIAL_DIFFUSE:
    case MATERIAL_MIRROR: return m->reflectance;
    case MATERIAL_REFRACTION: return m->transmittance;
    case MATERIAL_GLASS: {
        float cos_t, f = fresnel_dielectric(1, m->ior, &cos_t);
        rgb through = rgb_scale(m->transmittance, 1 - f), back = rgb_scale(m->reflectance, f);
        return (rgb){through.r + back.r, through.g + back.g, through.b + back.b};
    }
    case MATERIAL_MICROFACET:
        if (m->conductor)
            return (rgb){fresnel_conductor(1, m->eta.r, m->k.r),
                         fresnel_conductor(1, m->eta.g, m->k.g),
                         fresnel_conductor(1, m->eta.b, m->k.b)};
        return m->reflectance;
    }
    return grey(0);
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
        rgbs_set(&b->first.albedo, i, albedo_of(&s->materials[material]));
    }
}
