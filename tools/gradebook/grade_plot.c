/* Plots of a check on the pages of grades: the difference by tiles, and intervals against
 * margins. */
#include "grade_images.h"
#include "student_page.h"

#include "tools/plots/plot.h"
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
    fprintf(
        f,
        "<figure><svg width=\"%d\" viewBox=\"0 0 %g %g\" role=\"img\" aria-label=\"Tiles of the image by their difference\">",
        GRADE_SHOWN, width, height);
    json_array_foreach(values, i, v) {
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

enum { ROW = 34 };

/* One row: what it is about above its bar. */
static void draw_interval(struct plot *p, const json_t *v, double y)
{
    double none = member_number(v, "none"), full = member_number(v, "full"),
           value = member_number(v, "value"), lo = member_number(v, "lo"),
           hi = member_number(v, "hi");
    char text[128];
    snprintf(text, sizeof text, "%.60s %+.1f %% (%+.1f to %+.1f)", member_or_empty(v, "what"),
             100 * value, 100 * lo, 100 * hi);
    plot_bar(p, "none", -100 * none, y + 0.1, 100 * none, y + 0.5, "no points beyond ±%.3g %%",
             100 * none);
    plot_bar(p, "all", -100 * full, y + 0.1, 100 * full, y + 0.5, "all points within ±%.3g %%",
             100 * full);
    plot_segment(p, "expected", 0, y, 0, y + 0.55);
    plot_segment(p, "interval", 100 * lo, y + 0.3, 100 * hi, y + 0.3);
    if (fabs(100 * value) > p->x.hi)
        plot_arrow(p, value > 0, y + 0.3, "%s", text);
    else
        plot_point(p, 0, 100 * value, y + 0.3, "%s", text);
    plot_text(p, p->x.lo, y + 0.6, 4, 0, "start", "%s", text);
}

void grade_plot_intervals(FILE *f, const json_t *check)
{
    const json_t *list = json_object_get(check, "intervals");
    size_t num = json_array_size(list);
    double most = 0;
    json_each(v, list)
        most = fmax(most, 200 * member_number(v, "none"));
    if (num == 0 || !(most > 0))
        return;
    struct plot p = plot_sized(f, 312, ROW * (double)num);
    p.style = "plot grades";
    p.left = 14;
    p.right = 24;
    p.x = (struct plot_axis){
        .label = "difference, %: − too dark, + too bright", .lo = -most, .hi = most};
    p.y.hi = (double)num;
    fputs("<figure class=\"numbers\">", f);
    plot_open(&p, "Differences with their intervals, beside the margins");
    for (size_t i = 0; i < num; i++)
        draw_interval(&p, json_array_get(list, i), (double)(num - 1 - i));
    plot_close(&p);
    fputs("<figcaption>by how much, with the noise of the image: all points while a bar touches "
          "green, none once it has left yellow; fewer if it is longer than the yellow field, as "
          "the image is then too noisy to tell</figcaption></figure>\n",
          f);
}
