/* What the parts of the report share: the page under construction and its sections. */
#ifndef ASSAY_REPORT_INTERNAL_H
#define ASSAY_REPORT_INTERNAL_H

#include "renderer/image/moments.h"
#include "tools/images/flip.h"
#include "tools/results/results.h"

#include <stdint.h>
#include <stdio.h>

/* The packed numbers of an image (pixel_codec.h), written at the page's end as long as there is room. */
struct page_layer {
    char *path;
    int width, height;
    double n; /* observations per pixel; 0: not the same in all pixels, and then in bytes */
    char unit[16];
    double spp;
    uint8_t *bytes;
    size_t size;
};

/* A claim and its place on the page. */
struct claim_ref {
    const json_t *json;
    size_t index; /* in results.json; its anchor is #claim-<index> */
    enum outcome outcome;
};

/* Shown beside the statistics: how alike the two images of a claim look (FLIP), and what the test rule of Blender would
 * say of them (idiff). Neither takes part in any verdict. */
struct similarity {
    bool has_flip;   /* false where the reference is black */
    double hdr, ldr; /* mean FLIP; LDR: as the page shows the images at 0 stops */
    struct flip_exposures exposures;
    double idiff_percent; /* per cent of the pixels that differ by more than Blender's threshold */
    bool idiff_differs;
};

/* A claim's row in the table of similarities, and its packed FLIP map (pixel_codec.h; NULL: none). */
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

/* Adds the layer of m, which was read from path, once for each path. *index: its number on the page. */
NODISCARD bool report_pixel_data_add(struct page *p, const char *path, const struct moments *m,
                                     size_t *index, struct err *e);
/* Writes the colours of maps, all layers and the FLIP maps, as base64 in <script> elements that no browser runs. */
void report_pixel_data_write(struct page *p);
void report_pixel_data_free(struct page *p);

/* Writes the <section> of one scene: its purpose, its images, and all its claims, which are those given.
 * Fails if an image cannot be read or sizes differ. */
NODISCARD bool report_scene(struct page *p, const struct claim_ref *claim, size_t num,
                            struct err *e);

/* One side of a claim, as loaded. */
struct claim_side {
    const struct moments *m;
    size_t layer; /* its number on the page */
};

/* Writes the <article> of a judged claim: a place for the script's maps, the plots of its p-values and power, and the
 * evidence. white: the radiance shown as white. */
NODISCARD bool report_claim(struct page *p, const struct claim_ref *claim,
                            const struct claim_side *a, const struct claim_side *b, double white,
                            struct err *e);

/* <article> of a claim that could not be judged. */
void report_claim_error(struct page *p, const struct claim_ref *claim);

/* The verdict as a coloured label with a mark, so that colour is not needed. */
void report_badge(FILE *f, const struct claim_ref *claim);

/* The reference's name, and the quantity where it is not the mean. */
void report_reference(FILE *f, const struct claim_ref *claim);

/* The sections around the scenes; each writes nothing if the results have nothing for it (NULL or empty). */

/* The matrix at the top of a page of several scenes: a row with a thumbnail for each scene, in the order of the
 * claims, and a column for each reference of the tested program (the one that is neither ours nor a reference, else
 * ours). A cell has a mark, so that colour is not needed, the difference, and a link to its claim. The last column
 * counts the scene's other claims. Nothing for fewer than two scenes. An image that cannot be read has no
 * thumbnail; report_scene() then fails. */
void report_matrix(struct page *p, const struct claim_ref *claim, size_t num);

/* Writes <section id="table">: a row for each of num claims, in the order given, that links to its evidence, and
 * the same as CSV. page_table.js searches and sorts table#claims. */
void report_table(FILE *f, const struct claim_ref *claim, size_t num, bool folded);

/* Writes <details> of a judged claim, unfolded if `open`, with all that it takes to question the verdict: numbers,
 * regions, seeds, samples, versions, each statistic with its share of alpha and its finding, what the difference
 * resembles, the ratio of the variances, and the commands that run the claim again and approve another reference.
 * */
void report_evidence(FILE *f, const json_t *claim, bool open);
/* Writes the reporting tiles of smallest p as buttons (data-x, data-y: their corner, pixels) that mark the
 * tile in the images, and a line that the page's script replaces by a tile's values. Nothing if no tile has
 * noise. */
void report_evidence_tiles(FILE *f, const json_t *claim);

/* Compares A with the reference B, radiance `white` being shown as white. map: one float per pixel, receives HDR-FLIP,
 * unless B is black. Fails only if out of memory. */
NODISCARD bool report_similarity_measure(const struct moments *a, const struct moments *b,
                                         double white, struct similarity *out, float *map,
                                         struct err *e);
/* Writes the claim's line and adds its row to the table. Its FLIP map goes into the page for the script, except for a
 * claim as expected on a folded page. */
NODISCARD bool report_similarity(struct page *p, const struct claim_ref *claim,
                                 const struct moments *a, const struct moments *b, double white,
                                 struct err *e);
/* Writes a <section> with the table of all claims that have such a line; nothing if none has. */
void report_similarity_table(const struct page *p);

/* Stated errors ("consistency", stated_error_results.h): one line, how many scenes have errors as stated; the table. */
void report_stated_error_headline(FILE *f, const json_t *consistency);
void report_stated_error(FILE *f, const json_t *consistency);

/* Noise (noise_results.h): one line for the head of the page; a section with a row for each scene and engine:
 * variance of a sample, slope of the error, efficiency. */
void report_noise_headline(FILE *f, const json_t *noise);
void report_noise(FILE *f, const json_t *noise);

/* Convergence (convergence_results.h): the verdict in one line, as the page's headline if `alone`; for each scene
 * the plots of RMSE against samples and CPU time and of the depth ladder, what was judged, and the rungs. */
void report_convergence_headline(FILE *f, const json_t *results, bool alone);
void report_convergence(FILE *f, const json_t *convergence);

/* What the time went to (render_cost.h): a row for each scene, the costliest first; nothing where nothing was rendered. */
void report_cost(FILE *f, const json_t *results);

#endif
