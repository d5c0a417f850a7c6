#include "renderer/base/fs.h"
#include "image.h"

#include <errno.h>
#include <openexr.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>

/* libpng comes back by longjmp() after this, so all that is to be freed lies with those who call the function with the setjmp(). */
static void failed(png_structp png, png_const_charp message)
{
    err_set(png_get_error_ptr(png), "%s", message);
    png_longjmp(png, 1);
}

/* A failure too, but told when libpng is done: for want of memory it may lose a text with no more than a warning. */
static void warned(png_structp png, png_const_charp message)
{
    struct err *why = png_get_error_ptr(png);
    if (why->msg[0] == '\0')
        err_set(why, "%s", message);
}

/* The line about a file, of what is known of why. */
static bool refuse(const char *path, const char *verb, const struct err *why, struct err *e)
{
    return err_set(e, "%s: cannot %s: %s", path, verb,
                   why->msg[0] != '\0' ? why->msg : "out of memory");
}

/* Texts with other letters than ASCII have to say that they are UTF-8. */
static bool is_ascii(const char *text)
{
    while (*text != '\0' && (unsigned char)*text < 128)
        text++;
    return *text == '\0';
}

static png_text *texts_of(const struct image_attr *attr, int num)
{
    png_text *text = calloc((size_t)num + 1, sizeof *text);
    for (int i = 0; text != NULL && i < num; i++) {
        bool ascii = is_ascii(attr[i].value);
        size_t n = strlen(attr[i].value);
        text[i] =
            (png_text){.compression = ascii ? PNG_TEXT_COMPRESSION_NONE : PNG_ITXT_COMPRESSION_NONE,
                       .key = (char *)attr[i].name,
                       .text = (char *)attr[i].value,
                       .text_length = ascii ? n : 0,
                       .itxt_length = ascii ? 0 : n};
    }
    return text;
}

static bool write_to(png_structp png, png_infop info, FILE *f, int width, int height,
                     const uint8_t *rgb8, const png_text *text, int num)
{
    if (setjmp(png_jmpbuf(png)))
        return false;
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
    return refuse(path, "write", &why, e);
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

enum { SIGNATURE = 8 };

bool image_is_png(const char *path)
{
    png_byte start[SIGNATURE];
    FILE *f = fopen(path, "rb");
    bool is = f != NULL && fread(start, 1, SIGNATURE, f) == SIGNATURE &&
              png_sig_cmp(start, 0, SIGNATURE) == 0;
    if (f != NULL)
        fclose(f);
    return is;
}

/* Head and size of the file -> an image of that size. */
static bool begin(png_structp png, png_infop info, long bytes, struct image *im, struct err *e)
{
    static const char *const names[] = {"R", "G", "B"};
    png_uint_32 width = png_get_image_width(png, info), height = png_get_image_height(png, info);
    if (png_get_bit_depth(png, info) != 8 || png_get_color_type(png, info) != PNG_COLOR_TYPE_RGB ||
        png_get_interlace_type(png, info) != PNG_INTERLACE_NONE)
        return err_set(e, "not 8-bit RGB in rows, as pathtracer writes it");
    if (3.0 * width * height > (double)IMAGE_MAX_EXPANSION * (double)bytes)
        return err_set(e, "%lu x %lu pixels do not fit into a file of %ld bytes",
                       (unsigned long)width, (unsigned long)height, bytes);
    return image_alloc(im, (int)width, (int)height, 3, names, e);
}

static bool read_rows(png_structp png, png_infop info, uint8_t *row, struct image *im)
{
    if (setjmp(png_jmpbuf(png)))
        return false;
    size_t num = 3 * (size_t)im->width;
    for (int y = 0; y < im->height; y++) {
        png_read_row(png, row, NULL);
        for (size_t i = 0; i < num; i++)
            im->data[(size_t)y * num + i] = row[i];
    }
    png_read_end(png, info);
    return true;
}

static bool read_head(png_structp png, png_infop info, FILE *f)
{
    if (setjmp(png_jmpbuf(png)))
        return false;
    png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
    png_set_user_limits(png, IMAGE_MAX_SIDE, IMAGE_MAX_SIDE);
    png_init_io(png, f);
    png_read_info(png, info);
    return true;
}

static bool read_texts(png_structp png, png_infop info, struct image *im, struct err *e)
{
    png_textp text = NULL;
    int num = 0;
    png_get_text(png, info, &text, &num);
    for (int i = 0; i < num; i++)
        if (!image_set_attr(im, text[i].key, text[i].text, e))
            return false;
    return true;
}

bool image_read_png(const char *path, struct image *out, struct err *e)
{
    struct err why = {""};
    *out = (struct image){0};
    FILE *f = fopen(path, "rb");
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    long bytes = fseek(f, 0, SEEK_END) == 0 ? ftell(f) : -1;
    rewind(f);
    uint8_t *row = NULL;
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &why, failed, warned);
    png_infop info = png != NULL ? png_create_info_struct(png) : NULL;
    bool ok = info != NULL && read_head(png, info, f) && begin(png, info, bytes, out, &why);
    ok = ok && ((row = malloc(3 * (size_t)out->width)) != NULL || err_set(&why, "out of memory")) &&
         read_rows(png, info, row, out) && read_texts(png, info, out, &why);
    png_destroy_read_struct(&png, &info, NULL);
    free(row);
    fclose(f);
    if (ok && why.msg[0] == '\0')
        return true;
    image_free(out);
    return refuse(path, "read", &why, e);
}

const char *image_library_version(void)
{
    return "OpenEXR " OPENEXR_VERSION_STRING ", libpng " PNG_LIBPNG_VER_STRING;
}
