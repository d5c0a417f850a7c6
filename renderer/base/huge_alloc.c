#define _DEFAULT_SOURCE /* madvise */
#include "huge_alloc.h"

#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>

enum { CACHE_LINE = 64, HUGE_PAGE = 2 << 20 };

void *huge_alloc(size_t size)
{
    size_t page = size >= HUGE_PAGE ? HUGE_PAGE : CACHE_LINE;
    size = (size + page - 1) / page * page;
    void *p = aligned_alloc(page, size);
    if (p != NULL && page == HUGE_PAGE)
        madvise(p, size, MADV_HUGEPAGE); /* only a hint; its failure does no harm */
    return p;
}

void *huge_calloc(size_t num, size_t size)
{
    char *p = calloc(num, size);
    if (p == NULL)
        return NULL;
    const size_t bytes = num * size, skip = (HUGE_PAGE - (uintptr_t)p % HUGE_PAGE) % HUGE_PAGE;
    if (bytes >= skip + HUGE_PAGE)
        madvise(p + skip, (bytes - skip) / HUGE_PAGE * HUGE_PAGE, MADV_HUGEPAGE);
    return p;
}
