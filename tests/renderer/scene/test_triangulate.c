/* Polygons into triangles, against the shoelace formula (area) and the crossing-number rule
 * (coverage), which share nothing with ear clipping. */
#include "renderer/scene/triangulate.h"
#include "tests/support/test.h"

enum { MOST = 400 };

struct flat {
    double x[MOST], y[MOST];
    uint32_t n;
};

/* A 32-bit linear congruential generator; the seeds are fixed, so every run sees the same. */
static double random_unit(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / 16777216.0;
}

static double shoelace(const struct flat *f)
{
    double a = 0;
    for (uint32_t i = 0; i < f->n; i++) {
        uint32_t j = (i + 1) % f->n;
        a += f->x[i] * f->y[j] - f->x[j] * f->y[i];
    }
    return a / 2;
}

static bool is_inside(const struct flat *f, double x, double y)
{
    bool in = false;
    for (uint32_t i = 0, j = f->n - 1; i < f->n; j = i++)
        if ((f->y[i] > y) != (f->y[j] > y) &&
            x < (f->x[j] - f->x[i]) * (y - f->y[i]) / (f->y[j] - f->y[i]) + f->x[i])
            in = !in;
    return in;
}

static double triangle_area(const struct flat *f, const uint32_t *t)
{
    double ax = f->x[t[1]] - f->x[t[0]], ay = f->y[t[1]] - f->y[t[0]];
    double bx = f->x[t[2]] - f->x[t[0]], by = f->y[t[2]] - f->y[t[0]];
    return (ax * by - ay * bx) / 2;
}

static bool in_triangle(const struct flat *f, const uint32_t *t, double x, double y)
{
    struct flat g = {.n = 3};
    for (int k = 0; k < 3; k++) {
        g.x[k] = f->x[t[k]];
        g.y[k] = f->y[t[k]];
    }
    return is_inside(&g, x, y);
}

/* Places the polygon on the plane through (3,-2,7) spanned by two orthonormal vectors. */
static enum triangulate_result run(const struct flat *f, uint32_t *index)
{
    dvec3 s = d3(2.0 / 3, -1.0 / 3, 2.0 / 3), t = d3(2.0 / 3, 2.0 / 3, -1.0 / 3), p[MOST];
    for (uint32_t i = 0; i < f->n; i++)
        p[i] = d3(3 + f->x[i] * s.x + f->y[i] * t.x, -2 + f->x[i] * s.y + f->y[i] * t.y,
                  7 + f->x[i] * s.z + f->y[i] * t.z);
    return triangulate(p, f->n, index);
}

/* Same winding, same area, and every one of many random points inside is in exactly one triangle,
 * every one outside in none. Needs bounds of the polygon inside [-r,r]^2. */
static void check(const struct flat *f, double r)
{
    uint32_t index[3 * MOST];
    assert_int_equal(run(f, index), TRIANGULATE_OK);
    double area = shoelace(f), sum = 0;
    for (uint32_t t = 0; t + 2 < f->n; t++) {
        double a = triangle_area(f, index + 3 * t);
        assert_true(area > 0 ? a > -1e-12 * area : a < -1e-12 * area);
        sum += a;
    }
    assert_true(fabs(sum - area) < 1e-10 * fabs(area));
    uint32_t state = 1;
    int inside = 0;
    for (int i = 0; i < 500; i++) {
        double x = r * (2 * random_unit(&state) - 1), y = r * (2 * random_unit(&state) - 1);
        int hits = 0;
        for (uint32_t t = 0; t + 2 < f->n; t++)
            hits += in_triangle(f, index + 3 * t, x, y);
        assert_int_equal(hits, is_inside(f, x, y) ? 1 : 0);
        inside += hits;
    }
    assert_true(inside > 0);
}

static struct flat reversed(const struct flat *f)
{
    struct flat g = {.n = f->n};
    for (uint32_t i = 0; i < f->n; i++) {
        g.x[i] = f->x[f->n - 1 - i];
        g.y[i] = f->y[f->n - 1 - i];
    }
    return g;
}

