/* FLIP against what is known without it: the numbers that its authors publish, the chromaticities of BT.709, published
 * L*a*b* of its primaries, the Fourier transform of the contrast sensitivity, closed forms on flat images, and a
 * second implementation in double precision with whole two-dimensional filters. The images whose means its authors
 * publish are not here. */
#include "tools/images/flip.h"
#include "tools/images/flip_colour.h"
#include "tests/support/test.h"

static void near(double got, double wanted, double tolerance, const char *what)
{
    if (!(fabs(got - wanted) <= tolerance))
        fail_msg("%s: %.9g instead of %.9g", what, got, wanted);
}

static uint32_t random_state = 1;
static double uniform(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return ((random_state >> 8) + 0.5) / 16777216.0;
}

/* XYZ = M RGB from the chromaticities x, y of red, green, blue and white [BT.709-6, table 1]: columns are the primaries,
 * scaled so that they add up to white (Cramer's rule). */
static void matrix_of_chromaticities(double m[3][3], double white[3])
{
    static const double xy[4][2] = {{.64, .33}, {.30, .60}, {.15, .06}, {.3127, .3290}};
    double p[4][3];
    for (int i = 0; i < 4; i++) {
        p[i][0] = xy[i][0] / xy[i][1];
        p[i][1] = 1;
        p[i][2] = (1 - xy[i][0] - xy[i][1]) / xy[i][1];
    }
    double det[4];
    for (int k = 0; k < 4; k++) { /* 3: none replaced */
        const double *c[3] = {k == 0 ? p[3] : p[0], k == 1 ? p[3] : p[1], k == 2 ? p[3] : p[2]};
        det[k] = c[0][0] * (c[1][1] * c[2][2] - c[2][1] * c[1][2]) -
                 c[1][0] * (c[0][1] * c[2][2] - c[2][1] * c[0][2]) +
                 c[2][0] * (c[0][1] * c[1][2] - c[1][1] * c[0][2]);
    }
    for (int i = 0; i < 3; i++) {
        white[i] = p[3][i];
        for (int j = 0; j < 3; j++)
            m[i][j] = p[j][i] * det[j] / det[3];
    }
}

TEST(test_matrix)
{
    struct flip_colours c = flip_colours();
    double m[3][3], white[3];
    matrix_of_chromaticities(m, white);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            /* The standard rounds to four decimals; the papers' white differs from x, y in the fifth. */
            near((double)c.to[i][j], m[i][j] / white[i], 2e-4, "matrix");
            double product = 0;
            for (int k = 0; k < 3; k++)
                product += (double)c.to[i][k] * (double)c.from[k][j];
            near(product, i == j, 1e-6, "inverse");
        }
}

/* The authors' own constants, to the nine digits of their published program (NVlabs/flip, version 1.4, FLIP.h): the white
 * of D65, one over it, and RGB of XYZ. Ours are made from the matrix of sRGB. */
TEST(test_published)
{
    static const double white[3] = {0.950428545, 1.000000000, 1.088900371};
    static const double one_over_white[3] = {1.052156925, 1.000000000, 0.918357670};
    static const double from_xyz[3][3] = {{3.241003275, -1.537398934, -0.498615861},
                                          {-0.969224334, 1.875930071, 0.041554224},
                                          {0.055639423, -0.204011202, 1.057148933}};
    /* The largest entries of the sRGB matrix's rows, as the authors write them. */
    static const double to_xyz[3] = {10135552.0 / 24577794, 8788810.0 / 12288897,
                                     70074185.0 / 73733382};
    struct flip_colours c = flip_colours();
    for (int i = 0; i < 3; i++) {
        near((double)c.to[i][i], to_xyz[i] * one_over_white[i], 1e-7, "XYZ of RGB");
        for (int j = 0; j < 3; j++)
            near((double)c.from[i][j], from_xyz[i][j] * white[j], 4e-7, "RGB of XYZ");
    }
    /* For 67 pixels to a degree their filters reach 10 pixels; the exposure of their HDR example is 14 steps from
     * -12.5423 to 0.9427, which test_exposures() asks. */
    assert_int_equal(flip_csf_radius(67), 10);
}

