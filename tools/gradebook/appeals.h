/* What staff decided themselves: points of a check for one submission, with the reason, in a text file of lines
 *     ID CHECK POINTS REASON...
 * An ID with blanks stands in double quotes; # begins a line that is not read. */
#ifndef ASSAY_APPEALS_H
#define ASSAY_APPEALS_H

#include "tools/submission/rubric.h"

#include <jansson.h>

struct appeal {
    int line, check; /* index in the rubric */
    double points;
    char id[128], reason[256];
};
struct appeals {
    struct appeal *of;
    int num;
};

/* Fails with the line on a check that the rubric has not, on points that it does not give, without a reason, on a second line for
 * the same. The caller frees with appeals_free(). */
NODISCARD bool appeals_read(const char *path, const struct rubric *r, struct appeals *out,
                            struct err *e);
void appeals_free(struct appeals *a);

/* Hash of what is decided for a submission; a NULL: of nothing. */
void appeals_key(const struct appeals *a, const char *id, char key[65]);

/* Into a grade (tools/docs/formats/grades.md): each check decided gets its points and "appeal", the reason; it counts as judged. Points
 * of parts and of all follow. */
void appeals_apply(const struct appeals *a, const struct rubric *r, json_t *grade);

#endif
