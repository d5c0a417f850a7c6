#include "truth_one_lamp.h"

#include "truth_spot.h"

#include <gsl/gsl_integration.h>
#include <math.h>
#include <string.h>

/* Points per axis of the two rules whose difference is the error estimate. */
enum { ORDER = 8, CHECK_ORDER = 2 * ORDER };
static const double max_quadrature_error = 1e-10;

enum source { SOURCE_POINT, SOURCE_SPOT, SOURCE_RECTANGLE, SOURCE_SPHERE };

/* A Lambertian plane y = 0 under one source. */
struct plane {
    enum source source;
    double strength[3]; /* intensity or radiance */
    double albedo[3];
    double light[3];             /* point; centre of the sphere */
    double radius;               /* sphere */
    double height, ex[2], ez[2]; /* rectangle */
    struct truth_spot spot;
    double foot_x[2], foot_z[2];
};

double truth_point_irradiance(const double light[3], double x, double z)
{
    double dx = light[0] - x, dz = light[2] - z;
    double d2 = dx * dx + light[1] * light[1] + dz * dz;
    return light[1] / (d2 * sqrt(d2));
}

double truth_sphere_irradiance(const double centre[3], double radius, double x, double z)
{
    return M_PI * radius * radius * truth_point_irradiance(centre, x, z);
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
    switch (p->source) {
    case SOURCE_POINT: return truth_point_irradiance(p->light, x, z);
    case SOURCE_SPOT: return truth_spot_irradiance(&p->spot, x, z);
    case SOURCE_RECTANGLE: return truth_rectangle_irradiance(p->height, p->ex, p->ez, x, z);
    case SOURCE_SPHERE: return truth_sphere_irradiance(p->light, p->radius, x, z);
    }
    return NAN;
}

/* Mean irradiance over x[0]..x[1] by z[0]..z[1] by the product rule. */
static double mean_by_rule(const struct plane *p, const gsl_integration_glfixed_table *rule,
                           const double x[2], const double z[2])
{
    double sum = 0;
    for (size_t i = 0; i < rule->n; i++) {
        double px, wx;
        gsl_integration_glfixed_point(0, 1, i, &px, &wx, rule);
        for (size_t j = 0; j < rule->n; j++) {
            double pz, wz;
            gsl_integration_glfixed_point(0, 1, j, &pz, &wz, rule);
            sum += wx * wz * irradiance(p, x[0] + (x[1] - x[0]) * px, z[0] + (z[1] - z[0]) * pz);
        }
    }
    return sum;
}

static bool mean_irradiance(const struct plane *p, const gsl_integration_glfixed_table *rule,
                            const gsl_integration_glfixed_table *check, const double x[2],
                            const double z[2], double *mean, struct err *e)
{
    if (p->source == SOURCE_SPOT)
        return truth_spot_mean(&p->spot, x, z, mean, e);
    double coarse = mean_by_rule(p, rule, x, z);
    *mean = mean_by_rule(p, check, x, z);
    /* Written so that NaN fails too. */
    if (!(fabs(*mean - coarse) <= max_quadrature_error * *mean))
        return err_set(e, "quadrature not converged: %.12g and %.12g", coarse, *mean);
    return true;
}

static bool plane_render(const struct plane *p, struct moments *out, struct err *e)
{
    gsl_integration_glfixed_table *rule = gsl_integration_glfixed_table_alloc(ORDER);
    gsl_integration_glfixed_table *check = gsl_integration_glfixed_table_alloc(CHECK_ORDER);
    bool ok = (rule != NULL && check != NULL) || err_set(e, "out of memory for a quadrature rule");
    double dx = (p->foot_x[1] - p->foot_x[0]) / out->width;
    double dz = (p->foot_z[1] - p->foot_z[0]) / out->height;
    for (int i = 0; ok && i < out->width * out->height; i++) {
        int col = i % out->width, row = i / out->width;
        double x = p->foot_x[0] + dx * col, z = p->foot_z[0] + dz * row, mean;
        ok = mean_irradiance(p, rule, check, (double[2]){x, x + dx}, (double[2]){z, z + dz}, &mean,
                             e) ||
             err_prefix(e, "pixel (%d,%d)", col, row);
        for (int c = 0; ok && c < 3; c++)
            out->mean[3 * i + c] = p->albedo[c] / M_PI * p->strength[c] * mean;
    }
    gsl_integration_glfixed_table_free(rule);
    gsl_integration_glfixed_table_free(check);
    return ok;
}

static bool check_light(const char *name, const double position[3], struct err *e)
{
    return position[1] > 0 ||
           err_set(e, "%s is at height %g, not above the plane", name, position[1]);
}

