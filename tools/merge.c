#include "merge.h"

#include "../renderer/film.h"
#include "../renderer/identity.h"

#include <ctype.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What shares have to agree on, by metadata, and what that is to a reader. */
static const char *const common[][2] = {{"assay:version", "version of the program"},
                                        {"assay:scene", "scene (SHA-256)"},
                                        {"assay:settings", "settings"},
                                        {"assay:adaptive", "adaptive mode"},
                                        {"assay:seed", "seed"}};
enum { NUM_COMMON = sizeof common / sizeof common[0] };

/* "A:B,C:D" in order and apart. */
static bool parse_ranges(struct share *s, const char *text, struct err *e)
{
    size_t most = 1;
    for (const char *c = text; *c != '\0'; c++)
        most += *c == ',';
    s->range = calloc(most, sizeof *s->range);
    if (s->range == NULL)
        return err_set(e, "%s: out of memory", s->path);
    const char *at = text;
    for (long long after = 0; (size_t)s->num_ranges < most; at++) {
        char *colon, *end;
        long long a = strtoll(at, &colon, 10), b = -1;
        bool ok = isdigit((unsigned char)*at) && *colon == ':' && isdigit((unsigned char)colon[1]);
        if (ok)
            b = strtoll(colon + 1, &end, 10);
        if (!ok || a < after || b < a || b > UINT32_MAX || (*end != ',' && *end != '\0'))
            return err_set(e, "%s: assay:samples '%.64s' are not sample ranges", s->path, text);
        s->range[s->num_ranges][0] = (uint32_t)a;
        s->range[s->num_ranges++][1] = (uint32_t)b;
        after = b;
        at = end;
        if (*end == '\0')
            break;
    }
    return true;
}

bool share_read(const char *path, struct share *s, struct err *e)
{
    *s = (struct share){.path = path};
    if (!moments_read(path, &s->m, &s->im, e))
        return false;
    const char *cell = image_get_attr(&s->im, "assay:cell");
    const char *samples = image_get_attr(&s->im, "assay:samples");
    bool ok = cell != NULL && samples != NULL && identity_parse_cell(cell, s->cell) &&
              s->cell[2] == s->m.width && s->cell[3] == s->m.height;
    for (int i = 0; i < NUM_COMMON; i++)
        ok = ok && image_get_attr(&s->im, common[i][0]) != NULL;
    if (!ok)
        err_set(e,
                "%s: does not say which part of which picture it is (attributes assay:cell, "
                "assay:samples, assay:scene, ...)",
                path);
    ok = ok && parse_ranges(s, samples, e);
    if (!ok)
        share_free(s);
    return ok;
}

void share_free(struct share *s)
{
    moments_free(&s->m);
    image_free(&s->im);
    free(s->range);
    *s = (struct share){0};
}

static bool same_cell(const struct share *a, const struct share *b)
{
    return memcmp(a->cell, b->cell, sizeof a->cell) == 0;
}

static int by_cell_then_sample(const void *pa, const void *pb)
{
    const struct share *a = pa, *b = pb;
    for (int i = 0; i < 6; i++)
        if (a->cell[i] != b->cell[i])
            return a->cell[i] < b->cell[i] ? -1 : 1;
    return (a->range[0][0] > b->range[0][0]) - (a->range[0][0] < b->range[0][0]);
}

static bool check_pair(const struct share *a, const struct share *b, struct err *e)
{
    for (int i = 0; i < NUM_COMMON; i++) {
        const char *va = image_get_attr(&a->im, common[i][0]);
        const char *vb = image_get_attr(&b->im, common[i][0]);
        if (strcmp(va, vb) != 0)
            return err_set(e, "%s and %s: different %s: '%.300s' and '%.300s'", a->path, b->path,
                           common[i][1], va, vb);
    }
    if (a->cell[4] != b->cell[4] || a->cell[5] != b->cell[5])
        return err_set(e, "%s and %s: of pictures of %d x %d and %d x %d pixels", a->path, b->path,
                       a->cell[4], a->cell[5], b->cell[4], b->cell[5]);
    if (!same_cell(a, b)) {
        bool apart = a->cell[0] + a->cell[2] <= b->cell[0] ||
                     b->cell[0] + b->cell[2] <= a->cell[0] ||
                     a->cell[1] + a->cell[3] <= b->cell[1] || b->cell[1] + b->cell[3] <= a->cell[1];
        return apart || err_set(e, "%s and %s: their cells overlap without being the same", a->path,
                                b->path);
    }
    for (int i = 0; i < a->num_ranges; i++)
        for (int j = 0; j < b->num_ranges; j++)
            if (a->range[i][0] < b->range[j][1] && b->range[j][0] < a->range[i][1])
                return err_set(e, "%s and %s: both have samples %lu:%lu of the same cell", a->path,
                               b->path,
                               (unsigned long)(a->range[i][0] > b->range[j][0] ? a->range[i][0]
                                                                               : b->range[j][0]),
                               (unsigned long)(a->range[i][1] < b->range[j][1] ? a->range[i][1]
                                                                               : b->range[j][1]));
    if (strncmp(image_get_attr(&a->im, "assay:adaptive"), "rule", 4) == 0)
        return err_set(e,
                       "%s and %s: the assignment's adaptive rule stopped each by its own "
                       "samples, so they do not add up",
                       a->path, b->path);
    return true;
}

