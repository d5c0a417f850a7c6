#include "scene.h"

#include "environment.h"
#include "renderer/math/mat4.h"

#include <assert.h>
#include <float.h>
#include <stdlib.h>
#include <string.h>

/* Largest magnitude of a texture coordinate. */
#define MOST_UV 1e6f

void scene_free(struct scene *s)
{
    free(s->position);
    free(s->normal);
    free(s->tri_material);
    free(s->tri_object);
    free(s->tri_light);
    free(s->spheres);
    free(s->sphere_material);
    free(s->sphere_object);
    free(s->sphere_light);
    free(s->materials);
    free(s->lights);
    free(s->objects);
    for (uint32_t i = 0; i < s->num_images; i++)
        image_free(&s->images[i]);
    free(s->images);
    free(s->textures);
    free(s->uv);
    free(s->cameras);
    for (uint32_t i = 0; i < s->num_documents; i++)
        free(s->documents[i]);
    free(s->documents);
    environment_free(s->environment);
    memset(s, 0, sizeof *s);
}

static bool finite3(vec3 v)
{
    return isfinite(v.x) && isfinite(v.y) && isfinite(v.z);
}

static bool is_unit(vec3 v)
{
    return fabsf(length(v) - 1) < 1e-3f;
}

/* Finite and not negative. */
static bool is_radiometric(rgb c)
{
    return c.r >= 0 && c.g >= 0 && c.b >= 0 && isfinite(c.r) && isfinite(c.g) && isfinite(c.b);
}

static bool material_numbers_are_valid(const struct material *m)
{
    const int kind = 1 << m->kind;
    return (!(kind & MATERIAL_REFRACTS) || (m->ior >= 1 / MAX_IOR && m->ior <= MAX_IOR)) &&
           (!(kind & MATERIAL_IS_ROUGH) ||
            (m->alpha >= MICROFACET_MIN_ALPHA && isfinite(m->alpha))) &&
           is_radiometric(m->eta) && is_radiometric(m->k);
}

/* The largest value that a colour takes where a texture multiplies it. If any texel is negative or not
 * a number, the product with the least one is returned, so that the caller's check fails. */
static rgb largest(const struct scene *s, rgb factor, uint32_t map)
{
    if (map == 0)
        return factor;
    const rgb low = texture_min(&s->textures[map - 1]), high = texture_max(&s->textures[map - 1]);
    return rgb_mul(factor, is_radiometric(low) ? high : low);
}

/* Checks the colours that maps give, and that only matt materials have a reflectance map. */
static bool check_maps(const struct scene *s, const struct material *m, const char *where,
                       struct err *e)
{
    if (m->reflectance_map > s->num_textures || m->radiance_map > s->num_textures ||
        (m->reflectance_map != 0 && !(1 << m->kind & MATERIAL_IS_MATT)) || s->uv == NULL)
        return err_set(e, "%s: material '%s': a texture that is not there, or not diffuse", where,
                       m->name);
    rgb reflectance = largest(s, m->reflectance, m->reflectance_map);
    if (!is_radiometric(reflectance) || rgb_max(reflectance) > 1)
        return err_set(e, "%s: material '%s': reflectance outside [0,1] in its texture", where,
                       m->name);
    return is_radiometric(largest(s, m->radiance, m->radiance_map)) ||
           err_set(e, "%s: material '%s': radiance negative or not finite in its texture", where,
                   m->name);
}

