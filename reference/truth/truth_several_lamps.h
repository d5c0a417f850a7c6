/* Direct light of several lamps on a Lambertian plane, none in the way of another.
 *
 * kind               "values" in the .json (all keys needed, no others; triples are R, G, B)
 * lamps_over_plane   albedo, footprint (truth_one_lamp.h), lamps: 1 to 8 of either
 *                    {radiance, height, x: [lo, hi], z: [lo, hi]}: a rectangle that emits downwards, or
 *                    {intensity, light: [x, height, z]}: a point */
#ifndef ASSAY_TRUTH_SEVERAL_LAMPS_H
#define ASSAY_TRUTH_SEVERAL_LAMPS_H

#include "truth.h"

extern const struct truth_kind truth_several_lamps[]; /* ends with a NULL name */

#endif
