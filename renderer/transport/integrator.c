#include "integrator.h"

#include "renderer/scene/environment.h"
#include "aov.h"
#include "path_vertex.h"
#include "integrator_simd.h"
#include "renderer/shading/scene_simd.h"
#include "renderer/math/warp.h"

const char *const integrator_kind_names[] = {"path", "normals", NULL};
const char *const direct_kind_names[] = {"hemisphere", "light", "bsdf", "mis", NULL};

/* Chance to go on from this vertex (0: the first that the camera sees). */
static float survival(const struct integrator_options *o, int vertex, rgb throughput, float eta2)
{
    switch (o->roulette) {
    case ROULETTE_OFF: break;
    case ROULETTE_THROUGHPUT:
        return vertex >= 2 ? minf(1, roulette_factor(o) * (rgb_max(throughput) * eta2)) : 1;
    case ROULETTE_FIXED: return vertex >= 1 ? o->survival : 1;
    }
    return 1;
}

/* Where a shadow ray ends: before the light, so that it does not meet it. Off by this part of the
 * distance, and by the rounding of the surface's coordinates twice: once because the ray starts that
 * far off the surface, once because the light lies about as far from the origin. Far from the
 * origin, or in a small scene, the second is more. */
static float shadow_end(float distance, float eps)
{
    return distance * (1 - 1e-4f) - 2 * eps;
}

/* a^2/(a^2 + b^2) by way of b/a: the squares of densities of small lights overflow. */
static float power_heuristic(float a, float b)
{
    float r = b / a;
    return a > 0 ? 1 / (1 + r * r) : 0;
}

static bool counts(const struct integrator *it, int bounces)
{
    return bounces >= it->opt.first_bounce && bounces <= it->opt.max_bounces;
}

/* Camera rays for all lanes. */
static int generate(const struct integrator *it, struct batch *b, int num_lanes)
{
    uint32_t width = (uint32_t)it->camera->width;
    for (int i = 0; i < num_lanes; i++) {
        struct sample4 s =
            sampler_draw(&it->opt.sampler, b->pixel[i], b->sample[i], 0, PURPOSE_CAMERA);
        float x = (float)(b->pixel[i] % width) + s.u[0], y = (float)(b->pixel[i] / width) + s.u[1];
        rays_set(&b->ray, i, camera_ray(it->camera, x, y, s.u[2], s.u[3]));
        rgbs_set(&b->throughput, i, grey(1));
        rgbs_set(&b->radiance, i, grey(0));
        b->pdf_w[i] = 0;
        b->eta2[i] = 1;
        b->active[i] = (uint16_t)i;
    }
    return num_lanes;
}

static int32_t light_of(const struct scene *s, uint32_t prim)
{
    return prim < s->num_triangles ? s->tri_light[prim] : s->sphere_light[prim - s->num_triangles];
}

static uint32_t material_of(const struct scene *s, uint32_t prim)
{
    return prim < s->num_triangles ? s->tri_material[prim]
                                   : s->sphere_material[prim - s->num_triangles];
}

/* Weight of emission of light l that the path ran into on surface s, or in the environment (s is
 * NULL). */
static float emission_weight(const struct integrator *it, const struct batch *b, int i, uint32_t l,
                             const struct surface *s)
{
    if (b->pdf_w[i] == 0 || it->opt.direct == DIRECT_BSDF)
        return 1;
    if (it->opt.direct != DIRECT_MIS)
        return 0;
    vec3 d = vec3s_get(&b->ray.d, i);
    float pdf_light = s == NULL
                          ? environment_pdf_w(it->scene->environment, d)
                          : light_pdf_w(it->lights, l, vec3s_get(&b->ray.o, i), d, b->hit.t[i], s);
    if (chooses_light(it))
        pdf_light *= light_choice_probability(it->lights, l);
    return power_heuristic(b->pdf_w[i], (float)it->opt.light_samples * pdf_light);
}

