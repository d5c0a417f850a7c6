/* The geometry half of import_check.h: our triangles against Blender's polygons, as sets. */
#ifndef ASSAY_IMPORT_GEOMETRY_H
#define ASSAY_IMPORT_GEOMETRY_H

#include "import_check.h"
#include "renderer/math/mat4.h"

#define IMPORT_PLACE_TOLERANCE  1e-5 /* of the scene's extent */
#define IMPORT_NORMAL_TOLERANCE 1e-4 /* rad, of normals of faces */
/* rad, of normals stored in the file: Blender stores two angles of 16 bits each and sets those
 * below acos(1 - 1e-4) to 0. */
#define IMPORT_CUSTOM_TOLERANCE 0.0145

/* One file as read by both programs. */
struct import_pair {
    const struct scene *s;
    struct import_report *out;
    char axis; /* first letter of up_axis */
    double extent;
};

/* From Blender's axes to ours. */
dvec3 import_geometry_point(const struct import_pair *pair, dvec3 b);
/* Reads three numbers from index `at` on; false if they are not numbers. */
bool import_geometry_read_point(const json_t *array, size_t at, dvec3 *out);
/* Records a difference; only the first one of a file is kept. */
void import_geometry_differ(struct import_pair *pair, const char *fmt, ...)
    __attribute__((format(printf, 2, 3)));

/* found: a flag per triangle of ours, set if it is part of a polygon of Blender's. Fails on a
 * malformed dump. */
NODISCARD bool import_geometry_compare(struct import_pair *pair, const json_t *meshes, bool *found,
                                       struct err *e);

/* Angle between two directions, rad; exact for small ones. */
static inline double import_geometry_angle(dvec3 a, dvec3 b)
{
    return atan2(d3_length(d3_cross(a, b)), d3_dot(a, b));
}

#endif
