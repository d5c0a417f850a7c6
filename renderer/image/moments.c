#include "moments.h"

#include "renderer/base/huge_alloc.h"
#include "renderer/base/isa.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool alloc_doubles(struct moments *m, struct err *e)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    m->n = huge_calloc(pixels, sizeof *m->n);
    m->mean = huge_calloc(3 * pixels, sizeof *m->mean);
    m->m2 = huge_calloc(3 * pixels, sizeof *m->m2);
    m->m3 = huge_calloc(3 * pixels, sizeof *m->m3);
    return (m->n != NULL && m->mean != NULL && m->m2 != NULL && m->m3 != NULL) ||
           err_set(e, "out of memory for moments of %d x %d pixels", m->width, m->height);
}

/* Allocates the packed arrays as one block, which begins with n. */
static bool alloc_packed(struct moments *m, struct err *e)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    float *n = huge_alloc(10 * pixels * sizeof *n);
    if (n == NULL)
        return err_set(e, "out of memory for moments of %d x %d pixels", m->width, m->height);
    m->packed.n = n;
    m->packed.mean = n + pixels;
    m->packed.m2 = n + 4 * pixels;
    m->packed.m3 = n + 7 * pixels;
    return true;
}

static struct moments empty(int width, int height)
{
    return (struct moments){.width = width, .height = height, .unit = "sample", .spp = 1};
}

bool moments_alloc(struct moments *m, int width, int height, struct err *e)
{
    *m = empty(width, height);
    if (width < 1 || height < 1)
        return err_set(e, "cannot make moments of %d x %d pixels", width, height);
    if (alloc_doubles(m, e))
        return true;
    moments_free(m);
    return false;
}

void moments_free(struct moments *m)
{
    free(m->n);
    free(m->mean);
    free(m->m2);
    free(m->m3);
    free(m->tolerance);
    free(m->packed.n);
    *m = (struct moments){0};
}

bool moments_copy(const struct moments *from, struct moments *to, struct err *e)
{
    size_t pixels = (size_t)from->width * (size_t)from->height;
    if (!moments_alloc(to, from->width, from->height, e))
        return false;
    memcpy(to->n, from->n, pixels * sizeof *to->n);
    memcpy(to->mean, from->mean, 3 * pixels * sizeof *to->mean);
    memcpy(to->m2, from->m2, 3 * pixels * sizeof *to->m2);
    memcpy(to->m3, from->m3, 3 * pixels * sizeof *to->m3);
    memcpy(to->unit, from->unit, sizeof to->unit);
    to->spp = from->spp;
    to->sharing = from->sharing;
    return true;
}

/* One-observation case of [Pebay08 eq. 2.1-2.2], M3 before M2 because it needs the old M2. */
void moments_add(struct moments *m, size_t pixel, const double x[3])
{
    double n = ++m->n[pixel];
    for (int c = 0; c < 3; c++) {
        size_t i = 3 * pixel + (size_t)c;
        double d = x[c] - m->mean[i], dn = d / n, term = d * dn * (n - 1);
        m->mean[i] += dn;
        m->m3[i] += term * dn * (n - 2) - 3 * dn * m->m2[i];
        m->m2[i] += term;
    }
}

void moments_add_image(struct moments *m, const float *pixels_rgb)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    for (size_t p = 0; p < pixels; p++)
        moments_add(m, p,
                    (double[3]){pixels_rgb[3 * p], pixels_rgb[3 * p + 1], pixels_rgb[3 * p + 2]});
}

bool moments_merge(struct moments *dst, const struct moments *src, struct err *e)
{
    if (dst->width != src->width || dst->height != src->height)
        return err_set(e, "cannot merge moments of %d x %d and %d x %d pixels", dst->width,
                       dst->height, src->width, src->height);
    if (strcmp(dst->unit, src->unit) != 0 || dst->spp != src->spp)
        return err_set(e, "cannot merge moments over a %s of %g spp and a %s of %g spp", dst->unit,
                       dst->spp, src->unit, src->spp);
    if (dst->sharing != src->sharing)
        return err_set(e, "cannot merge moments whose pixels share noise in different ways");
    if (dst->tolerance != NULL || src->tolerance != NULL)
        return err_set(e, "cannot merge moments of rounded numbers");
    size_t pixels = (size_t)dst->width * (size_t)dst->height;
    for (size_t p = 0; p < pixels; p++) {
        double na = dst->n[p], nb = src->n[p], n = na + nb;
        if (nb == 0)
            continue;
        for (size_t i = 3 * p; i < 3 * p + 3; i++) {
            double d = src->mean[i] - dst->mean[i], dn = d / n;
            dst->m3[i] += src->m3[i] + d * dn * dn * na * nb * (na - nb) +
                          3 * dn * (na * src->m2[i] - nb * dst->m2[i]);
            dst->m2[i] += src->m2[i] + d * dn * na * nb;
            dst->mean[i] += dn * nb;
        }
        dst->n[p] = n;
    }
    return true;
}

