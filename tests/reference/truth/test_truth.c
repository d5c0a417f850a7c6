/* The closed forms against other routes to the same number: explicit sums, vector arithmetic,
 * adaptive quadrature over the emitter, Lambert's polygon formula, conservation of energy. All
 * comparisons use one tolerance, and the same tolerance must reject forms with a known mistake. */
#include "reference/truth/truth.h"
#include "reference/truth/truth_lamps.h"
#include "tests/support/quadrature.h"
#include "tests/support/own.h"
#include "tests/support/test.h"
#include "tests/support/vectors.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_integration.h>
#include <gsl/gsl_math.h>

/* The sum's closed form E (1 - rho^(m+1)) / (1 - rho), and its limits rho = 0, rho = 1. */
TEST(furnace_is_the_geometric_series)
{
    static const double albedo[] = {0.1, 0.2, 0.5, 0.8, 0.99};
    for (size_t i = 0; i < COUNT(albedo); i++)
        for (int m = 0; m <= 20; m++) {
            double rho = albedo[i];
            assert_true(
                same(truth_furnace(2.5, rho, m), 2.5 * (1 - gsl_pow_int(rho, m + 1)) / (1 - rho)));
            /* One bounce too few or too many must be seen, until the term itself is below the
             * tolerance. */
            if (m > 0 && gsl_pow_int(rho, m + 1) > 1e-7) {
                assert_false(same(truth_furnace(2.5, rho, m - 1), truth_furnace(2.5, rho, m)));
                assert_false(same(truth_furnace(2.5, rho, m + 1), truth_furnace(2.5, rho, m)));
            }
        }
    assert_true(same(truth_furnace(3, 0, 7), 3));
    assert_true(same(truth_furnace(3, 1, 7), 24));
}

/* Points spread over the plane, under the sources and far from them. */
static const double plane_points[][2] = {
    {0, 0},  {0.3, -0.2},     {1.25, 0.875}, {-1.25, 1.125}, {0.85, -0.375}, {0.4, -0.2},
    {5, -7}, {-0.001, 0.002}, {0.5, -0.05},  {0.5, 0.3},     {-40, 25}};

/* What a faulty renderer might have computed instead. */
enum mistake { NONE, NO_RECEIVER_COSINE, NO_EMITTER_COSINE, NO_FALLOFF, ONE_OVER_R };

/* Irradiance at p with normal +Y from a point light of intensity 1 at l, by vectors. */
static double point_by_vectors(const double l[3], double px, double pz, enum mistake mistake)
{
    const double n[3] = {0, 1, 0}, d[3] = {l[0] - px, l[1], l[2] - pz};
    double r = sqrt(dot3(d, d)), cosine = dot3(n, d) / r;
    return (mistake == NO_RECEIVER_COSINE ? 1 : cosine) / (mistake == NO_FALLOFF   ? 1
                                                           : mistake == ONE_OVER_R ? r
                                                                                   : r * r);
}

TEST(point_light_matches_vector_arithmetic)
{
    const double light[3] = {0.85, 0.5, -0.375};
    for (size_t i = 0; i < COUNT(plane_points); i++) {
        double x = plane_points[i][0], z = plane_points[i][1];
        double form = truth_point_irradiance(light, x, z);
        assert_true(same(form, point_by_vectors(light, x, z, NONE)));
        assert_false(same(form, point_by_vectors(light, x, z, NO_FALLOFF)));
        assert_false(same(form, point_by_vectors(light, x, z, ONE_OVER_R)));
        /* Straight below the light the cosine is 1 and cannot be missed. */
        if (x != light[0] || z != light[2])
            assert_false(same(form, point_by_vectors(light, x, z, NO_RECEIVER_COSINE)));
    }
}

static double ring(double r, void *light)
{
    return 2 * M_PI * r * truth_point_irradiance(light, r, 0);
}

/* An infinite plane catches half of the 4 pi W of an isotropic light of 1 W/sr, at any height. */
TEST(plane_catches_half_the_flux)
{
    static const double height[] = {0.1, 0.5, 3};
    gsl_integration_workspace *w = gsl_integration_workspace_alloc(1000);
    for (size_t i = 0; i < COUNT(height); i++) {
        double light[3] = {0, height[i], 0}, flux, error;
        gsl_function f = {ring, light};
        assert_int_equal(gsl_integration_qagiu(&f, 0, 0, 1e-10, 1000, w, &flux, &error),
                         GSL_SUCCESS);
        assert_true(same(flux, 2 * M_PI));
    }
    gsl_integration_workspace_free(w);
}

