/* The connect stage, next event estimation: samples lights, or uniform directions of the hemisphere
 * (-H), at every vertex and traces the shadow rays. */
#ifndef ASSAY_CONNECT_SIMD_H
#define ASSAY_CONNECT_SIMD_H

#include "paths_simd.h"
#include "shade_simd.h"

/* Samples of a light, at each vertex, whose shadow rays are traced in one call. */
enum { TOGETHER = 4 };

/* Vertices, as light sampling needs them. */
struct vertexv {
    vec3v p, ng, ns, wo, off; /* off: where rays leave on the side of ng */
    rgbv throughput, diffuse; /* diffuse: f of the diffuse part */
    vf eps;
    vi bits;
};

INLINE void load_vertex(const struct batch *b, int k, struct vertexv *v)
{
    v->p = v3_load(&b->p, k);
    v->ng = v3_load(&b->ng, k);
    v->ns = v3_load(&b->ns, k);
    v->wo = v3_load(&b->wo, k);
    v->eps = vf_load_any(b->eps + k);
    v->off = madv(v->p, v->eps, v->ng);
    v->throughput = rgb_load(&b->throughput, k);
    v->diffuse = eval_diffuse(rgb_load(&b->reflectance, k));
    v->bits = vi_load_any(b->bits + k);
}

/* Mask of the paths k .. that go on and whose surface has a lobe that is not a delta. */
INLINE unsigned scattering(const struct batch *b, int k)
{
    return b->goes_on[k / LANES] & bits(has_bits(vi_load_any(b->bits + k), MATERIAL_SCATTERS));
}

/* f(wo, wi) cos(theta_i) and the BSDF's own density of wi, for the lanes of the mask. Returns the lanes that scatter at
 * all: only such whose wi leaves on wo's side of the geometric surface. */
INLINE unsigned scatter_towards(const struct integrator *it, const struct batch *b, int k,
                                const struct vertexv *v, unsigned mask, vec3v wi, bool only_diffuse,
                                rgbv *f, vf *pdf_w)
{
    const vf zero = vf_set(0);
    vf cos_i = dotv(v->ns, wi);
    mask &= bits(vf_lt(zero, cos_i) & vf_lt(zero, dotv(v->ng, wi)));
    *f = rgb_scalev(v->diffuse, cos_i);
    *pdf_w = warp_cosine_hemisphere_pdf_w(cos_i);
    vm below = ~vf_lt(zero, dotv(v->wo, v->ns));
    if (only_diffuse)
        return mask & ~bits(below | rgb_is_zerov(*f));
    if (!mask)
        return 0;
    vm diffuse = has_bits(v->bits, 1 << MATERIAL_DIFFUSE);
    unsigned other = mask & ~bits(diffuse), black = bits(diffuse & below);
    if (other) {
        struct materialv m;
        materials_gather(it->records->material, (const int32_t *)b->material + k, &m);
        framev local = frame_from_normalv(v->ns);
        vf pdf_lobes;
        rgbv lobes = eval_lobes(&m, lanes_of(other), v->diffuse, frame_to_localv(&local, v->wo),
                                frame_to_localv(&local, wi), &pdf_lobes);
        *f = rgb_select(diffuse, *f, rgb_scalev(lobes, cos_i));
        *pdf_w = vf_select(diffuse, *pdf_w, pdf_lobes);
    }
    return mask & ~black & ~bits(rgb_is_zerov(*f));
}

/* The samples that one call of connect_light() takes at each vertex. */
struct light_samples {
    uint32_t purpose; /* of the first sample; each further one adds 1 */
    int num, count;   /* samples of this call, and of a vertex in all */
    bool chosen;      /* of the light in b->choice, else of `light` */
    uint32_t light;
    struct lamp lamp; /* `light`, if connect_light() samples it in rows */
};

/* Samples the lamp for the vertices first .. end-1 and stores the samples, in rows of LANES, where their shadow rays
 * will be: direction in d, distance in tmax, pdf_w in tmin. A separate loop, like draw_numbers(). */
static __attribute__((noinline)) void sample_lamp_rows(struct batch *b, int first, int end,
                                                       const struct light_samples *what)
{
    for (int k = first, j = 0; k < end; k += LANES) {
        const vec3v p = v3_load(&b->p, k);
        for (int i = 0; i < what->num; i++, j++) {
            vf u[4];
            struct light_samplev ls;
            load_numbers(b, j, u);
            sample_lamp(&what->lamp, p, u, &ls);
            v3_store(&b->shadow.d, LANES * j, ls.wi);
            vf_store_any(b->shadow.tmax + LANES * j, ls.distance);
            vf_store_any(b->shadow.tmin + LANES * j, ls.pdf_w);
        }
    }
}

