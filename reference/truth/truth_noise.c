#include "truth_noise.h"

#include "truth_values.h"

#include "renderer/base/isa.h"

#include <assert.h>
#include <gsl/gsl_integration.h>
#include <math.h>
#include <stdlib.h>

enum { MOST = 48 }; /* points of a rule along a side */
static const double max_quadrature_error = 1e-3;

/* With p_l = d^2/(A cos_l) and p_b = cos_p/pi the two densities of a direction to the rectangle, and
 * w_l = p_l^2/(p_l^2 + p_b^2), w_b = 1 - w_l, a sample is Y_l + Y_b: Y_l = cos_p/pi w_l/p_l at a place
 * with density p_l, Y_b = w_b where a direction with density p_b meets the rectangle. They are
 * independent, so E[(Y_l + Y_b)^2] = E[Y_l^2] + E[Y_b^2] + 2 E[Y_l] E[Y_b]. All four are integrals over
 * the rectangle, in which a piece dA is the solid angle cos_l dA/d^2. */
ISA_CLONES static void moments_by_rule(const struct truth_lamp *l,
                                       const gsl_integration_glfixed_table *rule, double x,
                                       double z, double moment[2])
{
    double area = (l->ex[1] - l->ex[0]) * (l->ez[1] - l->ez[0]);
    double light[2] = {0, 0}, bsdf[2] = {0, 0};
    double z_of[MOST], weight[MOST], y_l[MOST], w_l[MOST], p_l[MOST], p_b[MOST], piece[MOST];
    assert(rule->n <= MOST);
    for (size_t j = 0; j < rule->n; j++)
        gsl_integration_glfixed_point(l->ez[0], l->ez[1], j, &z_of[j], &weight[j], rule);
    for (size_t i = 0; i < rule->n; i++) {
        double qx, wx;
        gsl_integration_glfixed_point(l->ex[0], l->ex[1], i, &qx, &wx, rule);
        for (size_t j = 0; j < rule->n; j++) {
            double d2 = (qx - x) * (qx - x) + l->height * l->height + (z_of[j] - z) * (z_of[j] - z);
            double cosine = l->height / sqrt(d2); /* at the plane and at the lamp */
            p_l[j] = d2 / (area * cosine);
            p_b[j] = cosine / M_PI;
            w_l[j] = p_l[j] * p_l[j] / (p_l[j] * p_l[j] + p_b[j] * p_b[j]);
            piece[j] = wx * weight[j] * cosine / d2;
            y_l[j] = p_b[j] * w_l[j] / p_l[j];
        }
        for (size_t j = 0; j < rule->n; j++) {
            double w_b = 1 - w_l[j];
            light[0] += piece[j] * p_l[j] * y_l[j];
            light[1] += piece[j] * p_l[j] * y_l[j] * y_l[j];
            bsdf[0] += piece[j] * p_b[j] * w_b;
            bsdf[1] += piece[j] * p_b[j] * w_b * w_b;
        }
    }
    moment[0] = light[0] + bsdf[0];
    moment[1] = light[1] + bsdf[1] + 2 * light[0] * bsdf[0];
}

void truth_sample_moments(const struct truth_lamp *lamp, double x, double z, int order,
                          double moment[2])
{
    gsl_integration_glfixed_table *rule = gsl_integration_glfixed_table_alloc((size_t)order);
    moment[0] = moment[1] = NAN;
    if (rule != NULL)
        moments_by_rule(lamp, rule, x, z, moment);
    gsl_integration_glfixed_table_free(rule);
}

/* The lamp and the part of the plane that the image shows. */
struct footprint {
    struct truth_lamp lamp;
    double foot_x[2], foot_z[2];
    int width, height;
};

/* Variance of one sample of each pixel, for albedo and radiance 1. False if out of memory. */
static bool by_orders(const struct footprint *p, size_t in_pixel, size_t in_lamp, double *variance)
{
    gsl_integration_glfixed_table *place = gsl_integration_glfixed_table_alloc(in_pixel);
    gsl_integration_glfixed_table *rule = gsl_integration_glfixed_table_alloc(in_lamp);
    bool ok = place != NULL && rule != NULL;
    double dx = (p->foot_x[1] - p->foot_x[0]) / p->width;
    double dz = (p->foot_z[1] - p->foot_z[0]) / p->height;
    for (int i = 0; ok && i < p->width * p->height; i++) {
        double x0 = p->foot_x[0] + dx * (i % p->width), z0 = p->foot_z[0] + dz * (i / p->width);
        double sum[2] = {0, 0};
        for (size_t k = 0; k < place->n * place->n; k++) {
            double sx, sz, wx, wz, moment[2];
            gsl_integration_glfixed_point(0, 1, k % place->n, &sx, &wx, place);
            gsl_integration_glfixed_point(0, 1, k / place->n, &sz, &wz, place);
            moments_by_rule(&p->lamp, rule, x0 + dx * sx, z0 + dz * sz, moment);
            sum[0] += wx * wz * moment[0];
            sum[1] += wx * wz * moment[1];
        }
        variance[i] = sum[1] - sum[0] * sum[0];
    }
    gsl_integration_glfixed_table_free(place);
    gsl_integration_glfixed_table_free(rule);
    return ok;
}

bool truth_noise(const struct suite_scene *scene, const struct suite_reference *ref,
                 double **variance, struct err *e)
{
    double radiance[3], albedo[3];
    struct footprint p = {.width = scene->width, .height = scene->height};
    if (!suite_noise_is_known(ref->kind))
        return err_set(e, "%s: the noise of '%s' has no closed form", scene->name, ref->kind);
    if (!truth_values_read(
            ref->values, e,
            "radiance[3]>=0 albedo[3]=0..1 height>0 emitter.x[2] emitter.z[2] footprint.x[2] footprint.z[2]",
            radiance, albedo, &p.lamp.height, p.lamp.ex, p.lamp.ez, p.foot_x, p.foot_z))
        return err_prefix(e, "%s: noise", scene->name);
    if (scene->depth != 1)
        return err_set(e, "%s: noise: depth is %d, not 1", scene->name, scene->depth);
    size_t pixels = (size_t)p.width * (size_t)p.height;
    double *one = calloc(pixels, sizeof *one), *check = calloc(pixels, sizeof *check);
    double *out = calloc(3 * pixels, sizeof *out), sum = 0, off = 0;
    bool ok = one != NULL && check != NULL && out != NULL && by_orders(&p, 3, 12, check) &&
              by_orders(&p, 4, 16, one);
    if (!ok)
        err_set(e, "%s: noise: out of memory", scene->name);
    for (size_t i = 0; ok && i < pixels; i++) {
        sum += one[i];
        off += fabs(one[i] - check[i]);
        for (size_t c = 0; c < 3; c++)
            out[3 * i + c] = one[i] * radiance[c] * radiance[c] * albedo[c] * albedo[c];
    }
    if (ok && !(off <= max_quadrature_error * sum))
        ok = err_set(e, "%s: noise: quadrature not converged: off by %g of %g", scene->name, off,
                     sum);
    free(one);
    free(check);
    if (!ok) {
        free(out);
        return false;
    }
    *variance = out;
    return true;
}
