/* Approves a newly rendered reference (the candidate) in place of the stored one, or refuses it: what
 * changes is measured and printed first. */
#ifndef ASSAY_APPROVE_H
#define ASSAY_APPROVE_H

#include "reference/store/reference_render.h"
#include "tools/compare/verdict.h"

#include <stdio.h>

struct approve_options {
    const char *from_dir, *golden_dir; /* both laid out as by golden_write() */
    double alpha;                      /* of one comparison's verdict */
    bool accept_new;                   /* where nothing is stored */
    const char *why; /* accept for this reason a difference, or an undecided candidate with at
                      * least 1.25 times the samples of what is stored; NULL: refuse it */
};

enum approval {
    APPROVE_ACCEPTED,     /* stored */
    APPROVE_UNCHANGED,    /* nothing to do */
    APPROVE_DIFFERENT,    /* refused: DIFFERENT, and no reason given */
    APPROVE_INCONCLUSIVE, /* refused, whatever the options */
    APPROVE_BETTER,       /* refused: undecided, with more samples, and no reason given */
    APPROVE_IMPOSSIBLE /* refused: no candidate, a damaged one, or nothing to compare with; e says */
};

/* Decides on one reference. Prints to `out` the verdict (compare_moments() of candidate against stored, margins of
 * the suite), the difference with its interval and MDB, the provenance of both, and what was done.
 *
 * What is accepted goes into golden_dir as golden_write() does it; its manifest entry carries
 * "changes", oldest first, one for each approval: {"date", "verdict": "NEW", "IDENTICAL",
 * "EQUIVALENT", "DIFFERENT", "INCONCLUSIVE" or "NOT COMPARABLE" (of another size), and where they apply "why",
 * "difference", "ci", "mdb_global", "mdb_tile", "alpha", "was": {version, seed, scene_sha256,
 * exr_sha256, date}}. */
enum approval approve(const struct approve_options *opt, const struct suite_scene *scene,
                      const struct suite_reference *ref, FILE *out, struct err *e);

void approve_compare_heading(FILE *out);
/* Prints a row of the table under that heading (both versions, difference, verdict) and sets *verdict; stores
 * nothing. False, with a line, if the two cannot be compared. Of opt it uses from_dir, golden_dir and alpha. */
NODISCARD bool approve_compare(const struct approve_options *opt, const struct suite_scene *scene,
                               const struct suite_reference *ref, FILE *out, enum verdict *verdict,
                               struct err *e);

#endif
