#include "optics.h"

#include "vectors.h"

#include <assert.h>
#include <gsl/gsl_errno.h>
#include <gsl/gsl_integration.h>
#include <math.h>

enum { INNER_POINTS = 16, OUTER_INTERVALS = 200 };

static double square_abs(double complex a)
{
    return creal(a) * creal(a) + cimag(a) * cimag(a);
}

static double complex cosine_behind(double cos_i, double complex n)
{
    return csqrt(1 - (1 - cos_i * cos_i) / (n * n));
}

double optics_fresnel(double cos_i, double complex n)
{
    if (n == 0)
        return 1;
    double complex cos_t = cosine_behind(cos_i, n);
    double complex s = (cos_i - n * cos_t) / (cos_i + n * cos_t);
    double complex p = (n * cos_i - cos_t) / (n * cos_i + cos_t);
    return (square_abs(s) + square_abs(p)) / 2;
}

double optics_transmitted(double cos_i, double n)
{
    double complex cos_t = cosine_behind(cos_i, n);
    double complex s = 2 * cos_i / (cos_i + n * cos_t), p = 2 * cos_i / (n * cos_i + cos_t);
    return n * creal(cos_t) / cos_i * (square_abs(s) + square_abs(p)) / 2;
}

struct optics_view optics_view(double cos_o, double azimuth, double alpha)
{
    double sin_o = sqrt(1 - cos_o * cos_o);
    return (struct optics_view){.wo = {sin_o * cos(azimuth), sin_o * sin(azimuth), cos_o},
                                .cos_o = cos_o,
                                .sin_o = sin_o,
                                .azimuth = azimuth,
                                .alpha = alpha};
}

static void halfway(const double a[3], const double b[3], double m[3])
{
    for (int k = 0; k < 3; k++)
        m[k] = a[k] + b[k];
    double l = sqrt(dot3(m, m));
    for (int k = 0; k < 3; k++)
        m[k] /= l;
}

void optics_patch_of(const struct optics_view *v, const double wi[3], double *tau, double *psi)
{
    double m[3];
    halfway(v->wo, wi, m);
    *tau = atan2(hypot(m[0], m[1]), v->alpha * m[2]) / M_PI_2;
    double p = atan2(m[1], m[0]) - v->azimuth;
    *psi = p - 2 * M_PI * floor(p / (2 * M_PI));
}

struct integral {
    const struct optics_view *v;
    bool reflected;
    const struct optics_patch *p;
    double (*g)(const double m[3], void *data);
    void *data;
    gsl_integration_glfixed_table *table;
    double psi;
};

static double at_tau(double tau, void *data)
{
    const struct integral *in = data;
    double t = tan(tau * M_PI_2), slope = in->v->alpha * t;
    double z = 1 / sqrt(1 + slope * slope), phi = in->v->azimuth + in->psi;
    double m[3] = {slope * z * cos(phi), slope * z * sin(phi), z};
    /* dm = cos^3(theta_m) slope d(slope) d(psi) */
    return in->g(m, in->data) * z * z * z * slope * in->v->alpha * M_PI_2 * (1 + t * t);
}

/* The largest tau at this psi: with c = sin(theta_o) cos(psi), wo.m is proportional to
 * cos_o + slope c, and wi.z = 2 (wo.m) m.z - cos_o > 0 to cos_o slope^2 - 2 c slope - cos_o < 0. */
static double horizon(const struct integral *in)
{
    double c = in->v->sin_o * cos(in->psi), z = in->v->cos_o, root = sqrt(c * c + z * z);
    double slope;
    if (in->reflected)
        slope = c > 0 ? (c + root) / z : z / (root - c);
    else
        slope = c < 0 ? -z / c : INFINITY;
    return atan(slope / in->v->alpha) / M_PI_2;
}

static double at_psi(double psi, void *data)
{
    struct integral *in = data;
    in->psi = psi;
    double end = fmin(in->p->tau1, horizon(in));
    if (end <= in->p->tau0)
        return 0;
    gsl_function f = {at_tau, in};
    return gsl_integration_glfixed(&f, in->p->tau0, end, in->table);
}

