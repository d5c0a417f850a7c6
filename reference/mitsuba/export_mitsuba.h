/* The scene as Mitsuba 3 XML, for its rgb variants (scalar_rgb, llvm_ad_rgb, ...), with the files it
 * names beside it. README.md has the mapping and how well it is verified. */
#ifndef ASSAY_EXPORT_MITSUBA_H
#define ASSAY_EXPORT_MITSUBA_H

#include "renderer/scene/camera.h"

/* Writes path (by rename, last) and, before it, STEM_object_I.ply, STEM_material_I_eta.exr, .._k.exr
 * and STEM_environment.exr as needed, STEM being path without its ending. Samples and seed are the
 * parameters $spp and $seed. Fails with one line on what Mitsuba cannot express: refraction alone,
 * plastic, Schlick's form, correlated shadowing, two-sided emission, smooth emitters that reflect,
 * pixel filters other than the box of one pixel, a tent and a Gauss of radius 4 sigma, and what
 * features_check_exportable() refuses. */
NODISCARD bool export_mitsuba(const struct scene *s, const struct camera *c, int depth,
                              const char *path, struct err *e);

#endif
