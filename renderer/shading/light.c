#include "light.h"

#include "light_simd.h"
#include "renderer/math/discrete.h"

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

/* Mean luminance of triangle i of a textured light. */
static double texture_luminance(const struct scene *s, const struct light *l, uint32_t i)
{
    const struct material *m = material_of(s, l);
    return texture_mean_luminance(&s->textures[m->radiance_map - 1],
                                  s->uv + 3 * (size_t)(l->first + i), m->radiance);
}

/* Mean luminance of an area light over its area. */
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

/* Factor by which triangle i is chosen more often than in proportion to its area; its mean over the area is 1. mean:
 * light_luminance(). */
static double triangle_weight(const struct scene *s, const struct light *l, uint32_t i, double mean)
{
    return l->textured && mean > 0 ? 0.1 + 0.9 * texture_luminance(s, l, i) / mean : 1;
}

/* Fills a row for each light and a record for each triangle of the lights. False if out of memory. */
static bool build_records(struct light_table *t, const struct scene *s)
{
    uint32_t num = 0;
    t->row = calloc((size_t)s->num_lights + 1, sizeof *t->row);
    for (uint32_t l = 0; t->row != NULL && l < s->num_lights; l++) {
        t->row[l].first = (int32_t)num;
        num += s->lights[l].kind == LIGHT_TRIANGLES ? s->lights[l].count : 0;
    }
    t->lamp = calloc((size_t)num + 1, LAMP_WORDS * sizeof *t->lamp);
    if (t->row == NULL || t->lamp == NULL)
        return false;
    for (uint32_t l = 0; l < s->num_lights; l++) {
        const struct light *light = &s->lights[l];
        struct light_row *row = &t->row[l];
        double area = 0, mean = light->textured ? light_luminance(s, light) : 0;
        for (uint32_t i = 0; light->kind == LIGHT_TRIANGLES && i < light->count; i++)
            fill_record(s->position + 3 * (size_t)(light->first + i),
                        triangle_weight(s, light, i, mean), &area,
                        t->lamp + LAMP_WORDS * ((size_t)row->first + i));
        if (light_is_delta(light) || light->kind == LIGHT_ENVIRONMENT)
            continue;
        const struct material *m = material_of(s, light);
        row->radiance = m->radiance;
        row->pdf_a = 1 / light->area;
        row->both_sides = -m->radiance_both_sides;
        row->area = (float)area;
        row->untextured =
            light->kind == LIGHT_TRIANGLES && !light->textured ? (int32_t)light->count : 0;
    }
    return true;
}

/* Bounds of a light's triangles: their sphere, the cone of their normals, and their value along its axis. */
static void bound_triangles(const struct scene *s, const struct light *l, struct light_bounds *b)
{
    const vec3 *p = s->position + 3 * (size_t)l->first;
    vec3 least = p[0], most = p[0], facing = {0, 0, 0};
    for (uint32_t i = 0; i < l->count; i++) {
        for (int k = 0; k < 3; k++) {
            least = vmin(least, p[3 * i + (uint32_t)k]);
            most = vmax(most, p[3 * i + (uint32_t)k]);
        }
        facing = mad(facing, 0.5f / l->area,
                     cross(sub(p[3 * i + 1], p[3 * i]), sub(p[3 * i + 2], p[3 * i])));
    }
    const float flat = length(facing);
    b->centre = scale(add(least, most), 0.5f);
    b->axis = flat > 0 ? scale(facing, 1 / flat) : b->axis;
    for (uint32_t i = 0; i < 3 * l->count; i++)
        b->radius = maxf(b->radius, length(sub(p[i], b->centre)));
    /* Mean projected area: a quarter of a closed surface, half of a sheet that emits on both sides. */
    const bool both_sides = material_of(s, l)->radiance_both_sides;
    b->value *= both_sides ? 0.5 : (double)maxf(flat, 0.25f);
    b->angle = both_sides || !(flat > 0) ? PI_F : 0;
    for (uint32_t i = 0; b->angle < PI_F && i < l->count; i++) {
        const vec3 ng = normalize(cross(sub(p[3 * i + 1], p[3 * i]), sub(p[3 * i + 2], p[3 * i])));
        b->angle = maxf(b->angle, acosf(maxf(-1, minf(1, dot(b->axis, ng)))));
    }
}

