/* What the assignment's starter code does wrong, done on purpose: references by which a program that was built on it is
 * graded (tools/submission/rubric.h, `accept`). Nothing else may ask for it. */
#ifndef ASSAY_CS184_DEVIATIONS_H
#define ASSAY_CS184_DEVIATIONS_H

#include "scene.h"

enum cs184_deviation {
    CS184_LIGHT_PDF, /* the density of a light sample lacks a factor of the distance: irradiance falls as 1/r */
    CS184_TURNED_LAMP, /* the rectangle that is sampled is turned by 90 degrees against the one that is seen */
    CS184_BECKMANN, /* the shadowing of rough metals has a pi for a sqrt(pi) (microfacet.h) */
    CS184_NORMALS,  /* normals of the file are not used: those of its half-edge mesh are */
    NUM_CS184_DEVIATIONS
};
extern const char *const cs184_deviation_names[NUM_CS184_DEVIATIONS + 1]; /* NULL at the end */

static inline bool starter_has(const struct scene *s, enum cs184_deviation what)
{
    return (s->starter >> what & 1) != 0;
}

/* Sets s->starter to `bits` (1 << enum cs184_deviation), turns the visible rectangle lamps (two triangles each; sampling still
 * follows the file), changes the kind of rough metals, and gives triangles the normals of the half-edge mesh: at an inner
 * vertex of an object the sum of its triangles' normals, weighted by area; at one on a boundary minus that, as it is for
 * single triangles and quadrangles (of larger open meshes the starter code makes what its list of edges happens to give).
 * To be called once, before the hierarchy is built. Fails only out of memory. */
NODISCARD bool cs184_deviations_apply(struct scene *s, unsigned bits, struct err *e);

/* p, a point of a rectangular light, turned by 90 degrees about its centre in its plane; p itself on other lights. */
vec3 cs184_deviations_turn(const struct scene *s, const struct light *l, vec3 p);

#endif
