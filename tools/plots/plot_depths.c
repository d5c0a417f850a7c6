#include "plot_convergence.h"

#include "tools/html/csv_link.h"
#include "tools/html/html.h"
#include "tools/results/results.h"

#include <math.h>

enum { LEFT = 58, TOP = 10, WIDTH = 340, HEIGHT = 240, BOTTOM = TOP + HEIGHT };

/* From 0 to the ends. */
struct axes {
    double right, top;
};

static double at_x(const struct axes *a, double depth)
{
    return LEFT + 12 + (WIDTH - 24) * depth / a->right;
}

static double at_y(const struct axes *a, double v)
{
    return BOTTOM - HEIGHT * fmin(fmax(v, 0), a->top) / a->top;
}

static double tick(double top)
{
    double power = pow(10, floor(log10(top / 5))), share = top / 5 / power;
    return power * (share <= 1 ? 1 : share <= 2 ? 2 : share <= 5 ? 5 : 10);
}

static struct axes axes_of(const json_t *rungs)
{
    struct axes a = {1, 0};
    for (size_t i = 0; i < json_array_size(rungs); i++) {
        const json_t *g = json_array_get(rungs, i);
        a.right = fmax(a.right, member_number(g, "depth"));
        a.top = fmax(a.top, fmax(member_number(g, "mean") + 2 * member_number(g, "se"),
                                 member_number(g, "truth")));
    }
    a.top = a.top > 0 ? 1.08 * a.top : 1;
    return a;
}

static void write_ticks(FILE *f, const struct axes *a)
{
    const double up = tick(a->top), along = fmax(1, tick(2 * a->right));
    for (int i = 0; i * up <= a->top; i++)
        fprintf(f,
                "<path class=\"grid\" d=\"M%d %.1fh%d\"/><text x=\"%d\" y=\"%.1f\" "
                "text-anchor=\"end\">%g</text>",
                LEFT, at_y(a, i * up), WIDTH, LEFT - 6, at_y(a, i * up) + 4, i * up);
    for (int i = 0; i * along <= a->right; i++)
        fprintf(f, "<text x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">%g</text>", at_x(a, i * along),
                BOTTOM + 16, i * along);
}

static void write_line(FILE *f, const struct axes *a, const json_t *rungs, const char *name,
                       const char *style)
{
    const char *op = "M";
    fprintf(f, "<path class=\"%s\" d=\"", style);
    for (size_t i = 0; i < json_array_size(rungs); i++) {
        const json_t *g = json_array_get(rungs, i);
        if (json_object_get(g, name) == NULL)
            continue;
        fprintf(f, "%s%.1f %.1f", op, at_x(a, member_number(g, "depth")),
                at_y(a, member_number(g, name)));
        op = "L";
    }
    fputs("\"/>", f);
}

static void write_points(FILE *f, const struct axes *a, const json_t *rungs)
{
    fputs("<g class=\"e0\">", f);
    write_line(f, a, rungs, "mean", "line");
    for (size_t i = 0; i < json_array_size(rungs); i++) {
        const json_t *g = json_array_get(rungs, i);
        double x = at_x(a, member_number(g, "depth")), mean = member_number(g, "mean"),
               se = member_number(g, "se");
        fprintf(f,
                "<path class=\"line\" d=\"M%.1f %.1fV%.1f\"/><circle class=\"dot\" cx=\"%.1f\" "
                "cy=\"%.1f\" r=\"3\"><title>%.0f bounces: %.5g ± %.2g</title></circle>",
                x, at_y(a, mean - 2 * se), at_y(a, mean + 2 * se), x, at_y(a, mean),
                member_number(g, "depth"), mean, se);
    }
    fputs("</g>", f);
}

static void write_caption(FILE *f, const json_t *depths)
{
    const json_t *rungs = json_object_get(depths, "rungs");
    double largest = 0;
    size_t known = 0;
    for (size_t i = 0; i < json_array_size(rungs); i++) {
        const json_t *g = json_array_get(rungs, i);
        if (json_object_get(g, "truth") == NULL)
            continue;
        double d = member_number(g, "mean") - member_number(g, "truth");
        /* Single precision, as everywhere (tools/docs/background/verdict.md, 1). */
        double se = member_number(g, "se") + 1e-5 * member_number(g, "truth");
        largest = fmax(largest, se > 0 ? fabs(d) / se : 0);
        known++;
    }
    fprintf(
        f,
        "<figcaption><b>Depth ladder.</b> The picture's mean if paths end after so many bounces, %.0f "
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
    for (size_t i = 0; i < json_array_size(rungs); i++) {
        const json_t *g = json_array_get(rungs, i);
        csv_link_number(&csv, member_number(g, "depth"));
        csv_link_number(&csv, member_number(g, "mean"));
        csv_link_number(&csv, member_number(g, "se"));
        csv_link_number(&csv,
                        json_object_get(g, "truth") != NULL ? member_number(g, "truth") : NAN);
        csv_link_line(&csv);
    }
    csv_link_close(&csv);
    fputs("</figcaption>", f);
}

void plot_depths(FILE *f, const json_t *depths)
{
    const json_t *rungs = json_object_get(depths, "rungs");
    const char *error = member_text(depths, "error");
    if (error != NULL) {
        fputs("<p class=\"error-line\">No depth ladder: ", f);
        html_text(f, error);
        fputs("</p>\n", f);
    }
    if (json_array_size(rungs) == 0)
        return;
    struct axes a = axes_of(rungs);
    fprintf(f,
            "<figure class=\"map\"><svg class=\"plot depths\" viewBox=\"0 0 %d %d\" role=\"img\" "
            "aria-label=\"Mean radiance against the greatest number of bounces\">",
            LEFT + WIDTH + 14, BOTTOM + 40);
    write_ticks(f, &a);
    fprintf(f, "<path class=\"axis\" d=\"M%d %dV%dH%d\"/>", LEFT, TOP, BOTTOM, LEFT + WIDTH);
    write_points(f, &a, rungs);
    write_line(f, &a, rungs, "truth", "expected");
    fprintf(f,
            "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">greatest number of bounces</text><text "
            "transform=\"translate(11 %d) rotate(-90)\" text-anchor=\"middle\">mean radiance, W "
            "sr⁻¹ m⁻²</text></svg>",
            LEFT + WIDTH / 2, BOTTOM + 34, TOP + HEIGHT / 2);
    write_caption(f, depths);
    fputs("</figure>\n", f);
}
