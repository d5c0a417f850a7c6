/* Closed forms of furnaces, spheres, spots and the sun against quadrature of the rendering integral
 * and conservation of energy; each comparison must also reject forms with a known mistake. */
#include "reference/truth/truth_lamps.h"
#include "reference/truth/truth_spot.h"
#include "reference/truth/truth_sun.h"
#include "tests/support/quadrature.h"
#include "tests/support/own.h"
#include "tests/support/test.h"
#include "tests/support/vectors.h"

#include <gsl/gsl_integration.h>
#include <gsl/gsl_math.h>

/* The direction at the angle whose cosine is `cosine` from the unit vector w, turned by phi. */
static void around(const double w[3], double cosine, double phi, double out[3])
{
    double u[3] = {0}, v[3], s = sqrt(fmax(0, 1 - cosine * cosine));
    u[fabs(w[0]) < 0.6 ? 0 : 1] = 1;
    cross3(w, u, v);
    unit3(v);
    cross3(v, w, u);
    for (int i = 0; i < 3; i++)
        out[i] = cosine * w[i] + s * (cos(phi) * u[i] + sin(phi) * v[i]);
}

struct cap {
    double (*f)(double cosine, double phi, const void *ctx);
    const void *ctx;
};

/* The circle at that angle, by the trapezoidal rule: what is integrated here is a trigonometric
 * polynomial of low degree in phi, for which the rule is exact. */
static double over_circle(double angle, void *p)
{
    enum { POINTS = 16 };
    const struct cap *c = p;
    double sum = 0;
    for (int i = 0; i < POINTS; i++)
        sum += c->f(cos(angle), 2 * M_PI * (i + 0.5) / POINTS, c->ctx);
    return sum / POINTS * 2 * M_PI * sin(angle);
}

/* Over the cap of directions whose cosine with the axis is at least `least`, by solid angle. */
static double over_cap(double (*f)(double, double, const void *), const void *ctx, double least)
{
    gsl_integration_workspace *w = gsl_integration_workspace_alloc(1000);
    struct cap c = {f, ctx};
    gsl_function g = {over_circle, &c};
    double value, error;
    assert_int_equal(gsl_integration_qag(&g, 0, acos(least), 0, 1e-11, 1000, GSL_INTEG_GAUSS31, w,
                                         &value, &error),
                     0);
    gsl_integration_workspace_free(w);
    return value;
}

/* Inside a sphere of radius 2, at a point of its wall: cos cos / (pi d^2) of the wall's other
 * points, by vectors. */
static double wall_transfer(double cosine, double phi, const void *ctx)
{
    (void)ctx;
    static const double pole[3] = {0.6, 0, 0.8};
    double q[3], p[3], d[3];
    around(pole, cosine, phi, q);
    for (int i = 0; i < 3; i++) {
        p[i] = 2 * pole[i];
        q[i] *= 2;
        d[i] = q[i] - p[i];
    }
    double d2 = dot3(d, d), at_p = -dot3(d, p) / 2, at_q = dot3(d, q) / 2;
    return at_p * at_q / (M_PI * d2 * d2);
}

/* `gather`: radiance that a wall point of albedo 1 reflects when all walls have radiance 1, by quadrature over the
 * wall; applied once per bounce. */
TEST(furnace_matches_quadrature)
{
    double gather = 4 * over_cap(wall_transfer, NULL, -1);
    static const double albedo[] = {0.3, 0.6, 0.9, 0.95, 0.8};
    for (size_t i = 0; i < COUNT(albedo); i++)
        for (int depth = 0; depth <= 20; depth++) {
            double radiance = 1.2;
            for (int k = 0; k < depth; k++)
                radiance = 1.2 + albedo[i] * gather * radiance;
            assert_true(same(truth_furnace(1.2, albedo[i], depth), radiance));
            /* Emission that is added once more at the end. */
            assert_false(same(truth_furnace(1.2, albedo[i], depth) + 1.2, radiance));
        }
}

