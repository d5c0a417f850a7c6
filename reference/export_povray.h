/* The scene as POV-Ray 3.7 scene description language, written so that POV-Ray's picture is the
 * same radiance as ours. Which setting stands for what, and the measurement behind each, is in
 * MATCH_POVRAY.md. What POV-Ray cannot express is an error with one line, never left out. */
#ifndef ASSAY_EXPORT_POVRAY_H
#define ASSAY_EXPORT_POVRAY_H

#include "povray_plan.h"

#include <stdio.h>

/* What differs between two pictures of one scene. */
struct povray_variant {
    /* The whole scene and camera, turned about the origin: v' = rotation v. Row-major, orthonormal,
     * determinant +1. The picture stays; POV-Ray's directions relative to the scene do not. */
    double rotation[3][3];
    int lamp_cells; /* a rectangular lamp is lamp_cells x lamp_cells spotlights */
    /* false: pairs of cells hold the 2-point Gauss rule (lamp_cells is even); true: one random
     * point in each cell, a function of lamp_seed (sampler.h). */
    bool lamp_jitter;
    uint64_t lamp_seed;
    /* Moves the window right and up; 1 is the width, the height of the whole picture. */
    double shift_x, shift_y;
    bool indirect; /* false: paths end after the direct light (depth 1) */
    /* Probability in [0,1) that a reflecting point absorbs all light; the others reflect
     * 1/(1-roulette) times as much. Keeps the depths of a path apart where no path could end
     * otherwise. Used only where there is indirect light and it is noisy. */
    double roulette;
    double scale; /* POV-Ray's number = scale x radiance */
};

/* The variant for people: unrotated, 16 x 16 Gauss lamps, whole depth, scale 1. */
struct povray_variant povray_variant_plain(void);

/* Writes the scene file; the first lines say with which command line to render it. Fails as
 * povray_plan() does, and on a write error. f stays open. */
bool export_povray(const struct scene *s, const struct camera *c, int depth,
                   const struct povray_variant *v, FILE *f, struct err *e)
    __attribute__((warn_unused_result));

#endif
