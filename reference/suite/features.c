#include "features.h"

#include "renderer/scene/environment.h"

#include <math.h>

/* Shading normals this close to the geometric one count as equal to it: files have six digits. */
#define FLAT 1e-5

const char *const feature_names[NUM_FEATURES + 1] = {
    [FEATURE_DIFFUSE] = "diffuse",
    [FEATURE_MIRROR] = "mirror",
    [FEATURE_GLASS] = "glass",
    [FEATURE_REFRACTION] = "refraction",
    [FEATURE_SCHLICK] = "schlick",
    [FEATURE_MICROFACET] = "microfacet",
    [FEATURE_BECKMANN] = "beckmann",
    [FEATURE_PLASTIC] = "plastic",
    [FEATURE_AREA] = "area",
    [FEATURE_TWO_SIDED] = "two_sided",
    [FEATURE_POINT] = "point",
    [FEATURE_SPOT] = "spot",
    [FEATURE_FALLOFF] = "falloff",
    [FEATURE_DIRECTIONAL] = "directional",
    [FEATURE_ENVIRONMENT] = "environment",
    [FEATURE_SPHERE] = "sphere",
    [FEATURE_SMOOTH] = "smooth",
    [FEATURE_LENS] = "lens",
    [FEATURE_CLIP] = "clip",
    [FEATURE_TEXTURE] = "texture",
};

const char *const feature_texts[NUM_FEATURES] = {
    [FEATURE_DIFFUSE] = "matt surfaces",
    [FEATURE_MIRROR] = "a mirror",
    [FEATURE_GLASS] = "glass",
    [FEATURE_REFRACTION] = "a boundary that only refracts",
    [FEATURE_SCHLICK] = "glass by Schlick's approximation",
    [FEATURE_MICROFACET] = "rough metal (GGX)",
    [FEATURE_BECKMANN] = "rough metal (Beckmann)",
    [FEATURE_PLASTIC] = "highlights on matt surfaces",
    [FEATURE_AREA] = "glowing surfaces",
    [FEATURE_TWO_SIDED] = "surfaces that glow on both sides",
    [FEATURE_POINT] = "a point light",
    [FEATURE_SPOT] = "a spot light",
    [FEATURE_FALLOFF] = "a light without inverse square falloff",
    [FEATURE_DIRECTIONAL] = "a directional light",
    [FEATURE_ENVIRONMENT] = "a sky",
    [FEATURE_SPHERE] = "spheres",
    [FEATURE_SMOOTH] = "shading normals",
    [FEATURE_LENS] = "a lens",
    [FEATURE_CLIP] = "a near or far plane",
    [FEATURE_TEXTURE] = "textures",
};

dvec3 features_normal(const vec3 *p)
{
    dvec3 n = d3_cross(d3_sub(d3_of(p[1]), d3_of(p[0])), d3_sub(d3_of(p[2]), d3_of(p[0])));
    return d3_scale(n, 1 / d3_length(n));
}

static bool is_flat(const struct scene *s, uint32_t triangle)
{
    dvec3 n = features_normal(s->position + 3 * (size_t)triangle);
    for (size_t k = 3 * (size_t)triangle; k < 3 * (size_t)triangle + 3; k++)
        if (d3_length(d3_sub(d3_of(s->normal[k]), n)) > FLAT)
            return false;
    return true;
}

bool features_are_smooth(const struct scene *s, uint32_t first, uint32_t num)
{
    for (uint32_t i = first; i < first + num; i++)
        if (!is_flat(s, i))
            return true;
    return false;
}

/* Distance along one axis from p to the interval that a, b and c span. */
static double gap(float p, float a, float b, float c)
{
    return fmax(0, fmax((double)fminf(a, fminf(b, c)) - p, (double)p - fmaxf(a, fmaxf(b, c))));
}

/* A lower bound for the distance of the nearest point. */
static double triangle_distance(const vec3 *p, vec3 eye)
{
    double plane = fabs(d3_dot(features_normal(p), d3_sub(d3_of(eye), d3_of(p[0]))));
    double box =
        d3_length(d3(gap(eye.x, p[0].x, p[1].x, p[2].x), gap(eye.y, p[0].y, p[1].y, p[2].y),
                     gap(eye.z, p[0].z, p[1].z, p[2].z)));
    return fmax(plane, box);
}

/* Of one primitive: smallest and largest distance from the eye and depth along the view. */
struct reach {
    double distance[2], depth[2];
};

static struct reach triangle_reach(const vec3 *p, const struct camera *c)
{
    struct reach r = {{triangle_distance(p, c->eye), 0}, {INFINITY, -INFINITY}};
    for (int k = 0; k < 3; k++) {
        dvec3 to = d3_sub(d3_of(p[k]), d3_of(c->eye));
        double depth = -d3_dot(to, d3_of(c->backward));
        r.distance[1] = fmax(r.distance[1], d3_length(to));
        r.depth[0] = fmin(r.depth[0], depth);
        r.depth[1] = fmax(r.depth[1], depth);
    }
    return r;
}