/* 10: 1.2 (1 + .3), .8 (1 + .6), .4 (1 + .9). 11: .5 (1 - .8^6)/.2, 1 (1 - .5^6)/.5, 2 (1 - .2^6)/.8. 14: the series' closed
 * form, 20 bounces. */
TEST(furnace_images_are_flat)
{
    const struct {
        const char *name;
        double expected[3];
    } furnace[] = {
        {"10_furnace_one", {1.56, 1.28, 0.76}},
        {"11_furnace", {1.84464, 1.96875, 2.49984}},
        {"14_furnace_deep",
         {0.1 * (1 - gsl_pow_int(0.95, 21)) / 0.05, 0.15 * (1 - gsl_pow_int(0.9, 21)) / 0.1,
          0.3 * (1 - gsl_pow_int(0.8, 21)) / 0.2}}};
    for (size_t f = 0; f < COUNT(furnace); f++) {
        OWN(moments) m;
        render_truth(furnace[f].name, 16, 16, &m);
        for (size_t i = 0; i < 3 * 16 * 16; i++)
            assert_true(same(m.mean[i], furnace[f].expected[i % 3]));
    }
}

enum mistake { NONE, NO_RECEIVER_COSINE, NO_EMITTER_COSINE, ONE_OVER_R, WHOLE_SPHERE };

struct ball {
    double centre[3], radius, x, z;
    enum mistake mistake;
};

/* The receiver's distance to the centre, and the direction from the centre to it. */
static double ball_axis(const struct ball *b, double w[3])
{
    w[0] = b->x - b->centre[0];
    w[1] = -b->centre[1];
    w[2] = b->z - b->centre[2];
    double d = sqrt(dot3(w, w));
    unit3(w);
    return d;
}

/* cos cos / d^2 of a point of the sphere, given by its place about the axis to the receiver. */
static double ball_point(double cosine, double phi, const void *ctx)
{
    const struct ball *b = ctx;
    double axis[3], n[3], to[3];
    ball_axis(b, axis);
    around(axis, cosine, phi, n);
    for (int i = 0; i < 3; i++)
        to[i] = b->centre[i] + b->radius * n[i] - (i == 0 ? b->x : i == 2 ? b->z : 0);
    double d2 = dot3(to, to), d = sqrt(d2);
    double receiver = b->mistake == NO_RECEIVER_COSINE ? 1 : to[1] / d;
    double emitter = b->mistake == NO_EMITTER_COSINE ? 1 : fabs(dot3(to, n)) / d;
    return receiver * emitter / (b->mistake == ONE_OVER_R ? d : d2);
}

/* Over the part of the sphere that the receiver sees: up to the cosine R/d from the axis. */
static double ball_by_area(const struct ball *b)
{
    double axis[3], d = ball_axis(b, axis);
    double from = b->mistake == WHOLE_SPHERE ? -1 : b->radius / d;
    return b->radius * b->radius * over_cap(ball_point, b, from);
}

static double ball_direction(double cosine, double phi, const void *ctx)
{
    const struct ball *b = ctx;
    double axis[3], w[3];
    ball_axis(b, axis);
    for (int i = 0; i < 3; i++)
        axis[i] = -axis[i];
    around(axis, cosine, phi, w);
    return b->mistake == NO_RECEIVER_COSINE ? 1 : w[1];
}

/* Over the cone that the sphere fills. */
static double ball_by_solid_angle(const struct ball *b)
{
    double axis[3], sine = b->radius / ball_axis(b, axis);
    return over_cap(ball_direction, b, sqrt(1 - sine * sine));
}

