/* A library that reads images: libpng (image_png.c), or OpenImageIO for all else (oiio.cc, the one part in C++, in a shared
 * object of its own). image_oiio.c decides which reads what. No exception crosses this interface; error texts `why` are
 * cut at `size` bytes. */
#ifndef ASSAY_IMAGE_LIBRARY_H
#define ASSAY_IMAGE_LIBRARY_H

#include "image_oiio.h"

struct library_image; /* an open file */

struct image_library {
    const char *version;
    /* Opens a file of the format of that name in OpenImageIO; NULL with `why` if it is none. straight: colours are not
     * multiplied by alpha, as those of PNG never are. */
    struct library_image *(*open)(const char *path, const char *format, bool straight, char *why,
                                  size_t size);
    void (*close)(struct library_image *p);
    /* Fills all of *out but `parts`. *depth: slices of a volume; *bytes: size of the stored pixels, uncompressed. */
    bool (*head)(struct library_image *p, struct image_info *out, int *depth, double *bytes,
                 char *why, size_t size);
    const char *(*channel)(const struct library_image *p, int c);
    /* Reads data_width*data_height*channels floats, row by row. To be called once. */
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
