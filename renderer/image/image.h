/* Image files: OpenEXR, PNG and Radiance, by libraries that load quickly. Other formats: image_oiio.h.
 * Pixels are float32, interleaved, row 0 at the top. */
#ifndef ASSAY_IMAGE_H
#define ASSAY_IMAGE_H

#include "renderer/base/err.h"

#include <stddef.h>
#include <stdint.h>

/* Text metadata of a file: owned by whoever filled it. */
struct image_attr {
    const char *name;
    const char *value;
};

struct image {
    int width, height, channels;
    char (*names)[32]; /* channels of them: "R", "G", "B", "M2.R", ... */
    float *data;       /* width*height*channels */
    char **attr;       /* num_attrs pairs: name, value, name, value, ... */
    int num_attrs;
};

/* Sets shape and names but leaves data NULL: the head for image_writer_open(). image_free() it. */
NODISCARD bool image_head(struct image *im, int width, int height, int channels,
                          const char *const *names, struct err *e);
/* A zeroed image of that shape; names are copied. Fails on sizes below 1 or out of memory. */
NODISCARD bool image_alloc(struct image *im, int width, int height, int channels,
                           const char *const *names, struct err *e);
void image_free(struct image *im);

/* Appends a text attribute (both copied). Fails only out of memory. */
NODISCARD bool image_set_attr(struct image *im, const char *name, const char *value, struct err *e);
/* The value of a text attribute or NULL. Owned by the image. */
const char *image_get_attr(const struct image *im, const char *name);
/* Index of a channel by exact name, -1 if absent. */
int image_channel(const struct image *im, const char *name);

/* Limits of the readers. */
enum { IMAGE_MAX_SIDE = 1 << 16, IMAGE_MAX_CHANNELS = 4096 };
#define IMAGE_MAX_FLOATS 4e9 /* 16384 x 16384 pixels of a dozen channels */
/* Most bytes of pixels per byte of file: deflate, the densest compression in use, packs 1032 into one. A header that
 * promises more is refused before memory is allocated. */
#define IMAGE_MAX_EXPANSION 1032

/* Reads an OpenEXR file (its first part; rows or tiles of halves or floats) with its text attributes.
 * Channels are in the file's order. *half (may be NULL): some channel has only 16 bits. The caller
 * frees *out with image_free(). */
NODISCARD bool image_read_exr(const char *path, struct image *out, bool *half, struct err *e);
/* The same row by row, for an image that need not be in memory as a whole. NULL with a line on failure. `path` must
 * stay valid until image_reader_close(). */
struct image_reader;
NODISCARD struct image_reader *image_reader_open(const char *path, struct err *e);
/* Shape, names and attributes, owned by the reader. After the last row the caller may copy the struct and zero it, and
 * then owns them. */
struct image *image_reader_head(struct image_reader *r);
bool image_reader_is_half(const struct image_reader *r);
/* Reads the next *num rows, as many as the file packs together: channel after channel within a row. They belong to the
 * reader and last until the next call. NULL with a line on failure. */
NODISCARD const float *image_reader_rows(struct image_reader *r, int *num, struct err *e);
void image_reader_close(struct image_reader *r);
/* Copies such rows to rows y .. y+num-1 of an image. */
void image_put_rows(struct image *im, int y, const float *rows, int num);
/* The header alone: data stays NULL. */
NODISCARD bool image_read_exr_head(const char *path, struct image *out, struct err *e);
/* Reads a Radiance image (RGBE, rows from the top) as R G B. */
NODISCARD bool image_read_hdr(const char *path, struct image *out, struct err *e);

/* Writes a float32, ZIP-compressed scan-line OpenEXR with all channels and attributes. The file
 * appears whole, by rename, or not at all. */
NODISCARD bool image_write_exr(const char *path, const struct image *im, struct err *e);

/* The same for an image that is never in memory as a whole: its rows are written from the top, IMAGE_BAND at a time,
 * the last ones as many as are left. The file appears when the writer is closed. */
enum { IMAGE_BAND = 16 };
struct image_writer;
/* head: shape, names and attributes; must stay unchanged until the writer is closed. NULL with a line on failure. */
NODISCARD struct image_writer *image_writer_open(const char *path, const struct image *head,
                                                 struct err *e);
NODISCARD bool image_writer_rows(struct image_writer *w, const float *rows, int num, struct err *e);
/* Both free the writer. Only close makes the file appear; after a failure of image_writer_rows(), call abandon. */
NODISCARD bool image_writer_close(struct image_writer *w, struct err *e);
void image_writer_abandon(struct image_writer *w);

/* Writes or encodes 8-bit RGB (3 bytes a pixel, row 0 at the top) as PNG. The encoded bytes belong
 * to the caller (free()). The file appears by rename. */
NODISCARD bool image_write_png(const char *path, int width, int height, const uint8_t *rgb8,
                               struct err *e);
NODISCARD bool image_encode_png(int width, int height, const uint8_t *rgb8, uint8_t **bytes,
                                size_t *size, struct err *e);
/* The same with texts (tEXt chunks, ASCII) before the pixels. */
NODISCARD bool image_write_png_texts(const char *path, int width, int height, const uint8_t *rgb8,
                                     const struct image_attr *attr, int num_attrs, struct err *e);

/* Text that names the libraries: "OpenEXR 3.1.5, libpng 1.6.39". */
const char *image_library_version(void);

#endif