static const double primaries[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
/* L*a*b* of sRGB's red, green and blue under D65, as tables of it print them. */
static const double lab_of_primaries[3][3] = {
    {53.24, 80.09, 67.20}, {87.73, -86.18, 83.18}, {32.30, 79.19, -107.86}};

static void lab_of(const struct flip_colours *c, const double rgb[3], float lab[3])
{
    flip_lab(c, (const float[3]){(float)rgb[0], (float)rgb[1], (float)rgb[2]}, lab);
}

TEST(test_lab)
{
    struct flip_colours c = flip_colours();
    float lab[3];
    for (int i = 0; i < 3; i++) {
        const double *wanted = lab_of_primaries[i];
        lab_of(&c, primaries[i], lab);
        near((double)lab[0], wanted[0], 0.02, "L*");
        near((double)lab[1], 0.01 * wanted[0] * wanted[1], 0.05, "Hunt-adjusted a*");
        near((double)lab[2], 0.01 * wanted[0] * wanted[2], 0.05, "Hunt-adjusted b*");
    }
    /* Grey: no chroma; 18.42 % reflect L* 50, black 0, and below (6/29)^3 L* is a line of slope 903.3. */
    static const double grey[][2] = {{0, 0}, {1, 100}, {0.18418651851, 50}, {0.001, 0.9032963}};
    for (size_t i = 0; i < sizeof grey / sizeof *grey; i++) {
        lab_of(&c, (const double[3]){grey[i][0], grey[i][0], grey[i][0]}, lab);
        near((double)lab[0], grey[i][1], 1e-4, "L* of grey");
        near(hypot((double)lab[1], (double)lab[2]), 0, 1e-3, "chroma of grey");
    }
}

/* Green and blue are the furthest apart, by the published L*a*b*; no two colours of a grid are further. */
TEST(test_largest)
{
    enum { STEPS = 8, COLOURS = (STEPS + 1) * (STEPS + 1) * (STEPS + 1) };
    struct flip_colours c = flip_colours();
    const double *g = lab_of_primaries[1], *b = lab_of_primaries[2];
    double hyab =
        g[0] - b[0] + hypot(0.01 * (g[0] * g[1] - b[0] * b[1]), 0.01 * (g[0] * g[2] - b[0] * b[2]));
    near((double)c.largest, pow(hyab, 0.7), 0.01, "largest distance");
    static float lab[COLOURS][3];
    for (int i = 0; i < COLOURS; i++)
        lab_of(&c,
               (const double[3]){i % (STEPS + 1) / (double)STEPS,
                                 i / (STEPS + 1) % (STEPS + 1) / (double)STEPS,
                                 i / (STEPS + 1) / (STEPS + 1) / (double)STEPS},
               lab[i]);
    double most = 0;
    for (int i = 0; i < COLOURS; i++)
        for (int j = 0; j < i; j++)
            most = fmax(
                most, fabs((double)(lab[i][0] - lab[j][0])) +
                          hypot((double)(lab[i][1] - lab[j][1]), (double)(lab[i][2] - lab[j][2])));
    near(pow(most, 0.7), (double)c.largest, 1e-4, "largest of the grid");
    float green[3], blue[3], black[3] = {0, 0, 0};
    lab_of(&c, primaries[1], green);
    lab_of(&c, primaries[2], blue);
    near((double)flip_colour_error(&c, green, blue), 1, 1e-6, "green to blue");
    near((double)flip_colour_error(&c, green, green), 0, 0, "green to green");
    /* 0.4 of the largest is 0.95: a grey of HyAB (0.4 largest)^(1/0.7) from black. */
    float knee[3] = {powf(0.4f * c.largest, 1 / 0.7f), 0, 0};
    near((double)flip_colour_error(&c, knee, black), 0.95, 1e-5, "knee");
    knee[0] = powf(0.2f * c.largest, 1 / 0.7f);
    near((double)flip_colour_error(&c, knee, black), 0.475, 1e-5, "half the knee");
}

/* The filters are made of inverse Fourier transforms, so their transforms are the sensitivities: exp(-b f^2), and for
 * blue-yellow a1 sqrt(b1) exp(-b1 f^2) + a2 sqrt(b2) exp(-b2 f^2) over its value at 0, as both axes are weighted with the
 * amplitude of one. Three standard deviations of the widest hold all but exp(-4.5) = 1.1 % of it;
 * of the others pixels add the alias at 67 - f, exp(-.0047 47^2) = 3e-5 at most. */
TEST(test_csf)
{
    double ppd = FLIP_PPD;
    near(ppd, 67.0206, 1e-4, "pixels per degree"); /* as the papers print it */
    int r = flip_csf_radius(ppd);
    assert_int_equal(r, 10); /* 3 sqrt(.04/2)/pi 67.02 = 9.05 */
    for (int channel = 0; channel < 3; channel++) {
        double sum = 0;
        for (int y = -r; y <= r; y++)
            for (int x = -r; x <= r; x++)
                sum += flip_csf((enum flip_channel)channel, ppd, x, y);
        near(sum, 1, 1e-12, "sum of a filter");
        for (double f = 0; f <= 20; f += 2.5) { /* cycles per degree, along x */
            double got = 0, wanted;
            for (int y = -r; y <= r; y++)
                for (int x = -r; x <= r; x++)
                    got += flip_csf((enum flip_channel)channel, ppd, x, y) *
                           cos(2 * M_PI * f * x / ppd);
            if (channel == FLIP_BLUE_YELLOW) {
                double u = 34.1 * sqrt(.04), v = 13.5 * sqrt(.025);
                wanted = (u * exp(-.04 * f * f) + v * exp(-.025 * f * f)) / (u + v);
            } else {
                wanted = exp(-(channel == FLIP_ACHROMATIC ? .0047 : .0053) * f * f);
            }
            near(got, wanted, channel == FLIP_BLUE_YELLOW ? 0.012 : 5e-5, "sensitivity");
        }
    }
}

static void fill(double *rgb, size_t pixels, double r, double g, double b)
{
    for (size_t i = 0; i < pixels; i++) {
        rgb[3 * i] = r;
        rgb[3 * i + 1] = g;
        rgb[3 * i + 2] = b;
    }
}

enum { SIDE = 24, OTHER = 19, PIXELS = SIDE * OTHER };

/* Flat images have no features, and filters leave them alone: the error is that of two colours. */
TEST(test_flat)
{
    static double a[3 * PIXELS], b[3 * PIXELS];
    static float map[PIXELS];
    struct err e = {""};
    const double *g = lab_of_primaries[1], *u = lab_of_primaries[2];
    double largest = pow(
        g[0] - u[0] + hypot(0.01 * (g[0] * g[1] - u[0] * u[1]), 0.01 * (g[0] * g[2] - u[0] * u[2])),
        0.7);
    /* White is 100 from black, beyond the knee; grey of L* 50 is 50 from both, before it. */
    double far = 0.95 + 0.05 * (pow(100, 0.7) - 0.4 * largest) / (0.6 * largest);
    double half = 0.95 * pow(50, 0.7) / (0.4 * largest);
    const struct {
        double a, b, wanted;
    } grey[] = {
        {0, 1, far}, {1, 0, far}, {0.18418651851, 0, half}, {0.18418651851, 1, half}, {0.5, 0.5, 0},
        {-1, 0, 0},  {3, 1, 0}};
    for (size_t k = 0; k < sizeof grey / sizeof *grey; k++) {
        fill(a, PIXELS, grey[k].a, grey[k].a, grey[k].a);
        fill(b, PIXELS, grey[k].b, grey[k].b, grey[k].b);
        assert_true(flip_ldr(a, b, SIDE, OTHER, FLIP_PPD, map, &e));
        for (size_t i = 0; i < PIXELS; i++)
            near((double)map[i], grey[k].wanted, 2e-4, "flat");
    }
    fill(a, PIXELS, 0, 1, 0);
    fill(b, PIXELS, 0, 0, 1);
    assert_true(flip_ldr(a, b, SIDE, OTHER, FLIP_PPD, map, &e));
    near(flip_mean(map, PIXELS), 1, 1e-5, "green and blue");
}

/* The papers' formulas once more. */
enum { PPD, A2_BY, B_RG, Q, W, Q_FEATURES, NUM_CONSTANTS };
struct oracle {
    double at[NUM_CONSTANTS];
};
static const struct oracle papers = {{FLIP_PPD, 13.5, .0053, 0.7, 0.082, 0.5}};

struct colour {
    double v[3];
};

static struct colour xyz(const double rgb[3])
{
    double m[3][3], white[3];
    struct colour c = {{0}};
    matrix_of_chromaticities(m, white);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            c.v[i] += m[i][j] * rgb[j] / white[i];
    return c;
}

/* By Gauss and Jordan. */
static struct colour rgb_of_xyz(const double in[3])
{
    double m[3][4], matrix[3][3], white[3];
    matrix_of_chromaticities(matrix, white);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            m[i][j] = matrix[i][j] / white[i];
        m[i][3] = in[i];
    }
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            for (int j = 3; k != i && j >= i; j--)
                m[k][j] -= m[k][i] / m[i][i] * m[i][j];
    struct colour c;
    for (int i = 0; i < 3; i++)
        c.v[i] = fmin(fmax(m[i][3] / m[i][i], 0), 1);
    return c;
}

