/* light_sample_direction() from eight places: the kinds of lights that come in numbers in vectors, the
 * others lane by lane. Part of integrator_simd.c. */
#ifndef ASSAY_LIGHT_SIMD_H
#define ASSAY_LIGHT_SIMD_H

#include "renderer/math/vec_simd.h"
#include "scene_simd.h"

/* Up to so many triangles of a light are looked through one by one. */
enum { FEW_TRIANGLES = 8 };

/* struct light_sample. */
struct light_samplev {
    vec3v wi;
    vf distance;
    rgbv radiance;
    vi sphere, delta;
    vf pdf_w;
};

/* finish_area_sample(); both_sides: the light emits on both. */
INLINE void finish_area_samplev(struct light_samplev *s, rgb radiance, bool both_sides, vec3v from,
                                vec3v to, vec3v normal, float pdf_a)
{
    const vf zero = vf_set(0);
    vec3v w = subv(to, from);
    vf d2 = dotv(w, w);
    s->distance = vf_sqrt(d2);
    s->wi = scalev(w, 1 / s->distance);
    vf cosine = dotv(normal, s->wi), cos_l = vf_abs(cosine);
    vi lit = both_sides ? vi_set(-1) : vf_lt(cosine, zero);
    s->radiance = rgb_all(radiance);
    /* Of d2 = 0 comes NaN, which no comparison lets through. */
    lit &= vf_lt(zero, cos_l);
    s->pdf_w = vf_select(lit, pdf_a * d2 / cos_l, zero);
}

/* A light of few triangles: what its samples have in common. */
struct lamp {
    const float *record; /* of the first triangle, RECORD_WORDS of each */
    const float *cdf;    /* area up to and including each */
    int count;
    float pdf_a;
    rgb radiance;
    bool both_sides;
};

static inline bool is_lamp(const struct light *light)
{
    return light->kind == LIGHT_TRIANGLES && light->count <= FEW_TRIANGLES;
}

static inline struct lamp lamp_of(const struct scene *s, const struct lanes_scene *ls,
                                  const struct light_table *t, const struct light *light)
{
    const struct material *m = &s->materials[s->tri_material[light->first]];
    return (struct lamp){.record = ls->primitive + RECORD_WORDS * (size_t)light->first,
                         .cdf = light_table_areas(t) + light->first,
                         .count = (int)light->count,
                         .pdf_a = 1 / light->area,
                         .radiance = m->radiance,
                         .both_sides = m->radiance_both_sides};
}

INLINE void sample_lampv(const struct lamp *l, vec3v p, const vf u[4], struct light_samplev *out)
{
    const vf target = u[2] * l->cdf[l->count - 1];
    const float *r = l->record;
    vf q[12];
    for (int k = 0; k < 12; k++)
        q[k] = vf_set(r[k]);
    for (int i = 0; i < l->count - 1; i++) {
        vi beyond = vf_le(vf_set(l->cdf[i]), target);
        r += RECORD_WORDS;
        for (int k = 0; k < 12; k++)
            q[k] = vf_select(beyond, vf_set(r[k]), q[k]);
    }
    vf root = vf_sqrt(u[0]), b1 = 1 - root, b2 = u[1] * root;
    vec3v to =
        madv(madv(v3v(q[0], q[1], q[2]), b1, v3v(q[3], q[4], q[5])), b2, v3v(q[6], q[7], q[8]));
    finish_area_samplev(out, l->radiance, l->both_sides, p, to, v3v(q[9], q[10], q[11]), l->pdf_a);
}

/* From outside the cone, else lane by lane. */
INLINE vi sample_spherev(const struct scene *s, const struct light *light, vec3v p, const vf u[4],
                         struct light_samplev *out)
{
    const struct sphere *sp = &s->spheres[light->first];
    const float r2 = sp->radius * sp->radius;
    const vf zero = vf_set(0);
    vec3v to_centre = subv(v3_all(sp->centre), p);
    vf d2 = dotv(to_centre, to_centre);
    vi outside =
        sp->normal_out > 0 ? vf_lt(vf_set(1.0001f * sp->radius * sp->radius), d2) : vi_set(0);
    vf sin2 = r2 / d2, one_minus_cos = sin2 / (1 + vf_sqrt(vf_max(zero, 1 - sin2)));
    framev f = frame_from_normalv(normalizev(to_centre));
    vf h = u[0] * one_minus_cos, sine, cosine;
    vf r = vf_sqrt(vf_max(zero, h * (2 - h)));
    trig_turnv(u[1], &sine, &cosine);
    vec3v local = v3v(r * cosine, r * sine, 1 - h);
    out->wi = frame_to_worldv(&f, local);
    vf along = vf_sqrt(d2) * local.z;
    out->distance = along - vf_sqrt(vf_max(zero, r2 - d2 * (1 - local.z * local.z)));
    out->radiance = rgb_all(s->materials[s->sphere_material[light->first]].radiance);
    out->sphere = vi_set((int32_t)(s->num_triangles + light->first));
    out->pdf_w = 0.5f * INV_PI_F / one_minus_cos;
    return outside;
}

