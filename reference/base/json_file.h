/* JSON files: reading with file and line in every error, atomic writing. */
#ifndef ASSAY_JSON_FILE_H
#define ASSAY_JSON_FILE_H

#include "renderer/base/err.h"

#include <jansson.h>

/* As json_load_file(), but a folder, FIFO or device cannot be read, and a byte order mark is no error. Returns a new
 * reference, or NULL with the reason in *why, without the path. */
json_t *json_read(const char *path, size_t flags, json_error_t *why);

/* The same, but rejects duplicate members; the error is "FILE:LINE: why", or "FILE: why" if the file cannot be
 * opened. */
json_t *json_read_or_say(const char *path, struct err *e);

/* Reads a JSON object: a new reference, an empty object if there is no such file, NULL on error. */
json_t *json_read_object(const char *path, struct err *e);

/* Writes the file atomically (by rename), indented, with a final newline; creates its parent directories. */
NODISCARD bool json_write(const char *path, const json_t *root, struct err *e);
/* The same with the given json_dumps() flags; the directory must exist. */
NODISCARD bool json_write_as(const char *path, const json_t *root, size_t flags, struct err *e);

#endif
