#include "merge.h"

#include "share_internal.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

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
        const char *va = image_get_attr(&a->im, share_common[i][0]);
        const char *vb = image_get_attr(&b->im, share_common[i][0]);
        if (strcmp(va, vb) != 0)
            return err_set(e, "%s and %s: different %s: '%.300s' and '%.300s'", a->path, b->path,
                           share_common[i][1], va, vb);
    }
    if (a->cell[4] != b->cell[4] || a->cell[5] != b->cell[5])
        return err_set(e, "%s and %s: of images of %d x %d and %d x %d pixels", a->path, b->path,
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

static bool has_layers(const struct share *s)
{
    for (int i = 0; i < NUM_LAYERS; i++)
        if (image_channel(&s->im, layer_names[i]) < 0)
            return false;
    return true;
}

/* Adds the layers of a pixel's part with ns samples to dst, the layers of nd > 0 samples. Layers 0..5 are computed
 * from the moments afterwards. */
static void add_layers(float *dst, double nd, const float *src, double ns)
{
    enum { DEPTH = 6, HITS = 7, NORMAL = 8, OBJECT = 14 };
    double hd = dst[HITS], hs = src[HITS];
    if (hs > 0)
        dst[DEPTH] = (float)((hd * dst[DEPTH] + hs * src[DEPTH]) / (hd + hs));
    dst[HITS] = (float)(hd + hs);
    for (int i = NORMAL; i < OBJECT; i++)
        dst[i] = (float)((nd * dst[i] + ns * src[i]) / (nd + ns));
}

/* A part of a share, and where it goes. */
struct piece {
    const struct share *share;
    const struct share_part *part;
    int kept; /* index of its part in the whole; -1: the whole keeps no parts */
};

static int by_samples(const void *pa, const void *pb)
{
    const struct share_part *a = ((const struct piece *)pa)->part,
                            *b = ((const struct piece *)pb)->part;
    if (a->first != b->first)
        return a->first < b->first ? -1 : 1;
    return (a->last > b->last) - (a->last < b->last);
}

static bool add_moments(struct share *whole, size_t p, const struct share *s, const float *v,
                        struct err *e)
{
    double n = v[9], mean[3] = {v[0], v[1], v[2]}, m2[3] = {v[3], v[4], v[5]},
           m3[3] = {v[6], v[7], v[8]};
    struct moments to = moments_run(&whole->m, p, 1);
    struct moments from = {
        .width = 1, .height = 1, .n = &n, .mean = mean, .m2 = m2, .m3 = m3, .spp = s->m.spp};
    strcpy(from.unit, s->m.unit);
    return moments_merge(&to, &from, e) || err_prefix(e, "%s", s->path);
}

/* Adds a piece to its place in the whole. */
static bool add_piece(struct share *whole, const struct piece *piece, bool layers, struct err *e)
{
    const struct share *s = piece->share;
    int x0 = s->cell[0] - whole->cell[0];
    int y0 = whole->cell[1] + whole->cell[3] - s->cell[1] - s->cell[3];
    int values = layers ? PART_VALUES : 10;
    for (int y = 0; y < s->m.height; y++)
        for (int x = 0; x < s->m.width; x++) {
            size_t q = (size_t)y * (size_t)s->m.width + (size_t)x;
            size_t p = (size_t)(y + y0) * (size_t)whole->m.width + (size_t)(x + x0);
            const float *from = s->im.data + q * (size_t)s->im.channels;
            float *px = whole->im.data + p * (size_t)whole->im.channels, v[PART_VALUES];
            for (int i = 0; i < values; i++)
                v[i] = from[piece->part->channel[i]];
            double n = v[9], before = whole->m.n[p];
            /* A pixel that this part does not have (its range is of other cells): its own without samples have
             * variance INFINITY. */
            if (n == 0 && (!layers || v[10] == 0))
                continue;
            if (layers && before == 0)
                memcpy(px, v + 10, NUM_LAYERS * sizeof *px);
            else if (layers && n > 0)
                add_layers(px, before, v + 10, n);
            if (n > 0 && !add_moments(whole, p, s, v, e))
                return false;
            if (layers && before > 0 && n > 0)
                layers_of_moments(&whole->m, p, px);
            if (piece->kept >= 0)
                for (int i = 0; i < values; i++)
                    px[whole->part[piece->kept].channel[i]] = v[i];
        }
    return true;
}

/* The pieces of all shares in the order of their samples, whichever files they come from. */
static struct piece *list_pieces(const struct share *share, int num, int *num_pieces, struct err *e)
{
    int most = 0;
    for (int i = 0; i < num; i++)
        most += share[i].num_parts;
    struct piece *piece = calloc((size_t)most + 1, sizeof *piece);
    *num_pieces = 0;
    if (piece == NULL) {
        err_set(e, "out of memory");
        return NULL;
    }
    for (int i = 0; i < num; i++)
        for (int k = 0; k < share[i].num_parts; k++)
            if (share[i].part[k].last > share[i].part[k].first)
                piece[(*num_pieces)++] =
                    (struct piece){.share = &share[i], .part = &share[i].part[k], .kept = -1};
    qsort(piece, (size_t)*num_pieces, sizeof *piece, by_samples);
    return piece;
}

/* Lists the parts of the whole, and allocates channels for them, if there are several, and for the layers. */
static bool shape_whole(struct share *whole, struct piece *piece, int num, bool layers,
                        struct err *e)
{
    int values = layers ? PART_VALUES : 10, channels = layers ? NUM_LAYERS : 0;
    whole->part = calloc((size_t)num + 1, sizeof *whole->part);
    if (whole->part == NULL)
        return err_set(e, "out of memory");
    for (int i = 0; i < num; i++) {
        if (i == 0 || by_samples(&piece[i - 1], &piece[i]) != 0) {
            struct share_part *p = &whole->part[whole->num_parts++];
            p->first = piece[i].part->first;
            p->last = piece[i].part->last;
        }
        piece[i].kept = whole->num_parts - 1;
    }
    bool keeps = whole->num_parts > 1;
    int most = (IMAGE_MAX_CHANNELS - 10 - channels) / values;
    if (keeps && whole->num_parts > most)
        return err_set(e, "%d different sample ranges: at most %d can be merged", whole->num_parts,
                       most);
    size_t all = (size_t)channels + (keeps ? (size_t)(whole->num_parts * values) : 0);
    char(*text)[64] = calloc(all + 1, sizeof *text);
    const char **name = calloc(all + 1, sizeof *name);
    bool ok = (text != NULL && name != NULL) || err_set(e, "out of memory");
    for (int i = 0; ok && i < channels; i++)
        name[i] = layer_names[i];
    for (int k = 0; ok && keeps && k < whole->num_parts; k++)
        for (int i = 0; i < values; i++) {
            struct share_part *p = &whole->part[k];
            p->channel[i] = channels + k * values + i;
            share_part_name(p->first, p->last, i, text[p->channel[i]]);
            name[p->channel[i]] = text[p->channel[i]];
        }
    for (int i = 0; !keeps && i < num; i++)
        piece[i].kept = -1;
    if (ok) {
        /* An image without channels is needed for its attributes. */
        name[all] = "none";
        ok = image_alloc(&whole->im, whole->cell[2], whole->cell[3], all > 0 ? (int)all : 1, name,
                         e);
    }
    if (ok && all == 0)
        whole->im.channels = 0;
    free(text);
    free(name);
    return ok;
}

/* The sample ranges of shares first .. last-1, which are of one cell: sorted, and adjacent ones joined. */
static bool join_ranges(const struct share *share, int first, int last, struct share *out,
                        struct err *e)
{
    int most = 0;
    for (int i = first; i < last; i++)
        most += share[i].num_ranges;
    out->range = calloc((size_t)most + 1, sizeof *out->range);
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

/* Checks that the cells fill a rectangle and have the same samples; fills in cell and ranges of the whole. */
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
    int pieces = 0;
    struct piece *piece = list_pieces(share, num, &pieces, e);
    if (piece == NULL || !find_whole(share, num, &whole, e) ||
        !moments_alloc(&whole.m, whole.cell[2], whole.cell[3], e) ||
        !shape_whole(&whole, piece, pieces, layers, e))
        goto fail;
    strcpy(whole.m.unit, share[0].m.unit);
    whole.m.spp = share[0].m.spp;
    for (int i = 0; i < NUM_COMMON; i++)
        if (!image_set_attr(&whole.im, share_common[i][0],
                            image_get_attr(&share[0].im, share_common[i][0]), e))
            goto fail;
    for (int i = 0; i < pieces; i++)
        if (!add_piece(&whole, &piece[i], layers, e))
            goto fail;
    free(piece);
    *out = whole;
    return true;
fail:
    free(piece);
    share_free(&whole);
    return false;
}