static const struct ball balls[] = {
    {{0.75, 0.6, -0.35}, 0.5, 0, 0, NONE}, /* that of 33_sphere_light */
    {{0, 1, 0}, 0.999, 0, 0, NONE},        /* nearly touches the plane */
    {{-3, 2, 1}, 0.01, 0, 0, NONE},
};
static const double places[][2] = {{0, 0}, {0.75, -0.35}, {0.8, -0.5}, {0, 0.3}, {-6, 4}};

TEST(sphere_matches_quadrature)
{
    static const enum mistake by_area[] = {NO_RECEIVER_COSINE, NO_EMITTER_COSINE, ONE_OVER_R,
                                           WHOLE_SPHERE};
    for (size_t i = 0; i < COUNT(balls); i++)
        for (size_t j = 0; j < COUNT(places); j++) {
            struct ball b = balls[i];
            b.x = places[j][0];
            b.z = places[j][1];
            double form = truth_sphere_irradiance(b.centre, b.radius, b.x, b.z);
            assert_true(same(form, ball_by_area(&b)));
            assert_true(same(form, ball_by_solid_angle(&b)));
            for (size_t m = 0; m < COUNT(by_area); m++) {
                b.mistake = by_area[m];
                assert_false(same(form, ball_by_area(&b)));
            }
            b.mistake = NO_RECEIVER_COSINE;
            assert_false(same(form, ball_by_solid_angle(&b)));
        }
}

/* A disc of the sphere's radius that faces the receiver fills less than its cone: the form that
 * takes one for the other must be rejected. */
TEST(sphere_is_not_a_disc)
{
    const struct ball *b = &balls[0];
    double form = truth_sphere_irradiance(b->centre, b->radius, 0.75, -0.35);
    double disc = M_PI * 0.25 / (0.36 + 0.25);
    assert_false(same(form, disc));
    assert_true(form > disc);
}

static const struct truth_spot spots[] = {
    {{-0.1, 0.8, -0.2}, {3 / 7., -6 / 7., 2 / 7.}, 3, M_SQRT1_2}, /* that of 31 and 38 */
    {{0, 1, 0}, {0, -1, 0}, 0, 0.5},
    {{0.5, 0.3, 0.25}, {-0.48, -0.8, 0.36}, 2.5, 0.9},
    {{0, 2, 0}, {0.28, -0.96, 0}, 20, 0.5},
};

/* The angle from the arc tangent, the falloff from the angles, with one mistake at a time. */
static double spot_by_angles(const struct truth_spot *s, double x, double z, double exponent,
                             double cutoff, enum mistake mistake)
{
    double d[3] = {x - s->light[0], -s->light[1], z - s->light[2]}, c[3];
    cross3(s->axis, d, c);
    double angle = atan2(sqrt(dot3(c, c)), dot3(s->axis, d));
    double from_normal = atan2(hypot(d[0], d[2]), s->light[1]);
    if (angle >= cutoff)
        return 0;
    double r = s->light[1] / cos(from_normal);
    return pow(cos(angle), exponent) * (mistake == NO_RECEIVER_COSINE ? 1 : cos(from_normal)) /
           (mistake == ONE_OVER_R ? r : r * r);
}

TEST(spot_matches_angles)
{
    const struct truth_spot *s = &spots[0];
    int dark = 0;
    for (double x = -0.55; x < 1.2; x += 0.1)
        for (double z = -0.6; z < 1; z += 0.1) {
            double form = truth_spot_irradiance(s, x, z);
            assert_true(same(form, spot_by_angles(s, x, z, 3, M_PI / 4, NONE)));
            if (form == 0) {
                dark++;
                continue;
            }
            assert_false(same(form, spot_by_angles(s, x, z, 4, M_PI / 4, NONE)));
            assert_false(same(form, spot_by_angles(s, x, z, 3, M_PI / 4, NO_RECEIVER_COSINE)));
            assert_false(same(form, spot_by_angles(s, x, z, 3, M_PI / 4, ONE_OVER_R)));
        }
    /* The grid crosses the edge. A cone of the full angle, or of half of it, has another edge. */
    assert_true(dark > 20);
    assert_true(truth_spot_irradiance(s, -0.4, -0.2) == 0);
    assert_true(spot_by_angles(s, -0.4, -0.2, 3, M_PI / 2, NONE) > 0);
    assert_true(truth_spot_irradiance(s, 0.9, 0.8) > 0);
    assert_true(spot_by_angles(s, 0.9, 0.8, 3, M_PI / 8, NONE) == 0);
}

