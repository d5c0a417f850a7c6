/* What stands on the page beside the statistics: how alike the two images of a claim look (FLIP), and what another
 * renderer's test rule would have said of them (idiff). Neither has a part in any verdict. */
#ifndef ASSAY_REPORT_SIMILARITY_H
#define ASSAY_REPORT_SIMILARITY_H

#include "tools/images/flip.h"
#include "report_internal.h"

struct similarity {
    bool has_flip;   /* false where the reference is black */
    double hdr, ldr; /* mean FLIP; LDR: as the page shows the images at 0 stops */
    struct flip_exposures exposures;
    double idiff_percent; /* of the pixels differ by more than Blender's threshold */
    bool idiff_differs;
};

/* Compares A with the reference B, radiance `white` being shown as white. map (a float a pixel) receives HDR-FLIP.
 * Fails only out of memory. */
bool report_similarity_measure(const struct moments *a, const struct moments *b, double white,
                               struct similarity *out, float *map, struct err *e)
    __attribute__((warn_unused_result));

/* The claim's line, and its place in the table; the map goes into the page as the claim's, for its script, but
 * for a claim as expected on a page of many. */
bool report_similarity(struct page *p, const struct claim_ref *claim, const struct moments *a,
                       const struct moments *b, double white, struct err *e)
    __attribute__((warn_unused_result));

/* <section> with the table of all claims that have such a line; nothing without any. */
void report_similarity_table(const struct page *p);

#endif
