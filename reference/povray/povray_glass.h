/* Which glass POV-Ray can express. It keeps a list of the bodies that a ray is in, whereas we use the side
 * of the surface that is hit, so bodies must be closed and separate from everything else. */
#ifndef ASSAY_POVRAY_GLASS_H
#define ASSAY_POVRAY_GLASS_H

#include "renderer/scene/camera.h"

/* Is it glass or a boundary that only refracts? True even if its factors are zero. */
bool povray_is_glass(const struct material *m);

/* Checks each object of glass or of refraction alone. Fails on: a body that emits, Schlick's
 * approximation, glass whose factor of the reflected ray is not 1 (POV-Ray does not apply it to total
 * reflection), an index that is not above 1, triangles that are not a closed surface with its front
 * outside, a sphere whose front is inside, anything that may touch the body or be inside it, the eye
 * included (triangles are tested by their bounding boxes); and a mesh that only refracts if there is a
 * mirror, glass or an environment: POV-Ray reflects totally where we have nothing. */
NODISCARD bool povray_check_glass(const struct scene *s, const struct camera *c, double extent,
                                  struct err *e);

/* Must totally reflected rays find nothing? True if there is a mesh that only refracts. */
bool povray_hides_total_reflection(const struct scene *s);

#endif
