/* The closed forms of 16_snell_window, 28_beckmann_furnace and 39_three_lamps against other routes to the
 * same numbers, which must reject forms with a known mistake. */
#include "reference/truth/truth_ggx.h"
#include "reference/truth/truth_mirrors_and_glass.h"
#include "tests/support/optics.h"
#include "tests/support/quadrature.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

/* Radiance in glass over that of the sky, by conservation of power: a thin bundle of rays has the power outside times
 * the transmittance, in a solid angle and a cross-section that refraction has changed. The ratio of the
 * solid angles by central differences of the angle outside. */
static double sky_by_power(double theta, double n)
{
    const double h = 1e-5;
    double outside = asin(n * sin(theta));
    double stretch = (asin(n * sin(theta + h)) - asin(n * sin(theta - h))) / (2 * h);
    double solid_angles = sin(outside) / sin(theta) * stretch;
    return optics_transmitted(cos(theta), 1 / n) * solid_angles * cos(outside) / cos(theta);
}

TEST(window_keeps_power)
{
    const double n = 1.5;
    for (int i = 1; i <= 40; i++) {
        double theta = i * M_PI / 180, floor, sky;
        truth_window_shares(cos(theta), n, &floor, &sky);
        assert_true(same(floor, optics_fresnel(cos(theta), 1 / n)));
        assert_true(fabs(sky_by_power(theta, n) - sky) <= 1e-6 * sky);
        /* n^2 left out, and on the wrong side. */
        assert_true(fabs(sky_by_power(theta, n) - sky / (n * n)) > 0.5 * sky);
        assert_true(fabs(sky_by_power(theta, n) - sky / (n * n * n * n)) > 0.5 * sky);
    }
    for (int i = 42; i < 90; i++) {
        double floor, sky;
        truth_window_shares(cos(i * M_PI / 180), n, &floor, &sky);
        assert_true(fabs(floor - 1) < 1e-12 && fabs(sky) < 1e-12);
    }
}

/* Pixels of the window from the directions that the .md gives, by 40 x 40 points: those of one piece to
 * 1e-5; and one at the edge, where the points' own error is more. */
TEST(window_pixels_lie_where_they_should)
{
    enum { CELLS = 40 };
    static const double sky_radiance[3] = {.4, .3, .2}, floor_radiance[3] = {.3, .5, .8};
    static const int at[][2] = {{0, 0}, {32, 32}, {40, 20}, {63, 10}, {10, 60}, {56, 32}};
    OWN(moments) m;
    render_truth("16_snell_window", 64, 64, &m);
    for (size_t i = 0; i < COUNT(at); i++)
        for (int c = 0; c < 3; c++) {
            double sum = 0, mean = mean_at(&m, at[i][0], at[i][1], c);
            for (int k = 0; k < CELLS * CELLS; k++) {
                double u = (at[i][0] + (k % CELLS + 0.5) / CELLS) / 32 - 1;
                double v = (at[i][1] + (k / CELLS + 0.5) / CELLS) / 32 - 1;
                double cosine = 1 / sqrt(1 + 1.44 * (u * u + v * v));
                double f = optics_fresnel(cosine, 1 / 1.5);
                sum += f * floor_radiance[c] + (1 - f) * 2.25 * sky_radiance[c];
            }
            bool edge = at[i][0] == 56;
            assert_true(fabs(mean - sum / (CELLS * CELLS)) < (edge ? 5e-3 : 1e-5) * mean);
        }
}

struct metal {
    double eta, k, cos_o;
    double root; /* of pi in Lambda; the assignment's is pi itself */
};

static const double alpha = 0.5;

static double lambda(const struct metal *m, double z)
{
    double a = z / (alpha * sqrt(1 - z * z));
    return z == 1 ? 0 : 0.5 * (exp(-a * a) / (a * m->root) - erfc(a));
}

/* As visible_normal() of test_truth_sky.c: the integral over normals m instead of directions wi, restricted to
 * those m that reflect to above the surface. psi: azimuth from wo's; t: tan(theta_m) over its value where wi is
 * at the horizon. D dm = slope exp(-slope^2/alpha^2) / (pi alpha^2 cos_m) dslope dpsi. */
static double visible_normal(double psi, double t, const void *data)
{
    const struct metal *m = data;
    double z = m->cos_o, c = sqrt(1 - z * z) * cos(psi);
    double horizon = (c + sqrt(c * c + z * z)) / z, slope = t * horizon;
    double cos_m = 1 / sqrt(1 + slope * slope), cos_om = cos_m * (z + slope * c);
    double wi_z = 2 * cos_om * cos_m - z;
    if (!(wi_z > 0 && cos_om > 0))
        return 0;
    double g2 = 1 / (1 + lambda(m, z) + lambda(m, wi_z));
    return optics_fresnel(cos_om, m->eta + m->k * _Complex_I) * g2 * cos_om / z * slope * horizon *
           exp(-slope * slope / (alpha * alpha)) / (M_PI * alpha * alpha * cos_m);
}

static double albedo_by_normals(const struct metal *m)
{
    return 2 * integrate_plane(visible_normal, m, (double[]){0, M_PI}, (double[]){0, 1});
}

