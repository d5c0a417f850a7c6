/* generate, shade, connect and scatter on eight paths at a time, compiled once for each instruction set.
 * Paths that go on are moved to the front of the batch after each vertex, so vectors stay full; rays
 * that light sampling casts lie side by side too. */
#include "lanes_kernel.h"

#include "first_hit.h"
#include "integrator_lane.h"
#include "lanes_bsdf.h"
#include "lanes_film.h"
#include "lanes_light.h"
#include "lanes_sampler.h"

static const vi lane_number = {0, 1, 2, 3, 4, 5, 6, 7};

static bool counts(const struct integrator *it, int bounces)
{
    return bounces >= it->opt.first_bounce && bounces <= it->opt.max_bounces;
}

/* Bits of the lanes of eight paths from k that a batch of n has. */
INLINE unsigned lanes_there(int k, int n)
{
    return n - k >= LANES ? 255 : (1u << (n - k)) - 1;
}

INLINE unsigned count_bits(unsigned mask)
{
    return (unsigned)__builtin_popcount(mask);
}

INLINE void pick_v3(struct vec3s *a, int i, vec3v v, vi order)
{
    v3_store(a, i, v3v(pick(v.x, order), pick(v.y, order), pick(v.z, order)));
}

INLINE void pick_rgb(struct rgbs *a, int i, rgbv c, vi order)
{
    rgb_store(a, i, (rgbv){pick(c.r, order), pick(c.g, order), pick(c.b, order)});
}

/* Quotient and remainder by the picture's width: exact in double, of numbers below 2^31. */
INLINE void split_pixel(vi pixel, int width, vf *x, vf *y)
{
    typedef double vd __attribute__((vector_size(64)));
    vd p = __builtin_convertvector(pixel, vd);
    vi row = __builtin_convertvector((p + 0.5) * (1.0 / width), vi);
    *x = vf_of_int(pixel - row * width);
    *y = vf_of_int(row);
}

/* Camera rays for all lanes, as camera_ray(). */
static void generate(const struct integrator *it, struct batch *b, int n)
{
    const struct camera *c = it->camera;
    const vf zero = vf_set(0), one = vf_set(1);
    for (int k = 0; k < n; k += LANES) {
        vi pixel = vi_load_any(b->pixel + k), sample = vi_load_any(b->sample + k);
        vf u[4], px, py;
        drawv(&it->opt.sampler, (vu)pixel, (vu)sample, 0, PURPOSE_CAMERA, u);
        split_pixel(pixel, c->width, &px, &py);
        vf x = px + u[0], y = py + u[1];
        vf sx = (2 * x / (float)c->width - 1) * c->tan_h;
        vf sy = (1 - 2 * y / (float)c->height) * c->tan_v;
        vec3v d = subv(madv(scalev(v3_all(c->right), sx), sy, v3_all(c->up)), v3_all(c->backward));
        vec3v o = v3_all(c->eye);
        if (c->lens_radius > 0) {
            vf lx, ly;
            warp_diskv(u[2], u[3], &lx, &ly);
            vec3v focus = scalev(d, vf_set(c->focal_distance));
            vec3v lens = madv(scalev(v3_all(c->right), lx * c->lens_radius), ly * c->lens_radius,
                              v3_all(c->up));
            o = addv(o, lens);
            d = subv(focus, lens);
        }
        v3_store(&b->ray.o, k, o);
        v3_store(&b->ray.d, k, normalizev(d));
        vf_store_any(b->ray.tmin + k, vf_set(c->near));
        vf_store_any(b->ray.tmax + k, vf_set(c->far));
        rgb_store(&b->throughput, k, (rgbv){one, one, one});
        rgb_store(&b->gathered, k, (rgbv){zero, zero, zero});
        vf_store_any(b->pdf_w + k, zero);
        vf_store_any(b->eta2 + k, one);
        vf_store_any(b->slot + k, (vf)(lane_number + k));
        vf_store_any(b->slot_pixel + k, (vf)pixel);
        vf_store_any(b->slot_sample + k, (vf)sample);
    }
}

/* struct surface, and what it is of. */
struct surfacev {
    vec3v p, ng, ns;
    vf eps;
    vi material, light;
};

