#include "truth_ggx.h"

#include "truth_pixel_mean.h"
#include "truth_values.h"

#include <gsl/gsl_chebyshev.h>
#include <gsl/gsl_integration.h>
#include <gsl/gsl_math.h>
#include <string.h>

/* The albedo, a smooth function of the cosine, is computed at CHEBYSHEV + 1 cosines with POINTS x POINTS
 * points each, interpolated, and checked in between with CHECK_POINTS. (GSL has these two rules as tables, in
 * full precision.) */
enum { POINTS = 96, CHECK_POINTS = 128, CHEBYSHEV = 60, CHECKS = 7 };
static const double max_albedo_error = 1e-10;

double truth_fresnel_conductor(double cos_i, double eta, double k)
{
    double c2 = cos_i * cos_i, s2 = 1 - c2, t = eta * eta - k * k - s2;
    double a2b2 = sqrt(t * t + 4 * eta * eta * k * k), a = sqrt(0.5 * (a2b2 + t));
    double s = (a2b2 + c2 - 2 * a * cos_i) / (a2b2 + c2 + 2 * a * cos_i);
    double p =
        s * (c2 * a2b2 + s2 * s2 - 2 * a * cos_i * s2) / (c2 * a2b2 + s2 * s2 + 2 * a * cos_i * s2);
    return 0.5 * (s + p);
}

/* Smith's auxiliary function times the cosine, which is finite on the horizon too. */
static double lambda_cos(double alpha, double c)
{
    return 0.5 * (sqrt(c * c + alpha * alpha * (1 - c * c)) - c);
}

static double ggx_d(double alpha, double z)
{
    double e = 1 + z * z * (alpha * alpha - 1);
    return alpha * alpha / (M_PI * e * e);
}

/* 1/a = alpha tan is infinite on the horizon, where the product is alpha/(2 sqrt pi). */
static double beckmann_lambda_cos(double alpha, double c)
{
    double s = sqrt(1 - c * c), a = c / (alpha * s);
    return s == 0 ? 0 : 0.5 * (alpha * s * exp(-a * a) / sqrt(M_PI) - c * erfc(a));
}

static double beckmann_d(double alpha, double z)
{
    double z2 = z * z, a2 = alpha * alpha;
    return exp((1 - 1 / z2) / a2) / (M_PI * a2 * z2 * z2);
}

struct facets {
    double (*d)(double alpha, double cosine);
    double (*lambda_cos)(double alpha, double cosine);
};
static const struct facets ggx = {ggx_d, lambda_cos}, beckmann = {beckmann_d, beckmann_lambda_cos};

static double albedo_of(const struct facets *facets, double alpha, double eta, double k,
                        double cos_o, int points)
{
    gsl_integration_glfixed_table *rule = gsl_integration_glfixed_table_alloc((size_t)points);
    double sin_o = sqrt(1 - cos_o * cos_o), sum = 0, lo = facets->lambda_cos(alpha, cos_o);
    if (rule == NULL)
        return NAN;
    for (size_t i = 0; i < rule->n; i++) {
        double theta, w_theta;
        gsl_integration_glfixed_point(0, M_PI_2, i, &theta, &w_theta, rule);
        double c = cos(theta), s = sin(theta);
        /* G2/cos_i, with cos_i cos_o (1 + lambda_o + lambda_i) as the denominator of G2/(cos_i cos_o)
         */
        double g = cos_o / (c * cos_o + c * lo + cos_o * facets->lambda_cos(alpha, c));
        for (size_t j = 0; j < rule->n; j++) {
            double azimuth, w_azimuth;
            gsl_integration_glfixed_point(0, M_PI, j, &azimuth, &w_azimuth, rule);
            double cos_both = cos_o * c + sin_o * s * cos(azimuth);
            double cos_h = sqrt(0.5 * (1 + cos_both)), z = (cos_o + c) / (2 * cos_h);
            sum += w_theta * w_azimuth * s * c * facets->d(alpha, z) * g *
                   truth_fresnel_conductor(cos_h, eta, k) / (4 * cos_o);
        }
    }
    gsl_integration_glfixed_table_free(rule);
    return 2 * sum;
}

double truth_ggx_albedo(double alpha, double eta, double k, double cos_o, int points)
{
    return albedo_of(&ggx, alpha, eta, k, cos_o, points);
}

double truth_beckmann_albedo(double alpha, double eta, double k, double cos_o, int points)
{
    return albedo_of(&beckmann, alpha, eta, k, cos_o, points);
}

struct ggx_sphere {
    const struct facets *facets;
    double centre[3], radius, sky[3], alpha, eta[3], k[3];
    gsl_cheb_series *albedo[3]; /* in the cosine */
    int channel;                /* of the one being fitted */
};

static double albedo_at(double cos_o, void *form)
{
    const struct ggx_sphere *s = form;
    return albedo_of(s->facets, s->alpha, s->eta[s->channel], s->k[s->channel], cos_o, POINTS);
}

static bool fit_albedo(struct ggx_sphere *s, double min_cos, struct err *e)
{
    for (int c = 0; c < 3; c++) {
        gsl_function f = {albedo_at, s};
        s->channel = c;
        s->albedo[c] = gsl_cheb_alloc(CHEBYSHEV);
        if (s->albedo[c] == NULL)
            return err_set(e, "out of memory");
        gsl_cheb_init(s->albedo[c], &f, min_cos, 1);
        for (int i = 0; i <= CHECKS; i++) {
            double at = min_cos + (1 - min_cos) * i / CHECKS;
            double fit = gsl_cheb_eval(s->albedo[c], at);
            double a = albedo_of(s->facets, s->alpha, s->eta[c], s->k[c], at, CHECK_POINTS);
            if (!(fabs(fit - a) <= max_albedo_error * a))
                return err_set(e, "albedo at cosine %g is not converged: %.12g and %.12g", at, fit,
                               a);
        }
    }
    return true;
}

static int ggx_radiance(const void *form, const double eye[3], const double d[3], double light[3])
{
    const struct ggx_sphere *s = form;
    double cos_i, normal[3];
    bool hit = truth_sphere_hit(eye, d, s->centre, s->radius, &cos_i, normal);
    for (int c = 0; c < 3; c++)
        light[c] = s->sky[c] * (hit ? gsl_cheb_eval(s->albedo[c], cos_i) : 1);
    return hit;
}

static bool fill_sphere(const struct suite_scene *scene, const struct suite_reference *ref,
                        struct moments *out, struct err *e)
{
    struct ggx_sphere s = {.facets = strcmp(ref->kind, "ggx_sphere") == 0 ? &ggx : &beckmann};
    struct truth_view view;
    double min_cos;
    if (!truth_values_read(ref->values, e,
                           "(view) centre[3] radius>0 sky[3]>=0 alpha>0 eta[3]>=0 k[3]>=0",
                           s.centre, &s.radius, s.sky, &s.alpha, s.eta, s.k) ||
        !truth_view_read(ref->values, scene, &view, e) ||
        !truth_view_filled(&view, s.centre, s.radius, &min_cos, e) || !truth_check_depth(scene, e))
        return false;
    bool ok = fit_albedo(&s, min_cos, e) && truth_view_render(&view, ggx_radiance, &s, out, e);
    for (int c = 0; c < 3; c++)
        gsl_cheb_free(s.albedo[c]);
    return ok;
}

const struct truth_kind truth_ggx[] = {
    {"ggx_sphere", fill_sphere, true}, {"beckmann_sphere", fill_sphere, true}, {0}};
