#include "truth_several_lamps.h"

#include "truth_one_lamp.h"

#include <gsl/gsl_integration.h>
#include <math.h>

enum { MAX_LAMPS = 8 };

/* Points per axis of the two rules whose difference is the error estimate. */
enum { ORDER = 8, CHECK_ORDER = 2 * ORDER };
static const double max_quadrature_error = 1e-10;

struct lamp {
    double strength[3];        /* radiance or intensity */
    double height, x[2], z[2]; /* of a rectangle; height 0: a point */
    double point[3];
};

struct lamps {
    struct lamp lamp[MAX_LAMPS];
    int num;
    double albedo[3], foot_x[2], foot_z[2];
};

/* Radiance of the plane. */
static void radiance(const struct lamps *l, double x, double z, double out[3])
{
    out[0] = out[1] = out[2] = 0;
    for (int i = 0; i < l->num; i++) {
        const struct lamp *p = &l->lamp[i];
        double e = p->height > 0 ? truth_rectangle_irradiance(p->height, p->x, p->z, x, z)
                                 : truth_point_irradiance(p->point, x, z);
        for (int c = 0; c < 3; c++)
            out[c] += l->albedo[c] / M_PI * p->strength[c] * e;
    }
}

/* Mean over x0..x0+dx by z0..z0+dz. */
static void mean_by_rule(const struct lamps *l, const gsl_integration_glfixed_table *rule,
                         double x0, double dx, double z0, double dz, double mean[3])
{
    mean[0] = mean[1] = mean[2] = 0;
    for (size_t k = 0; k < rule->n * rule->n; k++) {
        double px, pz, wx, wz, light[3];
        gsl_integration_glfixed_point(0, 1, k % rule->n, &px, &wx, rule);
        gsl_integration_glfixed_point(0, 1, k / rule->n, &pz, &wz, rule);
        radiance(l, x0 + dx * px, z0 + dz * pz, light);
        for (int c = 0; c < 3; c++)
            mean[c] += wx * wz * light[c];
    }
}

static bool render(const struct lamps *l, struct moments *out, struct err *e)
{
    gsl_integration_glfixed_table *rule = gsl_integration_glfixed_table_alloc(ORDER);
    gsl_integration_glfixed_table *check = gsl_integration_glfixed_table_alloc(CHECK_ORDER);
    bool ok = (rule != NULL && check != NULL) || err_set(e, "out of memory for a quadrature rule");
    double dx = (l->foot_x[1] - l->foot_x[0]) / out->width;
    double dz = (l->foot_z[1] - l->foot_z[0]) / out->height;
    for (int i = 0; ok && i < out->width * out->height; i++) {
        int col = i % out->width, row = i / out->width;
        double x0 = l->foot_x[0] + dx * col, z0 = l->foot_z[0] + dz * row, coarse[3];
        double *mean = &out->mean[3 * (size_t)i];
        mean_by_rule(l, rule, x0, dx, z0, dz, coarse);
        mean_by_rule(l, check, x0, dx, z0, dz, mean);
        /* Written so that NaN fails too. */
        for (int c = 0; ok && c < 3; c++)
            ok = fabs(mean[c] - coarse[c]) <= max_quadrature_error * mean[c] ||
                 err_set(e, "pixel (%d,%d): quadrature not converged: %.12g and %.12g", col, row,
                         coarse[c], mean[c]);
    }
    gsl_integration_glfixed_table_free(rule);
    gsl_integration_glfixed_table_free(check);
    return ok;
}

static bool read_lamp(json_t *value, struct lamp *p, struct err *e)
{
    json_error_t why;
    if (json_object_get(value, "intensity") != NULL) {
        if (json_unpack_ex(value, &why, JSON_STRICT, "{s:[F,F,F], s:[F,F,F]}", "intensity",
                           &p->strength[0], &p->strength[1], &p->strength[2], "light", &p->point[0],
                           &p->point[1], &p->point[2]) != 0)
            return err_set(e, "%s", why.text);
        if (!(p->point[1] > 0))
            return err_set(e, "light is at height %g, not above the plane", p->point[1]);
    } else {
        if (json_unpack_ex(value, &why, JSON_STRICT, "{s:[F,F,F], s:F, s:[F,F], s:[F,F]}",
                           "radiance", &p->strength[0], &p->strength[1], &p->strength[2], "height",
                           &p->height, "x", &p->x[0], &p->x[1], "z", &p->z[0], &p->z[1]) != 0)
            return err_set(e, "%s", why.text);
        if (!(p->height > 0))
            return err_set(e, "height is %g, not above the plane", p->height);
        if (!(p->x[0] < p->x[1] && p->z[0] < p->z[1]))
            return err_set(e, "lamp has no area");
    }
    return truth_check_triple("strength", p->strength, HUGE_VAL, e);
}

static bool fill_lamps(const struct suite_scene *scene, const struct suite_reference *ref,
                       struct moments *out, struct err *e)
{
    struct lamps l = {.num = 0};
    json_t *array, *value;
    json_error_t why;
    size_t i;
    if (json_unpack_ex(ref->values, &why, JSON_STRICT, "{s:[F,F,F], s:{s:[F,F], s:[F,F]}, s:o}",
                       "albedo", &l.albedo[0], &l.albedo[1], &l.albedo[2], "footprint", "x",
                       &l.foot_x[0], &l.foot_x[1], "z", &l.foot_z[0], &l.foot_z[1], "lamps",
                       &array) != 0)
        return err_set(e, "%s", why.text);
    if (json_array_size(array) == 0 || json_array_size(array) > MAX_LAMPS)
        return err_set(e, "lamps is not an array of 1 to %d", MAX_LAMPS);
    json_array_foreach(array, i, value)
        if (!read_lamp(value, &l.lamp[l.num++], e))
            return err_prefix(e, "lamps[%zu]", i);
    if (!truth_check_triple("albedo", l.albedo, 1, e) || !truth_check_depth(scene, e))
        return false;
    if (l.foot_x[0] == l.foot_x[1] || l.foot_z[0] == l.foot_z[1])
        return err_set(e, "footprint has no area");
    return render(&l, out, e);
}

const struct truth_kind truth_several_lamps[] = {{"lamps_over_plane", fill_lamps, false}, {0}};
