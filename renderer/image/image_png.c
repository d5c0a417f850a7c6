#include "renderer/base/fs.h"
#include "image.h"

#include <openexr.h>
#include <errno.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>

/* For memory that it lacks libpng has many words, "too many text chunks" among them: errno, which is 0 before, knows better.
 * It comes back by longjmp() after this, so all that is to be freed lies with those who call the function with the setjmp(). */
static void failed(png_structp png, png_const_charp message)
{
    err_set(png_get_error_ptr(png), "%s", errno == ENOMEM ? "out of memory" : message);
    png_longjmp(png, 1);
}

/* A failure too, but told when libpng is done: for want of memory it may lose a text with no more than a warning. */
static void warned(png_structp png, png_const_charp message)
{
    struct err *why = png_get_error_ptr(png);
    if (why->msg[0] == '\0')
        err_set(why, "%s", errno == ENOMEM ? "out of memory" : message);
}

static png_text *texts_of(const struct image_attr *attr, int num)
{
    png_text *text = calloc((size_t)num + 1, sizeof *text);
    for (int i = 0; text != NULL && i < num; i++)
        text[i] = (png_text){.compression = PNG_TEXT_COMPRESSION_NONE,
                             .key = (char *)attr[i].name,
                             .text = (char *)attr[i].value,
                             .text_length = strlen(attr[i].value)};
    return text;
}

static bool write_to(png_structp png, png_infop info, FILE *f, int width, int height,
                     const uint8_t *rgb8, const png_text *text, int num)
{
    if (setjmp(png_jmpbuf(png)))
        return false;
    errno = 0;
    png_init_io(png, f);
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, 8, PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_set_text(png, info, text, num);
    png_write_info(png, info);
    for (int y = 0; y < height; y++)
        png_write_row(png, rgb8 + 3 * (size_t)y * (size_t)width);
    png_write_end(png, NULL);
    return true;
}

bool image_write_png_texts(const char *path, int width, int height, const uint8_t *rgb8,
                           const struct image_attr *attr, int num_attrs, struct err *e)
{
    struct out_file file;
    struct err why = {""};
    if (!out_open(&file, path, e))
        return false;
    png_text *text = texts_of(attr, num_attrs);
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &why, failed, warned);
    png_infop info = png != NULL ? png_create_info_struct(png) : NULL;
    bool ok = text != NULL && info != NULL &&
              write_to(png, info, file.f, width, height, rgb8, text, num_attrs);
    png_destroy_write_struct(&png, &info);
    free(text);
    if (ok && why.msg[0] == '\0')
        return out_commit(&file, e);
    out_abandon(&file);
    return err_set(e, "%s: cannot write: %s", path, why.msg[0] != '\0' ? why.msg : "out of memory");
}

bool image_write_png(const char *path, int width, int height, const uint8_t *rgb8, struct err *e)
{
    return image_write_png_texts(path, width, height, rgb8, NULL, 0, e);
}

bool image_encode_png(int width, int height, const uint8_t *rgb8, uint8_t **bytes, size_t *size,
                      struct err *e)
{
    png_image im = {.version = PNG_IMAGE_VERSION,
                    .width = (png_uint_32)width,
                    .height = (png_uint_32)height,
                    .format = PNG_FORMAT_RGB};
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
