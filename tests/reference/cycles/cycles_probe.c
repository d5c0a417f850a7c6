#include "cycles_probe.h"
#include "tests/support/test.h"

#include "reference/base/process.h"
#include "renderer/base/fs.h"

#include <gsl/gsl_cdf.h>

int probe_setup(void **state)
{
    struct probe *f = calloc(1, sizeof *f);
    struct err e;
    strcpy(f->dir, "/tmp/test_cycles.XXXXXX");
    assert_non_null(mkdtemp(f->dir));
    snprintf(f->work, sizeof f->work, "%s/work", f->dir);
    snprintf(f->bin, sizeof f->bin, "%s/bin", f->dir);
    MUST(fs_make_dirs(f->work, &e) && fs_make_dirs(f->bin, &e));
    snprintf(f->path, sizeof f->path, "%s", getenv("PATH"));
    f->s = build_scene();
    f->suite = (struct suite_scene){.name = "test", .width = 4, .height = 4, .depth = 1};
    f->ref = (struct suite_reference){.engine = "cycles", .replicates = 3, .spp = 16};
    f->opt = (struct reference_options){
        .seed = 7, .threads = 1, .timeout_s = 300, .work_dir = f->dir, .share_dir = "reference"};
    f->job = (struct reference_job){.suite = &f->suite,
                                    .ref = &f->ref,
                                    .opt = &f->opt,
                                    .scene = &f->s,
                                    .camera = &f->c,
                                    .dir = f->work};
    *state = f;
    return 0;
}

int probe_teardown(void **state)
{
    struct probe *f = *state;
    struct err e;
    bool ok = fs_remove_tree(f->dir, &e) && setenv("PATH", f->path, 1) == 0;
    scene_free(&f->s);
    free(f);
    return ok ? 0 : -1;
}

void probe_finish(struct probe *f)
{
    struct err e;
    MUST(scene_finish(&f->s, "test", &e) &&
         camera_init(&f->c, &f->s, f->suite.width, f->suite.height, &e));
}

void probe_size(struct probe *f, int width, int height)
{
    char path[4096];
    f->suite.width = width;
    f->suite.height = height;
    if (process_find("blender", path, sizeof path))
        return;
    print_message("SKIPPED: blender is not installed, so Cycles itself was not tested\n");
    skip();
}

void probe_sky(struct probe *f, const struct sky *sky)
{
    f->s.environment = sky_environment(sky);
    build_light(&f->s, (struct light){.kind = LIGHT_ENVIRONMENT});
}

void probe_uniform(const double d[3], double out[3], const void *data)
{
    (void)d;
    memcpy(out, data, 3 * sizeof *out);
}

/* Statistics of a part of the image: the sum over its pixels of the mean, and its standard error;
 * pixels are independent (box filter of one pixel, random numbers of their own). */
struct part {
    double sum, variance, truth;
};

static struct part take(const struct moments *m, const double *truth, int x0, int x1, int y0,
                        int y1, int channel)
{
    struct part p = {0};
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++) {
            size_t pixel = (size_t)y * (size_t)m->width + (size_t)x;
            p.sum += m->mean[3 * pixel + (size_t)channel];
            p.variance += m->n[pixel] > 1 ? moments_var_of_mean(m, pixel, channel) : 0;
            p.truth += truth[3 * pixel + (size_t)channel];
        }
    return p;
}

bool probe_agrees(const struct moments *m, const double *truth, double allowed)
{
    /* An image without noise is its own mean. */
    double t = m->n[0] > 1 ? gsl_cdf_tdist_Qinv(5e-7, m->n[0] - 1) : 0;
    int w = m->width, h = m->height;
    bool agree = true;
    for (int q = 0; q < 4; q++)
        for (int c = 0; c < 3; c++) {
            struct part p = take(m, truth, q % 2 * w / 2, (q % 2 + 1) * w / 2, q / 2 * h / 2,
                                 (q / 2 + 1) * h / 2, c);
            agree = agree && fabs(p.sum - p.truth) <= t * sqrt(p.variance) + allowed * p.truth;
        }
    return agree;
}

double *probe_expect(const struct probe *f, double tan_h, int sub, probe_radiance *radiance,
                     const void *data)
{
    int w = f->suite.width, h = f->suite.height;
    double *truth = calloc((size_t)(3 * w * h), sizeof *truth);
    assert_non_null(truth);
    for (int i = 0; i < w * h * sub * sub; i++) {
        int pixel = i / (sub * sub), place = i % (sub * sub);
        double x = pixel % w + (place % sub + 0.5) / sub, y = pixel / w + (place / sub + 0.5) / sub;
        double d[3] = {(2 * x / w - 1) * tan_h, (1 - 2 * y / h) * tan_h * h / w, -1}, out[3];
        radiance(d, out, data);
        for (int c = 0; c < 3; c++)
            truth[3 * pixel + c] += out[c] / (sub * sub);
    }
    return truth;
}

void probe_run(struct probe *f, int spp, struct moments *m)
{
    struct err e;
    json_t *manifest = json_object();
    f->ref.replicates = 8;
    f->ref.spp = spp;
    bool ok = engine_driver_render(&cycles_driver, &f->job, m, manifest, &e);
    json_decref(manifest);
    MUST(ok);
}

void probe_render(struct probe *f, struct moments *m)
{
    probe_finish(f);
    probe_run(f, 64, m);
}

static void report(const struct moments *m, const double *truth)
{
    for (int c = 0; c < 3; c++) {
        struct part p = take(m, truth, 0, m->width, 0, m->height, c);
        print_message("%s%+.2e +- %.2e%s", c == 0 ? "  Cycles / closed form - 1: " : ", ",
                      p.sum / p.truth - 1, sqrt(p.variance) / p.truth, c == 2 ? "\n" : "");
    }
}

void probe_judge(struct probe *f, struct moments *m, double *truth, double allowed, bool symmetric)
{
    int w = f->suite.width;
    size_t count = 3 * (size_t)w * (size_t)f->suite.height;
    report(m, truth);
    bool agrees = probe_agrees(m, truth, allowed), brighter, mirrored;
    for (size_t i = 0; i < count; i++)
        truth[i] *= 1.01;
    brighter = probe_agrees(m, truth, allowed);
    double *flipped = malloc(count * sizeof *flipped);
    for (size_t i = 0; i < count; i++) {
        size_t x = i / 3 % (size_t)w;
        flipped[i] = truth[i + 3 * ((size_t)w - 1 - 2 * x)] / 1.01;
    }
    mirrored = probe_agrees(m, flipped, allowed);
    free(flipped);
    free(truth);
    moments_free(m);
    assert_true(agrees);
    assert_false(brighter);
    assert_int_equal(mirrored, symmetric);
}

void probe_check(struct probe *f, double tan_h, int sub, probe_radiance *radiance, const void *data,
                 double allowed, bool symmetric)
{
    struct moments m;
    probe_render(f, &m);
    probe_judge(f, &m, probe_expect(f, tan_h, sub, radiance, data), allowed, symmetric);
}
