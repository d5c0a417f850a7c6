/* Light sampling (light.h) by lanes: samples for next event estimation, and their density. */
#ifndef ASSAY_LIGHT_SIMD_H
#define ASSAY_LIGHT_SIMD_H

#include "light.h"
#include "light_choice_simd.h"
#include "renderer/math/warp.h"
#include "renderer/scene/cs184_deviations.h"
#include "renderer/scene/environment_simd.h"

enum {
    /* A light of up to this many triangles is searched linearly. */
    FEW_TRIANGLES = 8,
    /* Words of the record of a light's triangle: corner, two edges, normal, the sum of area times
     * weight over the light's triangles up to this one, and its weight: 1, or the factor by which
     * its texture makes it be chosen more often. */
    LAMP_AREA = 12,
    LAMP_WEIGHT = 13,
    LAMP_WORDS = 16
};

/* A light as a row of COLUMNS words. */
struct light_row {
    rgb radiance;
    float pdf_a;
    int32_t both_sides;        /* -1 or 0 */
    int32_t first, untextured; /* first record; number of records, 0 if textured or a sphere */
    float area;                /* LAMP_AREA of its last record */
};

struct light_table {
    const struct scene *scene;
    float *lamp;                        /* records of the triangles of all lights */
    struct light_row *row;              /* by light */
    struct light_clusters *all, *delta; /* choices among all lights and among the delta lights */
    uint32_t num_areas;
};

/* Samples of lights. */
struct light_samplev {
    vec3v wi;      /* unit, from the point to the light */
    vf distance;   /* to the sampled place; INFINITY for directional lights and the environment */
    rgbv radiance; /* arriving along wi; for delta lights irradiance on a plane facing wi */
    vi sphere; /* primitive number of the light if it is a sphere seen from outside, which a shadow ray then has to
                  ignore; else -1 */
    vm delta; /* pdf_w is then 1 and no BSDF sample can find the light */
    vf pdf_w; /* per steradian; 0: this sample brings no light */
};

INLINE struct light_samplev light_sample_none(void)
{
    const vf zero = vf_set(0);
    struct light_samplev
        none; /* member by member: compilers clear a whole structure by a loop of bytes */
    none.wi = v3v(zero, zero, zero);
    none.radiance = (rgbv){zero, zero, zero};
    none.distance = none.pdf_w = zero;
    none.sphere = vi_set(-1);
    none.delta = vm_set(false);
    return none;
}

INLINE struct light_samplev light_sample_select(vm mask, const struct light_samplev *yes,
                                                const struct light_samplev *no)
{
    return (struct light_samplev){.wi = v3_select(mask, yes->wi, no->wi),
                                  .distance = vf_select(mask, yes->distance, no->distance),
                                  .radiance = rgb_select(mask, yes->radiance, no->radiance),
                                  .sphere = vi_select(mask, yes->sphere, no->sphere),
                                  .delta = (mask & yes->delta) | (~mask & no->delta),
                                  .pdf_w = vf_select(mask, yes->pdf_w, no->pdf_w)};
}

/* What samples of an area light have in common. */
struct lamp {
    const float *record; /* triangles: of the first */
    int count;
    vf pdf_a;
    rgbv radiance;
    vm both_sides;
};

static inline struct lamp lamp_of(const struct light_table *t, uint32_t l)
{
    const struct light_row *row = &t->row[l];
    return (struct lamp){.record = t->lamp + LAMP_WORDS * (size_t)row->first,
                         .count = (int)t->scene->lights[l].count,
                         .pdf_a = vf_set(row->pdf_a),
                         .radiance = rgb_all(row->radiance),
                         .both_sides = vm_set(row->both_sides)};
}

static inline bool is_lamp(const struct light *light)
{
    return light->kind == LIGHT_TRIANGLES && light->count <= FEW_TRIANGLES && !light->textured;
}

/* Fills a sample of the place `to` on an area light, which is sampled with density pdf_a there. */
INLINE void finish_area_sample(const struct lamp *l, vec3v from, vec3v to, vec3v normal,
                               struct light_samplev *s)
{
    const vf zero = vf_set(0);
    vec3v w = subv(to, from);
    vf d2 = dotv(w, w);
    s->distance = vf_sqrt(d2);
    s->wi = scalev(w, 1 / s->distance);
    vf cosine = dotv(normal, s->wi), cos_l = vf_abs(cosine);
    vm lit = l->both_sides | vf_lt(cosine, zero);
    s->radiance = l->radiance;
    /* Of d2 = 0 comes NaN, which no comparison lets through. */
    lit &= vf_lt(zero, cos_l);
    s->pdf_w = vf_select(lit, l->pdf_a * d2 / cos_l, zero);
}

