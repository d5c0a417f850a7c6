/* PNG files by libpng: 8 bits are written, 8 and 16 bits read. */
#include "image_library.h"
#include "renderer/base/fs.h"

#include <openexr.h>
#include <assert.h>
#include <errno.h>
#include <math.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>

/* libpng reports lack of memory in many words, "too many text chunks" among them; errno, cleared before, is reliable.
 * longjmp() follows, so everything that must be freed belongs to the callers of the function with the setjmp(). */
static void failed(png_structp png, png_const_charp message)
{
    err_set(png_get_error_ptr(png), "%s", errno == ENOMEM ? "out of memory" : message);
    png_longjmp(png, 1);
}

/* While writing a warning is a failure too, reported when libpng is done: it may drop a text for lack of memory with no
 * more than a warning. */
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
    const int wrong = !ok && ferror(file.f) != 0 ? errno : 0; /* libpng says "Write Error" */
    png_destroy_write_struct(&png, &info);
    free(text);
    if (ok && why.msg[0] == '\0')
        return out_commit(&file, e);
    out_abandon(&file);
    return err_set(e, "%s: cannot write: %s", path,
                   wrong != 0           ? strerror(wrong)
                   : why.msg[0] != '\0' ? why.msg
                                        : "out of memory");
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

struct library_image {
    FILE *f;
    png_structp png;
    png_infop info;
    struct err why;
    size_t left;  /* bytes that may still be read of the file */
    int channels; /* after expansion */
};

enum {
    MAX_TEXTS = 200,
    MAX_CHUNK = 1 << 18, /* bytes of an inflated text or profile; libpng drops longer ones */
    MAX_BLOCK = 1 << 23  /* more than a row; libpng allocates a chunk's stated length unread */
};

static void read_bytes(png_structp png, png_bytep to, size_t size)
{
    struct library_image *p = png_get_io_ptr(png);
    if (size > p->left)
        png_error(png, "its data are more than its pixels");
    p->left -= size;
    if (fread(to, 1, size, p->f) != size)
        png_error(png, "the file ends within one of its chunks");
}

static png_voidp get_block(png_structp png, png_alloc_size_t size)
{
    if (size > MAX_BLOCK)
        png_error(png, "one of its chunks is too long");
    return malloc(size);
}

static void free_block(png_structp png, png_voidp block)
{
    (void)png;
    free(block);
}

/* Warnings while reading concern metadata and are ignored, unless memory ran out: the gamma may have been lost then. */
static void pardoned(png_structp png, png_const_charp message)
{
    if (errno == ENOMEM)
        failed(png, message);
}

/* Orientation from Exif data, which have the form of TIFF: the 16-bit value of tag 0x112 in the first directory [TIFF
 * 6.0, 2]; 1 if there is none. */
static int orientation_of(const uint8_t *exif, size_t size)
{
    const bool little = size >= 8 && exif[0] == 'I';
#define SHORT(at) ((size_t)exif[(at) + !little] | (size_t)exif[(at) + little] << 8)
    if (size < 8)
        return 1;
    size_t at = little ? SHORT(4) | SHORT(6) << 16 : SHORT(4) << 16 | SHORT(6);
    for (size_t k = 0; at + 2 <= size && k < SHORT(at) && at + 2 + 12 * (k + 1) <= size; k++)
        if (SHORT(at + 2 + 12 * k) == 0x112)
            return (int)SHORT(at + 2 + 12 * k + 8);
    return 1;
#undef SHORT
}

static void close_png(struct library_image *p)
{
    png_destroy_read_struct(&p->png, &p->info, NULL);
    if (p->f != NULL)
        fclose(p->f);
    free(p);
}

static bool read_chunks(struct library_image *p)
{
    if (setjmp(png_jmpbuf(p->png)))
        return false;
    png_set_user_limits(p->png, PNG_UINT_31_MAX, PNG_UINT_31_MAX); /* the caller checks its own */
    png_set_chunk_malloc_max(p->png, MAX_CHUNK);
    png_set_chunk_cache_max(p->png, MAX_TEXTS);
    png_set_read_fn(p->png, p, read_bytes);
    png_read_info(p->png, p->info);
    return true;
}

static struct library_image *open_png(const char *path, const char *format, bool straight,
                                      char *why, size_t size)
{
    (void)format, (void)straight;
    struct library_image *p = calloc(1, sizeof *p);
    if (p != NULL && (p->f = fs_open(path)) != NULL) {
        p->left = SIZE_MAX;
        errno = 0;
        p->png = png_create_read_struct_2(PNG_LIBPNG_VER_STRING, &p->why, failed, pardoned, NULL,
                                          get_block, free_block);
        p->info = p->png != NULL ? png_create_info_struct(p->png) : NULL;
        if (p->info != NULL && read_chunks(p))
            return p;
    }
    snprintf(why, size, "cannot read: %s",
             p != NULL && p->why.msg[0] != '\0' ? p->why.msg : strerror(errno));
    if (p != NULL)
        close_png(p);
    return NULL;
}

