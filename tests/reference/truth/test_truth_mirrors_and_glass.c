/* The closed forms of mirrors and glass against other routes to the same number: rays followed from
 * wall to wall through the box as it stands, a tree of reflected and refracted rays by vectors and
 * complex amplitudes, adaptive quadrature over pixels. All points are compared to 1e-9, and the same
 * tolerance must reject forms with a known mistake. */
#include "reference/truth/truth_mirrors_and_glass.h"
#include "tests/support/optics.h"
#include "tests/support/quadrature.h"
#include "tests/support/suite_files.h"
#include "tests/support/own.h"
#include "tests/support/test.h"
#include "tests/support/vectors.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_integration.h>

static bool same_light(const double a[3], const double b[3])
{
    return same(a[0], b[0]) && same(a[1], b[1]) && same(a[2], b[2]);
}

/* Radiance in the direction (sx, sy, -1) by any of the routes. */
typedef void radiance_at(const void *scene, double sx, double sy, double light[3]);

/* Mean of one channel over a pixel by nested adaptive quadrature, to the absolute error `most`. Rules of
 * 15 points along the lines have been seen to miss slivers of another colour. */
struct pixel {
    radiance_at *f;
    const void *scene;
    double x[2], y, most;
    int channel;
    gsl_integration_workspace *inner;
};

static double at_x(double x, void *p)
{
    const struct pixel *q = p;
    double light[3];
    q->f(q->scene, x, q->y, light);
    return light[q->channel];
}

enum { INTERVALS = 500 };

static double at_y(double y, void *p)
{
    struct pixel *q = p;
    double value, error;
    q->y = y;
    gsl_function g = {at_x, q};
    assert_int_equal(gsl_integration_qag(&g, q->x[0], q->x[1], 0.1 * q->most * (q->x[1] - q->x[0]),
                                         0, INTERVALS, GSL_INTEG_GAUSS61, q->inner, &value, &error),
                     GSL_SUCCESS);
    return value;
}

static double pixel_mean(radiance_at *f, const void *scene, double half, int size, int col, int row,
                         int channel, double most)
{
    double w = 2 * half / size, x = w * col - half, y = half - w * (row + 1), value, error;
    gsl_integration_workspace *outer = gsl_integration_workspace_alloc(INTERVALS);
    struct pixel q = {
        f, scene, {x, x + w}, 0, most, channel, gsl_integration_workspace_alloc(INTERVALS)};
    gsl_function g = {at_y, &q};
    assert_int_equal(gsl_integration_qag(&g, y, y + w, most * w * w, 0, INTERVALS,
                                         GSL_INTEG_GAUSS15, outer, &value, &error),
                     GSL_SUCCESS);
    gsl_integration_workspace_free(q.inner);
    gsl_integration_workspace_free(outer);
    return value / (w * w);
}

/* The shipped scene's image at another depth and size; its own where they are 0. */
static void render(const char *name, int depth, int size, struct moments *out)
{
    struct err e;
    struct suite_scene scene = *suite_shipped_scene(name);
    scene.depth = depth ? depth : scene.depth;
    scene.width = scene.height = size ? size : scene.width;
    assert_string_equal(scene.reference[0].engine, "truth");
    MUST(truth_render(&scene, &scene.reference[0], out, &e));
}

/* 18_mirror_box, its numbers once more. */
enum { BOX_DEPTH = 9 };
static const struct truth_mirror_box box = {
    .x = {-1, 1.5},
    .y = {-0.75, 0.75},
    .z = {-1.5, 1.5},
    .eye = {0.25, 0.25, 0.5},
    .tan_half = 1,
    .split = {0.5, 0},
    .radiance = {{1, .4, .3}, {.3, .9, .5}, {.4, .5, 1}},
    .reflectance = {
        {.9, .8, .6}, {.6, .8, .9}, {.8, .9, .7}, {.7, .8, .95}, {.3, .35, .4}, {.4, .35, .3}}};

