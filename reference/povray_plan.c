#include "povray_plan.h"

#include <assert.h>
#include <gsl/gsl_math.h>

/* Furnaces agree to 3e-5 up to here; beyond, nobody has looked. */
#define MAX_RECURSION 20
/* POV-Ray ignores hits nearer than 1e-4, shadows nearer than 1e-3 and anything beyond 1e7. Extents
 * of 0.05 to 5e5 were seen to be right; at 5e-3 direct light was 9 % wrong. */
#define MIN_EXTENT 0.05
#define MAX_REACH  1e6

static vec3 face_normal(const vec3 *p)
{
    return normalize(cross(sub(p[1], p[0]), sub(p[2], p[0])));
}

static double distance_to_box(vec3 p, vec3 lo, vec3 hi)
{
    double dx = fmax(0, fmax((double)lo.x - p.x, (double)p.x - hi.x));
    double dy = fmax(0, fmax((double)lo.y - p.y, (double)p.y - hi.y));
    double dz = fmax(0, fmax((double)lo.z - p.z, (double)p.z - hi.z));
    return sqrt(dx * dx + dy * dy + dz * dz);
}

static vec3 farthest_corner(vec3 p, vec3 lo, vec3 hi)
{
    return v3(fmaxf(p.x - lo.x, hi.x - p.x), fmaxf(p.y - lo.y, hi.y - p.y),
              fmaxf(p.z - lo.z, hi.z - p.z));
}

/* A lower bound of the eye's distance to what is nearest: for a triangle, the distance to its plane
 * and to its bounding box. */
static double nearest_geometry(const struct scene *s, vec3 eye)
{
    double nearest = INFINITY;
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        const vec3 *p = &s->position[3 * (size_t)i];
        double plane = fabsf(dot(face_normal(p), sub(eye, p[0])));
        double box =
            distance_to_box(eye, vmin(p[0], vmin(p[1], p[2])), vmax(p[0], vmax(p[1], p[2])));
        nearest = fmin(nearest, fmax(plane, box));
    }
    for (uint32_t i = 0; i < s->num_spheres; i++)
        nearest = fmin(nearest,
                       fabs((double)length(sub(eye, s->spheres[i].centre)) - s->spheres[i].radius));
    return nearest;
}

static bool reflects(const struct material *m)
{
    return !rgb_is_zero(m->reflectance);
}

/* A plane does not see itself: there is no indirect light to wait for. */
static bool one_plane_reflects(const struct scene *s, double extent)
{
    for (uint32_t i = 0; i < s->num_spheres; i++)
        if (reflects(&s->materials[s->sphere_material[i]]))
            return false;
    vec3 n = {0}, o = {0};
    bool found = false;
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        if (!reflects(&s->materials[s->tri_material[i]]))
            continue;
        const vec3 *p = &s->position[3 * (size_t)i];
        if (!found) {
            n = face_normal(p);
            o = p[0];
            found = true;
        }
        for (int k = 0; k < 3; k++)
            if (fabs(dot(n, sub(p[k], o))) > 1e-6 * extent)
                return false;
    }
    return true;
}

bool povray_lamp(const struct scene *s, const struct light *l, struct povray_lamp *out)
{
    if (l->kind != LIGHT_TRIANGLES || l->count != 2)
        return false;
    const struct material *m = &s->materials[s->tri_material[l->first]];
    if (reflects(m) || m->radiance_both_sides ||
        s->tri_material[l->first + 1] != s->tri_material[l->first])
        return false;
    const vec3 *p = &s->position[3 * (size_t)l->first], *q = p + 3;
    vec3 n = cross(sub(p[1], p[0]), sub(p[2], p[0]));
    float size = length(sub(p[1], p[0])) + length(sub(p[2], p[0]));
    /* One corner of each triangle is its own; the fourth corner mirrors it in the middle of the
     * shared edge. */
    for (int i = 0; i < 3; i++) {
        vec3 own = p[i], b = p[(i + 1) % 3], c = p[(i + 2) % 3];
        vec3 fourth = sub(add(b, c), own);
        for (int j = 0; j < 3; j++) {
            vec3 e = sub(q[j], fourth), f = sub(q[(j + 1) % 3], c), g = sub(q[(j + 2) % 3], b);
            if (length(e) + length(f) + length(g) > 1e-5f * size)
                continue;
            *out = (struct povray_lamp){.corner = own,
                                        .edge1 = sub(b, own),
                                        .edge2 = sub(c, own),
                                        .normal = normalize(n),
                                        .radiance = m->radiance,
                                        .area = length(n)};
            return true;
        }
    }
    return false;
}

static bool check_material(const struct material *m, struct err *e)
{
    if (m->kind != MATERIAL_DIFFUSE)
        return err_set(e,
                       "POV-Ray: material '%s' is not diffuse, which this version does not export",
                       m->name);
    rgb a = m->reflectance, l = m->radiance;
    if (reflects(m) && ((a.r == 0 && l.r > 0) || (a.g == 0 && l.g > 0) || (a.b == 0 && l.b > 0)))
        return err_set(
            e, "POV-Ray cannot express material '%s': it emits a colour it does not reflect",
            m->name);
    return true;
}

