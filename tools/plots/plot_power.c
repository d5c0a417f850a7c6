#include "plot_power.h"

#include "tools/html/csv_link.h"
#include "tools/html/html.h"
#include "tools/results/results.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_sort.h>

enum { LEFT = 44, TOP = 8, WIDTH = 300, HEIGHT = 200, BOTTOM = TOP + HEIGHT };

static void write_frame(FILE *f, const char *label, const char *x, const char *y)
{
    fprintf(
        f,
        "<figure class=\"map\"><svg class=\"plot\" text-anchor=\"middle\" viewBox=\"0 0 %d %d\" role=\"img\" "
        "aria-label=\"%s\"><text x=\"%d\" y=\"%d\">%s</text><text transform=\"translate(11 %d) "
        "rotate(-90)\">%s</text>",
        LEFT + WIDTH + 14, BOTTOM + 40, label, LEFT + WIDTH / 2, BOTTOM + 34, x, TOP + HEIGHT / 2,
        y);
}

static void write_axes(FILE *f)
{
    fprintf(f, "<path class=\"axis\" d=\"M%d %dV%dH%d\"/>", LEFT, TOP, BOTTOM, LEFT + WIDTH);
}

/* The x at which Beta(i, n + 1 - i) reaches that probability. GSL's own inverse does not converge for some of
 * a few thousand tiles. */
static double beta_quantile(double probability, int i, int n)
{
    double low = 0, high = 1;
    for (int k = 0; k < 60 && high - low > 1e-9 * high; k++) {
        double middle = (low + high) / 2;
        if (gsl_cdf_beta_P(middle, i, n + 1 - i) < probability)
            low = middle;
        else
            high = middle;
    }
    return (low + high) / 2;
}

void qq_band(int i, int n, double *low, double *high)
{
    *low = beta_quantile(0.025, i, n);
    *high = beta_quantile(0.975, i, n);
}

/* Ends of the axes of a QQ plot of n tiles, in -log10 p. */
struct qq_axes {
    int n;
    double right, top;
};

/* Of the i-th smallest p, where uniform ones would have it. */
static double qq_x(const struct qq_axes *a, int i)
{
    return LEFT + WIDTH * -log10(i / (a->n + 1.0)) / a->right;
}

static double qq_y(const struct qq_axes *a, double v)
{
    return BOTTOM - HEIGHT * fmin(v, a->top) / a->top;
}

/* Every tile while there are few, then ever fewer of those with large p, which lie on each other. */
static int next_shown(int i, int n)
{
    return i + 1 + (n > 100 ? i / 50 : 0);
}

static void write_band(FILE *f, const struct qq_axes *a)
{
    double low, high;
    fputs("<path class=\"band\" d=\"", f);
    for (int i = 1; i <= a->n; i = next_shown(i, a->n)) {
        qq_band(i, a->n, &low, &high);
        fprintf(f, "%s%.1f %.1f", i == 1 ? "M" : "L", qq_x(a, i), qq_y(a, -log10(low)));
    }
    for (int i = a->n; i >= 1; i -= next_shown(i, a->n) - i) {
        qq_band(i, a->n, &low, &high);
        fprintf(f, "L%.1f %.1f", qq_x(a, i), qq_y(a, -log10(high)));
    }
    fputs("Z\"/>", f);
}

/* Distance of ticks: 1, 2 or 5 times a power of ten, at most five of them. */
static double tick(double top)
{
    double power = pow(10, floor(log10(top / 5))), share = top / 5 / power;
    return power * (share <= 1 ? 1 : share <= 2 ? 2 : share <= 5 ? 5 : 10);
}