struct rectangle {
    double height, x[2], z[2];
};

struct receiver {
    const struct rectangle *r;
    double x, z;
    enum mistake mistake;
};

/* cos cos / d^2 between the emitter's point and the receiver, radiance 1. */
static double transfer(double ex, double ez, const void *ctx)
{
    const struct receiver *p = ctx;
    double dx = ex - p->x, dz = ez - p->z, h = p->r->height;
    double d = sqrt(dx * dx + dz * dz + h * h), cosine = h / d;
    double receiver = p->mistake == NO_RECEIVER_COSINE ? 1 : cosine;
    double emitter = p->mistake == NO_EMITTER_COSINE ? 1 : cosine;
    double falloff = p->mistake == NO_FALLOFF ? 1 : p->mistake == ONE_OVER_R ? d : d * d;
    return receiver * emitter / falloff;
}

static double rectangle_by_quadrature(const struct rectangle *r, double x, double z,
                                      enum mistake mistake)
{
    struct receiver p = {r, x, z, mistake};
    return integrate_plane(transfer, &p, r->x, r->z);
}

static double rectangle_by_edges(const struct rectangle *r, double x, double z)
{
    const double corner[4][3] = {{r->x[0], r->height, r->z[0]},
                                 {r->x[1], r->height, r->z[0]},
                                 {r->x[1], r->height, r->z[1]},
                                 {r->x[0], r->height, r->z[1]}};
    return lambert_irradiance(corner, 4, (double[3]){x, 0, z}, (double[3]){0, 1, 0});
}

static const struct rectangle rectangles[] = {
    {0.6, {0.15, 0.65}, {-0.35, -0.05}}, /* that of 13_square_patch */
    {0.5, {-0.5, 1.1}, {-0.7, 0.5}},     /* that of 15_square_overhead */
    {0.05, {-1, 2}, {0.1, 0.3}},
    {3, {-0.01, 0.01}, {-2, 5}},
};

TEST(rectangle_matches_quadrature_and_edges)
{
    static const enum mistake mistakes[] = {NO_RECEIVER_COSINE, NO_EMITTER_COSINE, NO_FALLOFF,
                                            ONE_OVER_R};
    for (size_t i = 0; i < COUNT(rectangles); i++)
        for (size_t j = 0; j < COUNT(plane_points); j++) {
            const struct rectangle *r = &rectangles[i];
            double x = plane_points[j][0], z = plane_points[j][1];
            double form = truth_rectangle_irradiance(r->height, r->x, r->z, x, z);
            /* The four corner terms, each up to pi/4, nearly cancel far away. */
            double lost = 1e-15 / 1e-9;
            if (form < lost)
                continue;
            assert_true(same(form, rectangle_by_quadrature(r, x, z, NONE)));
            assert_true(same(form, rectangle_by_edges(r, x, z)));
            for (size_t m = 0; m < COUNT(mistakes); m++)
                assert_false(same(form, rectangle_by_quadrature(r, x, z, mistakes[m])));
        }
}

/* On the axis of a rectangle 2a x 2b at height h: 2 [a/u atan(b/u) + b/w atan(a/w)],
 * u^2 = h^2 + a^2, w^2 = h^2 + b^2. Of 15_square_overhead, the number in its .md. */
TEST(rectangle_on_axis)
{
    double u = sqrt(0.25 + 0.64), w = sqrt(0.25 + 0.36);
    double axis = 2 * (0.8 / u * atan(0.6 / u) + 0.6 / w * atan(0.8 / w));
    const struct rectangle *r = &rectangles[1];
    assert_true(same(truth_rectangle_irradiance(r->height, r->x, r->z, 0.3, -0.1), axis));
    assert_false(same(truth_rectangle_irradiance(r->height, r->x, r->z, 0.3, -0.0999), axis));
    assert_true(fabs(axis - 2.18589) < 5e-6);
}

