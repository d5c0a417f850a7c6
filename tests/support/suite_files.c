#include "suite_files.h"

#include "test.h"
#include "vectors.h"

#include <assert.h>
#include <string.h>

const struct suite *suite_shipped(void)
{
    static struct suite suite;
    struct err e;
    if (suite.num_scenes == 0)
        MUST(suite_load("reference/scenes", &suite, &e));
    return &suite;
}

const struct suite_scene *suite_shipped_scene(const char *name)
{
    const struct suite_scene *s = suite_find(suite_shipped(), name);
    assert_non_null(s);
    return s;
}

static void skin(double s, double t, double p[3])
{
    double a = 2 * M_PI * s, b = 2 * M_PI * t;
    double c2 = cos(2 * a), s2 = sin(2 * a), c3 = cos(3 * a), s3 = sin(3 * a);
    double from_axis = 0.42 + 0.2 * c3;
    /* Away from the ring; along the tube, at right angles to that; the third direction. */
    double out[3] = {c3 * c2, s3, c3 * s2}, side[3];
    double along[3] = {-0.6 * s3 * c2 - 2 * from_axis * s2, 0.6 * c3,
                       -0.6 * s3 * s2 + 2 * from_axis * c2};
    unit3(along);
    cross3(along, out, side);
    double middle[3] = {from_axis * c2, 0.2 * s3, from_axis * s2};
    double r = 0.1 * (1 + 0.15 * cos(3 * b + 20 * a));
    for (int k = 0; k < 3; k++)
        p[k] = middle[k] + r * (cos(b) * out[k] + sin(b) * side[k]);
}

void suite_knot(double s, double t, double p[3], double n[3])
{
    const double h = 1e-5;
    double q[4][3], ds[3], dt[3];
    skin(s, t, p);
    skin(s + h, t, q[0]);
    skin(s - h, t, q[1]);
    skin(s, t + h, q[2]);
    skin(s, t - h, q[3]);
    for (int k = 0; k < 3; k++) {
        ds[k] = q[0][k] - q[1][k];
        dt[k] = q[2][k] - q[3][k];
    }
    cross3(dt, ds, n);
    unit3(n);
}

/* Prints x with at most `digits` decimals, without trailing zeros and the zero before the point. */
static void number(FILE *f, double x, int digits)
{
    char text[32];
    snprintf(text, sizeof text, "%.*f", digits, x);
    char *end = text;
    while (*end != '\0')
        end++;
    while (end[-1] == '0')
        *--end = '\0';
    if (end[-1] == '.')
        *--end = '\0';
    const char *sign = text[0] == '-' ? "-" : "", *rest = text + (text[0] == '-');
    if (rest[0] == '0' && rest[1] == '\0')
        sign = "";
    else if (rest[0] == '0')
        rest++;
    fprintf(f, "%s%s", sign, rest);
}

/* Prints three numbers for each vertex, with at most `digits` decimals: its position (which 0) or
 * normal (1). */
static void knot_vertices(FILE *f, int digits, int which)
{
    for (int i = 0; i < KNOT_ALONG * KNOT_AROUND; i++) {
        double v[2][3];
        suite_knot((double)(i / KNOT_AROUND) / KNOT_ALONG, (double)(i % KNOT_AROUND) / KNOT_AROUND,
                   v[0], v[1]);
        for (int k = 0; k < 3; k++) {
            number(f, v[which][k], digits);
            putc(k < 2 ? ' ' : '\n', f);
        }
    }
}

static void knot_triangles(FILE *f)
{
    for (int i = 0; i < KNOT_ALONG; i++)
        for (int k = 0; k < KNOT_AROUND; k++) {
            int here = i * KNOT_AROUND, next = (i + 1) % KNOT_ALONG * KNOT_AROUND;
            int up = (k + 1) % KNOT_AROUND;
            fprintf(f, "%d %d %d %d %d %d%s", here + k, here + up, next + up, here + k, next + up,
                    next + k, k + 1 < KNOT_AROUND ? " " : "\n");
        }
}

void suite_write_mesh(FILE *f)
{
    char line[256];
    FILE *around = fopen("tests/support/44_mesh.dae.in", "r");
    assert(around != NULL);
    while (fgets(line, sizeof line, around) != NULL) {
        if (strcmp(line, "@position\n") == 0)
            knot_vertices(f, 4, 0);
        else if (strcmp(line, "@normal\n") == 0)
            knot_vertices(f, 3, 1);
        else if (strcmp(line, "@triangles\n") == 0)
            knot_triangles(f);
        else
            fputs(line, f);
    }
    fclose(around);
}

/* Bright at the horizon, darker below, the same blue at both poles, so that it makes no difference
 * whether a reader joins the top row to the bottom row. The lobe of the sun ends 45 degrees from
 * its middle, short of the pole. */
void suite_sky_radiance(const double d[3], double radiance[3])
{
    static const double horizon[3] = {0.6, 0.57, 0.51}, pole[3] = {0.18, 0.3, 0.54};
    static const double sun[3] = {-0.6, 0.6, -0.52915026221291817}, lobe[3] = {6, 5, 4};
    const double edge = 0.70710678118654752;
    double y = d[1], ground = y < 0 ? 1 + 2 * y * (1 + y) : 1;
    double t = (d[0] * sun[0] + d[1] * sun[1] + d[2] * sun[2] - edge) / (1 - edge);
    t = fmin(fmax(t, 0), 1);
    for (int c = 0; c < 3; c++)
        radiance[c] =
            (horizon[c] + (pole[c] - horizon[c]) * y * y) * ground + lobe[c] * t * t * (3 - 2 * t);
}

bool suite_sky(int turn, struct image *out, struct err *e)
{
    if (!image_alloc(out, SKY_WIDTH, SKY_HEIGHT, 3, (const char *const[]){"R", "G", "B"}, e))
        return false;
    for (int y = 0; y < SKY_HEIGHT; y++)
        for (int x = 0; x < SKY_WIDTH; x++) {
            double theta = M_PI * (y + 0.5) / SKY_HEIGHT;
            double phi = 2 * M_PI * (x + 0.5) / SKY_WIDTH - M_PI;
            double d[3] = {sin(theta) * cos(phi), cos(theta), -sin(theta) * sin(phi)}, l[3];
            suite_sky_radiance(d, l);
            for (int c = 0; c < 3; c++)
                out->data[3 * (y * SKY_WIDTH + (x + turn) % SKY_WIDTH) + c] =
                    (float)(round(256 * l[c]) / 256);
        }
    return true;
}