/* surface_at() of eight hits; lanes that hit nothing get anything. */
INLINE void surfaces(const struct lanes_scene *ls, uint32_t num_triangles, const struct batch *b,
                     int k, vi prim, struct surfacev *s)
{
    int32_t row[LANES];
    prim = vi_select(vi_lt(prim, vi_set(0)), vi_set(0), prim);
    vf_store_any(row, (vf)prim);
    vf w[3][LANES];
    for (int i = 0; i < 3; i++)
        gather_columns(ls->primitive + LANES * i, RECORD_WORDS, row, w[i]);
    vf u = vf_load_any(b->hit.u + k), v = vf_load_any(b->hit.v + k);
    vec3v e1 = v3v(w[0][3], w[0][4], w[0][5]), e2 = v3v(w[0][6], w[0][7], w[1][0]);
    vec3v n0 = v3v(w[1][4], w[1][5], w[1][6]), n1 = v3v(w[1][7], w[2][0], w[2][1]);
    vec3v n2 = v3v(w[2][2], w[2][3], w[2][4]);
    s->p = madv(madv(v3v(w[0][0], w[0][1], w[0][2]), u, e1), v, e2);
    s->ng = v3v(w[1][1], w[1][2], w[1][3]);
    vec3v ns = madv(madv(scalev(n0, 1 - u - v), u, n1), v, n2);
    vf l = vf_sqrt(dotv(ns, ns));
    ns = v3_select(vf_lt(vf_set(0), l), scalev(ns, 1 / l), s->ng);
    s->ns = v3_negate_if(vf_lt(dotv(ns, s->ng), vf_set(0)), ns);
    s->eps = w[2][RECORD_EPS - 2 * LANES];
    s->material = (vi)w[2][RECORD_MATERIAL - 2 * LANES];
    s->light = (vi)w[2][RECORD_LIGHT - 2 * LANES];
    if (!ls->has_spheres)
        return;
    vi sphere = ~vi_lt(prim, vi_set((int32_t)num_triangles));
    if (!bits(sphere))
        return;
    vec3v centre = v3v(w[0][0], w[0][1], w[0][2]);
    vec3v n = normalizev(subv(
        madv(v3_load(&b->ray.o, k), vf_load_any(b->hit.t + k), v3_load(&b->ray.d, k)), centre));
    s->p = v3_select(sphere, madv(centre, w[0][RECORD_RADIUS], n), s->p);
    n = scalev(n, w[0][RECORD_OUT]);
    s->ng = v3_select(sphere, n, s->ng);
    s->ns = v3_select(sphere, n, s->ns);
}

/* What lane i of the eight adds by the scalar code; into b->gathered. */
static void gather_one(struct batch *b, int i, rgb c)
{
    rgbs_add(&b->gathered, i, c);
}

static void add_environment(const struct integrator *it, struct batch *b, int k, unsigned missed)
{
    for (; missed; missed &= missed - 1) {
        int i = k + __builtin_ctz(missed);
        gather_one(b, i, lane_environment(it, b, i));
    }
}

static void add_emission(const struct integrator *it, struct batch *b, int k, unsigned lit)
{
    for (; lit; lit &= lit - 1) {
        int i = k + __builtin_ctz(lit);
        uint32_t prim = b->hit.prim[i];
        const struct scene *s = it->scene;
        ray r = rays_get(&b->ray, i);
        struct surface at = surface_at(s, prim, &r, b->hit.t[i], b->hit.u[i], b->hit.v[i]);
        bool flat = prim < s->num_triangles;
        uint32_t sphere = flat ? 0 : prim - s->num_triangles;
        uint32_t m = flat ? s->tri_material[prim] : s->sphere_material[sphere];
        int32_t light = flat ? s->tri_light[prim] : s->sphere_light[sphere];
        gather_one(b, i, lane_emission(it, b, i, (uint32_t)light, &s->materials[m], &at));
    }
}

