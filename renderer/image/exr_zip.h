/* Rows of an image as a chunk of OpenEXR's ZIP, and back: what its library would make of them, in less than half the time.
 * Noise hardly compresses, and that took it longer than a preview took to render. */
#ifndef ASSAY_EXR_ZIP_H
#define ASSAY_EXR_ZIP_H

#include <stddef.h>

struct exr_zip;

/* For chunks of up to `rows` rows of float32. from[k]: the channel of the image that is the file's k-th; copied, and
 * NULL where chunks are only read. NULL: out of memory. */
struct exr_zip *exr_zip_new(int width, int channels, const int *from, int rows);
void exr_zip_free(struct exr_zip *z);

/* num rows of an image, interleaved: channel after channel within a row, little endian; bytes at even places before
 * those at odd places; differences of neighbours; zlib. As they are where that is not shorter. The bytes belong to z
 * and last until the next call; *size is how many. [OpenEXR, "Scan Lines" and "ZIP compression"] */
const void *exr_zip_rows(struct exr_zip *z, const float *rows, int num, size_t *size);

/* The num rows that such a chunk holds as they lie in it: channel after channel within a row. They belong to z and last
 * until the next call. NULL: not a valid chunk. */
const float *exr_zip_unpack(struct exr_zip *z, const void *bytes, size_t size, int num);

#endif