static struct colour hunt(const double rgb[3])
{
    struct colour t = xyz(rgb);
    double f[3];
    for (int i = 0; i < 3; i++)
        f[i] = t.v[i] > 216.0 / 24389 ? pow(t.v[i], 1.0 / 3) : (24389.0 / 27 * t.v[i] + 16) / 116;
    double l = 116 * f[1] - 16;
    return (struct colour){{l, l / 100 * 500 * (f[0] - f[1]), l / 100 * 200 * (f[1] - f[2])}};
}

static double hyab_q(struct colour a, struct colour b, double q)
{
    return pow(fabs(a.v[0] - b.v[0]) + sqrt(pow(a.v[1] - b.v[1], 2) + pow(a.v[2] - b.v[2], 2)), q);
}

static size_t clamped(int x, int y)
{
    x = x < 0 ? 0 : x >= SIDE ? SIDE - 1 : x;
    y = y < 0 ? 0 : y >= OTHER ? OTHER - 1 : y;
    return (size_t)(y * SIDE + x);
}

enum { EDGE_X = 3, EDGE_Y, POINT_X, POINT_Y, NUM_FILTERS };

/* The filter's weight at offset (x, y) in pixels, not normalised. */
static double weight(const struct oracle *o, int filter, int x, int y)
{
    double d2 = (x * x + y * y) / (o->at[PPD] * o->at[PPD]), s = o->at[W] / 2 * o->at[PPD];
    double g = exp(-(x * x + y * y) / (2 * s * s));
    switch (filter) {
    case FLIP_ACHROMATIC: return sqrt(M_PI / .0047) * exp(-M_PI * M_PI * d2 / .0047);
    case FLIP_RED_GREEN: return sqrt(M_PI / o->at[B_RG]) * exp(-M_PI * M_PI * d2 / o->at[B_RG]);
    case FLIP_BLUE_YELLOW:
        return 34.1 * sqrt(M_PI / .04) * exp(-M_PI * M_PI * d2 / .04) +
               o->at[A2_BY] * sqrt(M_PI / .025) * exp(-M_PI * M_PI * d2 / .025);
    case EDGE_X: return -x * g;
    case EDGE_Y: return -y * g;
    case POINT_X: return (x * x / (s * s) - 1) * g;
    default: return (y * y / (s * s) - 1) * g;
    }
}