/* Adds emission, sets up the surfaces, and says which paths go on. */
static void shade(const struct integrator *it, struct batch *b, int n, int vertex)
{
    const struct lanes_scene *ls = it->lanes_scene;
    const bool lights_count = counts(it, vertex), last = vertex == it->opt.max_bounces;
    for (int k = 0; k < n; k += LANES) {
        unsigned there = lanes_there(k, n);
        vi prim = vi_load_any(b->hit.prim + k);
        unsigned missed = there & bits(vi_eq(prim, vi_set(-1)));
        if (missed && lights_count && it->scene->environment != NULL)
            add_environment(it, b, k, missed);
        there &= ~missed;
        struct surfacev s;
        surfaces(ls, it->scene->num_triangles, b, k, prim, &s);
        if (lights_count) {
            unsigned lit = there & bits(vi_lt(vi_set(-1), s.light));
            if (lit)
                add_emission(it, b, k, lit);
        }
        b->goes_on[k / LANES] = 0;
        if (last || !there)
            continue;
        int32_t row[LANES];
        vf material[LANES];
        vf_store_any(row, (vf)s.material);
        gather_columns(ls->material, MATERIAL_WORDS, row, material);
        vi about = (vi)material[MATERIAL_BITS];
        b->goes_on[k / LANES] = (uint8_t)(there & ~bits(has_bits(about, MATERIAL_IS_BLACK)));
        vec3v wo = negv(v3_load(&b->ray.d, k));
        vi front = vf_lt(vf_set(0), dotv(s.ng, wo));
        s.ng = v3_negate_if(~front, s.ng);
        s.ns = v3_negate_if(~front, s.ns);
        s.ns = v3_select(vf_le(dotv(s.ns, wo), vf_set(0)), s.ng, s.ns);
        v3_store(&b->p, k, s.p);
        v3_store(&b->ng, k, s.ng);
        v3_store(&b->ns, k, s.ns);
        v3_store(&b->wo, k, wo);
        vf_store_any(b->eps + k, s.eps);
        vf_store_any(b->material + k, (vf)s.material);
        vf_store_any(b->bits + k, (vf)about);
        rgb_store(&b->reflectance, k, (rgbv){material[0], material[1], material[2]});
        uint64_t flags = bytes_of(bits(front));
        memcpy(b->front + k, &flags, sizeof flags);
    }
}

/* Beckmann, lane by lane. */
static void scatter_towards_each(const struct integrator *it, const struct batch *b, int k,
                                 unsigned mask, const vec3v *wi, rgbv *f, vf *pdf_w)
{
    for (; mask; mask &= mask - 1) {
        int i = __builtin_ctz(mask);
        float p;
        rgb one = lane_scatter_towards(it, b, k + i, v3(wi->x[i], wi->y[i], wi->z[i]), &p);
        f->r[i] = one.r;
        f->g[i] = one.g;
        f->b[i] = one.b;
        (*pdf_w)[i] = p;
    }
}

/* lane_scatter_towards() for the lanes of the mask; which of them scatter some. */
INLINE unsigned scatter_towards(const struct integrator *it, const struct batch *b, int k,
                                unsigned mask, vec3v wi, rgbv *f, vf *pdf_w)
{
    const vf zero = vf_set(0);
    vec3v ns = v3_load(&b->ns, k), wo = v3_load(&b->wo, k);
    vf cos_i = dotv(ns, wi);
    mask &= bits(vf_lt(zero, cos_i) & vf_lt(zero, dotv(v3_load(&b->ng, k), wi)));
    if (!mask)
        return 0;
    *f = rgb_scalev(rgb_scalev(rgb_load(&b->reflectance, k), vf_set(INV_PI_F)), cos_i);
    *pdf_w = cos_i * INV_PI_F;
    vi about = vi_load_any(b->bits + k), diffuse = has_bits(about, 1 << MATERIAL_DIFFUSE);
    unsigned rough = mask & ~bits(diffuse);
    unsigned black = bits(diffuse & ~vf_lt(zero, dotv(wo, ns)));
    if (rough) {
        unsigned beckmann = rough & bits(has_bits(about, MATERIAL_IS_BECKMANN));
        if (rough & ~beckmann) {
            struct materialv m;
            materials_gather(it->lanes_scene, (const int32_t *)b->material + k, &m);
            framev local = frame_from_normalv(ns);
            vf pdf_ggx;
            rgbv ggx =
                eval_ggx(&m, frame_to_localv(&local, wo), frame_to_localv(&local, wi), &pdf_ggx);
            *f = rgb_select(diffuse, *f, rgb_scalev(ggx, cos_i));
            *pdf_w = vf_select(diffuse, *pdf_w, pdf_ggx);
        }
        if (beckmann)
            scatter_towards_each(it, b, k, beckmann, &wi, f, pdf_w);
    }
    return mask & ~black & ~bits(rgb_is_zerov(*f));
}

