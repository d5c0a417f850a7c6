#include "embree_tracer.h"
#include "bench_tracers.h"

#include <math.h>
#include <stdlib.h>

struct embree_tracer {
    const struct scene *scene;
    struct tracer embree;
    float eps;
};

struct pcg {
    uint64_t state;
};

static float uniform(struct pcg *g) /* O'Neill, PCG, 2014: XSH RR 64/32 */
{
    uint64_t old = g->state;
    g->state = old * 6364136223846793005u + 1442695040888963407u;
    uint32_t x = (uint32_t)(((old >> 18) ^ old) >> 27), r = (uint32_t)(old >> 59);
    return (float)(((x >> r) | (x << (-r & 31))) >> 8) * 0x1p-24f;
}

struct embree_tracer *embree_tracer_new(const struct scene *s, struct err *e)
{
    for (uint32_t i = 0; i < s->num_materials; i++)
        if (s->materials[i].kind != MATERIAL_DIFFUSE) {
            err_set(e, "the tracer on Embree knows diffuse surfaces only");
            return NULL;
        }
    for (uint32_t i = 0; i < s->num_lights; i++)
        if (s->lights[i].kind != LIGHT_TRIANGLES) {
            err_set(e, "the tracer on Embree knows lights of triangles only");
            return NULL;
        }
    struct embree_tracer *t = calloc(1, sizeof *t);
    if (t == NULL) {
        err_set(e, "out of memory");
        return NULL;
    }
    t->scene = s;
    t->embree = tracer_embree("embree", s, RTC_SCENE_FLAG_NONE);
    t->eps = 1e-5f * length(sub(s->bounds_max, s->bounds_min));
    return t;
}

void embree_tracer_free(struct embree_tracer *t)
{
    if (t != NULL)
        tracer_free(&t->embree);
    free(t);
}

static struct RTCRay embree_ray(vec3 o, vec3 d, float far)
{
    return (struct RTCRay){o.x, o.y, o.z, 0, d.x, d.y, d.z, 0, far, UINT32_MAX, 0, 0};
}

/* A point on light l, uniform over its area; *n is the normal of its front. */
static vec3 point_on(const struct scene *s, const struct light *l, float u, float v, float w,
                     vec3 *n)
{
    uint32_t i = l->first;
    const vec3 *p = s->position + 3 * (size_t)i;
    for (float left = w * l->area;; i++, p += 3) {
        *n = cross(sub(p[1], p[0]), sub(p[2], p[0]));
        float twice = length(*n);
        left -= twice / 2;
        if (left < 0 || i + 1 == l->first + l->count) {
            *n = scale(*n, 1 / twice);
            break;
        }
    }
    float r = sqrtf(u);
    return add(add(scale(p[0], 1 - r), scale(p[1], r * (1 - v))), scale(p[2], r * v));
}

static rgb path(const struct embree_tracer *t, ray r, int depth, struct pcg *g)
{
    const struct scene *s = t->scene;
    struct embree_query query;
    embree_query_init(&query);
    rgb sum = {0, 0, 0}, beta = {1, 1, 1};
    for (int vertex = 0;; vertex++) {
        struct RTCRayHit q = {.ray = embree_ray(r.o, r.d, 1e30f)};
        q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        embree_intersect(t->embree.scene, &query, &q);
        if (q.hit.geomID == RTC_INVALID_GEOMETRY_ID)
            return sum;
        uint32_t i = q.hit.primID;
        vec3 p = mad(r.o, q.ray.tfar, r.d), ng, ns;
        const struct material *m;
        if (q.hit.geomID == 0) {
            const vec3 *c = s->position + 3 * (size_t)i, *n = s->normal + 3 * (size_t)i;
            float u = q.hit.u, v = q.hit.v;
            ng = normalize(cross(sub(c[1], c[0]), sub(c[2], c[0])));
            ns = normalize(add(add(scale(n[0], 1 - u - v), scale(n[1], u)), scale(n[2], v)));
            m = &s->materials[s->tri_material[i]];
        } else {
            ng = ns = scale(normalize(sub(p, s->spheres[i].centre)), s->spheres[i].normal_out);
            m = &s->materials[s->sphere_material[i]];
        }
        bool front = dot(ng, r.d) < 0;
        if (vertex == 0 && (front || m->radiance_both_sides))
            sum = m->radiance;
        if (vertex == depth || rgb_is_zero(m->reflectance))
            return sum;
        if (!front) {
            ng = neg(ng);
            ns = neg(ns);
        }
        if (dot(ns, r.d) >= 0)
            ns = ng;
        beta = rgb_mul(beta, m->reflectance);
        vec3 o = mad(p, t->eps, ng);
        for (uint32_t k = 0; k < s->num_lights; k++) {
            const struct light *l = &s->lights[k];
            const struct material *lm = &s->materials[s->tri_material[l->first]];
            vec3 nl, x = point_on(s, l, uniform(g), uniform(g), uniform(g), &nl);
            vec3 to = sub(x, o);
            float d2 = dot(to, to), d = sqrtf(d2), cos_i = dot(ns, to) / d,
                  cos_l = -dot(nl, to) / d;
            if (lm->radiance_both_sides)
                cos_l = fabsf(cos_l);
            if (cos_i <= 0 || cos_l <= 0 || dot(ng, to) <= 0)
                continue;
            struct RTCRay shadow = embree_ray(o, scale(to, 1 / d), d * (1 - 1e-4f));
            embree_occluded(t->embree.scene, &query, &shadow);
            if (shadow.tfar < 0)
                continue;
            float f = cos_i * cos_l * l->area / (d2 * PI_F);
            sum = rgb_add(sum, rgb_scale(rgb_mul(beta, lm->radiance), f));
        }
        if (vertex + 1 == depth)
            return sum; /* the next vertex could only see a lamp, which has been sampled */
        float z = 1 - 2 * uniform(g), a = 2 * PI_F * uniform(g), flat = sqrtf(1 - z * z);
        vec3 d = normalize(add(mad(ns, flat * cosf(a), v3(1, 0, 0)),
                               v3(0, flat * sinf(a), z))); /* the normal plus a point of a sphere */
        if (!(dot(d, ng) > 0))
            return sum;
        if (vertex >= 2) {
            float go_on = rgb_max(beta);
            if (go_on < 1 && uniform(g) >= go_on)
                return sum;
            beta = go_on < 1 ? rgb_scale(beta, 1 / go_on) : beta;
        }
        r = (ray){o, d, 0, 1e30f};
    }
}

void embree_tracer_render(const struct embree_tracer *t, const struct camera *c, int depth, int spp,
                          uint32_t seed, float *rgb_out)
{
    struct pcg g = {seed * 0x9e3779b97f4a7c15u + 1};
    for (int y = 0; y < c->height; y++)
        for (int x = 0; x < c->width; x++) {
            rgb sum = {0, 0, 0};
            for (int k = 0; k < spp; k++) {
                float u = (float)x + uniform(&g), v = (float)y + uniform(&g);
                sum = rgb_add(sum, path(t, camera_ray(c, u, v, 0.5f, 0.5f), depth, &g));
            }
            float *out = rgb_out + 3 * ((size_t)y * (size_t)c->width + (size_t)x);
            out[0] = sum.r / (float)spp;
            out[1] = sum.g / (float)spp;
            out[2] = sum.b / (float)spp;
        }
}
