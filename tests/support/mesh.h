/* Generated triangle meshes: scenes that have positions and nothing else, enough for a hierarchy.
 * scene_free() frees them. Abort when out of memory. */
#ifndef ASSAY_TEST_MESH_H
#define ASSAY_TEST_MESH_H

#include "renderer/scene/scene.h"

/* n x n squares over [-1,1]^2, two triangles each, with sines of doubling frequency for heights; all
 * times `size`. */
struct scene mesh_terrain(uint32_t n, float size);
/* A ball of radius 1 about (0.31, 0.17, -0.23), the terrain's heights times `bump` on it: closed,
 * neighbours share their vertices bit for bit, at the poles `segments` slivers meet. 2 segments
 * (rings - 1) triangles, counter-clockwise from outside. */
struct scene mesh_ball(uint32_t rings, uint32_t segments, float bump);
/* Triangles anywhere in [-1,1]^3, of sizes from 0.003 to 0.3 and any shape, slivers included. */
struct scene mesh_soup(uint32_t n);
/* Needles: 1 long, 3 10^-4 wide, fanned out about the middle and crossing each other. */
struct scene mesh_needles(uint32_t n);
/* Every triangle of a terrain twice, the second time with other corners first. */
struct scene mesh_twins(uint32_t n);

struct mesh_bounds {
    vec3 middle;
    float size; /* half the diagonal */
};
struct mesh_bounds mesh_bounds(const struct scene *s);

/* Random point number (i, k) of that seed, in [-1,1]^3. */
vec3 mesh_random_point(uint64_t seed, uint32_t i, uint32_t k);

#endif
