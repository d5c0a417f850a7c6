#include "truth_spot.h"

#include <gsl/gsl_integration.h>
#include <gsl/gsl_sort.h>
#include <math.h>
#include <stddef.h>

enum { X = 0, Z = 2 };

/* Points per axis of the two rules whose difference is the error estimate, and how many strips may
 * be halved because of it. */
enum { ORDER = 8, CHECK_ORDER = 2 * ORDER, BUDGET = 2000 };
/* Error of one strip relative to the whole: a hundred strips make 1e-10. */
static const double strip_tolerance = 1e-12;

double truth_spot_irradiance(const struct truth_spot *s, double x, double z)
{
    double dx = x - s->light[X], dz = z - s->light[Z], h = s->light[1];
    double d2 = dx * dx + h * h + dz * dz, d = sqrt(d2);
    double cosine = (s->axis[X] * dx - s->axis[1] * h + s->axis[Z] * dz) / d;
    return cosine > s->cos_cutoff ? pow(cosine, s->exponent) * h / (d2 * d) : 0;
}

/* The steepest ray of the cone's edge is asin(sin_cutoff) from its axis. */
bool truth_spot_is_ellipse(const struct truth_spot *s)
{
    return -s->axis[1] > sqrt(1 - s->cos_cutoff * s->cos_cutoff);
}

/* Roots of a t^2 + 2 b t + c, a < 0, in ascending order. */
static bool roots(double a, double b, double c, double t[2])
{
    double discriminant = b * b - a * c;
    if (!(discriminant > 0))
        return false;
    t[0] = (-b + sqrt(discriminant)) / a;
    t[1] = (-b - sqrt(discriminant)) / a;
    return true;
}

/* Where the line parallel to `along` whose other coordinate is `at` lies in the cone. A point at d
 * from the light does if (axis . d)^2 > cos_cutoff^2 d . d. */
static bool chord(const struct truth_spot *s, int along, double at, double t[2])
{
    int across = X + Z - along;
    double c2 = s->cos_cutoff * s->cos_cutoff, h = s->light[1], d = at - s->light[across];
    double b = s->axis[across] * d - s->axis[1] * h, a = s->axis[along];
    if (!roots(a * a - c2, a * b, b * b - c2 * (h * h + d * d), t))
        return false;
    t[0] += s->light[along];
    t[1] += s->light[along];
    return true;
}

/* Lowest and highest z of the ellipse, where the discriminant of the chord along x vanishes. */
static bool extent(const struct truth_spot *s, double z[2])
{
    double a = s->axis[X] * s->axis[X] - s->cos_cutoff * s->cos_cutoff, h = s->light[1];
    if (!roots(s->axis[Z] * s->axis[Z] + a, -s->axis[Z] * s->axis[1] * h,
               (s->axis[1] * s->axis[1] + a) * h * h, z))
        return false;
    z[0] += s->light[Z];
    z[1] += s->light[Z];
    return true;
}

struct patch {
    const struct truth_spot *spot;
    double x[2];
    const gsl_integration_glfixed_table *rule, *check;
    double tolerance;
    int budget;
};

/* Integral over the part of x[0]..x[1] by z0..z1 that is in the cone. */
static double strip(const struct patch *p, const gsl_integration_glfixed_table *rule, double z0,
                    double z1)
{
    double sum = 0;
    for (size_t i = 0; i < rule->n; i++) {
        double z, wz, lit[2];
        gsl_integration_glfixed_point(z0, z1, i, &z, &wz, rule);
        if (!chord(p->spot, X, z, lit))
            continue;
        double x0 = fmax(p->x[0], lit[0]), x1 = fmin(p->x[1], lit[1]);
        for (size_t j = 0; x0 < x1 && j < rule->n; j++) {
            double x, wx;
            gsl_integration_glfixed_point(x0, x1, j, &x, &wx, rule);
            sum += wz * wx * truth_spot_irradiance(p->spot, x, z);
        }
    }
    return sum;
}

/* Halves strips until both rules agree: towards the ends of an ellipse chords shrink like a square
 * root, which no fixed rule follows. NaN if the budget is spent. */
static double refine(struct patch *p, double z0, double z1)
{
    double coarse = strip(p, p->rule, z0, z1), fine = strip(p, p->check, z0, z1);
    if (fabs(fine - coarse) <= p->tolerance)
        return fine;
    if (p->budget-- <= 0)
        return NAN;
    double middle = z0 + (z1 - z0) / 2;
    return refine(p, z0, middle) + refine(p, middle, z1);
}

/* The z at which the limits of integration change their form, so that a strip between two of them
 * is lit at every z or at none; sorted, from z[0] to z[1]. Returns how many. */
static int find_cuts(const struct truth_spot *s, const double x[2], const double z[2],
                     double cut[8])
{
    double candidate[6];
    int found = 0, n = 0;
    for (int i = 0; i < 2; i++)
        found += chord(s, Z, x[i], candidate + found) ? 2 : 0;
    found += extent(s, candidate + found) ? 2 : 0;
    cut[n++] = z[0];
    for (int i = 0; i < found; i++)
        if (candidate[i] > z[0] && candidate[i] < z[1])
            cut[n++] = candidate[i];
    cut[n++] = z[1];
    gsl_sort(cut, 1, (size_t)n);
    return n;
}

bool truth_spot_mean(const struct truth_spot *s, const double x[2], const double z[2], double *mean,
                     struct err *e)
{
    gsl_integration_glfixed_table *rule = gsl_integration_glfixed_table_alloc(ORDER);
    gsl_integration_glfixed_table *check = gsl_integration_glfixed_table_alloc(CHECK_ORDER);
    bool ok = rule != NULL && check != NULL;
    if (!ok) {
        err_set(e, "out of memory for a quadrature rule");
    } else {
        struct patch p = {s, {fmin(x[0], x[1]), fmax(x[0], x[1])}, rule, check, 0, BUDGET};
        double cut[8], sorted[2] = {fmin(z[0], z[1]), fmax(z[0], z[1])}, total = 0;
        int n = find_cuts(s, p.x, sorted, cut);
        for (int i = 0; i + 1 < n; i++)
            total += strip(&p, check, cut[i], cut[i + 1]);
        p.tolerance = strip_tolerance * total;
        *mean = 0;
        for (int i = 0; i + 1 < n; i++)
            *mean += refine(&p, cut[i], cut[i + 1]);
        *mean /= (p.x[1] - p.x[0]) * (sorted[1] - sorted[0]);
        ok = isfinite(*mean) || err_set(e, "quadrature over x %g..%g, z %g..%g not converged",
                                        p.x[0], p.x[1], sorted[0], sorted[1]);
    }
    gsl_integration_glfixed_table_free(rule);
    gsl_integration_glfixed_table_free(check);
    return ok;
}
