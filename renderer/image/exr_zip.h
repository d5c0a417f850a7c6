/* Rows of an image to a chunk of OpenEXR's ZIP compression and back, in less than half the time that OpenEXR takes.
 * Noise hardly compresses, and OpenEXR took longer for it than a preview took to render. */
#ifndef ASSAY_EXR_ZIP_H
#define ASSAY_EXR_ZIP_H

#include <stddef.h>

struct exr_zip;

/* For chunks of up to `rows` rows of float32: to pack them, where from[k] is which channel of the image is the k-th of
 * the file (copied), or to unpack them, where `from` is NULL. Returns NULL if out of memory; exr_zip_free() the result. */
struct exr_zip *exr_zip_new(int width, int channels, const int *from, int rows);
void exr_zip_free(struct exr_zip *z);

/* Packs num rows of an interleaved image: channel after channel within a row, little endian; even bytes before odd
 * ones; differences of neighbours; zlib. Not packed if that is not shorter. Returns *size bytes, which belong to z and
 * last until the next call. [OpenEXR, "Scan Lines" and "ZIP compression"] */
const void *exr_zip_rows(struct exr_zip *z, const float *rows, int num, size_t *size);

/* Unpacks such a chunk of num rows: channel after channel within a row. They belong to z and last until the next call.
 * NULL: not a valid chunk. */
const float *exr_zip_unpack(struct exr_zip *z, const void *bytes, size_t size, int num);

#endif
