#include "truth.h"

#include "truth_ggx.h"
#include "truth_optics.h"
#include "truth_sky.h"

#include <gsl/gsl_integration.h>
#include <gsl/gsl_math.h>

#include <stdio.h>
#include <string.h>

/* Points per axis of the two rules whose difference is the error estimate. */
enum { ORDER = 8, CHECK_ORDER = 2 * ORDER };
static const double max_quadrature_error = 1e-10;

enum source { SOURCE_POINT, SOURCE_RECTANGLE };

/* A Lambertian plane y = 0 under one source. */
struct plane {
    enum source source;
    double strength[3]; /* intensity or radiance */
    double albedo[3];
    double light[3];             /* point */
    double height, ex[2], ez[2]; /* rectangle */
    double foot_x[2], foot_z[2];
};

double truth_furnace(double emission, double albedo, int depth)
{
    double sum = 1;
    for (int k = 0; k < depth; k++)
        sum = 1 + albedo * sum;
    return emission * sum;
}

double truth_point_irradiance(const double light[3], double x, double z)
{
    double dx = light[0] - x, dz = light[2] - z;
    double d2 = dx * dx + light[1] * light[1] + dz * dz;
    return light[1] / (d2 * sqrt(d2));
}

/* Irradiance from the rectangle whose corners are above (0, 0) and (a, b); odd in a and in b. */
static double corner(double height, double a, double b)
{
    double ra = hypot(height, a), rb = hypot(height, b);
    return 0.5 * (a / ra * atan(b / ra) + b / rb * atan(a / rb));
}

double truth_rectangle_irradiance(double height, const double ex[2], const double ez[2], double x,
                                  double z)
{
    return corner(height, ex[1] - x, ez[1] - z) - corner(height, ex[0] - x, ez[1] - z) -
           corner(height, ex[1] - x, ez[0] - z) + corner(height, ex[0] - x, ez[0] - z);
}

static double irradiance(const struct plane *p, double x, double z)
{
    if (p->source == SOURCE_POINT)
        return truth_point_irradiance(p->light, x, z);
    return truth_rectangle_irradiance(p->height, p->ex, p->ez, x, z);
}

/* Mean irradiance over [x0,x1] x [z0,z1] by the product rule. */
static double mean_irradiance(const struct plane *p, const gsl_integration_glfixed_table *rule,
                              double x0, double x1, double z0, double z1)
{
    double sum = 0;
    for (size_t i = 0; i < rule->n; i++) {
        double x, wx;
        gsl_integration_glfixed_point(0, 1, i, &x, &wx, rule);
        for (size_t j = 0; j < rule->n; j++) {
            double z, wz;
            gsl_integration_glfixed_point(0, 1, j, &z, &wz, rule);
            sum += wx * wz * irradiance(p, x0 + (x1 - x0) * x, z0 + (z1 - z0) * z);
        }
    }
    return sum;
}

static bool plane_render(const struct plane *p, struct moments *out, struct err *e)
{
    bool ok = false;
    gsl_integration_glfixed_table *rule = gsl_integration_glfixed_table_alloc(ORDER);
    gsl_integration_glfixed_table *check = gsl_integration_glfixed_table_alloc(CHECK_ORDER);
    if (rule == NULL || check == NULL) {
        err_set(e, "out of memory for a quadrature rule");
        goto done;
    }
    double dx = (p->foot_x[1] - p->foot_x[0]) / out->width;
    double dz = (p->foot_z[1] - p->foot_z[0]) / out->height;
    for (int row = 0; row < out->height; row++) {
        for (int col = 0; col < out->width; col++) {
            double x = p->foot_x[0] + dx * col, z = p->foot_z[0] + dz * row;
            double coarse = mean_irradiance(p, rule, x, x + dx, z, z + dz);
            double fine = mean_irradiance(p, check, x, x + dx, z, z + dz);
            /* Written so that NaN fails too. */
            if (!(fabs(fine - coarse) <= max_quadrature_error * fine)) {
                err_set(e, "pixel (%d,%d): quadrature not converged: %.12g and %.12g", col, row,
                        coarse, fine);
                goto done;
            }
            size_t pixel = (size_t)row * (size_t)out->width + (size_t)col;
            for (size_t c = 0; c < 3; c++)
                out->mean[3 * pixel + c] = p->albedo[c] / M_PI * p->strength[c] * fine;
        }
    }
    ok = true;
done:
    gsl_integration_glfixed_table_free(rule);
    gsl_integration_glfixed_table_free(check);
    return ok;
}

bool truth_check_triple(const char *name, const double v[3], double hi, struct err *e)
{
    for (int c = 0; c < 3; c++)
        if (!(v[c] >= 0 && v[c] <= hi))
            return err_set(e, "%s[%d] is %g, not in [0, %g]", name, c, v[c], hi);
    return true;
}

static bool furnace_values(json_t *values, double emission[3], double albedo[3], struct err *e)
{
    json_error_t why;
    if (json_unpack_ex(values, &why, JSON_STRICT, "{s:[F,F,F], s:[F,F,F]}", "emission",
                       &emission[0], &emission[1], &emission[2], "albedo", &albedo[0], &albedo[1],
                       &albedo[2]) != 0)
        return err_set(e, "%s", why.text);
    return truth_check_triple("emission", emission, HUGE_VAL, e) &&
           truth_check_triple("albedo", albedo, 1, e);
}

