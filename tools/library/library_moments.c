/* libassay: moments that a caller gathers sample by sample or image by image (assay.h). */
#include "library_internal.h"

#include "renderer/image/moments.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct assay_moments {
    struct moments m;
};

struct assay_moments *assay_moments_new(int width, int height, const char *unit, double spp)
{
    struct err ignored;
    bool replicates = unit != NULL && strcmp(unit, "replicate") == 0;
    if (width < 1 || height < 1 || !(spp >= 0) ||
        (unit != NULL && !replicates && strcmp(unit, "sample") != 0))
        return NULL;
    struct assay_moments *m = calloc(1, sizeof *m);
    if (m != NULL && !moments_alloc(&m->m, width, height, &ignored)) {
        free(m);
        return NULL;
    }
    if (m != NULL && replicates)
        strcpy(m->m.unit, unit);
    if (m != NULL && (replicates || spp > 0))
        m->m.spp = spp;
    return m;
}

static bool is_finite(const double x[3])
{
    return isfinite(x[0]) && isfinite(x[1]) && isfinite(x[2]);
}

bool assay_moments_add(struct assay_moments *moments, int x, int y, const double light[3])
{
    struct moments *m = &moments->m;
    if (x < 0 || y < 0 || x >= m->width || y >= m->height || !is_finite(light))
        return false;
    moments_add(m, (size_t)y * (size_t)m->width + (size_t)x, light);
    return true;
}

bool assay_moments_add_image(struct assay_moments *moments, const float *light)
{
    size_t values = 3 * (size_t)moments->m.width * (size_t)moments->m.height;
    for (size_t i = 0; i < values; i++)
        if (!isfinite(light[i]))
            return false;
    moments_add_image(&moments->m, light);
    return true;
}

bool assay_moments_merge(struct assay_moments *to, const struct assay_moments *from,
                         char error[ASSAY_ERROR_SIZE])
{
    struct err e = {""};
    return library_told(moments_merge(&to->m, &from->m, &e), &e, error);
}

bool assay_moments_write(const struct assay_moments *moments, const char *path,
                         char error[ASSAY_ERROR_SIZE])
{
    struct err e = {""};
    return library_told(moments_write(path, &moments->m, NULL, 0, &e), &e, error);
}

struct assay_side assay_moments_side(const struct assay_moments *moments)
{
    const struct moments *m = &moments->m;
    return (struct assay_side){.width = m->width,
                               .height = m->height,
                               .channels = 3,
                               .n = m->n,
                               .mean = m->mean,
                               .m2 = m->m2,
                               .m3 = m->m3,
                               .unit = m->unit,
                               .spp = m->spp};
}

void assay_moments_free(struct assay_moments *moments)
{
    if (moments != NULL)
        moments_free(&moments->m);
    free(moments);
}
