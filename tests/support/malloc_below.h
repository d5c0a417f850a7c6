/* The allocator beneath a program's own malloc(), free(), ...: AddressSanitizer's if linked, so
 * that it still sees every block, else the C library's. For example MALLOC_BELOW(malloc)(size). */
#ifndef ASSAY_TESTS_MALLOC_BELOW_H
#define ASSAY_TESTS_MALLOC_BELOW_H

#include <stddef.h>

#define MALLOC_BELOW_DECLARE(type, name, ...)                                                      \
    extern type __interceptor_##name(__VA_ARGS__) __attribute__((weak));                           \
    extern type __libc_##name(__VA_ARGS__);
MALLOC_BELOW_DECLARE(void *, malloc, size_t)
MALLOC_BELOW_DECLARE(void *, calloc, size_t, size_t)
MALLOC_BELOW_DECLARE(void *, realloc, void *, size_t)
MALLOC_BELOW_DECLARE(void *, memalign, size_t, size_t)
MALLOC_BELOW_DECLARE(void, free, void *)
#define MALLOC_BELOW(name) (__interceptor_##name != NULL ? __interceptor_##name : __libc_##name)

#endif