/* All that leaves the light in its cone lands on the plane: the sum over a grid that holds the
 * ellipse, cell means times area, is 2 pi (1 - c^(n+1)) / (n+1), which is the integral of cos^n over
 * the cone. The cells' edges fall anywhere. */
TEST(plane_catches_the_cone)
{
    enum { CELLS = 31 };
    for (size_t i = 0; i < COUNT(spots); i++) {
        const struct truth_spot *s = &spots[i];
        assert_true(truth_spot_is_ellipse(s));
        double half = 6 * s->light[1], side = 2 * half / CELLS, flux = 0;
        for (int row = 0; row < CELLS; row++)
            for (int col = 0; col < CELLS; col++) {
                double x = s->light[0] - half + side * col, z = s->light[2] - half + side * row;
                double mean;
                struct err e;
                MUST(truth_spot_mean(s, (double[2]){x, x + side}, (double[2]){z, z + side}, &mean,
                                     &e));
                flux += mean * side * side;
            }
        double n = s->exponent + 1, cone = 2 * M_PI * (1 - pow(s->cos_cutoff, n)) / n;
        assert_true(same(flux, cone));
        assert_false(same(flux, 2 * M_PI * (1 - pow(s->cos_cutoff, n + 1)) / (n + 1)));
        assert_false(same(flux, cone * (1 + 1e-8)));
    }
}

static double spot_at(double x, double z, void *ctx)
{
    return truth_spot_irradiance(ctx, x, z);
}

struct line {
    const struct truth_spot *spot;
    double x, z[2];
    gsl_integration_workspace *inner;
};

static double along_line(double z, void *ctx)
{
    const struct line *l = ctx;
    return spot_at(l->x, z, (void *)(uintptr_t)l->spot);
}

/* Over z at one x, the ends of the lit part found by bisection from the brightest of 64 points. */
static double lit_line(double x, void *ctx)
{
    struct line *l = ctx;
    l->x = x;
    double best = 0, inside = 0, step = (l->z[1] - l->z[0]) / 63;
    for (int i = 0; i < 64; i++) {
        double z = l->z[0] + step * i, value = along_line(z, l);
        if (value > best) {
            best = value;
            inside = z;
        }
    }
    if (best == 0)
        return 0;
    double end[2];
    for (int k = 0; k < 2; k++) {
        double lit = inside, dark = l->z[k];
        for (int i = 0; i < 80 && along_line(l->z[k], l) == 0; i++) {
            double middle = (lit + dark) / 2;
            *(along_line(middle, l) > 0 ? &lit : &dark) = middle;
        }
        end[k] = along_line(l->z[k], l) == 0 ? lit : l->z[k];
    }
    gsl_function g = {along_line, l};
    double value, error;
    assert_int_equal(gsl_integration_qag(&g, end[0], end[1], 0, 1e-11, 1000, GSL_INTEG_GAUSS31,
                                         l->inner, &value, &error),
                     0);
    return value;
}

/* Pixels of 38_spot_edge that the edge crosses, lines along z in place of x and another search for
 * their ends; and pixels that are wholly lit or dark. */
