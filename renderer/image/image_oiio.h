/* Images of other programs: PNG by libpng, all else by OpenImageIO. That library loads 230 others, which takes a fifth
 * of a second, so it is in a file of its own, oiio.so, which is loaded when the first such image is read; without it
 * the call fails with a line. */
#ifndef ASSAY_IMAGE_OIIO_H
#define ASSAY_IMAGE_OIIO_H

#include "image.h"
#include "renderer/base/fs.h"

/* Reads OpenEXR, Radiance, PNG, PFM and PNM, told by their first bytes. Integers are scaled to [0,1], without colour
 * conversion. Of OpenEXR the data window is read; texts of a PNG above 256 KiB are dropped. What exceeds the limits of
 * image.h is refused before pixels are read. *half (may be NULL): the file stores fewer than 32 bits per channel. The
 * caller frees *out with image_free(). */
NODISCARD bool image_read(const char *path, struct image *out, bool *half, struct err *e);

/* Reads the colours of an OpenEXR, PNG, JPEG, Radiance or (by its name's ending) Targa file as channels R, G and B of
 * linear light: for textures. Grey is spread to the three, alpha is left out. OpenEXR and Radiance are linear; PNG is
 * sRGB, or what its gAMA chunk says; JPEG and Targa are sRGB [IEC 61966-2-1]. Refuses more than IMAGE_MAX_TEXELS pixels. */
enum { IMAGE_MAX_TEXELS = 1 << 26 };
NODISCARD bool image_read_colours(const char *path, struct image *out, struct err *e);

/* What a file stores, told by its header: for a reader that must know how exact the numbers are. */
#define IMAGE_SRGB 0.0
enum image_type {
    IMAGE_INT8,
    IMAGE_INT16,
    IMAGE_HALF,
    IMAGE_FLOAT,
    IMAGE_OTHER /* fewer than 8 bits, 32-bit integers, doubles */
};
struct image_info {
    char format[16];      /* OpenImageIO's name: "openexr", "png", "hdr", "pnm" (PFM too), .. */
    enum image_type type; /* of the narrowest channel */
    int bytes;            /* per value of that channel */
    double power;    /* exponent that makes stored numbers linear, or IMAGE_SRGB; for textures */
    int orientation; /* as in Exif: 1 is row 0 at the top, from left to right */
    int parts;       /* images in one file (EXR parts), 1 .. */
    int width, height, channels; /* of OpenEXR: of the display window */
    bool is_cropped;             /* the file holds another rectangle than the image, this: */
    int data_x, data_y, data_width, data_height; /* from the image's top left corner */
};
NODISCARD bool image_inspect(const char *path, struct image_info *out, struct err *e);

/* Turns the rectangle that image_read() returned into the whole displayed image: 0 in all channels where the file has
 * nothing, without pixels outside. */
NODISCARD bool image_uncrop(const struct image_info *info, struct image *im, struct err *e);

/* The path of oiio.so. False with a line, and where it should be, if it is not there. */
NODISCARD bool image_oiio_file(struct path *path, struct err *e);

/* Text that names the library: "OpenImageIO 2.4.7"; NULL with a line if it cannot be loaded. */
const char *image_oiio_version(struct err *e);

#endif
