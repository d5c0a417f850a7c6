/* "Has anything changed?" between renders of two versions of one program: sign_flip.h on files. */
#ifndef ASSAY_SAME_PROGRAM_H
#define ASSAY_SAME_PROGRAM_H

#include "sign_flip.h"
#include "tools/input/input.h"

/* Judges path[0] against path[1]: two images of any kind that input.h reads (a PNG even without its curve), or
 * two directories of equally many images; a side with memory[i] not NULL is taken from there. m: the moments of
 * both sides, if both state them, for their stated errors; they then need equally many samples; else NULL.
 * Fails with a line if numbers or sizes differ, and as sign_flip_test() does. */
NODISCARD bool same_program_judge(const char *const path[2],
                                  const struct input_memory *const memory[2],
                                  const struct moments *m, const struct sign_flip_options *opt,
                                  struct sign_flip *out, struct err *e);

/* Sets verdict, reason and MDBs of the claim. */
void same_program_decide(const struct sign_flip *f, double alpha, struct comparison *r);

#endif
