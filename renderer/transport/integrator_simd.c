/* generate, shade, connect and scatter on eight paths at a time, compiled once for each instruction set.
 * Paths that go on are moved to the front of the batch after each vertex, so vectors stay full; rays
 * that light sampling casts lie side by side too. */
#include "integrator_simd.h"

#include "aov.h"
#include "path_vertex.h"
#include "renderer/shading/bsdf_simd.h"
#include "film_simd.h"
#include "renderer/shading/light_simd.h"
#include "renderer/math/sampler_simd.h"

/* Samples of a light at a vertex whose rays go to the kernel together. */
enum { TOGETHER = 4 };

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

INLINE void draw_rows(struct batch *b, enum sampler_kind kind, const struct philox_keys *keys,
                      int first, int end, int vertex, uint32_t purpose, int num)
{
    for (int k = first, j = 0; k < end; k += LANES) {
        vu pixel = (vu)vi_load_any(b->slot_pixel + k), sample = (vu)vi_load_any(b->slot_sample + k);
        for (int i = 0; i < num; i++, j += LANES) {
            vf u[4];
            drawv(kind, keys, pixel, sample, (uint32_t)vertex, purpose + (uint32_t)i, u);
            for (int d = 0; d < 4; d++)
                vf_store_any(b->numbers[d] + j, u[d]);
        }
    }
}

/* The numbers of `num` purposes for the lanes first .. end, eight lanes after eight, into rows of
 * b->numbers. A loop of its own, short enough that the machine works on several rounds of it at once. */
static __attribute__((noinline)) void draw_numbers(const struct integrator *it, struct batch *b,
                                                   int first, int end, int vertex, uint32_t purpose,
                                                   int num)
{
    const struct philox_keys keys = philox_keys(it->opt.sampler.seed);
    switch (it->opt.sampler.kind) {
    case SAMPLER_INDEPENDENT:
        draw_rows(b, SAMPLER_INDEPENDENT, &keys, first, end, vertex, purpose, num);
        break;
    case SAMPLER_SOBOL: draw_rows(b, SAMPLER_SOBOL, &keys, first, end, vertex, purpose, num); break;
    }
}

INLINE void load_numbers(const struct batch *b, int row, vf u[4])
{
    for (int d = 0; d < 4; d++)
        u[d] = vf_load_any(b->numbers[d] + LANES * row);
}

/* Camera rays for all lanes, as camera_ray(). */
static void generate(const struct integrator *it, struct batch *b, int n)
{
    const struct camera *c = it->camera;
    const vf zero = vf_set(0), one = vf_set(1);
    for (int k = 0; k < n; k += LANES) {
        vf_store_any(b->slot + k, (vf)(lane_number + k));
        vf_store_any(b->slot_pixel + k, vf_load_any(b->pixel + k));
        vf_store_any(b->slot_sample + k, vf_load_any(b->sample + k));
    }
    draw_numbers(it, b, 0, n, 0, PURPOSE_CAMERA, 1);
    for (int k = 0; k < n; k += LANES) {
        vf u[4], px, py;
        load_numbers(b, k / LANES, u);
        split_pixel(vi_load_any(b->pixel + k), c->width, &px, &py);
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
    }
}

/* struct surface, and what it is of. */
struct surfacev {
    vec3v p, ng, ns;
    vf eps;
    vi material, light;
};

/* Shading normals, on the side of ng. */
INLINE vec3v interpolate_normals(vec3v n0, vec3v n1, vec3v n2, vec3v ng, vf u, vf v)
{
    vec3v ns = madv(madv(scalev(n0, 1 - u - v), u, n1), v, n2);
    vf l = vf_sqrt(dotv(ns, ns));
    ns = v3_select(vf_lt(vf_set(0), l), scalev(ns, 1 / l), ng);
    return v3_negate_if(vf_lt(dotv(ns, ng), vf_set(0)), ns);
}

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
    s->ns = interpolate_normals(n0, n1, n2, s->ng, u, v);
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

/* Eight vertices as samples of lights want them. */
struct vertexv {
    vec3v p, ng, ns, wo, off; /* off: where rays leave on the side of ng */
    rgbv throughput, diffuse; /* diffuse: reflectance / pi */
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
    v->diffuse = rgb_scalev(rgb_load(&b->reflectance, k), vf_set(INV_PI_F));
    v->bits = vi_load_any(b->bits + k);
}

