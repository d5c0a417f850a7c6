#include "light.h"

#include "renderer/math/discrete.h"
#include "renderer/scene/environment.h"
#include "renderer/scene/cs184_deviations.h"
#include "renderer/math/warp.h"

#include <assert.h>
#include <stdlib.h>

struct light_table {
    const struct scene *scene;
    float *cdf; /* per triangle: area up to and including it, from its light's first one */
    /* Choices among all lights and among the delta lights; NULL where there is nothing to choose. */
    uint32_t *all, *delta;
    uint32_t num_areas;
};

static void sum_areas(const struct scene *s, float *cdf)
{
    for (uint32_t l = 0; l < s->num_lights; l++) {
        const struct light *light = &s->lights[l];
        if (light->kind != LIGHT_TRIANGLES)
            continue;
        double sum = 0;
        for (uint32_t i = light->first; i < light->first + light->count; i++) {
            const vec3 *p = s->position + 3 * (size_t)i;
            sum += 0.5 * (double)length(cross(sub(p[1], p[0]), sub(p[2], p[0])));
            cdf[i] = (float)sum;
        }
    }
}

static double light_power(const struct scene *s, const struct light *l)
{
    const double pi = 3.14159265358979323846;
    double r = 0.5 * (double)length(sub(s->bounds_max, s->bounds_min)), r2 = r * r;
    double falloff = (double)l->attenuation[0] + r * l->attenuation[1] + r2 * l->attenuation[2];
    const struct material *m = NULL;
    switch (l->kind) {
    case LIGHT_POINT: return 4 * pi * rgb_luminance(l->value) / falloff * r2;
    case LIGHT_SPOT: {
        double n = (double)l->exponent + 1;
        return 2 * pi * (1 - pow(l->cos_cutoff, n)) / n * rgb_luminance(l->value) / falloff * r2;
    }
    case LIGHT_DIRECTIONAL: return pi * r2 * rgb_luminance(l->value);
    case LIGHT_TRIANGLES: m = &s->materials[s->tri_material[l->first]]; break;
    case LIGHT_SPHERE: m = &s->materials[s->sphere_material[l->first]]; break;
    case LIGHT_ENVIRONMENT: return pi * r2 * environment_total(s->environment);
    }
    return (m->radiance_both_sides ? 2 : 1) * pi * (double)l->area * rgb_luminance(m->radiance);
}

/* NULL if none of them has power; *ok false if that is for want of memory. */
static uint32_t *build_choice(const struct scene *s, bool only_delta, double *power, bool *ok)
{
    for (uint32_t l = 0; l < s->num_lights; l++)
        power[l] = only_delta && !light_is_delta(&s->lights[l]) ? 0 : light_power(s, &s->lights[l]);
    uint32_t *end = malloc(((size_t)s->num_lights + 1) * sizeof *end);
    *ok = end != NULL;
    if (*ok && (s->num_lights == 0 || !(discrete_build(power, s->num_lights, end) > 0))) {
        free(end);
        end = NULL;
    }
    return end;
}

struct light_table *light_table_build(const struct scene *s, struct err *e)
{
    if (s->num_lights > DISCRETE_MOST) {
        err_set(e, "more than %d lights", DISCRETE_MOST);
        return NULL;
    }
    struct light_table *t = calloc(1, sizeof *t);
    double *power = malloc(((size_t)s->num_lights + 1) * sizeof *power);
    bool ok = t != NULL && power != NULL;
    if (ok) {
        t->scene = s;
        t->cdf = calloc((size_t)s->num_triangles + 1, sizeof *t->cdf);
        ok = t->cdf != NULL;
    }
    if (ok)
        t->all = build_choice(s, false, power, &ok);
    if (ok)
        t->delta = build_choice(s, true, power, &ok);
    free(power);
    if (!ok) {
        light_table_free(t);
        err_set(e, "out of memory for the lights");
        return NULL;
    }
    sum_areas(s, t->cdf);
    for (uint32_t l = 0; l < s->num_lights; l++)
        t->num_areas += !light_is_delta(&s->lights[l]);
    return t;
}

