/* OpenEXR files, written by the C interface of its own library, which loads in a millisecond. */
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

/* What the library hands back to us: the open file, and why it could not be written. */
struct stream {
    int fd;
    char why[200];
};

/* While writing, OpenEXR reports lack of memory with the context's lock held; exr_get_user_data() would wait for that
 * lock forever. */
static void drop_complaint(exr_const_context_t f, exr_result_t code, const char *msg)
{
    (void)f;
    (void)code;
    (void)msg;
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
    init.error_handler_fn = drop_complaint;
    init.user_data = s;
    init.write_fn = write_at;
    init.max_image_width = init.max_image_height = IMAGE_MAX_SIDE;
    return init;
}

static bool failed(const char *path, const struct stream *s, exr_result_t code, struct err *e)
{
    return err_set(e, "%s: cannot write: %s", path,
                   s->why[0] != '\0' ? s->why : exr_get_default_error_message(code));
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

/* Sets up the packing of rows, by the order of channels in the file. */
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
    exr_result_t r = exr_start_write(&w->f, path, EXR_WRITE_FILE_DIRECTLY, &init);
    if (r == EXR_ERR_SUCCESS)
        r = write_header(w->f, head);
    if (r == EXR_ERR_SUCCESS)
        r = start_rows(w);
    if (r == EXR_ERR_SUCCESS)
        return w;
    failed(path, &w->s, r, e);
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
    return r == EXR_ERR_SUCCESS || failed(w->file.path, &w->s, r, e);
}

bool image_writer_close(struct image_writer *w, struct err *e)
{
    assert(w->y == w->head->height);
    exr_result_t r = exr_finish(&w->f); /* writes the table of chunk offsets */
    bool ok = r == EXR_ERR_SUCCESS;
    if (ok) {
        ok = out_commit(&w->file, e);
    } else {
        failed(w->file.path, &w->s, r, e);
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
