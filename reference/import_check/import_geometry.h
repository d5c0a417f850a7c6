/* The geometry half of import_check.h: our triangles against Blender's polygons, as sets. */
#ifndef ASSAY_IMPORT_GEOMETRY_H
#define ASSAY_IMPORT_GEOMETRY_H

#include "import_check.h"
#include "renderer/math/mat4.h"

#define IMPORT_PLACE_TOLERANCE  1e-5 /* of the scene's extent */
#define IMPORT_NORMAL_TOLERANCE 1e-4 /* rad, of normals of faces */
/* Of a file's own normals: Blender keeps two angles of 16 bits each and makes 0 of what is below
 * acos(1 - 1e-4). */
#define IMPORT_CUSTOM_TOLERANCE 0.0145

/* One file as both have read it. */
struct import_pair {
    const struct scene *s;
    struct import_report *out;
    char axis; /* first letter of up_axis */
    double extent;
};

/* From Blender's axes to ours. */
dvec3 import_geometry_point(const struct import_pair *pair, dvec3 b);
/* Three numbers from `at` on; false if they are none. */
bool import_geometry_read_point(const json_t *array, size_t at, dvec3 *out);
/* The first difference of a file is the one that is reported. */
void import_geometry_differ(struct import_pair *pair, const char *fmt, ...)
    __attribute__((format(printf, 2, 3)));

/* found: one per triangle of ours, set for those that some polygon is made of. */
NODISCARD bool import_geometry_compare(struct import_pair *pair, const json_t *meshes, bool *found,
                                       struct err *e);

/* Angle between two directions, rad; exact for small ones. */
static inline double import_geometry_angle(dvec3 a, dvec3 b)
{
    return atan2(d3_length(d3_cross(a, b)), d3_dot(a, b));
}

#endif
