/* Memory for large arrays. */
#ifndef ASSAY_HUGE_ALLOC_H
#define ASSAY_HUGE_ALLOC_H

#include "err.h"

#include <stddef.h>

/* `size` bytes, aligned to 64; an array of megabytes lies on large pages where the system has them:
 * fewer misses of the page table. Not zeroed. The caller's, to free(); NULL if out of memory. */
NODISCARD void *huge_alloc(size_t size);
/* As calloc(); megabytes lie on large pages where the system has them, for the most part: fewer faults
 * when they are touched first. The caller's, to free(). */
NODISCARD void *huge_calloc(size_t num, size_t size);

#endif
