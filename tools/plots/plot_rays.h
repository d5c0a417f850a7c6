/* The report's plot of intersection tests per ray. */
#ifndef ASSAY_PLOT_RAYS_H
#define ASSAY_PLOT_RAYS_H

#include "renderer/base/err.h"

#include <jansson.h>
#include <stdio.h>

/* Writes a <section> with a bar for each scene with a claim that has "rays_a" (results.md), most tests first: box and
 * primitive tests per ray of its first such claim. Nothing if there is none. Fails only if out of memory. */
NODISCARD bool plot_rays(FILE *f, const json_t *claims, struct err *e);

#endif
