/* Scope-based cleanup for tests: variables that are freed at the end of their block, but not if the
 * test fails there. */
#ifndef ASSAY_TESTS_OWN_H
#define ASSAY_TESTS_OWN_H

#include <stdlib.h>

/* OWN(moments) m; is a struct moments, for which moments_free() is called. */
#define OWN(type) __attribute__((cleanup(type##_free))) struct type

/* A text, for free(). */
static inline void own_free_text(char **text)
{
    free(*text);
}
#define OWN_TEXT __attribute__((cleanup(own_free_text))) char *

#endif
