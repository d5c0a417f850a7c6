#include "import_check.h"

#include "import_geometry.h"
#include "reference/base/json_file.h"
#include "reference/cycles/blender.h"

#include "renderer/base/fs.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define AXIS_TOLERANCE  1e-5 /* rad */
#define ANGLE_TOLERANCE 1e-5 /* relative, of tan_h */

static bool read_vector(const struct import_pair *pair, const json_t *object, const char *key,
                        dvec3 *out, struct err *e)
{
    dvec3 p = {0};
    if (!import_geometry_read_point(json_object_get(object, key), 0, &p))
        return err_set(e, "blender_import.py: '%s' is not three numbers", key);
    *out = import_geometry_point(pair, p);
    return true;
}

static bool compare_camera(struct import_pair *pair, const struct camera *c, const json_t *cameras,
                           struct err *e)
{
    const json_t *camera = json_array_get(cameras, 0);
    if (json_array_size(cameras) != 1) {
        import_geometry_differ(pair, "Blender has %zu cameras", json_array_size(cameras));
        return true;
    }
    if (json_object_get(camera, "eye") == NULL) {
        pair->out->cameras = 1;
        return true;
    }
    static const char *const names[] = {"right", "up", "backward"};
    const vec3 ours[] = {c->right, c->up, c->backward};
    struct import_report *out = pair->out;
    dvec3 p = {0};
    for (int i = 0; i < 3; i++) {
        if (!read_vector(pair, camera, names[i], &p, e))
            return false;
        double angle = import_geometry_angle(d3_of(ours[i]), p);
        out->axis_error = fmax(out->axis_error, angle);
        if (!(angle <= AXIS_TOLERANCE))
            import_geometry_differ(pair, "camera: '%s' is %.3g rad from Blender's", names[i],
                                   angle);
    }
    if (!read_vector(pair, camera, "eye", &p, e))
        return false;
    double d = d3_length(d3_sub(p, d3_of(c->eye))) / pair->extent;
    out->place_error = fmax(out->place_error, d);
    if (!(d <= IMPORT_PLACE_TOLERANCE))
        import_geometry_differ(pair, "camera: %.3g of the scene's extent from Blender's", d);
    const json_t *tan_h = json_object_get(camera, "tan_h");
    if (!json_is_number(tan_h))
        return err_set(e, "blender_import.py: a camera without 'tan_h'");
    out->angle_error = fabs(json_number_value(tan_h) / (double)c->tan_h - 1);
    if (!(out->angle_error <= ANGLE_TOLERANCE))
        import_geometry_differ(pair,
                               "camera: tangent of half the angle of view %.6f, Blender has %.6f",
                               (double)c->tan_h, json_number_value(tan_h));
    return true;
}

static bool same_light(const struct import_pair *pair, const struct light *l, const char *kind,
                       dvec3 position, dvec3 direction)
{
    const char *wanted = l->kind == LIGHT_POINT ? "POINT" : l->kind == LIGHT_SPOT ? "SPOT" : "SUN";
    bool placed = l->kind != LIGHT_DIRECTIONAL, aimed = l->kind != LIGHT_POINT;
    dvec3 aim = d3_of(l->kind == LIGHT_SPOT ? l->axis : neg(l->to_light));
    return strcmp(kind, wanted) == 0 &&
           (!placed || d3_length(d3_sub(position, d3_of(l->position))) <=
                           IMPORT_PLACE_TOLERANCE * pair->extent) &&
           (!aimed || import_geometry_angle(direction, aim) <= AXIS_TOLERANCE);
}

/* Is o a rectangular light, that is two triangles that emit on one side, centred at this place? The triangles
 * share the diagonal, their longest edge, whose midpoint is the centre. */
static bool is_rectangle_at(const struct import_pair *pair, const struct object *o, dvec3 place)
{
    const struct scene *s = pair->s;
    const struct material *m = &s->materials[o->material];
    if (o->num_triangles != 2 || rgb_is_zero(m->radiance) || m->radiance_both_sides)
        return false;
    const vec3 *p = s->position + 3 * (size_t)o->first_triangle;
    dvec3 centre = {0};
    double longest = -1;
    for (int i = 0; i < 3; i++) {
        dvec3 a = d3_of(p[i]), b = d3_of(p[(i + 1) % 3]);
        double d = d3_length(d3_sub(b, a));
        if (d > longest) {
            longest = d;
            centre = d3_add(a, b);
        }
    }
    centre = (dvec3){centre.x / 2, centre.y / 2, centre.z / 2};
    return d3_length(d3_sub(centre, place)) <= IMPORT_PLACE_TOLERANCE * pair->extent;
}

