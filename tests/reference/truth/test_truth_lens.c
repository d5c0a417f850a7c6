/* The closed form of the thin lens against quadrature over the lens and over chords of its disc;
 * lenses with a known mistake must be rejected. */
#include "reference/truth/truth_lens.h"
#include "tests/support/quadrature.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <gsl/gsl_integration.h>
#include <gsl/gsl_math.h>

static double chord(double t, void *ctx)
{
    (void)ctx;
    return 2 / M_PI * sqrt(1 - t * t);
}

/* The disc as a stack of chords of the length 2 sqrt(1 - t^2). */
TEST(share_matches_chords)
{
    gsl_integration_workspace *w = gsl_integration_workspace_alloc(1000);
    gsl_function g = {chord, NULL};
    for (double k = -0.99; k < 1; k += 0.06) {
        double value, error;
        assert_int_equal(gsl_integration_qags(&g, k, 1, 1e-15, 1e-11, 1000, w, &value, &error), 0);
        assert_true(same(truth_disc_share(k), value));
        assert_true(same(truth_disc_share(k) + truth_disc_share(-k), 1));
        /* A square aperture has (1 - k)/2. */
        assert_true(fabs(k) < 0.01 || !same(truth_disc_share(k), (1 - k) / 2));
    }
    assert_true(truth_disc_share(-1) == 1 && truth_disc_share(-7) == 1);
    assert_true(truth_disc_share(1) == 0 && truth_disc_share(7) == 0);
    gsl_integration_workspace_free(w);
}

struct ramp {
    double k0, a, b;
};

static double ramp_share(double u, double v, const void *ctx)
{
    const struct ramp *r = ctx;
    return truth_disc_share(r->k0 + r->a * u + r->b * v);
}

TEST(mean_share_matches_quadrature)
{
    static const struct ramp ramps[] = {{0, 0.1, 0.2},    {-0.7, 0.3, -0.05}, {-1.1, 0.4, 0.3},
                                        {0.9, -0.2, 0.3}, {-2, 3, 1.5},       {0.5, -4, 2}};
    for (size_t i = 0; i < COUNT(ramps); i++) {
        const struct ramp *r = &ramps[i];
        double unit[2] = {0, 1};
        double mean = truth_disc_share_mean(r->k0, r->a, r->b);
        assert_true(same(mean, integrate_plane(ramp_share, r, unit, unit)));
        /* The value in the middle is not the mean. */
        assert_false(same(mean, truth_disc_share(r->k0 + r->a / 2 + r->b / 2)));
    }
    assert_true(truth_disc_share_mean(1.5, -0.2, 0.1) == 0);
    assert_true(truth_disc_share_mean(-1.5, 0.2, 0.1) == 1);
}

enum mistake { NONE, RADIUS_1_PERCENT, FOCUS_1_PERCENT, SQUARE };

struct panel {
    double radiance[3], z, normal[2], offset;
};

/* 17_lens_step as its .dae has it. */
static const struct panel panels[2] = {{{1.6, 1.2, 0.8}, -1, {0.6, 0.8}, 0.15},
                                       {{0.9, 1.2, 1.5}, -5, {-0.8, -0.6}, 1.3}};
static const double background[3] = {0.3, 0.4, 0.5};

struct pixel {
    double x, y, side; /* at distance 1: lower left corner */
    const struct panel *panel;
    enum mistake mistake;
};

/* Where the ray from the lens point (lx, ly) through the image point (x, y), that is through the
 * point of the focal plane which a ray from the centre would meet there, meets the panel's plane:
 * how far inside the panel. */
static double inside(const struct pixel *p, double lx, double ly, double x, double y)
{
    double radius = p->mistake == RADIUS_1_PERCENT ? 0.2525 : 0.25;
    double focus = p->mistake == FOCUS_1_PERCENT ? 2.02 : 2;
    double o[2] = {radius * lx, radius * ly};
    double d[3] = {focus * x - o[0], focus * y - o[1], -focus};
    double t = p->panel->z / d[2];
    return p->panel->normal[0] * (o[0] + t * d[0]) + p->panel->normal[1] * (o[1] + t * d[1]) -
           p->panel->offset;
}

/* Share of the pixel that is inside for that lens point: the square is clipped by the line where
 * inside() is 0, and the polygon's area is taken by the shoelace formula. */