/* q: corner, edges and normal of each lane's triangle. */
INLINE void sample_triangle(const struct lamp *l, const vf q[LAMP_AREA], vec3v p, const vf u[4],
                            struct light_samplev *out)
{
    vf b1, b2;
    warp_triangle(u[0], u[1], &b1, &b2);
    vec3v to =
        madv(madv(v3v(q[0], q[1], q[2]), b1, v3v(q[3], q[4], q[5])), b2, v3v(q[6], q[7], q[8]));
    finish_area_sample(l, p, to, v3v(q[9], q[10], q[11]), out);
}

/* Samples a light of few triangles. */
INLINE void sample_lamp(const struct lamp *l, vec3v p, const vf u[4], struct light_samplev *out)
{
    const float *r = l->record;
    const vf target = u[2] * r[LAMP_WORDS * (l->count - 1) + LAMP_AREA];
    vf q[LAMP_AREA];
    for (int k = 0; k < LAMP_AREA; k++)
        q[k] = vf_set(r[k]);
    for (int i = 0; i < l->count - 1; i++, r += LAMP_WORDS) {
        vm beyond = vf_le(vf_set(r[LAMP_AREA]), target);
        for (int k = 0; k < LAMP_AREA; k++)
            q[k] = vf_select(beyond, vf_set(r[LAMP_WORDS + k]), q[k]);
    }
    sample_triangle(l, q, p, u, out);
}

/* Index of the triangle, of `count`, in whose part of the cumulative areas the target lies; like discrete_pick(). */
static inline int lamp_search(const float *record, int count, float target)
{
    int at = 0;
    for (int half; count > 1; count -= half) {
        half = count / 2;
        at += half & -(record[LAMP_WORDS * ((size_t)at + (size_t)half - 1) + LAMP_AREA] <= target);
    }
    return at;
}

/* Samples a light of many triangles. number: the sampled triangle of each lane. */
INLINE void sample_mesh(const struct lamp *l, vec3v p, const vf u[4], int32_t number[LANES],
                        struct light_samplev *out)
{
    const float all = l->record[LAMP_WORDS * ((size_t)l->count - 1) + LAMP_AREA];
    vf q[2 * COLUMNS];
    for (int i = 0; i < LANES; i++)
        number[i] = lamp_search(l->record, l->count, LANE(u[2], i) * all);
    for (int i = 0; i < 2; i++)
        gather_columns(l->record + COLUMNS * i, LAMP_WORDS, number, q + COLUMNS * i);
    sample_triangle(l, q, p, u, out);
}

/* Samples a light per lane, for the lanes of the mask whose lights are triangles without a texture. Returns the mask of
 * these lanes. */
INLINE unsigned sample_lamps(const struct light_table *t, const uint32_t light[LANES], vec3v p,
                             const vf u[4], unsigned mask, struct light_samplev *out)
{
    int32_t row[LANES] = {0}, number[LANES] = {0};
    vf w[COLUMNS], q[2 * COLUMNS];
    for (unsigned m = mask; m; m &= m - 1)
        row[__builtin_ctz(m)] = (int32_t)light[__builtin_ctz(m)];
    gather_columns(&t->row->radiance.r, COLUMNS, row, w);
    const vi first = as_vi(w[5]), count = as_vi(w[6]);
    const vf target = u[2] * w[7];
    mask &= bits(vi_lt(vi_set(0), count));
    for (unsigned m = mask; m; m &= m - 1) {
        const int i = __builtin_ctz(m), from = LANE(first, i);
        number[i] = from + lamp_search(t->lamp + LAMP_WORDS * (size_t)from, LANE(count, i),
                                       LANE(target, i));
    }
    for (int i = 0; i < 2; i++)
        gather_columns(t->lamp + COLUMNS * i, LAMP_WORDS, number, q + COLUMNS * i);
    const struct lamp lamp = {
        .radiance = {w[0], w[1], w[2]}, .pdf_a = w[3], .both_sides = vi_lt(as_vi(w[4]), vi_set(0))};
    sample_triangle(&lamp, q, p, u, out);
    return mask;
}

