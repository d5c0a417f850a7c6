/* The loader is not believed: Blender's own COLLADA importer reads the same file (blender_import.py), and what
 * it makes of it is held against our scene and camera.
 *
 * Compared: every triangle of the one has to be in the other, as sets, corners within 1e-5 of the
 * scene's extent and in the same turn; a polygon of Blender's is made up of our triangles if these
 * have their corners in its corners and its vector area. Normals of faces within 1e-4 rad, a file's
 * own within 0.0145 (Blender rounds them that much). Camera: place within 1e-5 of the extent, axes
 * within 1e-5 rad, tangent of half the angle of view within a relative 1e-5. Point and spot lights:
 * place; spot and directional lights: direction.
 *
 * Not compared, because Blender's importer does not read it, and therefore counted: spheres and
 * rectangles of light in our extras (of a rectangle, the point light that stands in the file for
 * other readers is found at its centre; of ambient light, a sun anywhere), a camera placed by
 * <lookat>, normals that Blender made itself, an environment. Materials and intensities are not
 * compared at all. */
#ifndef ASSAY_IMPORT_CHECK_H
#define ASSAY_IMPORT_CHECK_H

#include "reference/suite/suite.h"

#include <stddef.h>

struct import_report {
    bool agrees;
    char what[256];             /* the first thing that differs */
    size_t triangles, polygons; /* of ours that were found, in so many of Blender's */
    size_t normals;             /* corners whose normals were compared */
    size_t lights;              /* point, spot and directional lights that were found */
    /* Ours that Blender's importer does not read. */
    size_t spheres, rectangles, environments, cameras;
    size_t unread_normals; /* corners whose normals Blender made itself */
    /* Largest differences: of places relative to the extent, of directions in rad, of tan_h relative. */
    double place_error, normal_error, axis_error, angle_error;
};

/* dump: what blender_import.py wrote of one file, still in Blender's axes. Fails on a dump that is not of
 * that format, that holds an error of Blender's, and on a scene in the CGL dialect (whose camera is
 * placed anew). */
NODISCARD bool import_check_compare(const struct scene *s, const struct camera *c,
                                    const json_t *dump, struct import_report *out, struct err *e);

struct import_options {
    const char *work_dir;  /* exists; gets a directory, removed on success */
    const char *share_dir; /* where blender_import.py is */
    double timeout_s;
};

/* One Blender reads all `num` scenes. *dumps: an array of as many objects (a new reference). */
NODISCARD bool import_check_run(const struct suite_scene *const *scene, int num,
                                const struct import_options *opt, json_t **dumps, struct err *e);

/* Both, and as JSON (a new reference): [{"scene", "agrees", "what" or "error", and all numbers of
 * the report}]. A scene that cannot be judged has "error"; where Blender has no importer of COLLADA (as built by Debian 13, and from
 * 5.0 on), each has "absent" with the reason instead, and nothing was checked. */
NODISCARD bool import_check(const struct suite_scene *const *scene, int num,
                            const struct import_options *opt, json_t **reports, struct err *e);

#endif
