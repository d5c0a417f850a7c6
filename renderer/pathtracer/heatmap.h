/* How hard the acceleration structure works, as an image. */
#ifndef ASSAY_HEATMAP_H
#define ASSAY_HEATMAP_H

#include "renderer/bvh/bvh.h"
#include "renderer/scene/camera.h"
#include "renderer/image/image.h"

/* Counts the nodes that the ray through the centre of each pixel of the cell (x, y of the full image,
 * origin at the top left) visits until its nearest hit is known, and writes them as a PNG: dark is 0,
 * light is *most, the largest count. Rays leave the middle of the lens. */
NODISCARD bool heatmap_write(const char *path, const struct bvh *bvh, const struct camera *c, int x,
                             int y, int width, int height, uint64_t *most, struct err *e);

/* A colour for t in [0,1], black to white through purple, red and yellow: equal steps of t are nearly equal
 * steps of perceived difference, since it goes along a curve of constant speed in Oklab
 * [Ottosson20], and lightness is linear in t, so that it survives a grey print. */
void heatmap_colour(double t, uint8_t rgb8[3]);

#endif