/* Beckmann, lane by lane. */
static __attribute__((noinline)) void scatter_towards_each(const struct integrator *it,
                                                           const struct batch *b, int k,
                                                           unsigned mask, const vec3v *wi, rgbv *f,
                                                           vf *pdf_w)
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
                                const struct vertexv *v, unsigned mask, vec3v wi, bool only_diffuse,
                                rgbv *f, vf *pdf_w)
{
    const vf zero = vf_set(0);
    vf cos_i = dotv(v->ns, wi);
    mask &= bits(vf_lt(zero, cos_i) & vf_lt(zero, dotv(v->ng, wi)));
    *f = rgb_scalev(v->diffuse, cos_i);
    *pdf_w = cos_i * INV_PI_F;
    vi below = ~vf_lt(zero, dotv(v->wo, v->ns));
    if (only_diffuse)
        return mask & ~bits(below | rgb_is_zerov(*f));
    if (!mask)
        return 0;
    vi diffuse = has_bits(v->bits, 1 << MATERIAL_DIFFUSE);
    unsigned rough = mask & ~bits(diffuse), black = bits(diffuse & below);
    if (rough) {
        unsigned beckmann = rough & bits(has_bits(v->bits, MATERIAL_IS_BECKMANN));
        if (rough & ~beckmann) {
            struct materialv m;
            materials_gather(it->lanes_scene, (const int32_t *)b->material + k, &m);
            framev local = frame_from_normalv(v->ns);
            vf pdf_ggx;
            rgbv ggx =
                eval_ggx(&m, frame_to_localv(&local, v->wo), frame_to_localv(&local, wi), &pdf_ggx);
            *f = rgb_select(diffuse, *f, rgb_scalev(ggx, cos_i));
            *pdf_w = vf_select(diffuse, *pdf_w, pdf_ggx);
        }
        if (beckmann) {
            rgbv each = *f;
            vf pdf_each = *pdf_w;
            scatter_towards_each(it, b, k, beckmann, &wi, &each, &pdf_each);
            *f = each;
            *pdf_w = pdf_each;
        }
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

/* Samples of a light that one call for each vertex takes. */
struct light_samples {
    uint32_t purpose; /* of the first; the next has the next */
    int num, count;   /* this call's, and what a vertex takes in all */
    bool chosen;      /* of the light in b->choice, else of `light` */
    uint32_t light;
    struct lamp lamp; /* the light, if it is one, where only diffuse things scatter */
};

/* Samples of the lamp for the vertices first .. end, a row of each, where their shadow rays will be: directions,
 * distances and, for tmin, pdf_w. A loop of its own, as draw_numbers(). */
static __attribute__((noinline)) void sample_lamp(struct batch *b, int first, int end,
                                                  const struct light_samples *what)
{
    for (int k = first, j = 0; k < end; k += LANES) {
        const vec3v p = v3_load(&b->p, k);
        for (int i = 0; i < what->num; i++, j++) {
            vf u[4];
            struct light_samplev ls;
            load_numbers(b, j, u);
            sample_lampv(&what->lamp, p, u, &ls);
            v3_store(&b->shadow.d, LANES * j, ls.wi);
            vf_store_any(b->shadow.tmax + LANES * j, ls.distance);
            vf_store_any(b->shadow.tmin + LANES * j, ls.pdf_w);
        }
    }
}

/* In time: rays are stored no further back than in the row of their sample. */
INLINE void load_lamp_sample(const struct batch *b, int j, const struct lamp *lamp,
                             struct light_samplev *ls)
{
    ls->wi = v3_load(&b->shadow.d, LANES * j);
    ls->distance = vf_load_any(b->shadow.tmax + LANES * j);
    ls->pdf_w = vf_load_any(b->shadow.tmin + LANES * j);
    ls->radiance = rgb_all(lamp->radiance);
    ls->sphere = vi_set(-1);
    ls->delta = vi_set(0);
}

/* The like for other lights and one row; which lanes of the mask have a light to sample. */
INLINE unsigned sample_light(const struct integrator *it, const struct batch *b, int k,
                             const struct vertexv *v, unsigned mask,
                             const struct light_samples *what, int j, struct light_samplev *ls)
{
    vf u[4];
    load_numbers(b, j, u);
    *ls = (struct light_samplev){.sphere = vi_set(-1), .pdf_w = vf_set(0)};
    if (!what->chosen) {
        sample_lightv(it->scene, it->lanes_scene, it->lights, what->light, v->p, u, mask, ls);
        return mask;
    }
    uint32_t light[LANES];
    for (int i = 0; i < LANES; i++)
        light[i] = b->choice[k + i].light;
    vf probability = vf_load_any(b->choice_probability + k);
    mask &= bits(vf_lt(vf_set(0), probability));
    sample_each(it->lights, light, v->p, u, mask, ls);
    ls->pdf_w *= probability;
    return mask;
}

/* A sample, by the numbers of row j, for the lanes of the mask of vertices k ..: shadow rays behind the
 * `rays` that there are, and what they bring into row j; the lanes that cast one. */
INLINE unsigned connect_once(const struct integrator *it, struct batch *b, int k,
                             const struct vertexv *v, unsigned mask,
                             const struct light_samples *what, bool simple, int j, int rays)
{
    vf pdf_bsdf;
    struct light_samplev ls;
    if (simple)
        load_lamp_sample(b, j, &what->lamp, &ls);
    else
        mask = sample_light(it, b, k, v, mask, what, j, &ls);
    mask &= bits(vf_lt(vf_set(0), ls.pdf_w));
    rgbv f;
    mask = scatter_towards(it, b, k, v, mask, ls.wi, simple, &f, &pdf_bsdf);
    /* Without a branch where there is little to save. */
    if (!simple && !mask)
        return 0;
    vf per = (float)what->count * ls.pdf_w, w = vf_set(1);
    if (it->opt.direct == DIRECT_MIS)
        w = vf_select(ls.delta, w, power_heuristicv(per, pdf_bsdf));
    rgbv light = rgb_mulv(rgb_mulv(v->throughput, f), ls.radiance);
    rgb_store(&b->shadow_light, LANES * j, rgb_scalev(light, w / per));
    vi order = front_order(mask);
    pick_v3(&b->shadow.o, rays, v->off, order);
    pick_v3(&b->shadow.d, rays, ls.wi, order);
    vf end = ls.distance * (1 - 1e-4f) - 2 * v->eps;
    vf_store_any(b->shadow.tmax + rays, pick(end, order));
    vf_store_any(b->shadow.tmin + rays, vf_set(0));
    vf_store_any(b->shadow.ignore + rays, pick((vf)ls.sphere, order));
    return mask;
}

/* Adds what the shadow rays of vertices k .. let through, from row j on. */
INLINE void add_visible(struct batch *b, int k, int j, int num)
{
    const rgbv black = {vf_set(0), vf_set(0), vf_set(0)};
    rgbv g = rgb_load(&b->gathered, k);
    for (int end = j + num; j < end; j++) {
        unsigned cast = b->shadow_bits[j];
        unsigned seen = cast & ~spread_flags(b->occluded + b->shadow_first[j], cast);
        rgbv l = rgb_select(lanes_of(seen), rgb_load(&b->shadow_light, LANES * j), black);
        g = (rgbv){g.r + l.r, g.g + l.g, g.b + l.b};
    }
    rgb_store(&b->gathered, k, g);
}

/* Shadow rays from lanes first .. end; how many. */
INLINE int connect_rows(const struct integrator *it, struct batch *b, int first, int end,
                        const struct light_samples *what, bool simple)
{
    int rays = 0, j = 0;
    for (int k = first; k < end; k += LANES) {
        unsigned mask = b->goes_on[k / LANES];
        mask &= bits(has_bits(vi_load_any(b->bits + k), MATERIAL_SCATTERS));
        struct vertexv v;
        load_vertex(b, k, &v);
        for (int i = 0; i < what->num; i++, j++) {
            unsigned cast = mask ? connect_once(it, b, k, &v, mask, what, simple, j, rays) : 0;
            b->shadow_bits[j] = (uint8_t)cast;
            b->shadow_first[j] = (uint16_t)rays;
            rays += (int)count_bits(cast);
        }
    }
    return rays;
}

/* Samples a light from every lane that is not mirror-like, for as many lanes at a time as all these shadow
 * rays have room for. */
static void connect_light(const struct integrator *it, struct batch *b, int n, int vertex,
                          struct light_samples what)
{
    const struct light *light = &it->scene->lights[what.light];
    const bool simple = !what.chosen && is_lamp(light) && it->lanes_scene->only_diffuse;
    if (simple)
        what.lamp = lamp_of(it->scene, it->lanes_scene, it->lights, light);
    const int most = BATCH_LANES / LANES / what.num * LANES;
    for (int first = 0; first < n; first += most) {
        const int end = n - first < most ? n : first + most;
        draw_numbers(it, b, first, end, vertex + 1, what.purpose, what.num);
        if (simple)
            sample_lamp(b, first, end, &what);
        int rays = simple ? connect_rows(it, b, first, end, &what, true)
                          : connect_rows(it, b, first, end, &what, false);
        bvh_occluded(it->bvh, &b->shadow, b->active, rays, b->occluded, &b->stats);
        for (int k = first, j = 0; k < end; k += LANES, j += what.num)
            add_visible(b, k, j, what.num);
    }
}

/* Every lane chooses a light. */
static void choose(const struct integrator *it, struct batch *b, int n, int vertex,
                   uint32_t purpose, bool only_delta)
{
    draw_numbers(it, b, 0, n, vertex + 1, purpose, 1);
    for (int k = 0; k < n; k += LANES)
        for (unsigned mask = b->goes_on[k / LANES]; mask; mask &= mask - 1) {
            int i = k + __builtin_ctz(mask);
            b->choice[i] = light_choose(it->lights, only_delta, b->numbers[0][i]);
            b->choice_probability[i] = b->choice[i].probability;
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
            connect_light(it, b, n, vertex,
                          (struct light_samples){.purpose = purpose++,
                                                 .num = 1,
                                                 .count = it->opt.light_samples,
                                                 .chosen = true});
        }
        return;
    }
    for (uint32_t l = 0; l < s->num_lights; l++) {
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
}

/* bsdf_sample_direction() of Beckmann, lane by lane. */
static __attribute__((noinline)) void sample_each_bsdf(const struct integrator *it,
                                                       const struct batch *b, int k, unsigned mask,
                                                       const vec3v *wo, const vf u[4],
                                                       struct bsdf_samplev *s)
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
    if (bits(beckmann)) {
        const vf numbers[4] = {u[0], u[1], u[2], u[3]};
        struct bsdf_samplev each = *s;
        sample_each_bsdf(it, b, k, bits(beckmann), &wo, numbers, &each);
        *s = each;
    }
}

/* Chance to go on, as survival(). */
INLINE vf survival(const struct integrator_options *o, int vertex, rgbv throughput, vf eta2)
{
    if (o->roulette == ROULETTE_THROUGHPUT && vertex >= 2)
        return vf_min(vf_set(1), roulette_factor(o) * (rgb_maxv(throughput) * eta2));
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
    draw_numbers(it, b, 0, n, vertex + 1, PURPOSE_BSDF, 1);
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
        vf_store_any(b->slot_pixel + kept, pick(vf_load_any(b->slot_pixel + k), order));
        vf_store_any(b->slot_sample + kept, pick(vf_load_any(b->slot_sample + k), order));
        vf_store_any(b->slot + kept, pick(vf_load_any(b->slot + k), order));
        kept += (int)count_bits(mask);
    }
    return kept;
}

