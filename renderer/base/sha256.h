/* SHA-256 of files, bytes and texts. */
#ifndef ASSAY_SHA256_H
#define ASSAY_SHA256_H

#include "err.h"

#include <stddef.h>

/* Lower-case hex SHA-256 of a file (by nettle), with its terminating zero. False with a line on a read error. */
NODISCARD bool sha256_file(const char *path, char hex[65], struct err *e);
/* The same of bytes in memory, and of a text. */
void sha256_bytes(const void *bytes, size_t num, char hex[65]);
void sha256_text(const char *text, char hex[65]);

#endif
