/* What an object of results.json has to hold. */
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

/* An object, or a list of at least so many. */
enum shape_part { PART_OBJECT = -1, PART_LIST = 0, PART_LIST_OF_1 = 1, PART_LIST_OF_2 = 2 };

/* Names of each kind with a blank between: "name" has to be there, "name?" may be absent, "name~" may be null. And the parts of the
 * object, as many as have a name. */
struct shape {
    const char *names[NUM_SHAPE_KINDS];
    struct {
        const char *name; /* with or without '?' */
        const struct shape *of;
        enum shape_part kind;
    } part[8];
};

/* What an engine that is not judged has for a verdict. */
extern const char json_shape_measured[];

/* The line of a failure begins with `where` and names the member, "rungs.spp" say. */
NODISCARD bool json_shape_check(const json_t *object, const struct shape *shape, const char *where,
                                struct err *e);
/* A row has either an "error" (and then is not "passed", and has a "verdict" only if time was missing), or what is in `judged`,
 * with a "verdict" that agrees with "passed". */
NODISCARD bool json_shape_check_row(const json_t *row, const struct shape *judged,
                                    const char *where, struct err *e);

#endif
