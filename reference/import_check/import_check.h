/* Checks our COLLADA loader: Blender's own importer reads the same file (blender_import.py), and the result is
 * compared with our scene and camera.
 *
 * Compared: the triangles must be the same set, with corners within 1e-5 of the scene's extent and the
 * same orientation; triangles of ours make up a polygon of Blender's if their corners are among its
 * corners and their vector areas add up to its own. Face normals within 1e-4 rad, normals stored in the
 * file within 0.0145 rad (Blender's rounding). Camera: position within 1e-5 of the extent, axes within
 * 1e-5 rad, tangent of half the angle of view within a relative 1e-5. Point and spot lights: position;
 * spot and directional lights: direction.
 *
 * Not read by Blender's importer and therefore only counted: spheres and rectangular lights in our
 * extras (a rectangle is matched by the point light that the file has at its centre for other readers,
 * ambient light by any sun), a camera placed by <lookat>, normals that Blender computed itself, an
 * environment. Materials and intensities are not compared at all. */
#ifndef ASSAY_IMPORT_CHECK_H
#define ASSAY_IMPORT_CHECK_H

#include "reference/suite/suite.h"

#include <stddef.h>

struct import_report {
    bool agrees;
    char what[256];             /* the first thing that differs */
    size_t triangles, polygons; /* triangles of ours that were matched; polygons of Blender's compared */
    size_t normals;             /* corners whose normals were compared */
    size_t lights;              /* point, spot and directional lights that were found */
    /* Ours that Blender's importer does not read. */
    size_t spheres, rectangles, environments, cameras;
    size_t unread_normals; /* corners whose normals Blender made itself */
    /* Largest differences: positions relative to the extent, directions in rad, tan_h relative. */
    double place_error, normal_error, axis_error, angle_error;
};

/* dump: the output of blender_import.py for one file, still in Blender's axes. Fails on a dump of another
 * format or one that reports an error of Blender's, and on a scene in the CGL dialect (whose camera is
 * not the file's). */
NODISCARD bool import_check_compare(const struct scene *s, const struct camera *c,
                                    const json_t *dump, struct import_report *out, struct err *e);

struct import_options {
    const char *work_dir;  /* exists; gets a directory, removed on success */
    const char *share_dir; /* where blender_import.py is */
    double timeout_s;
};

/* One Blender process reads all `num` scenes. *dumps: an array of `num` objects (a new reference). */
NODISCARD bool import_check_run(const struct suite_scene *const *scene, int num,
                                const struct import_options *opt, json_t **dumps, struct err *e);

/* Runs both and returns the reports as JSON (a new reference): [{"scene", "agrees", "what" if it does not, and all
 * numbers of the report}]. A scene that cannot be judged has only "scene" and "error"; if Blender has no COLLADA
 * importer (Debian 13's build, and 5.0 and later), each scene has "absent" with the reason, and nothing was checked. */
NODISCARD bool import_check(const struct suite_scene *const *scene, int num,
                            const struct import_options *opt, json_t **reports, struct err *e);

#endif