/* surface_origin() */
INLINE vec3v leaving(const struct batch *b, int k, vec3v wi)
{
    vec3v ng = v3_load(&b->ng, k);
    vf eps = vf_load_any(b->eps + k);
    return madv(v3_load(&b->p, k), vf_select(vf_lt(dotv(wi, ng), vf_set(0)), -eps, eps), ng);
}

/* power_heuristic() */
INLINE vf power_heuristicv(vf a, vf b)
{
    vf r = b / a;
    return vf_select(vf_lt(vf_set(0), a), 1 / (1 + r * r), vf_set(0));
}

/* Adds what shadow rays let through. */
static void add_visible(struct batch *b, int n)
{
    const rgbv black = {vf_set(0), vf_set(0), vf_set(0)};
    for (int k = 0; k < n; k += LANES) {
        unsigned cast = b->shadow_bits[k / LANES];
        unsigned seen = cast & ~spread_flags(b->occluded + b->shadow_first[k / LANES], cast);
        rgbv l = rgb_select(lanes_of(seen), rgb_load(&b->shadow_light, k), black);
        rgbv g = rgb_load(&b->gathered, k);
        rgb_store(&b->gathered, k, (rgbv){g.r + l.r, g.g + l.g, g.b + l.b});
    }
}

/* One sample of a light from every lane that is not mirror-like, as one of `count` per lane; of light l,
 * or if `chosen` of the one in b->choice. */
static void connect_light(const struct integrator *it, struct batch *b, int n, int vertex,
                          uint32_t purpose, int count, bool chosen, uint32_t l)
{
    const struct scene *s = it->scene;
    const bool mis = it->opt.direct == DIRECT_MIS;
    int rays = 0;
    for (int k = 0; k < n; k += LANES) {
        unsigned mask = b->goes_on[k / LANES];
        mask &= bits(has_bits(vi_load_any(b->bits + k), MATERIAL_SCATTERS));
        b->shadow_bits[k / LANES] = 0;
        b->shadow_first[k / LANES] = (uint16_t)rays;
        if (!mask)
            continue;
        vf u[4], pdf_bsdf;
        drawv(&it->opt.sampler, (vu)vi_load_any(b->slot_pixel + k),
              (vu)vi_load_any(b->slot_sample + k), (uint32_t)vertex + 1, purpose, u);
        struct light_samplev ls = {.sphere = vi_set(-1), .pdf_w = vf_set(0)};
        vec3v p = v3_load(&b->p, k);
        if (chosen) {
            uint32_t light[LANES];
            for (int i = 0; i < LANES; i++)
                light[i] = b->choice[k + i].light;
            vf probability = vf_load_any(b->choice_probability + k);
            mask &= bits(vf_lt(vf_set(0), probability));
            sample_each(it->lights, light, &p, u, mask, &ls);
            ls.pdf_w *= probability;
        } else {
            sample_lightv(s, it->lanes_scene, it->lights, l, p, u, mask, &ls);
        }
        mask &= bits(vf_lt(vf_set(0), ls.pdf_w));
        rgbv f;
        mask = scatter_towards(it, b, k, mask, ls.wi, &f, &pdf_bsdf);
        if (!mask)
            continue;
        vf per = (float)count * ls.pdf_w, w = vf_set(1);
        if (mis)
            w = vf_select(ls.delta, w, power_heuristicv(per, pdf_bsdf));
        rgbv light = rgb_mulv(rgb_mulv(rgb_load(&b->throughput, k), f), ls.radiance);
        rgb_store(&b->shadow_light, k, rgb_scalev(light, w / per));
        vi order = front_order(mask);
        pick_v3(&b->shadow.o, rays, leaving(b, k, ls.wi), order);
        pick_v3(&b->shadow.d, rays, ls.wi, order);
        vf end = ls.distance * (1 - 1e-4f) - 2 * vf_load_any(b->eps + k);
        vf_store_any(b->shadow.tmax + rays, pick(end, order));
        vf_store_any(b->shadow.tmin + rays, vf_set(0));
        vf_store_any(b->shadow.ignore + rays, pick((vf)ls.sphere, order));
        b->shadow_bits[k / LANES] = (uint8_t)mask;
        rays += (int)count_bits(mask);
    }
    bvh_occluded(it->bvh, &b->shadow, b->active, rays, b->occluded, &b->stats);
    add_visible(b, n);
}

