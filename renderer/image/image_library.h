/* A library that reads images: libpng (image_png.c), or OpenImageIO for all else (oiio.cc, the one part in C++, in a shared
 * object of its own). image_oiio.c decides which reads what. No exception crosses this interface; texts that say why are cut
 * at `size`. */
#ifndef ASSAY_IMAGE_LIBRARY_H
#define ASSAY_IMAGE_LIBRARY_H

#include "image_oiio.h"

struct library_image; /* an open file */

struct image_library {
    const char *version;
    /* NULL with why: not an image of OpenImageIO's format of that name. straight: colours as stored, not times alpha; PNG's
     * always are. */
    struct library_image *(*open)(const char *path, const char *format, bool straight, char *why,
                                  size_t size);
    void (*close)(struct library_image *p);
    /* All but `parts`. *depth: of a volume; *bytes: of the pixels as stored, unpacked. */
    bool (*head)(struct library_image *p, struct image_info *out, int *depth, double *bytes,
                 char *why, size_t size);
    const char *(*channel)(const struct library_image *p, int c);
    /* Row by row, data_width*data_height*channels floats; once. */
    bool (*read)(struct library_image *p, float *data, char *why, size_t size);
    /* Text number k of the file's metadata; false: there are no more. Texts are the image's. */
    bool (*text)(const struct library_image *p, int k, const char **name, const char **value);
    /* How many images the file holds; another of them may be current afterwards. */
    int (*parts)(struct library_image *p);
};

/* Loaded from oiio.so by this name. */
#define IMAGE_LIBRARY_OIIO "assay_oiio"
extern const struct image_library image_png_library;

#endif
