#include "bench_sets.h"
#include "bench_timing.h"

#include "renderer/scene/camera.h"
#include "renderer/math/sampler.h"
#include "renderer/math/warp.h"

#include <stdio.h>
#include <stdlib.h>

enum {
    VIEW_WIDTH = 640,
    VIEW_HEIGHT = 480,
    TILE = 16,
    TAKEN = 4, /* one tile of so many */
    MAX_RAYS = VIEW_WIDTH * VIEW_HEIGHT / TAKEN
};

static void append(struct ray_set *s, ray r)
{
    struct rays *b = &s->batch[s->num_rays / BATCH_LANES];
    int i = (int)(s->num_rays++ % BATCH_LANES);
    rays_set(b, i, r);
    b->ignore[i] = NO_HIT;
}

static vec3 normal_of(const struct scene *s, uint32_t prim, vec3 p)
{
    if (prim >= s->num_triangles)
        return normalize(sub(p, s->spheres[prim - s->num_triangles].centre));
    const vec3 *c = s->position + 3 * (size_t)prim;
    return normalize(cross(sub(c[1], c[0]), sub(c[2], c[0])));
}

void ray_set_go_on(const struct scene *s, const struct ray_set *in, const struct answer_key *a,
                   float size, vec3 light, uint32_t seed, struct ray_set *bounce,
                   struct ray_set *shadow)
{
    for (size_t k = 0; k < in->num_rays; k++) {
        const struct hits *h = &a->hit[k / BATCH_LANES];
        int i = (int)(k % BATCH_LANES);
        if (h->prim[i] == NO_HIT)
            continue;
        ray r = rays_get(&in->batch[k / BATCH_LANES], i);
        vec3 p = mad(r.o, h->t[i], r.d), n = normal_of(s, h->prim[i], p);
        if (dot(n, r.d) > 0)
            n = neg(n);
        if (!(dot(n, n) > 0.5f))
            continue;
        p = mad(p, 1e-4f * size, n);
        struct sample4 u = sampler_get(seed, (uint32_t)k, 0, 0, 0);
        vec3 d = add(n, warp_uniform_sphere(u.u[0], u.u[1]));
        if (bounce != NULL && length(d) > 1e-3f)
            append(bounce, (ray){p, normalize(d), 0, INFINITY});
        vec3 to = sub(light, p);
        if (length(to) > 0)
            append(shadow, (ray){p, normalize(to), 0, 0.9999f * length(to)});
    }
}

void ray_set_camera(const struct bench_scene *of, vec3 middle, float size, struct ray_set *out)
{
    struct camera c;
    struct err e = {0};
    vec3 eye = mad(middle, 1.7f * size, normalize(v3(0.3f, 0.35f, 1)));
    vec3 forward = normalize(sub(middle, eye)), right = normalize(cross(forward, v3(0, 1, 0)));
    vec3 up = cross(right, forward);
    if (of->framed && !camera_init(&c, &of->scene, VIEW_WIDTH, VIEW_HEIGHT, &e)) {
        fprintf(stderr, "bench: %s\n", e.msg);
        exit(3);
    }
    if (of->framed)
        c.lens_radius = 0;
    uint32_t n = 0;
    for (int ty = 0; ty < VIEW_HEIGHT; ty += TILE)
        for (int tx = 0; tx < VIEW_WIDTH; tx += TILE)
            for (int i = 0; (tx + 2 * ty) / TILE % TAKEN == 0 && i < TILE * TILE; i++) {
                struct sample4 u = sampler_get(71, n++, 0, 0, 0);
                float x = (float)(tx + i % TILE) + u.u[0], y = (float)(ty + i / TILE) + u.u[1];
                if (of->framed) {
                    append(out, camera_ray(&c, x, y, 0.5f, 0.5f));
                    continue;
                }
                float a = 0.8f * (2 * x / VIEW_WIDTH - 1), b = 0.6f * (1 - 2 * y / VIEW_HEIGHT);
                append(out, (ray){eye, normalize(mad(mad(forward, a, right), b, up)), 0, INFINITY});
            }
}

struct ray_set ray_set_new(void)
{
    const size_t batches = MAX_RAYS / BATCH_LANES + 1;
    return (struct ray_set){.batch = bench_allocate(batches * sizeof(struct rays))};
}

struct answer_key answers_new(void)
{
    const size_t batches = MAX_RAYS / BATCH_LANES + 1;
    return (struct answer_key){bench_allocate(batches * sizeof(struct hits)),
                               bench_allocate(batches * BATCH_LANES * sizeof(bool))};
}

size_t ray_set_different(const struct ray_set *s, bool shadow, const struct answer_key *a,
                         const struct answer_key *b, float size)
{
    size_t n = 0;
    for (size_t k = 0; k < s->num_rays; k++) {
        size_t at = k / BATCH_LANES;
        int i = (int)(k % BATCH_LANES);
        if (shadow) {
            n += a->occluded[at][i] != b->occluded[at][i];
            continue;
        }
        bool x = a->hit[at].prim[i] == NO_HIT, y = b->hit[at].prim[i] == NO_HIT;
        n += x != y || (!x && fabsf(a->hit[at].t[i] - b->hit[at].t[i]) > 1e-3f * size);
    }
    return n;
}