TEST(beckmann_albedo_both_ways)
{
    static const double cosine[] = {1, 0.9, 0.7, 0.5, 0.35, 0.237};
    static const double eta[3] = {.2, .9, 1.3}, k[3] = {3.9, 2.5, 2.3};
    for (size_t i = 0; i < COUNT(cosine); i++)
        for (int c = 0; c < 3; c++) {
            struct metal m = {eta[c], k[c], cosine[i], sqrt(M_PI)};
            double a = truth_beckmann_albedo(alpha, eta[c], k[c], cosine[i], 96);
            assert_true(same(a, albedo_by_normals(&m)));
            m.root = M_PI;
            assert_true(cosine[i] > 0.6 || fabs(albedo_by_normals(&m) / a - 1) > 0.01);
            /* Another distribution of the same roughness. */
            assert_true(fabs(truth_ggx_albedo(alpha, eta[c], k[c], cosine[i], 96) / a - 1) > 1e-3);
        }
}

struct place {
    double height, x, z;
};

static double transfer(double ex, double ez, const void *ctx)
{
    const struct place *p = ctx;
    double d2 = (ex - p->x) * (ex - p->x) + (ez - p->z) * (ez - p->z) + p->height * p->height;
    return p->height * p->height / (d2 * d2);
}

/* Radiance at (x, 0, z) of 39_three_lamps, its numbers once more. */
static double three_lamps(double x, double z, int channel, bool with_point)
{
    static const double wide[3] = {5, 2.5, 1}, small[3] = {1, 3, 4}, point[3] = {.3, .3, .9};
    static const double albedo[3] = {.6, .7, .8};
    struct place high = {0.7, x, z}, low = {0.6, x, z};
    double d2 = pow(x - 0.3, 2) + pow(z + 0.4, 2) + 0.64;
    double e =
        wide[channel] * integrate_plane(transfer, &high, (double[]){-1, -.5}, (double[]){-.5, .1}) +
        small[channel] * integrate_plane(transfer, &low, (double[]){.1, .9}, (double[]){.2, .4}) +
        with_point * point[channel] * 0.8 / (d2 * sqrt(d2));
    return albedo[channel] / M_PI * e;
}

/* Mean over pixels by Gauss's rule of 3 x 3 points, off by (0.01/0.6)^6 = 2e-11. */
TEST(three_lamps_both_ways)
{
    static const double node[3] = {-0.7745966692414834, 0, 0.7745966692414834};
    static const double weight[3] = {5. / 18, 8. / 18, 5. / 18};
    static const int at[][2] = {{0, 0}, {95, 0}, {20, 40}, {60, 45}, {95, 63}};
    OWN(moments) m;
    render_truth("39_three_lamps", 96, 64, &m);
    for (size_t i = 0; i < COUNT(at); i++) {
        int c = (int)i % 3;
        double right = 0, lacking = 0, exchanged = 0;
        for (int k = 0; k < 9; k++) {
            double w = weight[k % 3] * weight[k / 3];
            double x = (at[i][0] + 0.5 + node[k % 3] / 2) / 48 - 1;
            double z = (at[i][1] + 0.5 + node[k / 3] / 2) / 48 - 2. / 3;
            right += w * three_lamps(x, z, c, true);
            lacking += w * three_lamps(x, z, c, false);
            exchanged += w * three_lamps(2 * x / 3, 3 * z / 2, c, true);
        }
        double mean = mean_at(&m, at[i][0], at[i][1], c);
        assert_true(same(mean, right));
        assert_false(same(mean, lacking));
        assert_false(same(mean, exchanged));
    }
}

TEST(impossible_values_are_refused)
{
#define LAMPS(lamps)                                                                               \
    "{'albedo': [0.5, 0.5, 0.5], 'footprint': {'x': [0, 1], 'z': [0, 1]}, 'lamps': "               \
    "[" lamps "]}"
    static const char point[] = LAMPS("{'intensity': [1, 1, 1], 'light': [0, 1, 0]}");
    expect_refusal("lamps_over_plane", point, 1, NULL);
    expect_refusal("lamps_over_plane", point, 0, "direct light");
    expect_refusal("lamps_over_plane", LAMPS(""), 1, "not an array of 1 to 8");
    expect_refusal("lamps_over_plane", LAMPS("{'intensity': [1, 1, 1], 'light': [0, -1, 0]}"), 1,
                   "lamps[0]: light is at height -1");
    expect_refusal("lamps_over_plane",
                   LAMPS("{'radiance': [1, 1, 1], 'height': 1, 'x': [1, 0], 'z': [0, 1]}"), 1,
                   "no area");
#define WINDOW(eye, forward, ior)                                                                  \
    "{'view': {'eye': " eye ", 'right': [1, 0, 0], 'up': [0, 0, 1], 'forward': " forward           \
    ", 'tan_half': 1.2}, 'ior': " ior ", 'sky': [1, 1, 1], 'floor': [1, 1, 1]}"
    expect_refusal("snell_window", WINDOW("[0, -1, 0]", "[0, 1, 0]", "1.5"), 1, NULL);
    expect_refusal("snell_window", WINDOW("[0, -1, 0]", "[0, 1, 0]", "1.5"), 0, "one bounce");
    expect_refusal("snell_window", WINDOW("[0, 1, 0]", "[0, 1, 0]", "1.5"), 1, "not below");
    expect_refusal("snell_window", WINDOW("[0, -1, 0]", "[0, -1, 0]", "1.5"), 1, "not look up");
    expect_refusal("snell_window", WINDOW("[0, -1, 0]", "[0, 1, 0]", "1"), 1, "not above 1");
}
