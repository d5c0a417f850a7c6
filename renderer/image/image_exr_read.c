/* OpenEXR files, read by the C interface of its own library, which loads in a millisecond. */
#define _GNU_SOURCE
#include "exr_zip.h"
#include "renderer/base/fs.h"
#include "image.h"

#include <assert.h>
#include <errno.h>
#include <openexr.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* What the library hands back to us: the open file, and its first complaint. */
struct stream {
    int fd;
    char why[200];
    bool no_memory; /* memory ran out for an attribute: OpenEXR drops it and goes on */
};

/* Only while reading: while writing, OpenEXR reports lack of memory with the context's lock held, and
 * exr_get_user_data() would wait for that lock forever. */
static void keep_complaint(exr_const_context_t f, exr_result_t code, const char *msg)
{
    void *s = NULL;
    if (f == NULL || exr_get_user_data(f, &s) != EXR_ERR_SUCCESS || s == NULL)
        return;
    struct stream *stream = s;
    stream->no_memory |= code == EXR_ERR_OUT_OF_MEMORY;
    if (stream->why[0] == '\0')
        snprintf(stream->why, sizeof stream->why, "%s", msg);
}

static int64_t read_at(exr_const_context_t f, void *s, void *buffer, uint64_t size, uint64_t offset,
                       exr_stream_error_func_ptr_t error)
{
    uint64_t done = 0;
    while (done < size) {
        ssize_t n = pread(((struct stream *)s)->fd, (char *)buffer + done, size - done,
                          (off_t)(offset + done));
        if (n < 0)
            return error(f, EXR_ERR_READ_IO, "%s", strerror(errno)), -1;
        if (n == 0)
            break;
        done += (uint64_t)n;
    }
    return (int64_t)done;
}

static int64_t size_of(exr_const_context_t f, void *s)
{
    (void)f;
    return lseek(((struct stream *)s)->fd, 0, SEEK_END);
}

static exr_context_initializer_t initializer(struct stream *s)
{
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = keep_complaint;
    init.user_data = s;
    init.read_fn = read_at;
    init.size_fn = size_of;
    init.max_image_width = init.max_image_height = IMAGE_MAX_SIDE;
    return init;
}

static bool failed(const char *path, const struct stream *s, exr_result_t code, struct err *e)
{
    return err_set(e, "%s: cannot read: %s", path,
                   s->why[0] != '\0' ? s->why : exr_get_default_error_message(code));
}

struct image_reader {
    const char *path;
    struct stream s;
    exr_context_t f;
    struct image head;
    bool half, tiled;
    int y, first_y;        /* the next row; the number of the first in the file */
    int band, across;      /* rows that are packed together; columns of a tile */
    float *rows;           /* room for one band */
    struct exr_zip *zip;   /* NULL: the library unpacks */
    unsigned char *packed; /* as many bytes as `rows` */
};

/* Reads shape and text attributes from the header. */
static bool read_header(struct image_reader *reader, struct err *e)
{
    exr_context_t f = reader->f;
    const struct stream *s = &reader->s;
    const char *path = reader->path;
    struct image *im = &reader->head;
    const exr_attr_chlist_t *list;
    exr_attr_box2i_t w;
    exr_storage_t storage;
    int32_t num_attrs;
    exr_result_t r = exr_get_channels(f, 0, &list);
    if (r == EXR_ERR_SUCCESS)
        r = exr_get_data_window(f, 0, &w);
    if (r == EXR_ERR_SUCCESS)
        r = exr_get_storage(f, 0, &storage);
    if (r == EXR_ERR_SUCCESS)
        r = exr_get_attribute_count(f, 0, &num_attrs);
    if (r != EXR_ERR_SUCCESS)
        return failed(path, s, r, e);
    if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED)
        return err_set(e, "%s: has deep pixels", path);
    int64_t width = (int64_t)w.max.x - w.min.x + 1, height = (int64_t)w.max.y - w.min.y + 1;
    int channels = list->num_channels;
    if (channels < 1 || channels > IMAGE_MAX_CHANNELS || width > IMAGE_MAX_SIDE ||
        height > IMAGE_MAX_SIDE || (double)width * (double)height * channels > IMAGE_MAX_FLOATS)
        return err_set(e, "%s: an image of %lld x %lld x %d is more than this program takes", path,
                       (long long)width, (long long)height, channels);
    const char *names[IMAGE_MAX_CHANNELS];
    double bytes = 0;
    for (int c = 0; c < channels; c++) {
        const exr_attr_chlist_entry_t *ch = &list->entries[c];
        names[c] = ch->name.str;
        reader->half |= ch->pixel_type == EXR_PIXEL_HALF;
        bytes += (double)width * (double)height * (ch->pixel_type == EXR_PIXEL_HALF ? 2 : 4);
        if (ch->pixel_type == EXR_PIXEL_UINT || ch->x_sampling != 1 || ch->y_sampling != 1 ||
            ch->name.length >= (int)sizeof im->names[0])
            return err_set(e, "%s: channel %.64s is not a float for each pixel", path, names[c]);
    }
    off_t size = lseek(s->fd, 0, SEEK_END);
    if (bytes > IMAGE_MAX_EXPANSION * (double)size)
        return err_set(e, "%s: an image of %lld x %lld x %d cannot be in %lld bytes", path,
                       (long long)width, (long long)height, channels, (long long)size);
    if (!image_head(im, (int)width, (int)height, channels, names, e))
        return err_prefix(e, "%s", path);
    reader->tiled = storage == EXR_STORAGE_TILED;
    reader->first_y = w.min.y;
    /* "type" describes the layout of the file, not the image, and the writer sets its own. */
    for (int i = 0; i < num_attrs; i++) {
        const exr_attribute_t *a;
        if (exr_get_attribute_by_index(f, 0, EXR_ATTR_LIST_FILE_ORDER, i, &a) == EXR_ERR_SUCCESS &&
            a->type == EXR_ATTR_STRING && strcmp(a->name, "type") != 0 &&
            !image_set_attr(im, a->name, a->string->str, e))
            return err_prefix(e, "%s", path);
    }
    return true;
}

