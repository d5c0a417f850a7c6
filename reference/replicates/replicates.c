#include "replicates.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

bool replicates_alloc(struct replicates *r, int width, int height, int count, struct err *e)
{
    assert(width > 0 && height > 0 && count > 0);
    *r = (struct replicates){.width = width, .height = height};
    r->capacity = count < MOST_REPLICATES ? count : MOST_REPLICATES;
    r->luminance =
        malloc((size_t)r->capacity * (size_t)width * (size_t)height * sizeof *r->luminance);
    return r->luminance != NULL || err_set(e, "replicates: out of memory");
}

void replicates_add(struct replicates *r, const float *rgb)
{
    if (r->num == r->capacity)
        return;
    size_t pixels = (size_t)r->width * (size_t)r->height;
    float *out = r->luminance + (size_t)r->num++ * pixels;
    for (size_t p = 0; p < pixels; p++)
        out[p] = .2126f * rgb[3 * p] + .7152f * rgb[3 * p + 1] + .0722f * rgb[3 * p + 2];
}

void replicates_free(struct replicates *r)
{
    free(r->luminance);
    *r = (struct replicates){0};
}

bool replicates_residuals(const struct replicates *r, size_t pixel, double *e)
{
    size_t stride = (size_t)r->width * (size_t)r->height;
    double mean = 0, m2 = 0;
    for (int k = 0; k < r->num; k++)
        mean += (double)r->luminance[(size_t)k * stride + pixel] / r->num;
    for (int k = 0; k < r->num; k++) {
        e[k] = r->luminance[(size_t)k * stride + pixel] - mean;
        m2 += e[k] * e[k];
    }
    /* Equal floats differ from their mean only by rounding. */
    if (!(m2 > 1e-28 * mean * mean * r->num))
        return false;
    for (int k = 0; k < r->num; k++)
        e[k] *= sqrt((r->num - 1) / m2);
    return true;
}