TEST(edge_pixels_match_quadrature)
{
    struct truth_spot s = spots[0];
    struct moments m;
    render_truth("38_spot_edge", 64, 64, &m);
    double side = 1.5 / 64;
    gsl_integration_workspace *outer = gsl_integration_workspace_alloc(1000);
    struct line l = {&s, 0, {0, 0}, gsl_integration_workspace_alloc(1000)};
    int crossed = 0, tested = 0;
    for (int row = 0; row < 64; row += 3)
        for (int col = 0; col < 64; col++) {
            double x = -0.5 + side * col, z = -0.625 + side * row;
            int lit = 0;
            for (int k = 0; k < 4; k++)
                lit += truth_spot_irradiance(&s, x + side * (k & 1), z + side * (k >> 1)) > 0;
            crossed += lit > 0 && lit < 4;
            if ((lit == 0 || lit == 4) && (row * 64 + col) % 50 != 0)
                continue;
            l.z[0] = z;
            l.z[1] = z + side;
            gsl_function g = {lit_line, &l};
            double value, error;
            assert_int_equal(gsl_integration_qag(&g, x, x + side, 1e-16, 1e-10, 1000,
                                                 GSL_INTEG_GAUSS15, outer, &value, &error),
                             0);
            double mean = 0.6 / M_PI * 4 * value / (side * side);
            double form = mean_at(&m, col, row, 0);
            /* Bisection knows the end to a rounding error of the cosine, which counts for slivers. */
            assert_true(same(form, mean) || fabs(form - mean) < 1e-12);
            tested++;
        }
    assert_true(crossed > 20 && tested > 40);
    gsl_integration_workspace_free(l.inner);
    gsl_integration_workspace_free(outer);
    moments_free(&m);
}

static double spot_31(double x, double z, const void *ctx)
{
    (void)ctx;
    return spot_by_angles(&spots[0], x, z, 3, M_PI / 4, NONE);
}

static double sphere_33(double x, double z, const void *ctx)
{
    (void)ctx;
    double dx = 0.75 - x, dz = -0.35 - z, d = sqrt(dx * dx + 0.36 + dz * dz);
    return M_PI * (0.5 / d) * (0.5 / d) * (0.6 / d);
}

/* As the .dae have them. Half side = height of the eye x tan(half angle): 1 x 1/2, .2 x 2. */
static const struct plane_scene plane_scenes[] = {
    {.name = "31_spot_plane",
     .irradiance = spot_31,
     .source = {4, 3, 2},
     .albedo = {0.6, 0.7, 0.8},
     .left = 0.5 - 0.5,
     .top = 0.2 - 0.5,
     .half = 0.5},
    {.name = "33_sphere_light",
     .irradiance = sphere_33,
     .source = {2, 3, 4},
     .albedo = {0.8, 0.6, 0.5},
     .left = 0.4 - 0.4,
     .top = -0.1 - 0.4,
     .half = 0.4},
};

TEST(pixels_are_box_filtered)
{
    static const int pixels[][2] = {{0, 0}, {63, 0}, {0, 63}, {63, 63}, {60, 12}, {17, 40}};
    for (size_t s = 0; s < COUNT(plane_scenes); s++)
        expect_box_filter(&plane_scenes[s], pixels, COUNT(pixels));
}

TEST(pixels_do_not_depend_on_resolution)
{
    static const char *const names[] = {"17_lens_step", "31_spot_plane", "32_sun_plane",
                                        "33_sphere_light", "38_spot_edge"};
    for (size_t s = 0; s < COUNT(names); s++)
        expect_any_resolution(names[s]);
}

/* 32_sun_plane as its .dae has it: apex, then points on the ridges right, bottom, left, top. */
static const double eye[3] = {0.5, 2, -0.25};
static const double corner[5][3] = {{0.515625, 0, -0.234375},
                                    {8, -4, -0.203125},
                                    {0.5234375, -1, 3.5},
                                    {-2.3125, -0.25, -0.232421875},
                                    {0.53125, -2, -5.25}};

static const struct truth_pyramid pyramid = {{0.515625, 0, -0.234375},
                                             {{8, -4, -0.203125},
                                              {0.5234375, -1, 3.5},
                                              {-2.3125, -0.25, -0.232421875},
                                              {0.53125, -2, -5.25}},
                                             {6, 3, 2}};

