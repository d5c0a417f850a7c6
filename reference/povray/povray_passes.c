#include "povray_passes.h"

#include "povray_glass.h"
#include "povray_lamp.h"
#include "povray_texture.h"

#include "reference/suite/features.h"
#include "renderer/scene/environment.h"

#include <assert.h>
#include <gsl/gsl_math.h>

/* Furnaces agree to 3e-5 up to this depth; larger ones are untested. */
#define MAX_RECURSION 20
/* max_trace_level: mirrors and glass agree up to here, at 250 POV-Ray runs out of stack. */
#define MAX_LEVELS 60
/* POV-Ray ignores hits nearer than 1e-4, shadows nearer than 1e-3 and anything beyond 1e7. Extents
 * of 0.05 to 5e5 were seen to be right; at 5e-3 direct light was 9 % wrong. */
#define MIN_EXTENT 0.05
#define MAX_REACH  1e6

static vec3 face_normal(const vec3 *p)
{
    return normalize(cross(sub(p[1], p[0]), sub(p[2], p[0])));
}

static bool reflects(const struct material *m)
{
    return !material_is_black(m);
}

static bool reflects_or_glows(const struct material *m)
{
    return reflects(m) || !rgb_is_zero(m->radiance);
}

/* Do all surfaces for which counted() holds lie in one plane? A plane does not see itself, so it has no indirect
 * light. */
static bool is_one_plane(const struct scene *s, double extent,
                         bool (*counted)(const struct material *))
{
    for (uint32_t i = 0; i < s->num_spheres; i++)
        if (counted(&s->materials[s->sphere_material[i]]))
            return false;
    vec3 n = {0}, o = {0};
    bool found = false;
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        if (!counted(&s->materials[s->tri_material[i]]))
            continue;
        const vec3 *p = &s->position[3 * (size_t)i];
        if (!found) {
            n = face_normal(p);
            o = p[0];
            found = true;
        }
        for (int k = 0; k < 3; k++)
            if (fabsf(dot(n, sub(p[k], o))) > 1e-6 * extent)
                return false;
    }
    return true;
}

static bool check_material(const struct material *m, struct err *e)
{
    const unsigned expressed = 1u << MATERIAL_DIFFUSE | 1u << MATERIAL_MIRROR |
                               1u << MATERIAL_REFRACTION | 1u << MATERIAL_GLASS;
    if (!(1u << m->kind & expressed))
        return err_set(e, "POV-Ray does not have %s (material '%s')",
                       features_material_names[m->kind], m->name);
    if (m->kind != MATERIAL_DIFFUSE)
        return true;
    rgb a = m->reflectance, l = m->radiance;
    if (reflects(m) && !material_has_map(m) &&
        ((a.r == 0 && l.r > 0) || (a.g == 0 && l.g > 0) || (a.b == 0 && l.b > 0)))
        return err_set(
            e, "POV-Ray cannot express material '%s': it emits a colour it does not reflect",
            m->name);
    return true;
}

static bool check_camera(const struct scene *s, const struct camera *c, double extent,
                         struct err *e)
{
    double nearest, farthest;
    features_distances(s, c, &nearest, &farthest);
    if (c->is_orthographic)
        return err_set(e, "POV-Ray: an orthographic camera is not verified");
    if (c->lens_radius > 0)
        return err_set(e, "POV-Ray's depth of field is not verified: the lens must be a pinhole");
    if (c->filter.radius > 0)
        return err_set(e, "POV-Ray: a pixel filter other than the box of one pixel");
    if (!(extent >= MIN_EXTENT && fmax(extent, farthest) <= MAX_REACH))
        return err_set(
            e,
            "POV-Ray's fixed tolerances show: the scene spans %.3g and reaches %.3g from "
            "the eye, not at least %g and at most %g",
            extent, farthest, MIN_EXTENT, MAX_REACH);
    return features_check_clipping("POV-Ray", s, c, e);
}

