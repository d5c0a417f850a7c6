/* Which vector instructions the kernels use. They are compiled once for each set and chosen when the
 * program runs. */
#ifndef ASSAY_ISA_H
#define ASSAY_ISA_H

#include "err.h"

#include <stdbool.h>

enum isa {
    ISA_SCALAR, /* none: the reference that the others are tested against */
    ISA_AUTO,   /* as an option only: the widest that the machine has */
    ISA_SSE42,
    ISA_AVX2,  /* with FMA */
    ISA_AVX512 /* F, VL, BW, DQ */
};

/* *isa = ISA_AUTO becomes the widest set of this machine; fails with a line if the machine lacks
 * what is asked for. */
NODISCARD bool isa_choose(enum isa *isa, struct err *e);

extern const char *const isa_names[]; /* by enum isa; ends with NULL */

/* Put before a function that loops over many numbers. The compiler makes clones for wider vectors, and
 * the dynamic loader picks one when the program starts; not under sanitizers, which are not ready by
 * then. All clones give the same bits, as the compiler neither contracts nor reorders floating-point
 * operations. */
#if defined __GLIBC__ && !defined __clang__ && !defined __SANITIZE_ADDRESS__ &&                    \
    !defined __SANITIZE_THREAD__
#define ISA_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define ISA_CLONES
#endif

#endif
