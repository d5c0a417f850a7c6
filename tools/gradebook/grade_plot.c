#include "student_page.h"

#include "tools/html/html.h"
#include "tools/results/results.h"

#include <math.h>
#include <string.h>

void grade_plot_difference(FILE *f, const json_t *check, double width, double height)
{
    const json_t *values = json_object_get(check, "relative"),
                 *tile = json_object_get(check, "tile");
    bool exact = strcmp(member_or_empty(check, "kind"), "exact") == 0;
    size_t columns = (size_t)(width / GRADE_TILE), i;
    json_t *v;
    if (json_array_size(values) == 0 || columns == 0)
        return;
    fprintf(f, "<figure><svg width=\"%d\" viewBox=\"0 0 %g %g\" role=\"img\">", GRADE_SHOWN, width,
            height);
    json_array_foreach(values, i, v)
    {
        double d = json_number_value(v), strength = fmin(1, fabs(d) / 0.5);
        int other = (int)(255 * (1 - strength));
        double x = (double)(i % columns * GRADE_TILE), y = (double)(i / columns * GRADE_TILE);
        fprintf(f, "<rect x=\"%g\" y=\"%g\" width=\"8\" height=\"8\" fill=\"", x, y);
        if (!json_is_number(v))
            fputs("#bbb\"/>", f);
        else
            fprintf(f, "rgb(%d,%d,%d)\"><title>%+.1f %%</title></rect>", d > 0 ? 255 : other, other,
                    d > 0 ? other : 255, 100 * d);
    }
    if (json_array_size(tile) == 2)
        fprintf(
            f,
            "<rect x=\"%g\" y=\"%g\" width=\"8\" height=\"8\" fill=\"none\" stroke=\"#000\" stroke-width=\".6\"/>",
            json_number_value(json_array_get(tile, 0)), json_number_value(json_array_get(tile, 1)));
    fprintf(f,
            "</svg><figcaption>%s, 8 × 8 pixels each; framed: the furthest</figcaption></figure>\n",
            exact ? "share of the pixels that differ, full colour from 50 %"
                  : "difference: red too bright, blue too dark, full colour from 50 %");
}

/* Where on 0 .. 360 a difference of so many times the margin stands: twice it at the ends. */
static double place(double v)
{
    return 180 + 90 * fmax(-2, fmin(2, v));
}

static void show_interval(FILE *f, const json_t *v, double y)
{
    double none = member_number(v, "none"), full = member_number(v, "full") / none,
           lo = place(member_number(v, "lo") / none), hi = place(member_number(v, "hi") / none);
    fprintf(f,
            "<rect x=\"90\" y=\"%g\" width=\"180\" height=\"16\" fill=\"#f3ead0\"/>"
            "<rect x=\"%.1f\" y=\"%g\" width=\"%.1f\" height=\"16\" fill=\"#cfe8cf\"/>",
            y, place(-full), y, place(full) - place(-full));
    fprintf(f,
            "<rect x=\"%.1f\" y=\"%g\" width=\"%.1f\" height=\"4\" fill=\"#222\"/>"
            "<circle cx=\"%.1f\" cy=\"%g\" r=\"4\"/><text x=\"378\" y=\"%g\">",
            lo, y + 6, fmax(1, hi - lo), place(member_number(v, "value") / none), y + 8, y + 12);
    html_text(f, member_or_empty(v, "what"));
    fprintf(f, " %+.1f %% (%+.1f to %+.1f)</text>\n", 100 * member_number(v, "value"),
            100 * member_number(v, "lo"), 100 * member_number(v, "hi"));
}

void grade_plot_intervals(FILE *f, const json_t *check)
{
    const json_t *list = json_object_get(check, "intervals");
    size_t num = json_array_size(list), i;
    json_t *v;
    if (num == 0)
        return;
    fprintf(f,
            "<figure><svg width=\"600\" viewBox=\"0 0 600 %zu\" role=\"img\" font-size=\"11\">\n",
            20 * num + 18);
    json_array_foreach(list, i, v) show_interval(f, v, 20 * (double)i);
    fprintf(
        f,
        "<line x1=\"180\" x2=\"180\" y1=\"0\" y2=\"%zu\" stroke=\"#888\"/>"
        "<text x=\"110\" y=\"%zu\">too dark</text><text x=\"195\" y=\"%zu\">too bright</text></svg>"
        "<figcaption>by how much, with the noise of your picture: all points while a bar touches "
        "green, none once it has left yellow</figcaption></figure>\n",
        20 * num, 20 * num + 12, 20 * num + 12);
}