/* Loads row j of sample_lamp_rows(). It is not overwritten yet: shadow rays are packed no further than this row. */
INLINE void load_lamp_sample(const struct batch *b, int j, const struct lamp *lamp,
                             struct light_samplev *ls)
{
    ls->wi = v3_load(&b->shadow.d, LANES * j);
    ls->distance = vf_load_any(b->shadow.tmax + LANES * j);
    ls->pdf_w = vf_load_any(b->shadow.tmin + LANES * j);
    ls->radiance = lamp->radiance;
    ls->sphere = vi_set(-1);
    ls->delta = vm_set(false);
}

/* Samples the lights in b->choice: all lamps together, others one by one. */
static __attribute__((noinline)) void sample_chosen(const struct integrator *it,
                                                    const struct batch *b, int k, unsigned mask,
                                                    int j, struct light_samplev *out)
{
    const vi chosen = vi_load_any(b->choice + k);
    const vec3v p = v3_load(&b->p, k), n = v3_load(&b->ns, k);
    vf u[4];
    load_numbers(b, j, u);
    if (it->scene->starter == 0)
        mask &= ~sample_lamps(it->lights, b->choice + k, p, u, mask, out);
    while (mask) {
        const uint32_t light = b->choice[k + __builtin_ctz(mask)];
        const vm same = lanes_of(mask) & vi_eq(chosen, vi_set((int32_t)light));
        struct light_samplev one;
        sample_light_from(it->lights, light, p, n, u, bits(same), &one);
        *out = light_sample_select(same, &one, out);
        mask &= ~bits(same);
    }
}

/* Takes row j of samples of any lights; returns the lanes of the mask that have a sample. */
INLINE unsigned sample_light(const struct integrator *it, const struct batch *b, int k,
                             const struct vertexv *v, unsigned mask,
                             const struct light_samples *what, int j, struct light_samplev *ls)
{
    if (!what->chosen) {
        vf u[4];
        load_numbers(b, j, u);
        sample_light_from(it->lights, what->light, v->p, v->ns, u, mask, ls);
        return mask;
    }
    vf probability = vf_load_any(b->choice_probability + k);
    mask &= bits(vf_lt(vf_set(0), probability));
    struct light_samplev chosen = light_sample_none();
    sample_chosen(it, b, k, mask, j, &chosen);
    *ls = chosen;
    ls->pdf_w *= probability;
    return mask;
}

/* Where a shadow ray ends: short of the light, so that it does not hit it, by 1e-4 of the distance
 * and by twice the rounding error of the surface's coordinates: once because the ray starts that far
 * off the surface, once because the light is about as far from the scene's origin. Far from the
 * origin, or in a small scene, the second term is the larger. */
INLINE vf shadow_end(vf distance, vf eps)
{
    return distance * (1 - 1e-4f) - 2 * eps;
}

/* Takes one sample, by the numbers of row j, for the lanes of the mask of vertices k ..: appends shadow rays
 * to the `rays` that there are, and stores what they bring in row j. Returns the lanes that cast one. */
INLINE unsigned connect_once(const struct integrator *it, struct batch *b, int k,
                             const struct vertexv *v, unsigned mask,
                             const struct light_samples *what, bool in_rows, bool only_diffuse,
                             int j, int rays)
{
    vf pdf_bsdf;
    struct light_samplev ls;
    if (in_rows)
        load_lamp_sample(b, j, &what->lamp, &ls);
    else
        mask = sample_light(it, b, k, v, mask, what, j, &ls);
    mask &= bits(vf_lt(vf_set(0), ls.pdf_w));
    rgbv f;
    mask = scatter_towards(it, b, k, v, mask, ls.wi, only_diffuse, &f, &pdf_bsdf);
    /* Without a branch where there is little to save. */
    if (!only_diffuse && !mask)
        return 0;
    vf per = (float)what->count * ls.pdf_w, w = vf_set(1);
    if (it->opt.direct == DIRECT_MIS)
        w = vf_select(ls.delta, w, power_heuristic(per, pdf_bsdf));
    rgbv light = rgb_mulv(rgb_mulv(v->throughput, f), ls.radiance);
    rgb_store(&b->shadow_light, LANES * j, rgb_scalev(light, w / per));
    vi order = front_order(mask);
    pick_v3(&b->shadow.o, rays, v->off, order);
    pick_v3(&b->shadow.d, rays, ls.wi, order);
    vf_store_any(b->shadow.tmax + rays, pick(shadow_end(ls.distance, v->eps), order));
    vf_store_any(b->shadow.tmin + rays, vf_set(0));
    vf_store_any(b->shadow.ignore + rays, pick(as_vf(ls.sphere), order));
    return mask;
}

