#include "render_check.h"
#include "own.h"
#include "test.h"

#define ROUNDING 2e-5

void check_finish(struct scene *s)
{
    struct err e = {""};
    MUST(scene_finish(s, "test", &e));
}

struct integrator_options check_options(int direct, int depth, uint64_t seed)
{
    return (struct integrator_options){.kind = INTEGRATE_PATHS,
                                       .direct = (enum direct_kind)direct,
                                       .max_bounces = depth,
                                       .light_samples = 1,
                                       .roulette = ROULETTE_THROUGHPUT,
                                       .sampler = {SAMPLER_INDEPENDENT, seed}};
}

struct moments check_render_all(const struct scene *s, const struct camera *c,
                                const struct render_options *o, enum bvh_kind kind,
                                struct render_stats *stats)
{
    struct err e = {""};
    struct moments m;
    struct render_stats unused;
    struct progress p;
    progress_start(&p, "test", NULL, true);
    struct bvh *bvh = bvh_build(s, kind, &e);
    MUST(bvh != NULL);
    MUST(render(s, c, bvh, o, &p, &m, stats != NULL ? stats : &unused, &e));
    bvh_free(bvh);
    return m;
}

struct moments check_render(const struct scene *s, struct integrator_options io, int width,
                            int height, int spp)
{
    struct err e = {""};
    struct camera c;
    MUST(camera_init(&c, s, width, height, &e));
    const struct render_options o = {.integrator = io,
                                     .width = width,
                                     .height = height,
                                     .num_samples = (uint32_t)spp,
                                     .threads = 1};
    return check_render_all(s, &c, &o, BVH_SAH, NULL);
}

struct check_result check_pool(const struct moments *m)
{
    struct check_result r = {{0}, {0}};
    size_t pixels = (size_t)m->width * (size_t)m->height;
    for (size_t p = 0; p < pixels; p++)
        for (int c = 0; c < 3; c++) {
            r.mean[c] += m->mean[3 * p + (size_t)c] / (double)pixels;
            r.std_error[c] += moments_var_of_mean(m, p, c);
        }
    for (int c = 0; c < 3; c++)
        r.std_error[c] = sqrt(r.std_error[c]) / (double)pixels;
    return r;
}

struct check_result check_look(const struct scene *s, struct integrator_options io, int size,
                               int spp)
{
    OWN(moments) m = check_render(s, io, size, size, spp);
    struct check_result r = check_pool(&m);
    return r;
}

bool check_agrees(const struct check_result *r, int channel, double expected)
{
    return fabs(r->mean[channel] - expected) <=
           CHECK_Z_LIMIT * r->std_error[channel] + ROUNDING * fabs(expected);
}

void check_mean(const struct check_result *r, int channel, double expected, const char *what)
{
    if (!check_agrees(r, channel, expected))
        fail_msg("%s, channel %d: %.7g +- %.2g, expected %.7g", what, channel, r->mean[channel],
                 r->std_error[channel], expected);
}

double check_z(const struct moments *a, const struct moments *b, int channel)
{
    struct check_result ra = check_pool(a), rb = check_pool(b);
    return (ra.mean[channel] - rb.mean[channel]) /
           hypot(ra.std_error[channel], rb.std_error[channel]);
}