/* Bounds for choosing among lights. Their value is the luminance of the light's irradiance on a surface that faces it,
 * before the falloff. */
static struct light_bounds light_bounds(const struct scene *s, const struct light *l)
{
    struct light_bounds b = {.near = true,
                             .centre = l->position,
                             .axis = {0, 0, 1},
                             .angle = PI_F,
                             .even = 1,
                             .falloff = {l->attenuation[0], l->attenuation[1], l->attenuation[2]},
                             .value = rgb_luminance(l->value)};
    switch (l->kind) {
    case LIGHT_POINT: return b;
    case LIGHT_SPOT:
        b.axis = l->axis;
        b.angle = 0;
        b.reach = l->cos_cutoff;
        b.even = maxf(0, 1 - l->exponent);
        return b;
    case LIGHT_DIRECTIONAL:
    case LIGHT_ENVIRONMENT:
        b.near = false;
        b.falloff[0] = 1;
        b.falloff[1] = b.falloff[2] = 0;
        b.centre = l->to_light;
        if (l->kind == LIGHT_ENVIRONMENT) {
            /* All around, where cluster_weight() is sqrt(2) value; a plane receives a quarter on average. */
            b.value = environment_total(s->environment) / 4 / sqrt(2);
            b.radius = 2;
        }
        return b;
    case LIGHT_TRIANGLES:
    case LIGHT_SPHERE: break;
    }
    const struct material *m = material_of(s, l);
    double mean = light_luminance(s, l);
    /* Bright texels that the mean has missed must keep some probability. */
    if (l->textured)
        mean = fmax(mean, 1e-3 * rgb_luminance(rgb_mul(
                                     m->radiance, texture_max(&s->textures[m->radiance_map - 1]))));
    b.falloff[0] = b.falloff[1] = 0;
    b.falloff[2] = 1;
    b.value = (double)l->area * mean;
    if (l->kind == LIGHT_TRIANGLES) {
        b.even = 0;
        bound_triangles(s, l, &b);
    } else {
        b.centre = s->spheres[l->first].centre;
        b.radius = s->spheres[l->first].radius;
        b.value /= 4;
    }
    return b;
}

/* Clusters of all lights, or of the delta lights only; NULL if out of memory. */
static struct light_clusters *build_choice(const struct scene *s, bool only_delta)
{
    struct light_bounds *b = malloc(((size_t)s->num_lights + 1) * sizeof *b);
    struct light_clusters *t = NULL;
    for (uint32_t l = 0; b != NULL && l < s->num_lights; l++) {
        b[l] = light_bounds(s, &s->lights[l]);
        if (only_delta && !light_is_delta(&s->lights[l]))
            b[l].value = 0;
    }
    if (b != NULL)
        t = light_clusters_build(b, s->num_lights);
    free(b);
    return t;
}

struct light_table *light_table_build(const struct scene *s, struct err *e)
{
    if (s->num_lights > DISCRETE_MOST) {
        err_set(e, "more than %d lights", DISCRETE_MOST);
        return NULL;
    }
    struct light_table *t = calloc(1, sizeof *t);
    if (t != NULL)
        t->scene = s;
    if (t == NULL || !build_records(t, s) || (t->all = build_choice(s, false)) == NULL ||
        (t->delta = build_choice(s, true)) == NULL) {
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
    free(t->row);
    light_clusters_free(t->all);
    light_clusters_free(t->delta);
    free(t);
}

uint32_t light_count_areas(const struct light_table *t)
{
    return t->num_areas;
}
