/* What documents in JSON can hold of what a user wrote. */
#ifndef ASSAY_UTF8_H
#define ASSAY_UTF8_H

#include <stdbool.h>

/* Whether it is UTF-8: no overlong form, no surrogate, nothing above U+10FFFF [RFC 3629]. */
bool utf8_is_valid(const char *text);

#endif