/* What filter sees of a plane around a pixel; positive and negative weights sum to 1 and -1. */
static double filtered(const struct oracle *o, int filter, const double *plane, int px, int py)
{
    int r = filter < EDGE_X ? (int)ceil(3 * sqrt(.04 / (2 * M_PI * M_PI)) * o->at[PPD])
                            : (int)ceil(3 * o->at[W] / 2 * o->at[PPD]);
    double sum[2] = {0}, weights[2] = {0};
    for (int y = -r; y <= r; y++)
        for (int x = -r; x <= r; x++) {
            double v = weight(o, filter, x, y);
            weights[v < 0] += fabs(v);
            sum[v < 0] += v * plane[clamped(px + x, py + y)];
        }
    return sum[0] / weights[0] + (weights[1] > 0 ? sum[1] / weights[1] : 0);
}

static void oracle_ldr(const struct oracle *o, const double *a, const double *b, double *map)
{
    static double plane[2][3][PIXELS];
    const double *image[2] = {a, b};
    for (int s = 0; s < 2; s++)
        for (size_t i = 0; i < PIXELS; i++) {
            struct colour c = xyz(&image[s][3 * i]);
            plane[s][0][i] = 116 * c.v[1] - 16;
            plane[s][1][i] = 500 * (c.v[0] - c.v[1]);
            plane[s][2][i] = 200 * (c.v[1] - c.v[2]);
        }
    double largest = hyab_q(hunt(primaries[1]), hunt(primaries[2]), o->at[Q]);
    for (int y = 0; y < OTHER; y++)
        for (int x = 0; x < SIDE; x++) {
            struct colour seen[2];
            double edge[2], point[2];
            for (int s = 0; s < 2; s++) {
                double opponent[3], gradient[4];
                for (int c = 0; c < 3; c++)
                    opponent[c] = filtered(o, c, plane[s][c], x, y);
                double luma = (opponent[0] + 16) / 116;
                double t[3] = {luma + opponent[1] / 500, luma, luma - opponent[2] / 200};
                struct colour rgb = rgb_of_xyz(t);
                seen[s] = hunt(rgb.v);
                for (int k = 0; k < 4; k++)
                    gradient[k] = filtered(o, EDGE_X + k, plane[s][0], x, y) / 116;
                edge[s] = sqrt(gradient[0] * gradient[0] + gradient[1] * gradient[1]);
                point[s] = sqrt(gradient[2] * gradient[2] + gradient[3] * gradient[3]);
            }
            double d = hyab_q(seen[0], seen[1], o->at[Q]), knee = 0.4 * largest;
            double colour =
                d < knee ? 0.95 * d / knee : 0.95 + 0.05 * (d - knee) / (largest - knee);
            double feature = fmax(fabs(edge[0] - edge[1]), fabs(point[0] - point[1]));
            map[y * SIDE + x] = pow(colour, 1 - pow(feature / sqrt(2), o->at[Q_FEATURES]));
        }
}

