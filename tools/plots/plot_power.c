#include "plot_power.h"

#include "plot.h"

#include "tools/html/csv_link.h"
#include "tools/html/html.h"
#include "tools/results/results.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_sort.h>

/* The quantile of Beta(i, n + 1 - i), by bisection: for a few thousand tiles GSL's own inverse does not converge
 * at some i. */
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

void plot_qq_band(int i, int n, double *low, double *high)
{
    *low = beta_quantile(0.025, i, n);
    *high = beta_quantile(0.975, i, n);
}

/* -log10 of the expected i-th smallest of n uniform p-values. */
static double qq_expected(int i, int n)
{
    return -log10(i / (n + 1.0));
}

/* The point to draw after i: every one of up to 100, else fewer and fewer of those with large p, which overlap. */
static int next_shown(int i, int n)
{
    return i + 1 + (n > 100 ? i / 50 : 0);
}

static void draw_band(struct plot *p, int n)
{
    double low, high;
    plot_path_open(p, "band");
    for (int i = 1; i <= n; i = next_shown(i, n)) {
        plot_qq_band(i, n, &low, &high);
        plot_path_to(p, qq_expected(i, n), -log10(low));
    }
    for (int i = n; i >= 1; i -= next_shown(i, n) - i) {
        plot_qq_band(i, n, &low, &high);
        plot_path_to(p, qq_expected(i, n), -log10(high));
    }
    plot_path_close(p, true);
}

static void write_tile_csv(FILE *f, const json_t *claim)
{
    const json_t *p = json_object_get(claim, "tile_log10_p"), *t = json_object_get(claim, "tile_t");
    size_t columns = (size_t)member_number(claim, "tiles_x");
    double side = member_number(claim, "tile");
    struct csv csv = csv_link_open(f, "tiles.csv", "x,y,t,log10_p");
    for (size_t i = 0; columns > 0 && i < json_array_size(p); i++) {
        const json_t *one = json_array_get(p, i);
        const bool known = json_is_number(one);
        csv_link_row(&csv, "nnnn", side * (double)(i % columns), side * (double)(i / columns),
                     known ? json_number_value(json_array_get(t, i)) : NAN,
                     known ? json_number_value(one) : NAN);
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
        /* The y axis is cut so that outliers do not flatten the rest. */
        double chance = -log10(1 / (n + 1.0)), right = 1.05 * chance;
        struct plot p = plot_sized(f, 300, 200);
        p.x = (struct plot_axis){.label = "expected −log₁₀ p", .hi = right};
        p.y = (struct plot_axis){.label = "observed −log₁₀ p",
                                 .hi = fmin(fmax(-v[0], 1.6 * chance), 2.5 * chance)};
        fputs("<figure class=\"map\">", f);
        plot_open(&p, "Observed against expected p-values of the tiles, as minus log10");
        draw_band(&p, n);
        plot_segment(&p, "expected", 0, 0, right, right);
        for (int i = 1; i <= n; i = next_shown(i, n))
            plot_point(&p, 0, qq_expected(i, n), -v[i - 1], "p %.2g, expected %.2g",
                       pow(10, v[i - 1]), i / (n + 1.0));
        for (int i = 1; i <= n; i++)
            outside += gsl_cdf_beta_P(pow(10, v[i - 1]), i, n + 1 - i) < 0.025;
        plot_close(&p);
        fprintf(
            f,
            "<figcaption><b>The same p-values, one by one.</b> If both have the same mean the points follow "
            "the dashed line, each in the band 95 times of 100; here %d of %d are above it.%s ",
            outside, n, -v[0] > p.y.hi ? " What lies on the upper edge is further out." : "");
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
    json_each(s, statistics) {
        double tests = member_number(s, "num_tests");
        double level = member_number(claim, "alpha") * member_number(s, "share") / tests;
        if (strcmp(member_text(s, "name"), "image") == 0 && tests > 0 && level > 0)
            p.critical = gsl_cdf_ugaussian_Qinv(level / 2);
    }
    /* An MDB of 10 or more: no test covers the image (region_mdb_none). */
    if (p.critical > 0 && mdb > p.margin && mdb < 10)
        p.error = (mdb - p.margin) / (p.critical + gsl_cdf_ugaussian_Qinv(0.05));
    return p;
}

double power_at(const struct power *p, double bias)
{
    return gsl_cdf_ugaussian_P((fabs(bias) - p->margin) / p->error - p->critical);
}

/* The abscissae of the curve: both ends, and points within 4 standard errors of its rise. */
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
    struct plot plot = plot_sized(f, 300, 200);
    plot.x = (struct plot_axis){.label = "true bias of the image, %", .hi = 100 * top};
    plot.y = (struct plot_axis){.label = "chance of DIFFERENT, %", .hi = 100, .step = 25};
    fputs("<figure class=\"map\">", f);
    plot_open(&plot, "Chance to find a bias of the image, against its size");
    if (p.margin > 0)
        plot_bar(&plot, "band", 0, 0, 100 * p.margin, 100, "margin %s",
                 html_percent_plain(p.margin).s);
    plot_path_open(&plot, "curve");
    for (int i = 0; i < num; i++)
        plot_path_to(&plot, 100 * bias[i], 100 * power_at(&p, bias[i]));
    plot_path_close(&plot, false);
    for (int i = 0; i < num; i++) /* invisible bars with tooltips */
        plot_bar(&plot, "hover", 100 * (i > 0 ? bias[i - 1] + bias[i] : 0) / 2, 0,
                 100 * (i + 1 < num ? bias[i] + bias[i + 1] : 2 * top) / 2, 100, "bias %s: %.3g %%",
                 html_percent_plain(bias[i]).s, 100 * power_at(&p, bias[i]));
    plot_segment(&plot, "expected", 100 * mdb, 0, 100 * mdb, 100);
    plot_text(&plot, 100 * mdb, 45, 5, 0, "start", "MDB");
    if (p.margin > 0) {
        plot_segment(&plot, "expected", 100 * p.margin, 0, 100 * p.margin, 100);
        plot_text(&plot, 100 * p.margin, 80, -5, 0, "end", "margin");
    }
    plot_close(&plot);
    fprintf(
        f,
        "<figcaption><b>What this claim could have found.</b> How likely a true bias of that size makes "
        "the image's mean DIFFERENT: hardly ever inside the margin (shaded), where it would be wrong, and 95\u00a0%% "
        "of the time at the MDB, %s. ",
        html_percent_plain(mdb).s);
    struct csv csv = csv_link_open(f, "power.csv", "bias,power");
    for (int i = 0; i < num; i++)
        csv_link_row(&csv, "nn", bias[i], power_at(&p, bias[i]));
    csv_link_close(&csv);
    fputs("</figcaption></figure>\n", f);
}
