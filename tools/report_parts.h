/* What the parts of the report share: the page under construction and its sections. */
#ifndef ASSAY_REPORT_PARTS_H
#define ASSAY_REPORT_PARTS_H

#include "../renderer/image.h"
#include "../renderer/moments.h"
#include "results.h"

#include <stdint.h>
#include <stdio.h>

/* Numbers behind a picture, for the exposure slider and the pixel readout; written at the page's
 * end as long as there is room. */
struct layer {
    int width, height, channels;
    uint16_t *half; /* IEEE binary16, interleaved */
};

struct page {
    FILE *f;
    char dir[4096]; /* of results.json, with a final slash, or "" */
    struct layer *layer;
    size_t num_layers;
};

/* Appends a layer of `channels` values a pixel; *index is its number on the page. */
bool page_add_layer(struct page *p, int width, int height, int channels, const double *value,
                    size_t *index, struct err *e) __attribute__((warn_unused_result));

/* One claim where it stands in the page. */
struct claim_ref {
    const json_t *json;
    size_t index; /* in results.json; its anchor is #claim-<index> */
    enum outcome outcome;
};

/* <section> of one scene: what it is for, its pictures, each of its claims. All claims are of the
 * same scene. Fails when a picture cannot be read or the sizes differ. */
bool report_scene(struct page *p, const struct claim_ref *claim, size_t num, struct err *e)
    __attribute__((warn_unused_result));

/* <article> of one judged claim: the maps on the colour range +-range, the histogram, and all that
 * is needed to doubt the verdict. The maps are one channel each. */
bool report_claim(struct page *p, const struct claim_ref *claim, const struct image *relative,
                  const struct image *z, double range, struct err *e)
    __attribute__((warn_unused_result));

/* <article> of a claim that could not be judged. */
void report_claim_error(struct page *p, const struct claim_ref *claim);

/* The verdict as a coloured label with a mark, so that colour is not needed. */
void report_badge(FILE *f, const struct claim_ref *claim);

/* The reference's name, and the quantity where it is not the mean. */
void report_reference(FILE *f, const struct claim_ref *claim);

/* The style attribute of a picture's figure: its width in pixels, and the whole factors by which it
 * is drawn side by side and alone. */
void report_scale(FILE *f, int width);

#endif