/* Blocks of colours with noise, a bright line and a bright point; the other one is shifted and noisier. */
static void draw(double *rgb, int shift, double noise, double scale)
{
    for (int y = 0; y < OTHER; y++)
        for (int x = 0; x < SIDE; x++)
            for (int c = 0; c < 3; c++) {
                double v = (((x + shift) / 6 + y / 5) * 7 + 3 * c) % 10 / 10.0;
                v = x + shift == 13 || (x == 4 && y == 14) ? 1 : v;
                v += noise * (uniform() - 0.5);
                rgb[3 * (y * SIDE + x) + c] = scale * fmin(fmax(v, 0), 1);
            }
}

static double furthest(const double *wanted, const float *got)
{
    double most = 0;
    for (size_t i = 0; i < PIXELS; i++)
        most = fmax(most, fabs(wanted[i] - (double)got[i]));
    return most;
}

/* Single precision, and a white that differs in the fifth digit: within 5e-4 everywhere. */
#define AGREES 5e-4

TEST(test_brute_force)
{
    static double a[3 * PIXELS], b[3 * PIXELS], wanted[PIXELS];
    static float got[PIXELS];
    struct err e = {""};
    static const double ppd[] = {FLIP_PPD, 20, 134};
    draw(a, 0, 0.1, 1);
    draw(b, 1, 0.4, 1);
    for (size_t k = 0; k < sizeof ppd / sizeof *ppd; k++) {
        struct oracle o = papers;
        o.at[PPD] = ppd[k];
        oracle_ldr(&o, a, b, wanted);
        assert_true(flip_ldr(a, b, SIDE, OTHER, o.at[PPD], got, &e));
        near(furthest(wanted, got), 0, AGREES, "difference from the second implementation");
        assert_true(flip_mean(got, PIXELS) > 0.1);
    }
    assert_true(flip_ldr(b, a, SIDE, OTHER, 134, got, &e));
    near(furthest(wanted, got), 0, AGREES, "exchanged");
}

/* Controls: a small change of any one constant is noticed by that comparison. */
TEST(test_brute_force_sees)
{
    static double a[3 * PIXELS], b[3 * PIXELS], wanted[PIXELS];
    static float got[PIXELS];
    struct err e = {""};
    draw(a, 0, 0.1, 1);
    draw(b, 1, 0.4, 1);
    assert_true(flip_ldr(a, b, SIDE, OTHER, FLIP_PPD, got, &e));
    for (int k = 0; k < NUM_CONSTANTS; k++) {
        struct oracle o = papers;
        o.at[k] *= k == A2_BY ? 1.2 : 1.03; /* a quarter of its filter, much like the rest */
        oracle_ldr(&o, a, b, wanted);
        assert_true(furthest(wanted, got) > AGREES);
    }
}