double optics_integrate_normals(const struct optics_view *v, bool reflected,
                                const struct optics_patch *p,
                                double (*g)(const double m[3], void *data), void *data)
{
    struct integral in = {.v = v, .reflected = reflected, .p = p, .g = g, .data = data};
    gsl_integration_workspace *w = gsl_integration_workspace_alloc(OUTER_INTERVALS);
    in.table = gsl_integration_glfixed_table_alloc(INNER_POINTS);
    assert(w != NULL && in.table != NULL);
    gsl_function f = {at_psi, &in};
    double sum, error;
    gsl_error_handler_t *old = gsl_set_error_handler_off();
    int status = gsl_integration_qag(&f, p->psi0, p->psi1, 1e-7, 1e-4, OUTER_INTERVALS,
                                     GSL_INTEG_GAUSS15, w, &sum, &error);
    gsl_set_error_handler(old);
    assert(status == GSL_SUCCESS);
    gsl_integration_glfixed_table_free(in.table);
    gsl_integration_workspace_free(w);
    return sum;
}

struct reflected {
    const double *wo;
    double (*g)(const double wi[3], void *data);
    void *data;
};

static double reflect_then_g(const double m[3], void *data)
{
    const struct reflected *r = data;
    double c = dot3(r->wo, m), wi[3];
    for (int k = 0; k < 3; k++)
        wi[k] = 2 * c * m[k] - r->wo[k];
    return 4 * c * r->g(wi, r->data);
}

double optics_integrate_directions(const struct optics_view *v, const struct optics_patch *p,
                                   double (*g)(const double wi[3], void *data), void *data)
{
    struct reflected r = {v->wo, g, data};
    return optics_integrate_normals(v, true, p, reflect_then_g, &r);
}

static double tan2(const double w[3])
{
    return (w[0] * w[0] + w[1] * w[1]) / (w[2] * w[2]);
}

double optics_metal_d(const struct optics_metal *s, const double m[3])
{
    double a2 = s->alpha * s->alpha, c4 = m[2] * m[2] * m[2] * m[2], t = tan2(m) / a2;
    return s->ggx ? 1 / (M_PI * a2 * c4 * (1 + t) * (1 + t)) : exp(-t) / (M_PI * a2 * c4);
}

double optics_metal_lambda(const struct optics_metal *s, const double w[3])
{
    double t = s->alpha * sqrt(tan2(w));
    if (t == 0)
        return 0;
    if (s->ggx)
        return (sqrt(1 + t * t) - 1) / 2;
    return (exp(-1 / (t * t)) * t / sqrt(M_PI) - erfc(1 / t)) / 2;
}

double optics_metal_f_cos(const struct optics_metal *s, const double wo[3], const double wi[3])
{
    double m[3];
    halfway(wo, wi, m);
    double lo = optics_metal_lambda(s, wo), li = optics_metal_lambda(s, wi);
    double g = s->separable ? 1 / ((1 + lo) * (1 + li)) : 1 / (1 + lo + li);
    return optics_fresnel(dot3(wo, m), s->n) * optics_metal_d(s, m) * g / (4 * wo[2]);
}

struct lit {
    const struct optics_metal *s;
    const double *wo;
};

static double f_cos_of(const double wi[3], void *data)
{
    const struct lit *l = data;
    return optics_metal_f_cos(l->s, l->wo, wi);
}

double optics_metal_albedo(const struct optics_metal *s, double cos_o)
{
    struct optics_view v = optics_view(cos_o, 0, s->alpha);
    struct lit l = {s, v.wo};
    double sum = 0;
    for (int k = 0; k < 4; k++) {
        struct optics_patch p = {k / 4.0, (k + 1) / 4.0, 0, M_PI};
        sum += 2 * optics_integrate_directions(&v, &p, f_cos_of, &l);
    }
    return sum;
}