/* Which kinds of reflecting objects and of lights a scene contains. */
struct census {
    bool diffuse, specular;
    bool sources; /* point, spot, directional lights and lamps */
    bool glow;    /* emitters that are not lamps, and the environment */
    int lamps;
};

static void count_materials(const struct scene *s, struct census *n)
{
    for (uint32_t i = 0; i < s->num_objects; i++) {
        const struct material *m = &s->materials[s->objects[i].material];
        n->diffuse |= reflects(m) && m->kind == MATERIAL_DIFFUSE;
        n->specular |= reflects(m) && m->kind != MATERIAL_DIFFUSE;
    }
}

static bool plan_falloff(const struct light *l, struct povray_passes *p, struct err *e)
{
    bool constant = l->attenuation[0] > 0 && l->attenuation[1] == 0 && l->attenuation[2] == 0;
    bool square = l->attenuation[0] == 0 && l->attenuation[1] == 0 && l->attenuation[2] > 0;
    if (!constant && !square)
        return err_set(e, "POV-Ray cannot express a light whose falloff is neither constant nor "
                          "purely quadratic");
    double r = 0.5 * p->extent;
    double falloff = constant ? (double)l->attenuation[0] : (double)l->attenuation[2] * r * r;
    p->radiance = fmax(p->radiance, (double)rgb_max(l->value) / falloff / M_PI);
    return true;
}

static bool plan_environment(const struct environment *env, struct povray_passes *p, struct err *e)
{
    struct environment_parts sky = environment_parts(env);
    if (environment_is_hidden(env))
        return err_set(e, "POV-Ray cannot express ambient light that only diffuse surfaces see");
    if (sky.width > POVRAY_MOST_TEXELS || sky.height > POVRAY_MOST_TEXELS)
        return err_set(e, "POV-Ray: the environment is %u x %u, of which 254 x 254 is the most",
                       sky.width, sky.height);
    p->radiance = fmax(p->radiance, (double)rgb_max(sky.radiance));
    for (size_t i = 0; i < (size_t)sky.width * sky.height; i++)
        p->radiance = fmax(p->radiance, (double)rgb_max(sky.texel[i]));
    return true;
}

static bool plan_lights(const struct scene *s, struct povray_passes *p, struct census *n,
                        struct err *e)
{
    for (uint32_t i = 0; i < s->num_lights; i++) {
        const struct light *l = &s->lights[i];
        struct povray_lamp lamp;
        switch (l->kind) {
        case LIGHT_POINT:
        case LIGHT_SPOT:
            if (!plan_falloff(l, p, e))
                return false;
            n->sources = true;
            break;
        case LIGHT_DIRECTIONAL:
            p->radiance = fmax(p->radiance, (double)rgb_max(l->value) / M_PI);
            n->sources = true;
            break;
        case LIGHT_ENVIRONMENT:
            if (!plan_environment(s->environment, p, e))
                return false;
            n->glow = true;
            break;
        case LIGHT_TRIANGLES:
        case LIGHT_SPHERE: {
            bool ball = l->kind == LIGHT_SPHERE;
            uint32_t material = ball ? s->sphere_material[l->first] : s->tri_material[l->first];
            if (povray_lamp(s, l, &lamp))
                n->lamps++;
            else
                n->glow = true;
            const struct material *m = &s->materials[material];
            rgb most =
                m->radiance_map != 0 ? texture_max(&s->textures[m->radiance_map - 1]) : grey(1);
            p->radiance = fmax(p->radiance, (double)rgb_max(rgb_mul(m->radiance, most)));
            break;
        }
        }
    }
    n->sources |= n->lamps > 0;
    p->num_lamps = n->lamps;
    if (p->radiance == 0)
        p->radiance = 1;
    return true;
}

/* surfaces: how many the longest path has, the emitting one included. After its j-th diffuse surface a
 * path is at trace level 3j/2 and has at most surfaces - 1 - j mirrors ahead of it. */