void light_table_free(struct light_table *t)
{
    if (t == NULL)
        return;
    free(t->cdf);
    free(t->all);
    free(t->delta);
    free(t);
}

struct light_choice light_choose(const struct light_table *t, bool only_delta, float u)
{
    const uint32_t *end = only_delta ? t->delta : t->all;
    if (end == NULL)
        return (struct light_choice){0};
    uint32_t l = discrete_pick(end, t->scene->num_lights, u);
    return (struct light_choice){l, discrete_probability(end, l)};
}

float light_choice_probability(const struct light_table *t, uint32_t l)
{
    return t->all != NULL ? discrete_probability(t->all, l) : 0;
}

const float *light_table_areas(const struct light_table *t)
{
    return t->cdf;
}

uint32_t light_count_areas(const struct light_table *t)
{
    return t->num_areas;
}

/* pdf_w and direction for a place on an area light of density pdf_a there. */
static void finish_area_sample(struct light_sample *s, const struct material *m, vec3 from, vec3 to,
                               vec3 normal, float pdf_a)
{
    vec3 w = sub(to, from);
    float d2 = dot(w, w);
    if (d2 == 0)
        return;
    s->distance = sqrtf(d2);
    s->wi = scale(w, 1 / s->distance);
    float cos_l = fabsf(dot(normal, s->wi));
    s->radiance = emitted_radiance(m, normal, neg(s->wi));
    if (cos_l > 0 && !rgb_is_zero(s->radiance))
        s->pdf_w = pdf_a * d2 / cos_l;
}

static struct light_sample sample_triangles(const struct light_table *t, const struct light *light,
                                            vec3 p, const float u[3])
{
    const struct scene *s = t->scene;
    float target = u[2] * t->cdf[light->first + light->count - 1];
    uint32_t lo = light->first, hi = light->first + light->count - 1;
    while (lo < hi) {
        uint32_t mid = lo + (hi - lo) / 2;
        if (t->cdf[mid] > target)
            hi = mid;
        else
            lo = mid + 1;
    }
    float b1, b2;
    warp_triangle(u[0], u[1], &b1, &b2);
    const vec3 *q = s->position + 3 * (size_t)lo;
    vec3 e1 = sub(q[1], q[0]), e2 = sub(q[2], q[0]);
    struct light_sample out = {.sphere = NO_HIT};
    finish_area_sample(&out, &s->materials[s->tri_material[lo]], p, mad(mad(q[0], b1, e1), b2, e2),
                       normalize(cross(e1, e2)), 1 / light->area);
    return out;
}

/* 1 - cos of the half angle that the sphere subtends at squared distance d2 > r2, without the
 * cancellation of forming the cosine. */
static float cone_one_minus_cos(float r2, float d2)
{
    float sin2 = r2 / d2;
    return sin2 / (1 + sqrtf(maxf(0, 1 - sin2)));
}

/* Outside and not so near that the cone is a half space: there the cone, else the area. */
static bool uses_cone(const struct sphere *sp, float d2)
{
    return sp->normal_out > 0 && d2 > 1.0001f * sp->radius * sp->radius;
}

static struct light_sample sample_sphere(const struct light_table *t, const struct light *light,
                                         vec3 p, const float u[3])
{
    const struct scene *s = t->scene;
    const struct sphere *sp = &s->spheres[light->first];
    const struct material *m = &s->materials[s->sphere_material[light->first]];
    struct light_sample out = {.sphere = NO_HIT};
    vec3 to_centre = sub(sp->centre, p);
    float d2 = dot(to_centre, to_centre), r2 = sp->radius * sp->radius;
    if (!uses_cone(sp, d2)) {
        vec3 n = warp_uniform_sphere(u[0], u[1]);
        finish_area_sample(&out, m, p, mad(sp->centre, sp->radius, n), scale(n, sp->normal_out),
                           1 / light->area);
        return out;
    }
    float one_minus_cos = cone_one_minus_cos(r2, d2);
    frame f = frame_from_normal(normalize(to_centre));
    vec3 local = warp_uniform_cone(u[0], u[1], one_minus_cos);
    out.wi = frame_to_world(&f, local);
    /* Distance to the near side; at the rim rounding may make the root negative. */
    float along = sqrtf(d2) * local.z;
    out.distance = along - sqrtf(maxf(0, r2 - d2 * (1 - local.z * local.z)));
    out.radiance = m->radiance;
    out.sphere = s->num_triangles + light->first;
    out.pdf_w = warp_uniform_cone_pdf_w(one_minus_cos);
    return out;
}

