#include "render_check.h"
#include "test.h"

#define Z_LIMIT  4.89
#define ROUNDING 2e-5

void check_finish(struct scene *s)
{
    struct err e = {""};
    if (!scene_finish(s, "test", &e))
        fail_msg("%s", e.msg);
}

struct moments check_render(const struct scene *s, struct integrator_options io, int width,
                            int height, int spp)
{
    return check_render_with(s, io, width, height, spp, 1, BVH_SAH);
}

struct moments check_render_with(const struct scene *s, struct integrator_options io, int width,
                                 int height, int spp, int threads, enum bvh_kind kind)
{
    struct err e = {""};
    struct camera c;
    struct moments m;
    struct render_stats stats;
    struct progress p;
    progress_start(&p, "test", NULL, true);
    assert_true(camera_init(&c, s, width, height, &e));
    struct bvh *bvh = bvh_build(s, kind, &e);
    assert_non_null(bvh);
    struct render_options o = {.integrator = io,
                               .width = width,
                               .height = height,
                               .num_samples = (uint32_t)spp,
                               .threads = threads};
    assert_true(render(s, &c, bvh, &o, &p, &m, &stats, &e));
    bvh_free(bvh);
    return m;
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

bool check_result_agrees(const struct check_result *r, int channel, double expected)
{
    return fabs(r->mean[channel] - expected) <=
           Z_LIMIT * r->std_error[channel] + ROUNDING * fabs(expected);
}

void check_result_mean(const struct check_result *r, int channel, double expected, const char *what)
{
    if (!check_result_agrees(r, channel, expected))
        fail_msg("%s, channel %d: %.7g +- %.2g, expected %.7g", what, channel, r->mean[channel],
                 r->std_error[channel], expected);
}

bool check_agrees(const struct moments *m, int channel, double expected)
{
    struct check_result r = check_pool(m);
    return check_result_agrees(&r, channel, expected);
}

void check_mean(const struct moments *m, int channel, double expected, const char *what)
{
    struct check_result r = check_pool(m);
    check_result_mean(&r, channel, expected, what);
}

double check_std_error(const struct moments *m, int channel)
{
    return check_pool(m).std_error[channel];
}

double check_z(const struct moments *a, const struct moments *b, int channel)
{
    struct check_result ra = check_pool(a), rb = check_pool(b);
    return (ra.mean[channel] - rb.mean[channel]) /
           hypot(ra.std_error[channel], rb.std_error[channel]);
}