static bool check_normals(const struct scene *s, struct err *e)
{
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        vec3 n = face_normal(&s->position[3 * (size_t)i]);
        for (size_t k = 3 * (size_t)i; k < 3 * (size_t)i + 3; k++)
            if (!(dot(n, s->normal[k]) > 0))
                return err_set(e,
                               "POV-Ray is not verified with shading normals behind the triangle "
                               "(object '%s')",
                               s->objects[s->tri_object[i]].name);
    }
    return true;
}

static bool check_camera(const struct scene *s, const struct camera *c, double extent,
                         struct err *e)
{
    double farthest = length(farthest_corner(c->eye, s->bounds_min, s->bounds_max));
    if (c->lens_radius > 0)
        return err_set(e, "POV-Ray's depth of field is not verified: the lens must be a pinhole");
    if (!(extent >= MIN_EXTENT && fmax(extent, farthest) <= MAX_REACH))
        return err_set(
            e,
            "POV-Ray's fixed tolerances show: the scene spans %.3g and reaches %.3g from "
            "the eye, not at least %g and at most %g",
            extent, farthest, MIN_EXTENT, MAX_REACH);
    double nearest = nearest_geometry(s, c->eye);
    if (c->near > 0 && nearest < c->near)
        return err_set(e,
                       "POV-Ray has no clipping planes: geometry may be at %.6g, nearer than %.6g",
                       nearest, c->near);
    if (c->far > 0 && farthest > c->far)
        return err_set(e,
                       "POV-Ray has no clipping planes: geometry may be at %.6g, farther than %.6g",
                       farthest, c->far);
    return true;
}

static bool plan_lights(const struct scene *s, struct povray_plan *p, struct err *e)
{
    int delta = 0, other = 0;
    double radiance = 0;
    for (uint32_t i = 0; i < s->num_lights; i++) {
        const struct light *l = &s->lights[i];
        struct povray_lamp lamp;
        switch (l->kind) {
        case LIGHT_POINT: {
            bool constant =
                l->attenuation[0] > 0 && l->attenuation[1] == 0 && l->attenuation[2] == 0;
            bool square = l->attenuation[0] == 0 && l->attenuation[1] == 0 && l->attenuation[2] > 0;
            if (!constant && !square)
                return err_set(e, "POV-Ray cannot express a point light whose falloff is neither "
                                  "constant nor purely quadratic");
            double r = 0.5 * p->extent;
            double falloff = constant ? l->attenuation[0] : l->attenuation[2] * r * r;
            radiance = fmax(radiance, rgb_max(l->value) / falloff / M_PI);
            delta++;
            break;
        }
        case LIGHT_DIRECTIONAL:
            radiance = fmax(radiance, rgb_max(l->value) / M_PI);
            delta++;
            break;
        case LIGHT_SPOT:
        case LIGHT_ENVIRONMENT:
            return err_set(e, "POV-Ray: light %u: %s is not matched yet", i,
                           l->kind == LIGHT_SPOT ? "a spot light" : "an environment");
        case LIGHT_TRIANGLES:
        case LIGHT_SPHERE:
            if (!povray_lamp(s, l, &lamp))
                other++;
            radiance =
                fmax(radiance, rgb_max(l->kind == LIGHT_SPHERE
                                           ? s->materials[s->sphere_material[l->first]].radiance
                                           : s->materials[s->tri_material[l->first]].radiance));
            break;
        }
    }
    if (delta > 0 && other > 0)
        return err_set(e, "POV-Ray counts the bounces of light sources and of glowing geometry "
                          "differently: point or directional lights cannot be mixed with emitters "
                          "that are not black one-sided parallelograms");
    p->sources = other == 0;
    p->radiance = radiance > 0 ? radiance : 1;
    return true;
}

bool povray_plan(const struct scene *s, const struct camera *c, int depth, struct povray_plan *out,
                 struct err *e)
{
    assert(depth >= 0);
    struct povray_plan p = {0};
    p.extent = length(sub(s->bounds_max, s->bounds_min));
    for (uint32_t i = 0; i < s->num_materials; i++)
        if (!check_material(&s->materials[i], e))
            return false;
    if (!check_normals(s, e) || !check_camera(s, c, p.extent, e) || !plan_lights(s, &p, e))
        return false;
    p.recursion = p.sources ? (depth > 1 ? depth - 1 : 0) : depth;
    if (s->num_lights == 0 || (p.sources && one_plane_reflects(s, p.extent)))
        p.recursion = 0;
    if (p.recursion > MAX_RECURSION)
        return err_set(e, "POV-Ray is verified to depth %d only, not %d",
                       MAX_RECURSION + (p.sources ? 1 : 0), depth);
    p.constant = s->num_triangles == 0 && s->num_spheres == 1 && s->spheres[0].normal_out < 0 &&
                 length(sub(c->eye, s->spheres[0].centre)) < s->spheres[0].radius && !p.sources;
    *out = p;
    return true;
}
