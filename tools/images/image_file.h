/* A picture file of any engine as RGB radiance (or code values), with the hygiene that every kind of
 * input needs. No colour conversion, no guesses: what is not understood is refused with a line. */
#ifndef ASSAY_IMAGE_FILE_H
#define ASSAY_IMAGE_FILE_H

#include "reference/base/image_oiio.h"

struct picture {
    int width, height;
    float *rgb; /* 3 per pixel, row 0 at the top; of an integer file its codes over the largest */
    struct image_info info;
    int num_other; /* channels of the file that are not looked at */
};

/* EXR, HDR (RGBE), PFM, and PNG of 8 or 16 bits. Channels R, G, B, or Y alone for all three; A only
 * where it is 1 everywhere. Fails on other formats and channels, on a rotated or cropped picture, on
 * several pictures in one file, on NaN and infinity. The caller frees with picture_free(). */
bool picture_read(const char *path, struct picture *out, struct err *e)
    __attribute__((warn_unused_result));
/* The same of a file that image_inspect() has looked at, so that it is opened once less. */
bool picture_read_inspected(const char *path, const struct image_info *info, struct picture *out,
                            struct err *e) __attribute__((warn_unused_result));
/* The same from an image that is already read. */
bool picture_from_image(const char *path, const struct image *im, const struct image_info *info,
                        struct picture *out, struct err *e) __attribute__((warn_unused_result));
void picture_free(struct picture *p);

#endif