struct moments moments_run(const struct moments *m, size_t first, int num)
{
    struct moments run = *m;
    run.width = num;
    run.height = 1;
    if (m->n != NULL) {
        run.n += first;
        run.mean += 3 * first;
        run.m2 += 3 * first;
        run.m3 += 3 * first;
    } else {
        run.packed.n += first;
        run.packed.mean += 3 * first;
        run.packed.m2 += 3 * first;
        run.packed.m3 += 3 * first;
    }
    run.tolerance = m->tolerance != NULL ? m->tolerance + 3 * first : NULL;
    return run;
}

struct moments moments_rows(const struct moments *m, int y, int num)
{
    struct moments rows = moments_run(m, (size_t)y * (size_t)m->width, num);
    rows.width = m->width;
    rows.height = num;
    return rows;
}

void moments_make_exact(struct moments *m)
{
    const size_t pixels = (size_t)m->width * (size_t)m->height;
    strcpy(m->unit, "exact");
    for (size_t p = 0; p < pixels; p++)
        m->n[p] = 1;
    memset(m->m2, 0, 3 * pixels * sizeof *m->m2);
    memset(m->m3, 0, 3 * pixels * sizeof *m->m3);
}

bool moments_is_exact(const struct moments *m)
{
    return strcmp(m->unit, "exact") == 0;
}

bool moments_noise_is_unknown(const struct moments *m)
{
    return strcmp(m->unit, "picture") == 0;
}

double moments_var_of_mean(const struct moments *m, size_t pixel, int channel)
{
    double n = moments_n(m, pixel);
    if (moments_is_exact(m))
        return 0;
    if (strcmp(m->unit, "stratified") == 0)
        return NAN;
    return n < 2 ? NAN : moments_m2(m, 3 * pixel + (size_t)channel) / (n * (n - 1));
}

static const char *const channel_names[10] = {"R",    "G",    "B",    "M2.R", "M2.G",
                                              "M2.B", "M3.R", "M3.G", "M3.B", "n"};

struct moments_writer {
    struct image head;
    struct image_writer *file;
    float *band; /* IMAGE_BAND rows */
};

static bool writer_head(struct moments_writer *w, const struct moments *m, int height,
                        const struct image *layers, const struct image_attr *attrs, int num_attrs,
                        struct err *e)
{
    const char *names[IMAGE_MAX_CHANNELS];
    char spp[32], sharing[32];
    int more = layers != NULL ? layers->channels : 0;
    assert(10 + more <= IMAGE_MAX_CHANNELS);
    memcpy(names, channel_names, sizeof channel_names);
    for (int c = 0; c < more; c++)
        names[10 + c] = layers->names[c];
    snprintf(spp, sizeof spp, "%.17g", m->spp);
    bool ok = image_head(&w->head, m->width, height, 10 + more, names, e) &&
              image_set_attr(&w->head, "assay:unit", m->unit, e) &&
              image_set_attr(&w->head, "assay:spp", spp, e);
    snprintf(sharing, sizeof sharing, "%.17g", m->sharing);
    ok = ok && (!(m->sharing > 1) || image_set_attr(&w->head, "assay:sharing", sharing, e));
    for (int i = 0; ok && i < num_attrs; i++)
        ok = image_set_attr(&w->head, attrs[i].name, attrs[i].value, e);
    return ok;
}

struct moments_writer *moments_writer_open(const char *path, const struct moments *first,
                                           int height, const struct image *layers,
                                           const struct image_attr *attrs, int num_attrs,
                                           struct err *e)
{
    struct moments_writer *w = calloc(1, sizeof *w);
    if (w == NULL) {
        err_set(e, "%s: out of memory", path);
        return NULL;
    }
    if (writer_head(w, first, height, layers, attrs, num_attrs, e)) {
        w->band =
            malloc(IMAGE_BAND * (size_t)first->width * (size_t)w->head.channels * sizeof *w->band);
        if (w->band == NULL)
            err_set(e, "%s: out of memory", path);
        else if ((w->file = image_writer_open(path, &w->head, e)) != NULL)
            return w;
    }
    moments_writer_abandon(w);
    return NULL;
}