/* A ray that goes from wall to wall. */
static void march(const struct truth_mirror_box *b, int depth, double sx, double sy,
                  double light[3])
{
    const double *range[3] = {b->x, b->y, b->z};
    double p[3] = {b->eye[0], b->eye[1], b->eye[2]}, d[3] = {sx, sy, -1}, share[3] = {1, 1, 1};
    light[0] = light[1] = light[2] = 0;
    for (int bounces = 0; bounces <= depth; bounces++) {
        double nearest = HUGE_VAL;
        int axis = 0;
        for (int k = 0; k < 3; k++) {
            double t = d[k] != 0 ? (range[k][d[k] > 0] - p[k]) / d[k] : HUGE_VAL;
            if (t < nearest) {
                nearest = t;
                axis = k;
            }
        }
        int side = d[axis] > 0;
        for (int k = 0; k < 3; k++)
            p[k] += nearest * d[k];
        p[axis] = range[axis][side];
        d[axis] = -d[axis];
        bool at_end = axis == 2 && !side, right = p[0] > b->split[0], low = p[1] < b->split[1];
        if (at_end && !(right && low)) {
            const double *glow = b->radiance[low ? 2 : right ? 1 : 0];
            for (int c = 0; c < 3; c++)
                light[c] = share[c] * glow[c];
            return;
        }
        for (int c = 0; c < 3; c++)
            share[c] *= b->reflectance[2 * axis + side][c];
    }
}

static int count_box_differences(const struct truth_mirror_box *b, int depth)
{
    uint64_t state = 18;
    int different = 0;
    for (int i = 0; i < 20000; i++) {
        double sx = 2 * next_number(&state) - 1, sy = 2 * next_number(&state) - 1;
        double unfolded[3], marched[3];
        truth_mirror_box_radiance(b, depth, sx, sy, unfolded);
        march(&box, BOX_DEPTH, sx, sy, marched);
        different += !same_light(unfolded, marched);
    }
    return different;
}

TEST(mirror_box_unfolds)
{
    assert_int_equal(count_box_differences(&box, BOX_DEPTH), 0);
    assert_true(count_box_differences(&box, BOX_DEPTH - 1) > 20);
    assert_true(count_box_differences(&box, BOX_DEPTH + 1) > 20);
    for (int k = 0; k < 4; k++) { /* each two neighbours exchanged; 4 and 5 only come in pairs */
        struct truth_mirror_box wrong = box;
        memcpy(wrong.reflectance[k], box.reflectance[k + 1], sizeof box.reflectance[k]);
        memcpy(wrong.reflectance[k + 1], box.reflectance[k], sizeof box.reflectance[k]);
        assert_true(count_box_differences(&wrong, BOX_DEPTH) > 20);
    }
    struct truth_mirror_box wrong = box;
    wrong.split[0] = 0; /* as if panels in mirrored cells were not mirrored, at one place */
    assert_true(count_box_differences(&wrong, BOX_DEPTH) > 20);
}

static void marched_box(const void *scene, double sx, double sy, double light[3])
{
    march(scene, BOX_DEPTH, sx, sy, light);
}

TEST(mirror_box_pixels)
{
    /* Of 60 x 60, whose borders the image's edges do not share as they do those of 64 x 64: plain ones, ones
     * with an edge across, corners, fine structure of later arrivals. */
    enum { SIZE = 60 };
    static const int at[][2] = {{3, 8}, {11, 20}, {33, 3}, {11, 33}, {38, 36}, {52, 43}, {33, 56}};
    OWN(moments) m;
    render("18_mirror_box", 0, SIZE, &m);
    int cut = 0;
    for (size_t i = 0; i < COUNT(at); i++)
        for (int c = 0; c < 3; c++) {
            double mean = m.mean[3 * (SIZE * at[i][1] + at[i][0]) + c], light[3];
            double direct = pixel_mean(marched_box, &box, 1, SIZE, at[i][0], at[i][1], c, 1e-9);
            assert_true(fabs(mean - direct) <= 2e-9);
            march(&box, BOX_DEPTH, 2 * (at[i][0] + 0.5) / SIZE - 1, 1 - 2 * (at[i][1] + 0.5) / SIZE,
                  light);
            cut += fabs(light[c] - mean) > 1e-6;
        }
    /* The middle of a pixel is no substitute for its mean. */
    assert_true(cut >= 6);
}

TEST(fresnel_of_amplitudes)
{
    static const double index[] = {1.5, 1 / 1.5, 1.1, 2.4, 1 / 2.4};
    for (size_t i = 0; i < COUNT(index); i++)
        for (int k = 1; k <= 200; k++) {
            double n = index[i], cos_i = k / 200.0, cos_t;
            double f = truth_fresnel(cos_i, n, &cos_t);
            assert_true(same(f, optics_fresnel(cos_i, n)));
            assert_true(fabs(1 - f - optics_transmitted(cos_i, n)) < 1e-12);
            assert_true(cos_t == 0 || same(n * n * (1 - cos_t * cos_t), 1 - cos_i * cos_i) ||
                        k == 200);
        }
}