/* sRGB and a profile win over gAMA [PNG 11.3.3]. */
static double power_of(const struct library_image *p)
{
    png_fixed_point gamma;
    if (png_get_valid(p->png, p->info, PNG_INFO_sRGB | PNG_INFO_iCCP) != 0 ||
        png_get_gAMA_fixed(p->png, p->info, &gamma) == 0)
        return IMAGE_SRGB;
    return 1e5 / fmax(1, (double)gamma);
}

/* Describes the image after expansion: palettes become colours, fewer than 8 bits become 8, transparency becomes a
 * channel. */
static bool head_of(struct library_image *p, struct image_info *out, int *depth, double *bytes,
                    char *why, size_t size)
{
    (void)why, (void)size;
    png_uint_32 exif_size;
    png_bytep exif;
    bool wide = png_get_bit_depth(p->png, p->info) == 16;
    p->channels = (png_get_color_type(p->png, p->info) == PNG_COLOR_TYPE_PALETTE
                       ? 3
                       : png_get_channels(p->png, p->info)) +
                  (png_get_valid(p->png, p->info, PNG_INFO_tRNS) != 0);
    *out = (struct image_info){.format = "png",
                               .type = wide ? IMAGE_INT16 : IMAGE_INT8,
                               .bytes = wide ? 2 : 1,
                               .power = power_of(p),
                               .orientation = 1,
                               .width = (int)png_get_image_width(p->png, p->info),
                               .height = (int)png_get_image_height(p->png, p->info),
                               .channels = p->channels};
    out->data_width = out->width;
    out->data_height = out->height;
    if (png_get_eXIf_1(p->png, p->info, &exif_size, &exif) != 0)
        out->orientation = orientation_of(exif, exif_size);
    *depth = 1;
    *bytes = (double)out->width * out->height * out->channels * out->bytes;
    return true;
}

static const char *channel_of(const struct library_image *p, int c)
{
    static const char *const grey[] = {"Y", "A"}, *const colours[] = {"R", "G", "B", "A"};
    return (p->channels < 3 ? grey : colours)[c];
}

/* Compressed data are at most twice as long as what they inflate to. Up to the last row libpng reads no more than it
 * needs; then it would inflate all that is left, up to a thousand times the size of the file, so the limit is lowered.
 * Each pass of an interlaced file fills some pixels of the rows. */
static bool read_rows(struct library_image *p, uint8_t *rows, size_t size, png_uint_32 height)
{
    if (setjmp(png_jmpbuf(p->png)))
        return false;
    errno = 0;
    png_set_expand(p->png);
    int passes = png_set_interlace_handling(p->png);
    png_read_update_info(p->png, p->info);
    assert(png_get_rowbytes(p->png, p->info) == size);
    p->left = 2 * size * height + (1 << 16);
    for (int pass = 0; pass < passes; pass++)
        for (png_uint_32 y = 0; y < height; y++) {
            if (pass == passes - 1 && y == height - 1)
                p->left = 2 * size + (1 << 16);
            png_read_row(p->png, rows + size * y, NULL);
        }
    return true;
}

static bool read_png(struct library_image *p, float *data, char *why, size_t size)
{
    const png_uint_32 height = png_get_image_height(p->png, p->info);
    const bool wide = png_get_bit_depth(p->png, p->info) == 16;
    const size_t row = (size_t)png_get_image_width(p->png, p->info) * (size_t)p->channels,
                 n = row * height;
    uint8_t *b = malloc(n << wide);
    bool ok = b != NULL && read_rows(p, b, row << wide, height);
    for (size_t i = 0; ok && i < n; i++)
        data[i] = wide ? (float)(b[2 * i] << 8 | b[2 * i + 1]) * (1.0F / 65535)
                       : (float)b[i] * (1.0F / 255);
    if (!ok)
        snprintf(why, size, "cannot read: %s", b != NULL ? p->why.msg : "out of memory");
    free(b);
    return ok;
}

static bool text_of(const struct library_image *p, int k, const char **name, const char **value)
{
    png_textp text;
    int num = 0;
    png_get_text(p->png, p->info, &text, &num);
    if (k >= num)
        return false;
    *name = text[k].key;
    *value = text[k].text;
    return true;
}

static int parts_of(struct library_image *p)
{
    (void)p;
    return 1;
}

const struct image_library image_png_library = {"libpng " PNG_LIBPNG_VER_STRING,
                                                open_png,
                                                close_png,
                                                head_of,
                                                channel_of,
                                                read_png,
                                                text_of,
                                                parts_of};

const char *image_library_version(void)
{
    return "OpenEXR " OPENEXR_VERSION_STRING ", libpng " PNG_LIBPNG_VER_STRING;
}