/* Every light of Blender's must match one of ours, and vice versa. Marks the triangles of rectangular lights
 * in `found`. */
static bool compare_lights(struct import_pair *pair, const json_t *lights, json_int_t num_ambient,
                           bool *found, struct err *e)
{
    const struct scene *s = pair->s;
    bool *used = calloc((size_t)s->num_lights + 1, sizeof *used);
    if (used == NULL)
        return err_set(e, "import check: out of memory");
    bool ok = true;
    for (size_t i = 0; ok && i < json_array_size(lights); i++) {
        const json_t *light = json_array_get(lights, i);
        const char *kind = json_string_value(json_object_get(light, "kind"));
        const char *name = json_string_value(json_object_get(light, "name"));
        dvec3 position = {0}, direction = {0};
        ok = (kind != NULL && name != NULL) ||
             err_set(e, "blender_import.py: a light without its members");
        ok = ok && read_vector(pair, light, "position", &position, e) &&
             read_vector(pair, light, "direction", &direction, e);
        bool known = false;
        for (uint32_t l = 0; ok && !known && l < s->num_lights; l++)
            if (!used[l] && s->lights[l].kind <= LIGHT_DIRECTIONAL &&
                same_light(pair, &s->lights[l], kind, position, direction)) {
                known = used[l] = true;
                pair->out->lights++;
            }
        for (uint32_t o = 0; ok && !known && o < s->num_objects; o++) {
            uint32_t t = s->objects[o].first_triangle;
            if (!is_rectangle_at(pair, &s->objects[o], position) || found[t] || found[t + 1])
                continue;
            known = found[t] = found[t + 1] = true;
            pair->out->rectangles++;
        }
        if (ok && !known && strcmp(kind, "SUN") == 0 && s->environment != NULL && num_ambient-- > 0)
            known = true;
        if (ok && !known)
            import_geometry_differ(pair, "Blender's light '%s' (%s) is none of ours", name, kind);
    }
    for (uint32_t l = 0; ok && l < s->num_lights; l++)
        if (s->lights[l].kind <= LIGHT_DIRECTIONAL && !used[l])
            import_geometry_differ(pair, "light %u of ours is none of Blender's", l);
    free(used);
    return ok;
}

static void count_unread(struct import_pair *pair, const bool *found)
{
    const struct scene *s = pair->s;
    pair->out->spheres = s->num_spheres;
    pair->out->environments = s->environment != NULL;
    uint32_t missing = 0, first = 0;
    for (uint32_t t = s->num_triangles; t-- > 0;)
        if (!found[t]) {
            first = t;
            missing++;
        }
    if (missing > 0)
        import_geometry_differ(pair,
                               "%u triangles of ours are none of Blender's, first one of '%s'",
                               missing, s->objects[s->tri_object[first]].name);
}

bool import_check_compare(const struct scene *s, const struct camera *c, const json_t *dump,
                          struct import_report *out, struct err *e)
{
    *out = (struct import_report){.agrees = true};
    const char *error = json_string_value(json_object_get(dump, "error"));
    if (error != NULL)
        return err_set(e, "Blender's importer: %s", error);
    if (s->dialect == DIALECT_CGL)
        return err_set(e, "in the CGL dialect the camera is not the file's");
    const char *axis = json_string_value(json_object_get(dump, "up_axis"));
    const json_t *meshes = json_object_get(dump, "meshes");
    const json_t *cameras = json_object_get(dump, "cameras");
    const json_t *lights = json_object_get(dump, "lights");
    if (axis == NULL || strchr("XYZ", axis[0]) == NULL || strcmp(axis + 1, "_UP") != 0 ||
        !json_is_array(meshes) || !json_is_array(cameras) || !json_is_array(lights))
        return err_set(e, "blender_import.py: not a dump of a file");
    struct import_pair pair = {.s = s,
                               .out = out,
                               .axis = axis[0],
                               .extent =
                                   d3_length(d3_sub(d3_of(s->bounds_max), d3_of(s->bounds_min)))};
    bool *found = calloc((size_t)s->num_triangles + 2, sizeof *found);
    if (found == NULL)
        return err_set(e, "import check: out of memory");
    bool ok = import_geometry_compare(&pair, meshes, found, e) &&
              compare_camera(&pair, c, cameras, e) &&
              compare_lights(&pair, lights,
                             json_integer_value(json_object_get(dump, "num_ambient")), found, e);
    if (ok)
        count_unread(&pair, found);
    free(found);
    return ok;
}