struct sun {
    double axis[3], normal[3];
};

static double sun_direction(double cosine, double phi, const void *ctx)
{
    const struct sun *s = ctx;
    double w[3];
    around(s->axis, cosine, phi, w);
    return dot3(w, s->normal);
}

/* The facet's cosine as the irradiance of a sun of 5 degrees' radius, whose radiance makes the
 * irradiance 1 on a plane that faces it: exact as long as all of it is above the horizon (the
 * cosine is above sin 5 degrees), because the sum of its directions lies along its axis. */
static double facet_by_quadrature(const double normal[3], const double to_light[3])
{
    struct sun s = {{to_light[0], to_light[1], to_light[2]}, {normal[0], normal[1], normal[2]}};
    unit3(s.axis);
    unit3(s.normal);
    double sine = sin(5 * M_PI / 180);
    return over_cap(sun_direction, &s, sqrt(1 - sine * sine)) / (M_PI * sine * sine);
}

/* Up the normal of facet k, which the ridges to corner[k+1] and the next bound, from heights: the
 * plane y = a x + b z through both, by Cramer's rule. */
static void facet_normal(int k, double n[3])
{
    double u[3], v[3];
    for (int i = 0; i < 3; i++) {
        u[i] = corner[1 + k][i] - corner[0][i];
        v[i] = corner[1 + (k + 1) % 4][i] - corner[0][i];
    }
    double det = u[0] * v[2] - v[0] * u[2];
    n[0] = -(u[1] * v[2] - v[1] * u[2]) / det;
    n[1] = 1;
    n[2] = -(u[0] * v[1] - v[0] * u[1]) / det;
}

TEST(pyramid_matches_quadrature)
{
    static const double turned[][3] = {{-6, 3, 2}, {2, 3, 6}, {6, 2, 3}, {6, 3, -2}};
    double form[4];
    truth_pyramid_cosines(&pyramid, form);
    for (int k = 0; k < 4; k++) {
        double n[3];
        facet_normal(k, n);
        assert_true(form[k] > sin(5 * M_PI / 180));
        assert_true(same(form[k], facet_by_quadrature(n, pyramid.to_light)));
        for (size_t i = 0; i < COUNT(turned); i++)
            assert_false(same(form[k], facet_by_quadrature(n, turned[i])));
        for (int other = 0; other < 4; other++)
            assert_true(same(form[k], form[other]) == (k == other));
    }
}

/* Which facet the eye's ray through image point (sx, sy) at distance 1 meets first; -1 for none. */
static int facet_seen(double sx, double sz)
{
    const double d[3] = {sx, -1, sz};
    double nearest = INFINITY;
    int seen = -1;
    for (int k = 0; k < 4; k++) {
        /* eye + t d = apex + a u + b v */
        double u[3], v[3], from[3], uv[3], dv[3], du[3];
        for (int i = 0; i < 3; i++) {
            u[i] = corner[1 + k][i] - corner[0][i];
            v[i] = corner[1 + (k + 1) % 4][i] - corner[0][i];
            from[i] = eye[i] - corner[0][i];
        }
        cross3(u, v, uv);
        cross3(d, v, dv);
        cross3(u, d, du);
        double det = -dot3(d, uv), t = dot3(from, uv) / det;
        double a = dot3(from, dv) / det, b = dot3(from, du) / det;
        if (t > 0 && a >= 0 && b >= 0 && a + b <= 1 && t < nearest) {
            nearest = t;
            seen = k;
        }
    }
    return seen;
}

/* Each pixel is cut where the ridges' images may cross it, through its middle, into four squares
 * that show one facet each; the centres of the squares are followed into the scene. */
