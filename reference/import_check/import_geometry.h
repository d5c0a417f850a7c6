/* The geometry half of import_check.h: our triangles against Blender's polygons, as sets. */
#ifndef ASSAY_IMPORT_GEOMETRY_H
#define ASSAY_IMPORT_GEOMETRY_H

#include "import_check.h"

#define IMPORT_PLACE_TOLERANCE  1e-5 /* of the scene's extent */
#define IMPORT_NORMAL_TOLERANCE 1e-4 /* rad, of normals of faces */
/* Of a file's own normals: Blender keeps two angles of 16 bits each and makes 0 of what is below
 * acos(1 - 1e-4). */
#define IMPORT_CUSTOM_TOLERANCE 0.0145

typedef struct {
    double x, y, z;
} point;

/* One file as both have read it. */
struct import_pair {
    const struct scene *s;
    struct import_report *out;
    char axis; /* first letter of up_axis */
    double extent;
};

/* From Blender's axes to ours. */
point import_geometry_point(const struct import_pair *pair, point b);
/* Three numbers from `at` on; false if they are none. */
bool import_geometry_read_point(const json_t *array, size_t at, point *out);
/* The first difference of a file is the one that is reported. */
void import_geometry_differ(struct import_pair *pair, const char *fmt, ...)
    __attribute__((format(printf, 2, 3)));

/* found: one per triangle of ours, set for those that some polygon is made of. */
NODISCARD bool import_geometry_compare(struct import_pair *pair, const json_t *meshes, bool *found,
                                       struct err *e);

static inline point point_of(vec3 v)
{
    return (point){(double)v.x, (double)v.y, (double)v.z};
}
static inline point point_add(point a, point b)
{
    return (point){a.x + b.x, a.y + b.y, a.z + b.z};
}
static inline point point_sub(point a, point b)
{
    return (point){a.x - b.x, a.y - b.y, a.z - b.z};
}
static inline double point_dot(point a, point b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline point point_cross(point a, point b)
{
    return (point){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline double point_length(point a)
{
    return sqrt(point_dot(a, a));
}
/* Angle between two directions, rad; exact for small ones. */
static inline double point_angle(point a, point b)
{
    return atan2(point_length(point_cross(a, b)), point_dot(a, b));
}

#endif
