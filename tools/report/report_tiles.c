#include "report_tiles.h"

#include "tools/html/html.h"
#include "tools/results/results.h"

#include <math.h>

enum { SHOWN = 8 };

struct tile {
    size_t index;
    double log10_p;
};

/* Puts one that comes after all in `tile` among the SHOWN smallest, in their order. */
static void keep_smallest(struct tile tile[SHOWN], size_t num, struct tile one)
{
    size_t i = num < SHOWN ? num : SHOWN;
    if (i == SHOWN && one.log10_p >= tile[SHOWN - 1].log10_p)
        return;
    i -= i == SHOWN;
    for (; i > 0 && tile[i - 1].log10_p > one.log10_p; i--)
        tile[i] = tile[i - 1];
    tile[i] = one;
}

void report_tiles(FILE *f, const json_t *claim)
{
    const json_t *log10_p = json_object_get(claim, "tile_log10_p"),
                 *t = json_object_get(claim, "tile_t");
    size_t num = 0, size = json_array_size(log10_p),
           columns = (size_t)member_number(claim, "tiles_x");
    double side = member_number(claim, "tile");
    struct tile tile[SHOWN] = {{0}};
    for (size_t i = 0; i < size; i++) {
        const json_t *p = json_array_get(log10_p, i);
        if (json_is_number(p))
            keep_smallest(tile, num++, (struct tile){i, json_number_value(p)});
    }
    if (num > 0 && columns > 0) {
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
                    html_number(json_number_value(json_array_get(t, k->index))).s);
        }
        fputs(
            "</div>\n<p class=\"caption tile-reading\" aria-live=\"polite\">Each is x, y of its "
            "corner; p asks if the tile's means are equal, without a margin. The first is outlined "
            "in the maps. Press one to mark and enlarge it, or a tile in any image to mark "
            "it.</p></div>\n",
            f);
    }
}