static void write_tile_csv(FILE *f, const json_t *claim)
{
    const json_t *p = json_object_get(claim, "tile_log10_p"), *t = json_object_get(claim, "tile_t");
    size_t columns = (size_t)member_number(claim, "tiles_x");
    double side = member_number(claim, "tile");
    struct csv csv = csv_link_open(f, "tiles.csv", "x,y,t,log10_p");
    for (size_t i = 0; columns > 0 && i < json_array_size(p); i++) {
        const json_t *one = json_array_get(p, i);
        csv_link_number(&csv, side * (double)(i % columns));
        csv_link_number(&csv, side * (double)(i / columns));
        csv_link_number(&csv, json_is_number(one) ? json_number_value(json_array_get(t, i)) : NAN);
        csv_link_number(&csv, json_is_number(one) ? json_number_value(one) : NAN);
        csv_link_line(&csv);
    }
    csv_link_close(&csv);
}

bool plot_qq(FILE *f, const json_t *claim, struct err *e)
{
    const json_t *list = json_object_get(claim, "tile_log10_p");
    double *v = calloc(json_array_size(list) + 1, sizeof *v);
    int n = 0, outside = 0;
    if (v == NULL)
        return err_set(e, "out of memory for the report");
    for (size_t i = 0; i < json_array_size(list); i++)
        if (json_is_number(json_array_get(list, i)))
            v[n++] = fmin(json_number_value(json_array_get(list, i)), 0);
    if (n >= 4) {
        gsl_sort(v, 1, (size_t)n);
        /* What is far out must not flatten the rest. */
        double chance = -log10(1 / (n + 1.0));
        struct qq_axes a = {n, 1.05 * chance, fmin(fmax(-v[0], 1.6 * chance), 2.5 * chance)};
        write_frame(f, "Observed against expected p-values of the tiles, as minus log10",
                    "expected −log₁₀ p", "observed −log₁₀ p");
        write_band(f, &a);
        fprintf(f, "<path class=\"expected\" d=\"M%d %dL%d %.1f\"/>", LEFT, BOTTOM, LEFT + WIDTH,
                qq_y(&a, a.right));
        fputs("<path class=\"points\" d=\"", f);
        for (int i = 1; i <= n; i = next_shown(i, n))
            fprintf(f, "M%.1f %.1fh0", qq_x(&a, i), qq_y(&a, -v[i - 1]));
        fputs("\"/>", f);
        for (int i = 1; i <= n; i++)
            outside += gsl_cdf_beta_P(pow(10, v[i - 1]), i, n + 1 - i) < 0.025;
        write_axes(f);
        for (int i = 0; i * tick(a.right) <= a.right; i++)
            fprintf(f, "<text x=\"%.0f\" y=\"%d\">%g</text>",
                    LEFT + WIDTH * (i * tick(a.right)) / a.right, BOTTOM + 16, i * tick(a.right));
        fputs("<g text-anchor=\"end\">", f);
        for (int i = 0; i * tick(a.top) <= a.top; i++)
            fprintf(f, "<text x=\"%d\" y=\"%.0f\">%g</text>", LEFT - 6,
                    qq_y(&a, i * tick(a.top)) + 4, i * tick(a.top));
        fprintf(
            f,
            "</g></svg><figcaption><b>The same p-values, one by one.</b> If both have the same mean the points follow "
            "the dashed line, each in the band 95 times of 100; here %d of %d are above it.%s ",
            outside, n, -v[0] > a.top ? " What lies on the upper edge is further out." : "");
        write_tile_csv(f, claim);
        fputs("</figcaption></figure>\n", f);
    }
    free(v);
    return true;
}

struct power power_of(const json_t *claim)
{
    const json_t *statistics = json_object_get(claim, "statistics");
    struct power p = {.margin = member_number(claim, "margin_global")};
    double mdb = member_number(claim, "mdb_global");
    for (size_t i = 0; i < json_array_size(statistics); i++) {
        const json_t *s = json_array_get(statistics, i);
        double tests = member_number(s, "num_tests");
        double level = member_number(claim, "alpha") * member_number(s, "share") / tests;
        if (strcmp(member_text(s, "name"), "image") == 0 && tests > 0 && level > 0)
            p.critical = gsl_cdf_ugaussian_Qinv(level / 2);
    }
    /* Beyond 10 no test covers the image (1e6). */
    if (p.critical > 0 && mdb > p.margin && mdb < 10)
        p.error = (mdb - p.margin) / (p.critical + gsl_cdf_ugaussian_Qinv(0.05));
    return p;
}