static bool write_jobs(const struct suite_scene *const *scene, int num, const char *dir,
                       struct err *e)
{
    json_t *jobs = json_array();
    bool ok = true;
    for (int i = 0; ok && i < num; i++) {
        char full[PATH_MAX];
        ok = realpath(scene[i]->dae, full) != NULL ||
             err_set(e, "%s: %s", scene[i]->dae, strerror(errno));
        json_array_append_new(jobs, json_pack("{s:s, s:i, s:i}", "dae", ok ? full : "", "width",
                                              scene[i]->width, "height", scene[i]->height));
    }
    ok = ok && json_write(fs_path("%s/jobs.json", dir).s, jobs, e);
    json_decref(jobs);
    return ok;
}

static bool read_dumps(int num, const char *dir, json_t **dumps, struct err *e)
{
    json_error_t why;
    *dumps = json_array();
    for (int i = 0; i < num; i++) {
        const struct path path = fs_path("%s/import_%04d.json", dir, i);
        json_t *dump = json_read(path.s, 0, &why);
        if (dump == NULL) {
            json_decref(*dumps);
            return err_set(e, "%s: %s", path.s, why.text);
        }
        json_array_append_new(*dumps, dump);
    }
    return true;
}

bool import_check_run(const struct suite_scene *const *scene, int num,
                      const struct import_options *opt, json_t **dumps, struct err *e)
{
    struct path temp = fs_path("%s/import-XXXXXX", opt->work_dir);
    const char *const dir = temp.s;
    if (mkdtemp(temp.s) == NULL)
        return err_set(e, "%s: cannot make a directory in it: %s", opt->work_dir, strerror(errno));
    if (!write_jobs(scene, num, dir, e) ||
        !blender_run(BLENDER_RUN "blender_import.py -- --jobs jobs.json", opt->share_dir,
                     "import_check/blender_import.py", dir, opt->timeout_s, e) ||
        !read_dumps(num, dir, dumps, e)) {
        struct err why = *e;
        return err_set(e, "%.900s (see %s)", why.msg, dir);
    }
    if (fs_remove_tree(dir, e))
        return true;
    json_decref(*dumps);
    return false;
}

static json_t *report_json(const char *scene, const struct import_report *r)
{
    json_t *j = json_pack(
        "{s:s, s:b, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:f, s:f, s:f, s:f}", "scene",
        scene, "agrees", r->agrees, "unread_cameras", (json_int_t)r->cameras, "triangles",
        (json_int_t)r->triangles, "polygons", (json_int_t)r->polygons, "normals",
        (json_int_t)r->normals, "lights", (json_int_t)r->lights, "unread_spheres",
        (json_int_t)r->spheres, "unread_rectangles", (json_int_t)r->rectangles,
        "unread_environments", (json_int_t)r->environments, "unread_normals",
        (json_int_t)r->unread_normals, "place_error", r->place_error, "normal_error",
        r->normal_error, "axis_error", r->axis_error, "angle_error", r->angle_error);
    if (!r->agrees)
        json_object_set_new(j, "what", json_string(r->what));
    return j;
}

bool import_check(const struct suite_scene *const *scene, int num, const struct import_options *opt,
                  json_t **reports, struct err *e)
{
    json_t *dumps;
    if (!import_check_run(scene, num, opt, &dumps, e))
        return false;
    *reports = json_array();
    for (int i = 0; i < num; i++) {
        struct scene s;
        struct camera c;
        struct import_report r;
        struct err why = {0};
        const json_t *dump = json_array_get(dumps, (size_t)i);
        const char *absent = json_string_value(json_object_get(dump, "absent"));
        json_t *report = NULL;
        if (absent != NULL)
            report = json_pack("{s:s, s:s}", "scene", scene[i]->name, "absent", absent);
        else if (suite_open(scene[i], &s, &c, &why)) {
            if (import_check_compare(&s, &c, dump, &r, &why))
                report = report_json(scene[i]->name, &r);
            scene_free(&s);
        }
        if (report == NULL)
            report = json_pack("{s:s, s:s}", "scene", scene[i]->name, "error", why.msg);
        json_array_append_new(*reports, report);
    }
    json_decref(dumps);
    return true;
}
