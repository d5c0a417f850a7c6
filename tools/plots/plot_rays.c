#include "plot_rays.h"

#include "tools/html/csv_link.h"
#include "tools/html/html.h"
#include "tools/results/results.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct bar {
    const char *scene;              /* borrowed */
    double rays, boxes, primitives; /* tests of a ray */
};

static int most_first(const void *a, const void *b)
{
    const struct bar *x = a, *y = b;
    double s = x->boxes + x->primitives, t = y->boxes + y->primitives;
    return s != t ? (s < t ? 1 : -1) : strcmp(x->scene, y->scene);
}

static size_t gather(const json_t *claims, struct bar *bar)
{
    size_t num = 0;
    for (size_t i = 0; i < json_array_size(claims); i++) {
        const json_t *c = json_array_get(claims, i), *r = json_object_get(c, "rays_a");
        double rays = member_number(r, "rays");
        bool known = false;
        for (size_t k = 0; k < num; k++)
            known |= strcmp(bar[k].scene, member_text(c, "scene")) == 0;
        if (known || !(rays > 0))
            continue;
        bar[num++] = (struct bar){.scene = member_text(c, "scene"),
                                  .rays = rays,
                                  .boxes = member_number(r, "box_tests") / rays,
                                  .primitives = member_number(r, "primitive_tests") / rays};
    }
    qsort(bar, num, sizeof *bar, most_first);
    return num;
}

/* 1, 2 or 5 times a power of ten: the distance of at most 5 ticks up to `top`. */
static double tick(double top)
{
    double power = pow(10, floor(log10(top / 5))), share = top / 5 / power;
    return power * (share <= 1 ? 1 : share <= 2 ? 2 : share <= 5 ? 5 : 10);
}

static void write_plot(FILE *f, const struct bar *bar, size_t num)
{
    enum { LEFT = 170, TOP = 8, WIDTH = 460, ROW = 18 };
    int bottom = TOP + ROW * (int)num;
    double top = 1.05 * (bar[0].boxes + bar[0].primitives);
    fprintf(
        f,
        "<svg class=\"plot rays\" viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"Box and primitive tests of a "
        "ray in %zu scenes; the numbers are in the CSV file\">",
        LEFT + WIDTH + 50, bottom + 40, num);
    const double step = tick(top);
    for (int i = 0; i * step <= top; i++) {
        double at = LEFT + WIDTH * i * step / top;
        fprintf(f,
                "<path class=\"grid\" d=\"M%.1f %dV%d\"/><text x=\"%.1f\" y=\"%d\" "
                "text-anchor=\"middle\">%g</text>",
                at, TOP, bottom, at, bottom + 16, i * step);
    }
    for (size_t i = 0; i < num; i++) {
        double y = TOP + ROW * (double)i, boxes = WIDTH * bar[i].boxes / top,
               primitives = WIDTH * bar[i].primitives / top;
        fprintf(f, "<text x=\"%d\" y=\"%.0f\" text-anchor=\"end\">", LEFT - 6, y + 13);
        html_text(f, bar[i].scene);
        fprintf(
            f,
            "</text><g><title>%.3g rays, of each %.3g box and %.3g primitive tests</title><rect class=\"bar\" "
            "x=\"%d\" y=\"%.0f\" width=\"%.1f\" height=\"%d\"/><rect class=\"bar second\" x=\"%.1f\" y=\"%.0f\" "
            "width=\"%.1f\" height=\"%d\"/></g><text x=\"%.1f\" y=\"%.0f\">%s</text>",
            bar[i].rays, bar[i].boxes, bar[i].primitives, LEFT, y + 3, boxes, ROW - 6, LEFT + boxes,
            y + 3, primitives, ROW - 6, LEFT + boxes + primitives + 5, y + 13,
            html_number(bar[i].boxes + bar[i].primitives).s);
    }
    fprintf(f,
            "<path class=\"axis\" d=\"M%d %dV%dH%d\"/><text x=\"%d\" y=\"%d\" "
            "text-anchor=\"middle\">tests of a ray</text></svg></div>\n",
            LEFT, TOP, bottom, LEFT + WIDTH, LEFT + WIDTH / 2, bottom + 34);
}

bool plot_rays(FILE *f, const json_t *claims, struct err *e)
{
    struct bar *bar = calloc(json_array_size(claims) + 1, sizeof *bar);
    if (bar == NULL)
        return err_set(e, "out of memory for the report");
    size_t num = gather(claims, bar);
    if (num > 0) {
        fputs(
            "<section id=\"rays\">\n<h2>What a ray costs</h2>\n<figure><div class=\"wide plain\" tabindex=\"0\" role=\"region\" aria-label=\"Plot of tests of a ray\">",
            f);
        write_plot(f, bar, num);
        fputs(
            "<figcaption><b>Tests of a ray.</b> Filled: with boxes of the hierarchy; outlined: with primitives. A test is "
            "of a node or a leaf, of up to eight boxes or triangles at once, and packets of rays share some, so that "
            "it may be less than one. What is fast has short bars; a bar that has grown since the last commit is work "
            "that the hierarchy no longer saves. Unlike times these counts do not depend on how busy the machine was. ",
            f);
        struct csv csv =
            csv_link_open(f, "rays.csv", "scene,rays,box_tests_per_ray,primitive_tests_per_ray");
        for (size_t i = 0; i < num; i++) {
            csv_link_text(&csv, bar[i].scene);
            csv_link_number(&csv, bar[i].rays);
            csv_link_number(&csv, bar[i].boxes);
            csv_link_number(&csv, bar[i].primitives);
            csv_link_line(&csv);
        }
        csv_link_close(&csv);
        fputs("</figcaption></figure>\n</section>\n", f);
    }
    free(bar);
    return true;
}
