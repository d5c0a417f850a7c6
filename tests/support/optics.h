/* Independent formulas for the BSDF tests, in double precision and without the renderer's code: Fresnel's equations in
 * complex numbers, microfacet conductors (GGX, Beckmann), integrals over directions. */
#ifndef ASSAY_TEST_OPTICS_H
#define ASSAY_TEST_OPTICS_H

#include <complex.h>
#include <stdbool.h>

#undef I /* of <complex.h>: too short a name to give away */

/* Unpolarised reflectance of a smooth boundary from the amplitudes of both polarisations; n: index
 * behind over index in front, eta + i k for a metal [Born99 1.5.2, 14.2]. Total reflection needs no
 * case of its own: the cosine behind is then imaginary. */
double optics_fresnel(double cos_i, double complex n);
/* Transmitted power of a dielectric, from the transmitted amplitudes; 0 under total reflection. */
double optics_transmitted(double cos_i, double n);

/* Rough surfaces seen from wo = (sin cos(azimuth), sin sin(azimuth), cos). */
struct optics_view {
    double wo[3];
    double cos_o, sin_o, azimuth;
    double alpha; /* only scales the coordinate tau below */
};

struct optics_view optics_view(double cos_o, double azimuth, double alpha);

/* A patch of normals m in polar coordinates of their slopes: tan(theta_m) = alpha tan(tau pi/2), and
 * psi is the azimuth of m from wo's. tau in [0,1], psi in [0, 2 pi]. */
struct optics_patch {
    double tau0, tau1, psi0, psi1;
};

/* tau and psi of the normal halfway between wo and wi. */
void optics_patch_of(const struct optics_view *v, const double wi[3], double *tau, double *psi);

/* Integral over the patch of g(m) per steradian of m, over normals visible from wo (wo.m > 0), or with
 * `reflected` only those that reflect wo to above the surface. g is smooth there. Relative error
 * 1e-4, absolute 1e-7. */
double optics_integrate_normals(const struct optics_view *v, bool reflected,
                                const struct optics_patch *p,
                                double (*g)(const double m[3], void *data), void *data);

/* Integral over the directions wi above the surface that the normals of the patch reflect wo to, of
 * g(wi) per steradian of wi: d(wi) = 4 (wo.m) dm. */
double optics_integrate_directions(const struct optics_view *v, const struct optics_patch *p,
                                   double (*g)(const double wi[3], void *data), void *data);

/* A microfacet conductor by its textbook formulas in tan(theta). */
struct optics_metal {
    bool ggx, separable;
    double alpha;
    double complex n; /* 0: reflects all */
};

double optics_metal_d(const struct optics_metal *s, const double m[3]);
double optics_metal_lambda(const struct optics_metal *s, const double w[3]);
/* f(wo, wi) cos(theta_i) */
double optics_metal_f_cos(const struct optics_metal *s, const double wo[3], const double wi[3]);
/* Integral of it over all wi. */
double optics_metal_albedo(const struct optics_metal *s, double cos_o);

#endif
