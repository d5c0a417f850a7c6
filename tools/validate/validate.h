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
    /* SCENE for all its claims, or SCENE/CLAIM, where CLAIM is the name of a reference (pathtracer against it), the
     * name of a variant of ours, "consistency", "noise", or A:B for any other pair. None: everything is judged. With
     * `engine` these are NAME:REFERENCE and NAME:pathtracer. */
    const char *only[MAX_ONLY];
    int num_only;
    bool live;     /* render the references now instead of reading the goldens */
    double alpha;  /* of the whole family of claims */
    int of_claims; /* size of that family, if this run judges only a part; 0: the claims judged */
    uint64_t seed; /* of our render */
    uint32_t reference_seed;     /* live: of the references */
    const struct engine *engine; /* NULL, or another engine, which alone is judged: against references and ours */
    int engine_spp, engine_replicates; /* 0: as its description says */
    bool
        repeats_seeds; /* the engine is rendered with the seeds of each stored reference first, and is EQUIVALENT
                           to it if that makes the same bits; where not, images of one seed are compared in
                           pairs; what these leave undecided is rendered with reference_seed */
    int threads;
    double timeout_s; /* of one program */
    bool quiet;
    /* To find out fast that a renderer is wrong: looks up to the declared samples (alpha_spending_declared), the
     * cheapest first, until a claim comes out DIFFERENT against expectation. alpha is still divided by all claims;
     * those undecided by then are INCONCLUSIVE, those not looked at are not in the results. */
    bool until_different;
    /* Wall time. Above 0: each claim gets looks at more and more samples until it is decided or the time is over
     * (alpha_spending_open); alpha is spent over the looks (alpha_spending.h). 0: one look, at the declared
     * samples. */
    double budget_s;
    /* 2: what is flagged as DIFFERENT at sqrt(alpha) must be confirmed with fresh seeds at sqrt(alpha)
     * (two_stage.h), if both sides can be rendered again: not against goldens, whose noise is in both stages, so
     * that the product does not bound the error. 1: one stage. 0: 2 for alpha below 1e-5, where no tail is known
     * well enough, else 1. */
    int stages;
    /* Called between looks, at least show_every_s apart (0: never), with the results so far: as validate() returns
     * them, and "unfinished" and "page_every_s". If it returns false, with a line in e, the run ends. */
    double show_every_s;
    bool (*show)(const json_t *so_far, const struct validate_options *opt, struct err *e);
};

/* What cannot be rendered in parts is judged once, at its declared size: adaptive variants, the other engine, and
 * stated errors. Goldens and closed forms do not grow; our renders grow by ranges of sample numbers, with --live
 * those of engines by further replicates. A claim of noise has looks of its own.
 *
 * A claim that the budget left undecided is INCONCLUSIVE, with what its last look saw. One that had no look is
 * INCONCLUSIVE with an error line and no numbers; never a pass.
 *
 * Fills *results (results.h; a new reference) and writes below out_dir: data/<scene>/<engine>.exr (with several
 * looks <engine>_<observations>.exr), z_<a>_<b>.exr and rel_<a>_<b>.exr, for the other engine also its manifest
 * <engine>.json. Scenes that it cannot express are listed in "not_expressible": [{"scene":, "engine":, "reason":}].
 * With `live`, "loader" is the report of import_check() on the same scenes. A claim that cannot be judged is in the
 * results with its error. False only if nothing could be judged at all (no suite, no output directory, another
 * engine that can express none of the scenes), or if show() ended the run. */
NODISCARD bool validate(const struct validate_options *opt, int argc, char **argv, json_t **results,
                        struct err *e);

/* A part of a run, selected by `only` as validate_options.only; all parts together give the same bits as the run. */
struct validate_part {
    const struct suite_scene *scene;
    const char *const *only;
    int num_only, num_claims; /* of the whole run */
};
/* Calls part() for each scene with claims, or for each claim, in the order of the results, as long as it returns true.
 * False if it did not, and on what makes validate() fail before it judges. */
NODISCARD bool validate_parts(const struct validate_options *opt, bool by_claim,
                              bool (*part)(void *ctx, const struct validate_part *part,
                                           struct err *e),
                              void *ctx, struct err *e);
/* *results: what validate() would return for the whole run (a new reference), without claims and other lists. */
NODISCARD bool validate_start(const struct validate_options *opt, int argc, char **argv,
                              json_t **results, struct err *e);

#endif