static void set_levels(struct povray_pass *pass, bool specular, int surfaces)
{
    pass->levels = specular ? surfaces : MAX_LEVELS;
    pass->bailout_indirect =
        specular && pass->recursion > 0 ? fmin(1e-4, 0.2 * exp2(-pass->recursion)) : 1e-9;
    pass->levels_indirect =
        specular && pass->recursion > 0 ? surfaces + surfaces / 2 : pass->levels;
}

static void plan_passes(const struct scene *s, const struct census *n, int depth,
                        struct povray_passes *p)
{
    struct povray_pass lit = {.sources = true}, seen = {.glow = true};
    bool lone = is_one_plane(s, p->extent, reflects);
    bool flat = s->environment == NULL && is_one_plane(s, p->extent, reflects_or_glows);
    if (depth > 1 && !lone)
        lit.recursion = depth - 1;
    if (n->diffuse && n->glow && !flat)
        seen.recursion = depth;
    else if (n->diffuse && n->specular && n->lamps > 0 && depth > 1)
        seen.recursion =
            depth - 1; /* the last surface is a mirror or glass; else the lamp was sampled */
    bool needs_lit = n->sources && n->diffuse && depth > 0;
    bool needs_seen = !needs_lit || n->glow || n->lamps > 0;
    set_levels(&lit, n->specular, depth);
    set_levels(&seen, n->specular, depth + 1);
    if (needs_lit && needs_seen && seen.recursion == 0 && !n->specular) {
        lit.glow = true;
        needs_seen = false;
    }
    if (needs_lit)
        p->pass[p->num_passes++] = lit;
    if (needs_seen)
        p->pass[p->num_passes++] = seen;
    p->specular = n->specular;
}

static bool check_depth(const struct povray_passes *p, const struct census *n, int depth,
                        struct err *e)
{
    for (int i = 0; i < p->num_passes; i++) {
        const struct povray_pass *pass = &p->pass[i];
        if (pass->recursion > MAX_RECURSION || pass->levels > MAX_LEVELS)
            return err_set(e, "POV-Ray is verified to depth %d only, not %d",
                           pass->recursion > 0 ? MAX_RECURSION + (n->glow ? 0 : 1) : MAX_LEVELS - 1,
                           depth);
        if (pass->recursion > 0 && n->specular && depth < POVRAY_LEAST_MIXED_DEPTH)
            return err_set(e,
                           "POV-Ray cannot end paths that mix diffuse surfaces with mirrors or "
                           "glass at depth %d: it needs %d at least",
                           depth, POVRAY_LEAST_MIXED_DEPTH);
    }
    return true;
}

bool povray_passes_are_noisy(const struct povray_passes *p)
{
    bool indirect = false;
    for (int i = 0; i < p->num_passes; i++)
        indirect |= p->pass[i].recursion > 0;
    return indirect && !p->constant;
}

bool povray_passes(const struct scene *s, const struct camera *c, int depth,
                   struct povray_passes *out, struct err *e)
{
    assert(depth >= 0);
    struct povray_passes p = {0};
    struct census n = {0};
    p.extent = length(sub(s->bounds_max, s->bounds_min));
    for (uint32_t i = 0; i < s->num_materials; i++)
        if (!check_material(&s->materials[i], e))
            return false;
    count_materials(s, &n);
    if (!features_check_normals("POV-Ray", s, e) || !povray_check_textures(s, e) ||
        !check_camera(s, c, p.extent, e) || !povray_check_glass(s, c, p.extent, e) ||
        !plan_lights(s, &p, &n, e))
        return false;
    plan_passes(s, &n, depth, &p);
    if (!check_depth(&p, &n, depth, e))
        return false;
    p.constant = s->num_triangles == 0 && s->num_spheres == 1 && s->num_lights == 1 &&
                 s->spheres[0].normal_out < 0 && n.diffuse && n.glow &&
                 length(sub(c->eye, s->spheres[0].centre)) < s->spheres[0].radius;
    *out = p;
    return true;
}
