/* A suite of a user's own: a directory with suite.json (tools/docs/formats/suite.md), whose scenes are files of any kind, and
 * whose references are stored below golden/ beside it. */
#ifndef ASSAY_SUITE_OWN_H
#define ASSAY_SUITE_OWN_H

#include "suite.h"

/* Is there a suite.json? */
bool suite_own_is(const char *dir);

/* All scenes of the file, without their hashes: suite_load() adds these and frees `out`, also after a failure. An error names
 * the file and the member. */
NODISCARD bool suite_own_read(const char *dir, struct suite *out, struct err *e);

#endif