/* Mistakes of a renderer of glass. */
enum mistake { NONE, SCHLICK, NO_FRESNEL, ONE_MORE, ONE_LESS, INDEX, NO_ECHO, REFLECTION_FREE };

static double reflectance(double cos_i, double n, enum mistake m)
{
    double r0 = (n - 1) / (n + 1) * ((n - 1) / (n + 1));
    if (m == SCHLICK && optics_fresnel(cos_i, n) < 1)
        return r0 + (1 - r0) * pow(1 - cos_i, 5);
    return m == NO_FRESNEL ? 0 : optics_fresnel(cos_i, n);
}

/* One glass body in surroundings. first: where the ray p + t d meets it, from inside or outside, with
 * the outward normal; false if it does not. behind: what the ray sees that meets it no more. */
struct body {
    bool (*hit)(const struct body *b, double p[3], const double d[3], bool inside, double n[3]);
    void (*surroundings)(const struct body *b, const double p[3], const double d[3],
                         double light[3]);
    double n;
    const void *data;
};

/* The tree of rays, each with its share, cut after `left` more bounces. */
static void trace(const struct body *b, const double origin[3], const double d[3], bool inside,
                  int left, double share, enum mistake m, double light[3])
{
    double p[3] = {origin[0], origin[1], origin[2]}, n[3];
    if (!b->hit(b, p, d, inside, n)) {
        double le[3];
        b->surroundings(b, p, d, le);
        for (int c = 0; c < 3; c++)
            light[c] += share * le[c];
        return;
    }
    if (left == 0)
        return;
    double sign = inside ? -1 : 1, cos_i = -sign * dot3(d, n);
    double eta = inside ? 1 / b->n : b->n; /* behind over in front */
    double r = reflectance(cos_i, eta, m), reflected[3], refracted[3];
    for (int k = 0; k < 3; k++)
        reflected[k] = d[k] + 2 * cos_i * sign * n[k];
    if (r > 0 && !(m == NO_ECHO && inside) && !(m == REFLECTION_FREE && !inside))
        trace(b, p, reflected, inside, left - 1, share * r, m, light);
    /* Snell's law for the part along the surface; the rest makes the length 1. */
    double along[3];
    for (int k = 0; k < 3; k++)
        along[k] = (d[k] + cos_i * sign * n[k]) / eta;
    double rest = 1 - dot3(along, along);
    if (rest <= 0)
        return;
    for (int k = 0; k < 3; k++)
        refracted[k] = along[k] - sqrt(rest) * sign * n[k];
    trace(b, p, refracted, !inside, left - 1, share * (1 - r), m, light);
}

static void look_at_body(const struct body *b, const double eye[3], const double d[3], int depth,
                         enum mistake m, double light[3])
{
    struct body other = *b;
    light[0] = light[1] = light[2] = 0;
    other.n *= m == INDEX ? 1.001 : 1;
    trace(&other, eye, d, false, depth + (m == ONE_MORE) - (m == ONE_LESS), 1, m, light);
}

/* 19_glass_slab. */
enum { SLAB_DEPTH = 3 };
static const double slab_front[3] = {.9, .5, .3}, slab_behind[3] = {.3, .6, 1};
static const double slab_eye[3] = {0, 0, 1};

static bool slab_hit(const struct body *b, double p[3], const double d[3], bool inside, double n[3])
{
    (void)b;
    /* Outside and on its way to it, or inside: the face ahead. */
    if (!inside && p[2] * d[2] >= 0)
        return false;
    double face = inside ? (d[2] > 0 ? 0.1 : -0.1) : (p[2] > 0 ? 0.1 : -0.1);
    double t = (face - p[2]) / d[2];
    for (int k = 0; k < 3; k++)
        p[k] += t * d[k];
    n[0] = n[1] = 0;
    n[2] = face > 0 ? 1 : -1;
    return true;
}

static void slab_surroundings(const struct body *b, const double p[3], const double d[3],
                              double light[3])
{
    (void)b;
    (void)p;
    for (int c = 0; c < 3; c++)
        light[c] = d[2] > 0 ? slab_front[c] : slab_behind[c];
}

static const struct body slab = {slab_hit, slab_surroundings, 1.5, NULL};