rgb lane_environment(const struct integrator *it, const struct batch *b, int i)
{
    const struct scene *s = it->scene;
    if (s->environment == NULL || (b->pdf_w[i] == 0 && environment_is_hidden(s->environment)))
        return grey(0);
    rgb le = environment_radiance(s->environment, vec3s_get(&b->ray.d, i));
    if (rgb_is_zero(le))
        return grey(0);
    float w = emission_weight(it, b, i, (uint32_t)s->environment_light, NULL);
    return rgb_scale(rgb_mul(rgbs_get(&b->throughput, i), le), w);
}

rgb lane_emission(const struct integrator *it, const struct batch *b, int i, uint32_t light,
                  const struct material *m, const struct surface *s)
{
    rgb le = emitted_radiance(m, s->ng, neg(vec3s_get(&b->ray.d, i)));
    if (rgb_is_zero(le))
        return grey(0);
    float w = emission_weight(it, b, i, light, s);
    return rgb_scale(rgb_mul(rgbs_get(&b->throughput, i), le), w);
}

/* Adds emission, sets up the surfaces, drops lanes whose path has ended. */
static int shade_hits(const struct integrator *it, struct batch *b, int num_active, int vertex)
{
    int kept = 0;
    for (int k = 0; k < num_active; k++) {
        int i = b->active[k];
        uint32_t prim = b->hit.prim[i];
        if (prim == NO_HIT) {
            if (counts(it, vertex))
                rgbs_add(&b->radiance, i, lane_environment(it, b, i));
            continue;
        }
        ray r = rays_get(&b->ray, i);
        struct surface s = surface_at(it->scene, prim, &r, b->hit.t[i], b->hit.u[i], b->hit.v[i]);
        vec3 wo = neg(r.d);
        b->material[i] = material_of(it->scene, prim);
        const struct material *m = &it->scene->materials[b->material[i]];
        int32_t light = light_of(it->scene, prim);
        if (light >= 0 && counts(it, vertex))
            rgbs_add(&b->radiance, i, lane_emission(it, b, i, (uint32_t)light, m, &s));
        if (vertex == it->opt.max_bounces || bsdf_is_black(m))
            continue;
        b->front[i] = dot(s.ng, wo) > 0;
        if (!b->front[i]) {
            s.ng = neg(s.ng);
            s.ns = neg(s.ns);
        }
        /* An interpolated normal that looks away from the viewer has no hemisphere to share. */
        if (dot(s.ns, wo) <= 0)
            s.ns = s.ng;
        vec3s_set(&b->p, i, s.p);
        vec3s_set(&b->ng, i, s.ng);
        vec3s_set(&b->ns, i, s.ns);
        vec3s_set(&b->wo, i, wo);
        b->eps[i] = s.eps;
        b->active[kept++] = (uint16_t)i;
    }
    return kept;
}

static vec3 to_local(const frame *f, vec3 w)
{
    return v3(dot(w, f->s), dot(w, f->t), dot(w, f->n));
}

rgb lane_scatter_towards(const struct integrator *it, const struct batch *b, int i, vec3 wi,
                         float *pdf_w)
{
    vec3 ns = vec3s_get(&b->ns, i);
    float cos_i = dot(ns, wi);
    if (pdf_w != NULL)
        *pdf_w = 0;
    if (cos_i <= 0 || dot(vec3s_get(&b->ng, i), wi) <= 0)
        return grey(0);
    frame f = frame_from_normal(ns);
    const struct material *m = &it->scene->materials[b->material[i]];
    vec3 wo_local = to_local(&f, vec3s_get(&b->wo, i)), wi_local = to_local(&f, wi);
    if (pdf_w != NULL)
        *pdf_w = bsdf_pdf_w(m, wo_local, wi_local);
    return rgb_scale(bsdf_eval(m, wo_local, wi_local), cos_i);
}

