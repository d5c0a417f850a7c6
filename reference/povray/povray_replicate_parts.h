/* How a replicate of a POV-Ray reference is composed of POV-Ray images.
 *
 *     total_i = fine + (indirect_i - direct_i)
 *
 * where each of the three is the sum over the plan's passes.
 * fine, the same for all replicates, is the mean of POVRAY_WINDOWS images without noise: shifted
 * sub-pixel grids, a fine quadrature of the lamps, no radiosity unless the scene is a constant
 * furnace. indirect_i and direct_i differ in nothing but radiosity, so their difference is the
 * indirect light; a glowing lamp in view is the same in both and drops out. POV-Ray has no seed: a
 * replicate is made independent by a rotation of the whole scene, a block size (+BS), lamp points
 * and a shift inside the sub-pixel of its own.
 *
 * Each image has a scale of its own within one octave. Half floats round by up to 2^-11 of a
 * value; at another scale to another side, so the rounding averages out as well. */
#ifndef ASSAY_POVRAY_REPLICATE_PARTS_H
#define ASSAY_POVRAY_REPLICATE_PARTS_H

#include "export_povray.h"

enum {
    POVRAY_WINDOWS = 32,
    POVRAY_WINDOW_GRID = 2,   /* sub-pixels a side */
    POVRAY_WINDOW_CELLS = 16, /* spotlights a side for one lamp, 2-point Gauss rule; with more lamps
                                 fewer, in a regular grid that each window shifts differently */
    POVRAY_JITTER_CELLS = 3   /* the same in a replicate, at most; one random point in each cell */
};
/* Probability of the roulette in a replicate's two images. */
#define POVRAY_ROULETTE 0.1
/* An emitter of radiance plan->radiance comes out as this .. twice this, far from half's 6e-5 and
 * 65504. */
#define POVRAY_TOP_VALUE 16.0

struct povray_image {
    char name[32]; /* "fine_07_0", "indirect_012_0", "direct_012_0"; the last number is the pass */
    int grid;      /* rendered grid times as wide and high, then averaged */
    int block;     /* 4 .. 64 pixels */
    struct povray_variant variant;
};

/* Window j, 0 <= j < POVRAY_WINDOWS, of an image of width x height, in pass `pass` of the plan. The
 * shifts of the windows are a Hammersley set over one sub-pixel. */
struct povray_image povray_window(const struct povray_passes *plan, int width, int height, int j,
                                  int pass);
/* One of the two images of replicate i in that pass; everything random in it follows from seed. */
struct povray_image povray_replicate(const struct povray_passes *plan, int width, int height,
                                     int grid, int i, uint32_t seed, int pass, bool indirect);

#endif
