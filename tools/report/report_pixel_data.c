/* The numbers behind the page's images, packed (pixel_codec.h) and written as base64; the
 * browser computes the maps from them (tools/html/page_maps.js). */
#include "tools/images/pixel_codec.h"
#include "tools/html/plot_colour.h"
#include "tools/html/html.h"
#include "report_internal.h"

#include <stdlib.h>
#include <string.h>

/* A page of several scenes stays below 3 MB: the numbers of images and maps get what the text leaves.
 * The page of one scene has them whatever their size. */
enum { PAGE_LIMIT = 3000000, PAGE_RESERVE = 100000 };

bool report_pixel_data_add(struct page *p, const char *path, const struct moments *m, size_t *index,
                           struct err *e)
{
    for (*index = 0; *index < p->num_layers; ++*index)
        if (strcmp(p->layer[*index].path, path) == 0)
            return true;
    struct page_layer *grown = realloc(p->layer, (p->num_layers + 1) * sizeof *grown);
    if (grown == NULL)
        return err_set(e, "out of memory for the report");
    p->layer = grown;
    struct page_layer *l = &grown[*index];
    bool uniform;
    *l = (struct page_layer){
        .path = strdup(path), .width = m->width, .height = m->height, .spp = m->spp};
    if (l->path == NULL)
        return err_set(e, "out of memory for the report");
    memcpy(l->unit, m->unit, sizeof l->unit);
    if (!pixel_codec_encode(m, p->folded ? 2 : 0, &l->bytes, &l->size, &uniform, e)) {
        free(l->path);
        return false;
    }
    l->n = uniform ? m->n[0] : 0;
    p->num_layers++;
    return true;
}

/* Ends a <script> tag and writes its content as base64. */
static void write_bytes(FILE *f, const void *bytes, size_t size)
{
    fputs("\">", f);
    html_base64(f, bytes, size);
    fputs("</script>\n", f);
}

static void write_colours(FILE *f)
{
    enum { DIVERGING = 257, SEQUENTIAL = 256 };
    uint8_t colour[3 * (DIVERGING + SEQUENTIAL)];
    for (int i = 0; i < DIVERGING; i++)
        plot_diverging_rgb8(2.0 * i / (DIVERGING - 1) - 1, &colour[3 * i]);
    for (int i = 0; i < SEQUENTIAL; i++)
        plot_sequential_rgb8((double)i / (SEQUENTIAL - 1), &colour[3 * (DIVERGING + i)]);
    fputs("<script type=\"text/plain\" id=\"colours", f);
    write_bytes(f, colour, sizeof colour);
}

/* Has the page room for that many bytes as base64? */
static bool has_room(const struct page *p, size_t size)
{
    long here = ftell(p->f);
    return here >= 0 &&
           (p->num_scenes <= 1 || (size_t)here + size * 4 / 3 + PAGE_RESERVE <= PAGE_LIMIT);
}

void report_pixel_data_write(struct page *p)
{
    size_t left_out = 0, maps = 0, maps_left_out = 0;
    if (p->num_layers > 0)
        write_colours(p->f);
    for (size_t i = 0; i < p->num_layers; i++) {
        const struct page_layer *l = &p->layer[i];
        if (!has_room(p, l->size)) {
            left_out++;
            continue;
        }
        html_print(p->f,
                   "<script type=\"text/plain\" id=\"layer-%zu\" data-width=\"%d\" "
                   "data-height=\"%d\" data-n=\"%.9g\" data-spp=\"%.9g\" data-unit=\"%s",
                   i, l->width, l->height, l->n, l->spp, l->unit);
        write_bytes(p->f, l->bytes, l->size);
    }
    for (size_t i = 0; i < p->num_alike; i++) {
        const struct page_alike *n = &p->alike[i];
        if (n->bytes == NULL)
            continue;
        maps++;
        if (!has_room(p, n->size)) {
            maps_left_out++;
            continue;
        }
        fprintf(p->f,
                "<script type=\"text/plain\" id=\"flip-%zu\" data-width=\"%d\" data-height=\"%d",
                n->claim.index, n->width, n->height);
        write_bytes(p->f, n->bytes, n->size);
    }
    if (left_out > 0)
        fprintf(
            p->f,
            "<p class=\"caption\">To stay below 3 MB this page leaves out the numbers of %zu of "
            "its %zu images, and with them the images.</p>\n",
            left_out, p->num_layers);
    if (maps_left_out > 0)
        fprintf(p->f,
                "<p class=\"caption\">To stay below 3 MB this page leaves out %zu of its %zu FLIP "
                "maps.</p>\n",
                maps_left_out, maps);
}

void report_pixel_data_free(struct page *p)
{
    for (size_t i = 0; i < p->num_layers; i++) {
        free(p->layer[i].path);
        free(p->layer[i].bytes);
    }
    free(p->layer);
    for (size_t i = 0; i < p->num_alike; i++)
        free(p->alike[i].bytes);
    free(p->alike);
}