static ray leaving(const struct batch *b, int i, vec3 wi, float tmax)
{
    struct surface s = {.p = vec3s_get(&b->p, i), .ng = vec3s_get(&b->ng, i), .eps = b->eps[i]};
    return (ray){.o = surface_origin(&s, wi), .d = wi, .tmin = 0, .tmax = tmax};
}

/* One sample of a light from every diffuse lane, as one of `count` per lane. b->choice says which
 * light. */
static void connect_light(const struct integrator *it, struct batch *b, int num_lanes, int vertex,
                          uint32_t purpose, int count)
{
    int n = 0;
    for (int k = 0; k < num_lanes; k++) {
        int i = b->diffuse[k];
        if (b->choice[i].probability == 0)
            continue;
        struct sample4 u = sampler_draw(&it->opt.sampler, b->pixel[i], b->sample[i],
                                        (uint32_t)vertex + 1, purpose);
        struct light_sample ls =
            light_sample_direction(it->lights, b->choice[i].light, vec3s_get(&b->p, i), u.u);
        if (ls.pdf_w <= 0)
            continue;
        ls.pdf_w *= b->choice[i].probability;
        float pdf_bsdf;
        rgb f = lane_scatter_towards(it, b, i, ls.wi, &pdf_bsdf);
        if (rgb_is_zero(f))
            continue;
        float w = 1;
        if (it->opt.direct == DIRECT_MIS && !ls.delta)
            w = power_heuristic((float)count * ls.pdf_w, pdf_bsdf);
        rgb light = rgb_mul(rgb_mul(rgbs_get(&b->throughput, i), f), ls.radiance);
        rgbs_set(&b->shadow_light, i, rgb_scale(light, w / ((float)count * ls.pdf_w)));
        rays_set(&b->shadow, i, leaving(b, i, ls.wi, shadow_end(ls.distance, b->eps[i])));
        b->shadow.ignore[i] = ls.sphere;
        b->shadow_lane[n++] = (uint16_t)i;
    }
    bvh_occluded(it->bvh, &b->shadow, b->shadow_lane, n, b->occluded, &b->stats);
    for (int k = 0; k < n; k++) {
        int i = b->shadow_lane[k];
        if (!b->occluded[i])
            rgbs_add(&b->radiance, i, rgbs_get(&b->shadow_light, i));
    }
}

/* One uniform direction of the hemisphere from every diffuse lane, as one of `count` per lane;
 * counts if it meets an emitter. */
static void connect_hemisphere(const struct integrator *it, struct batch *b, int num_lanes,
                               int vertex, uint32_t purpose, int count)
{
    int n = 0;
    for (int k = 0; k < num_lanes; k++) {
        int i = b->diffuse[k];
        struct sample4 u = sampler_draw(&it->opt.sampler, b->pixel[i], b->sample[i],
                                        (uint32_t)vertex + 1, purpose);
        vec3 local = warp_uniform_hemisphere(u.u[0], u.u[1]);
        frame f = frame_from_normal(vec3s_get(&b->ns, i));
        vec3 wi = frame_to_world(&f, local);
        rgb scattered = lane_scatter_towards(it, b, i, wi, NULL);
        if (rgb_is_zero(scattered))
            continue;
        float pdf_w = warp_uniform_hemisphere_pdf_w(local);
        rgbs_set(
            &b->shadow_light, i,
            rgb_scale(rgb_mul(rgbs_get(&b->throughput, i), scattered), 1 / ((float)count * pdf_w)));
        rays_set(&b->shadow, i, leaving(b, i, wi, INFINITY));
        b->shadow_lane[n++] = (uint16_t)i;
    }
    bvh_closest(it->bvh, &b->shadow, b->shadow_lane, n, &b->shadow_hit, &b->stats);
    for (int k = 0; k < n; k++) {
        int i = b->shadow_lane[k];
        uint32_t prim = b->shadow_hit.prim[i];
        if (prim == NO_HIT && it->scene->environment != NULL)
            rgbs_add(
                &b->radiance, i,
                rgb_mul(rgbs_get(&b->shadow_light, i),
                        environment_radiance(it->scene->environment, vec3s_get(&b->shadow.d, i))));
        if (prim == NO_HIT || light_of(it->scene, prim) < 0)
            continue;
        ray r = rays_get(&b->shadow, i);
        struct surface s = surface_at(it->scene, prim, &r, b->shadow_hit.t[i], b->shadow_hit.u[i],
                                      b->shadow_hit.v[i]);
        const struct material *m = &it->scene->materials[material_of(it->scene, prim)];
        rgbs_add(&b->radiance, i,
                 rgb_mul(rgbs_get(&b->shadow_light, i), emitted_radiance(m, s.ng, neg(r.d))));
    }
}

