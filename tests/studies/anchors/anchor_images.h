/* The images of tests/studies/anchors/make_anchors.c: many renders of one scene by our renderer, each with a seed of
 * its own, a long render as Mitsuba's rule asks for one, and what is done to an image to make it
 * wrong by a known amount. */
#ifndef ASSAY_TESTS_ANCHOR_IMAGES_H
#define ASSAY_TESTS_ANCHOR_IMAGES_H

#include "anchor_rules.h"

struct anchor_pool {
    char title[128];
    int side, spp, num_renders;
    struct moments *render;             /* num_renders of them, unit "sample", n = spp */
    struct mitsuba_reference reference; /* one render of reference_spp samples, in XYZ */
    struct moments expected;            /* the same render in RGB: the mean */
    double
        *bounced;   /* 3 a pixel, in [0, 1]: the share of `expected` that is not light of an emitter
                        seen directly */
    int num_places; /* regions where a local error is put: of the nine squares at 4, 24 and 44 in x
                        and y, those with at least half of the image's mean of bounced light */
    int place[9][2];
};

struct anchor_job {
    const char *scene; /* of reference/scenes, with its own depth */
    int side, spp, num_renders, reference_spp;
    uint64_t seed;    /* of the reference; the renders' count up from there */
    const char *what; /* said while it runs (work.h); NULL: nothing */
};

/* Renders the pool; the caller frees it with anchor_pool_free(). */
NODISCARD bool anchor_render(const struct anchor_job *job, struct anchor_pool *out, struct err *e);
void anchor_pool_free(struct anchor_pool *p);

/* A scene's noise: the standard deviation of one sample of luminance (RMS over pixels) over the image's mean. */
double anchor_noise(const struct anchor_pool *p);

enum anchor_error {
    ANCHOR_GLOBAL,  /* all light times 1 + b */
    ANCHOR_BOUNCED, /* light that has bounced times 1 + b */
    ANCHOR_REGION,  /* the same in one square of ANCHOR_REGION_SIDE pixels */
    NUM_ANCHOR_ERRORS
};
enum { ANCHOR_REGION_SIDE = 16 };

/* out = in with an error of size b; `place` counts the region. out has the size of in. The noise is
 * scaled with the mean. */
void anchor_make_wrong(const struct anchor_pool *p, const struct moments *in,
                       enum anchor_error kind, double b, int place, struct moments *out);

#endif