/* Every lane chooses a light. */
static void choose(const struct integrator *it, struct batch *b, int n, int vertex,
                   uint32_t purpose, bool only_delta)
{
    for (int k = 0; k < n; k += LANES) {
        vf u[4];
        drawv(&it->opt.sampler, (vu)vi_load_any(b->slot_pixel + k),
              (vu)vi_load_any(b->slot_sample + k), (uint32_t)vertex + 1, purpose, u);
        for (unsigned mask = b->goes_on[k / LANES]; mask; mask &= mask - 1) {
            int i = __builtin_ctz(mask);
            b->choice[k + i] = light_choose(it->lights, only_delta, u[0][i]);
            b->choice_probability[k + i] = b->choice[k + i].probability;
        }
    }
}

static void connect(const struct integrator *it, struct batch *b, int n, int vertex)
{
    const struct scene *s = it->scene;
    uint32_t purpose = PURPOSE_LIGHT;
    bool only_delta = it->opt.direct == DIRECT_BSDF;
    if (chooses_light(it)) {
        for (int k = 0; k < it->opt.light_samples; k++) {
            choose(it, b, n, vertex, purpose++, only_delta);
            connect_light(it, b, n, vertex, purpose++, it->opt.light_samples, true, 0);
        }
        return;
    }
    for (uint32_t l = 0; l < s->num_lights; l++) {
        bool delta = light_is_delta(&s->lights[l]);
        if (!delta && only_delta)
            continue;
        int count = delta ? 1 : it->opt.light_samples;
        for (int k = 0; k < count; k++)
            connect_light(it, b, n, vertex, purpose++, count, false, l);
    }
}

/* bsdf_sample_direction() of Beckmann, lane by lane. */
static void sample_each_bsdf(const struct integrator *it, const struct batch *b, int k,
                             unsigned mask, const vec3v *wo, const vf u[4], struct bsdf_samplev *s)
{
    for (; mask; mask &= mask - 1) {
        int i = __builtin_ctz(mask);
        struct bsdf_sample one =
            bsdf_sample_direction(&it->scene->materials[b->material[k + i]], b->front[k + i],
                                  v3(wo->x[i], wo->y[i], wo->z[i]), u[0][i], u[1][i], u[2][i]);
        s->wi.x[i] = one.wi.x;
        s->wi.y[i] = one.wi.y;
        s->wi.z[i] = one.wi.z;
        s->weight.r[i] = one.weight.r;
        s->weight.g[i] = one.weight.g;
        s->weight.b[i] = one.weight.b;
        s->pdf_w[i] = one.pdf_w;
    }
}

/* Directions for the lanes of the mask. */
INLINE void sample_bsdf(const struct integrator *it, const struct batch *b, int k, unsigned mask,
                        vec3v wo, const vf u[4], struct bsdf_samplev *s)
{
    const vf zero = vf_set(0);
    vi about = vi_load_any(b->bits + k), above = vf_lt(zero, wo.z);
    vi diffuse = has_bits(about, 1 << MATERIAL_DIFFUSE);
    *s = (struct bsdf_samplev){.eta2 = vf_set(1), .delta = vi_set(0)};
    s->wi = warp_cosine_hemispherev(u[0], u[1]);
    s->pdf_w = vf_select(diffuse & above, vf_max(zero, s->wi.z * INV_PI_F), zero);
    s->weight = rgb_load(&b->reflectance, k);
    unsigned other = mask & ~bits(diffuse) & bits(above);
    if (!other)
        return;
    struct materialv m;
    materials_gather(it->lanes_scene, (const int32_t *)b->material + k, &m);
    vi lanes = lanes_of(other);
    vi mirror = lanes & has_bits(about, 1 << MATERIAL_MIRROR);
    if (bits(mirror))
        reflectv(mirror, wo, m.reflectance, s);
    vi dielectric = lanes & has_bits(about, 1 << MATERIAL_GLASS | 1 << MATERIAL_REFRACTION);
    if (bits(dielectric)) {
        uint64_t flags;
        memcpy(&flags, b->front + k, sizeof flags);
        sample_dielectricv(&m, dielectric, lanes_of(spread_flags(&flags, 255)), wo, u[2], s);
    }
    vi rough = lanes & has_bits(about, 1 << MATERIAL_MICROFACET);
    vi beckmann = rough & has_bits(about, MATERIAL_IS_BECKMANN);
    if (bits(rough & ~beckmann))
        sample_ggxv(&m, rough & ~beckmann, wo, u[0], u[1], s);
    if (bits(beckmann))
        sample_each_bsdf(it, b, k, bits(beckmann), &wo, u, s);
}

