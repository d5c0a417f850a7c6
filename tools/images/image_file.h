/* Reads an image file of any engine as RGB radiance (or code values), with the checks that every kind of
 * input needs. No colour conversion, no guesses: what is not understood is refused with a line. */
#ifndef ASSAY_IMAGE_FILE_H
#define ASSAY_IMAGE_FILE_H

#include "renderer/image/image_oiio.h"

struct image_file {
    int width, height;
    float *rgb; /* 3 per pixel, row 0 at the top; of an integer file, codes over the largest code */
    struct image_info info;
    int num_other; /* channels of the file that are ignored */
    double spp;    /* paths per pixel, mean over the image, of a moments EXR; else 0, not known */
};

/* EXR, HDR (RGBE), PFM, and PNG or PPM of 8 or 16 bits. Channels R, G, B, or Y alone for all three; A only
 * where it is 1 everywhere. An EXR whose data and display windows differ is the image shown (image_uncrop()).
 * Fails on other formats and channels, on a rotated or otherwise cropped image, on
 * several images in one file, on NaN and infinity. The caller frees with image_file_free(). */
NODISCARD bool image_file_read(const char *path, struct image_file *out, struct err *e);
/* The same for a file that image_inspect() has read already, which saves opening it again. */
NODISCARD bool image_file_read_inspected(const char *path, const struct image_info *info,
                                         struct image_file *out, struct err *e);
/* The same from an image that is already read, and uncropped. */
NODISCARD bool image_file_from_image(const char *path, const struct image *im,
                                     const struct image_info *info, struct image_file *out,
                                     struct err *e);
void image_file_free(struct image_file *p);

#endif
