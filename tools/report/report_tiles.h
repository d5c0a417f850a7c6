/* The report's list of a claim's tiles. */
#ifndef ASSAY_REPORT_TILES_H
#define ASSAY_REPORT_TILES_H

#include <jansson.h>
#include <stdio.h>

/* The reporting tiles of smallest p as buttons (data-x, data-y: their corner, pixels) that mark the tile
 * in the images, and an empty line for what the page's script reads there. Nothing if no tile has
 * noise. */
void report_tiles(FILE *f, const json_t *claim);

#endif
