/* The closed forms of a rough metal and of skies against other routes to the same number: quadrature
 * over visible normals, over the wall, over directions, over the texels of the map. Points are
 * compared to 1e-9, and the same tolerance must reject forms with a known mistake. */
#include "reference/truth/truth_ggx.h"
#include "reference/truth/truth_sky.h"
#include "reference/truth/truth_pixel_mean.h"
#include "tests/support/optics.h"
#include "renderer/image/image_oiio.h"
#include "tests/support/quadrature.h"
#include "tests/support/suite_files.h"
#include "tests/support/own.h"
#include "tests/support/test.h"
#include "tests/support/vectors.h"

#include <gsl/gsl_integration.h>

static void unit_vector(uint64_t *state, double n[3])
{
    double z = 2 * next_number(state) - 1, phi = 2 * M_PI * next_number(state);
    n[0] = sqrt(1 - z * z) * cos(phi);
    n[1] = z;
    n[2] = sqrt(1 - z * z) * sin(phi);
}

/* A rough metal seen under cos_o: the mean of F G2/G1 over the normals m visible from wo, whose density
 * is D (wo.m) G1 / cos_o, as long as they reflect to above the surface. */
enum metal_mistake { RIGHT, SEPARABLE, NO_SHADOWING, SCHLICK, NO_FRESNEL, SQUARED_ALPHA };

struct metal {
    double alpha, eta, k, cos_o;
    enum metal_mistake mistake;
};

static double lambda(double alpha, double z)
{
    return 0.5 * (sqrt(1 + alpha * alpha * (1 - z * z) / (z * z)) - 1);
}

static double metal_fresnel(const struct metal *m, double c)
{
    double complex n = m->eta + m->k * _Complex_I;
    if (m->mistake == NO_FRESNEL)
        return 1;
    if (m->mistake == SCHLICK)
        return optics_fresnel(1, n) + (1 - optics_fresnel(1, n)) * pow(1 - c, 5);
    return optics_fresnel(c, n);
}

/* psi: azimuth of m from wo's. t: tan(theta_m) over its value where wi is at the horizon. With slope =
 * tan(theta_m) and c = sin(theta_o) cos(psi), wi.z = 2 (wo.m) m.z - cos_o > 0 means
 * cos_o slope^2 - 2 c slope - cos_o < 0. */
static double visible_normal(double psi, double t, const void *data)
{
    const struct metal *m = data;
    double alpha = m->mistake == SQUARED_ALPHA ? m->alpha * m->alpha : m->alpha, z = m->cos_o;
    double c = sqrt(1 - z * z) * cos(psi), horizon = (c + sqrt(c * c + z * z)) / z;
    double slope = t * horizon, cos_m = 1 / sqrt(1 + slope * slope);
    double cos_om = cos_m * (z + slope * c), wi_z = 2 * cos_om * cos_m - z;
    if (!(wi_z > 0 && cos_om > 0))
        return 0;
    double lo = lambda(alpha, z), li = lambda(alpha, wi_z);
    double g2 = 1 / (1 + lo + li);
    if (m->mistake == SEPARABLE)
        g2 = 1 / ((1 + lo) * (1 + li));
    if (m->mistake == NO_SHADOWING)
        g2 = 1 / (1 + lo);
    /* D dm = slope dslope dpsi / (pi alpha^2 cos_m (1 + slope^2/alpha^2)^2) [Walter07 eq. 33] */
    double e = 1 + slope * slope / (alpha * alpha);
    return metal_fresnel(m, cos_om) * g2 * cos_om / z * slope * horizon /
           (M_PI * alpha * alpha * cos_m * e * e);
}

static double albedo_by_normals(const struct metal *m)
{
    return 2 * integrate_plane(visible_normal, m, (double[]){0, M_PI}, (double[]){0, 1});
}

static const double metal_alpha = 0.5, metal_eta[3] = {.2, .9, 1.3}, metal_k[3] = {3.9, 2.5, 2.3};

TEST(metal_albedo_both_ways)
{
    static const double cosine[] = {1, 0.9, 0.7, 0.5, 0.35, 0.237};
    for (size_t i = 0; i < COUNT(cosine); i++)
        for (int c = 0; c < 3; c++) {
            struct metal m = {metal_alpha, metal_eta[c], metal_k[c], cosine[i], RIGHT};
            double a = truth_ggx_albedo(m.alpha, m.eta, m.k, m.cos_o, 96);
            assert_true(same(a, albedo_by_normals(&m)));
        }
    for (enum metal_mistake wrong = SEPARABLE; wrong <= SQUARED_ALPHA; wrong++)
        for (size_t i = 1; i < COUNT(cosine); i += 2) {
            struct metal m = {metal_alpha, metal_eta[0], metal_k[0], cosine[i], wrong};
            double a = truth_ggx_albedo(m.alpha, m.eta, m.k, m.cos_o, 96);
            double off = albedo_by_normals(&m) / a - 1;
            print_message("mistake %d at cosine %g: %+.3f %%\n", (int)wrong, cosine[i], 100 * off);
            assert_true(fabs(off) > 1e-5);
        }
}

