#include "render_check.h"
#include "own.h"
#include "test.h"

#define ROUNDING 2e-5

void check_aim(struct scene *s, vec3 eye, vec3 backward, vec3 up)
{
    build_camera(s, eye, 0.02f);
    s->camera.backward = backward;
    s->camera.up = up;
    s->camera.right = cross(up, backward);
}

struct scene check_plate(vec3 n, float albedo)
{
    struct scene s = build_scene();
    uint32_t m = build_material(&s, grey(albedo), grey(0));
    frame f = frame_from_normal(n);
    build_quad(&s, add(scale(f.s, -3), scale(f.t, -3)), scale(f.s, 6), scale(f.t, 6), m);
    const float h = 0.70710678f;
    check_aim(&s, add(scale(n, 2), scale(f.t, 2)), scale(add(n, f.t), h), scale(sub(n, f.t), h));
    return s;
}

double check_irradiance(const double (*v)[3], int n)
{
    double sum = 0;
    for (int i = 0; i < n; i++) {
        const double *a = v[i], *b = v[(i + 1) % n];
        double c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                       a[0] * b[1] - a[1] * b[0]};
        double lc = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
        double ab = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        sum += atan2(lc, ab) * c[1] / lc;
    }
    return fabs(sum) / 2;
}

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
