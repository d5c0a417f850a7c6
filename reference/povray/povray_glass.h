/* Which glass POV-Ray can do. It keeps a list of the bodies that a ray is in, where we look at the
 * side of the surface, so bodies must be closed and apart from everything else. */
#ifndef ASSAY_POVRAY_GLASS_H
#define ASSAY_POVRAY_GLASS_H

#include "renderer/scene/camera.h"

/* Something passes light, or would if its factor were not zero. */
bool povray_is_glass(const struct material *m);

/* Checks each object of glass or of refraction alone. Fails on: a body that emits, Schlick's
 * approximation, glass whose factor of the reflected ray is not 1 (POV-Ray does not apply it to total
 * reflection), an index that is not above 1, triangles that are not a closed surface with its front
 * outside, a sphere seen from inside, anything that may touch the body or be inside it (bounding
 * boxes of triangles are taken for the triangles), the eye too; and refraction alone by triangles
 * beside a mirror, glass or an environment: POV-Ray reflects totally where we have nothing. */
NODISCARD bool povray_check_glass(const struct scene *s, const struct camera *c, double extent,
                                  struct err *e);

/* Total reflection has to find nothing: there is refraction alone by triangles. */
bool povray_hides_total_reflection(const struct scene *s);

#endif