/* Every lane samples the same light. */
static void choose_for_all(struct batch *b, int num_lanes, uint32_t l)
{
    for (int k = 0; k < num_lanes; k++)
        b->choice[b->diffuse[k]] = (struct light_choice){l, 1};
}

/* Every lane samples a light of its own. only_delta: among the delta lights. */
static void choose_for_each(const struct integrator *it, struct batch *b, int num_lanes, int vertex,
                            uint32_t purpose, bool only_delta)
{
    for (int k = 0; k < num_lanes; k++) {
        int i = b->diffuse[k];
        struct sample4 u = sampler_draw(&it->opt.sampler, b->pixel[i], b->sample[i],
                                        (uint32_t)vertex + 1, purpose);
        b->choice[i] = light_choose(it->lights, only_delta, u.u[0]);
    }
}

static void connect(const struct integrator *it, struct batch *b, int num_active, int vertex)
{
    const struct scene *s = it->scene;
    uint32_t purpose = PURPOSE_LIGHT;
    bool only_delta = it->opt.direct != DIRECT_LIGHT && it->opt.direct != DIRECT_MIS;
    bool choose = chooses_light(it);
    int n = 0;
    for (int k = 0; k < num_active; k++) {
        b->diffuse[n] = b->active[k];
        n += !bsdf_is_delta(&s->materials[b->material[b->active[k]]]);
    }
    for (int k = 0; choose && k < it->opt.light_samples; k++) {
        choose_for_each(it, b, n, vertex, purpose++, only_delta);
        connect_light(it, b, n, vertex, purpose++, it->opt.light_samples);
    }
    for (uint32_t l = 0; !choose && l < s->num_lights; l++) {
        bool delta = light_is_delta(&s->lights[l]);
        if (!delta && only_delta)
            continue;
        int count = delta ? 1 : it->opt.light_samples;
        choose_for_all(b, n, l);
        for (int k = 0; k < count; k++)
            connect_light(it, b, n, vertex, purpose++, count);
    }
    if (it->opt.direct == DIRECT_HEMISPHERE) {
        uint32_t areas = light_count_areas(it->lights);
        int count = (int)(areas < MANY_LIGHTS ? areas : MANY_LIGHTS) * it->opt.light_samples;
        for (int k = 0; k < count; k++)
            connect_hemisphere(it, b, n, vertex, purpose++, count);
    }
}

/* Sets up the next ray of every active lane that goes on. only_delta: the last ray of a path, where
 * light sampling has already dealt with all emitters but those behind a delta lobe. */
