/* Validation: renders the suite with the program under test, compares every scene with its references, and
 * judges. */
#ifndef ASSAY_VALIDATE_H
#define ASSAY_VALIDATE_H

#include "reference/external/engine_description.h"
#include "renderer/base/err.h"

#include <jansson.h>
#include <stdint.h>

enum { MAX_ONLY = 64 };

struct validate_options {
    const char *suite_dir, *golden_dir, *out_dir, *share_dir;
    const char *pathtracer; /* the program under test */
    /* SCENE, all claims of it, or SCENE/CLAIM, where CLAIM is the reference's name for pathtracer against it, the name of a
     * variant of ours, "consistency", "noise", or A:B for any other pair; none: all. */
    const char *only[MAX_ONLY];
    int num_only;
    bool live;     /* render the references now instead of reading the goldens */
    double alpha;  /* of the whole family of claims */
    int of_claims; /* how many that has, where this run judges only some; 0: those that it judges */
    uint64_t seed; /* of our render */
    uint32_t reference_seed;     /* live: of the references */
    const struct engine *engine; /* a further one, judged against references and ours; NULL: none */
    int engine_spp, engine_replicates; /* 0: its own */
    int threads;
    double timeout_s; /* of one program */
    bool quiet;
    /* Looks up to the declared samples (alpha_spending_declared), the small ones of all scenes first, and stop
     * at the first claim that comes out DIFFERENT against expectation: to find out fast that a renderer
     * is wrong. alpha is still divided by all claims; those undecided by then are
     * INCONCLUSIVE, those not looked at are not in the results. */
    bool until_different;
    /* Wall time. Above 0: each claim is looked at again and again, with samples that double, until it is
     * decided or the time is over (alpha_spending_open), and alpha is spent over the looks (alpha_spending.h). 0: one
     * look, at the declared samples. */
    double budget_s;
    /* 2: what DIFFERENT flags at sqrt(alpha) is confirmed with fresh seeds at sqrt(alpha) (two_stage.h), where
     * both sides can be had again: not against goldens, whose noise is in both stages, so that no product
     * bounds the error. 1: one stage. 0: 2 below alpha 1e-5, where no tail is known well enough, else 1. */
    int stages;
    /* Every so many seconds (0: never), between two looks, what is judged so far: a document as validate() returns, with
     * "unfinished" and "page_every_s". False with a line in e ends the run. */
    double show_every_s;
    bool (*show)(const json_t *so_far, const struct validate_options *opt, struct err *e);
};

/* What cannot be looked at in parts is judged once, at its declared size: adaptive variants, the further
 * engine (rendered once), and the claims of consistency. Goldens and closed forms do not grow; ours grows
 * by ranges of sample numbers, with --live engines by further replicates. A claim of noise has looks of its own.
 *
 * A claim that the budget left undecided is INCONCLUSIVE, with what its last look saw. One that had no look
 * is INCONCLUSIVE with an error line and no numbers; never a pass.
 *
 * Fills *results (results.h; a new reference) and writes below out_dir: data/<scene>/<engine>.exr (in parts:
 * <engine>_<observations>.exr), z_<a>_<b>.exr and rel_<a>_<b>.exr, for a further engine also its manifest <engine>.json. Scenes
 * that it cannot express are the results' "not_expressible": [{"scene":, "engine":, "reason":}].
 * With `live`, "loader" in the results is what import_check() says of the same scenes. A claim that
 * cannot be judged is in the results with its error; false only if nothing could be judged at all
 * (no suite, no output directory, a further engine that can express none of the scenes). */
NODISCARD bool validate(const struct validate_options *opt, int argc, char **argv, json_t **results,
                        struct err *e);

/* A part of a run; all parts together give the same bits as the run. only: what to pass as validate_options.only. */
struct validate_part {
    const struct suite_scene *scene;
    const char *const *only;
    int num_only, num_claims; /* of the whole run */
};
/* Calls for each scene that has claims, or for each claim, in the order of the results; stops where that returns false, and
 * returns it. Fails where validate() would before it judges. */
NODISCARD bool validate_parts(const struct validate_options *opt, bool by_claim,
                              bool (*part)(void *ctx, const struct validate_part *part,
                                           struct err *e),
                              void *ctx, struct err *e);
/* *results as validate() on the whole, with all lists empty. */
NODISCARD bool validate_start(const struct validate_options *opt, int argc, char **argv,
                              json_t **results, struct err *e);

#endif
