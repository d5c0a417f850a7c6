/* The shade stage: the surface that each ray hit, its texture, and its emission with the weight of multiple importance
 * sampling. */
#ifndef ASSAY_SHADE_SIMD_H
#define ASSAY_SHADE_SIMD_H

#include "paths_simd.h"
#include "renderer/scene/shape_simd.h"

/* struct surface, with the numbers of its material and light. */
struct surfacev {
    vec3v p, ng, ns;
    vf eps;
    vi material, light;
};

/* surface_at() of hits from k; undefined in lanes that hit nothing. */
INLINE void surfaces(const struct integrator *it, const struct rays *r, const struct hits *h, int k,
                     struct surfacev *s)
{
    const struct scene_simd *ls = it->records;
    int32_t row[LANES];
    vi prim = vi_load_any(h->prim + k);
    prim = vi_select(vi_lt(prim, vi_set(0)), vi_set(0), prim);
    vi_store_any(row, prim);
    vf w[3][COLUMNS];
    for (int i = 0; i < 3; i++)
        gather_columns(ls->primitive + COLUMNS * i, RECORD_WORDS, row, w[i]);
    vf u = vf_load_any(h->u + k), v = vf_load_any(h->v + k);
    vec3v e1 = v3v(w[0][3], w[0][4], w[0][5]), e2 = v3v(w[0][6], w[0][7], w[1][0]);
    vec3v n0 = v3v(w[1][4], w[1][5], w[1][6]), n1 = v3v(w[1][7], w[2][0], w[2][1]);
    vec3v n2 = v3v(w[2][2], w[2][3], w[2][4]);
    s->p = madv(madv(v3v(w[0][0], w[0][1], w[0][2]), u, e1), v, e2);
    s->ng = v3v(w[1][1], w[1][2], w[1][3]);
    s->ns = interpolate_normals(n0, n1, n2, s->ng, u, v);
    s->eps = w[2][RECORD_EPS - 2 * COLUMNS];
    s->material = as_vi(w[2][RECORD_MATERIAL - 2 * COLUMNS]);
    s->light = as_vi(w[2][RECORD_LIGHT - 2 * COLUMNS]);
    if (!ls->has_spheres)
        return;
    vm sphere = ~vi_lt(prim, vi_set((int32_t)it->scene->num_triangles));
    if (!bits(sphere))
        return;
    vec3v n, centre = v3v(w[0][0], w[0][1], w[0][2]);
    vec3v p = sphere_place(centre, w[0][RECORD_RADIUS], w[0][RECORD_OUT], v3_load(&r->o, k),
                           v3_load(&r->d, k), vf_load_any(h->t + k), &n);
    s->p = v3_select(sphere, p, s->p);
    s->ng = v3_select(sphere, n, s->ng);
    s->ns = v3_select(sphere, n, s->ns);
}

/* Radiance that the surfaces s (hits k ..) emit against the ray directions d, for the lanes of the mask. */
INLINE rgbv emitted(const struct scene *scene, const struct surfacev *s, const struct hits *h,
                    int k, vec3v d, unsigned mask)
{
    rgbv le = rgb_all(grey(0));
    unsigned both_sides = 0;
    for (; mask; mask &= mask - 1) {
        int i = __builtin_ctz(mask);
        const struct material *m = &scene->materials[LANE(s->material, i)];
        both_sides |= (unsigned)m->radiance_both_sides << i;
        rgb radiance = m->radiance;
        if (m->radiance_map != 0)
            radiance = rgb_mul(radiance, scene_map_at(scene, m->radiance_map, h->prim[k + i],
                                                      h->u[k + i], h->v[k + i]));
        rgb_set_lane(&le, i, radiance);
    }
    vm front = vf_lt(vf_set(0), dotv(s->ng, negv(d)));
    return rgb_where(lanes_of(both_sides) | front, le);
}

/* a^2/(a^2 + b^2) by way of b/a: the squares of densities of small lights overflow. */
INLINE vf power_heuristic(vf a, vf b)
{
    vf r = b / a;
    return vf_select(vf_lt(vf_set(0), a), 1 / (1 + r * r), vf_set(0));
}

/* Weight of the emission that the paths of the mask have hit: of these lights on surface s, or, with s NULL, of the
 * environment, whose density is pdf_light. */
INLINE vf emission_weight(const struct integrator *it, const struct batch *b, int k, unsigned mask,
                          const int32_t light[LANES], const struct surfacev *s, vf pdf_light)
{
    const vf one = vf_set(1), pdf_w = vf_load_any(b->pdf_w + k);
    vm certain = vf_eq(pdf_w, vf_set(0));
    if (it->opt.direct == DIRECT_BSDF)
        return one;
    if (it->opt.direct != DIRECT_MIS)
        return vf_select(certain, one, vf_set(0));
    mask &= ~bits(certain);
    if (s != NULL)
        pdf_light = pdf_of_light(it->lights, light, b->hit.prim + k, v3_load(&b->ray.o, k),
                                 v3_load(&b->ray.d, k), vf_load_any(b->hit.t + k), s->ng, mask);
    if (chooses_light(it)) {
        for (unsigned m = mask; m; m &= m - 1) {
            int i = __builtin_ctz(m);
            LANE(pdf_light, i) *=
                chosen_probability(it->lights->all, (uint32_t)light[i], vec3s_get(&b->ray.o, k + i),
                                   vec3s_get(&b->from_n, k + i), b->from_weight[k + i]);
        }
    }
    return vf_select(certain, one,
                     power_heuristic(pdf_w, (float)it->opt.light_samples * pdf_light));
}