INLINE void sample_pointv(const struct light *light, vec3v p, struct light_samplev *out)
{
    vec3v w = subv(v3_all(light->position), p);
    vf d = vf_sqrt(dotv(w, w));
    const float *a = light->attenuation;
    out->wi = scalev(w, 1 / d);
    out->distance = d;
    out->radiance = rgb_scalev(rgb_all(light->value), 1 / (a[0] + d * (a[1] + d * a[2])));
    out->pdf_w = vf_select(vf_eq(d, vf_set(0)), vf_set(0), vf_set(1));
    out->delta = vi_set(-1);
}

INLINE void sample_directionalv(const struct light *light, struct light_samplev *out)
{
    out->wi = v3_all(light->to_light);
    out->distance = vf_set(INFINITY);
    out->radiance = rgb_all(light->value);
    out->pdf_w = vf_set(1);
    out->delta = vi_set(-1);
}

/* Lanes of the mask one by one, each of light number l[lane]. */
static __attribute__((noinline)) void sample_each_at(const struct light_table *t, const uint32_t *l,
                                                     const vec3v *p, const vf u[4], unsigned mask,
                                                     struct light_samplev *out)
{
    for (; mask; mask &= mask - 1) {
        int i = __builtin_ctz(mask);
        const float numbers[4] = {u[0][i], u[1][i], u[2][i], u[3][i]};
        struct light_sample s =
            light_sample_direction(t, l[i], v3(p->x[i], p->y[i], p->z[i]), numbers);
        out->wi.x[i] = s.wi.x;
        out->wi.y[i] = s.wi.y;
        out->wi.z[i] = s.wi.z;
        out->distance[i] = s.distance;
        out->radiance.r[i] = s.radiance.r;
        out->radiance.g[i] = s.radiance.g;
        out->radiance.b[i] = s.radiance.b;
        out->sphere[i] = (int32_t)s.sphere;
        out->delta[i] = s.delta ? -1 : 0;
        out->pdf_w[i] = s.pdf_w;
    }
}

/* By way of copies: what an address is taken of lives in memory for all its life. */
INLINE void sample_each(const struct light_table *t, const uint32_t *l, vec3v p, const vf u[4],
                        unsigned mask, struct light_samplev *out)
{
    const vf numbers[4] = {u[0], u[1], u[2], u[3]};
    struct light_samplev each = *out;
    sample_each_at(t, l, &p, numbers, mask, &each);
    *out = each;
}

/* The lanes of the mask sample light l. */
INLINE void sample_lightv(const struct scene *s, const struct lanes_scene *ls,
                          const struct light_table *t, uint32_t l, vec3v p, const vf u[4],
                          unsigned mask, struct light_samplev *out)
{
    const struct light *light = &s->lights[l];
    vi done = vi_set(0);
    switch (light->kind) {
    case LIGHT_TRIANGLES:
        if (is_lamp(light)) {
            const struct lamp lamp = lamp_of(s, ls, t, light);
            sample_lampv(&lamp, p, u, out);
            return;
        }
        break;
    case LIGHT_SPHERE: done = sample_spherev(s, light, p, u, out); break;
    case LIGHT_POINT: sample_pointv(light, p, out); return;
    case LIGHT_DIRECTIONAL: sample_directionalv(light, out); return;
    case LIGHT_SPOT:
    case LIGHT_ENVIRONMENT: break;
    }
    mask &= ~bits(done);
    const uint32_t same[LANES] = {l, l, l, l, l, l, l, l};
    if (mask)
        sample_each(t, same, p, u, mask, out);
}

#endif
