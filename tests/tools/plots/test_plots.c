/* The curves of the page's plots, computed another way: the QQ band from sums of binomial probabilities,
 * the power curve from simulated tests; and the page's CSV links, decoded again. */
#include "tools/html/csv_link.h"
#include "tools/html/html.h"
#include "tools/plots/plot.h"
#include "tools/plots/plot_power.h"
#include "tests/support/own.h"
#include "tests/support/simulate.h"
#include "tests/support/test.h"

/* The i-th smallest of n uniform numbers is at most x if at least i of them are: a binomial tail. */
static double order_cdf(int i, int n, double x)
{
    double sum = 0;
    for (int k = i; k <= n; k++)
        sum += exp(lgamma(n + 1) - lgamma(k + 1) - lgamma(n - k + 1) + k * log(x) +
                   (n - k) * log1p(-x));
    return sum;
}

TEST(qq_band_is_binomial)
{
    static const int of[][2] = {{1, 4},   {4, 4},     {1, 64},   {10, 64},
                                {64, 64}, {200, 400}, {1, 4096}, {3000, 4096}};
    for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
        double low, high;
        plot_qq_band(of[k][0], of[k][1], &low, &high);
        assert_float_equal(order_cdf(of[k][0], of[k][1], low), 0.025, 1e-6);
        assert_float_equal(order_cdf(of[k][0], of[k][1], high), 0.975, 1e-6);
    }
}

static json_t *claim_of(double alpha, double margin, double mdb)
{
    json_t *c =
        json_pack("{sf sf sf s[{ss sf si}]}", "alpha", alpha, "margin_global", margin, "mdb_global",
                  mdb, "statistics", "name", "image", "share", 0.25, "num_tests", 4);
    assert_non_null(c);
    return c;
}

/* A two-sided test of a mean at level 0.05 x 0.25 / 4 with that standard error, simulated 40000 times for
 * each bias. Each frequency lies within 4 standard errors (at most 0.01) of the curve with probability
 * 0.9999. Control: the curve at half the bias does not fit. */
TEST(power_is_that_of_the_test)
{
    enum { TRIALS = 40000 };
    json_t *claim = claim_of(0.05, 0.003, 0.008);
    struct power p = power_of(claim);
    assert_float_equal(power_at(&p, 0.008), 0.95, 1e-9);
    /* P(|N(0, 1)| > c) = 0.05 x 0.25 / 4 */
    assert_float_equal(erfc(p.critical / sqrt(2)), 0.003125, 1e-9);
    static const double bias[] = {0.003, 0.005, -0.006, 0.007, 0.008};
    uint64_t seed = 11;
    for (size_t i = 0; i < sizeof bias / sizeof *bias; i++) {
        int found = 0;
        for (int k = 0; k < TRIALS; k++)
            found += (fabs(bias[i] + p.error * draw_normal(uniform(&seed), &seed)) - p.margin) /
                         p.error >
                     p.critical;
        assert_float_equal((double)found / TRIALS, power_at(&p, bias[i]), 0.01);
        if (fabs(bias[i]) > 0.0055)
            assert_true(fabs((double)found / TRIALS - power_at(&p, bias[i] / 2)) > 0.01);
    }
    json_decref(claim);
    /* No test covers the image. */
    claim = claim_of(0.05, 0.003, 1e6);
    p = power_of(claim);
    assert_float_equal(p.error, 0, 0);
    json_decref(claim);
}

/* What a browser saves: the link's data, percent-decoded. */
static char *saved(const char *link)
{
    const char *at = strstr(link, "href=\"data:text/csv;charset=utf-8,");
    assert_non_null(at);
    at = strchr(at, ',') + 1;
    char *out = malloc(strlen(at) + 1), *end = out;
    assert_non_null(out);
    for (; *at != '"'; at++) {
        assert_true(*at != '\0' && *at != '<' && *at != '#' && *at != ' ' && *at != '\'');
        if (*at == '%') {
            char hex[3] = {at[1], at[2], '\0'};
            *end++ = (char)strtol(hex, NULL, 16);
            at += 2;
        } else {
            *end++ = *at;
        }
    }
    *end = '\0';
    return out;
}

TEST(csv_comes_back)
{
    OWN_TEXT link = NULL;
    struct csv csv;
    PRINTED(link, csv = csv_link_open(f, "x.csv", "name,a,b"),
            csv_link_row(&csv, "tnn", "say \"hi\", <b>&#'\xc3\xa4", -0.25, NAN),
            csv_link_row(&csv, "tnn", "=1+1", 1e-9, 3.0), csv_link_close(&csv));
    OWN_TEXT text = saved(link);
    assert_string_equal(
        text, "name,a,b\r\n\"say \"\"hi\"\", <b>&#'\xc3\xa4\",-0.25,\r\n\"'=1+1\",1e-09,3\r\n");
}

TEST(text_is_escaped_and_numbers_are_printed)
{
    OWN_TEXT text = NULL;
    PRINTED(text, html_print(f, "<b title=\"%s\">%s</b> %d %zu %+.2f%% %lld%s", "\"x'", "<i>&", -3,
                             (size_t)7, 1.5, 1LL << 40, json_string_value(NULL)));
    assert_string_equal(text,
                        "<b title=\"&quot;x&#39;\">&lt;i&gt;&amp;</b> -3 7 +1.50% 1099511627776");
}

/* Positions of the marks and labels of the axes, worked out by hand. */
TEST(axes_are_in_proportion)
{
    OWN_TEXT text = NULL;
    struct plot p = {.style = "plot",
                     .left = 100,
                     .width = 300,
                     .height = 200,
                     .bottom = 40,
                     .x = {.label = "a <b>", .lo = 1, .hi = 1000, .is_log = true, .unit = " s"},
                     .y = {.label = "y", .lo = -1, .hi = 1}};
    PRINTED(text, p.f = f, plot_open(&p, "what %s is", "\"it\""),
            plot_point(&p, 0, 10, 0.5, "%s", "10 & half"),
            plot_point(&p, 0, 1e9, -7, "%s", "beyond both ends"), plot_close(&p));
    assert_float_equal(plot_x(&p, 100), 300, 1e-9);
    assert_float_equal(plot_y(&p, 1), 0, 1e-9);
    static const char *const there[] = {
        "aria-label=\"what &quot;it&quot; is\"",
        ">a &lt;b&gt;</text>",
        ">1 s</text>",
        ">1000 s</text>",
        ">-0.5</text>",
        "cx=\"200.0\" cy=\"50.0\" r=\"3.2\"><title>10 &amp; half</title>",
        "cx=\"400.0\" cy=\"200.0\"",
    };
    for (size_t i = 0; i < sizeof there / sizeof *there; i++)
        if (strstr(text, there[i]) == NULL)
            fail_msg("no %s in %s", there[i], text);
    assert_null(strstr(text, ">2 s</text>")); /* three decades: powers of ten alone */
    static const double steps[][2] = {{5, 1}, {5.1, 2}, {12, 5}, {0.3, 0.1}, {40, 10}};
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++)
        assert_float_equal(plot_step(steps[i][0]), steps[i][1], 1e-9);
}
