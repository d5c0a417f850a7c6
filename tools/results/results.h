/* results.json: the record of one `assay validate`, `assay compare` or `assay converge`, and the only source of
 * junit.xml and of the HTML page. All members: tools/docs/formats/results.md.
 *
 * Paths in "files" are absolute, or relative to the directory of results.json. A claim with "error" could not be
 * judged: it never passes and makes the exit code 3, unless its "verdict" is INCONCLUSIVE: then only time was
 * missing, and it counts as inconclusive. "passed" is true exactly if "verdict" equals "expected" and, for NO
 * DIFFERENCE FOUND, the MDBs do not exceed those of "accept_mdb".
 *
 * After results_read() callers may rely on the members that results.md marks as needed, of the whole and of each claim
 * (of one with "error": only scene, a, b, expected and passed), and on the types of all other members that it lists. */
#ifndef ASSAY_RESULTS_H
#define ASSAY_RESULTS_H

#include "reference/base/json_file.h"
#include "reference/base/json_node.h"

#include <jansson.h>

/* Exit codes of every verb. */
enum { EXIT_EQUIVALENT = 0, EXIT_DIFFERENT = 1, EXIT_INCONCLUSIVE = 2, EXIT_NOT_JUDGED = 3 };

/* Reads a results.json and checks what is promised above; the error line names file, claim and member.
 * *out: a new reference. */
NODISCARD bool results_read(const char *path, json_t **out, struct err *e);

/* How a claim came out, worst first. OPPOSITE: EQUIVALENT or DIFFERENT, where neither that nor INCONCLUSIVE was
 * expected. UNDECIDED: any other verdict that was not expected. */
enum outcome { OUTCOME_NOT_JUDGED, OUTCOME_OPPOSITE, OUTCOME_UNDECIDED, OUTCOME_AS_EXPECTED };
enum outcome results_claim_outcome(const json_t *claim);
/* The same for a row of stated errors or noise, or an engine of "convergence". One that was only measured is as
 * expected. */
enum outcome results_row_outcome(const json_t *row);
/* The alpha of the claim's intervals, whose level is 1 - 2 alpha: half of the claim's where it has two stages. */
double results_interval_alpha(const json_t *claim);
/* Is "pathtracer-light", say, `name` itself or one of its variants? */
bool results_is_variant_of(const char *text, const char *name);
/* How many claims have the same error as claim i, which has one; 0 if an earlier claim has it (each is listed once). */
size_t results_num_with_error(const json_t *claims, size_t i);
/* Is claim (or row of noise) i the first of its scene? */
bool results_is_first_of_scene(const json_t *claims, size_t i);
/* Is the claim OUTCOME_NOT_JUDGED because the budget ended before its first look? It has no numbers, but counts
 * as INCONCLUSIVE. */
bool results_claim_lacks_time(const json_t *claim);

/* Iterates over all that a file judges: claims, stated errors ("consistency"), noise, engines of "convergence". Set
 * `results`, and `kind` to begin with a later kind; initialise the rest with zero. */
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
/* Moves on to the next one; false past the last. */
bool results_next(struct results_walk *w);
/* The number of items of one kind; count[]: the same by outcome. */
size_t results_count(const json_t *results, enum judged kind,
                     size_t count[OUTCOME_AS_EXPECTED + 1]);

/* How the "reason" begins of a claim that was undecided when --budget was over. results_lack_time(): is there such
 * a claim, or one that lacks time? */
#define BUDGET_SPENT "budget spent"
bool results_lack_time(const json_t *results);

/* Over all that results_next() visits: 0 if everything is as expected; 3 if anything could not be judged, or there is
 * nothing; else 1 if any outcome is OPPOSITE, else 2. A claim that lacks time counts as undecided. */
int results_exit_code(const json_t *results);

/* JUnit XML: one testsuite with a testcase for each claim and each judged row of noise; a failure for an unexpected
 * verdict, an error for what could not be judged. Appears by rename. */
NODISCARD bool junit_write(const char *path, const json_t *results, struct err *e);

#endif
