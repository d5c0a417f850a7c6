#include "mesh.h"

#include "renderer/math/sampler.h"

#include <stdlib.h>

static struct scene new_mesh(uint32_t triangles)
{
    struct scene s = {.num_triangles = triangles};
    s.position = malloc(3 * (size_t)triangles * sizeof *s.position);
    if (s.position == NULL)
        abort();
    return s;
}

static void set_triangle(struct scene *s, uint32_t i, vec3 a, vec3 b, vec3 c)
{
    s->position[3 * (size_t)i] = a;
    s->position[3 * (size_t)i + 1] = b;
    s->position[3 * (size_t)i + 2] = c;
}

static float height(float x, float z)
{
    float h = 0, a = 0.2f;
    for (int k = 0; k < 8; k++, a *= 0.55f)
        h += a * sinf(exp2f((float)k) * (3 * x + 2 * z) + 5.1f * (float)k) *
             cosf(exp2f((float)k) * (4 * z - x) + 1.7f * (float)k);
    return h;
}

struct scene mesh_terrain(uint32_t n, float size)
{
    struct scene s = new_mesh(2 * n * n);
    for (uint32_t i = 0; i < n * n; i++) {
        vec3 p[4];
        for (uint32_t k = 0; k < 4; k++) {
            float x = 2 * (float)(i % n + k % 2) / (float)n - 1;
            float z = 2 * (float)(i / n + k / 2) / (float)n - 1;
            p[k] = scale(v3(x, height(x, z), z), size);
        }
        set_triangle(&s, 2 * i, p[0], p[2], p[1]);
        set_triangle(&s, 2 * i + 1, p[1], p[2], p[3]);
    }
    return s;
}

/* Point (i, k) of a ball, the same bits for whoever asks. */
static vec3 ball_point(uint32_t i, uint32_t k, uint32_t rings, uint32_t segments, float bump)
{
    float theta = PI_F * (float)i / (float)rings;
    float phi = 2 * PI_F * (float)(k % segments) / (float)segments;
    float flat = i == 0 || i == rings ? 0 : sinf(theta);
    vec3 d = v3(flat * cosf(phi), cosf(theta), flat * sinf(phi));
    if (bump > 0)
        d = scale(d, 1 + bump * (height(d.x, d.y) + height(d.z, d.y)));
    return add(v3(0.31f, 0.17f, -0.23f), d);
}

struct scene mesh_ball(uint32_t rings, uint32_t segments, float bump)
{
    struct scene s = new_mesh(2 * segments * (rings - 1));
    uint32_t n = 0;
    for (uint32_t i = 0; i < rings; i++)
        for (uint32_t k = 0; k < segments; k++) {
            vec3 a = ball_point(i, k, rings, segments, bump);
            vec3 b = ball_point(i, k + 1, rings, segments, bump);
            vec3 c = ball_point(i + 1, k, rings, segments, bump);
            vec3 d = ball_point(i + 1, k + 1, rings, segments, bump);
            if (i > 0)
                set_triangle(&s, n++, a, b, d);
            if (i + 1 < rings)
                set_triangle(&s, n++, a, d, c);
        }
    return s;
}

vec3 mesh_random_point(uint64_t seed, uint32_t i, uint32_t k)
{
    struct sample4 s = sampler_get(seed, i, k, 0, 0);
    return v3(2 * s.u[0] - 1, 2 * s.u[1] - 1, 2 * s.u[2] - 1);
}

struct mesh_bounds mesh_bounds(const struct scene *s)
{
    vec3 lo = s->position[0], hi = lo;
    for (size_t i = 0; i < 3 * (size_t)s->num_triangles; i++) {
        lo = vmin(lo, s->position[i]);
        hi = vmax(hi, s->position[i]);
    }
    return (struct mesh_bounds){scale(add(lo, hi), 0.5f), length(sub(hi, lo)) / 2};
}

struct scene mesh_soup(uint32_t n)
{
    struct scene s = new_mesh(n);
    for (uint32_t i = 0; i < n; i++) {
        vec3 p = mesh_random_point(31, i, 0);
        float size = 0.3f * powf(0.01f, sampler_get(32, i, 0, 0, 0).u[0]);
        set_triangle(&s, i, p, mad(p, size, mesh_random_point(31, i, 1)),
                     mad(p, size, mesh_random_point(31, i, 2)));
    }
    return s;
}

struct scene mesh_needles(uint32_t n)
{
    struct scene s = new_mesh(n);
    for (uint32_t i = 0; i < n; i++) {
        vec3 a = scale(mesh_random_point(31, i, 0), 0.3f),
             b = add(a, normalize(mesh_random_point(31, i, 1)));
        set_triangle(&s, i, a, b, mad(b, 3e-4f, mesh_random_point(31, i, 2)));
    }
    return s;
}

struct scene mesh_twins(uint32_t n)
{
    struct scene one = mesh_terrain(n, 1), s = new_mesh(2 * one.num_triangles);
    for (uint32_t i = 0; i < one.num_triangles; i++) {
        const vec3 *p = one.position + 3 * (size_t)i;
        set_triangle(&s, i, p[0], p[1], p[2]);
        set_triangle(&s, one.num_triangles + i, p[1], p[2], p[0]);
    }
    scene_free(&one);
    return s;
}
