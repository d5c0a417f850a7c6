/* results.json: the record of one `assay validate`, `assay compare` or `assay converge`, from which junit.xml and
 * report.html are made and nothing else. All members: tools/docs/formats/results.md.
 *
 * Paths in "files" are absolute, or relative to the directory of results.json. A claim with "error" could not be
 * judged: it never counts as passed and makes the exit code 3, unless it also has the "verdict" INCONCLUSIVE:
 * then only time was missing, and it counts as that. "passed" is true exactly where "verdict" equals "expected"
 * and, of NO DIFFERENCE FOUND, the MDBs are at most those of "accept_mdb".
 *
 * After results_read() a reader may rely on what that page marks as needed, of the whole and of each claim (of one
 * with "error": scene, a, b, expected and passed alone), and on the type of everything else there that is present. */
#ifndef ASSAY_RESULTS_H
#define ASSAY_RESULTS_H

#include "reference/base/json_file.h"
#include "reference/base/json_node.h"

#include <jansson.h>

/* Exit codes of every verb. */
enum { EXIT_EQUIVALENT = 0, EXIT_DIFFERENT = 1, EXIT_INCONCLUSIVE = 2, EXIT_NOT_JUDGED = 3 };

/* Reads results.json and checks all that report and junit rely on (see above), each failure a line
 * with file, claim and member. New reference in *out. */
NODISCARD bool results_read(const char *path, json_t **out, struct err *e);

/* How a claim came out, worst first. OPPOSITE: DIFFERENT for what should pass, or EQUIVALENT for DIFFERENT. UNDECIDED: any
 * other verdict that was not expected. */
enum outcome { OUTCOME_NOT_JUDGED, OUTCOME_OPPOSITE, OUTCOME_UNDECIDED, OUTCOME_AS_EXPECTED };
enum outcome results_claim_outcome(const json_t *claim);
/* The same of a row that is no claim: stated errors, noise, an engine of the convergence. One that is only measured has passed. */
enum outcome results_row_outcome(const json_t *row);
/* How many claims have the error of claim i, which has one; 0 if an earlier one has it. */
size_t results_num_with_error(const json_t *claims, size_t i);
/* Is no earlier claim (or row of noise) of its scene? */
bool results_is_first_of_scene(const json_t *claims, size_t i);
/* Of a claim that is OUTCOME_NOT_JUDGED: the budget ended before its first look. It has no numbers,
 * like any that was not judged, but counts as INCONCLUSIVE. */
bool results_claim_lacks_time(const json_t *claim);

/* All that a file judges, one after the other: claims, stated errors ("consistency"), noise, engines of the convergence. Set
 * `results`, and `kind` to begin with that; the rest is zero. */
enum judged { JUDGED_CLAIM, JUDGED_STATED_ERROR, JUDGED_NOISE, JUDGED_CONVERGENCE, NUM_JUDGED };
struct results_walk {
    const json_t *results;
    enum judged kind;
    const json_t *json; /* the claim, row or engine */
    const char *scene;
    enum outcome outcome;
    bool lacks_time;    /* results_claim_lacks_time() */
    size_t index;       /* in its list */
    size_t row, engine; /* what comes next */
};
/* False past the last. */
bool results_next(struct results_walk *w);
/* How many of one kind there are; by outcome in count. */
size_t results_count(const json_t *results, enum judged kind,
                     size_t count[OUTCOME_AS_EXPECTED + 1]);

/* How the reason begins of what was not decided when the time of --budget was over; and whether there is such a claim or one that
 * lacks time. */
#define BUDGET_SPENT "budget spent"
bool results_lack_time(const json_t *results);

/* 0 if every claim and every engine of the convergence passed; else 3 if any could not be judged, else 1 if any verdict was the
 * opposite of the expected (DIFFERENT for EQUIVALENT or the reverse), else 2. */
int results_exit_code(const json_t *results);

/* JUnit XML: one testsuite, one testcase per claim; failure for a wrong verdict, error for one that
 * could not be judged. Appears by rename. */
NODISCARD bool junit_write(const char *path, const json_t *results, struct err *e);

#endif
