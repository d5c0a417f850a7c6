#include "export_cycles.h"

#include "export_cycles_internal.h"
#include "reference/suite/features.h"
#include "reference/base/json_file.h"
#include "renderer/base/fs.h"

#include <assert.h>
#include <math.h>
#include <unistd.h>

enum { MAX_DEPTH = 1025 }; /* Blender's limit of 1024 bounces is one less than ours */

/* Blender's range of focal lengths for a 36 mm sensor, mm. */
#define LENS_MIN 1.0
#define LENS_MAX 5000.0

static json_t *camera_json(const struct scene *s, const struct camera *c, struct err *e)
{
    if (c->is_orthographic) {
        err_set(e, "Cycles: an orthographic camera is not verified");
        return NULL;
    }
    if (c->lens_radius > 0 && !(c->focal_distance > 0)) {
        err_set(e, "Cycles: a lens that focuses at distance %g", (double)c->focal_distance);
        return NULL;
    }
    double near, far;
    /* Blender stores a rotation, not a matrix, so the axes must be orthonormal. */
    if (!features_check_axes("Cycles", c, e) ||
        !features_clip_depths("Cycles", s, c, &near, &far, e))
        return NULL;
    double tan_h = c->tan_h, lens = 18 / tan_h, square = tan_h * c->height / c->width;
    if (!(lens >= LENS_MIN && lens <= LENS_MAX)) {
        err_set(e,
                "Cycles: horizontal angle of view out of Blender's range (tan of its half is %g)",
                tan_h);
        return NULL;
    }
    double nearest, furthest;
    features_distances(s, c, &nearest, &furthest);
    nearest -= (double)c->lens_radius; /* rays start anywhere on the lens */
    furthest += (double)c->lens_radius;
    /* Cycles clips by depth, we by distance: use planes that clip nothing in both, or the same primitives. */
    double corner = sqrt(1 + tan_h * tan_h + square * square);
    if (near == 0)
        near = 0.5 * nearest / corner;
    if (isinf(far))
        far = 2 * furthest;
    return json_pack("{so,so,so,so,sf,s[ff],sf,sf}", "right", cycles_vec3(c->right), "up",
                     cycles_vec3(c->up), "backward", cycles_vec3(c->backward), "eye",
                     cycles_vec3(c->eye), "tan_h", tan_h, "clip", near, far, "lens_radius",
                     (double)c->lens_radius, "focal_distance", (double)c->focal_distance);
}

/* Cycles truncates its Gauss at 6 sigma, beyond which less than a float's rounding is left. Blender's filter width is 4
 * sigma, at most 10 pixels. */
static bool check_filter(const struct pixel_filter *f, struct err *e)
{
    char text[PIXEL_FILTER_TEXT];
    if (f->radius == 0 || (pixel_filter_is_gauss(f, 6) && f->sigma <= 2.5))
        return true;
    pixel_filter_print(f, text);
    return err_set(
        e,
        "Cycles: a pixel filter %s, not the box of one pixel or gauss:SIGMA:(6 SIGMA) with SIGMA up to 2.5",
        text);
}

bool export_cycles(const struct scene *s, const struct camera *c, int depth, const char *path,
                   struct err *e)
{
    assert(depth >= 0 && c->width > 0 && c->height > 0);
    double extent = d3_length(d3_sub(d3_of(s->bounds_max), d3_of(s->bounds_min)));
    json_t *camera = NULL, *materials = NULL, *meshes = NULL, *environment = NULL;
    bool image_written = false;
    uint32_t textures_written = 0;
    if (depth > MAX_DEPTH)
        return err_set(e, "Cycles: depth %d, at most %d are possible", depth, MAX_DEPTH);
    const struct path image = fs_path("%s.exr", path);
    bool ok = check_filter(&c->filter, e) && cycles_write_textures(s, path, &textures_written, e) &&
              (materials = cycles_materials(s, path, e)) != NULL &&
              (camera = camera_json(s, c, e)) != NULL && (meshes = cycles_meshes(s, e)) != NULL &&
              (environment = cycles_environment(s, image.s, &image_written, e)) != NULL;
    json_t *root =
        json_pack("{si,si,si,si,sf,so?,so?,so?,so,so,so?}", "assay_cycles", 2, "depth", depth,
                  "width", c->width, "height", c->height, "extent", extent, "camera", camera,
                  "materials", materials, "meshes", meshes, "spheres", cycles_spheres(s, c->eye),
                  "lights", cycles_lights(s), "environment", environment);
    if (c->filter.radius > 0)
        json_object_set_new(root, "filter_width", json_real(4 * c->filter.sigma));
    ok = ok && json_write_as(path, root, JSON_COMPACT | JSON_REAL_PRECISION(9), e);
    if (!ok && image_written)
        unlink(image.s);
    if (!ok)
        cycles_remove_textures(path, textures_written);
    json_decref(root);
    return ok;
}
