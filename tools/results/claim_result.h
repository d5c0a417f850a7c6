/* One claim of results.json (results.h): made from what was compared, and checked when it is read. */
#ifndef ASSAY_CLAIM_RESULT_H
#define ASSAY_CLAIM_RESULT_H

#include "tools/compare/compare.h"

#include <jansson.h>

/* Who is compared with whom, and what should come out. */
struct claim_context {
    const struct suite_scene *scene; /* NULL: two files; a, b are then their names */
    const char *a, *b;
    const char *fidelity; /* "class" in results.json; NULL: none */
    enum verdict expected;
    struct compare_options opt;
    double accept_mdb[2]; /* of the image, of a tile: NO DIFFERENCE FOUND passes if expected and no
                             more than that could have been missed; 0: never */
    const char *rerun;    /* the command that judges this claim alone */
};

/* Is the verdict the one expected and, of NO DIFFERENCE FOUND, the MDB small enough? */
bool claim_result_passes(const struct claim_context *c, const struct comparison *result);

/* New references, NULL if out of memory. */
json_t *claim_result_judged(const struct claim_context *c, const struct comparison *result);
json_t *claim_result_not_judged(const struct claim_context *c, const char *error);

/* Adds how often and by what a side was observed: n, unit, spp (side "a" or "b"). */
bool claim_result_add_observations(json_t *claim, const char *side, const struct moments *m);

/* Has a claim of a file all that results.h promises? The line begins with `where`. */
NODISCARD bool claim_result_check(const json_t *claim, const char *where, struct err *e);

/* A new results object with everything but claims: command line (a verb and its arguments, NULL at argv[argc]; in words that
 * shell_quote_split() reads back), date, machine. NULL with a line if an argument is no UTF-8, and out of memory. */
NODISCARD json_t *claim_result_new_results(int argc, char **argv, double alpha, struct err *e);

#endif
