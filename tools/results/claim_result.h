/* One claim of results.json (results.h): made from what was compared, and checked when it is read. */
#ifndef ASSAY_CLAIM_RESULT_H
#define ASSAY_CLAIM_RESULT_H

#include "tools/compare/compare.h"

#include <jansson.h>

/* What a claim compares, which verdict is expected, and with which options. */
struct claim_context {
    const struct suite_scene *scene; /* NULL: two files; a, b are then their names */
    const char *a, *b;
    const char *fidelity; /* "class" in results.json; NULL: none */
    enum verdict expected;
    struct compare_options opt;
    double accept_mdb[2]; /* image, tile: the largest MDB (relative) with which an expected NO
                             DIFFERENCE FOUND passes; 0: it never does */
    const char *rerun;    /* the command that judges this claim alone */
};

/* Is the verdict the expected one and, for NO DIFFERENCE FOUND, is each MDB small enough? */
bool claim_result_passes(const struct claim_context *c, const struct comparison *result);

/* A claim as JSON: judged, or with its error. New references; NULL if out of memory. */
json_t *claim_result_judged(const struct claim_context *c, const struct comparison *result);
json_t *claim_result_not_judged(const struct claim_context *c, const char *error);

/* Adds n_SIDE (fewest observations of any pixel), unit_SIDE and spp_SIDE; side: "a" or "b". */
bool claim_result_add_observations(json_t *claim, const char *side, const struct moments *m);

/* Does a claim that was read have all that results.h promises? Error lines begin with `where`. */
NODISCARD bool claim_result_check(const json_t *claim, const char *where, struct err *e);

/* Results without claims: command (argv: verb and arguments, argv[argc] NULL; quoted so that shell_quote_split()
 * reads it back), version, date, machine, alpha. A new reference; NULL with a line if an argument is not UTF-8 or
 * memory runs out. */
NODISCARD json_t *claim_result_new_results(int argc, char **argv, double alpha, struct err *e);

#endif
