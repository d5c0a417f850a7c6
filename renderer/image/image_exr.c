/* OpenEXR files through the C interface of its own library, which loads in a millisecond. */
#define _GNU_SOURCE
#include "exr_zip.h"
#include "renderer/base/fs.h"
#include "image.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <openexr.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* What the library hands back to us: the open file, and its first complaint. */
struct stream {
    int fd;
    char why[200];
    bool no_memory; /* for a text of the header: OpenEXR leaves it out and goes on */
};

/* Only while reading: a file that is written holds its lock where memory runs out, and asking it for our data would
 * wait for that forever. */
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

static void drop_complaint(exr_const_context_t f, exr_result_t code, const char *msg)
{
    (void)f;
    (void)code;
    (void)msg;
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

static int64_t write_at(exr_const_context_t f, void *s, const void *buffer, uint64_t size,
                        uint64_t offset, exr_stream_error_func_ptr_t error)
{
    uint64_t done = 0;
    while (done < size) {
        ssize_t n = pwrite(((struct stream *)s)->fd, (const char *)buffer + done, size - done,
                           (off_t)(offset + done));
        if (n <= 0) {
            struct stream *stream = s;
            snprintf(stream->why, sizeof stream->why, "%s", strerror(n < 0 ? errno : EIO));
            return error(f, EXR_ERR_WRITE_IO, "%s", stream->why), -1;
        }
        done += (uint64_t)n;
    }
    return (int64_t)done;
}

static exr_context_initializer_t initializer(struct stream *s)
{
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = keep_complaint;
    init.user_data = s;
    init.read_fn = read_at;
    init.size_fn = size_of;
    init.write_fn = write_at;
    init.max_image_width = init.max_image_height = IMAGE_MAX_SIDE;
    return init;
}

static bool failed(const char *path, const char *what, const struct stream *s, exr_result_t code,
                   struct err *e)
{
    return err_set(e, "%s: cannot %s: %s", path, what,
                   s->why[0] != '\0' ? s->why : exr_get_default_error_message(code));
}

/* Where the pixels of each channel of a chunk go in the interleaved image: the first is number
 * `at`. */
static void point_channels(exr_coding_channel_info_t *c, int num, const struct image *im, size_t at)
{
    for (int k = 0; k < num; k++) {
        c[k].user_bytes_per_element = sizeof(float);
        c[k].user_data_type = EXR_PIXEL_FLOAT;
        c[k].user_pixel_stride = im->channels * (int32_t)sizeof(float);
        c[k].user_line_stride = im->width * c[k].user_pixel_stride;
        c[k].decode_to_ptr = (uint8_t *)(im->data + at * (size_t)im->channels +
                                         image_channel(im, c[k].channel_name));
    }
}

static exr_result_t write_header(exr_context_t f, const struct image *im)
{
    int part;
    exr_result_t r = exr_add_part(f, NULL, EXR_STORAGE_SCANLINE, &part);
    if (r == EXR_ERR_SUCCESS)
        r = exr_initialize_required_attr_simple(f, part, im->width, im->height,
                                                EXR_COMPRESSION_ZIP);
    for (int c = 0; r == EXR_ERR_SUCCESS && c < im->channels; c++)
        r = exr_add_channel(f, part, im->names[c], EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LOGARITHMIC, 1,
                            1);
    for (int i = 0; r == EXR_ERR_SUCCESS && i < im->num_attrs; i++)
        r = exr_attr_set_string(f, part, im->attr[2 * i], im->attr[2 * i + 1]);
    return r == EXR_ERR_SUCCESS ? exr_write_header(f) : r;
}

struct image_writer {
    const struct image *head;
    struct out_file file;
    struct stream s;
    exr_context_t f;
    struct exr_zip *zip;
    int y; /* the next row */
};

/* What packs the rows: by the order of channels in the file. */
static exr_result_t start_rows(struct image_writer *w)
{
    const exr_attr_chlist_t *list;
    int32_t rows;
    exr_result_t r = exr_get_scanlines_per_chunk(w->f, 0, &rows);
    if (r == EXR_ERR_SUCCESS)
        r = exr_get_channels(w->f, 0, &list);
    int *from = malloc((size_t)w->head->channels * sizeof *from);
    if (r == EXR_ERR_SUCCESS && from != NULL) {
        assert(rows == IMAGE_BAND);
        for (int k = 0; k < w->head->channels; k++)
            from[k] = image_channel(w->head, list->entries[k].name.str);
        w->zip = exr_zip_new(w->head->width, w->head->channels, from, rows);
    }
    free(from);
    return r == EXR_ERR_SUCCESS && w->zip == NULL ? EXR_ERR_OUT_OF_MEMORY : r;
}

struct image_writer *image_writer_open(const char *path, const struct image *head, struct err *e)
{
    struct image_writer *w = calloc(1, sizeof *w);
    if (w == NULL) {
        err_set(e, "%s: out of memory", path);
        return NULL;
    }
    if (!out_open(&w->file, path, e)) {
        free(w);
        return NULL;
    }
    w->head = head;
    w->s.fd = fileno(w->file.f);
    exr_context_initializer_t init = initializer(&w->s);
    init.error_handler_fn = drop_complaint;
    exr_result_t r = exr_start_write(&w->f, path, EXR_WRITE_FILE_DIRECTLY, &init);
    if (r == EXR_ERR_SUCCESS)
        r = write_header(w->f, head);
    if (r == EXR_ERR_SUCCESS)
        r = start_rows(w);
    if (r == EXR_ERR_SUCCESS)
        return w;
    failed(path, "write", &w->s, r, e);
    image_writer_abandon(w);
    return NULL;
}

bool image_writer_rows(struct image_writer *w, const float *rows, int num, struct err *e)
{
    size_t size;
    assert(w->y + num <= w->head->height);
    assert(num == IMAGE_BAND || w->y + num == w->head->height);
    const void *bytes = exr_zip_rows(w->zip, rows, num, &size);
    exr_result_t r = exr_write_scanline_chunk(w->f, 0, w->y, bytes, size);
    w->y += num;
    return r == EXR_ERR_SUCCESS || failed(w->file.path, "write", &w->s, r, e);
}

bool image_writer_close(struct image_writer *w, struct err *e)
{
    assert(w->y == w->head->height);
    exr_result_t r = exr_finish(&w->f); /* writes the table of rows */
    bool ok = r == EXR_ERR_SUCCESS;
    if (ok) {
        ok = out_commit(&w->file, e);
    } else {
        failed(w->file.path, "write", &w->s, r, e);
        out_abandon(&w->file);
    }
    exr_zip_free(w->zip);
    free(w);
    return ok;
}

void image_writer_abandon(struct image_writer *w)
{
    if (w == NULL)
        return;
    exr_finish(&w->f);
    out_abandon(&w->file);
    exr_zip_free(w->zip);
    free(w);
}

bool image_write_exr(const char *path, const struct image *im, struct err *e)
{
    struct image_writer *w = image_writer_open(path, im, e);
    if (w == NULL)
        return false;
    for (int y = 0; y < im->height; y += IMAGE_BAND) {
        int num = im->height - y < IMAGE_BAND ? im->height - y : IMAGE_BAND;
        const float *rows = im->data + (size_t)y * (size_t)im->width * (size_t)im->channels;
        if (!image_writer_rows(w, rows, num, e)) {
            image_writer_abandon(w);
            return false;
        }
    }
    return image_writer_close(w, e);
}

/* An image of the shape that the header says, and its texts. */
static bool read_header(exr_context_t f, const char *path, const struct stream *s, bool pixels,
                        struct image *im, bool *half, struct err *e)
{
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
        return failed(path, "read", s, r, e);
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
    *half = false;
    for (int c = 0; c < channels; c++) {
        const exr_attr_chlist_entry_t *ch = &list->entries[c];
        names[c] = ch->name.str;
        *half |= ch->pixel_type == EXR_PIXEL_HALF;
        bytes += (double)width * (double)height * (ch->pixel_type == EXR_PIXEL_HALF ? 2 : 4);
        if (ch->pixel_type == EXR_PIXEL_UINT || ch->x_sampling != 1 || ch->y_sampling != 1 ||
            ch->name.length >= (int)sizeof im->names[0])
            return err_set(e, "%s: channel %.64s is not a float for each pixel", path, names[c]);
    }
    off_t size = lseek(s->fd, 0, SEEK_END);
    if (bytes > IMAGE_MAX_EXPANSION * (double)size)
        return err_set(e, "%s: an image of %lld x %lld x %d cannot be in %lld bytes", path,
                       (long long)width, (long long)height, channels, (long long)size);
    if (!(pixels ? image_alloc : image_head)(im, (int)width, (int)height, channels, names, e))
        return err_prefix(e, "%s", path);
    /* "type" says how the file is made, not what of, and a writer has its own. */
    for (int i = 0; i < num_attrs; i++) {
        const exr_attribute_t *a;
        if (exr_get_attribute_by_index(f, 0, EXR_ATTR_LIST_FILE_ORDER, i, &a) == EXR_ERR_SUCCESS &&
            a->type == EXR_ATTR_STRING && strcmp(a->name, "type") != 0 &&
            !image_set_attr(im, a->name, a->string->str, e))
            return err_prefix(e, "%s", path);
    }
    return true;
}

/* One chunk, whose first pixel is number `at`. */
static exr_result_t read_chunk(exr_context_t f, const exr_chunk_info_t *chunk, struct image *im,
                               size_t at)
{
    exr_decode_pipeline_t decoder = EXR_DECODE_PIPELINE_INITIALIZER;
    exr_result_t r = exr_decoding_initialize(f, 0, chunk, &decoder);
    if (r == EXR_ERR_SUCCESS) {
        point_channels(decoder.channels, decoder.channel_count, im, at);
        r = exr_decoding_choose_default_routines(f, 0, &decoder);
    }
    if (r == EXR_ERR_SUCCESS)
        r = exr_decoding_run(f, 0, &decoder);
    exr_decoding_destroy(f, &decoder);
    return r;
}

static exr_result_t read_rows(exr_context_t f, struct image *im)
{
    exr_chunk_info_t chunk;
    exr_attr_box2i_t w;
    int32_t rows;
    exr_result_t r = exr_get_scanlines_per_chunk(f, 0, &rows);
    if (r == EXR_ERR_SUCCESS)
        r = exr_get_data_window(f, 0, &w);
    for (int y = 0; r == EXR_ERR_SUCCESS && y < im->height; y += rows) {
        r = exr_read_scanline_chunk_info(f, 0, w.min.y + y, &chunk);
        if (r == EXR_ERR_SUCCESS)
            r = read_chunk(f, &chunk, im, (size_t)y * (size_t)im->width);
    }
    return r;
}

static exr_result_t read_tiles(exr_context_t f, struct image *im)
{
    exr_chunk_info_t chunk;
    int32_t tw, th;
    exr_result_t r = exr_get_tile_sizes(f, 0, 0, 0, &tw, &th);
    for (int y = 0; r == EXR_ERR_SUCCESS && y < im->height; y += th)
        for (int x = 0; r == EXR_ERR_SUCCESS && x < im->width; x += tw) {
            r = exr_read_tile_chunk_info(f, 0, x / tw, y / th, 0, 0, &chunk);
            if (r == EXR_ERR_SUCCESS)
                r = read_chunk(f, &chunk, im, (size_t)y * (size_t)im->width + (size_t)x);
        }
    return r;
}

/* The pixels too, or the header alone. */
static bool read_exr(const char *path, bool pixels, struct image *out, bool *half, struct err *e)
{
    struct stream s = {.fd = fs_open_fd(path)};
    if (s.fd < 0)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    exr_context_initializer_t init = initializer(&s);
    exr_context_t f = NULL;
    exr_storage_t storage = EXR_STORAGE_SCANLINE;
    struct image im = {0};
    bool small = false;
    exr_result_t r = exr_start_read(&f, path, &init);
    if (r == EXR_ERR_SUCCESS && s.no_memory)
        r = EXR_ERR_OUT_OF_MEMORY;
    bool ok = r == EXR_ERR_SUCCESS || failed(path, "read", &s, r, e);
    ok = ok && read_header(f, path, &s, pixels, &im, &small, e);
    if (ok && pixels) {
        exr_get_storage(f, 0, &storage);
        r = storage == EXR_STORAGE_TILED ? read_tiles(f, &im) : read_rows(f, &im);
        ok = r == EXR_ERR_SUCCESS || failed(path, "read", &s, r, e);
    }
    exr_finish(&f);
    close(s.fd);
    if (!ok) {
        image_free(&im);
        return false;
    }
    *out = im;
    if (half != NULL)
        *half = small;
    return true;
}

bool image_read_exr(const char *path, struct image *out, bool *half, struct err *e)
{
    return read_exr(path, true, out, half, e);
}

bool image_read_exr_head(const char *path, struct image *out, struct err *e)
{
    return read_exr(path, false, out, NULL, e);
}
