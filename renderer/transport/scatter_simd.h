/* The scatter stage, the last at each vertex: BSDF sampling, Russian roulette, and the next ray of every path that goes
 * on. Surviving paths are moved to the front of the batch. */
#ifndef ASSAY_SCATTER_SIMD_H
#define ASSAY_SCATTER_SIMD_H

#include "guide_simd.h"
#include "paths_simd.h"
#include "renderer/scene/shape_simd.h"

#include <limits.h>

/* The first vertex (0: what the camera sees) at which roulette may end a path. */
INLINE int first_at_risk(const struct integrator_options *o)
{
    return o->roulette == ROULETTE_OFF ? INT_MAX : o->roulette == ROULETTE_FIXED ? 1 : 2;
}

/* Russian roulette: the probability with which a path continues from this vertex. */
INLINE vf survival(const struct integrator_options *o, int vertex, rgbv throughput, vf eta2)
{
    if (vertex < first_at_risk(o))
        return vf_set(1);
    if (o->roulette == ROULETTE_FIXED)
        return vf_set(o->survival);
    return vf_min(vf_set(1), roulette_factor(o) * (rgb_maxv(throughput) * eta2));
}

/* Stores the radiance of the paths of the mask, which are finished. */
INLINE void finish(struct batch *b, int k, unsigned over)
{
    for (; over; over &= over - 1) {
        int i = k + __builtin_ctz(over);
        rgbs_set(&b->radiance, (int)b->slot[i], rgbs_get(&b->gathered, i));
    }
}

/* Notes bins for the paths of the mask. */
static void guide_note(struct batch *b, int k, unsigned mask, vi bin, int vertex)
{
    for (; mask; mask &= mask - 1) {
        const int i = k + __builtin_ctz(mask);
        const uint32_t slot = b->slot[i];
        const rgb gathered = rgbs_get(&b->gathered, i);
        const rgb after = rgb_mul(rgbs_get(&b->throughput, i), rgbs_get(&b->reflectance, i));
        b->notes->bin[vertex][slot] = LANE(bin, i - k);
        b->notes->before[vertex][slot] = gathered.r + gathered.g + gathered.b;
        b->notes->throughput[vertex][slot] = after.r + after.g + after.b;
    }
}

/* Guides the numbers from which the paths' next directions come, where the surface is diffuse, and divides throughput by
 * their density. */
static __attribute__((noinline)) void guide(const struct integrator *it, struct batch *b, int n,
                                            int vertex)
{
    for (int k = 0; k < n; k += LANES) {
        unsigned mask = b->goes_on[k / LANES];
        vm diffuse = lanes_of(mask) & has_bits(vi_load_any(b->bits + k), 1 << MATERIAL_DIFFUSE);
        if (!bits(diffuse))
            continue;
        vf old[2] = {vf_load_any(b->numbers[0] + k), vf_load_any(b->numbers[1] + k)};
        vf new[2] = {old[0], old[1]};
        vi bin, place = guide_place(it->guide, v3_load(&b->p, k), v3_load(&b->ns, k));
        vf density = vf_select(diffuse, guide_direction(it->guide, place, new, &bin), vf_set(1));
        vf_store_any(b->numbers[0] + k, vf_select(diffuse, new[0], old[0]));
        vf_store_any(b->numbers[1] + k, vf_select(diffuse, new[1], old[1]));
        if (b->notes != NULL && vertex < GUIDE_VERTICES)
            guide_note(b, k, bits(diffuse), place * GUIDE_BINS + bin, vertex);
        rgb_store(&b->throughput, k, rgb_scalev(rgb_load(&b->throughput, k), 1 / density));
    }
}

/* Sets up the next ray of every path that goes on and moves these paths to the front; returns how many. only_delta: the
 * next ray is a path's last, and light sampling has already counted all emitters but those that a delta lobe finds. */
static int scatter(const struct integrator *it, struct batch *b, int n, int vertex, bool only_delta)
{
    const vf zero = vf_set(0);
    int kept = 0;
    const bool chooses = chooses_light(it), by_normal = chooses || it->scene->environment != NULL;
    const bool two = it->records->only_diffuse && vertex < first_at_risk(&it->opt);
    draw_numbers(it, b, 0, n, (struct draws){vertex + 1, PURPOSE_BSDF, 1, .used = two ? 2 : 4});
    if (it->guide != NULL)
        guide(it, b, n, vertex);
    for (int k = 0; k < n; k += LANES) {
        unsigned there = lanes_there(k, n), mask = b->goes_on[k / LANES];
        if (!mask) {
            finish(b, k, there);
            continue;
        }
        vf u[4];
        load_numbers(b, k / LANES, u);
        framev f = frame_from_normalv(v3_load(&b->ns, k));
        vec3v wo = frame_to_localv(&f, v3_load(&b->wo, k));
        struct bsdf_samplev s;
        sample_lobes(it->records->material, (const int32_t *)b->material + k,
                     vi_load_any(b->bits + k), rgb_load(&b->reflectance, k), b->front + k, mask, wo,
                     u, &s);
        vec3v wi = frame_to_worldv(&f, s.wi);
        /* Both normals have to agree on which side the light leaves. */
        vm ok = vf_lt(zero, s.pdf_w) & vf_lt(zero, s.wi.z * dotv(v3_load(&b->ng, k), wi));
        if (only_delta)
            ok &= s.delta;
        rgbv throughput = rgb_mulv(rgb_load(&b->throughput, k), s.weight);
        vf eta2 = vf_load_any(b->eta2 + k) * s.eta2;
        vf go_on = survival(&it->opt, vertex, throughput, eta2);
        vm at_risk = vf_lt(go_on, vf_set(1));
        ok &= ~at_risk | vf_lt(u[3], go_on);
        throughput = rgb_scalev(throughput, vf_select(at_risk, 1 / go_on, vf_set(1)));
        mask &= bits(ok);
        finish(b, k, there & ~mask);
        vec3v o = leave_surface(v3_load(&b->p, k), v3_load(&b->ng, k), vf_load_any(b->eps + k), wi);
        vi order = front_order(mask);
        pick_rgb(&b->throughput, kept, throughput, order);
        pick_rgb(&b->gathered, kept, rgb_load(&b->gathered, k), order);
        pick_v3(&b->ray.o, kept, o, order);
        pick_v3(&b->ray.d, kept, wi, order);
        if (by_normal)
            pick_v3(&b->from_n, kept, v3_load(&b->ns, k), order);
        if (chooses) {
            vf_store_any(b->from_weight + kept, pick(vf_load_any(b->choice_weight + k), order));
        }
        vf_store_any(b->ray.tmin + kept, zero);
        vf_store_any(b->ray.tmax + kept, vf_set(INFINITY));
        vf_store_any(b->pdf_w + kept, pick(vf_select(s.delta, zero, s.pdf_w), order));
        vf_store_any(b->eta2 + kept, pick(eta2, order));
        vf_store_any(b->slot_pixel + kept, pick(vf_load_any(b->slot_pixel + k), order));
        vf_store_any(b->slot_sample + kept, pick(vf_load_any(b->slot_sample + k), order));
        vf_store_any(b->slot + kept, pick(vf_load_any(b->slot + k), order));
        kept += __builtin_popcount(mask);
    }
    return kept;
}

#endif
