/* Files and texts by their content. */
#ifndef ASSAY_SHA256_H
#define ASSAY_SHA256_H

#include "err.h"

/* Lower-case hex SHA-256 of a file (nettle). */
NODISCARD bool sha256_file(const char *path, char hex[65], struct err *e);
/* The same of a text. */
void sha256_text(const char *text, char hex[65]);

#endif
