/* The stages on as many paths at a time as there are lanes, compiled once for each instruction set. Paths that go on
 * move to the front of the batch after each vertex, so vectors stay full; rays that light sampling casts lie side by
 * side too. */
#include "integrator_simd.h"

#include "aov.h"
#include "connect_simd.h"
#include "film_simd.h"
#include "generate_simd.h"
#include "scatter_simd.h"
#include "shade_simd.h"

static void integrate_lanes(const struct integrator *it, struct batch *b, int n)
{
    const bool last_ray = it->opt.direct == DIRECT_BSDF || it->opt.direct == DIRECT_MIS;
    generate(it, b, n);
    for (int i = 0; i < BATCH_LANES; i++) /* there are n paths, but there may be more shadow rays */
        b->active[i] = (uint16_t)i;
    if (it->opt.kind == INTEGRATE_NORMALS) {
        bvh_closest(it->bvh, &b->ray, b->active, n, &b->hit, &b->stats);
        if (it->opt.first_hits)
            first_hits_record(it, b, n);
        show_normals(it, b, n);
        return;
    }
    for (int vertex = 0; n > 0; vertex++) {
        bvh_closest(it->bvh, &b->ray, b->active, n, &b->hit, &b->stats);
        if (vertex == 0 && it->opt.first_hits)
            first_hits_record(it, b, n);
        shade(it, b, n, vertex);
        if (counts(it, vertex + 1))
            connect(it, b, n, vertex);
        bool only_delta = vertex + 1 == it->opt.max_bounces && !last_ray;
        n = scatter(it, b, n, vertex, only_delta);
    }
}

const struct integrator_simd FOR_ISA(integrator_simd) = {.integrate = integrate_lanes,
                                                         .film_add = film_add_lanes};
