/* Shares of an image as files. */
#include "merge.h"

#include "renderer/pathtracer/render_id.h"
#include "share_internal.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const share_common[NUM_COMMON][2] = {{"assay:version", "version of the program"},
                                                 {"assay:scene", "scene (SHA-256)"},
                                                 {"assay:settings", "settings"},
                                                 {"assay:adaptive", "adaptive mode"},
                                                 {"assay:seed", "seed"}};

/* Channel name of one of the PART_VALUES. */
static const char *share_part_channel(int value)
{
    static const char *const moments[10] = {"R",    "G",    "B",    "M2.R", "M2.G",
                                            "M2.B", "M3.R", "M3.G", "M3.B", "n"};
    return value < 10 ? moments[value] : layer_names[value - 10];
}

/* Parses "A:B,C:D", in ascending order; apart: they must be disjoint (parts of different cells may overlap). */
static bool parse_ranges(const char *text, bool apart, const char *path, uint32_t (**range)[2],
                         int *num, struct err *e)
{
    size_t most = 1;
    for (const char *c = text; *c != '\0'; c++)
        most += *c == ',';
    *range = calloc(most, sizeof **range);
    if (*range == NULL)
        return err_set(e, "%s: out of memory", path);
    const char *at = text;
    for (long long after = 0; (size_t)*num < most; at++) {
        char *colon, *end;
        long long a = strtoll(at, &colon, 10), b = -1;
        bool ok = isdigit((unsigned char)*at) && *colon == ':' && isdigit((unsigned char)colon[1]);
        if (ok)
            b = strtoll(colon + 1, &end, 10);
        if (!ok || a < after || b < a || b > UINT32_MAX || (*end != ',' && *end != '\0'))
            return err_set(e, "%s: assay:%s '%.64s' are not sample ranges", path,
                           apart ? "samples" : "parts", text);
        (*range)[*num][0] = (uint32_t)a;
        (*range)[(*num)++][1] = (uint32_t)b;
        after = apart ? b : a;
        at = end;
        if (*end == '\0')
            break;
    }
    return true;
}

/* Finds the channels of a part; kept: it is one of several, and their names begin with "A:B.". */
static bool find_channels(const struct share *s, struct share_part *p, bool kept, struct err *e)
{
    for (int i = 0; i < PART_VALUES; i++) {
        char name[64];
        if (kept)
            share_part_name(p->first, p->last, i, name);
        p->channel[i] = image_channel(&s->im, kept ? name : share_part_channel(i));
        if (i < 10 && p->channel[i] < 0)
            return err_set(e, "%s: lacks channel %s", s->path, kept ? name : share_part_channel(i));
    }
    return true;
}

/* Checks the parts against the whole: in every pixel their samples add up to its n, and their values are valid
 * moments. */
static bool check_parts(const struct share *s, struct err *e)
{
    size_t pixels = (size_t)s->m.width * (size_t)s->m.height;
    for (size_t q = 0; q < pixels; q++) {
        const float *px = s->im.data + q * (size_t)s->im.channels;
        double n = 0;
        for (int k = 0; k < s->num_parts; k++) {
            const int *c = s->part[k].channel;
            bool ok = px[c[9]] >= 0 && px[c[9]] <= s->part[k].last - s->part[k].first;
            for (int i = 0; i < 10; i++)
                ok = ok && isfinite(px[c[i]]) && (i < 3 || i > 5 || px[c[i]] >= 0);
            if (!ok)
                return err_set(e, "%s: part %lu:%lu of pixel (%zu, %zu) is no moments", s->path,
                               (unsigned long)s->part[k].first, (unsigned long)s->part[k].last,
                               q % (size_t)s->m.width, q / (size_t)s->m.width);
            n += px[c[9]];
        }
        if (n != s->m.n[q])
            return err_set(e, "%s: the parts of pixel (%zu, %zu) are not its samples", s->path,
                           q % (size_t)s->m.width, q / (size_t)s->m.width);
    }
    return true;
}