/* An infinite lid of radiance 1 gives the irradiance pi. With half-width a the error is that of the
 * far rim, 4 sides of order (h/a)^2. */
TEST(wide_rectangle_gives_pi)
{
    const double wide[2] = {-1e6, 1e6};
    assert_true(same(truth_rectangle_irradiance(1, wide, wide, 0.3, -0.2), M_PI));
    const double narrow[2] = {-1e3, 1e3};
    assert_false(same(truth_rectangle_irradiance(1, narrow, narrow, 0.3, -0.2), M_PI));
}

TEST(images_are_exact_moments)
{
    static const char *const names[] = {"11_furnace", "12_point_plane", "13_square_patch"};
    for (size_t s = 0; s < COUNT(names); s++) {
        OWN(moments) m;
        render_truth(names[s], 64, 48, &m);
        assert_int_equal(m.width, 64);
        assert_int_equal(m.height, 48);
        assert_string_equal(m.unit, "exact");
        assert_true(m.spp == 0);
        for (size_t i = 0; i < 64 * 48; i++) {
            assert_true(m.n[i] == 1);
            for (size_t c = 3 * i; c < 3 * i + 3; c++)
                assert_true(m.mean[c] > 0 && m.m2[c] == 0 && m.m3[c] == 0);
        }
    }
}

static double point_12(double x, double z, const void *ctx)
{
    (void)ctx;
    return point_by_vectors((double[3]){0.85, 0.5, -0.375}, x, z, NONE);
}

static double rectangle_13(double x, double z, const void *ctx)
{
    (void)ctx;
    return rectangle_by_edges(&rectangles[0], x, z);
}

static double rectangle_15(double x, double z, const void *ctx)
{
    (void)ctx;
    return rectangle_by_edges(&rectangles[1], x, z);
}

/* Numbers of the plane scenes as their .dae has them, with the footprint of the camera: centre
 * below the eye, half side = height x tan(half angle) = 2 x 1/2 = 0.5 x 2 = 1, image up = -Z. */
static const struct plane_scene plane_scenes[] = {
    /* light at (.85, -.375): (.85 + .75) * 32 = 51.2, (-.375 + 1.125) * 32 = 24 */
    {"12_point_plane",
     point_12,
     {3, 2, 1},
     {0.5, 0.6, 0.7},
     0.25 - 1,
     -0.125 - 1,
     1,
     51,
     24,
     false},
    /* centre at (.4, -.2): (.4 + 1.25) * 32 = 52.8, (-.2 + .875) * 32 = 21.6 */
    {"13_square_patch",
     rectangle_13,
     {12, 10, 6},
     {0.3, 0.5, 0.7},
     -0.25 - 1,
     0.125 - 1,
     1,
     52,
     21,
     false},
    /* centre at (.3, -.1), in the middle. Half side: .4 x 2.5 = 1 */
    {"15_square_overhead",
     rectangle_15,
     {1, 1.5, 2},
     {0.8, 0.6, 0.4},
     0.3 - 1,
     -0.1 - 1,
     1,
     32,
     32,
     true},
};

TEST(pixels_are_box_filtered)
{
    static const int pixels[][2] = {{0, 0},   {63, 0},  {0, 63}, {63, 63},
                                    {51, 24}, {52, 21}, {17, 40}};
    for (size_t s = 0; s < COUNT(plane_scenes); s++)
        expect_box_filter(&plane_scenes[s], pixels, COUNT(pixels));
}

TEST(pixels_do_not_depend_on_resolution)
{
    for (size_t s = 0; s < COUNT(plane_scenes); s++)
        expect_any_resolution(plane_scenes[s].name);
}

/* Where the bright spot lies (the pixel, or its neighbour if the spot is on their border), and that
 * each flip, turn or transposition of the image would put it elsewhere. */
