/* Decisions of staff: the points of a check for one submission, with the reason, in a text file of lines
 *     ID CHECK POINTS REASON...
 * An ID with blanks stands in double quotes; lines that begin with # are comments. */
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

/* Fails, with the line's number, on an unknown check, on points that it does not give, on a missing
 * reason, and on a second decision about one check and ID. The caller frees with appeals_free(). */
NODISCARD bool appeals_read(const char *path, const struct rubric *r, struct appeals *out,
                            struct err *e);
void appeals_free(struct appeals *a);

/* Hash of all decisions about a submission; a NULL: there are none. */
void appeals_key(const struct appeals *a, const char *id, char key[65]);

/* Enters the decisions into a grade (tools/docs/formats/grades.md): a check gets the points and, as
 * "appeal", the reason, and counts as judged; the points of its part and of the whole are updated.
 * a NULL: none. */
void appeals_apply(const struct appeals *a, const struct rubric *r, json_t *grade);

#endif
