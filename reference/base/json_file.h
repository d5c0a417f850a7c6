/* JSON files that appear whole. */
#ifndef ASSAY_JSON_FILE_H
#define ASSAY_JSON_FILE_H

#include "renderer/base/err.h"

#include <jansson.h>

/* json_load_file() of a regular file; a FIFO, say, fails to open. A new reference; NULL, and why in *why. */
json_t *json_read(const char *path, size_t flags, json_error_t *why);

/* The same, members may not repeat; NULL with the line "FILE:LINE: why", or "FILE: why" where it cannot be opened. */
json_t *json_read_or_say(const char *path, struct err *e);

/* A new reference; {} without a file; NULL: error. */
json_t *json_read_object(const char *path, struct err *e);

/* Writes by rename, indented, with a final newline; makes the directories above it. */
NODISCARD bool json_write(const char *path, const json_t *root, struct err *e);
/* The same with flags of json_dumps(), in a directory that is there. */
NODISCARD bool json_write_as(const char *path, const json_t *root, size_t flags, struct err *e);

#endif
