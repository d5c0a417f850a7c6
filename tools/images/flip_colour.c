#include "flip_colour.h"

#include <math.h>

/* Constants of [Andersson20]. */
#define Q_COLOUR  0.7f  /* exponent of colour distances */
#define KNEE_FROM 0.4f  /* of the largest such distance .. */
#define KNEE_TO   0.95f /* .. becomes this error */

/* CIE XYZ of linear BT.709 RGB, whole numbers over a common denominator [IEC 61966-2-1]. */
static const double xyz_of_rgb[3][3] = {
    {10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
    {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
    {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};

static void invert(const double m[3][3], double out[3][3])
{
    double det = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int r0 = (j + 1) % 3, r1 = (j + 2) % 3, c0 = (i + 1) % 3, c1 = (i + 2) % 3;
            out[i][j] = m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0];
        }
    for (int k = 0; k < 3; k++)
        det += m[0][k] * out[k][0];
    for (int i = 0; i < 9; i++)
        out[i / 3][i % 3] /= det;
}

void flip_multiply(const float m[3][3], const float v[3], float out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

void flip_lab(const struct flip_colours *c, const float rgb[3], float lab[3])
{
    const float delta = 6.0f / 29;
    float f[3];
    flip_multiply(c->to, rgb, f);
    for (int i = 0; i < 3; i++)
        f[i] = f[i] > delta * delta * delta ? cbrtf(f[i]) : f[i] / (3 * delta * delta) + 4.0f / 29;
    lab[0] = 116 * f[1] - 16;
    lab[1] = 0.01f * lab[0] * 500 * (f[0] - f[1]);
    lab[2] = 0.01f * lab[0] * 200 * (f[1] - f[2]);
}

/* HyAB distance (city block in lightness, Euclidean in chroma), to the power Q_COLOUR. */
static float distance(const float a[3], const float b[3])
{
    return powf(fabsf(a[0] - b[0]) + hypotf(a[1] - b[1], a[2] - b[2]), Q_COLOUR);
}

struct flip_colours flip_colours(void)
{
    struct flip_colours c;
    double to[3][3], from[3][3];
    for (int i = 0; i < 3; i++) {
        double white = xyz_of_rgb[i][0] + xyz_of_rgb[i][1] + xyz_of_rgb[i][2];
        for (int j = 0; j < 3; j++)
            to[i][j] = xyz_of_rgb[i][j] / white;
    }
    invert(to, from);
    for (int i = 0; i < 9; i++) {
        c.to[i / 3][i % 3] = (float)to[i / 3][i % 3];
        c.from[i / 3][i % 3] = (float)from[i / 3][i % 3];
    }
    float green[3], blue[3];
    flip_lab(&c, (const float[3]){0, 1, 0}, green);
    flip_lab(&c, (const float[3]){0, 0, 1}, blue);
    c.largest = distance(green, blue);
    return c;
}

float flip_colour_error(const struct flip_colours *c, const float a[3], const float b[3])
{
    float d = distance(a, b), knee = KNEE_FROM * c->largest;
    float error =
        d < knee ? d * KNEE_TO / knee : KNEE_TO + (d - knee) / (c->largest - knee) * (1 - KNEE_TO);
    return fminf(error, 1);
}
