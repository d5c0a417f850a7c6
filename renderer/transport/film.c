#include "film.h"

#include "renderer/base/huge_alloc.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const layer_names[NUM_LAYERS] = {"variance.R", "variance.G", "variance.B", "stderr.R",
                                             "stderr.G",   "stderr.B",   "depth.Z",    "depth.hits",
                                             "normal.X",   "normal.Y",   "normal.Z",   "albedo.R",
                                             "albedo.G",   "albedo.B",   "id.object"};

/* Depth where nothing is hit, as Blender writes it. */
#define DEPTH_OF_NOTHING 1e10f

bool film_alloc(struct film *f, int width, int height, bool first_hits, struct err *e)
{
    *f = (struct film){0};
    if (!moments_alloc(&f->m, width, height, e))
        return false;
    size_t pixels = (size_t)width * (size_t)height;
    f->s1 = huge_calloc(pixels, sizeof *f->s1);
    f->s2 = huge_calloc(pixels, sizeof *f->s2);
    if (first_hits)
        f->first = huge_calloc(pixels, sizeof *f->first);
    if (f->s1 == NULL || f->s2 == NULL || (first_hits && f->first == NULL)) {
        film_free(f);
        return err_set(e, "out of memory for an image of %d x %d pixels", width, height);
    }
    return true;
}

void film_free(struct film *f)
{
    moments_free(&f->m);
    free(f->s1);
    free(f->s2);
    free(f->first);
    free(f->target);
    *f = (struct film){0};
}

void film_set_sampler(struct film *f, enum sampler_kind kind)
{
    strcpy(f->m.unit, kind == SAMPLER_INDEPENDENT ? "sample" : "stratified");
}

void film_add_first_hit(struct film *f, size_t pixel, const struct first_hits *h, int i)
{
    struct first_hit_sums *s = &f->first[pixel];
    bool hit = h->object[i] != NO_HIT;
    if (f->m.n[pixel] == 1)
        s->object = hit ? 1 + (double)h->object[i] : 0;
    if (!hit)
        return;
    rgb a = rgbs_get(&h->albedo, i);
    vec3 n = vec3s_get(&h->normal, i);
    s->hits++;
    s->depth += h->depth[i];
    s->normal[0] += n.x;
    s->normal[1] += n.y;
    s->normal[2] += n.z;
    s->albedo[0] += a.r;
    s->albedo[1] += a.g;
    s->albedo[2] += a.b;
}

static void add_first_hits(struct first_hit_sums *dst, const struct first_hit_sums *src)
{
    dst->hits += src->hits;
    dst->depth += src->depth;
    for (int c = 0; c < 3; c++) {
        dst->normal[c] += src->normal[c];
        dst->albedo[c] += src->albedo[c];
    }
}

bool film_merge(struct film *dst, const struct film *src, size_t first, int num, struct err *e)
{
    struct moments to = moments_run(&dst->m, first, num), from = moments_run(&src->m, first, num);
    assert(dst->m.width == src->m.width && (dst->first == NULL) == (src->first == NULL));
    for (size_t p = first; p < first + (size_t)num; p++) {
        dst->s1[p] += src->s1[p];
        dst->s2[p] += src->s2[p];
        if (dst->first == NULL)
            continue;
        if (dst->m.n[p] == 0)
            dst->first[p].object = src->first[p].object;
        add_first_hits(&dst->first[p], &src->first[p]);
    }
    return moments_merge(&to, &from, e);
}

double film_relative_error(const struct film *f)
{
    size_t pixels = (size_t)f->m.width * (size_t)f->m.height;
    double luminance = 0, squares = 0;
    for (size_t p = 0; p < pixels; p++) {
        double n = f->m.n[p];
        if (n < 2)
            return INFINITY;
        double m2 = f->s2[p] - f->s1[p] * f->s1[p] / n;
        luminance += f->s1[p] / n;
        squares += m2 > 0 ? m2 / (n * (n - 1)) : 0;
    }
    return luminance > 0 ? sqrt(squares * (double)pixels) / luminance : INFINITY;
}

void layers_of_moments(const struct moments *m, size_t pixel, float layers[6])
{
    double n = m->n[pixel];
    for (size_t c = 0; c < 3; c++) {
        double variance = n < 2 ? INFINITY : m->m2[3 * pixel + c] / (n - 1);
        layers[c] = (float)variance;
        layers[3 + c] = (float)sqrt(n < 2 ? INFINITY : variance / n);
    }
}

bool film_layers(const struct film *f, struct image *out, struct err *e)
{
    if (!image_alloc(out, f->m.width, f->m.height, NUM_LAYERS, layer_names, e))
        return false;
    size_t pixels = (size_t)f->m.width * (size_t)f->m.height;
    for (size_t p = 0; p < pixels; p++) {
        float *px = out->data + NUM_LAYERS * p;
        const struct first_hit_sums *s = &f->first[p];
        double n = f->m.n[p] > 0 ? f->m.n[p] : 1;
        layers_of_moments(&f->m, p, px);
        px[6] = s->hits > 0 ? (float)(s->depth / s->hits) : DEPTH_OF_NOTHING;
        px[7] = (float)s->hits;
        for (size_t c = 0; c < 3; c++) {
            px[8 + c] = (float)(s->normal[c] / n);
            px[11 + c] = (float)(s->albedo[c] / n);
        }
        px[14] = (float)s->object;
    }
    return true;
}
