/* What the parts of the report share: the page under construction and its sections. */
#ifndef ASSAY_REPORT_INTERNAL_H
#define ASSAY_REPORT_INTERNAL_H

#include "renderer/image/moments.h"
#include "tools/images/flip.h"
#include "tools/results/results.h"

#include <stdint.h>
#include <stdio.h>

/* Numbers behind an image (pixel_codec.h), written at the page's end as long as there is room. */
struct page_layer {
    char *path;
    int width, height;
    double n; /* of every pixel; 0 where they differ and the bytes tell */
    char unit[16];
    double spp;
    uint8_t *bytes;
    size_t size;
};

/* One claim where it stands in the page. */
struct claim_ref {
    const json_t *json;
    size_t index; /* in results.json; its anchor is #claim-<index> */
    enum outcome outcome;
};

/* What stands on the page beside the statistics: how alike the two images of a claim look (FLIP), and what another
 * renderer's test rule would have said of them (idiff). Neither has a part in any verdict. */
struct similarity {
    bool has_flip;   /* false where the reference is black */
    double hdr, ldr; /* mean FLIP; LDR: as the page shows the images at 0 stops */
    struct flip_exposures exposures;
    double idiff_percent; /* of the pixels differ by more than Blender's threshold */
    bool idiff_differs;
};

/* A claim's row in the table of that, and its packed FLIP map (pixel_codec.h; NULL: none). */
struct page_alike {
    struct claim_ref claim;
    int width, height;
    struct similarity is;
    uint8_t *bytes;
    size_t size;
};

struct page {
    FILE *f;
    char dir[4096]; /* of results.json, with a final slash, or "" */
    struct page_layer *layer;
    struct page_alike *alike;
    size_t num_layers, num_alike, num_scenes;
    bool
        folded; /* many claims: the evidence of those that came out as expected is folded and without
                    plots and FLIP maps, and images are stored to 1/4 of their standard errors */
};

/* The number on the page of the layer of m, which was read from path; the same path has one. */
NODISCARD bool report_pixel_data_add(struct page *p, const char *path, const struct moments *m,
                                     size_t *index, struct err *e);
/* All layers, then the FLIP maps, and the colours of maps, as base64 in elements that no browser runs. */
void report_pixel_data_write(struct page *p);
void report_pixel_data_free(struct page *p);

/* <section> of one scene: what it is for, its images, each of its claims. All claims are of the
 * same scene. Fails when an image cannot be read or the sizes differ. */
NODISCARD bool report_scene(struct page *p, const struct claim_ref *claim, size_t num,
                            struct err *e);

/* One side of a claim, as loaded. */
struct claim_side {
    const struct moments *m;
    size_t layer; /* its number on the page */
};

/* <article> of one judged claim: where the page's script puts its maps, the histogram, and all that is
 * needed to doubt the verdict. `white` is the radiance shown as white. */
NODISCARD bool report_claim(struct page *p, const struct claim_ref *claim,
                            const struct claim_side *a, const struct claim_side *b, double white,
                            struct err *e);

/* <article> of a claim that could not be judged. */
void report_claim_error(struct page *p, const struct claim_ref *claim);

/* The verdict as a coloured label with a mark, so that colour is not needed. */
void report_badge(FILE *f, const struct claim_ref *claim);

/* The reference's name, and the quantity where it is not the mean. */
void report_reference(FILE *f, const struct claim_ref *claim);

/* The sections around the scenes, in their order; each is nothing where the results have nothing of it (NULL or empty). */

/* The matrix on top of a page of several scenes: a row for each, with a thumbnail, in the order of the claims, which are those of
 * the tested program: the one that is neither ours nor a reference, else ours. A cell has a mark, the difference and a link to its
 * claim, so that colour is not needed. The last column counts the scene's other claims. Nothing for fewer than two scenes. An image
 * that cannot be read has no thumbnail here; the scene's own section says so. */
void report_matrix(struct page *p, const struct claim_ref *claim, size_t num);

/* <section id="table"> of num claims in the order given: what each said, in a row that leads to its evidence, and the same as CSV;
 * table#claims is what page_table.js finds and sorts. */
void report_table(FILE *f, const struct claim_ref *claim, size_t num, bool folded);

/* What a reader needs to doubt a verdict: numbers, regions, seeds, samples, versions, which statistic looked, with what part of
 * alpha, and what each found, what the difference looks like, how the noise of both sides compares, and the
 * commands that run the claim again and approve another reference: <details> of a judged claim, unfolded if `open`. */
void report_evidence(FILE *f, const json_t *claim, bool open);
/* The reporting tiles of smallest p as buttons (data-x, data-y: their corner, pixels) that mark the tile
 * in the images, and an empty line for what the page's script reads there. Nothing if no tile has
 * noise. */
void report_evidence_tiles(FILE *f, const json_t *claim);

/* Compares A with the reference B, radiance `white` being shown as white. map (a float a pixel) receives HDR-FLIP.
 * Fails only out of memory. */
NODISCARD bool report_similarity_measure(const struct moments *a, const struct moments *b,
                                         double white, struct similarity *out, float *map,
                                         struct err *e);
/* The claim's line, and its place in the table; the map goes into the page as the claim's, for its script, but
 * for a claim as expected on a page of many. */
NODISCARD bool report_similarity(struct page *p, const struct claim_ref *claim,
                                 const struct moments *a, const struct moments *b, double white,
                                 struct err *e);
/* <section> with the table of all claims that have such a line; nothing without any. */
void report_similarity_table(const struct page *p);

/* Stated errors ("consistency", stated_error_results.h): how many renderers err as they state, in one line; the table. */
void report_stated_error_headline(FILE *f, const json_t *consistency);
void report_stated_error(FILE *f, const json_t *consistency);

/* Noise (noise_results.h): one line for the head of the page; a section with a row for each scene and engine: variance of a
 * sample, its fall, efficiency. */
void report_noise_headline(FILE *f, const json_t *noise);
void report_noise(FILE *f, const json_t *noise);

/* Convergence (convergence_results.h): the verdict in one line, the page's headline if it is about nothing else; for every scene
 * the plots of RMSE against samples and against CPU time, what was judged, and the rungs behind it. */
void report_convergence_headline(FILE *f, const json_t *results, bool alone);
void report_convergence(FILE *f, const json_t *convergence);

/* What the time went to (render_cost.h): a row for each scene, the costliest first; nothing where nothing was rendered. */
void report_cost(FILE *f, const json_t *results);

#endif
