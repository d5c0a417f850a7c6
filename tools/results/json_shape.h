/* Checks the members of objects in results.json against tables of names and types. */
#ifndef ASSAY_JSON_SHAPE_H
#define ASSAY_JSON_SHAPE_H

#include "renderer/base/err.h"

#include <jansson.h>

enum shape_kind {
    IS_TEXT,
    IS_NUMBER,
    IS_POSITIVE,
    IS_ESTIMATE, /* a number and, as NAME_ci, its interval or null */
    IS_POSITIVE_ESTIMATE,
    IS_COUNT,
    IS_BOOLEAN,
    IS_INTERVAL,
    IS_TRIPLE, /* of numbers */
    IS_COUNTS,
    IS_VERDICT, /* or MEASURED */
    NUM_SHAPE_KINDS
};

/* A part is an object, or a list of at least that many objects. */
enum shape_part { PART_OBJECT = -1, PART_LIST = 0, PART_LIST_OF_1 = 1, PART_LIST_OF_2 = 2 };

/* The members of an object. names: those of each kind, separated by blanks; "name" is required, "name?" may be absent,
 * "name~" may be null. part: members that are objects or lists of them, up to the first without a name. */
struct shape {
    const char *names[NUM_SHAPE_KINDS];
    struct {
        const char *name; /* with or without '?' */
        const struct shape *of;
        enum shape_part kind;
    } part[8];
};

/* "MEASURED": the verdict of an engine that is not judged. */
extern const char json_shape_measured[];

/* Error lines begin with `where` and name the member, such as "rungs.spp". */
NODISCARD bool json_shape_check(const json_t *object, const struct shape *shape, const char *where,
                                struct err *e);
/* Checks a row: it has either an "error" (then "passed" is false, and a "verdict" can only be INCONCLUSIVE: the
 * time was over), or the members of `judged` and a "verdict" that agrees with "passed". */
NODISCARD bool json_shape_check_row(const json_t *row, const struct shape *judged,
                                    const char *where, struct err *e);

#endif