static bool check_materials(const struct scene *s, const char *where, struct err *e)
{
    for (uint32_t i = 0; i < s->num_materials; i++) {
        const struct material *m = &s->materials[i];
        if (!is_radiometric(m->reflectance) || rgb_max(m->reflectance) > 1)
            return err_set(e, "%s: material '%s': reflectance outside [0,1]", where, m->name);
        if (!is_radiometric(m->specular) || rgb_max(m->specular) > 1 ||
            !is_radiometric(m->mirror) || rgb_max(m->mirror) > 1)
            return err_set(e, "%s: material '%s': highlight or mirror image outside [0,1]", where,
                           m->name);
        if (!is_radiometric(m->transmittance) || rgb_max(m->transmittance) > 1)
            return err_set(e, "%s: material '%s': transmittance outside [0,1]", where, m->name);
        if (!material_numbers_are_valid(m))
            return err_set(e, "%s: material '%s': index of refraction or roughness out of range",
                           where, m->name);
        if (!is_radiometric(m->radiance))
            return err_set(e, "%s: material '%s': radiance negative or not finite", where, m->name);
        if (material_has_map(m) && !check_maps(s, m, where, e))
            return false;
    }
    return true;
}

static bool check_point(const struct light *l, uint32_t i, const char *where, struct err *e)
{
    const float *a = l->attenuation;
    if (!finite3(l->position))
        return err_set(e, "%s: light %u: position not finite", where, i);
    if (!(a[0] >= 0 && a[1] >= 0 && a[2] >= 0 && a[0] + a[1] + a[2] > 0 &&
          isfinite(a[0] + a[1] + a[2])))
        return err_set(e, "%s: light %u: attenuation negative, zero or not finite", where, i);
    return true;
}

/* Checks all lights that are not primitives, finds the environment's and counts the dark ones. */
static bool check_lights(struct scene *s, const char *where, struct err *e)
{
    s->environment_light = -1;
    s->num_dark_lights = 0;
    for (uint32_t i = 0; i < s->num_lights; i++) {
        const struct light *l = &s->lights[i];
        if (!is_radiometric(l->value))
            return err_set(e, "%s: light %u: value negative or not finite", where, i);
        s->num_dark_lights += l->kind != LIGHT_ENVIRONMENT && rgb_is_zero(l->value);
        switch (l->kind) {
        case LIGHT_DIRECTIONAL:
            if (!is_unit(l->to_light))
                return err_set(e, "%s: light %u: direction not of unit length", where, i);
            break;
        case LIGHT_SPOT:
            if (!is_unit(l->axis))
                return err_set(e, "%s: light %u: direction not of unit length", where, i);
            if (!(l->cos_cutoff >= 0 && l->cos_cutoff < 1 && l->exponent >= 0) ||
                !isfinite(l->exponent))
                return err_set(e, "%s: light %u: cone or exponent out of range", where, i);
            if (!check_point(l, i, where, e))
                return false;
            break;
        case LIGHT_POINT:
            if (!check_point(l, i, where, e))
                return false;
            break;
        case LIGHT_ENVIRONMENT:
            if (s->environment_light >= 0 || s->environment == NULL)
                return err_set(e, "%s: light %u: more than one environment, or none", where, i);
            s->environment_light = (int32_t)i;
            break;
        case LIGHT_TRIANGLES:
        case LIGHT_SPHERE: assert(false); break;
        }
    }
    if (s->environment != NULL && s->environment_light < 0)
        return err_set(e, "%s: an environment that is no light", where);
    return true;
}

/* Checks that objects own contiguous runs of primitives, in order and without gaps. */
static bool check_objects(const struct scene *s, const char *where, struct err *e)
{
    uint64_t triangles = 0, spheres = 0;
    for (uint32_t i = 0; i < s->num_objects; i++) {
        const struct object *o = &s->objects[i];
        if (o->material >= s->num_materials)
            return err_set(e, "%s: object '%s': no material %u", where, o->name, o->material);
        if (o->first_triangle != triangles || o->first_sphere != spheres)
            return err_set(e, "%s: object '%s': its primitives do not follow the last object's",
                           where, o->name);
        if (o->num_spheres > 0 && material_has_map(&s->materials[o->material]))
            return err_set(e, "%s: object '%s': a texture on a sphere", where, o->name);
        triangles += o->num_triangles;
        spheres += o->num_spheres;
    }
    if (triangles != s->num_triangles || spheres != s->num_spheres)
        return err_set(e, "%s: objects and primitives differ in number", where);
    return true;
}