TEST(concave_shapes)
{
    const struct flat shapes[] = {
        {{0, 2, 2, 1, 1, 0}, {0, 0, 1, 1, 2, 2}, 6},                          /* L */
        {{0, 3, 1, 1}, {0, 0, 0.4, 3}, 4},                                    /* dart */
        {{0, 4, 4, 3, 3, 2, 2, 1, 1, 0}, {0, 0, 3, 3, 1, 1, 3, 3, 1, 1}, 10}, /* comb */
        {{0, 1, 2, 2, 0}, {0, 0, 0, 2, 2}, 5},       /* vertex on an edge */
        {{0, 0, 2, 2, 2, 0}, {0, 0, 0, 0, 2, 2}, 6}, /* doubled vertices */
        /* A square with a square hole, joined by the edge (0,0)-(1,1). */
        {{0, 4, 4, 0, 0, 1, 1, 3, 3, 1}, {0, 0, 4, 4, 0, 1, 3, 3, 1, 1}, 10},
    };
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        check(&shapes[i], 4.5);
        struct flat clockwise = reversed(&shapes[i]);
        check(&clockwise, 4.5);
    }
}

/* Radii drawn freely at ordered angles make simple polygons that are concave at about every other
 * vertex. */
TEST(random_star_shapes)
{
    uint32_t seed = 7;
    for (uint32_t n = 4; n <= 200; n += 7) {
        struct flat f = {.n = n};
        for (uint32_t i = 0; i < n; i++) {
            double angle = 6.283185307179586 * i / n, r = 0.2 + random_unit(&seed);
            f.x[i] = r * cos(angle);
            f.y[i] = r * sin(angle);
        }
        check(&f, 1.3);
    }
}

/* Two arms of a spiral of five turns: every ear must look past the other arm. */
TEST(spiral)
{
    struct flat f = {.n = MOST};
    for (uint32_t i = 0; i < MOST / 2; i++) {
        double angle = 31.4 * i / (MOST / 2), r = 0.2 + angle / 31.4;
        f.x[i] = r * cos(angle);
        f.y[i] = r * sin(angle);
        f.x[MOST - 1 - i] = (r + 0.05) * cos(angle);
        f.y[MOST - 1 - i] = (r + 0.05) * sin(angle);
    }
    check(&f, 1.3);
}

TEST(crossed_polygons_are_fans)
{
    uint32_t index[3 * MOST];
    const struct flat bow = {{0, 1, 1, 0}, {0, 1, 0, 1}, 4};    /* no area at all */
    const struct flat uneven = {{0, 3, 3, 0}, {0, 1, 0, 2}, 4}; /* some area */
    struct flat pentagram = {.n = 5};                           /* turns left at every corner */
    for (int i = 0; i < 5; i++) {
        pentagram.x[i] = cos(6.283185307179586 * 2 * i / 5);
        pentagram.y[i] = sin(6.283185307179586 * 2 * i / 5);
    }
    assert_int_equal(run(&bow, index), TRIANGULATE_CROSSED);
    assert_int_equal(run(&uneven, index), TRIANGULATE_CROSSED);
    for (uint32_t k = 0; k < 6; k++)
        assert_int_equal(index[k], ((const uint32_t[]){0, 1, 2, 0, 2, 3})[k]);
    assert_int_equal(run(&pentagram, index), TRIANGULATE_CROSSED);
    /* A band bent by 400 degrees, so that its ends overlap: ears can be clipped, but they would cover
     * the overlap twice. */
    struct flat band = {.n = 10};
    for (int i = 0; i < 5; i++) {
        double angle = 400.0 / 360 * 6.283185307179586 * i / 4;
        band.x[i] = cos(angle);
        band.y[i] = sin(angle);
        band.x[9 - i] = 0.6 * cos(angle);
        band.y[9 - i] = 0.6 * sin(angle);
    }
    assert_int_equal(run(&band, index), TRIANGULATE_CROSSED);
}

TEST(line_is_flat)
{
    uint32_t index[3 * MOST];
    const struct flat line = {{0, 1, 2, 3}, {0, 1, 2, 3}, 4};
    const struct flat point = {{1, 1, 1, 1}, {2, 2, 2, 2}, 4};
    assert_int_equal(run(&line, index), TRIANGULATE_FLAT);
    assert_int_equal(run(&point, index), TRIANGULATE_FLAT);
}