/* The exposures, by bisection of the tone curve; the published example's file is named after its range, -12.5423 to
 * +0.9427, and its number of exposures, 14. */
TEST(test_exposures)
{
    struct err e = {""};
    double low = 0, high = 8;
    for (int i = 0; i < 60; i++)
        *(flip_tone((low + high) / 2) < 0.85 ? &low : &high) = (low + high) / 2;
    enum { N = 9 };
    double rgb[3 * N];
    for (int i = 0; i < N; i++) {
        double y = i == 7 ? low / exp2(-12.5423) : low / exp2(0.9427) * exp2(i - 4);
        fill(rgb + 3 * i, 1, y, y, y);
    }
    struct flip_exposures x;
    assert_true(flip_exposures(rgb, N, &x, &e));
    near(x.start, -12.5423, 1e-9, "start");
    near(x.stop, 0.9427, 1e-9, "stop");
    assert_int_equal(x.num, 14);

    fill(rgb, N, low, low, low);
    assert_true(flip_exposures(rgb, N, &x, &e));
    near(fabs(x.start) + fabs(x.stop), 0, 1e-9, "flat");
    assert_int_equal(x.num, 2);
    /* Of an even number the middle two's mean. */
    fill(rgb, 4, low, low, low);
    fill(rgb, 2, low / 2, low / 2, low / 2);
    assert_true(flip_exposures(rgb, 4, &x, &e));
    near(x.stop, -log2(0.75), 1e-9, "even");
    fill(rgb, 3, 0, 0, 0); /* mostly black: of the others */
    assert_true(flip_exposures(rgb, 4, &x, &e));
    near(x.stop, 0, 1e-9, "mostly black");
    fill(rgb, 4, 0, 0, 0);
    assert_false(flip_exposures(rgb, 4, &x, &e));

    /* Narkowicz' fit x (2.51 x + .03)/(x (2.43 x + .59) + .14), at 0.6 x. */
    static const double at[] = {0, 0.01, 0.18, 1, 4};
    for (int i = 0; i < 5; i++) {
        double v = 0.6 * at[i];
        near(flip_tone(at[i]), v * (2.51 * v + .03) / (v * (2.43 * v + .59) + .14), 1e-12, "ACES");
    }
    near(flip_tone(1e30), 1, 0, "too bright");
    near(flip_tone(-1), 0, 0, "negative");
}

/* The largest over exposures, by the second implementation; and twice the light is the same. */
TEST(test_hdr)
{
    static double a[3 * PIXELS], b[3 * PIXELS], shown[2][3 * PIXELS], one[PIXELS], wanted[PIXELS];
    static float got[PIXELS], twice[PIXELS];
    struct err e = {""};
    draw(a, 0, 0.1, 3);
    draw(b, 1, 0.4, 3);
    for (int i = 0; i < 3; i++)
        a[30 + i] = 60; /* a lamp */
    struct flip_exposures x;
    assert_true(flip_exposures(a, PIXELS, &x, &e));
    assert_true(x.num > 4);
    memset(wanted, 0, sizeof wanted);
    for (int k = 0; k < x.num; k++) {
        double gain = exp2(x.start + k * (x.stop - x.start) / (x.num - 1));
        for (size_t i = 0; i < 3 * PIXELS; i++) {
            shown[0][i] = flip_tone(gain * a[i]);
            shown[1][i] = flip_tone(gain * b[i]);
        }
        oracle_ldr(&papers, shown[0], shown[1], one);
        for (size_t i = 0; i < PIXELS; i++)
            wanted[i] = fmax(wanted[i], one[i]);
    }
    assert_true(flip_hdr(a, b, SIDE, OTHER, FLIP_PPD, &x, got, &e));
    near(furthest(wanted, got), 0, AGREES, "HDR");
    for (size_t i = 0; i < 3 * PIXELS; i++) {
        a[i] *= 2;
        b[i] *= 2;
    }
    assert_true(flip_exposures(a, PIXELS, &x, &e));
    assert_true(flip_hdr(a, b, SIDE, OTHER, FLIP_PPD, &x, twice, &e));
    for (size_t i = 0; i < PIXELS; i++)
        near((double)twice[i], (double)got[i], 2e-5, "twice the light");
    assert_true(flip_hdr(a, a, SIDE, OTHER, FLIP_PPD, &x, got, &e));
    near(flip_mean(got, PIXELS), 0, 0, "identical");
}
