/* Vectors of double, for computations independent of the renderer's. */
#ifndef ASSAY_TEST_VECTORS_H
#define ASSAY_TEST_VECTORS_H

#include <math.h>

static inline double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* out must not be a or b. */
static inline void cross3(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static inline void unit3(double v[3])
{
    double length = sqrt(dot3(v, v));
    for (int k = 0; k < 3; k++)
        v[k] /= length;
}

/* Irradiance at a point, whose normal is n, from a polygon of radiance 1 that it sees in full: Lambert's formula, half the sum
 * over the edges of the angle that the edge subtends times the cosine between n and the normal of the plane through edge and
 * point. Below zero where the corners go round the other way. */
static inline double lambert_irradiance(const double (*corner)[3], int num, const double at[3],
                                        const double n[3])
{
    double sum = 0;
    for (int i = 0; i < num; i++) {
        double a[3], b[3], normal[3];
        for (int k = 0; k < 3; k++) {
            a[k] = corner[i][k] - at[k];
            b[k] = corner[(i + 1) % num][k] - at[k];
        }
        cross3(b, a, normal);
        double sine = sqrt(dot3(normal, normal));
        sum += sine > 0 ? atan2(sine, dot3(a, b)) * dot3(n, normal) / sine : 0;
    }
    return sum / 2;
}

#endif