static struct reach sphere_reach(const struct sphere *b, const struct camera *c)
{
    dvec3 to = d3_sub(d3_of(b->centre), d3_of(c->eye));
    double d = d3_length(to), radius = (double)b->radius;
    double depth = -d3_dot(to, d3_of(c->backward));
    return (struct reach){{fabs(d - radius), d + radius}, {depth - radius, depth + radius}};
}

/* Of primitive i; triangles come first. */
static struct reach reach_of(const struct scene *s, uint32_t i, const struct camera *c)
{
    return i < s->num_triangles ? triangle_reach(s->position + 3 * (size_t)i, c)
                                : sphere_reach(&s->spheres[i - s->num_triangles], c);
}

void features_distances(const struct scene *s, const struct camera *c, double *nearest,
                        double *furthest)
{
    *nearest = INFINITY;
    *furthest = 0;
    for (uint32_t i = 0; i < scene_num_primitives(s); i++) {
        struct reach r = reach_of(s, i, c);
        *nearest = fmin(*nearest, r.distance[0]);
        *furthest = fmax(*furthest, r.distance[1]);
    }
}

static bool may_be_cut(const struct scene *s, const struct camera *c)
{
    double nearest, furthest, lens = (double)c->lens_radius;
    features_distances(s, c, &nearest, &furthest);
    return !(nearest - lens > (double)c->near && furthest + lens < (double)c->far);
}

const char *const features_material_names[NUM_MATERIAL_KINDS] = {
    [MATERIAL_DIFFUSE] = "diffuse surfaces",
    [MATERIAL_MIRROR] = "mirrors",
    [MATERIAL_REFRACTION] = "a boundary that only refracts",
    [MATERIAL_GLASS] = "glass",
    [MATERIAL_MICROFACET] = "microfacets",
    [MATERIAL_PLASTIC] = "diffuse surfaces with a highlight or a mirror image"};

static unsigned material_features(const struct material *m)
{
    unsigned f = 0;
    switch (m->kind) {
    case MATERIAL_DIFFUSE: f = rgb_is_zero(m->reflectance) ? 0 : 1u << FEATURE_DIFFUSE; break;
    case MATERIAL_MIRROR: f = 1u << FEATURE_MIRROR; break;
    case MATERIAL_REFRACTION: f = 1u << FEATURE_REFRACTION; break;
    case MATERIAL_GLASS: f = 1u << (m->schlick ? FEATURE_SCHLICK : FEATURE_GLASS); break;
    case MATERIAL_MICROFACET:
        f = 1u << (m->microfacet == MICROFACET_GGX ? FEATURE_MICROFACET : FEATURE_BECKMANN);
        break;
    case MATERIAL_PLASTIC:
        f = 1u << FEATURE_PLASTIC | (rgb_is_zero(m->mirror) ? 0 : 1u << FEATURE_MIRROR);
        break;
    }
    if (!rgb_is_zero(m->radiance))
        f |= 1u << (m->radiance_both_sides ? FEATURE_TWO_SIDED : FEATURE_AREA);
    if (material_has_map(m))
        f |= 1u << FEATURE_TEXTURE;
    return f;
}

static unsigned light_features(const struct light *l)
{
    bool physical = l->attenuation[0] == 0 && l->attenuation[1] == 0;
    unsigned falloff = physical ? 0 : 1u << FEATURE_FALLOFF;
    switch (l->kind) {
    case LIGHT_POINT: return 1u << FEATURE_POINT | falloff;
    case LIGHT_SPOT: return 1u << FEATURE_SPOT | falloff;
    case LIGHT_DIRECTIONAL: return 1u << FEATURE_DIRECTIONAL;
    case LIGHT_ENVIRONMENT: return 1u << FEATURE_ENVIRONMENT;
    case LIGHT_TRIANGLES:
    case LIGHT_SPHERE: break; /* by their material */
    }
    return 0;
}

unsigned features_of_scene(const struct scene *s, const struct camera *c)
{
    unsigned f = 0;
    for (uint32_t i = 0; i < s->num_objects; i++)
        f |= material_features(&s->materials[s->objects[i].material]);
    for (uint32_t i = 0; i < s->num_lights; i++)
        f |= light_features(&s->lights[i]);
    if (s->num_spheres > 0)
        f |= 1u << FEATURE_SPHERE;
    if (features_are_smooth(s, 0, s->num_triangles))
        f |= 1u << FEATURE_SMOOTH;
    if (c->lens_radius > 0)
        f |= 1u << FEATURE_LENS;
    if (may_be_cut(s, c))
        f |= 1u << FEATURE_CLIP;
    return f;
}

bool features_check_clipping(const char *engine, const struct scene *s, const struct camera *c,
                             struct err *e)
{
    double nearest, furthest;
    if (scene_num_primitives(s) == 0)
        return err_set(e, "%s: nothing to see: no triangles, no spheres", engine);
    features_distances(s, c, &nearest, &furthest);
    return !may_be_cut(s, c) ||
           err_set(e,
                   "%s: the near plane is at %g, the far plane is at %g: they may cut geometry, at "
                   "distance %g to %g from the eye",
                   engine, (double)c->near, (double)c->far, nearest, furthest);
}