TEST(conductor_of_amplitudes)
{
    for (int i = 1; i <= 100; i++)
        for (int c = 0; c < 3; c++)
            assert_true(same(truth_fresnel_conductor(i / 100.0, metal_eta[c], metal_k[c]),
                             optics_fresnel(i / 100.0, metal_eta[c] + metal_k[c] * _Complex_I)));
    /* Without absorption it is a dielectric. */
    assert_true(same(truth_fresnel_conductor(0.6, 1.5, 0), optics_fresnel(0.6, 1.5)));
}

/* White facets, alpha = 1, seen from above: D = 1/pi, G1(wo) = 1 and, with c = cos(theta_i), theta_i =
 * 2 theta_m, G2 = 2c/(1 + c). So A = integral of 2 sin cos G2 over theta_m from 0 to pi/4, which is that
 * of c/(1 + c) over c from 0 to 1: 1 - ln 2. A very large k makes facets white. */
TEST(white_metal_from_above)
{
    assert_true(same(truth_ggx_albedo(1, 1, 1e12, 1, 96), 1 - M_LN2));
}

struct wall_point {
    double distance, height;
    int mistake; /* 1: one cosine missing, 2: cosines exchanged for those of a lid */
};

/* Share of dy dz of the wall: cos(floor) cos(wall) / (pi d^2), with cosines y/d and distance/d. */
static double wall_element(double y, double z, const void *data)
{
    const struct wall_point *p = data;
    double d2 = p->distance * p->distance + y * y + z * z;
    if (p->mistake == 1)
        return y / (M_PI * d2 * sqrt(d2));
    if (p->mistake == 2)
        return p->distance * p->distance / (M_PI * d2 * d2);
    return y * p->distance / (M_PI * d2 * d2);
}

TEST(wall_share_both_ways)
{
    uint64_t s = 34;
    for (int i = 0; i < 60; i++) {
        struct wall_point p = {0.15 + 2 * next_number(&s), 0.5 + 2 * next_number(&s), 0};
        double z[2] = {-1.5 + 2 * next_number(&s), 0};
        z[1] = z[0] + 0.2 + 2 * next_number(&s);
        const double y[2] = {0, p.height};
        double share = truth_wall_share(p.distance, z, p.height);
        assert_true(same(share, integrate_plane(wall_element, &p, y, z)));
        for (p.mistake = 1; p.mistake <= 2; p.mistake++)
            assert_false(same(share, integrate_plane(wall_element, &p, y, z)));
    }
    /* A wall without end hides half of the sky from a point at its foot. */
    const double wide[2] = {-1e9, 1e9};
    assert_true(same(truth_wall_share(1e-9, wide, 1e3), 0.5));
}

/* The sky of 35_sky_gradient, its numbers once more. */
static const struct truth_gradient sky = {.mean = {1, .8, .9},
                                          .gradient = {{.6, -.1, .2}, {.2, .5, .1}, {.1, .2, -.6}}};

struct sky_point {
    double n[3], s[3], t[3];
    int channel;
    bool no_cosine;
};

static void make_frame(struct sky_point *p)
{
    int least = fabs(p->n[0]) < 0.5 ? 0 : 1;
    double a[3] = {least == 0, least == 1, 0}, c = dot3(a, p->n);
    for (int k = 0; k < 3; k++)
        p->s[k] = (a[k] - c * p->n[k]) / sqrt(1 - c * c);
    for (int k = 0; k < 3; k++)
        p->t[k] = p->n[(k + 1) % 3] * p->s[(k + 2) % 3] - p->n[(k + 2) % 3] * p->s[(k + 1) % 3];
}

/* L cos(theta) sin(theta) / pi */
static double sky_element(double theta, double phi, const void *data)
{
    const struct sky_point *p = data;
    double slope = 0;
    for (int k = 0; k < 3; k++)
        slope += sky.gradient[k][p->channel] *
                 (cos(theta) * p->n[k] + sin(theta) * (cos(phi) * p->s[k] + sin(phi) * p->t[k]));
    return (sky.mean[p->channel] + slope) * sin(theta) * (p->no_cosine ? 0.5 : cos(theta)) / M_PI;
}

