/* libassay: a side of a comparison, from a file or from memory. */
#include "library_internal.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LARGEST_SIDE = 1 << 16 };

static size_t pixels_of(const struct assay_side *s)
{
    return (size_t)s->width * (size_t)s->height;
}

/* Value i of the image at `pixels`, on the scale of image_file.h: integers over their maximum. */
static float value(enum assay_type type, const void *pixels, size_t i)
{
    switch (type) {
    case ASSAY_HALF:
    case ASSAY_FLOAT32: return ((const float *)pixels)[i];
    case ASSAY_UINT8: return (float)((const uint8_t *)pixels)[i] / 255;
    case ASSAY_UINT16: return (float)((const uint16_t *)pixels)[i] / 65535;
    }
    return NAN;
}

static const struct {
    enum image_type type;
    size_t bytes;
} types[] = {[ASSAY_FLOAT32] = {IMAGE_FLOAT, 4},
             [ASSAY_UINT8] = {IMAGE_INT8, 1},
             [ASSAY_UINT16] = {IMAGE_INT16, 2},
             [ASSAY_HALF] = {IMAGE_HALF, 4}};

static bool take_image(struct library_side *out, const struct assay_side *s, int k, struct err *e)
{
    size_t channels = (size_t)s->channels, values = 3 * pixels_of(s);
    const char *from =
        (const char *)s->pixels + (size_t)k * pixels_of(s) * channels * types[s->type].bytes;
    float *image = out->memory.renders.rgb[k] = malloc(values * sizeof *image);
    if (image == NULL)
        return err_set(e, "%s: out of memory", out->name);
    for (size_t i = 0; i < values; i++) {
        image[i] = value(s->type, from, channels == 3 ? i : i / 3);
        if (!isfinite(image[i]))
            return err_set(e, "%s: pixel %zu,%zu of image %d is %s", out->name,
                           i / 3 % (size_t)s->width, i / 3 / (size_t)s->width, k,
                           isnan(image[i]) ? "not a number" : "infinite");
    }
    for (int j = 0; j < k; j++)
        if (memcmp(image, out->memory.renders.rgb[j], values * sizeof *image) == 0)
            return err_set(e, "%s: images %d and %d are the same: the seed was ignored", out->name,
                           j, k);
    return true;
}

static bool take_images(struct library_side *out, const struct assay_side *s, struct err *e)
{
    if ((size_t)s->type >= sizeof types / sizeof *types)
        return err_set(e, "%s: type %d is none of assay.h", out->name, (int)s->type);
    if (s->num > 1 && s->type != ASSAY_FLOAT32)
        return err_set(e, "%s: replicates need 32-bit floats", out->name);
    out->memory.type = types[s->type].type;
    out->memory.renders = (struct replicate_dir){.num = s->num,
                                                 .width = s->width,
                                                 .height = s->height,
                                                 .rgb = calloc((size_t)s->num, sizeof(float *))};
    bool ok = out->memory.renders.rgb != NULL || err_set(e, "%s: out of memory", out->name);
    for (int k = 0; ok && k < s->num; k++)
        ok = take_image(out, s, k, e);
    return ok;
}

static bool take_moments(struct library_side *out, const struct assay_side *s, struct err *e)
{
    struct moments *m = &out->moments;
    const char *unit = s->unit != NULL ? s->unit : "sample";
    if (strcmp(unit, "sample") != 0 && strcmp(unit, "replicate") != 0 && strcmp(unit, "exact") != 0)
        return err_set(e, "%s: unit '%s' is none of sample, replicate, exact", out->name, unit);
    if (!(s->spp >= 0))
        return err_set(e, "%s: %g paths in an observation", out->name, s->spp);
    if (!moments_alloc(m, s->width, s->height, e))
        return false;
    strcpy(m->unit, unit);
    m->spp = strcmp(unit, "sample") == 0 && !(s->spp > 0) ? 1 : s->spp;
    for (size_t p = 0; p < pixels_of(s); p++) {
        m->n[p] = s->n[p];
        if (!(s->n[p] >= 1 && s->n[p] == floor(s->n[p]) && isfinite(s->n[p])))
            return err_set(e, "%s: pixel %zu,%zu has %g observations", out->name,
                           p % (size_t)s->width, p / (size_t)s->width, s->n[p]);
        for (size_t c = 0; c < 3; c++) {
            size_t i = s->channels == 3 ? 3 * p + c : p;
            m->mean[3 * p + c] = s->mean[i];
            m->m2[3 * p + c] = s->m2[i];
            m->m3[3 * p + c] = s->m3 != NULL ? s->m3[i] : 0;
        }
    }
    out->memory.moments = m;
    out->memory.has_m3 = s->m3 != NULL || strcmp(unit, "exact") == 0;
    return true;
}

bool library_side_open(struct library_side *out, const struct assay_side *side, const char *name,
                       struct err *e)
{
    bool images = side->num > 0 && side->pixels != NULL;
    bool moments = side->num == 0 && side->n != NULL && side->mean != NULL && side->m2 != NULL;
    *out = (struct library_side){.name = side->name != NULL ? side->name : name};
    if (side->path != NULL) {
        out->name = side->path;
        return (side->pixels == NULL && side->mean == NULL) ||
               err_set(e, "%s: has a path and pixels, which of them?", out->name);
    }
    if (!images && !moments)
        return err_set(e, "%s: has neither a path nor pixels nor moments", out->name);
    if (side->width < 1 || side->height < 1 || side->width > LARGEST_SIDE ||
        side->height > LARGEST_SIDE || (side->channels != 1 && side->channels != 3))
        return err_set(e, "%s: %d x %d pixels of %d channels", out->name, side->width, side->height,
                       side->channels);
    return images ? take_images(out, side, e) : take_moments(out, side, e);
}

void library_side_close(struct library_side *s)
{
    for (int k = 0; s->memory.renders.rgb != NULL && k < s->memory.renders.num; k++)
        free(s->memory.renders.rgb[k]);
    free(s->memory.renders.rgb);
    moments_free(&s->moments);
    *s = (struct library_side){.name = NULL};
}

bool library_told(bool ok, const struct err *e, char error[ASSAY_ERROR_SIZE])
{
    if (error != NULL)
        snprintf(error, ASSAY_ERROR_SIZE, "%s", ok ? "" : e->msg);
    return ok;
}