static bool check_owner(const struct scene *s, uint32_t object, uint32_t material, bool in_run,
                        const char *what, uint32_t i, const char *where, struct err *e)
{
    if (object >= s->num_objects || !in_run)
        return err_set(e, "%s: %s %u: not of object %u", where, what, i, object);
    if (material != s->objects[object].material)
        return err_set(e, "%s: %s %u: not the material of its object", where, what, i);
    return true;
}

static bool check_primitives(const struct scene *s, const char *where, struct err *e)
{
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        uint32_t id = s->tri_object[i];
        const struct object *o = &s->objects[id < s->num_objects ? id : 0];
        bool in_run = i - o->first_triangle < o->num_triangles;
        if (!check_owner(s, id, s->tri_material[i], in_run, "triangle", i, where, e))
            return false;
        for (size_t k = 3 * (size_t)i; k < 3 * (size_t)i + 3; k++) {
            if (!finite3(s->position[k]))
                return err_set(e, "%s: triangle %u: position not finite", where, i);
            if (!is_unit(s->normal[k]))
                return err_set(e, "%s: triangle %u: normal not of unit length", where, i);
            if (s->uv != NULL && !(fabsf(s->uv[k].u) <= MOST_UV && fabsf(s->uv[k].v) <= MOST_UV))
                return err_set(e, "%s: triangle %u: texture coordinate beyond %g", where, i,
                               (double)MOST_UV);
        }
    }
    for (uint32_t i = 0; i < s->num_spheres; i++) {
        uint32_t id = s->sphere_object[i];
        const struct object *o = &s->objects[id < s->num_objects ? id : 0];
        bool in_run = i - o->first_sphere < o->num_spheres;
        if (!check_owner(s, id, s->sphere_material[i], in_run, "sphere", i, where, e))
            return false;
        const struct sphere *sp = &s->spheres[i];
        if (!finite3(sp->centre) || !(sp->radius > 0) || !isfinite(sp->radius))
            return err_set(e, "%s: sphere %u: centre or radius not finite, or radius not positive",
                           where, i);
        if (fabsf(sp->normal_out) != 1)
            return err_set(e, "%s: sphere %u: normal_out is not +1 or -1", where, i);
    }
    return true;
}

static void find_bounds(struct scene *s)
{
    vec3 lo = v3(FLT_MAX, FLT_MAX, FLT_MAX), hi = neg(lo);
    if (scene_num_primitives(s) == 0)
        lo = hi = v3(0, 0, 0);
    for (uint32_t i = 0; i < scene_num_primitives(s); i++) {
        vec3 its_lo, its_hi;
        scene_primitive_bounds(s, i, &its_lo, &its_hi);
        lo = vmin(lo, its_lo);
        hi = vmax(hi, its_hi);
    }
    s->bounds_min = s->frame_min = lo;
    s->bounds_max = s->frame_max = hi;
}

static double triangle_area(const vec3 *p)
{
    const dvec3 o = d3_of(p[0]);
    return 0.5 * d3_length(d3_cross(d3_sub(d3_of(p[1]), o), d3_sub(d3_of(p[2]), o)));
}