static int layer_at(const struct share *s, int layer)
{
    return image_channel(&s->im, layer_names[layer]);
}

static bool has_layers(const struct share *s)
{
    for (int i = 0; i < NUM_LAYERS; i++)
        if (layer_at(s, i) < 0)
            return false;
    return true;
}

/* Adds pixel q of src, with ns samples, to the layers of a pixel of nd samples. Layers 0..5 follow from
 * the moments afterwards. */
static void add_layers(float *dst, double nd, const struct share *src, size_t q, double ns)
{
    enum { DEPTH = 6, HITS = 7, NORMAL = 8, OBJECT = 14 };
    float value[NUM_LAYERS];
    for (int i = 0; i < NUM_LAYERS; i++)
        value[i] = src->im.data[q * (size_t)src->im.channels + (size_t)layer_at(src, i)];
    if (nd == 0) {
        memcpy(dst, value, sizeof value);
        return;
    }
    if (ns == 0)
        return;
    double hd = dst[HITS], hs = value[HITS];
    if (hs > 0)
        dst[DEPTH] = (float)((hd * dst[DEPTH] + hs * value[DEPTH]) / (hd + hs));
    dst[HITS] = (float)(hd + hs);
    for (int i = NORMAL; i < OBJECT; i++)
        dst[i] = (float)((nd * dst[i] + ns * value[i]) / (nd + ns));
}

/* A view of one pixel as moments of its own. */
static struct moments pixel_of(const struct moments *m, size_t p)
{
    struct moments one = *m;
    one.width = one.height = 1;
    one.n += p;
    one.mean += 3 * p;
    one.m2 += 3 * p;
    one.m3 += 3 * p;
    return one;
}

/* Adds a share to its place in the whole. */
static bool add_share(struct share *whole, const struct share *s, bool layers, struct err *e)
{
    int x0 = s->cell[0] - whole->cell[0];
    int y0 = whole->cell[1] + whole->cell[3] - s->cell[1] - s->cell[3];
    for (int y = 0; y < s->m.height; y++)
        for (int x = 0; x < s->m.width; x++) {
            size_t q = (size_t)y * (size_t)s->m.width + (size_t)x;
            size_t p = (size_t)(y + y0) * (size_t)whole->m.width + (size_t)(x + x0);
            struct moments to = pixel_of(&whole->m, p), from = pixel_of(&s->m, q);
            float *px = whole->im.data + NUM_LAYERS * p;
            bool adds = to.n[0] > 0 && from.n[0] > 0;
            if (layers)
                add_layers(px, to.n[0], s, q, from.n[0]);
            if (!moments_merge(&to, &from, e))
                return err_prefix(e, "%s", s->path);
            if (layers && adds)
                layers_of_moments(&whole->m, p, px);
        }
    return true;
}

/* The ranges of share first .. last-1, which are of one cell and sorted; neighbours joined. */
static bool join_ranges(const struct share *share, int first, int last, struct share *out,
                        struct err *e)
{
    int most = 0;
    for (int i = first; i < last; i++)
        most += share[i].num_ranges;
    out->range = calloc((size_t)most, sizeof *out->range);
    if (out->range == NULL)
        return err_set(e, "out of memory");
    for (int i = first; i < last; i++)
        for (int k = 0; k < share[i].num_ranges; k++) {
            int at = out->num_ranges;
            while (at > 0 && out->range[at - 1][0] > share[i].range[k][0]) {
                memcpy(out->range[at], out->range[at - 1], sizeof *out->range);
                at--;
            }
            memcpy(out->range[at], share[i].range[k], sizeof *out->range);
            out->num_ranges++;
        }
    int kept = 0;
    for (int k = 1; k < out->num_ranges; k++) {
        if (out->range[kept][1] == out->range[k][0])
            out->range[kept][1] = out->range[k][1];
        else
            memcpy(out->range[++kept], out->range[k], sizeof *out->range);
    }
    out->num_ranges = kept + 1;
    return true;
}