static struct light_sample sample_point(const struct light *light, vec3 p)
{
    struct light_sample out = {.sphere = NO_HIT};
    vec3 w = sub(light->position, p);
    float d = length(w), share = 1;
    if (d == 0)
        return out;
    out.wi = scale(w, 1 / d);
    if (light->kind == LIGHT_SPOT) {
        float cosine = -dot(light->axis, out.wi);
        if (!(cosine > light->cos_cutoff))
            return out;
        share = powf(cosine, light->exponent);
    }
    const float *a = light->attenuation;
    out.distance = d;
    out.radiance = rgb_scale(light->value, share / (a[0] + d * (a[1] + d * a[2])));
    out.pdf_w = 1;
    out.delta = true;
    return out;
}

/* cs184_deviations.h: the sample as the assignment's starter code makes it of ours. */
static struct light_sample as_starter(const struct scene *s, const struct light *light, vec3 p,
                                      struct light_sample ours)
{
    struct light_sample out = ours;
    if (starter_has(s, CS184_TURNED_LAMP) && light->count == 2) {
        const vec3 *q = s->position + 3 * (size_t)light->first;
        out = (struct light_sample){.sphere = NO_HIT};
        finish_area_sample(&out, &s->materials[s->tri_material[light->first]], p,
                           cs184_deviations_turn(s, light, mad(p, ours.distance, ours.wi)),
                           normalize(cross(sub(q[1], q[0]), sub(q[2], q[0]))), 1 / light->area);
    }
    if (starter_has(s, CS184_LIGHT_PDF) && out.pdf_w > 0)
        out.pdf_w /= out.distance;
    return out;
}

struct light_sample light_sample_direction(const struct light_table *t, uint32_t l, vec3 p,
                                           const float u[4])
{
    const struct light *light = &t->scene->lights[l];
    struct light_sample out = {.sphere = NO_HIT};
    switch (light->kind) {
    case LIGHT_POINT:
    case LIGHT_SPOT: out = sample_point(light, p); break;
    case LIGHT_DIRECTIONAL:
        out = (struct light_sample){.sphere = NO_HIT,
                                    .wi = light->to_light,
                                    .distance = INFINITY,
                                    .radiance = light->value,
                                    .pdf_w = 1,
                                    .delta = true};
        break;
    case LIGHT_TRIANGLES: out = sample_triangles(t, light, p, u); break;
    case LIGHT_SPHERE: out = sample_sphere(t, light, p, u); break;
    case LIGHT_ENVIRONMENT: {
        struct environment_sample s = environment_sample_direction(t->scene->environment, u);
        out.wi = s.wi;
        out.distance = INFINITY;
        out.radiance = s.radiance;
        out.pdf_w = s.pdf_w;
        break;
    }
    }
    if (t->scene->starter != 0 && light->kind == LIGHT_TRIANGLES)
        out = as_starter(t->scene, light, p, out);
    return out;
}

float light_pdf_w(const struct light_table *t, uint32_t l, vec3 p, vec3 wi, float d,
                  const struct surface *hit)
{
    const struct light *light = &t->scene->lights[l];
    assert(light->kind == LIGHT_TRIANGLES || light->kind == LIGHT_SPHERE);
    if (light->kind == LIGHT_SPHERE) {
        const struct sphere *sp = &t->scene->spheres[light->first];
        vec3 to_centre = sub(sp->centre, p);
        float d2 = dot(to_centre, to_centre);
        if (uses_cone(sp, d2))
            return warp_uniform_cone_pdf_w(cone_one_minus_cos(sp->radius * sp->radius, d2));
    }
    float cos_l = fabsf(dot(hit->ng, wi));
    return cos_l > 0 ? d * d / (cos_l * light->area) : 0;
}