/* Samples a light of triangles with a texture. */
static __attribute__((noinline)) void sample_textured(const struct scene *s,
                                                      const struct light *light,
                                                      const struct lamp *l, vec3v p, const vf u[4],
                                                      unsigned mask, struct light_samplev *out)
{
    int32_t number[LANES];
    vf b1, b2;
    const struct material *m = &s->materials[s->tri_material[light->first]];
    sample_mesh(l, p, u, number, out);
    warp_triangle(u[0], u[1], &b1, &b2);
    for (; mask; mask &= mask - 1) {
        int i = __builtin_ctz(mask);
        rgb texel = scene_map_at(s, m->radiance_map, light->first + (uint32_t)number[i],
                                 LANE(b1, i), LANE(b2, i));
        rgb_set_lane(&out->radiance, i, rgb_mul(m->radiance, texel));
        LANE(out->pdf_w, i) *=
            rgb_is_zero(texel) ? 0 : l->record[LAMP_WORDS * (size_t)number[i] + LAMP_WEIGHT];
    }
}

/* 1 - cos of the half angle that a sphere subtends at squared distance d2 > r2, without the
 * cancellation of forming the cosine. */
INLINE vf cone_one_minus_cos(vf r2, vf d2)
{
    vf sin2 = r2 / d2;
    return sin2 / (1 + vf_sqrt(vf_max(vf_set(0), 1 - sin2)));
}

/* Lanes that are outside the sphere and not so near that the cone becomes a half space. These sample the cone, others
 * the area. */
INLINE vm uses_cone(vf radius, vf d2)
{
    return vf_lt(1.0001f * radius * radius, d2);
}

INLINE void sample_sphere(const struct scene *s, const struct light *light, const struct lamp *l,
                          vec3v p, const vf u[4], unsigned mask, struct light_samplev *out)
{
    const struct sphere *sp = &s->spheres[light->first];
    const vf zero = vf_set(0), radius = vf_set(sp->radius), r2 = radius * radius;
    vec3v to_centre = subv(v3_all(sp->centre), p);
    vf d2 = dotv(to_centre, to_centre);
    vm cone = sp->normal_out > 0 ? uses_cone(radius, d2) : vm_set(false);
    vf one_minus_cos = cone_one_minus_cos(r2, d2);
    framev f = frame_from_normalv(normalizev(to_centre));
    vec3v local = warp_uniform_cone(u[0], u[1], one_minus_cos);
    out->wi = frame_to_worldv(&f, local);
    /* Distance to the near side; at the rim rounding may make the root negative. */
    vf along = vf_sqrt(d2) * local.z;
    out->distance = along - vf_sqrt(vf_max(zero, r2 - d2 * (1 - local.z * local.z)));
    out->radiance = l->radiance;
    out->sphere = vi_set((int32_t)(s->num_triangles + light->first));
    out->pdf_w = warp_uniform_cone_pdf_w(one_minus_cos);
    if (!(mask & ~bits(cone)))
        return;
    struct light_samplev area = light_sample_none();
    vec3v n = warp_uniform_sphere(u[0], u[1]);
    finish_area_sample(l, p, madv(v3_all(sp->centre), radius, n), scalev(n, vf_set(sp->normal_out)),
                       &area);
    *out = light_sample_select(cone, out, &area);
}

/* Samples a point or spot light. */
INLINE void sample_point(const struct light *light, vec3v p, unsigned mask,
                         struct light_samplev *out)
{
    vec3v w = subv(v3_all(light->position), p);
    vf d = vf_sqrt(dotv(w, w)), share = vf_set(1);
    const float *a = light->attenuation;
    vm dark = vf_eq(d, vf_set(0));
    out->wi = scalev(w, 1 / d);
    if (light->kind == LIGHT_SPOT) {
        vf cosine = -dotv(v3_all(light->axis), out->wi);
        dark |= ~vf_lt(vf_set(light->cos_cutoff), cosine);
        share = cosine;
        for (unsigned lit = mask & ~bits(dark); lit; lit &= lit - 1) {
            int i = __builtin_ctz(lit);
            LANE(share, i) = powf(LANE(share, i), light->exponent);
        }
    }
    out->distance = d;
    out->radiance = rgb_scalev(rgb_all(light->value), share / (a[0] + d * (a[1] + d * a[2])));
    out->pdf_w = vf_select(dark, vf_set(0), vf_set(1));
    out->delta = vm_set(true);
}

