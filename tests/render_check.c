#include "render_check.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#define Z_LIMIT 4.89

void check_finish(struct scene *s)
{
    struct err e = {""};
    if (!scene_finish(s, "test", &e))
        fail_msg("%s", e.msg);
}

struct moments check_render(const struct scene *s, struct integrator_options io, int width,
                            int height, int spp)
{
    struct err e = {""};
    struct camera c;
    struct moments m;
    struct render_stats stats;
    struct progress p;
    progress_start(&p, "test", NULL, true);
    assert_true(camera_init(&c, s, width, height, &e));
    struct bvh *bvh = bvh_build(s, BVH_SAH, &e);
    assert_non_null(bvh);
    struct render_options o = {.integrator = io,
                               .width = width,
                               .height = height,
                               .num_samples = (uint32_t)spp,
                               .threads = 1};
    assert_true(render(s, &c, bvh, &o, &p, &m, &stats, &e));
    bvh_free(bvh);
    return m;
}

static void pooled(const struct moments *m, int channel, double *mean, double *std_error)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    double sum = 0, var = 0;
    for (size_t p = 0; p < pixels; p++) {
        sum += m->mean[3 * p + (size_t)channel];
        var += moments_var_of_mean(m, p, channel);
    }
    *mean = sum / (double)pixels;
    *std_error = sqrt(var) / (double)pixels;
}

bool check_agrees(const struct moments *m, int channel, double expected)
{
    double mean, se;
    pooled(m, channel, &mean, &se);
    return fabs(mean - expected) <= Z_LIMIT * se + 2e-5 * fabs(expected);
}

void check_mean(const struct moments *m, int channel, double expected, const char *what)
{
    double mean, se;
    pooled(m, channel, &mean, &se);
    if (!check_agrees(m, channel, expected))
        fail_msg("%s: %.7g +- %.2g, expected %.7g", what, mean, se, expected);
}

double check_std_error(const struct moments *m, int channel)
{
    double mean, se;
    pooled(m, channel, &mean, &se);
    return se;
}

double check_z(const struct moments *a, const struct moments *b, int channel)
{
    double ma, mb, sa, sb;
    pooled(a, channel, &ma, &sa);
    pooled(b, channel, &mb, &sb);
    return (ma - mb) / sqrt(sa * sa + sb * sb);
}