/* Adds what the shadow rays of vertices k .. let through, from row j on. */
INLINE void add_visible(struct batch *b, int k, int j, int num)
{
    rgbv g = rgb_load(&b->gathered, k);
    for (int end = j + num; j < end; j++) {
        unsigned cast = b->shadow_bits[j];
        unsigned seen = cast & ~spread_flags(b->occluded + b->shadow_first[j], cast);
        g = rgb_addv(g, rgb_where(lanes_of(seen), rgb_load(&b->shadow_light, LANES * j)));
    }
    rgb_store(&b->gathered, k, g);
}

/* Casts the shadow rays of lanes first .. end-1; returns how many. in_rows: of samples by sample_lamp_rows();
 * only_diffuse: all materials are. */
INLINE int connect_rows(const struct integrator *it, struct batch *b, int first, int end,
                        const struct light_samples *what, bool in_rows, bool only_diffuse)
{
    int rays = 0, j = 0;
    for (int k = first; k < end; k += LANES) {
        unsigned mask = scattering(b, k);
        struct vertexv v;
        load_vertex(b, k, &v);
        for (int i = 0; i < what->num; i++, j++) {
            unsigned cast =
                mask ? connect_once(it, b, k, &v, mask, what, in_rows, only_diffuse, j, rays) : 0;
            b->shadow_bits[j] = (uint16_t)cast;
            b->shadow_first[j] = (uint16_t)rays;
            rays += __builtin_popcount(cast);
        }
    }
    return rays;
}

/* The three cases of connect_rows(), each compiled by itself: in one function they would share registers. */
static __attribute__((noinline)) int connect_any(const struct integrator *it, struct batch *b,
                                                 int first, int end,
                                                 const struct light_samples *what)
{
    return connect_rows(it, b, first, end, what, false, false);
}
static __attribute__((noinline)) int connect_lamp(const struct integrator *it, struct batch *b,
                                                  int first, int end,
                                                  const struct light_samples *what)
{
    return connect_rows(it, b, first, end, what, true, false);
}
static __attribute__((noinline)) int connect_lamp_diffuse(const struct integrator *it,
                                                          struct batch *b, int first, int end,
                                                          const struct light_samples *what)
{
    return connect_rows(it, b, first, end, what, true, true);
}

/* True if only delta lights are sampled; other emitters are then found by directions. */
INLINE bool samples_only_delta(const struct integrator *it)
{
    return it->opt.direct != DIRECT_LIGHT && it->opt.direct != DIRECT_MIS;
}

/* Chooses a light for each lane by its u[3], which becomes its position within the choice. */
static __attribute__((noinline)) void choose(const struct integrator *it, struct batch *b, int n)
{
    const struct light_clusters *t = samples_only_delta(it) ? it->lights->delta : it->lights->all;
    for (int k = 0; k < n; k += LANES) {
        unsigned mask = scattering(b, k);
        if (!mask)
            continue;
        vf u = vf_load_any(b->numbers[3] + k), weight, all;
        vi cluster = choose_cluster(t, v3_load(&b->p, k), v3_load(&b->ns, k), u, &weight, &all, &u);
        mask &= bits(vf_lt(vf_set(0), all));
        vf_store_any(b->numbers[3] + k, u);
        vf_store_any(b->choice_weight + k, all);
        vf_store_any(b->choice_probability + k, vf_set(0));
        for (; mask; mask &= mask - 1) {
            const int i = __builtin_ctz(mask);
            float within;
            b->choice[k + i] =
                choose_in_cluster(t, LANE(cluster, i), b->numbers[3] + k + i, &within);
            b->choice_probability[k + i] = within * (LANE(weight, i) / LANE(all, i));
        }
    }
}

/* Samples a light from every lane of scattering(), for as many lanes at a time as there is room for all their
 * shadow rays. */
static void connect_light(const struct integrator *it, struct batch *b, int n, int vertex,
                          struct light_samples what)
{
    const struct light *light = &it->scene->lights[what.light];
    const bool in_rows = !what.chosen && is_lamp(light) && it->scene->starter == 0;
    if (in_rows)
        what.lamp = lamp_of(it->lights, what.light);
    const int most = BATCH_LANES / LANES / what.num * LANES;
    const int used = !what.chosen && light->kind == LIGHT_TRIANGLES ? 3 : 4;
    for (int first = 0; first < n; first += most) {
        const int end = n - first < most ? n : first + most;
        draw_numbers(it, b, first, end,
                     (struct draws){vertex + 1, what.purpose, what.num, .used = used});
        if (what.chosen)
            choose(it, b, n);
        if (in_rows)
            sample_lamp_rows(b, first, end, &what);
        int rays = !in_rows                    ? connect_any(it, b, first, end, &what)
                   : it->records->only_diffuse ? connect_lamp_diffuse(it, b, first, end, &what)
                                               : connect_lamp(it, b, first, end, &what);
        bvh_occluded(it->bvh, &b->shadow, b->active, rays, b->occluded, &b->stats);
        for (int k = first, j = 0; k < end; k += LANES, j += what.num)
            add_visible(b, k, j, what.num);
    }
}

