/* The report's plot of what a ray costs. */
#ifndef ASSAY_PLOT_RAYS_H
#define ASSAY_PLOT_RAYS_H

#include "renderer/base/err.h"

#include <jansson.h>
#include <stdio.h>

/* <section> with a bar for each scene of which a claim has "rays_a" (results.h), most tests first: box and primitive tests
 * of a ray, of the first such claim. Nothing where none has. Fails only out of memory. */
NODISCARD bool plot_rays(FILE *f, const json_t *claims, struct err *e);

#endif