static int scatter(const struct integrator *it, struct batch *b, int num_active, int vertex,
                   bool only_delta)
{
    int kept = 0;
    for (int k = 0; k < num_active; k++) {
        int i = b->active[k];
        const struct material *m = &it->scene->materials[b->material[i]];
        struct sample4 u = sampler_draw(&it->opt.sampler, b->pixel[i], b->sample[i],
                                        (uint32_t)vertex + 1, PURPOSE_BSDF);
        frame f = frame_from_normal(vec3s_get(&b->ns, i));
        vec3 wo = to_local(&f, vec3s_get(&b->wo, i));
        struct bsdf_sample s = bsdf_sample_direction(m, b->front[i], wo, u.u[0], u.u[1], u.u[2]);
        vec3 wi = frame_to_world(&f, s.wi);
        /* Both normals have to agree on which side the light leaves. */
        if (s.pdf_w <= 0 || (only_delta && !s.delta) || s.wi.z * dot(vec3s_get(&b->ng, i), wi) <= 0)
            continue;
        rgb throughput = rgb_mul(rgbs_get(&b->throughput, i), s.weight);
        float eta2 = b->eta2[i] * s.eta2;
        float go_on = survival(&it->opt, vertex, throughput, eta2);
        if (go_on < 1) {
            if (u.u[3] >= go_on)
                continue;
            throughput = rgb_scale(throughput, 1 / go_on);
        }
        rgbs_set(&b->throughput, i, throughput);
        b->eta2[i] = eta2;
        b->pdf_w[i] = s.delta ? 0 : s.pdf_w;
        rays_set(&b->ray, i, leaving(b, i, wi, INFINITY));
        b->active[kept++] = (uint16_t)i;
    }
    return kept;
}

static void integrate_normals(const struct integrator *it, struct batch *b, int num_active)
{
    bvh_closest(it->bvh, &b->ray, b->active, num_active, &b->hit, &b->stats);
    if (it->opt.first_hits)
        first_hits_record(it, b, num_active);
    for (int k = 0; k < num_active; k++) {
        int i = b->active[k];
        if (b->hit.prim[i] == NO_HIT)
            continue;
        ray r = rays_get(&b->ray, i);
        vec3 n =
            surface_at(it->scene, b->hit.prim[i], &r, b->hit.t[i], b->hit.u[i], b->hit.v[i]).ns;
        rgbs_set(&b->radiance, i, (rgb){0.5f + 0.5f * n.x, 0.5f + 0.5f * n.y, 0.5f + 0.5f * n.z});
    }
}

bool integrator_prepare(struct integrator *it, struct err *e)
{
    static const struct lanes_kernel *const kernel[] = {[ISA_SSE42] = &lanes_kernel_sse42,
                                                        [ISA_AVX2] = &lanes_kernel_avx2,
                                                        [ISA_AVX512] = &lanes_kernel_avx512};
    enum isa isa = it->opt.isa;
    it->lanes = NULL;
    it->lanes_scene = NULL;
    const bool normals = it->opt.kind == INTEGRATE_NORMALS;
    if (isa == ISA_SCALAR || (it->opt.direct == DIRECT_HEMISPHERE && !normals))
        return true;
    if (!isa_choose(&isa, e))
        return false;
    it->lanes = kernel[isa];
    return normals || (it->lanes_scene = lanes_scene_build(it->scene, e)) != NULL;
}

void integrator_free(struct integrator *it)
{
    lanes_scene_free((struct lanes_scene *)it->lanes_scene);
    it->lanes_scene = NULL;
    it->lanes = NULL;
}

void integrate(const struct integrator *it, struct batch *b, int num_lanes)
{
    if (it->lanes != NULL) {
        it->lanes->integrate(it, b, num_lanes);
        return;
    }
    int active = generate(it, b, num_lanes);
    if (it->opt.kind == INTEGRATE_NORMALS) {
        integrate_normals(it, b, active);
        return;
    }
    /* In these two the last ray of every path looks for emitters. */
    bool last_ray = it->opt.direct == DIRECT_BSDF || it->opt.direct == DIRECT_MIS;
    for (int vertex = 0; active > 0; vertex++) {
        bvh_closest(it->bvh, &b->ray, b->active, active, &b->hit, &b->stats);
        if (vertex == 0 && it->opt.first_hits)
            first_hits_record(it, b, active);
        active = shade_hits(it, b, active, vertex);
        if (counts(it, vertex + 1))
            connect(it, b, active, vertex);
        bool only_delta = vertex + 1 == it->opt.max_bounces && !last_ray;
        active = scatter(it, b, active, vertex, only_delta);
    }
}