INLINE void sample_directional(const struct light *light, struct light_samplev *out)
{
    out->wi = v3_all(light->to_light);
    out->distance = vf_set(INFINITY);
    out->radiance = rgb_all(light->value);
    out->pdf_w = vf_set(1);
    out->delta = vm_set(true);
}

/* Turns a sample of ours into that of the assignment's starter code (cs184_deviations.h). */
INLINE void as_starter(const struct scene *s, const struct light *light, const struct lamp *l,
                       vec3v p, struct light_samplev *out)
{
    if (starter_has(s, CS184_TURNED_LAMP) && light->count == 2) {
        vec3v to = madv(p, out->distance, out->wi);
        for (int i = 0; i < LANES; i++)
            v3_set_lane(&to, i, cs184_deviations_turn(s, light, v3_lane(&to, i)));
        const float *ng = l->record + 9;
        finish_area_sample(l, p, to, v3_all(v3(ng[0], ng[1], ng[2])), out);
    }
    if (starter_has(s, CS184_LIGHT_PDF))
        out->pdf_w =
            vf_select(vf_lt(vf_set(0), out->pdf_w), out->pdf_w / out->distance, out->pdf_w);
}

/* Samples light l as seen from p, for the lanes of the mask; other lanes are undefined. n: unit normals there, used by
 * the environment only. u in [0,1)^4. */
INLINE void sample_light_from(const struct light_table *t, uint32_t l, vec3v p, vec3v n,
                              const vf u[4], unsigned mask, struct light_samplev *out)
{
    const struct scene *s = t->scene;
    const struct light *light = &s->lights[l];
    struct lamp lamp;
    *out = light_sample_none();
    switch (light->kind) {
    case LIGHT_TRIANGLES:
        lamp = lamp_of(t, l);
        if (is_lamp(light))
            sample_lamp(&lamp, p, u, out);
        else if (light->textured)
            sample_textured(s, light, &lamp, p, u, mask, out);
        else
            sample_mesh(&lamp, p, u, (int32_t[LANES]){0}, out);
        if (s->starter != 0)
            as_starter(s, light, &lamp, p, out);
        return;
    case LIGHT_SPHERE:
        lamp = lamp_of(t, l);
        sample_sphere(s, light, &lamp, p, u, mask, out);
        return;
    case LIGHT_POINT:
    case LIGHT_SPOT: sample_point(light, p, mask, out); return;
    case LIGHT_DIRECTIONAL: sample_directional(light, out); return;
    case LIGHT_ENVIRONMENT:
        out->distance = vf_set(INFINITY);
        sample_environment_from(s->environment, n, u, mask, &out->wi, &out->radiance, &out->pdf_w);
        return;
    }
}

/* Density, per steradian at p, with which sampling the area lights `light` would give the unit directions wi, which hit
 * primitives `prim` with normals ng at the distances d; for the lanes of the mask. */
INLINE vf pdf_of_light(const struct light_table *t, const int32_t light[LANES],
                       const uint32_t prim[LANES], vec3v p, vec3v wi, vf d, vec3v ng, unsigned mask)
{
    const struct scene *s = t->scene;
    const vf zero = vf_set(0);
    vf area = vf_set(1), radius = zero;
    vec3v centre = {zero, zero, zero};
    unsigned round = 0;
    for (; mask; mask &= mask - 1) {
        int i = __builtin_ctz(mask);
        const struct light *l = &s->lights[light[i]];
        LANE(area, i) = l->area;
        if (l->textured)
            LANE(area, i) /= t->lamp[LAMP_WORDS * (size_t)((uint32_t)t->row[light[i]].first +
                                                           prim[i] - l->first) +
                                     LAMP_WEIGHT];
        if (l->kind == LIGHT_SPHERE && s->spheres[l->first].normal_out > 0) {
            round |= 1u << i;
            LANE(radius, i) = s->spheres[l->first].radius;
            v3_set_lane(&centre, i, s->spheres[l->first].centre);
        }
    }
    vf cos_l = vf_abs(dotv(ng, wi));
    vf pdf_w = vf_select(vf_lt(zero, cos_l), d * d / (cos_l * area), zero);
    if (!round)
        return pdf_w;
    vec3v to_centre = subv(centre, p);
    vf d2 = dotv(to_centre, to_centre);
    vf cone = warp_uniform_cone_pdf_w(cone_one_minus_cos(radius * radius, d2));
    return vf_select(lanes_of(round) & uses_cone(radius, d2), cone, pdf_w);
}

#endif
