/* Which vector instructions the kernels use. They are compiled once for each set and chosen when the
 * program runs. */
#ifndef ASSAY_ISA_H
#define ASSAY_ISA_H

#include "err.h"

#include <stdbool.h>

enum isa {
    ISA_SCALAR, /* none: the oracle of the others */
    ISA_AUTO,   /* as an option only: the widest that the machine has */
    ISA_SSE42,
    ISA_AVX2,  /* with FMA */
    ISA_AVX512 /* F, VL, BW, DQ */
};

/* *isa = ISA_AUTO becomes the widest set of this machine; fails with a line if the machine lacks
 * what is asked for. */
bool isa_choose(enum isa *isa, struct err *e) __attribute__((warn_unused_result));

extern const char *const isa_names[]; /* by enum isa; ends with NULL */

#endif