/* Adds the weighted emission that the paths of the mask have hit: of the surfaces s, or, with s NULL, of the
 * environment. */
static __attribute__((noinline)) void add_emission(const struct integrator *it, struct batch *b,
                                                   int k, unsigned mask, const struct surfacev *s,
                                                   int vertex)
{
    const vec3v d = v3_load(&b->ray.d, k);
    int32_t light[LANES];
    vf pdf_w = vf_set(0);
    rgbv le;
    if (s != NULL) {
        le = emitted(it->scene, s, &b->hit, k, d, mask);
        vi_store_any(light, s->light);
    } else {
        if (environment_is_hidden(it->scene->environment))
            mask &= ~bits(vf_eq(vf_load_any(b->pdf_w + k), vf_set(0)));
        const vec3v n = v3_load(&b->from_n, k);
        const bool weighs = vertex > 0 && it->opt.direct == DIRECT_MIS;
        le = look_up_environment(it->scene->environment, weighs ? &n : NULL, d, mask, &pdf_w);
        vi_store_any(light, vi_set(it->scene->environment_light));
    }
    mask &= ~bits(rgb_is_zerov(le));
    vf w = emission_weight(it, b, k, mask, light, s, pdf_w);
    gather_light(b, k, lanes_of(mask), rgb_scalev(rgb_mulv(rgb_load(&b->throughput, k), le), w));
}

/* Multiplies the reflectance in the lanes of the mask by their textures; ends paths on a diffuse
 * surface that is black there. */
static __attribute__((noinline)) void apply_textures(const struct integrator *it, struct batch *b,
                                                     int k, unsigned mask)
{
    const struct scene *s = it->scene;
    for (; mask; mask &= mask - 1) {
        int i = k + __builtin_ctz(mask);
        const struct material *m = &s->materials[b->material[i]];
        rgb texel = scene_map_at(s, m->reflectance_map, b->hit.prim[i], b->hit.u[i], b->hit.v[i]);
        rgb r = rgb_mul(rgbs_get(&b->reflectance, i), texel);
        rgbs_set(&b->reflectance, i, r);
        if (rgb_is_zero(r) && m->kind == MATERIAL_DIFFUSE)
            b->goes_on[k / LANES] &= (uint16_t) ~(1u << (i - k));
    }
}

/* Adds emission, sets up the surfaces, and says which paths go on. */
static void shade(const struct integrator *it, struct batch *b, int n, int vertex)
{
    const struct scene_simd *ls = it->records;
    const bool lights_count = counts(it, vertex), last = vertex == it->opt.max_bounces;
    for (int k = 0; k < n; k += LANES) {
        unsigned there = lanes_there(k, n);
        vi prim = vi_load_any(b->hit.prim + k);
        unsigned missed = there & bits(vi_eq(prim, vi_set(-1)));
        if (missed && lights_count && it->scene->environment != NULL)
            add_emission(it, b, k, missed, NULL, vertex);
        there &= ~missed;
        struct surfacev s;
        surfaces(it, &b->ray, &b->hit, k, &s);
        if (lights_count) {
            unsigned lit = there & bits(vi_lt(vi_set(-1), s.light));
            if (lit) {
                /* A copy: with its address taken, s would live in memory, not in registers. */
                const struct surfacev met = s;
                add_emission(it, b, k, lit, &met, vertex);
            }
        }
        b->goes_on[k / LANES] = 0;
        if (last || !there)
            continue;
        int32_t row[LANES];
        vf material[COLUMNS];
        vi_store_any(row, s.material);
        gather_columns(ls->material, MATERIAL_WORDS, row, material);
        vi about = as_vi(material[MATERIAL_BITS]);
        b->goes_on[k / LANES] = (uint16_t)(there & ~bits(has_bits(about, MATERIAL_IS_BLACK)));
        vec3v wo = negv(v3_load(&b->ray.d, k));
        vm front = vf_lt(vf_set(0), dotv(s.ng, wo));
        s.ng = v3_negate_if(~front, s.ng);
        s.ns = v3_negate_if(~front, s.ns);
        /* A shading normal that faces away from the viewer is replaced by the geometric one. */
        s.ns = v3_select(vf_le(dotv(s.ns, wo), vf_set(0)), s.ng, s.ns);
        v3_store(&b->p, k, s.p);
        v3_store(&b->ng, k, s.ng);
        v3_store(&b->ns, k, s.ns);
        v3_store(&b->wo, k, wo);
        vf_store_any(b->eps + k, s.eps);
        vi_store_any(b->material + k, s.material);
        vi_store_any(b->bits + k, about);
        rgb_store(&b->reflectance, k, (rgbv){material[0], material[1], material[2]});
        if (ls->has_textures)
            apply_textures(it, b, k, there & bits(has_bits(about, MATERIAL_IS_TEXTURED)));
        store_flags(b->front + k, front);
    }
}

#endif