/* Shading normals of hits on triangles, from the scene itself: for one ray a pixel records do not pay. */
INLINE vec3v triangle_normals(const struct scene *s, const struct batch *b, int k, vi prim)
{
    enum { WORDS = 9 };
    const float *const from[2] = {&s->position[0].x, &s->normal[0].x};
    int32_t row[LANES];
    vf_store_any(row, (vf)prim);
    vf w[2][LANES], last[2][LANES];
    for (int i = 0; i < 2; i++) {
        gather_columns(from[i], WORDS, row, w[i]);
        gather_columns(from[i] + 1, WORDS, row, last[i]);
    }
    vec3v p = v3v(w[0][0], w[0][1], w[0][2]);
    vec3v e1 = subv(v3v(w[0][3], w[0][4], w[0][5]), p);
    vec3v e2 = subv(v3v(w[0][6], w[0][7], last[0][7]), p);
    return interpolate_normals(v3v(w[1][0], w[1][1], w[1][2]), v3v(w[1][3], w[1][4], w[1][5]),
                               v3v(w[1][6], w[1][7], last[1][7]), normalizev(crossv(e1, e2)),
                               vf_load_any(b->hit.u + k), vf_load_any(b->hit.v + k));
}

/* integrate_normals() of integrator.c, behind the rays. */
static __attribute__((noinline)) void show_normals(const struct integrator *it, struct batch *b,
                                                   int n)
{
    const struct scene *s = it->scene;
    const vf zero = vf_set(0);
    for (int k = 0; k < n; k += LANES) {
        vi prim = vi_load_any(b->hit.prim + k);
        vi flat = vi_lt(vi_set(-1), prim) & vi_lt(prim, vi_set((int32_t)s->num_triangles));
        rgbv c = {zero, zero, zero};
        if (bits(flat)) {
            vec3v ns = triangle_normals(s, b, k, prim & flat);
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

static void integrate_lanes(const struct integrator *it, struct batch *b, int n)
{
    const bool last_ray = it->opt.direct == DIRECT_BSDF || it->opt.direct == DIRECT_MIS;
    generate(it, b, n);
    for (int i = 0; i < BATCH_LANES; i++) /* n of paths, but of shadow rays there may be more */
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

const struct lanes_kernel FOR_ISA(lanes_kernel) = {.integrate = integrate_lanes,
                                                   .film_add = film_add_lanes};
