/* Double-precision 4x4 matrices for loading: row-major storage, column vectors, so the product A*B
 * applies B first. Scenes are float32 only after the last transform. */
#ifndef ASSAY_MAT4_H
#define ASSAY_MAT4_H

#include "vec.h"

#include <math.h>
#include <stdbool.h>

typedef struct {
    double x, y, z;
} dvec3;

typedef struct {
    double m[4][4];
} mat4;

static inline dvec3 d3(double x, double y, double z)
{
    return (dvec3){x, y, z};
}
static inline dvec3 d3_of(vec3 v)
{
    return (dvec3){(double)v.x, (double)v.y, (double)v.z};
}
static inline dvec3 d3_add(dvec3 a, dvec3 b)
{
    return (dvec3){a.x + b.x, a.y + b.y, a.z + b.z};
}
static inline dvec3 d3_sub(dvec3 a, dvec3 b)
{
    return (dvec3){a.x - b.x, a.y - b.y, a.z - b.z};
}
static inline dvec3 d3_scale(dvec3 a, double s)
{
    return (dvec3){a.x * s, a.y * s, a.z * s};
}
static inline double d3_dot(dvec3 a, dvec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline dvec3 d3_cross(dvec3 a, dvec3 b)
{
    return (dvec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline double d3_length(dvec3 a)
{
    return sqrt(d3_dot(a, a));
}
/* Scales *a to unit length; false, and *a untouched, if it is zero or not finite. */
static inline bool d3_normalize(dvec3 *a)
{
    double l = d3_length(*a);
    if (!(l > 0) || !isfinite(l))
        return false;
    *a = d3_scale(*a, 1 / l);
    return true;
}

static inline mat4 mat4_identity(void)
{
    return (mat4){{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
}
static inline mat4 mat4_translate(dvec3 t)
{
    return (mat4){{{1, 0, 0, t.x}, {0, 1, 0, t.y}, {0, 0, 1, t.z}, {0, 0, 0, 1}}};
}
static inline mat4 mat4_scale(dvec3 s)
{
    return (mat4){{{s.x, 0, 0, 0}, {0, s.y, 0, 0}, {0, 0, s.z, 0}, {0, 0, 0, 1}}};
}
/* Rotation by `angle` (radians) about the unit axis a, counter-clockwise when a points at the viewer. */
static inline mat4 mat4_rotate(dvec3 a, double angle)
{
    double c = cos(angle), s = sin(angle), k = 1 - c;
    return (mat4){{{c + k * a.x * a.x, k * a.x * a.y - s * a.z, k * a.x * a.z + s * a.y, 0},
                   {k * a.y * a.x + s * a.z, c + k * a.y * a.y, k * a.y * a.z - s * a.x, 0},
                   {k * a.z * a.x - s * a.y, k * a.z * a.y + s * a.x, c + k * a.z * a.z, 0},
                   {0, 0, 0, 1}}};
}
/* Columns x, y, z, origin. */
static inline mat4 mat4_columns(dvec3 x, dvec3 y, dvec3 z, dvec3 o)
{
    return (mat4){{{x.x, y.x, z.x, o.x}, {x.y, y.y, z.y, o.y}, {x.z, y.z, z.z, o.z}, {0, 0, 0, 1}}};
}
static inline dvec3 mat4_column(const mat4 *a, int j)
{
    return (dvec3){a->m[0][j], a->m[1][j], a->m[2][j]};
}
static inline mat4 mat4_mul(const mat4 *a, const mat4 *b)
{
    mat4 r;
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            r.m[i][j] = a->m[i][0] * b->m[0][j] + a->m[i][1] * b->m[1][j] +
                        a->m[i][2] * b->m[2][j] + a->m[i][3] * b->m[3][j];
    return r;
}
/* The first three components of a * (p, 1). */
static inline dvec3 mat4_point(const mat4 *a, dvec3 p)
{
    return (dvec3){a->m[0][0] * p.x + a->m[0][1] * p.y + a->m[0][2] * p.z + a->m[0][3],
                   a->m[1][0] * p.x + a->m[1][1] * p.y + a->m[1][2] * p.z + a->m[1][3],
                   a->m[2][0] * p.x + a->m[2][1] * p.y + a->m[2][2] * p.z + a->m[2][3]};
}
static inline bool mat4_is_affine(const mat4 *a)
{
    return a->m[3][0] == 0 && a->m[3][1] == 0 && a->m[3][2] == 0 && a->m[3][3] == 1;
}
/* Determinant of the linear part, the upper left 3 x 3. */
static inline double mat4_det3(const mat4 *a)
{
    return d3_dot(mat4_column(a, 0), d3_cross(mat4_column(a, 1), mat4_column(a, 2)));
}
/* The cofactor matrix of the linear part times n: det(a) * inverse-transpose(a) * n. It maps the
 * cross product of two vectors to the cross product of their images, without a division. */
static inline dvec3 mat4_cofactor(const mat4 *a, dvec3 n)
{
    dvec3 x = mat4_column(a, 0), y = mat4_column(a, 1), z = mat4_column(a, 2);
    dvec3 cx = d3_cross(y, z), cy = d3_cross(z, x), cz = d3_cross(x, y);
    return (dvec3){cx.x * n.x + cy.x * n.y + cz.x * n.z, cx.y * n.x + cy.y * n.y + cz.y * n.z,
                   cx.z * n.x + cy.z * n.y + cz.z * n.z};
}

#endif