/* Chance to go on, as survival(). */
INLINE vf survival(const struct integrator_options *o, int vertex, rgbv throughput, vf eta2)
{
    if (o->roulette == ROULETTE_THROUGHPUT && vertex >= 2)
        return vf_min(vf_set(1), rgb_maxv(throughput) * eta2);
    return vf_set(o->roulette == ROULETTE_FIXED && vertex >= 1 ? o->survival : 1);
}

/* The paths of the mask are over. */
INLINE void finish(struct batch *b, int k, unsigned over)
{
    for (; over; over &= over - 1) {
        int i = k + __builtin_ctz(over);
        rgbs_set(&b->radiance, (int)b->slot[i], rgbs_get(&b->gathered, i));
    }
}

/* Sets up the next ray of every path that goes on, and moves these to the front; how many. */
static int scatter(const struct integrator *it, struct batch *b, int n, int vertex, bool only_delta)
{
    const vf zero = vf_set(0);
    int kept = 0;
    for (int k = 0; k < n; k += LANES) {
        unsigned there = lanes_there(k, n), mask = b->goes_on[k / LANES];
        if (!mask) {
            finish(b, k, there);
            continue;
        }
        vf u[4];
        vi pixel = vi_load_any(b->slot_pixel + k), sample = vi_load_any(b->slot_sample + k);
        drawv(&it->opt.sampler, (vu)pixel, (vu)sample, (uint32_t)vertex + 1, PURPOSE_BSDF, u);
        framev f = frame_from_normalv(v3_load(&b->ns, k));
        vec3v wo = frame_to_localv(&f, v3_load(&b->wo, k));
        struct bsdf_samplev s;
        sample_bsdf(it, b, k, mask, wo, u, &s);
        vec3v wi = frame_to_worldv(&f, s.wi);
        vi ok = vf_lt(zero, s.pdf_w) & vf_lt(zero, s.wi.z * dotv(v3_load(&b->ng, k), wi));
        if (only_delta)
            ok &= s.delta;
        rgbv throughput = rgb_mulv(rgb_load(&b->throughput, k), s.weight);
        vf eta2 = vf_load_any(b->eta2 + k) * s.eta2;
        vf go_on = survival(&it->opt, vertex, throughput, eta2);
        vi at_risk = vf_lt(go_on, vf_set(1));
        ok &= ~at_risk | vf_lt(u[3], go_on);
        throughput = rgb_scalev(throughput, vf_select(at_risk, 1 / go_on, vf_set(1)));
        mask &= bits(ok);
        finish(b, k, there & ~mask);
        vi order = front_order(mask);
        vec3v o = leaving(b, k, wi);
        pick_rgb(&b->throughput, kept, throughput, order);
        pick_rgb(&b->gathered, kept, rgb_load(&b->gathered, k), order);
        pick_v3(&b->ray.o, kept, o, order);
        pick_v3(&b->ray.d, kept, wi, order);
        vf_store_any(b->ray.tmin + kept, zero);
        vf_store_any(b->ray.tmax + kept, vf_set(INFINITY));
        vf_store_any(b->pdf_w + kept, pick(vf_select(s.delta, zero, s.pdf_w), order));
        vf_store_any(b->eta2 + kept, pick(eta2, order));
        vf_store_any(b->slot_pixel + kept, pick((vf)pixel, order));
        vf_store_any(b->slot_sample + kept, pick((vf)sample, order));
        vf_store_any(b->slot + kept, pick(vf_load_any(b->slot + k), order));
        kept += (int)count_bits(mask);
    }
    return kept;
}

static void integrate_lanes(const struct integrator *it, struct batch *b, int n)
{
    const bool last_ray = it->opt.direct == DIRECT_BSDF || it->opt.direct == DIRECT_MIS;
    generate(it, b, n);
    for (int i = 0; i < n; i++)
        b->active[i] = (uint16_t)i;
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

const struct lanes_kernel FOR_ISA(lanes_kernel) = {.integrate = integrate_lanes,
                                                   .film_add = film_add_lanes};
