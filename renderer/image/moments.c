#include "moments.h"

#include "renderer/base/huge_alloc.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool moments_alloc(struct moments *m, int width, int height, struct err *e)
{
    *m = (struct moments){.width = width, .height = height, .unit = "sample", .spp = 1};
    if (width < 1 || height < 1)
        return err_set(e, "cannot make moments of %d x %d pixels", width, height);
    size_t pixels = (size_t)width * (size_t)height;
    m->n = huge_calloc(pixels, sizeof *m->n);
    m->mean = huge_calloc(3 * pixels, sizeof *m->mean);
    m->m2 = huge_calloc(3 * pixels, sizeof *m->m2);
    m->m3 = huge_calloc(3 * pixels, sizeof *m->m3);
    if (m->n == NULL || m->mean == NULL || m->m2 == NULL || m->m3 == NULL) {
        moments_free(m);
        return err_set(e, "out of memory for moments of %d x %d pixels", width, height);
    }
    return true;
}

void moments_free(struct moments *m)
{
    free(m->n);
    free(m->mean);
    free(m->m2);
    free(m->m3);
    free(m->tolerance);
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
    run.n += first;
    run.mean += 3 * first;
    run.m2 += 3 * first;
    run.m3 += 3 * first;
    run.tolerance = m->tolerance != NULL ? m->tolerance + 3 * first : NULL;
    return run;
}

double moments_var_of_mean(const struct moments *m, size_t pixel, int channel)
{
    double n = m->n[pixel];
    if (strcmp(m->unit, "exact") == 0)
        return 0;
    if (strcmp(m->unit, "stratified") == 0)
        return NAN;
    return n < 2 ? NAN : m->m2[3 * pixel + (size_t)channel] / (n * (n - 1));
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
    char spp[32];
    int more = layers != NULL ? layers->channels : 0;
    assert(10 + more <= IMAGE_MAX_CHANNELS);
    memcpy(names, channel_names, sizeof channel_names);
    for (int c = 0; c < more; c++)
        names[10 + c] = layers->names[c];
    snprintf(spp, sizeof spp, "%.17g", m->spp);
    bool ok = image_head(&w->head, m->width, height, 10 + more, names, e) &&
              image_set_attr(&w->head, "assay:unit", m->unit, e) &&
              image_set_attr(&w->head, "assay:spp", spp, e);
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

/* Pixels first .. end-1 as floats of all channels. */
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

/* One pixel of a moments EXR: finite, M2 >= 0, n a whole number >= 0. */
static bool pixel_is_valid(const float *px, const int at[10])
{
    for (int c = 0; c < 10; c++)
        if (!isfinite(px[at[c]]))
            return false;
    float n = px[at[9]];
    return px[at[3]] >= 0 && px[at[4]] >= 0 && px[at[5]] >= 0 && n >= 0 && n == floorf(n);
}

bool moments_read(const char *path, struct moments *out, struct image *image, struct err *e)
{
    struct image im = {0};
    struct moments m = {0};
    bool half;
    if (!image_read_exr(path, &im, &half, e))
        return false;
    const char *unit = image_get_attr(&im, "assay:unit");
    const char *spp = image_get_attr(&im, "assay:spp");
    int at[10];
    bool has_all = unit != NULL && spp != NULL && strlen(unit) < sizeof m.unit;
    for (int c = 0; c < 10; c++) {
        at[c] = image_channel(&im, channel_names[c]);
        has_all = has_all && at[c] >= 0;
    }
    if (!has_all) {
        err_set(e,
                "%s: not a moments EXR (channels R G B M2.* M3.* n, attributes assay:unit, "
                "assay:spp)",
                path);
        goto fail;
    }
    if (half) {
        err_set(e, "%s: moments need 32-bit floats, this file has fewer bits", path);
        goto fail;
    }
    if (strcmp(unit, "sample") != 0 && strcmp(unit, "replicate") != 0 &&
        strcmp(unit, "exact") != 0 && strcmp(unit, "stratified") != 0 &&
        strcmp(unit, "picture") != 0) {
        err_set(e, "%s: unknown unit of observation '%s'", path, unit);
        goto fail;
    }
    if (!moments_alloc(&m, im.width, im.height, e))
        goto fail;
    strcpy(m.unit, unit);
    char *end;
    m.spp = strtod(spp, &end);
    if (end == spp || *end != '\0' || !(m.spp >= 0 && m.spp < 1e15)) {
        err_set(e, "%s: assay:spp '%s' is not a number of samples", path, spp);
        goto fail;
    }
    size_t pixels = (size_t)m.width * (size_t)m.height;
    for (size_t p = 0; p < pixels; p++) {
        const float *px = im.data + (size_t)im.channels * p;
        if (!pixel_is_valid(px, at)) {
            err_set(e, "%s: pixel (%zu, %zu) is not finite or has a negative M2 or count", path,
                    p % (size_t)m.width, p / (size_t)m.width);
            goto fail;
        }
        for (size_t c = 0; c < 3; c++) {
            m.mean[3 * p + c] = px[at[c]];
            m.m2[3 * p + c] = px[at[3 + c]];
            m.m3[3 * p + c] = px[at[6 + c]];
        }
        m.n[p] = px[at[9]];
    }
    *out = m;
    if (image != NULL)
        *image = im;
    else
        image_free(&im);
    return true;
fail:
    moments_free(&m);
    image_free(&im);
    return false;
}
