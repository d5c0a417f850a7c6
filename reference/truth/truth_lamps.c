#include "truth_lamps.h"

#include "truth_spot.h"
#include "truth_values.h"

#include <gsl/gsl_integration.h>
#include <math.h>
#include <string.h>

enum { MAX_LAMPS = 8 };

/* Points per axis of the two rules whose difference is the error estimate. */
enum { ORDER = 8, CHECK_ORDER = 2 * ORDER };
static const double max_quadrature_error = 1e-10;

enum source { SOURCE_POINT, SOURCE_SPOT, SOURCE_RECTANGLE, SOURCE_SPHERE };

struct lamp {
    enum source source;
    double strength[3];          /* intensity or radiance */
    double light[3];             /* point; centre of the sphere */
    double radius;               /* sphere */
    double height, ex[2], ez[2]; /* rectangle */
    struct truth_spot spot;
};

/* The Lambertian plane y = 0 and the lamps above it. */
struct plane {
    double albedo[3], foot_x[2], foot_z[2];
    struct lamp lamp[MAX_LAMPS];
    int num;
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

static double irradiance(const struct lamp *l, double x, double z)
{
    switch (l->source) {
    case SOURCE_POINT: return truth_point_irradiance(l->light, x, z);
    case SOURCE_SPOT: return truth_spot_irradiance(&l->spot, x, z);
    case SOURCE_RECTANGLE: return truth_rectangle_irradiance(l->height, l->ex, l->ez, x, z);
    case SOURCE_SPHERE: return truth_sphere_irradiance(l->light, l->radius, x, z);
    }
    return NAN;
}

/* Mean irradiance over x[0]..x[1] by z[0]..z[1] by the product rule. */
static double mean_by_rule(const struct lamp *l, const gsl_integration_glfixed_table *rule,
                           const double x[2], const double z[2])
{
    double sum = 0;
    for (size_t i = 0; i < rule->n; i++) {
        double px, wx;
        gsl_integration_glfixed_point(0, 1, i, &px, &wx, rule);
        for (size_t j = 0; j < rule->n; j++) {
            double pz, wz;
            gsl_integration_glfixed_point(0, 1, j, &pz, &wz, rule);
            sum += wx * wz * irradiance(l, x[0] + (x[1] - x[0]) * px, z[0] + (z[1] - z[0]) * pz);
        }
    }
    return sum;
}

static bool mean_irradiance(const struct lamp *l, const gsl_integration_glfixed_table *rule,
                            const gsl_integration_glfixed_table *check, const double x[2],
                            const double z[2], double *mean, struct err *e)
{
    if (l->source == SOURCE_SPOT)
        return truth_spot_mean(&l->spot, x, z, mean, e);
    double coarse = mean_by_rule(l, rule, x, z);
    *mean = mean_by_rule(l, check, x, z);
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
    const size_t width = (size_t)out->width, num = (size_t)p->num;
    for (size_t i = 0; ok && i < width * (size_t)out->height * num; i++) {
        const struct lamp *l = &p->lamp[i % num];
        size_t pixel = i / num;
        int col = (int)(pixel % width), row = (int)(pixel / width);
        double x = p->foot_x[0] + dx * col, z = p->foot_z[0] + dz * row, mean;
        ok = mean_irradiance(l, rule, check, (double[2]){x, x + dx}, (double[2]){z, z + dz}, &mean,
                             e) ||
             err_prefix(e, "pixel (%d,%d)", col, row);
        for (int c = 0; ok && c < 3; c++)
            out->mean[3 * pixel + (size_t)c] += p->albedo[c] / M_PI * l->strength[c] * mean;
    }
    gsl_integration_glfixed_table_free(rule);
    gsl_integration_glfixed_table_free(check);
    return ok;
}

static bool check_light(const double position[3], struct err *e)
{
    return position[1] > 0 || err_set(e, "light is at height %g, not above the plane", position[1]);
}

static bool check_rectangle(const struct lamp *l, struct err *e)
{
    if (!(l->height > 0))
        return err_set(e, "height is %g, not above the plane", l->height);
    return (l->ex[0] < l->ex[1] && l->ez[0] < l->ez[1]) || err_set(e, "emitter has no area");
}

static bool read_point(const json_t *values, struct plane *p, struct lamp *l, struct err *e)
{
    return truth_values_read(
               values, e, "intensity[3]>=0 light[3] albedo[3]=0..1 footprint.x[2] footprint.z[2]",
               l->strength, l->light, p->albedo, p->foot_x, p->foot_z) &&
           check_light(l->light, e);
}

/* Makes v a unit vector. */
static bool normalise(const char *name, double v[3], struct err *e)
{
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++)
        v[i] /= length;
    return length > 0 || err_set(e, "%s has no direction", name);
}

