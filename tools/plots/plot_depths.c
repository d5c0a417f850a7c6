/* Plot of the depth ladder: mean radiance against the greatest number of bounces. */
#include "plot.h"
#include "plot_convergence.h"

#include "tools/html/csv_link.h"
#include "tools/html/html.h"
#include "tools/results/results.h"

#include <math.h>

static void draw(FILE *f, const json_t *rungs)
{
    double right = 1, top = 0;
    json_each(g, rungs) {
        right = fmax(right, member_number(g, "depth"));
        top = fmax(top, fmax(member_number(g, "mean") + 2 * member_number(g, "se"),
                             member_number(g, "truth")));
    }
    struct plot p = plot_sized(f, 340, 240);
    p.style = "plot depths";
    p.x = (struct plot_axis){.label = "greatest number of bounces",
                             .lo = -0.04 * right,
                             .hi = 1.04 * right,
                             .step = right < 5 ? 1 : 0};
    p.y = (struct plot_axis){
        .label = "mean radiance, W sr⁻¹ m⁻²", .hi = top > 0 ? 1.08 * top : 1, .has_grid = true};
    plot_open(&p, "Mean radiance against the greatest number of bounces");
    plot_series(&p, 0, NULL);
    json_each(g, rungs) {
        double x = member_number(g, "depth"), y = member_number(g, "mean"),
               se = member_number(g, "se");
        plot_line_to(&p, x, y);
        plot_segment(&p, "line", x, y - 2 * se, x, y + 2 * se);
        plot_point(&p, 0, x, y, "%.0f bounces: %.5g ± %.2g", x, y, se);
    }
    plot_series_end(&p);
    plot_path_open(&p, "expected");
    json_each(g, rungs) {
        if (json_object_get(g, "truth") != NULL)
            plot_path_to(&p, member_number(g, "depth"), member_number(g, "truth"));
    }
    plot_path_close(&p, false);
    plot_close(&p);
}

static void write_caption(FILE *f, const json_t *depths)
{
    const json_t *rungs = json_object_get(depths, "rungs");
    double largest = 0;
    size_t known = 0;
    json_each(g, rungs) {
        if (json_object_get(g, "truth") == NULL)
            continue;
        double d = member_number(g, "mean") - member_number(g, "truth");
        /* With the tolerance for float32 of all comparisons (tools/docs/background/verdict.md, 1). */
        double se = member_number(g, "se") + 1e-5 * member_number(g, "truth");
        largest = fmax(largest, se > 0 ? fabs(d) / se : 0);
        known++;
    }
    fprintf(
        f,
        "<figcaption><b>Depth ladder</b> of our path tracer. The image's mean if paths end after so many bounces, %.0f "
        "samples per pixel: 0 is what lamps show of themselves, 1 adds direct light, each further step what one "
        "more bounce brings. Late steps must shrink; a step that is missing, or comes one too late, is a wrong depth. "
        "Strokes are ±2 standard errors. ",
        member_number(depths, "samples"));
    if (known > 0)
        fprintf(
            f,
            "Dashed: the closed form, known at %zu of %zu depths, at most %.2g standard errors away. It is "
            "shown, not judged. ",
            known, json_array_size(rungs), largest);
    struct csv csv = csv_link_open(f, "depths.csv", "depth,mean,standard_error,closed_form");
    json_each(g, rungs)
        csv_link_row(&csv, "mmmm", g, "depth", g, "mean", g, "se", g, "truth");
    csv_link_close(&csv);
    fputs("</figcaption>", f);
}

void plot_depths(FILE *f, const json_t *depths)
{
    const json_t *rungs = json_object_get(depths, "rungs");
    const char *error = member_text(depths, "error");
    if (error != NULL)
        html_print(f, "<p class=\"error-line\">No depth ladder: %s</p>\n", error);
    if (json_array_size(rungs) == 0)
        return;
    fputs("<figure class=\"map\">", f);
    draw(f, rungs);
    write_caption(f, depths);
    fputs("</figure>\n", f);
}