static bool find_parts(struct share *s, struct err *e)
{
    const char *text = image_get_attr(&s->im, "assay:parts");
    uint32_t whole[1][2] = {{s->range[0][0], s->range[s->num_ranges - 1][1]}}, (*range)[2] = NULL;
    int num = 0;
    bool ok = text == NULL || parse_ranges(text, false, s->path, &range, &num, e);
    if (ok && text == NULL)
        num = 1;
    s->part = ok ? calloc((size_t)num, sizeof *s->part) : NULL;
    ok = ok && (s->part != NULL || err_set(e, "%s: out of memory", s->path));
    for (int i = 0; ok && i < num; i++) {
        struct share_part *p = &s->part[s->num_parts++];
        p->first = text != NULL ? range[i][0] : whole[0][0];
        p->last = text != NULL ? range[i][1] : whole[0][1];
        ok = find_channels(s, p, text != NULL, e);
    }
    free(range);
    return ok && (text == NULL || check_parts(s, e));
}

bool share_read(const char *path, struct share *s, struct err *e)
{
    *s = (struct share){.path = path};
    if (!moments_read(path, &s->m, &s->im, e))
        return false;
    const char *cell = image_get_attr(&s->im, "assay:cell");
    const char *samples = image_get_attr(&s->im, "assay:samples");
    bool ok = cell != NULL && samples != NULL && render_id_parse_cell(cell, s->cell) &&
              s->cell[2] == s->m.width && s->cell[3] == s->m.height;
    for (int i = 0; i < NUM_COMMON; i++)
        ok = ok && image_get_attr(&s->im, share_common[i][0]) != NULL;
    if (!ok)
        err_set(e,
                "%s: does not say which part of which image it is (attributes assay:cell, "
                "assay:samples, assay:scene, ...)",
                path);
    ok = ok && parse_ranges(samples, true, s->path, &s->range, &s->num_ranges, e) &&
         find_parts(s, e);
    if (!ok)
        share_free(s);
    return ok;
}

void share_free(struct share *s)
{
    moments_free(&s->m);
    image_free(&s->im);
    free(s->range);
    free(s->part);
    *s = (struct share){0};
}

void share_part_name(uint32_t first, uint32_t last, int value, char name[64])
{
    snprintf(name, 64, "%lu:%lu.%s", (unsigned long)first, (unsigned long)last,
             share_part_channel(value));
}

/* "A:B,C:D" of num ranges, each the first two uint32_t of an element of `stride` bytes; to free(). NULL: out of
 * memory. */
static char *write_ranges(const void *range, int num, size_t stride)
{
    enum { RANGE = 24 };
    size_t size = (size_t)num * RANGE + 1, n = 0;
    char *text = malloc(size);
    if (text == NULL)
        return NULL;
    text[0] = '\0';
    for (int i = 0; i < num; i++) {
        uint32_t ends[2];
        memcpy(ends, (const char *)range + (size_t)i * stride, sizeof ends);
        n += (size_t)snprintf(text + n, size - n, "%s%lu:%lu", i > 0 ? "," : "",
                              (unsigned long)ends[0], (unsigned long)ends[1]);
    }
    return text;
}

bool share_write(const char *path, const struct share *s, const char *command, struct err *e)
{
    char cell[64];
    char *samples = write_ranges(s->range, s->num_ranges, sizeof *s->range);
    char *parts = write_ranges(s->part, s->num_parts, sizeof *s->part);
    render_id_cell(s->cell, s->cell[4], s->cell[5], cell);
    struct image_attr attrs[NUM_COMMON + 4] = {
        {"assay:command", command}, {"assay:cell", cell}, {"assay:samples", samples}};
    int num = 3;
    for (int i = 0; i < NUM_COMMON; i++)
        attrs[num++] =
            (struct image_attr){share_common[i][0], image_get_attr(&s->im, share_common[i][0])};
    if (s->num_parts > 1)
        attrs[num++] = (struct image_attr){"assay:parts", parts};
    bool ok = (samples != NULL && parts != NULL) || err_set(e, "%s: out of memory", path);
    ok = ok && moments_write_layers(path, &s->m, s->im.channels > 0 ? &s->im : NULL, attrs, num, e);
    free(samples);
    free(parts);
    return ok;
}