static double clipped(const struct pixel *p, double lx, double ly)
{
    static const double corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    double polygon[8][2], value[4];
    int n = 0;
    for (int i = 0; i < 4; i++)
        value[i] = inside(p, lx, ly, p->x + p->side * corner[i][0], p->y + p->side * corner[i][1]);
    for (int i = 0; i < 4; i++) {
        int next = (i + 1) % 4;
        if (value[i] > 0) {
            polygon[n][0] = corner[i][0];
            polygon[n++][1] = corner[i][1];
        }
        if ((value[i] > 0) != (value[next] > 0)) {
            double t = value[i] / (value[i] - value[next]);
            for (int k = 0; k < 2; k++)
                polygon[n][k] = corner[i][k] + t * (corner[next][k] - corner[i][k]);
            n++;
        }
    }
    double twice = 0;
    for (int i = 0; i < n; i++) {
        const double *a = polygon[i], *b = polygon[(i + 1) % n];
        twice += a[0] * b[1] - b[0] * a[1];
    }
    return twice / 2;
}

/* u across the edge's normal from -1 to 1, v along it: the disc, its area stretched to the square
 * -1..1 by -1..1; lens points with the density 1/pi. */
static double over_lens(double u, double v, const void *ctx)
{
    const struct pixel *p = ctx;
    double chord_half = sqrt(1 - u * u), w = v * chord_half;
    const double *n = p->panel->normal;
    if (p->mistake == SQUARE)
        return clipped(p, u, v) / 4;
    return clipped(p, u * n[0] - w * n[1], u * n[1] + w * n[0]) * chord_half / M_PI;
}

static double lens_share(const struct pixel *p)
{
    const double range[2] = {-1, 1};
    return integrate_plane(over_lens, p, range, range);
}

TEST(pixels_match_rays)
{
    static const struct {
        int col, row, panel;
    } pixels[] = {{40, 20, 0}, {60, 45, 0}, {5, 5, 0},  {20, 17, 0},
                  {8, 40, 1},  {30, 55, 1}, {14, 32, 1}};
    OWN(moments) m;
    render_truth("17_lens_step", 64, 64, &m);
    int blurred = 0;
    for (size_t i = 0; i < COUNT(pixels); i++) {
        int col = pixels[i].col, row = pixels[i].row;
        struct pixel p = {-0.5 + col / 64., 0.5 - (row + 1) / 64., 1 / 64.,
                          &panels[pixels[i].panel], NONE};
        double share = lens_share(&p);
        for (int c = 0; c < 3; c++)
            assert_true(same(mean_at(&m, col, row, c),
                             background[c] + share * (p.panel->radiance[c] - background[c])));
        blurred += share > 0.02 && share < 0.98;
        bool try_mistakes = i == 0 || i == 5; /* near and far */
        for (enum mistake k = RADIUS_1_PERCENT; try_mistakes && k <= SQUARE; k++) {
            p.mistake = k;
            double wrong = lens_share(&p);
            assert_false(same(mean_at(&m, col, row, 0),
                              background[0] + wrong * (p.panel->radiance[0] - background[0])));
        }
    }
    assert_true(blurred == 6);
}

/* Away from both edges the image is one panel or the background; up is +Y and right is +X. */
TEST(panels_are_where_they_belong)
{
    OWN(moments) m;
    render_truth("17_lens_step", 64, 64, &m);
    for (int c = 0; c < 3; c++) {
        assert_true(mean_at(&m, 63, 0, c) == panels[0].radiance[c]);
        assert_true(same(mean_at(&m, 0, 63, c), panels[1].radiance[c]));
        assert_true(mean_at(&m, 63, 63, c) == background[c]);
    }
}

#define PANEL(distance, normal, offset)                                                            \
    "{'radiance':[1,1,1],'distance':" distance ",'normal':" normal ",'offset':" offset "}"
#define SCENE(panels)                                                                              \
    "{'background':[1,1,1],'footprint':{'x':[-1,1],'y':[1,-1]},'panels':[" panels "]}"

TEST(impossible_values_are_refused)
{
    expect_refusal("lens_steps", SCENE(PANEL("1", "[0.6,0.8]", "0.1")), 0, NULL);
    expect_refusal("lens_steps", SCENE(PANEL("1", "[0.6,0.8]", "0.1")), 9, NULL);
    expect_refusal("lens_steps", SCENE(PANEL("2", "[0.6,0.8]", "0.1")), 0, "in focus");
    expect_refusal("lens_steps", SCENE(PANEL("-1", "[0.6,0.8]", "0.1")), 0, "distance is -1");
    expect_refusal("lens_steps", SCENE(PANEL("1", "[0.6,0.7]", "0.1")), 0, "unit length");
    expect_refusal("lens_steps", SCENE(PANEL("1", "[0,1]", "0.1")), 0, "parallel");
    expect_refusal("lens_steps", SCENE(""), 0, "panels is not");
    expect_refusal("lens_steps",
                   SCENE(PANEL("1", "[0.6,0.8]", "0.1") "," PANEL("5", "[0.6,0.8]", "0.1")), 0,
                   "two panels");
}
