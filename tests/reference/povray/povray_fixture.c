#include "povray_fixture.h"
#include "tests/support/test.h"

#include "tests/support/build_scene.h"

#include "reference/base/process.h"
#include "renderer/base/fs.h"
#include "renderer/transport/render.h"

#include <gsl/gsl_cdf.h>

void fixture_init(struct fixture *f, struct scene s, int size, int depth)
{
    struct err e;
    *f = (struct fixture){.dir = "/tmp/test_povray.XXXXXX",
                          .s = s,
                          .suite = {.width = size, .height = size, .depth = depth},
                          .ref = {.replicates = 2, .subgrid = 1},
                          .opt = {.seed = 1, .threads = THREADS, .timeout_s = 60}};
    assert_non_null(mkdtemp(f->dir));
    if (!scene_finish(&f->s, "test", &e) || !camera_init(&f->c, &f->s, size, size, &e))
        fail_msg("%s", e.msg);
    f->job = (struct reference_job){.suite = &f->suite,
                                    .ref = &f->ref,
                                    .opt = &f->opt,
                                    .scene = &f->s,
                                    .camera = &f->c,
                                    .dir = f->dir};
}

void fixture_free(struct fixture *f)
{
    struct err e;
    assert_true(fs_remove_tree(f->dir, &e));
    scene_free(&f->s);
}

struct moments must_render(struct fixture *f, json_t *manifest)
{
    struct err e;
    struct moments m;
    MUST(engine_driver_render(&povray_driver, &f->job, &m, manifest, &e));
    return m;
}

void look_down(struct scene *s, float h)
{
    s->camera = (struct scene_camera){.present = true,
                                      .right = {1, 0, 0},
                                      .up = {0, 0, -1},
                                      .backward = {0, 1, 0},
                                      .eye = {0, h, 0},
                                      .hfov = PI_F / 2,
                                      .near = 1e-3f,
                                      .far = 1e3f};
}

void need_povray(void)
{
    char path[4096];
    if (process_find("povray", path, sizeof path))
        return;
    print_message("SKIPPED: povray is not in PATH; POV-Ray itself was not tested\n");
    skip();
}

double image_mean(const struct moments *m, int channel)
{
    double sum = 0;
    for (int i = 0; i < m->width * m->height; i++)
        sum += m->mean[3 * i + channel];
    return sum / (m->width * m->height);
}

void render_ours(struct fixture *f, int depth, double mean[3], double variance[3])
{
    struct err e;
    struct progress quiet;
    struct render_stats stats;
    struct moments m;
    progress_start(&quiet, "test", NULL, true);
    struct bvh *bvh = bvh_build(&f->s, BVH_SAH, &e);
    assert_non_null(bvh);
    struct render_options o = {.integrator = {.kind = INTEGRATE_PATHS,
                                              .direct = DIRECT_MIS,
                                              .max_bounces = depth,
                                              .light_samples = 1,
                                              .sampler = {SAMPLER_INDEPENDENT, 5}},
                               .width = f->suite.width,
                               .height = f->suite.height,
                               .num_samples = 4096,
                               .threads = 2};
    assert_true(render(&f->s, &f->c, bvh, &o, &quiet, &m, &stats, &e));
    for (int k = 0; k < 3; k++) {
        mean[k] = image_mean(&m, k);
        variance[k] = 0;
        for (int i = 0; i < m.width * m.height; i++)
            variance[k] += moments_var_of_mean(&m, (size_t)i, k) / pow(m.width * m.height, 2);
    }
    moments_free(&m);
    bvh_free(bvh);
}

bool means_agree(double x[CALLS][3], int channel, double ours, double variance)
{
    double mean = 0;
    for (int i = 0; i < CALLS; i++)
        mean += x[i][channel] / CALLS;
    for (int i = 0; i < CALLS; i++)
        variance += pow(x[i][channel] - mean, 2) / (CALLS - 1) / CALLS;
    print_message("POV-Ray / ours - 1: %+.4f, standard error %.4f\n", mean / ours - 1,
                  sqrt(variance) / ours);
    return fabs(mean - ours) < gsl_cdf_tdist_Qinv(.0005, CALLS - 1) * sqrt(variance);
}
