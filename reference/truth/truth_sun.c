#include "truth_sun.h"

#include "truth_values.h"

#include <math.h>

/* The upward normal, not of unit length, of the facet between the ridges k and k+1. */
static void facet_normal(const struct truth_pyramid *p, int k, double n[3])
{
    double u[3], v[3];
    for (int i = 0; i < 3; i++) {
        u[i] = p->ridge[k][i] - p->apex[i];
        v[i] = p->ridge[(k + 1) % 4][i] - p->apex[i];
    }
    n[0] = v[1] * u[2] - v[2] * u[1];
    n[1] = v[2] * u[0] - v[0] * u[2];
    n[2] = v[0] * u[1] - v[1] * u[0];
}

static double inner(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void truth_pyramid_cosines(const struct truth_pyramid *p, double cosine[4])
{
    for (int k = 0; k < 4; k++) {
        double n[3];
        facet_normal(p, k, n);
        cosine[k] = inner(n, p->to_light) / sqrt(inner(n, n) * inner(p->to_light, p->to_light));
    }
}

/* Facets that see each other would need another form. */
static bool is_convex(const struct truth_pyramid *p)
{
    for (int k = 0; k < 4; k++) {
        double n[3];
        facet_normal(p, k, n);
        for (int i = 0; i < 4; i++)
            if (i != k && i != (k + 1) % 4 && !(inner(n, p->ridge[i]) < inner(n, p->apex)))
                return false;
    }
    return true;
}

static bool read_pyramid(json_t *values, struct truth_pyramid *p, double irradiance[3],
                         double albedo[3], double centre[2], struct err *e)
{
    if (!truth_values_read(
            values, e, "irradiance[3]>=0 albedo[3]=0..1 to_light[3] apex[3] ridges[12] centre[2]",
            irradiance, albedo, p->to_light, p->apex, p->ridge[0], centre))
        return false;
    double cosine[4];
    truth_pyramid_cosines(p, cosine);
    for (int k = 0; k < 4; k++)
        if (!(cosine[k] > 0))
            return err_set(e, "the facet behind ridge %d does not face the light", k);
    return is_convex(p) || err_set(e, "the pyramid is not convex");
}

static double clamp01(double x)
{
    return fmin(fmax(x, 0), 1);
}

static bool fill_pyramid(const struct suite_scene *scene, const struct suite_reference *ref,
                         struct moments *out, struct err *e)
{
    struct truth_pyramid p;
    double irradiance[3], albedo[3], centre[2], facet[4];
    if (!read_pyramid(ref->values, &p, irradiance, albedo, centre, e) ||
        !truth_check_depth(scene, e))
        return false;
    truth_pyramid_cosines(&p, facet);
    for (int row = 0; row < out->height; row++)
        for (int col = 0; col < out->width; col++) {
            double right = clamp01(col + 1 - centre[0] * out->width);
            double low = clamp01(row + 1 - centre[1] * out->height);
            double mean = low * (right * facet[0] + (1 - right) * facet[1]) +
                          (1 - low) * ((1 - right) * facet[2] + right * facet[3]);
            size_t pixel = (size_t)row * (size_t)out->width + (size_t)col;
            for (size_t c = 0; c < 3; c++)
                out->mean[3 * pixel + c] = albedo[c] / M_PI * irradiance[c] * mean;
        }
    return true;
}

const struct truth_kind truth_sun[] = {{"sun_on_pyramid", fill_pyramid, false}, {0}};
