/* What a reader needs to doubt a verdict: numbers, regions, seeds, samples, versions, which statistic looked, and the
 * commands that run the claim again and approve another reference. */
#ifndef ASSAY_REPORT_EVIDENCE_H
#define ASSAY_REPORT_EVIDENCE_H

#include <stdbool.h>
#include <stdio.h>

#include <jansson.h>

/* <details> of a judged claim of results.json, unfolded if `open`. */
void report_evidence(FILE *f, const json_t *claim, bool open);

/* The reporting tiles of smallest p as buttons (data-x, data-y: their corner, pixels) that mark the tile
 * in the images, and an empty line for what the page's script reads there. Nothing if no tile has
 * noise. */
void report_evidence_tiles(FILE *f, const json_t *claim);

#endif
