#include "light.h"

#include "light_simd.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static double triangle_area(const vec3 p[3])
{
    return 0.5 * (double)length(cross(sub(p[1], p[0]), sub(p[2], p[0])));
}

static void fill_record(const vec3 p[3], double weight, double *area, float *r)
{
    vec3 e1 = sub(p[1], p[0]), e2 = sub(p[2], p[0]), ng = normalize(cross(e1, e2));
    *area += weight * triangle_area(p);
    const float words[] = {p->x, p->y, p->z, e1.x, e1.y, e1.z,         e2.x,
                           e2.y, e2.z, ng.x, ng.y, ng.z, (float)*area, (float)weight};
    memcpy(r, words, sizeof words);
}

static const struct material *material_of(const struct scene *s, const struct light *l)
{
    return &s->materials[l->kind == LIGHT_TRIANGLES ? s->tri_material[l->first]
                                                    : s->sphere_material[l->first]];
}

/* Luminance of triangle i of a textured light, a mean. */
static double texture_luminance(const struct scene *s, const struct light *l, uint32_t i)
{
    const struct material *m = material_of(s, l);
    return texture_mean_luminance(&s->textures[m->radiance_map - 1],
                                  s->uv + 3 * (size_t)(l->first + i), m->radiance);
}

/* The same of all its triangles. */
static double light_luminance(const struct scene *s, const struct light *l)
{
    double sum = 0, area = 0;
    if (!l->textured)
        return rgb_luminance(material_of(s, l)->radiance);
    for (uint32_t i = 0; i < l->count; i++) {
        double a = triangle_area(s->position + 3 * (size_t)(l->first + i));
        sum += a * texture_luminance(s, l, i);
        area += a;
    }
    return sum / area;
}

/* How much more often than by its area triangle i is chosen; its mean over the area is 1. mean: light_luminance(). */
static double triangle_weight(const struct scene *s, const struct light *l, uint32_t i, double mean)
{
    return l->textured && mean > 0 ? 0.1 + 0.9 * texture_luminance(s, l, i) / mean : 1;
}

/* Records of the triangles of all lights. */
static bool build_records(struct light_table *t, const struct scene *s)
{
    uint32_t num = 0;
    t->first = calloc((size_t)s->num_lights + 1, sizeof *t->first);
    for (uint32_t l = 0; t->first != NULL && l < s->num_lights; l++) {
        t->first[l] = num;
        num += s->lights[l].kind == LIGHT_TRIANGLES ? s->lights[l].count : 0;
    }
    t->lamp = calloc((size_t)num + 1, LAMP_WORDS * sizeof *t->lamp);
    if (t->first == NULL || t->lamp == NULL)
        return false;
    for (uint32_t l = 0; l < s->num_lights; l++) {
        const struct light *light = &s->lights[l];
        double area = 0, mean = light->textured ? light_luminance(s, light) : 0;
        for (uint32_t i = 0; light->kind == LIGHT_TRIANGLES && i < light->count; i++)
            fill_record(s->position + 3 * (size_t)(light->first + i),
                        triangle_weight(s, light, i, mean), &area,
                        t->lamp + LAMP_WORDS * (size_t)(t->first[l] + i));
    }
    return true;
}

static double light_power(const struct scene *s, const struct light *l)
{
    const double pi = 3.14159265358979323846;
    double r = 0.5 * (double)length(sub(s->bounds_max, s->bounds_min));
    if (scene_num_primitives(s) == 0)
        r = 1; /* nothing is lit, whichever is chosen */
    const double r2 = r * r;
    double falloff = (double)l->attenuation[0] + r * l->attenuation[1] + r2 * l->attenuation[2];
    switch (l->kind) {
    case LIGHT_POINT: return 4 * pi * rgb_luminance(l->value) / falloff * r2;
    case LIGHT_SPOT: {
        double n = (double)l->exponent + 1;
        return 2 * pi * (1 - pow(l->cos_cutoff, n)) / n * rgb_luminance(l->value) / falloff * r2;
    }
    case LIGHT_DIRECTIONAL: return pi * r2 * rgb_luminance(l->value);
    case LIGHT_TRIANGLES:
    case LIGHT_SPHERE: break;
    case LIGHT_ENVIRONMENT: return pi * r2 * environment_total(s->environment);
    }
    const struct material *m = material_of(s, l);
    double mean = light_luminance(s, l);
    /* What the mean has missed must still be chosen some time. */
    if (l->textured)
        mean = fmax(mean, 1e-3 * rgb_luminance(rgb_mul(
                                     m->radiance, texture_max(&s->textures[m->radiance_map - 1]))));
    return (m->radiance_both_sides ? 2 : 1) * pi * (double)l->area * mean;
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
        ok = build_records(t, s);
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
    for (uint32_t l = 0; l < s->num_lights; l++)
        t->num_areas += !light_is_delta(&s->lights[l]);
    return t;
}

void light_table_free(struct light_table *t)
{
    if (t == NULL)
        return;
    free(t->lamp);
    free(t->first);
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

uint32_t light_count_areas(const struct light_table *t)
{
    return t->num_areas;
}

struct light_sample light_sample_direction(const struct light_table *t, uint32_t l, vec3 p,
                                           const float u[4])
{
    struct light_samplev s;
    sample_light_from(t, l, p, u, 1, &s);
    return (struct light_sample){.wi = s.wi,
                                 .distance = s.distance,
                                 .radiance = s.radiance,
                                 .sphere = (uint32_t)s.sphere,
                                 .pdf_w = s.pdf_w,
                                 .delta = s.delta != 0};
}

float light_pdf_w(const struct light_table *t, uint32_t l, uint32_t prim, vec3 p, vec3 wi, float d,
                  const struct surface *hit)
{
    const struct light *light = &t->scene->lights[l];
    assert(light->kind == LIGHT_TRIANGLES || light->kind == LIGHT_SPHERE);
    return pdf_of_light(t, (const int32_t[]){(int32_t)l}, &prim, p, wi, d, hit->ng, 1);
}
