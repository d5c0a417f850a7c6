#include "plot_rays.h"

#include "plot.h"

#include "tools/html/csv_link.h"
#include "tools/html/html.h"
#include "tools/results/results.h"

#include <stdlib.h>
#include <string.h>

struct bar {
    const char *scene;              /* borrowed */
    double rays, boxes, primitives; /* boxes, primitives: tests per ray */
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
    json_each(c, claims) {
        const json_t *r = json_object_get(c, "rays_a");
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

static void draw(FILE *f, const struct bar *bar, size_t num)
{
    struct plot p = plot_sized(f, 460, 18 * (double)num);
    p.style = "plot rays";
    p.left = 170;
    p.right = 50;
    p.x = (struct plot_axis){.label = "tests of a ray",
                             .hi = 1.05 * (bar[0].boxes + bar[0].primitives),
                             .has_grid = true};
    p.y.hi = (double)num;
    plot_open(&p, "Box and primitive tests of a ray in %zu scenes; the numbers are in the CSV file",
              num);
    for (size_t i = 0; i < num; i++) {
        double y = (double)(num - i), boxes = bar[i].boxes, all = boxes + bar[i].primitives;
        char hover[128];
        snprintf(hover, sizeof hover, "%.3g rays, of each %.3g box and %.3g primitive tests",
                 bar[i].rays, boxes, bar[i].primitives);
        plot_text(&p, 0, y - 0.5, -6, 4, "end", "%s", bar[i].scene);
        plot_bar(&p, "bar", 0, y - 0.83, boxes, y - 0.17, "%s", hover);
        plot_bar(&p, "bar second", boxes, y - 0.83, all, y - 0.17, "%s", hover);
        plot_text(&p, all, y - 0.5, 5, 4, "start", "%s", html_number(all).s);
    }
    plot_close(&p);
    fputs("</div>\n", f);
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
        draw(f, bar, num);
        fputs(
            "<figcaption><b>Tests of a ray.</b> Filled: with boxes of the hierarchy; outlined: with primitives. A test is "
            "of a node or a leaf, of up to eight boxes or triangles at once, and packets of rays share some, so that "
            "it may be less than one. What is fast has short bars; a bar that has grown since the last commit is work "
            "that the hierarchy no longer saves. Unlike times these counts do not depend on how busy the machine was. ",
            f);
        struct csv csv =
            csv_link_open(f, "rays.csv", "scene,rays,box_tests_per_ray,primitive_tests_per_ray");
        for (size_t i = 0; i < num; i++)
            csv_link_row(&csv, "tnnn", bar[i].scene, bar[i].rays, bar[i].boxes, bar[i].primitives);
        csv_link_close(&csv);
        fputs("</figcaption></figure>\n</section>\n", f);
    }
    free(bar);
    return true;
}
