#include "quadrature.h"
#include "suite_files.h"
#include "own.h"
#include "test.h"

#include "reference/truth/truth.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_integration.h>

bool same(double a, double b)
{
    return fabs(a - b) <= 1e-9 * fabs(b);
}

double next_number(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 9007199254740992.0;
}

struct integrand {
    double (*f)(double x, double z, const void *ctx);
    const void *ctx;
    double z[2], x;
    gsl_integration_cquad_workspace *inner;
};

static double over_z(double z, void *p)
{
    const struct integrand *in = p;
    return in->f(in->x, z, in->ctx);
}

static double over_x(double x, void *p)
{
    struct integrand *in = p;
    in->x = x;
    gsl_function g = {over_z, in};
    double value, error;
    assert_int_equal(
        gsl_integration_cquad(&g, in->z[0], in->z[1], 0, 1e-12, in->inner, &value, &error, NULL),
        GSL_SUCCESS);
    return value;
}

double integrate_plane(double (*f)(double, double, const void *), const void *ctx,
                       const double x[2], const double z[2])
{
    gsl_integration_cquad_workspace *outer = gsl_integration_cquad_workspace_alloc(1000);
    struct integrand in = {f, ctx, {z[0], z[1]}, 0, gsl_integration_cquad_workspace_alloc(1000)};
    gsl_function g = {over_x, &in};
    double value, error;
    assert_int_equal(gsl_integration_cquad(&g, x[0], x[1], 0, 1e-11, outer, &value, &error, NULL),
                     GSL_SUCCESS);
    gsl_integration_cquad_workspace_free(in.inner);
    gsl_integration_cquad_workspace_free(outer);
    return value;
}

void render_truth(const char *name, int width, int height, struct moments *out)
{
    struct err e;
    struct suite_scene scene = *suite_shipped_scene(name);
    scene.width = width;
    scene.height = height;
    const struct suite_reference *truth = suite_reference_of(&scene, "truth");
    assert_non_null(truth);
    MUST(truth_render(&scene, truth, out, &e));
}

double mean_at(const struct moments *m, int col, int row, int channel)
{
    return m->mean[3 * (row * m->width + col) + channel];
}

void expect_box_filter(const struct plane_scene *p, const int (*pixels)[2], size_t num)
{
    OWN(moments) m;
    render_truth(p->name, 64, 64, &m);
    for (size_t i = 0; i < num; i++) {
        int col = pixels[i][0], row = pixels[i][1];
        double side = p->half / 32, x = p->left + side * col, z = p->top + side * row;
        double centre = p->irradiance(x + side / 2, z + side / 2, NULL);
        double mean = integrate_plane(p->irradiance, NULL, (double[2]){x, x + side},
                                      (double[2]){z, z + side}) /
                      (side * side);
        for (int c = 0; c < 3; c++)
            assert_true(same(mean_at(&m, col, row, c), p->albedo[c] * p->source[c] * mean / M_PI));
        assert_false(same(mean_at(&m, col, row, 0), p->albedo[0] * p->source[0] * centre / M_PI));
    }
}

void expect_any_resolution(const char *name)
{
    OWN(moments) coarse, fine;
    render_truth(name, 64, 64, &coarse);
    render_truth(name, 128, 128, &fine);
    assert_string_equal(coarse.unit, "exact");
    for (int row = 0; row < 64; row++)
        for (int col = 0; col < 64; col++)
            for (int c = 0; c < 3; c++) {
                double mean = 0;
                for (int k = 0; k < 4; k++)
                    mean += mean_at(&fine, 2 * col + (k & 1), 2 * row + (k >> 1), c) / 4;
                assert_true(same(mean_at(&coarse, col, row, c), mean));
            }
}

void expect_refusal(const char *kind, const char *text, int depth, const char *message)
{
    json_error_t why;
    OWN_TEXT json = test_json(text);
    json_t *values = json_loads(json, 0, &why);
    assert_non_null(values);
    struct suite_scene scene = {.name = "19_bad",
                                .width = 4,
                                .height = 4,
                                .depth = depth,
                                .lens_radius = 0.25,
                                .focal_distance = 2};
    struct suite_reference ref = {.engine = "truth", .values = values};
    snprintf(ref.kind, sizeof ref.kind, "%s", kind);
    struct moments m;
    struct err e = {""};
    bool ok = truth_render(&scene, &ref, &m, &e);
    if (ok != (message == NULL))
        fail_msg("%s %s: %s", kind, text, ok ? "accepted" : e.msg);
    if (ok) {
        moments_free(&m);
    } else {
        assert_ptr_equal(strstr(e.msg, "19_bad: truth '"), e.msg);
        if (strstr(e.msg, message) == NULL)
            fail_msg("%s %s: no '%s' in: %s", kind, text, message, e.msg);
    }
    json_decref(values);
}
