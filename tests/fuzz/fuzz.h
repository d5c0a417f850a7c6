/* What the fuzz targets share (libFuzzer [LLVM libFuzzer]; `make fuzz`). A target gives the bytes to a reader and
 * aborts where the reader breaks its contract: a failure has one line of text, and leaves nothing behind. */
#ifndef ASSAY_TESTS_FUZZ_H
#define ASSAY_TESTS_FUZZ_H

#include "renderer/base/err.h"

#include <stddef.h>
#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* A file in memory with these bytes, its name ending in `suffix`; the same name at every call of a
 * process with that suffix. At most two suffixes. */
const char *fuzz_file(const uint8_t *data, size_t size, const char *suffix);

/* A directory in which the file of fuzz_file() is called `name`; one for each process, made by the
 * first call. */
const char *fuzz_dir(const char *file, const char *name);

/* Aborts unless a failed call left one line that says something, and names the file where `path` is not NULL. */
void fuzz_check_line(const struct err *e, const char *path);

/* Aborts with the line if `ok` is false. */
void fuzz_require(int ok, const char *what);

#endif
