#include "povray_lamp.h"

#include <assert.h>
#include <gsl/gsl_math.h>

static void find_rectangle(const struct scene *s, const struct light *l, struct povray_lamp *out)
{
    if (l->count != 2)
        return;
    const vec3 *p = &s->position[3 * (size_t)l->first], *q = p + 3;
    vec3 n = cross(sub(p[1], p[0]), sub(p[2], p[0]));
    float size = length(sub(p[1], p[0])) + length(sub(p[2], p[0]));
    /* One corner of each triangle is not shared; the second triangle's is the mirror image of the
     * first's in the midpoint of the shared edge. */
    for (int i = 0; i < 3; i++) {
        vec3 own = p[i], b = p[(i + 1) % 3], c = p[(i + 2) % 3];
        vec3 fourth = sub(add(b, c), own);
        for (int j = 0; j < 3; j++) {
            vec3 e = sub(q[j], fourth), f = sub(q[(j + 1) % 3], c), g = sub(q[(j + 2) % 3], b);
            if (length(e) + length(f) + length(g) > 1e-5f * size)
                continue;
            out->kind = POVRAY_RECTANGLE;
            out->corner = own;
            out->edge1 = sub(b, own);
            out->edge2 = sub(c, own);
            out->normal = normalize(n);
            out->area = length(n);
            return;
        }
    }
}

bool povray_lamp(const struct scene *s, const struct light *l, struct povray_lamp *out)
{
    if (l->kind != LIGHT_TRIANGLES && l->kind != LIGHT_SPHERE)
        return false;
    bool ball = l->kind == LIGHT_SPHERE;
    uint32_t material = ball ? s->sphere_material[l->first] : s->tri_material[l->first];
    const struct material *m = &s->materials[material];
    if (!material_is_black(m) || m->radiance_both_sides || l->textured ||
        (ball && s->spheres[l->first].normal_out < 0))
        return false;
    *out = (struct povray_lamp){.kind = ball ? POVRAY_BALL : POVRAY_MESH,
                                .radiance = m->radiance,
                                .area = l->area,
                                .first = l->first,
                                .count = ball ? 1 : l->count};
    for (uint32_t i = 1; i < out->count; i++)
        if (s->tri_material[l->first + i] != material)
            return false;
    if (!ball)
        find_rectangle(s, l, out);
    return true;
}

static double fraction(double x)
{
    return x - floor(x);
}

static void ball_point(const struct sphere *b, double z, double phi, vec3 *p, vec3 *normal)
{
    double r = sqrt(fmax(0, 1 - z * z));
    *normal = v3((float)(r * cos(phi)), (float)(r * sin(phi)), (float)z);
    *p = mad(b->centre, b->radius, *normal);
}

static void triangle_point(const vec3 *v, double a, double b, vec3 *p, vec3 *normal)
{
    if (a + b > 1) {
        a = 1 - a;
        b = 1 - b;
    }
    vec3 e1 = sub(v[1], v[0]), e2 = sub(v[2], v[0]);
    *p = mad(mad(v[0], (float)a, e1), (float)b, e2);
    *normal = normalize(cross(e1, e2));
}

static double triangle_area(const vec3 *v)
{
    return 0.5 * (double)length(cross(sub(v[1], v[0]), sub(v[2], v[0])));
}

void povray_lamp_points(const struct scene *s, const struct povray_lamp *l, const double shift[3],
                        int n, vec3 *p, vec3 *normal)
{
    assert(n > 0 && l->kind != POVRAY_RECTANGLE);
    double u = shift[0], v = shift[1], w = shift[2];
    if (l->kind == POVRAY_BALL) {
        for (int i = 0; i < n; i++)
            ball_point(&s->spheres[l->first], 1 - 2 * (i + u) / n,
                       2 * M_PI * fraction(v + i * 0.6180339887498949), &p[i], &normal[i]);
        return;
    }
    const vec3 *t = &s->position[3 * (size_t)l->first];
    double total = 0, below = 0, here = triangle_area(t);
    for (uint32_t k = 0; k < l->count; k++)
        total += triangle_area(t + 3 * (size_t)k);
    uint32_t k = 0;
    for (int i = 0; i < n; i++) {
        double at = (i + u) / n * total;
        while (at >= below + here && k + 1 < l->count) {
            below += here;
            here = triangle_area(t + 3 * (size_t)++k);
        }
        /* Steps of the two-dimensional golden ratio, 1/g and 1/g^2 with g^3 = g + 1. */
        triangle_point(t + 3 * (size_t)k, fraction(v + i * 0.7548776662466927),
                       fraction(w + i * 0.5698402909980532), &p[i], &normal[i]);
    }
}
