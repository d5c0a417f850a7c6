#include "povray_fixture.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include "tests/support/render_check.h"

#include "reference/base/process.h"
#include "renderer/base/fs.h"

#include <gsl/gsl_cdf.h>

void fixture_init(struct fixture *f, struct scene s, int size, int depth)
{
    *f = (struct fixture){.dir = "/tmp/test_povray.XXXXXX",
                          .s = s,
                          .suite = {.width = size, .height = size, .depth = depth},
                          .ref = {.replicates = 2, .subgrid = 1},
                          .opt = {.seed = 1, .threads = THREADS, .timeout_s = 60}};
    assert_non_null(mkdtemp(f->dir));
    f->c = build_finish(&f->s, size, size);
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
    json_t *told = manifest != NULL ? json_incref(manifest) : json_object();
    MUST(engine_driver_render(&povray_driver, &f->job, &m, told, &e));
    json_decref(told);
    return m;
}

/* Inlined, gcc 12 takes what it returns for a pointer into its frame. */
__attribute__((noinline)) char *povray_text(const struct scene *s, const struct camera *c,
                                            int depth, const struct povray_variant *v)
{
    struct err e;
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    assert_non_null(f);
    MUST(export_povray(s, c, depth, v, f, &e));
    assert_int_equal(fclose(f), 0);
    return text;
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
    struct render_options o = {.integrator = check_options(DIRECT_MIS, depth, 5),
                               .width = f->suite.width,
                               .height = f->suite.height,
                               .num_samples = 4096,
                               .threads = 2};
    o.integrator.roulette = ROULETTE_OFF;
    OWN(moments) m = check_render_all(&f->s, &f->c, &o, BVH_SAH, NULL);
    for (int k = 0; k < 3; k++) {
        mean[k] = image_mean(&m, k);
        variance[k] = 0;
        for (int i = 0; i < m.width * m.height; i++)
            variance[k] += moments_var_of_mean(&m, (size_t)i, k) / pow(m.width * m.height, 2);
    }
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