/* Points the decoder's channels to their places in r->rows, for a chunk that begins at column x. */
static void point_channels(const struct image_reader *r, exr_coding_channel_info_t *c, int num,
                           int x)
{
    const int width = r->head.width;
    for (int k = 0; k < num; k++) {
        c[k].user_bytes_per_element = sizeof(float);
        c[k].user_data_type = EXR_PIXEL_FLOAT;
        c[k].user_pixel_stride = sizeof(float);
        c[k].user_line_stride = r->head.channels * width * (int32_t)sizeof(float);
        c[k].decode_to_ptr =
            (uint8_t *)(r->rows + image_channel(&r->head, c[k].channel_name) * width + x);
    }
}

static exr_result_t read_chunk(struct image_reader *r, const exr_chunk_info_t *chunk, int x)
{
    exr_decode_pipeline_t decoder = EXR_DECODE_PIPELINE_INITIALIZER;
    exr_result_t result = exr_decoding_initialize(r->f, 0, chunk, &decoder);
    if (result == EXR_ERR_SUCCESS) {
        point_channels(r, decoder.channels, decoder.channel_count, x);
        result = exr_decoding_choose_default_routines(r->f, 0, &decoder);
    }
    if (result == EXR_ERR_SUCCESS)
        result = exr_decoding_run(r->f, 0, &decoder);
    exr_decoding_destroy(r->f, &decoder);
    return result;
}

static exr_result_t read_tiles(struct image_reader *r)
{
    exr_chunk_info_t chunk;
    exr_result_t result = EXR_ERR_SUCCESS;
    for (int x = 0; result == EXR_ERR_SUCCESS && x < r->head.width; x += r->across) {
        result = exr_read_tile_chunk_info(r->f, 0, x / r->across, r->y / r->band, 0, 0, &chunk);
        if (result == EXR_ERR_SUCCESS)
            result = read_chunk(r, &chunk, x);
    }
    return result;
}

/* Reads the next num rows. Whatever exr_zip_unpack() cannot read is left to the library, which says what is wrong. */
static exr_result_t read_band(struct image_reader *r, int num, const float **rows)
{
    exr_chunk_info_t chunk;
    *rows = r->rows;
    if (r->tiled)
        return read_tiles(r);
    exr_result_t result = exr_read_scanline_chunk_info(r->f, 0, r->first_y + r->y, &chunk);
    if (result != EXR_ERR_SUCCESS)
        return result;
    const size_t room =
        (size_t)num * (size_t)r->head.width * (size_t)r->head.channels * sizeof *r->rows;
    if (r->zip != NULL && chunk.packed_size <= room &&
        exr_read_chunk(r->f, 0, &chunk, r->packed) == EXR_ERR_SUCCESS &&
        (*rows = exr_zip_unpack(r->zip, r->packed, chunk.packed_size, num)) != NULL)
        return EXR_ERR_SUCCESS;
    *rows = r->rows;
    return read_chunk(r, &chunk, 0);
}

