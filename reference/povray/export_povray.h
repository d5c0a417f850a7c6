/* The scene as POV-Ray 3.7 scene description language, written so that POV-Ray's image is the
 * same radiance as ours. Which setting stands for what, and the measurement behind each, is in
 * README.md. What POV-Ray cannot express is an error with one line, never left out. */
#ifndef ASSAY_EXPORT_POVRAY_H
#define ASSAY_EXPORT_POVRAY_H

#include "povray_passes.h"

#include <stdio.h>

/* Where the spotlights of a lamp are placed. Lamps that are not rectangles have evenly spread points
 * (povray_lamp_points()) under every rule. */
enum povray_rule {
    POVRAY_GAUSS, /* rectangles: pairs of cells hold the 2-point Gauss rule (lamp_cells is even) */
    POVRAY_SHIFT, /* rectangles: one point in each cell, at the same place in all of them. The place
                     is lamp_shift[0..1], plus a golden-ratio step for each further lamp */
    POVRAY_JITTER /* rectangles: one random point in each cell, a function of lamp_seed (sampler.h) */
};

/* What differs between two images of one scene. */
struct povray_variant {
    /* The whole scene and camera, turned about the origin: v' = rotation v. Row-major, orthonormal,
     * determinant +1. The image stays; POV-Ray's directions relative to the scene do not. */
    double rotation[3][3];
    int pass;       /* index into the plan's passes */
    int lamp_cells; /* a lamp is lamp_cells x lamp_cells spotlights */
    enum povray_rule rule;
    double lamp_shift[3]; /* in [0,1); with POVRAY_GAUSS for lamps other than rectangles */
    uint64_t lamp_seed;   /* of POVRAY_JITTER */
    /* Moves the window right and up, in units of the whole image's width and height. */
    double shift_x, shift_y;
    bool indirect; /* false: no light from diffuse surface to diffuse surface */
    /* Mirrors and glass are followed as far as the pass with indirect light follows them, so that an
     * image without it can be subtracted. */
    bool indirect_levels;
    /* Russian roulette: probability in [0,1) that a reflecting point absorbs all light; otherwise it
     * reflects 1/(1-roulette) times as much. Decorrelates the depths of a path where no path would
     * end otherwise (README.md, "Closed rooms"). Used only if there is indirect light with noise. */
    double roulette;
    double scale; /* POV-Ray's number = scale x radiance */
};

/* The variant for `assay export`: first pass, unrotated, 16 x 16 Gauss lamps, all bounces, scale 1. */
struct povray_variant povray_variant_plain(void);

/* Writes the scene file; the first lines say with which command line to render it. Fails as
 * povray_passes() does, and on a write error. f stays open. */
NODISCARD bool export_povray(const struct scene *s, const struct camera *c, int depth,
                             const struct povray_variant *v, FILE *f, struct err *e);

#endif
