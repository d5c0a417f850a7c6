/* First hits of camera rays, for the layers beside the image (AOVs: depth, normal, albedo, object). */
#ifndef ASSAY_AOV_H
#define ASSAY_AOV_H

#include "integrator.h"

/* Fills b->first of the active lanes from b->ray and b->hit. Albedo is the share of light that the
 * surface reflects or transmits at normal incidence: diffuse or mirror reflectance, transmittance of a
 * refracting surface, Fresnel reflectance of a conductor, both together for glass, the sum of its
 * lobes for plastic. */
void first_hits_record(const struct integrator *it, struct batch *b, int num_active);

#endif
