/* The generate stage: camera rays. Also the image of normals (INTEGRATE_NORMALS), which needs only these rays' first
 * hits. */
#ifndef ASSAY_GENERATE_SIMD_H
#define ASSAY_GENERATE_SIMD_H

#include "paths_simd.h"
#include "renderer/scene/shape.h"
#include "renderer/scene/camera_simd.h"
#include "renderer/scene/pixel_filter_simd.h"
#include "renderer/scene/shape_simd.h"

/* Camera rays for all lanes. */
static void generate(const struct integrator *it, struct batch *b, int n)
{
    const struct camera *c = it->camera;
    const vf zero = vf_set(0), one = vf_set(1);
    for (int k = 0; k < n; k += LANES) {
        vi_store_any(b->slot + k, vi_numbers() + k);
        vf_store_any(b->slot_pixel + k, vf_load_any(b->pixel + k));
        vf_store_any(b->slot_sample + k, vf_load_any(b->sample + k));
    }
    draw_numbers(it, b, 0, n,
                 (struct draws){0, PURPOSE_CAMERA, 1, .used = c->lens_radius > 0 ? 4 : 2});
    for (int k = 0; k < n; k += LANES) {
        vf u[4];
        load_numbers(b, k / LANES, u);
        if (c->filter.radius > 0)
            for (int axis = 0; axis < 2; axis++)
                u[axis] = 0.5f + filter_places(&c->filter, u[axis]);
        vi pixel = vi_load_any(b->pixel + k), row = vi_divide(pixel, c->width);
        vf x = vf_of_int(pixel - row * c->width) + u[0], y = vf_of_int(row) + u[1];
        vec3v o, d;
        camera_rays(c, x, y, u[2], u[3], &o, &d);
        v3_store(&b->ray.o, k, o);
        v3_store(&b->ray.d, k, d);
        vf_store_any(b->ray.tmin + k, vf_set(c->near));
        vf_store_any(b->ray.tmax + k, vf_set(c->far));
        rgb_store(&b->throughput, k, (rgbv){one, one, one});
        rgb_store(&b->gathered, k, (rgbv){zero, zero, zero});
        vf_store_any(b->pdf_w + k, zero);
        vf_store_any(b->eta2 + k, one);
    }
}

/* Shading normals of hits on triangles, read from the scene: building records does not pay for one ray per pixel. */
INLINE vec3v triangle_normals(const struct scene *s, const struct batch *b, int k, vi prim)
{
    enum { WORDS = 9 };
    const float *const from[2] = {&s->position[0].x, &s->normal[0].x};
    int32_t row[LANES];
    vi_store_any(row, prim);
    vf w[2][COLUMNS], last[2][COLUMNS];
    for (int i = 0; i < 2; i++) {
        gather_columns(from[i], WORDS, row, w[i]);
        gather_columns(from[i] + 1, WORDS, row, last[i]);
    }
    vec3v p = v3v(w[0][0], w[0][1], w[0][2]);
    vec3v e1 = subv(v3v(w[0][3], w[0][4], w[0][5]), p);
    vec3v e2 = subv(v3v(w[0][6], w[0][7], last[0][7]), p);
    vec3v n0 = v3v(w[1][0], w[1][1], w[1][2]), n1 = v3v(w[1][3], w[1][4], w[1][5]),
          n2 = v3v(w[1][6], w[1][7], last[1][7]);
    vf u = vf_load_any(b->hit.u + k), v = vf_load_any(b->hit.v + k);
    /* The side to which they are turned: none, where the starter code's are shown. */
    vec3v side = starter_has(s, CS184_NORMALS) ? madv(madv(scalev(n0, 1 - u - v), u, n1), v, n2)
                                               : triangle_normal(e1, e2);
    return interpolate_normals(n0, n1, n2, side, u, v);
}

/* Stores (n + 1)/2 as radiance, n being the shading normal at the hit; black where there is none. */
static __attribute__((noinline)) void show_normals(const struct integrator *it, struct batch *b,
                                                   int n)
{
    const struct scene *s = it->scene;
    const vf zero = vf_set(0);
    for (int k = 0; k < n; k += LANES) {
        vi prim = vi_load_any(b->hit.prim + k);
        vm flat = vi_lt(vi_set(-1), prim) & vi_lt(prim, vi_set((int32_t)s->num_triangles));
        rgbv c = {zero, zero, zero};
        if (bits(flat)) {
            vec3v ns = triangle_normals(s, b, k, vi_where(flat, prim));
            c = rgb_select(flat, (rgbv){0.5f + 0.5f * ns.x, 0.5f + 0.5f * ns.y, 0.5f + 0.5f * ns.z},
                           c);
        }
        rgb_store(&b->radiance, k, c);
        unsigned round = lanes_there(k, n) & ~bits(flat | vi_eq(prim, vi_set(-1)));
        for (; round; round &= round - 1) {
            int i = k + __builtin_ctz(round);
            ray r = rays_get(&b->ray, i);
            vec3 ns = surface_at(s, b->hit.prim[i], &r, b->hit.t[i], 0, 0).ns;
            rgbs_set(&b->radiance, i,
                     (rgb){0.5f + 0.5f * ns.x, 0.5f + 0.5f * ns.y, 0.5f + 0.5f * ns.z});
        }
    }
}

#endif
