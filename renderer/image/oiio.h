/* The face of oiio.so (oiio.cc), the one part in C++: OpenImageIO's reader of one image at a time. For image_oiio.c, which finds
 * and loads it and decides what is read. No exception crosses this line; texts that say why are cut at `size`. */
#ifndef ASSAY_OIIO_H
#define ASSAY_OIIO_H

#include "image_oiio.h"

#define OIIO_TABLE "assay_oiio"

struct oiio_image; /* an open file */

struct oiio_table {
    const char *version;
    /* NULL with why: not an image of OpenImageIO's format of that name. straight: colours as stored, not times alpha. */
    struct oiio_image *(*open)(const char *path, const char *format, bool straight, char *why,
                               size_t size);
    void (*close)(struct oiio_image *p);
    /* All but `parts`. *depth: of a volume; *bytes: of the pixels as stored, unpacked. */
    bool (*head)(struct oiio_image *p, struct image_info *out, int *depth, double *bytes, char *why,
                 size_t size);
    const char *(*channel)(const struct oiio_image *p, int c);
    /* Row by row, data_width*data_height*channels floats. */
    bool (*read)(struct oiio_image *p, float *data, char *why, size_t size);
    /* Text number k of the file's metadata; false: there are no more. Texts are the image's. */
    bool (*text)(const struct oiio_image *p, int k, const char **name, const char **value);
    /* How many images the file holds; another of them may be current afterwards. */
    int (*parts)(struct oiio_image *p);
};

#endif
