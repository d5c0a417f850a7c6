/* SHA-256 of files and texts. */
#ifndef ASSAY_SHA256_H
#define ASSAY_SHA256_H

#include "err.h"

/* Lower-case hex SHA-256 of a file (by nettle), with its terminating zero. False with a line on a read error. */
NODISCARD bool sha256_file(const char *path, char hex[65], struct err *e);
/* The same of a text. */
void sha256_text(const char *text, char hex[65]);

#endif