/* Interleaves all channels of pixels first .. end-1 as floats. */
static void interleave(const struct moments *m, const struct image *layers, size_t first,
                       size_t end, size_t channels, float *out)
{
    size_t more = channels - 10;
    for (size_t p = first; p < end; p++) {
        float *px = out + channels * (p - first);
        for (size_t c = 0; c < 3; c++) {
            px[c] = (float)m->mean[3 * p + c];
            px[3 + c] = (float)m->m2[3 * p + c];
            px[6 + c] = (float)m->m3[3 * p + c];
        }
        px[9] = (float)m->n[p];
        for (size_t c = 0; layers != NULL && c < more; c++)
            px[10 + c] = layers->data[more * p + c];
    }
}

bool moments_writer_rows(struct moments_writer *w, const struct moments *m,
                         const struct image *layers, struct err *e)
{
    assert(m->width == w->head.width);
    for (int y = 0; y < m->height; y += IMAGE_BAND) {
        int rows = m->height - y < IMAGE_BAND ? m->height - y : IMAGE_BAND;
        size_t first = (size_t)y * (size_t)m->width;
        interleave(m, layers, first, first + (size_t)rows * (size_t)m->width,
                   (size_t)w->head.channels, w->band);
        if (!image_writer_rows(w->file, w->band, rows, e))
            return false;
    }
    return true;
}

bool moments_writer_close(struct moments_writer *w, struct err *e)
{
    bool ok = image_writer_close(w->file, e);
    w->file = NULL;
    moments_writer_abandon(w);
    return ok;
}

void moments_writer_abandon(struct moments_writer *w)
{
    if (w == NULL)
        return;
    image_writer_abandon(w->file);
    image_free(&w->head);
    free(w->band);
    free(w);
}

bool moments_write_layers(const char *path, const struct moments *m, const struct image *layers,
                          const struct image_attr *attrs, int num_attrs, struct err *e)
{
    struct moments_writer *w = moments_writer_open(path, m, m->height, layers, attrs, num_attrs, e);
    if (w == NULL)
        return false;
    if (moments_writer_rows(w, m, layers, e))
        return moments_writer_close(w, e);
    moments_writer_abandon(w);
    return false;
}

bool moments_write(const char *path, const struct moments *m, const struct image_attr *attrs,
                   int num_attrs, struct err *e)
{
    return moments_write_layers(path, m, NULL, attrs, num_attrs, e);
}

/* True for a valid value of a moments EXR: finite, M2 (channels 3 to 5) >= 0, n (channel 9) a whole number >= 0. */
static bool is_valid(float v, int channel)
{
    const bool least = channel < 3 || (channel > 5 && channel < 9) || v >= 0;
    return fabsf(v) <= FLT_MAX && least && (channel < 9 || v >= 0x1p23f || v == (float)(int)v);
}

/* Reads the attributes of a moments EXR into *m and finds its channels. */
static bool read_head(const char *path, struct image_reader *r, struct moments *m, int at[10],
                      struct err *e)
{
    const struct image *head = image_reader_head(r);
    const char *unit = image_get_attr(head, "assay:unit"), *spp = image_get_attr(head, "assay:spp");
    char *end;
    bool has_all = unit != NULL && spp != NULL && strlen(unit) < sizeof m->unit;
    for (int c = 0; c < 10; c++) {
        at[c] = image_channel(head, channel_names[c]);
        has_all = has_all && at[c] >= 0;
    }
    if (!has_all)
        return err_set(e,
                       "%s: not a moments EXR (channels R G B M2.* M3.* n, attributes assay:unit, "
                       "assay:spp)",
                       path);
    if (image_reader_is_half(r))
        return err_set(e, "%s: moments need 32-bit floats, this file has fewer bits", path);
    if (strcmp(unit, "sample") != 0 && strcmp(unit, "replicate") != 0 &&
        strcmp(unit, "exact") != 0 && strcmp(unit, "stratified") != 0 &&
        strcmp(unit, "picture") != 0)
        return err_set(e, "%s: unknown unit of observation '%s'", path, unit);
    *m = empty(head->width, head->height);
    strcpy(m->unit, unit);
    m->spp = strtod(spp, &end);
    if (end == spp || *end != '\0' || !(m->spp >= 0 && m->spp < 1e15))
        return err_set(e, "%s: assay:spp '%s' is not a number of samples", path, spp);
    const char *sharing = image_get_attr(head, "assay:sharing");
    if (sharing == NULL)
        return true;
    m->sharing = strtod(sharing, &end);
    return (end != sharing && *end == '\0' && m->sharing >= 1 && m->sharing < 1e15) ||
           err_set(e, "%s: assay:sharing '%s' is not a factor of 1 or more", path, sharing);
}

