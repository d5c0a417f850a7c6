/* The scene as one pbrt-v4 text file. pbrt is spectral; README.md says what is exact and what is only
 * close. */
#ifndef ASSAY_EXPORT_PBRT_H
#define ASSAY_EXPORT_PBRT_H

#include "renderer/scene/camera.h"

/* Writes path (by rename, last) and, before it, an environment's image to STEM_environment.exr, STEM being path without
 * its ending; samples, seed and the image's name are given on pbrt's command line. Fails with one line on what pbrt
 * cannot express: coloured mirrors, coloured metals without an index of refraction, Beckmann's distribution, separable
 * shadowing, tinted glass, refraction alone, plastic, Schlick's approximation, environment images of more than 512
 * rows, and what features_check_exportable() refuses. */
NODISCARD bool export_pbrt(const struct scene *s, const struct camera *c, int depth,
                           const char *path, struct err *e);

#endif