static bool read_spot(const json_t *values, struct plane *p, struct lamp *l, struct err *e)
{
    struct truth_spot *s = &l->spot;
    double cutoff;
    if (!truth_values_read(
            values, e,
            "intensity[3]>=0 light[3] axis[3] exponent>=0 cutoff>0 albedo[3]=0..1 footprint.x[2] footprint.z[2]",
            l->strength, s->light, s->axis, &s->exponent, &cutoff, p->albedo, p->foot_x, p->foot_z))
        return false;
    if (!(cutoff < 90))
        return err_set(e, "cutoff is %g degrees, not below 90", cutoff);
    s->cos_cutoff = cos(cutoff * M_PI / 180);
    return check_light(s->light, e) && normalise("axis", s->axis, e) &&
           (truth_spot_is_ellipse(s) || err_set(e, "the cone does not end on the plane"));
}

static bool read_rectangle(const json_t *values, struct plane *p, struct lamp *l, struct err *e)
{
    return truth_values_read(
               values, e,
               "radiance[3]>=0 height emitter.x[2] emitter.z[2] albedo[3]=0..1 footprint.x[2] footprint.z[2]",
               l->strength, &l->height, l->ex, l->ez, p->albedo, p->foot_x, p->foot_z) &&
           check_rectangle(l, e);
}

static bool read_sphere(const json_t *values, struct plane *p, struct lamp *l, struct err *e)
{
    return truth_values_read(
               values, e,
               "radiance[3]>=0 centre[3] radius>0 albedo[3]=0..1 footprint.x[2] footprint.z[2]",
               l->strength, l->light, &l->radius, p->albedo, p->foot_x, p->foot_z) &&
           (l->radius < l->light[1] ||
            err_set(e, "radius is %g, not below the height %g", l->radius, l->light[1]));
}

/* Reads one entry of "lamps". */
static bool read_lamp(const json_t *values, struct lamp *l, struct err *e)
{
    l->source = json_object_get(values, "intensity") != NULL ? SOURCE_POINT : SOURCE_RECTANGLE;
    if (l->source == SOURCE_POINT)
        return truth_values_read(values, e, "intensity[3]>=0 light[3]", l->strength, l->light) &&
               check_light(l->light, e);
    return truth_values_read(values, e, "radiance[3]>=0 height x[2] z[2]", l->strength, &l->height,
                             l->ex, l->ez) &&
           check_rectangle(l, e);
}

static bool read_lamps(const json_t *values, struct plane *p, struct lamp *l, struct err *e)
{
    const json_t *lamps = json_object_get(values, "lamps");
    p->num = (int)json_array_size(lamps);
    if (p->num < 1 || p->num > MAX_LAMPS)
        return err_set(e, "lamps is not an array of 1 to %d", MAX_LAMPS);
    for (int i = 0; i < p->num; i++)
        if (!read_lamp(json_array_get(lamps, (size_t)i), &l[i], e))
            return err_prefix(e, "lamps[%d]", i);
    return truth_values_read(values, e, "albedo[3]=0..1 footprint.x[2] footprint.z[2] (lamps)",
                             p->albedo, p->foot_x, p->foot_z);
}

/* The sources are out of sight and the plane does not see itself, so that every depth from 1 on
 * gives the same image. */
static bool fill_plane(const struct suite_scene *scene, const struct suite_reference *ref,
                       struct moments *out, struct err *e)
{
    static const struct {
        const char *kind;
        enum source source;
        bool (*read)(const json_t *, struct plane *, struct lamp *, struct err *);
    } forms[] = {{"point_over_plane", SOURCE_POINT, read_point},
                 {"spot_over_plane", SOURCE_SPOT, read_spot},
                 {"rectangle_over_plane", SOURCE_RECTANGLE, read_rectangle},
                 {"sphere_over_plane", SOURCE_SPHERE, read_sphere},
                 {"lamps_over_plane", SOURCE_POINT, read_lamps}};
    struct plane p = {.num = 1};
    int i = 0;
    while (strcmp(forms[i].kind, ref->kind) != 0)
        i++;
    p.lamp[0].source = forms[i].source;
    if (!forms[i].read(ref->values, &p, p.lamp, e) || !truth_check_depth(scene, e))
        return false;
    if (p.foot_x[0] == p.foot_x[1] || p.foot_z[0] == p.foot_z[1])
        return err_set(e, "footprint has no area");
    return plane_render(&p, out, e);
}

const struct truth_kind truth_lamps[] = {
    {"point_over_plane", fill_plane, false},     {"spot_over_plane", fill_plane, false},
    {"rectangle_over_plane", fill_plane, false}, {"sphere_over_plane", fill_plane, false},
    {"lamps_over_plane", fill_plane, false},     {0}};