/* Appends the lights of all emissive objects to s->lights, which has room for them. */
static bool append_area_lights(struct scene *s, const char *where, struct err *e)
{
    for (uint32_t i = 0; i < s->num_objects; i++) {
        const struct object *o = &s->objects[i];
        if (rgb_is_zero(s->materials[o->material].radiance))
            continue;
        double area = 0;
        for (uint32_t t = o->first_triangle; t < o->first_triangle + o->num_triangles; t++) {
            area += triangle_area(s->position + 3 * (size_t)t);
            s->tri_light[t] = (int32_t)s->num_lights;
        }
        if (o->num_triangles > 0) {
            if (!(area > 0) || !(area <= FLT_MAX))
                return err_set(e, "%s: object '%s': emits, but its area is %g", where, o->name,
                               area);
            s->lights[s->num_lights++] =
                (struct light){.kind = LIGHT_TRIANGLES,
                               .first = o->first_triangle,
                               .count = o->num_triangles,
                               .area = (float)area,
                               .textured = s->materials[o->material].radiance_map != 0};
        }
        for (uint32_t k = o->first_sphere; k < o->first_sphere + o->num_spheres; k++) {
            double r = s->spheres[k].radius, sphere_area = 4 * M_PI * r * r;
            if (!(sphere_area <= FLT_MAX))
                return err_set(e, "%s: object '%s': emits, but its area is %g", where, o->name,
                               sphere_area);
            s->sphere_light[k] = (int32_t)s->num_lights;
            s->lights[s->num_lights++] = (struct light){
                .kind = LIGHT_SPHERE, .first = k, .count = 1, .area = (float)sphere_area};
        }
    }
    return true;
}

/* Allocates tri_light, sphere_light, and room in lights for all area lights. False if out of memory. */
static bool make_room(struct scene *s)
{
    size_t most_lights = (size_t)s->num_lights + s->num_objects + s->num_spheres;
    struct light *lights = realloc(s->lights, (most_lights + 1) * sizeof *lights);
    if (lights == NULL)
        return false;
    s->lights = lights;
    free(s->tri_light);
    free(s->sphere_light);
    s->tri_light = malloc(((size_t)s->num_triangles + 1) * sizeof *s->tri_light);
    s->sphere_light = malloc(((size_t)s->num_spheres + 1) * sizeof *s->sphere_light);
    return s->tri_light != NULL && s->sphere_light != NULL;
}

bool scene_finish(struct scene *s, const char *where, struct err *e)
{
    if (s->num_objects > INT32_MAX / 2 || s->num_spheres > INT32_MAX / 2 ||
        s->num_lights > INT32_MAX / 2 || s->num_triangles > UINT32_MAX / 4)
        return err_set(e, "%s: too many primitives", where);
    if (!check_materials(s, where, e) || !check_lights(s, where, e) ||
        !check_objects(s, where, e) || !check_primitives(s, where, e))
        return false;
    if (!make_room(s))
        return err_set(e, "%s: out of memory", where);
    for (uint32_t i = 0; i < s->num_triangles; i++)
        s->tri_light[i] = -1;
    for (uint32_t i = 0; i < s->num_spheres; i++)
        s->sphere_light[i] = -1;
    if (!append_area_lights(s, where, e))
        return false;
    find_bounds(s);
    return true;
}

bool scene_choose_camera(struct scene *s, const char *name)
{
    for (uint32_t i = 0; i < s->num_cameras; i++)
        if (strcmp(s->cameras[i].name, name) == 0) {
            s->camera = s->cameras[i];
            return true;
        }
    return false;
}

bool scene_add_environment(struct scene *s, struct environment *env, struct err *e)
{
    if (s->environment != NULL)
        return err_set(e, "the scene has an environment of its own: its ambient light");
    struct light *lights = realloc(s->lights, ((size_t)s->num_lights + 1) * sizeof *lights);
    if (lights == NULL)
        return err_set(e, "out of memory");
    s->lights = lights;
    s->environment = env;
    s->environment_light = (int32_t)s->num_lights;
    lights[s->num_lights++] = (struct light){.kind = LIGHT_ENVIRONMENT};
    return true;
}

bool scene_read_environment(struct scene *s, const char *path, struct err *e)
{
    struct environment *env = environment_read(path, e);
    if (env == NULL)
        return false;
    if (scene_add_environment(s, env, e))
        return true;
    environment_free(env);
    return err_prefix(e, "%s", path);
}

bool material_is_black(const struct material *m)
{
    return !m->conductor && rgb_is_zero(m->reflectance) && rgb_is_zero(m->transmittance) &&
           rgb_is_zero(m->specular) && rgb_is_zero(m->mirror);
}