static bool point_values(json_t *values, struct plane *p, struct err *e)
{
    json_error_t why;
    if (json_unpack_ex(
            values, &why, JSON_STRICT, "{s:[F,F,F], s:[F,F,F], s:[F,F,F], s:{s:[F,F], s:[F,F]}}",
            "intensity", &p->strength[0], &p->strength[1], &p->strength[2], "albedo", &p->albedo[0],
            &p->albedo[1], &p->albedo[2], "light", &p->light[0], &p->light[1], &p->light[2],
            "footprint", "x", &p->foot_x[0], &p->foot_x[1], "z", &p->foot_z[0], &p->foot_z[1]) != 0)
        return err_set(e, "%s", why.text);
    if (!(p->light[1] > 0))
        return err_set(e, "light is at height %g, not above the plane", p->light[1]);
    return truth_check_triple("intensity", p->strength, HUGE_VAL, e);
}

static bool rectangle_values(json_t *values, struct plane *p, struct err *e)
{
    json_error_t why;
    if (json_unpack_ex(values, &why, JSON_STRICT,
                       "{s:[F,F,F], s:[F,F,F], s:F, s:{s:[F,F], s:[F,F]}, s:{s:[F,F], s:[F,F]}}",
                       "radiance", &p->strength[0], &p->strength[1], &p->strength[2], "albedo",
                       &p->albedo[0], &p->albedo[1], &p->albedo[2], "height", &p->height, "emitter",
                       "x", &p->ex[0], &p->ex[1], "z", &p->ez[0], &p->ez[1], "footprint", "x",
                       &p->foot_x[0], &p->foot_x[1], "z", &p->foot_z[0], &p->foot_z[1]) != 0)
        return err_set(e, "%s", why.text);
    if (!(p->height > 0))
        return err_set(e, "height is %g, not above the plane", p->height);
    if (!(p->ex[0] < p->ex[1] && p->ez[0] < p->ez[1]))
        return err_set(e, "emitter has no area");
    return truth_check_triple("radiance", p->strength, HUGE_VAL, e);
}

static bool fill_furnace(json_t *values, int depth, struct moments *out, struct err *e)
{
    double emission[3], albedo[3];
    if (!furnace_values(values, emission, albedo, e))
        return false;
    size_t pixels = (size_t)out->width * (size_t)out->height;
    for (size_t i = 0; i < 3 * pixels; i++)
        out->mean[i] = truth_furnace(emission[i % 3], albedo[i % 3], depth);
    return true;
}

/* The source itself is out of sight and the plane does not see itself, so that every depth from 1
 * on gives the same picture. */
static bool fill_plane(struct plane *p, json_t *values, int depth, struct moments *out,
                       struct err *e)
{
    if (p->source == SOURCE_POINT ? !point_values(values, p, e) : !rectangle_values(values, p, e))
        return false;
    if (!truth_check_triple("albedo", p->albedo, 1, e))
        return false;
    if (p->foot_x[0] == p->foot_x[1] || p->foot_z[0] == p->foot_z[1])
        return err_set(e, "footprint has no area");
    if (depth < 1)
        return err_set(e, "depth is %d, but the form needs direct light (1 or more)", depth);
    return plane_render(p, out, e);
}

static const struct truth_kind *const families[] = {truth_optics, truth_ggx, truth_sky};

static const struct truth_kind *find_kind(const char *name)
{
    for (size_t i = 0; i < sizeof families / sizeof *families; i++)
        for (const struct truth_kind *k = families[i]; k->name != NULL; k++)
            if (strcmp(k->name, name) == 0)
                return k;
    return NULL;
}

bool truth_render(const struct suite_scene *scene, const struct suite_reference *ref,
                  struct moments *out, struct err *e)
{
    struct moments m = {0};
    bool ok = moments_alloc(&m, scene->width, scene->height, e);
    if (!ok)
        goto fail;
    snprintf(m.unit, sizeof m.unit, "exact");
    m.spp = 0;
    for (size_t i = 0; i < (size_t)m.width * (size_t)m.height; i++)
        m.n[i] = 1;

    if (strcmp(ref->kind, "furnace") == 0)
        ok = fill_furnace(ref->values, scene->depth, &m, e);
    else if (strcmp(ref->kind, "point_over_plane") == 0)
        ok = fill_plane(&(struct plane){.source = SOURCE_POINT}, ref->values, scene->depth, &m, e);
    else if (strcmp(ref->kind, "rectangle_over_plane") == 0)
        ok = fill_plane(&(struct plane){.source = SOURCE_RECTANGLE}, ref->values, scene->depth, &m,
                        e);
    else if (find_kind(ref->kind) != NULL)
        ok = find_kind(ref->kind)->fill(scene, ref->values, &m, e);
    else
        ok = err_set(e, "unknown closed form");
    if (!ok)
        goto fail;
    *out = m;
    return true;
fail:
    moments_free(&m);
    return err_prefix(e, "%s: truth '%s'", scene->name, ref->kind);
}