/* Depths of what lies before the near plane, between the planes, and beyond the far one. */
struct layers {
    double before, seen[2], beyond; /* largest; smallest and largest; smallest */
    bool is_mixed;
};

static void sort_reach(struct reach r, const struct camera *c, struct layers *l)
{
    double lens = (double)c->lens_radius;
    if (!(r.depth[1] > 0))
        return; /* behind the camera */
    if (r.distance[1] + lens < (double)c->near) {
        l->before = fmax(l->before, r.depth[1]);
    } else if (r.distance[0] - lens > (double)c->far) {
        l->beyond = fmin(l->beyond, r.depth[0]);
    } else {
        l->is_mixed |=
            !(r.distance[0] - lens > (double)c->near && r.distance[1] + lens < (double)c->far);
        l->seen[0] = fmin(l->seen[0], r.depth[0]);
        l->seen[1] = fmax(l->seen[1], r.depth[1]);
    }
}

static struct layers find_layers(const struct scene *s, const struct camera *c)
{
    struct layers l = {.seen = {INFINITY, 0}, .beyond = INFINITY};
    for (uint32_t i = 0; i < scene_num_primitives(s); i++)
        sort_reach(reach_of(s, i, c), c, &l);
    return l;
}

bool features_clip_depths(const char *engine, const struct scene *s, const struct camera *c,
                          double *near, double *far, struct err *e)
{
    *near = 0;
    *far = INFINITY;
    if (scene_num_primitives(s) == 0)
        return features_check_clipping(engine, s, c, e);
    if (!may_be_cut(s, c))
        return true;
    struct layers l = find_layers(s, c);
    if (l.is_mixed || !(l.before < l.seen[0] && l.seen[1] < l.beyond))
        return features_check_clipping(engine, s, c, e);
    if (l.before > 0)
        *near = (l.before + l.seen[0]) / 2;
    if (isfinite(l.beyond))
        *far = (l.seen[1] + l.beyond) / 2;
    return true;
}

bool features_check_axes(const char *engine, const struct camera *c, struct err *e)
{
    double square = (double)c->tan_h * c->height / c->width;
    dvec3 right = d3_of(c->right), up = d3_of(c->up), back = d3_of(c->backward);
    if (!(fabs((double)c->tan_v / square - 1) < 1e-5))
        return err_set(e, "%s: the camera's pixels are not square (tan_h %g, tan_v %g, %d x %d)",
                       engine, (double)c->tan_h, (double)c->tan_v, c->width, c->height);
    if (!(d3_length(d3_sub(d3_cross(right, up), back)) < 1e-5 && fabs(d3_dot(right, up)) < 1e-5))
        return err_set(e, "%s: the camera's axes are not orthogonal", engine);
    return true;
}

bool features_check_normals(const char *engine, const struct scene *s, struct err *e)
{
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        dvec3 n = features_normal(s->position + 3 * (size_t)i);
        for (size_t k = 3 * (size_t)i; k < 3 * (size_t)i + 3; k++)
            if (!(d3_dot(d3_of(s->normal[k]), n) > 0))
                return err_set(e, "%s: object '%s' has a shading normal behind its triangle",
                               engine, s->objects[s->tri_object[i]].name);
    }
    return true;
}

bool features_check_textures(const char *engine, const struct scene *s, struct err *e)
{
    for (uint32_t i = 0; i < s->num_materials; i++)
        if (material_has_map(&s->materials[i]))
            return err_set(e, "%s: the texture of material '%s' cannot be expressed", engine,
                           s->materials[i].name);
    return true;
}

static bool check_light(const char *engine, const struct scene *s, uint32_t index, struct err *e)
{
    const struct light *l = &s->lights[index];
    const float *a = l->attenuation;
    if ((l->kind == LIGHT_POINT || l->kind == LIGHT_SPOT) &&
        (a[0] != 0 || a[1] != 0 || !(a[2] > 0)))
        return err_set(e, "%s: light %u: falloff 1/(%g + %g d + %g d^2) is not the inverse square",
                       engine, index, (double)a[0], (double)a[1], (double)a[2]);
    if (l->kind == LIGHT_SPOT && l->exponent != 0)
        return err_set(e, "%s: light %u: no spot light that falls off as a power of the cosine",
                       engine, index);
    return l->kind != LIGHT_ENVIRONMENT || !environment_is_hidden(s->environment) ||
           err_set(e, "%s has no ambient light that only rough surfaces receive", engine);
}

bool features_check_exportable(const char *engine, const struct scene *s, const struct camera *c,
                               struct err *e)
{
    if (c->is_orthographic)
        return err_set(e, "%s: an orthographic camera cannot be expressed", engine);
    if (!features_check_axes(engine, c, e) || !features_check_clipping(engine, s, c, e) ||
        !features_check_normals(engine, s, e) || !features_check_textures(engine, s, e))
        return false;
    for (uint32_t i = 0; i < s->num_lights; i++)
        if (!check_light(engine, s, i, e))
            return false;
    return true;
}