static bool read_point(json_t *values, struct plane *p, struct err *e)
{
    json_error_t why;
    if (json_unpack_ex(
            values, &why, JSON_STRICT, "{s:[F,F,F], s:[F,F,F], s:[F,F,F], s:{s:[F,F], s:[F,F]}}",
            "intensity", &p->strength[0], &p->strength[1], &p->strength[2], "albedo", &p->albedo[0],
            &p->albedo[1], &p->albedo[2], "light", &p->light[0], &p->light[1], &p->light[2],
            "footprint", "x", &p->foot_x[0], &p->foot_x[1], "z", &p->foot_z[0], &p->foot_z[1]) != 0)
        return err_set(e, "%s", why.text);
    return check_light("light", p->light, e) &&
           truth_check_triple("intensity", p->strength, HUGE_VAL, e);
}

/* Makes v a unit vector. */
static bool normalise(const char *name, double v[3], struct err *e)
{
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    if (!(length > 0))
        return err_set(e, "%s has no direction", name);
    for (int i = 0; i < 3; i++)
        v[i] /= length;
    return true;
}

static bool read_spot(json_t *values, struct plane *p, struct err *e)
{
    struct truth_spot *s = &p->spot;
    double cutoff;
    json_error_t why;
    if (json_unpack_ex(values, &why, JSON_STRICT,
                       "{s:[F,F,F], s:[F,F,F], s:[F,F,F], s:[F,F,F], s:F, s:F,"
                       " s:{s:[F,F], s:[F,F]}}",
                       "intensity", &p->strength[0], &p->strength[1], &p->strength[2], "albedo",
                       &p->albedo[0], &p->albedo[1], &p->albedo[2], "light", &s->light[0],
                       &s->light[1], &s->light[2], "axis", &s->axis[0], &s->axis[1], &s->axis[2],
                       "exponent", &s->exponent, "cutoff", &cutoff, "footprint", "x", &p->foot_x[0],
                       &p->foot_x[1], "z", &p->foot_z[0], &p->foot_z[1]) != 0)
        return err_set(e, "%s", why.text);
    if (!(s->exponent >= 0))
        return err_set(e, "exponent is %g", s->exponent);
    if (!(cutoff > 0 && cutoff < 90))
        return err_set(e, "cutoff is %g degrees, not between 0 and 90", cutoff);
    s->cos_cutoff = cos(cutoff * M_PI / 180);
    return check_light("light", s->light, e) && normalise("axis", s->axis, e) &&
           (truth_spot_is_ellipse(s) || err_set(e, "the cone does not end on the plane")) &&
           truth_check_triple("intensity", p->strength, HUGE_VAL, e);
}

static bool read_rectangle(json_t *values, struct plane *p, struct err *e)
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

static bool read_sphere(json_t *values, struct plane *p, struct err *e)
{
    json_error_t why;
    if (json_unpack_ex(values, &why, JSON_STRICT,
                       "{s:[F,F,F], s:[F,F,F], s:[F,F,F], s:F, s:{s:[F,F], s:[F,F]}}", "radiance",
                       &p->strength[0], &p->strength[1], &p->strength[2], "albedo", &p->albedo[0],
                       &p->albedo[1], &p->albedo[2], "centre", &p->light[0], &p->light[1],
                       &p->light[2], "radius", &p->radius, "footprint", "x", &p->foot_x[0],
                       &p->foot_x[1], "z", &p->foot_z[0], &p->foot_z[1]) != 0)
        return err_set(e, "%s", why.text);
    if (!(p->radius > 0 && p->radius < p->light[1]))
        return err_set(e, "radius is %g, not between 0 and the height %g", p->radius, p->light[1]);
    return truth_check_triple("radiance", p->strength, HUGE_VAL, e);
}

static const struct {
    const char *kind;
    enum source source;
    bool (*read)(json_t *, struct plane *, struct err *);
} sources[] = {{"point_over_plane", SOURCE_POINT, read_point},
               {"spot_over_plane", SOURCE_SPOT, read_spot},
               {"rectangle_over_plane", SOURCE_RECTANGLE, read_rectangle},
               {"sphere_over_plane", SOURCE_SPHERE, read_sphere}};

/* The source itself is out of sight and the plane does not see itself, so that every depth from 1 on
 * gives the same image. */
static bool fill_plane(const struct suite_scene *scene, const struct suite_reference *ref,
                       struct moments *out, struct err *e)
{
    int i = 0;
    while (strcmp(sources[i].kind, ref->kind) != 0)
        i++;
    struct plane p = {.source = sources[i].source};
    if (!sources[i].read(ref->values, &p, e) || !truth_check_triple("albedo", p.albedo, 1, e) ||
        !truth_check_depth(scene, e))
        return false;
    if (p.foot_x[0] == p.foot_x[1] || p.foot_z[0] == p.foot_z[1])
        return err_set(e, "footprint has no area");
    return plane_render(&p, out, e);
}

const struct truth_kind truth_one_lamp[] = {{"point_over_plane", fill_plane, false},
                                            {"spot_over_plane", fill_plane, false},
                                            {"rectangle_over_plane", fill_plane, false},
                                            {"sphere_over_plane", fill_plane, false},
                                            {0}};