double power_at(const struct power *p, double bias)
{
    return gsl_cdf_ugaussian_P((fabs(bias) - p->margin) / p->error - p->critical);
}

static double power_y(double share)
{
    return BOTTOM - HEIGHT * share;
}

static void write_mark(FILE *f, double x, double top, bool left, const char *text, double y)
{
    double at = LEFT + WIDTH * x / top;
    fprintf(f,
            "<path class=\"expected\" d=\"M%.1f %dV%d\"/><text x=\"%.1f\" y=\"%.1f\" "
            "text-anchor=\"%s\">%s</text>",
            at, TOP, BOTTOM, left ? at - 5 : at + 5, y, left ? "end" : "start", text);
}

/* Where the curve is drawn: the ends, and between them 4 standard errors around where it rises. */
enum { RISE = 24, POINTS = RISE + 3 };
static int curve_points(const struct power *p, double top, double bias[POINTS])
{
    int num = 0;
    bias[num++] = 0;
    for (int i = 0; i <= RISE; i++) {
        double b = p->margin + p->error * (p->critical + 8.0 * i / RISE - 4);
        if (b > 0 && b < top)
            bias[num++] = b;
    }
    bias[num++] = top;
    return num;
}

void plot_power(FILE *f, const json_t *claim)
{
    struct power p = power_of(claim);
    double mdb = member_number(claim, "mdb_global"), top = 1.3 * mdb, bias[POINTS];
    if (!(p.error > 0))
        return;
    int num = curve_points(&p, top, bias);
    write_frame(f, "Chance to find a bias of the image, against its size",
                "true bias of the image, %", "chance of DIFFERENT, %");
    if (p.margin > 0)
        fprintf(f, "<rect class=\"band\" x=\"%d\" y=\"%d\" width=\"%.1f\" height=\"%d\"/>", LEFT,
                TOP, WIDTH * p.margin / top, HEIGHT);
    fputs("<path class=\"curve\" d=\"", f);
    for (int i = 0; i < num; i++)
        fprintf(f, "%s%.1f %.1f", i == 0 ? "M" : "L", LEFT + WIDTH * bias[i] / top,
                power_y(power_at(&p, bias[i])));
    fputs("\"/>", f);
    write_mark(f, mdb, top, false, "MDB", power_y(0.45));
    if (p.margin > 0)
        write_mark(f, p.margin, top, true, "margin", power_y(0.8));
    write_axes(f);
    fputs("<g text-anchor=\"end\">", f);
    for (int i = 0; i <= 4; i++)
        fprintf(f, "<text x=\"%d\" y=\"%.0f\">%d</text>", LEFT - 6, power_y(i / 4.0) + 4, 25 * i);
    fputs("</g>", f);
    for (int i = 0; i * tick(100 * top) <= 100 * top; i++)
        fprintf(f, "<text x=\"%.0f\" y=\"%d\">%s</text>",
                LEFT + WIDTH * (i * tick(100 * top)) / (100 * top), BOTTOM + 16,
                html_number(i * tick(100 * top)).s);
    fprintf(
        f,
        "</svg><figcaption><b>What this claim could have found.</b> How likely a true bias of that size makes "
        "the image's mean DIFFERENT: hardly ever inside the margin (shaded), where it would be wrong, and 95\u00a0%% "
        "of the time at the MDB, %s. ",
        html_percent_plain(mdb).s);
    struct csv csv = csv_link_open(f, "power.csv", "bias,power");
    for (int i = 0; i < num; i++) {
        csv_link_number(&csv, bias[i]);
        csv_link_number(&csv, power_at(&p, bias[i]));
        csv_link_line(&csv);
    }
    csv_link_close(&csv);
    fputs("</figcaption></figure>\n", f);
}
