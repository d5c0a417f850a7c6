#include "report_tiles.h"

#include "report_html.h"
#include "results.h"

#include <math.h>
#include <stdlib.h>

enum { SHOWN = 8 };

struct tile {
    size_t index;
    double log10_p;
};

static int compare_tiles(const void *a, const void *b)
{
    const struct tile *x = a, *y = b;
    if (x->log10_p != y->log10_p)
        return x->log10_p < y->log10_p ? -1 : 1;
    return (x->index > y->index) - (x->index < y->index);
}

void report_tiles(FILE *f, const json_t *claim)
{
    const json_t *log10_p = json_object_get(claim, "tile_log10_p"),
                 *t = json_object_get(claim, "tile_t");
    size_t num = 0, size = json_array_size(log10_p),
           columns = (size_t)member_number(claim, "tiles_x");
    double side = member_number(claim, "tile");
    struct tile *tile = calloc(size + 1, sizeof *tile);
    for (size_t i = 0; tile != NULL && i < size; i++)
        if (json_is_number(json_array_get(log10_p, i)))
            tile[num++] = (struct tile){i, json_number_value(json_array_get(log10_p, i))};
    if (num > 0 && columns > 0) {
        qsort(tile, num, sizeof *tile, compare_tiles);
        fprintf(f,
                "<div class=\"tiles\"><h4>The tiles of smallest p, of %zu</h4>\n<div "
                "class=\"tabs\">\n",
                num);
        for (size_t i = 0; i < num && i < SHOWN; i++) {
            const struct tile *k = &tile[i];
            fprintf(f,
                    "<button type=\"button\" data-x=\"%.0f\" data-y=\"%.0f\">%.0f, %.0f: p %.2g, "
                    "t %s</button>\n",
                    side * (double)(k->index % columns), side * (double)(k->index / columns),
                    side * (double)(k->index % columns), side * (double)(k->index / columns),
                    pow(10, fmin(k->log10_p, 0)),
                    plain_number(json_number_value(json_array_get(t, k->index))).s);
        }
        fputs("</div>\n<p class=\"caption tile-reading\" aria-live=\"polite\">Each is x, y of its "
              "corner; p asks if the tile's means are equal, without a margin. Press one to mark "
              "and enlarge it, or a tile in any picture to mark it.</p></div>\n",
              f);
    }
    free(tile);
}