static void slab_formula(double cos_i, double n, int depth, double light[3])
{
    double front, behind;
    truth_slab_shares(cos_i, n, depth, &front, &behind);
    for (int c = 0; c < 3; c++)
        light[c] = front * slab_front[c] + behind * slab_behind[c];
}

TEST(slab_is_a_tree_of_rays)
{
    static const enum mistake mistakes[] = {SCHLICK, NO_FRESNEL,      INDEX,
                                            NO_ECHO, REFLECTION_FREE, ONE_MORE};
    for (int depth = 0; depth <= 8; depth++)
        for (int degrees = 0; degrees < 90; degrees += 5) {
            double a = degrees * M_PI / 180, formula[3], tree[3];
            double d[3] = {sin(a) * 0.6, sin(a) * 0.8, -cos(a)};
            slab_formula(cos(a), slab.n, depth, formula);
            look_at_body(&slab, slab_eye, d, depth, NONE, tree);
            assert_true(same_light(formula, tree));
            for (size_t k = 0; depth == SLAB_DEPTH && k < COUNT(mistakes); k++) {
                look_at_body(&slab, slab_eye, d, depth, mistakes[k], tree);
                /* Schlick's formula is exact at normal incidence. */
                assert_true(!same_light(formula, tree) || (mistakes[k] == SCHLICK && degrees == 0));
            }
        }
}

/* The whole series: (1 - F)^2 / (1 - F^2) goes through and 2 F/(1 + F) comes back, which add up to 1. */
TEST(slab_at_any_depth_loses_nothing)
{
    for (int k = 1; k <= 20; k++) {
        double front, behind, f = truth_fresnel(k / 20.0, 1.5, NULL);
        truth_slab_shares(k / 20.0, 1.5, 400, &front, &behind);
        assert_true(same(front, 2 * f / (1 + f)));
        assert_true(same(behind, (1 - f) / (1 + f)));
    }
}

static void slab_scene(const void *scene, double sx, double sy, double light[3])
{
    double d[3] = {0.6 + 0.8 * sx, sy, -0.8 + 0.6 * sx};
    (void)scene;
    unit3(d);
    look_at_body(&slab, slab_eye, d, SLAB_DEPTH, NONE, light);
}

TEST(slab_pixels)
{
    static const int at[][2] = {{0, 0}, {63, 63}, {5, 31}, {40, 12}, {63, 32}};
    OWN(moments) m;
    render("19_glass_slab", 0, 0, &m);
    for (size_t i = 0; i < COUNT(at); i++)
        for (int c = 0; c < 3; c++)
            assert_true(same(m.mean[3 * (64 * at[i][1] + at[i][0]) + c],
                             pixel_mean(slab_scene, NULL, 0.9, 64, at[i][0], at[i][1], c, 1e-11)));
}

/* 22_glass_sphere. */
static const struct truth_glass_sphere ball = {
    .n = 1.5,
    .centre = {.3, -.2, -1},
    .radius = 1.2,
    .room = {{-2, 2.5}, {-1.8, 2.2}, {-7, 4.5}},
    .walls =
        {{1, .75, .65}, {.65, 1, .75}, {.75, .75, .65}, {.9, 1, 1}, {.65, .75, 1}, {1, .85, .65}},
    .depth = 3};
static const double ball_eye[3] = {0, 0, 3};

static bool ball_hit(const struct body *b, double p[3], const double d[3], bool inside, double n[3])
{
    const struct truth_glass_sphere *s = b->data;
    double o[3];
    for (int k = 0; k < 3; k++)
        o[k] = p[k] - s->centre[k];
    double half = dot3(o, d), c = dot3(o, o) - s->radius * s->radius, root = half * half - c;
    /* On the way out it is the far end of the chord, from outside the near one, unless just left. */
    if (root <= 0 || (!inside && half >= 0))
        return false;
    double t = inside ? -half + sqrt(root) : -half - sqrt(root);
    for (int k = 0; k < 3; k++)
        p[k] += t * d[k];
    for (int k = 0; k < 3; k++)
        n[k] = p[k] - s->centre[k];
    unit3(n);
    return true;
}