/* Allocates the buffers for the rows. */
static exr_result_t start_reading(struct image_reader *r)
{
    exr_compression_t compression;
    exr_result_t result = exr_get_compression(r->f, 0, &compression);
    if (result == EXR_ERR_SUCCESS)
        result = r->tiled ? exr_get_tile_sizes(r->f, 0, 0, 0, &r->across, &r->band)
                          : exr_get_scanlines_per_chunk(r->f, 0, &r->band);
    if (result != EXR_ERR_SUCCESS)
        return result;
    const int rows = r->band < r->head.height ? r->band : r->head.height;
    const size_t floats = (size_t)rows * (size_t)r->head.width * (size_t)r->head.channels;
    const size_t bytes = floats * sizeof *r->rows;
    r->rows = malloc(bytes);
    bool ok = r->rows != NULL;
    if (ok && !r->tiled && !r->half &&
        (compression == EXR_COMPRESSION_ZIP || compression == EXR_COMPRESSION_ZIPS)) {
        r->packed = malloc(bytes);
        r->zip = exr_zip_new(r->head.width, r->head.channels, NULL, rows);
        ok = r->packed != NULL && r->zip != NULL;
    }
    return ok ? EXR_ERR_SUCCESS : EXR_ERR_OUT_OF_MEMORY;
}

static bool start(struct image_reader *r, bool pixels, struct err *e)
{
    exr_context_initializer_t init = initializer(&r->s);
    exr_result_t result = exr_start_read(&r->f, r->path, &init);
    if (result == EXR_ERR_SUCCESS && r->s.no_memory)
        result = EXR_ERR_OUT_OF_MEMORY;
    if (result == EXR_ERR_SUCCESS && !read_header(r, e))
        return false;
    if (result == EXR_ERR_SUCCESS && pixels)
        result = start_reading(r);
    return result == EXR_ERR_SUCCESS || failed(r->path, &r->s, result, e);
}

static struct image_reader *reader_open(const char *path, bool pixels, struct err *e)
{
    struct image_reader *r = calloc(1, sizeof *r);
    if (r == NULL) {
        err_set(e, "%s: out of memory", path);
        return NULL;
    }
    r->path = path;
    r->s.fd = fs_open_fd(path);
    if (r->s.fd < 0 ? !err_set(e, "%s: cannot read: %s", path, strerror(errno))
                    : !start(r, pixels, e)) {
        image_reader_close(r);
        return NULL;
    }
    return r;
}

struct image_reader *image_reader_open(const char *path, struct err *e)
{
    return reader_open(path, true, e);
}

void image_reader_close(struct image_reader *r)
{
    if (r == NULL)
        return;
    exr_finish(&r->f);
    if (r->s.fd >= 0)
        close(r->s.fd);
    image_free(&r->head);
    exr_zip_free(r->zip);
    free(r->rows);
    free(r->packed);
    free(r);
}

struct image *image_reader_head(struct image_reader *r)
{
    return &r->head;
}

bool image_reader_is_half(const struct image_reader *r)
{
    return r->half;
}

const float *image_reader_rows(struct image_reader *r, int *num, struct err *e)
{
    const float *rows;
    const int left = r->head.height - r->y;
    assert(left > 0);
    *num = r->band < left ? r->band : left;
    exr_result_t result = read_band(r, *num, &rows);
    r->y += *num;
    if (result == EXR_ERR_SUCCESS)
        return rows;
    failed(r->path, &r->s, result, e);
    return NULL;
}

void image_put_rows(struct image *im, int y, const float *rows, int num)
{
    const size_t width = (size_t)im->width, channels = (size_t)im->channels;
    for (size_t row = 0; row < (size_t)num; row++)
        for (size_t c = 0; c < channels; c++, rows += width) {
            float *out = im->data + ((size_t)y + row) * width * channels + c;
            for (size_t x = 0; x < width; x++)
                out[x * channels] = rows[x];
        }
}

bool image_read_exr(const char *path, struct image *out, bool *half, struct err *e)
{
    struct image_reader *r = image_reader_open(path, e);
    if (r == NULL)
        return false;
    struct image im = r->head;
    im.data = malloc((size_t)im.width * (size_t)im.height * (size_t)im.channels * sizeof *im.data);
    bool ok = im.data != NULL || err_set(e, "%s: out of memory for an image of %d x %d x %d", path,
                                         im.width, im.height, im.channels);
    for (int num = 0, y = 0; ok && y < im.height; y += num) {
        const float *rows = image_reader_rows(r, &num, e);
        ok = rows != NULL;
        if (ok)
            image_put_rows(&im, y, rows, num);
    }
    if (ok) {
        *out = im;
        r->head = (struct image){0};
        if (half != NULL)
            *half = r->half;
    } else {
        free(im.data);
    }
    image_reader_close(r);
    return ok;
}

bool image_read_exr_head(const char *path, struct image *out, struct err *e)
{
    struct image_reader *r = reader_open(path, false, e);
    if (r == NULL)
        return false;
    *out = r->head;
    r->head = (struct image){0};
    image_reader_close(r);
    return true;
}