TEST(pyramid_pixels_match_rays)
{
    double cosine[4];
    truth_pyramid_cosines(&pyramid, cosine);
    OWN(moments) m;
    render_truth("32_sun_plane", 64, 64, &m);
    int mixed = 0;
    for (int row = 0; row < 64; row++)
        for (int col = 0; col < 64; col++) {
            double sum = 0;
            int facets = 0;
            for (int k = 0; k < 4; k++) {
                double sx = -0.5 + (col + 0.25 + 0.5 * (k & 1)) / 64;
                double sz = -0.5 + (row + 0.25 + 0.5 * (k >> 1)) / 64;
                int f = facet_seen(sx, sz);
                assert_in_range(f, 0, 3);
                facets |= 1 << f;
                sum += cosine[f] / 4;
            }
            mixed += (facets & (facets - 1)) != 0;
            assert_true(same(mean_at(&m, col, row, 0), 0.7 * 3 / M_PI * sum));
            assert_true(same(mean_at(&m, col, row, 1), 0.5 * 2.5 / M_PI * sum));
            assert_true(same(mean_at(&m, col, row, 2), 0.3 * 2 / M_PI * sum));
        }
    assert_int_equal(mixed, 127);
}

#define FOOT   "'footprint':{'x':[-1,1],'z':[-1,1]}"
#define SPOT   "{'intensity':[1,1,1],'albedo':[1,1,1],'light':[0,1,0],'axis':[0,-1,0]," FOOT
#define BALL   "{'radiance':[1,1,1],'albedo':[1,1,1],'centre':[0,1,0]," FOOT
#define SUN    "{'irradiance':[1,1,1],'albedo':[1,1,1],'centre':[0.5,0.5],'apex':[0,0,0],"
#define RIDGES "'ridges':[[1,-1,0],[0,-1,1],[-1,-1,0],[0,-1,-1]]"

TEST(impossible_values_are_refused)
{
    expect_refusal("spot_over_plane", SPOT ",'exponent':1,'cutoff':45}", 1, NULL);
    expect_refusal("spot_over_plane", SPOT ",'exponent':1,'cutoff':45}", 0, "depth is 0");
    expect_refusal("spot_over_plane", SPOT ",'exponent':-1,'cutoff':45}", 1, "exponent is -1");
    expect_refusal("spot_over_plane", SPOT ",'exponent':1,'cutoff':90}", 1, "cutoff is 90");
    expect_refusal("spot_over_plane", SPOT ",'exponent':1}", 1, "cutoff");
    expect_refusal("spot_over_plane",
                   "{'intensity':[1,1,1],'albedo':[1,1,1],'light':[0,1,0],'axis':[1,-1,0],"
                   "'exponent':1,'cutoff':50," FOOT "}",
                   1, "does not end on the plane");
    expect_refusal("sphere_over_plane", BALL ",'radius':0.9}", 1, NULL);
    expect_refusal("sphere_over_plane", BALL ",'radius':1}", 1, "radius is 1");
    expect_refusal("sphere_over_plane", BALL ",'radius':0}", 1, "radius is 0");
    expect_refusal("sphere_over_plane", BALL ",'radius':0.9}", 0, "depth is 0");
    expect_refusal("sun_on_pyramid", SUN RIDGES ",'to_light':[0,1,0]}", 1, NULL);
    expect_refusal("sun_on_pyramid", SUN RIDGES ",'to_light':[0,1,0]}", 0, "depth is 0");
    expect_refusal("sun_on_pyramid", SUN RIDGES ",'to_light':[3,1,0]}", 1, "does not face");
    expect_refusal("sun_on_pyramid",
                   SUN "'to_light':[0,1,0],'ridges':[[1,-1,0],[0,1,1],[-1,-1,0],[0,1,-1]]}", 1,
                   "not convex");
    expect_refusal("sun_on_pyramid", SUN "'to_light':[0,1,0],'ridges':[[1,-1,0]]}", 1, "1");
}