/* Checks and stores row y. row: its values, channel after channel. */
ISA_CLONES static bool take_row(const char *path, struct moments *m, const int at[10], size_t y,
                                const float *row, struct err *e)
{
    double *const out[4] = {m->mean, m->m2, m->m3, m->n};
    float *const packed[4] = {m->packed.mean, m->packed.m2, m->packed.m3, m->packed.n};
    const size_t width = (size_t)m->width;
    size_t bad = width;
    for (int c = 0; c < 10; c++) {
        const size_t part = (size_t)c / 3, stride = c < 9 ? 3 : 1,
                     first = stride * y * width + (size_t)c % 3;
        const float *v = row + (size_t)at[c] * width;
        bool all_valid = true;
        for (size_t x = 0; x < width; x++)
            all_valid &= is_valid(v[x], c);
        for (size_t x = 0; !all_valid && x < bad; x++)
            if (!is_valid(v[x], c))
                bad = x;
        if (m->n != NULL)
            for (size_t x = 0; x < width; x++)
                out[part][first + stride * x] = v[x];
        else
            for (size_t x = 0; x < width; x++)
                packed[part][first + stride * x] = v[x];
    }
    return bad == width ||
           err_set(e, "%s: pixel (%zu, %zu) is not finite or has a negative M2 or count", path, bad,
                   y);
}

static bool read_rows(struct image_reader *r, const char *path, const int at[10], struct moments *m,
                      struct image *image, struct err *e)
{
    const size_t size = (size_t)m->width * (size_t)image_reader_head(r)->channels;
    for (int num = 0, y = 0; y < m->height; y += num) {
        const float *rows = image_reader_rows(r, &num, e);
        if (rows == NULL)
            return false;
        for (int k = 0; k < num; k++)
            if (!take_row(path, m, at, (size_t)y + (size_t)k, rows + (size_t)k * size, e))
                return false;
        if (image != NULL)
            image_put_rows(image, y, rows, num);
    }
    return true;
}

static bool read_as(bool (*alloc)(struct moments *m, struct err *e), const char *path,
                    struct moments *out, struct image *image, struct err *e)
{
    struct moments m = {0};
    int at[10];
    struct image_reader *r = image_reader_open(path, e);
    if (r == NULL)
        return false;
    bool ok = read_head(path, r, &m, at, e) && alloc(&m, e);
    struct image im = *image_reader_head(r);
    if (ok && image != NULL) {
        im.data =
            malloc((size_t)im.width * (size_t)im.height * (size_t)im.channels * sizeof *im.data);
        ok = im.data != NULL || err_set(e, "%s: out of memory", path);
    }
    ok = ok && read_rows(r, path, at, &m, im.data != NULL ? &im : NULL, e);
    if (ok && image != NULL) {
        *image = im;
        *image_reader_head(r) = (struct image){0};
    } else {
        free(im.data);
    }
    if (ok)
        *out = m;
    else
        moments_free(&m);
    image_reader_close(r);
    return ok;
}

bool moments_read(const char *path, struct moments *out, struct image *image, struct err *e)
{
    return read_as(alloc_doubles, path, out, image, e);
}

bool moments_read_packed(const char *path, struct moments *out, struct err *e)
{
    return read_as(alloc_packed, path, out, NULL, e);
}

bool moments_unpack(struct moments *m, struct err *e)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    if (m->n != NULL)
        return true;
    if (!alloc_doubles(m, e))
        return false;
    for (size_t p = 0; p < pixels; p++)
        m->n[p] = m->packed.n[p];
    for (size_t i = 0; i < 3 * pixels; i++) {
        m->mean[i] = m->packed.mean[i];
        m->m2[i] = m->packed.m2[i];
        m->m3[i] = m->packed.m3[i];
    }
    free(m->packed.n);
    memset(&m->packed, 0, sizeof m->packed);
    return true;
}