/* Are all cells there, and with the same samples? Fills cell and ranges of the whole. */
static bool find_whole(const struct share *share, int num, struct share *whole, struct err *e)
{
    int x0 = INT_MAX, y0 = INT_MAX, x1 = 0, y1 = 0;
    double area = 0;
    for (int i = 0, end; i < num; i = end) {
        for (end = i + 1; end < num && same_cell(&share[i], &share[end]);)
            end++;
        const int *c = share[i].cell;
        x0 = c[0] < x0 ? c[0] : x0;
        y0 = c[1] < y0 ? c[1] : y0;
        x1 = c[0] + c[2] > x1 ? c[0] + c[2] : x1;
        y1 = c[1] + c[3] > y1 ? c[1] + c[3] : y1;
        area += (double)c[2] * c[3];
        struct share *into = whole, other = {0};
        if (i > 0)
            into = &other;
        bool ok = join_ranges(share, i, end, into, e);
        if (ok && i > 0 &&
            (other.num_ranges != whole->num_ranges ||
             memcmp(other.range, whole->range, (size_t)whole->num_ranges * sizeof *whole->range) !=
                 0))
            ok = err_set(e, "%s and %s: their cells do not have the same samples in all",
                         share[0].path, share[i].path);
        free(other.range);
        if (!ok)
            return false;
    }
    const int cell[6] = {x0, y0, x1 - x0, y1 - y0, share[0].cell[4], share[0].cell[5]};
    memcpy(whole->cell, cell, sizeof cell);
    if (area != (double)cell[2] * cell[3])
        return err_set(e, "the cells leave part of %d x %d pixels at (%d, %d) open", cell[2],
                       cell[3], cell[0], cell[1]);
    return true;
}

bool merge_shares(struct share *share, int num, struct share *out, struct err *e)
{
    struct share whole = {0};
    bool layers = true;
    qsort(share, (size_t)num, sizeof *share, by_cell_then_sample);
    for (int i = 0; i < num; i++) {
        layers = layers && has_layers(&share[i]);
        for (int j = 0; j < i; j++)
            if (!check_pair(&share[j], &share[i], e))
                return false;
    }
    if (!find_whole(share, num, &whole, e) ||
        !moments_alloc(&whole.m, whole.cell[2], whole.cell[3], e) ||
        !image_alloc(&whole.im, whole.cell[2], whole.cell[3], NUM_LAYERS, layer_names, e))
        goto fail;
    for (int i = 0; i < NUM_COMMON; i++)
        if (!image_set_attr(&whole.im, common[i][0], image_get_attr(&share[0].im, common[i][0]), e))
            goto fail;
    for (int i = 0; i < num; i++)
        if (!add_share(&whole, &share[i], layers, e))
            goto fail;
    if (!layers)
        whole.im.channels = 0;
    *out = whole;
    return true;
fail:
    share_free(&whole);
    return false;
}

bool share_write(const char *path, const struct share *s, const char *command, struct err *e)
{
    enum { RANGE = 24 };
    char cell[64];
    size_t size = (size_t)s->num_ranges * RANGE + 1, n = 0;
    char *samples = malloc(size);
    if (samples == NULL)
        return err_set(e, "%s: out of memory", path);
    for (int i = 0; i < s->num_ranges; i++)
        n += (size_t)snprintf(samples + n, size - n, "%s%lu:%lu", i > 0 ? "," : "",
                              (unsigned long)s->range[i][0], (unsigned long)s->range[i][1]);
    identity_cell(s->cell, s->cell[4], s->cell[5], cell);
    struct image_attr attrs[NUM_COMMON + 3] = {
        {"assay:command", command}, {"assay:cell", cell}, {"assay:samples", samples}};
    for (int i = 0; i < NUM_COMMON; i++)
        attrs[3 + i] = (struct image_attr){common[i][0], image_get_attr(&s->im, common[i][0])};
    bool ok = moments_write_layers(path, &s->m, s->im.channels > 0 ? &s->im : NULL, attrs,
                                   NUM_COMMON + 3, e);
    free(samples);
    return ok;
}