/* Each wall's plane in turn: the one that the ray reaches inside the others' bounds. */
static void ball_surroundings(const struct body *b, const double p[3], const double d[3],
                              double light[3])
{
    const struct truth_glass_sphere *s = b->data;
    light[0] = light[1] = light[2] = NAN;
    for (int k = 0; k < 3; k++)
        for (int side = 0; side < 2; side++) {
            double t = (s->room[k][side] - p[k]) / d[k];
            int u = (k + 1) % 3, v = (k + 2) % 3;
            double x = p[u] + t * d[u], y = p[v] + t * d[v];
            if (t > 0 && x >= s->room[u][0] && x <= s->room[u][1] && y >= s->room[v][0] &&
                y <= s->room[v][1])
                memcpy(light, s->walls[2 * k + side], sizeof s->walls[0]);
        }
}

static const struct body ball_body = {ball_hit, ball_surroundings, 1.5, &ball};

static int count_ball_differences(int depth, enum mistake m)
{
    uint64_t state = 22;
    int different = 0;
    for (int i = 0; i < 20000; i++) {
        double d[3] = {0.8 * next_number(&state) - 0.4, 0.8 * next_number(&state) - 0.4, -1};
        double formula[3], tree[3];
        struct truth_glass_sphere s = ball;
        s.depth = depth;
        unit3(d);
        truth_glass_sphere_radiance(&s, ball_eye, d, formula);
        look_at_body(&ball_body, ball_eye, d, depth, m, tree);
        different += !same_light(formula, tree);
    }
    return different;
}

TEST(ball_is_a_tree_of_rays)
{
    for (int depth = 0; depth <= 8; depth++)
        assert_int_equal(count_ball_differences(depth, NONE), 0);
    /* More than half of the image is the ball. */
    for (enum mistake m = SCHLICK; m <= REFLECTION_FREE; m++)
        assert_true(count_ball_differences(ball.depth, m) > 8000);
}

static void ball_scene(const void *scene, double sx, double sy, double light[3])
{
    double d[3] = {sx, sy, -1};
    (void)scene;
    unit3(d);
    look_at_body(&ball_body, ball_eye, d, ball.depth, NONE, light);
}

TEST(ball_pixels)
{
    /* Of an image of 16 x 16: a wall, the middle of the ball, its rim, edges of walls through it. */
    static const int at[][2] = {{1, 8}, {9, 9}, {3, 9}, {4, 13}, {9, 14}, {13, 6}};
    OWN(moments) m;
    render("22_glass_sphere", 0, 16, &m);
    for (size_t i = 0; i < COUNT(at); i++) {
        double mean = m.mean[3 * (16 * at[i][1] + at[i][0]) + (int)i % 3];
        double direct = pixel_mean(ball_scene, NULL, 0.4, 16, at[i][0], at[i][1], (int)i % 3, 1e-7);
        assert_true(fabs(mean - direct) <= 1e-6 * direct);
    }
}

/* The largest difference, relative to the larger of the two, of a square, a sixteenth of the image's side (4 pixels of 64), in
 * the mean of its channels, with its sign. */
static double worst_square(const struct moments *a, const struct moments *b)
{
    double worst = 0;
    int side = a->width / 16;
    for (int k = 0; k < 256; k++) {
        double sum_a = 0, sum_b = 0;
        for (int row = k / 16 * side; row < (k / 16 + 1) * side; row++)
            for (int i = 3 * (k % 16) * side; i < 3 * (k % 16 + 1) * side; i++) {
                sum_a += a->mean[3 * row * a->width + i];
                sum_b += b->mean[3 * row * a->width + i];
            }
        double larger = fmax(sum_a, sum_b);
        if (larger > 0 && fabs(sum_a - sum_b) > fabs(worst) * larger)
            worst = (sum_a - sum_b) / larger;
    }
    return worst;
}

/* One bounce more or less moves a square by more than twice its margin of 1 %. */
TEST(depth_shows)
{
    static const char *const names[] = {"18_mirror_box", "19_glass_slab", "22_glass_sphere"};
    static const int depth[] = {BOX_DEPTH, SLAB_DEPTH, 3};
    for (size_t i = 0; i < COUNT(names); i++) {
        struct moments m[3];
        for (int k = 0; k < 3; k++)
            render(names[i], depth[i] + k - 1, 32, &m[k]);
        double less = worst_square(&m[0], &m[1]), more = worst_square(&m[2], &m[1]);
        print_message("%s, worst square: one bounce less %+.1f %%, one more %+.1f %%\n", names[i],
                      100 * less, 100 * more);
        assert_true(less < -0.02 && more > 0.02);
        for (int k = 0; k < 3; k++)
            moments_free(&m[k]);
    }
}
