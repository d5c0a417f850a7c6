/* Closed forms as images. Each is evaluated from the numbers in the scene's .json, which are
 * derived and explained in its .md; nothing of the renderer's camera, loader or light code is used,
 * so that a mistake there cannot hide. Where radiance varies over a pixel, the box-filtered value
 * is the Gauss-Legendre quadrature (GSL) of the closed form over the pixel. */
#ifndef ASSAY_TRUTH_H
#define ASSAY_TRUTH_H

#include "../renderer/moments.h"
#include "suite.h"

/* Fills *out (unit "exact") for that reference of that scene. Fails on an unknown kind or missing
 * values. The caller frees. */
bool truth_render(const struct suite_scene *scene, const struct suite_reference *ref,
                  struct moments *out, struct err *e) __attribute__((warn_unused_result));

#endif
