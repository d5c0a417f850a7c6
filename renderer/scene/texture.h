/* Textures: an image of linear RGB, a wrap mode for coordinates outside it, and the filter between the centres
 * of its texels.
 *
 * Coordinates are COLLADA's and OpenGL's: (0,0) is the image's lower left corner, (1,1) its upper right one, so the
 * centre of texel (i, j), j from the top row, is ((i + 1/2)/width, 1 - (j + 1/2)/height). */
#ifndef ASSAY_TEXTURE_H
#define ASSAY_TEXTURE_H

#include "renderer/math/vec.h"

#include <stddef.h>

/* What continues the image beyond an edge: itself; its mirror image; its outermost texels; black. */
enum texture_wrap { TEXTURE_WRAP, TEXTURE_MIRROR, TEXTURE_CLAMP, TEXTURE_BORDER };

struct texture {
    int width, height;
    enum texture_wrap wrap[2]; /* of u and of v */
    bool nearest;              /* the texel that a place lies in; else bilinear between centres */
    const float *texel;        /* 3 floats each, by rows from the top; not owned */
};

/* A place on an image. */
struct uv {
    float u, v;
};

/* Colour at any place; NaN and coordinates beyond 1e7 are clamped. */
rgb texture_lookup(const struct texture *t, struct uv at);
/* At barycentric coordinates (b1, b2) of the second and third corner. */
rgb texture_on_triangle(const struct texture *t, const struct uv corner[3], float b1, float b2);
/* About the mean luminance of factor times the texture over a triangle: the mean over the centres of
 * n^2 equal parts, n being the texels along the longer side of its bounding box, at most 64. */
double texture_mean_luminance(const struct texture *t, const struct uv corner[3], rgb factor);
/* Largest and smallest value of each channel over the whole image; NaN if one is NaN. */
rgb texture_max(const struct texture *t);
rgb texture_min(const struct texture *t);

#endif