TEST(gradient_both_ways)
{
    uint64_t s = 35;
    for (int i = 0; i < 60; i++) {
        struct sky_point p = {.channel = i % 3};
        unit_vector(&s, p.n);
        make_frame(&p);
        double form = truth_gradient_reflected(&sky, p.channel, p.n);
        assert_true(same(form, integrate_plane(sky_element, &p, (double[]){0, M_PI_2},
                                               (double[]){0, 2 * M_PI})));
        p.no_cosine = true;
        assert_false(same(form, integrate_plane(sky_element, &p, (double[]){0, M_PI_2},
                                                (double[]){0, 2 * M_PI})));
        const double turned[3] = {p.n[2], p.n[1], -p.n[0]};
        assert_false(same(form, truth_gradient_reflected(&sky, p.channel, turned)));
    }
}

enum { MAP_WIDTH = 64, MAP_HEIGHT = 32 };

static void read_map(struct image *im)
{
    struct err e = {""};
    bool half;
    MUST(image_read("reference/scenes/35_sky_gradient.exr", im, &half, &e));
    assert_false(half);
    assert_int_equal(im->width, MAP_WIDTH);
    assert_int_equal(im->height, MAP_HEIGHT);
    assert_int_equal(image_channel(im, "R"), 0);
    assert_int_equal(image_channel(im, "B"), 2);
}

TEST(map_is_what_make_sky_writes)
{
    OWN(image) im;
    read_map(&im);
    for (int row = 0; row < MAP_HEIGHT; row++)
        for (int col = 0; col < MAP_WIDTH; col++)
            for (int c = 0; c < 3; c++) {
                float expected =
                    (float)truth_gradient_texel(&sky, c, MAP_WIDTH, MAP_HEIGHT, col, row);
                float v = im.data[(row * MAP_WIDTH + col) * im.channels + c];
                /* mathematical functions may differ in the last digit between libraries */
                assert_true(fabsf(v - expected) <= 2e-7f * expected && v > 0);
            }
}

/* What a surface of albedo 1 reflects under the map itself, bilinear between the middles of texels and
 * constant beyond the middles of the outer rows: Gauss-Legendre with 4 x 4 points over each of 8 x 8 parts of
 * each cell, in the directions in front of the surface. The edge of the hemisphere runs through cells, where
 * the integrand has a kink; the error that leaves is of order 1e-6. */
static double reflected_under_map(const struct image *im, int channel, const double n[3])
{
    enum { PARTS = 8, POINTS = 4 };
    gsl_integration_glfixed_table *rule = gsl_integration_glfixed_table_alloc(POINTS);
    double sum = 0;
    for (int j = 0; j < MAP_HEIGHT * PARTS; j++)
        for (size_t a = 0; a < POINTS; a++) {
            double y, wy;
            gsl_integration_glfixed_point((double)j / PARTS, (j + 1.0) / PARTS, a, &y, &wy, rule);
            double theta = M_PI * y / MAP_HEIGHT, in_y = fmin(fmax(y - 0.5, 0), MAP_HEIGHT - 1.0);
            int row = (int)fmin(in_y, MAP_HEIGHT - 2);
            for (int i = 0; i < MAP_WIDTH * PARTS; i++)
                for (size_t b = 0; b < POINTS; b++) {
                    double x, wx;
                    gsl_integration_glfixed_point((double)i / PARTS, (i + 1.0) / PARTS, b, &x, &wx,
                                                  rule);
                    double phi = 2 * M_PI * x / MAP_WIDTH - M_PI;
                    double w[3] = {sin(theta) * cos(phi), cos(theta), -sin(theta) * sin(phi)};
                    double c = dot3(n, w);
                    if (c <= 0)
                        continue;
                    double in_x = x - 0.5 + (x < 0.5 ? MAP_WIDTH : 0);
                    int col = (int)in_x, next = (col + 1) % MAP_WIDTH;
                    const float *top = im->data + 3 * row * MAP_WIDTH + channel;
                    const float *low = top + 3 * MAP_WIDTH;
                    double s = in_x - col, t = in_y - row;
                    double light = (1 - t) * ((1 - s) * top[3 * col] + s * top[3 * next]) +
                                   t * ((1 - s) * low[3 * col] + s * low[3 * next]);
                    sum += wx * wy * light * c * sin(theta);
                }
        }
    gsl_integration_glfixed_table_free(rule);
    return sum * (M_PI / MAP_HEIGHT) * (2 * M_PI / MAP_WIDTH) / M_PI;
}

/* So the closed form may be used for the map: texel values are chosen steeper than the gradient to make up for
 * bilinear interpolation. Control: the plain values of the gradient at texel centres. */
