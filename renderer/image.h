/* The C face of image files (OpenImageIO behind it, image_oiio.cc). Pixels are float32,
 * interleaved, row 0 at the top. No C++ exception crosses this line. */
#ifndef ASSAY_IMAGE_H
#define ASSAY_IMAGE_H

#include "err.h"

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

/* A zeroed image of that shape; names are copied. Fails on sizes below 1 or out of memory. */
bool image_alloc(struct image *im, int width, int height, int channels, const char *const *names,
                 struct err *e) __attribute__((warn_unused_result));
void image_free(struct image *im);

/* Appends a text attribute (both copied). Fails only out of memory. */
bool image_set_attr(struct image *im, const char *name, const char *value, struct err *e)
    __attribute__((warn_unused_result));
/* The value of a text attribute or NULL. Owned by the image. */
const char *image_get_attr(const struct image *im, const char *name);
/* Index of a channel by exact name, -1 if absent. */
int image_channel(const struct image *im, const char *name);

/* Reads any file that OpenImageIO knows. Integer formats come scaled to [0,1], no colour
 * conversion. *half (may be NULL) tells if the file stored fewer than 32 bits per channel. */
bool image_read(const char *path, struct image *out, bool *half, struct err *e)
    __attribute__((warn_unused_result));

/* What a file stores, told by its header: for a reader that must know how exact the numbers are. */
enum image_type {
    IMAGE_INT8,
    IMAGE_INT16,
    IMAGE_HALF,
    IMAGE_FLOAT,
    IMAGE_OTHER /* fewer than 8 bits, 32-bit integers, doubles */
};
struct image_info {
    char format[16];      /* OpenImageIO's name: "openexr", "png", "hdr", "pnm" (PFM too), .. */
    enum image_type type; /* the smallest of its channels */
    int orientation;      /* as in Exif: 1 is row 0 at the top, from left to right */
    int parts;            /* pictures in one file (EXR parts, TIFF pages), 1 .. */
    int width, height, channels;
    bool is_cropped;      /* the file holds another rectangle than the picture shown */
};
bool image_inspect(const char *path, struct image_info *out, struct err *e)
    __attribute__((warn_unused_result));

/* Writes a float32, ZIP-compressed scan-line OpenEXR with all channels and attributes. The file
 * appears whole, by rename, or not at all. */
bool image_write_exr(const char *path, const struct image *im, struct err *e)
    __attribute__((warn_unused_result));

/* Writes or encodes 8-bit RGB (3 bytes a pixel, row 0 at the top) as PNG. The encoded bytes belong
 * to the caller (free()). The file appears by rename. */
bool image_write_png(const char *path, int width, int height, const uint8_t *rgb8, struct err *e)
    __attribute__((warn_unused_result));
bool image_encode_png(int width, int height, const uint8_t *rgb8, uint8_t **bytes, size_t *size,
                      struct err *e) __attribute__((warn_unused_result));

/* Text that names the libraries: "OpenImageIO 2.4.7". */
const char *image_library_version(void);

#endif
