#include "fs.h"
#include "image.h"

#include <openexr.h>
#include <png.h>
#include <stdlib.h>

static png_image header(int width, int height)
{
    return (png_image){.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)width,
                       .height = (png_uint_32)height,
                       .format = PNG_FORMAT_RGB};
}

bool image_write_png(const char *path, int width, int height, const uint8_t *rgb8, struct err *e)
{
    struct out_file file;
    png_image im = header(width, height);
    if (!out_open(&file, path, e))
        return false;
    if (png_image_write_to_stdio(&im, file.f, 0, rgb8, 0, NULL))
        return out_commit(&file, e);
    out_abandon(&file);
    return err_set(e, "%s: cannot write: %s", path, im.message);
}

bool image_encode_png(int width, int height, const uint8_t *rgb8, uint8_t **bytes, size_t *size,
                      struct err *e)
{
    png_image im = header(width, height);
    png_alloc_size_t room = PNG_IMAGE_PNG_SIZE_MAX(im);
    *bytes = malloc(room);
    if (*bytes == NULL)
        return err_set(e, "PNG in memory: out of memory");
    if (!png_image_write_to_memory(&im, *bytes, &room, 0, rgb8, 0, NULL)) {
        free(*bytes);
        return err_set(e, "PNG in memory: %s", im.message);
    }
    *size = room;
    return true;
}

const char *image_library_version(void)
{
    return "OpenEXR " OPENEXR_VERSION_STRING ", libpng " PNG_LIBPNG_VER_STRING;
}