TEST(map_stands_for_the_gradient)
{
    OWN(image) im, plain;
    double worst = 0, worst_plain = 0;
    uint64_t s = 350;
    read_map(&im);
    read_map(&plain);
    for (int i = 0; i < 3 * MAP_WIDTH * MAP_HEIGHT; i++) {
        /* As if texels simply had the value in their middle. */
        int col = i / 3 % MAP_WIDTH, row = i / 3 / MAP_WIDTH;
        double theta = M_PI * (row + 0.5) / MAP_HEIGHT,
               phi = 2 * M_PI * (col + 0.5) / MAP_WIDTH - M_PI;
        double w[3] = {sin(theta) * cos(phi), cos(theta), -sin(theta) * sin(phi)};
        double v = sky.mean[i % 3];
        for (int k = 0; k < 3; k++)
            v += sky.gradient[k][i % 3] * w[k];
        plain.data[i] = (float)v;
    }
    for (int i = 0; i < 24; i++) {
        double n[3] = {i == 0, i == 1, i == 2};
        if (i > 2)
            unit_vector(&s, n);
        double form = truth_gradient_reflected(&sky, i % 3, n);
        worst = fmax(worst, fabs(reflected_under_map(&im, i % 3, n) / form - 1));
        worst_plain = fmax(worst_plain, fabs(reflected_under_map(&plain, i % 3, n) / form - 1));
    }
    print_message("worst error %.2e, of texels with the plain values %.2e\n", worst, worst_plain);
    assert_true(worst < 1e-5);
    assert_true(worst_plain > 1e-4);
}

/* Of the shipped images: one pixel's mean by the midpoints of 40 x 40 cells of it, exact to 1e-6, with
 * the camera's geometry written once more. */
static void render(const char *name, struct moments *out)
{
    struct err e;
    const struct suite_scene *scene = suite_shipped_scene(name);
    assert_string_equal(scene->reference[0].engine, "truth");
    MUST(truth_render(scene, &scene->reference[0], out, &e));
}

static double floor_seen_down(double u, double v, int channel)
{
    static const double sky_radiance[3] = {1, .8, .6}, albedo[3] = {.8, .6, .4};
    double x = 0.4 + u, z = 0.1 + v, local[2] = {-1.2 - z, 0.4 - z};
    if (x > 1.025)
        return sky_radiance[channel];
    return sky_radiance[channel] * albedo[channel] * (1 - truth_wall_share(x + 0.75, local, 1.5));
}

/* sin(theta_i) on the ball: sine of the angle between ray and axis, times distance over radius (8). */
static double metal_seen(double u, double v, int channel)
{
    static const double sky_radiance[3] = {1, .9, .8};
    double t2 = 0.0865 * 0.0865 * (u * u + v * v), sin_i2 = 64 * t2 / (1 + t2);
    return sky_radiance[channel] *
           truth_ggx_albedo(0.5, metal_eta[channel], metal_k[channel], sqrt(1 - sin_i2), 48);
}

static double gradient_seen(double u, double v, int channel)
{
    static const double albedo[3] = {.8, .7, .6};
    double x = 0.0865 * u, y = -0.0865 * v, length = sqrt(1 + x * x + y * y), d[3], n[3];
    const double eye[3] = {6, 3, 6};
    d[0] = (-2 + 2 * x + y) / (3 * length);
    d[1] = (-1 - 2 * x + 2 * y) / (3 * length);
    d[2] = (-2 - x - 2 * y) / (3 * length);
    double half = -dot3(eye, d), t = half - sqrt(half * half - 81 + 1.125 * 1.125);
    for (int k = 0; k < 3; k++)
        n[k] = (eye[k] + t * d[k]) / 1.125;
    return albedo[channel] * truth_gradient_reflected(&sky, channel, n);
}

TEST(pixels_lie_where_they_should)
{
    enum { CELLS = 40 };
    static const struct {
        const char *name;
        double (*seen)(double u, double v, int channel);
        int cells; /* the metal is slow, and smooth */
    } scenes[] = {{"34_sky_constant", floor_seen_down, CELLS},
                  {"23_ggx_furnace", metal_seen, 6},
                  {"35_sky_gradient", gradient_seen, CELLS}};
    static const int at[][2] = {{0, 0}, {51, 10}, {52, 10}, {10, 50}, {63, 63}, {2, 30}};
    for (size_t s = 0; s < COUNT(scenes); s++) {
        OWN(moments) m;
        render(scenes[s].name, &m);
        int cells = scenes[s].cells;
        for (size_t i = 0; i < COUNT(at); i++) {
            double sum = 0, mean = m.mean[3 * (64 * at[i][1] + at[i][0]) + (int)i % 3];
            for (int k = 0; k < cells * cells; k++)
                sum += scenes[s].seen((at[i][0] + (k % cells + 0.5) / cells) / 32 - 1,
                                      (at[i][1] + (k / cells + 0.5) / cells) / 32 - 1, (int)i % 3);
            assert_true(fabs(mean - sum / (cells * cells)) < (cells == CELLS ? 2e-6 : 1e-4) * mean);
        }
    }
}
