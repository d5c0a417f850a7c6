/* Memory for large arrays. */
#ifndef ASSAY_HUGE_ALLOC_H
#define ASSAY_HUGE_ALLOC_H

#include "err.h"

#include <stddef.h>

/* `size` bytes, aligned to 64; an array of megabytes lies on large pages where the system has them:
 * fewer TLB misses. Not zeroed. The caller frees it; NULL if out of memory. */
NODISCARD void *huge_alloc(size_t size);
/* Like calloc(); most of an array of megabytes lies on large pages where the system has them, so that
 * first touching it causes fewer page faults. The caller frees it; NULL if out of memory. */
NODISCARD void *huge_calloc(size_t num, size_t size);

#endif