/* Samples one uniform direction of the hemisphere, one of `count`, from every lane of scattering(); adds what emitters
 * send along it. Rays and what they bring stay in the lanes of their vertices. */
static __attribute__((noinline)) void connect_hemisphere(const struct integrator *it,
                                                         struct batch *b, int n, int vertex,
                                                         uint32_t purpose, int count)
{
    const struct scene *s = it->scene;
    int rays = 0;
    draw_numbers(it, b, 0, n, (struct draws){vertex + 1, purpose, 1, .used = 2});
    for (int k = 0; k < n; k += LANES) {
        unsigned mask = scattering(b, k);
        struct vertexv v;
        vf u[4], pdf_bsdf;
        rgbv f;
        load_vertex(b, k, &v);
        load_numbers(b, k / LANES, u);
        vec3v local = warp_uniform_hemisphere(u[0], u[1]);
        framev around = frame_from_normalv(v.ns);
        vec3v wi = frame_to_worldv(&around, local);
        mask = scatter_towards(it, b, k, &v, mask, wi, false, &f, &pdf_bsdf);
        vf per = (float)count * warp_uniform_hemisphere_pdf_w(local);
        rgb_store(&b->shadow_light, k, rgb_scalev(rgb_mulv(v.throughput, f), 1 / per));
        v3_store(&b->shadow.o, k, v.off);
        v3_store(&b->shadow.d, k, wi);
        vf_store_any(b->shadow.tmin + k, vf_set(0));
        vf_store_any(b->shadow.tmax + k, vf_set(INFINITY));
        b->shadow_bits[k / LANES] = (uint16_t)mask;
        for (; mask; mask &= mask - 1)
            b->shadow_lane[rays++] = (uint16_t)(k + __builtin_ctz(mask));
    }
    bvh_closest(it->bvh, &b->shadow, b->shadow_lane, rays, &b->shadow_hit, &b->stats);
    for (int k = 0; k < n; k += LANES) {
        const vec3v d = v3_load(&b->shadow.d, k);
        unsigned cast = b->shadow_bits[k / LANES];
        if (!cast)
            continue;
        struct surfacev at;
        surfaces(it, &b->shadow, &b->shadow_hit, k, &at);
        vm missed = vi_eq(vi_load_any(b->shadow_hit.prim + k), vi_set(-1));
        vm lit = ~missed & vi_lt(vi_set(-1), at.light);
        rgbv le = emitted(s, &at, &b->shadow_hit, k, d, cast & bits(lit));
        if (s->environment != NULL) {
            le = rgb_select(missed,
                            look_up_environment(s->environment, NULL, d, cast & bits(missed), NULL),
                            le);
            lit |= missed;
        }
        gather_light(b, k, lanes_of(cast) & lit, rgb_mulv(rgb_load(&b->shadow_light, k), le));
    }
}

static void connect(const struct integrator *it, struct batch *b, int n, int vertex)
{
    const struct scene *s = it->scene;
    uint32_t purpose = PURPOSE_LIGHT;
    const bool only_delta = samples_only_delta(it);
    const bool chooses = chooses_light(it);
    for (int k = 0; chooses && k < it->opt.light_samples; k++) {
        connect_light(
            it, b, n, vertex,
            (struct light_samples){
                .purpose = purpose++, .num = 1, .count = it->opt.light_samples, .chosen = true});
    }
    for (uint32_t l = 0; !chooses && l < s->num_lights; l++) {
        bool delta = light_is_delta(&s->lights[l]);
        if (!delta && only_delta)
            continue;
        int count = delta ? 1 : it->opt.light_samples;
        for (int k = 0; k < count; k += TOGETHER) {
            const int num = count - k < TOGETHER ? count - k : TOGETHER;
            connect_light(
                it, b, n, vertex,
                (struct light_samples){.purpose = purpose, .num = num, .count = count, .light = l});
            purpose += (uint32_t)num;
        }
    }
    if (it->opt.direct == DIRECT_HEMISPHERE) {
        uint32_t areas = light_count_areas(it->lights);
        int count = (int)(areas < MANY_LIGHTS ? areas : MANY_LIGHTS) * it->opt.light_samples;
        for (int k = 0; k < count; k++)
            connect_hemisphere(it, b, n, vertex, purpose++, count);
    }
}

#endif