TEST(images_are_the_right_way_round)
{
    for (size_t s = 0; s < COUNT(plane_scenes); s++) {
        OWN(moments) m;
        render_truth(plane_scenes[s].name, 64, 64, &m);
        int best = 0;
        for (int i = 0; i < 64 * 64; i++)
            if (m.mean[3 * i] > m.mean[3 * best])
                best = i;
        assert_in_range(best % 64, (size_t)plane_scenes[s].bright_col - 1,
                        (size_t)plane_scenes[s].bright_col);
        assert_in_range(best / 64, (size_t)plane_scenes[s].bright_row - 1,
                        (size_t)plane_scenes[s].bright_row);
        for (int symmetry = 1; symmetry < 8 && !plane_scenes[s].symmetric; symmetry++) {
            int col = best % 64, row = best / 64;
            int x = symmetry & 4 ? row : col, y = symmetry & 4 ? col : row;
            double other = mean_at(&m, symmetry & 1 ? 63 - x : x, symmetry & 2 ? 63 - y : y, 0);
            assert_true(other < 0.5 * m.mean[3 * best]);
        }
    }
}

#define POINT_REST "'albedo':[0.5,0.5,0.5],'footprint':{'x':[-1,1],'z':[-1,1]}"
#define RECT_REST  "'radiance':[1,1,1],'albedo':[0.5,0.5,0.5],'footprint':{'x':[-1,1],'z':[-1,1]}"

static const struct bad {
    const char *kind, *values;
    int depth;
    const char *message; /* a part of it; NULL: must be accepted */
} bad[] = {
    {"furnace", "{'emission':[1,1,1],'albedo':[0,0.5,1]}", 0, NULL},
    {"furnace", "{'emission':[1,1,1]}", 1, "albedo"},
    {"furnace", "{'emission':[1,1,1],'albedo':[0,0,0],'extra':1}", 1, "extra"},
    {"furnace", "{'emission':[1,1],'albedo':[0,0,0]}", 1, "'emission' is not 3 numbers"},
    {"furnace", "{'emission':[1,1,1,1],'albedo':[0,0,0]}", 1, "'emission' is not 3 numbers"},
    {"furnace", "{'emission':[1,1,'1'],'albedo':[0,0,0]}", 1, "'emission' is not 3 numbers"},
    {"furnace", "{'emission':[1,1,1],'albedo':[0,0,1.01]}", 1, "albedo[2] is 1.01"},
    {"furnace", "{'emission':[1,-1,1],'albedo':[0,0,0]}", 1, "emission[1] is -1"},
    {"lambda", "{}", 1, "truth 'lambda': unknown closed form"},
    {"point_over_plane", "{'intensity':[1,1,1],'light':[0,1,0]," POINT_REST "}", 1, NULL},
    {"point_over_plane", "{'intensity':[1,1,1],'light':[0,1,0]," POINT_REST "}", 7, NULL},
    {"point_over_plane", "{'intensity':[1,1,1],'light':[0,1,0]," POINT_REST "}", 0, "depth is 0"},
    {"point_over_plane", "{'intensity':[1,1,1],'light':[0,0,0]," POINT_REST "}", 1,
     "not above the plane"},
    {"point_over_plane", "{'intensity':[1,1,-1],'light':[0,1,0]," POINT_REST "}", 1,
     "intensity[2]"},
    {"point_over_plane",
     "{'intensity':[1,1,1],'light':[0,1,0],'albedo':[0.5,0.5,0.5],"
     "'footprint':{'x':[1,1],'z':[-1,1]}}",
     1, "footprint has no area"},
    {"point_over_plane", "{'intensity':[1,1,1],'light':[0,1e-3,0]," POINT_REST "}", 1,
     "not converged"},
    {"rectangle_over_plane", "{'height':1,'emitter':{'x':[0,1],'z':[0,1]}," RECT_REST "}", 1, NULL},
    {"rectangle_over_plane", "{'height':-1,'emitter':{'x':[0,1],'z':[0,1]}," RECT_REST "}", 1,
     "not above the plane"},
    {"rectangle_over_plane", "{'height':1,'emitter':{'x':[1,0],'z':[0,1]}," RECT_REST "}", 1,
     "emitter has no area"},
    {"rectangle_over_plane", "{'height':1,'emitter':{'x':[0,1],'y':[0,1]}," RECT_REST "}", 1, "z"},
    {"rectangle_over_plane",
     "{'height':1e-4,'emitter':{'x':[0.1,0.2],'z':[0.1,0.2]}," RECT_REST "}", 1, "not converged"},
};

TEST(impossible_values_are_refused)
{
    for (size_t i = 0; i < COUNT(bad); i++)
        expect_refusal(bad[i].kind, bad[i].values, bad[i].depth, bad[i].message);
}
