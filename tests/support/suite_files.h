/* The suite that is shipped, and those of its files that are computed: the mesh of 44_mesh and the
 * sky images of 46_sky and 96_sky_turned. make_suite_files writes them; test_suite_scenes compares
 * the shipped files with these functions. */
#ifndef ASSAY_TEST_SUITE_FILES_H
#define ASSAY_TEST_SUITE_FILES_H

#include "reference/suite/suite.h"
#include "renderer/image/image.h"

#include <stdio.h>

/* reference/scenes, read once, and a scene of it; the test fails if it is missing. */
const struct suite *suite_shipped(void);
const struct suite_scene *suite_shipped_scene(const char *name);

/* A point of the knot's skin and the unit normal there, outside. s in [0,1) runs along the tube, t in
 * [0,1) around it. The tube's middle runs 2 times around the axis Y and 3 times around the ring of
 * radius 0.42 in y = 0, at 0.2 from it; three ridges wind along the tube. */
void suite_knot(double s, double t, double p[3], double n[3]);

enum { KNOT_ALONG = 400, KNOT_AROUND = 36 };
/* 44_mesh.dae: KNOT_ALONG x KNOT_AROUND vertices, two triangles for each, in the box of tests/support/44_mesh.dae.in. */
void suite_write_mesh(FILE *f);

enum { SKY_WIDTH = 128, SKY_HEIGHT = 64, SKY_TURN = 1 };
/* Radiance of 46_sky from the unit direction d (Y up), before rounding. */
void suite_sky_radiance(const double d[3], double radiance[3]);
/* The image in latitude and longitude as environment.h has it: the radiance at the middles of texels,
 * rounded to 1/256, moved `turn` columns to the right. Channels R, G, B. The caller frees. */
NODISCARD bool suite_sky(int turn, struct image *out, struct err *e);

#endif
