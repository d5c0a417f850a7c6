/* First hits of camera rays, for the layers beside the image (AOVs: depth, normal, albedo, object). */
#ifndef ASSAY_AOV_H
#define ASSAY_AOV_H

#include "integrator.h"

/* Fills b->first of the active lanes from b->ray and b->hit. Albedo is the share of light that the
 * surface sends back at normal incidence: diffuse reflectance, a mirror's reflectance, a refracting
 * surface's transmittance, a conductor's Fresnel reflectance, and for glass both of its ways
 * together. */
void first_hits_record(const struct integrator *it, struct batch *b, int num_active);

#endif
