#include "collada_internal.h"

#include "renderer/base/fs.h"
#include "renderer/base/number.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* The meaning of coordinates in a document, or in an element with an <asset> of its own. */
struct frame {
    const xmlDoc *doc;
    double unit; /* metres */
    int up;      /* index into AXES */
};

/* Position of the walk over the nodes: one per level, so that a node that contains itself is detected. */
struct place {
    const struct place *above;
    const xmlNode *node;
    struct frame frame;
    mat4 to_world;
    int depth;
};

/* Rotations to Y_UP, from the table in the specification. */
static const char AXIS_NAMES[] = "Y_UP X_UP Z_UP";
static const double AXES[][3][3] = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                    {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}},
                                    {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}};

/* Updates *f by the element's own <asset>, if it has one. */
static void read_asset(struct loader *ld, const xmlNode *element, struct frame *f)
{
    const xmlNode *asset = element_first(element); /* an <asset> is first: survey_element() */
    if (!element_is(asset, "asset"))
        return;
    const xmlNode *unit = element_child(asset, "unit"), *up = element_child(asset, "up_axis");
    const char *meter = element_attribute(unit, "meter"), *end = meter;
    element_check(ld, asset,
                  "contributor* coverage? created* keywords* modified* revision* subject* title* "
                  "unit? up_axis? extra*");
    if (meter != NULL && ld->dialect == DIALECT_COLLADA &&
        !(number_parse(meter, &end, &f->unit) && *end == '\0' && f->unit >= 1e-18 &&
          f->unit <= FARTHEST))
        fail_at(ld, unit, "<unit>: meter=\"%.60s\" is not a positive number", meter);
    if (up != NULL && element_is_one_of(element, "light library_lights"))
        fail_at(ld, up, "<up_axis> of a <%s> is not supported", (const char *)element->name);
    f->up = field_choice(ld, asset, "up_axis", AXIS_NAMES, f->up);
}

/* The matrix that takes coordinates from one up axis to another and scales lengths by `size`. */
static mat4 change_axes(int from, int to, double size)
{
    mat4 m = mat4_identity();
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            m.m[i][j] = 0;
            for (int k = 0; k < 3; k++)
                m.m[i][j] += AXES[to][k][i] * AXES[from][k][j] * size;
        }
    return m;
}

/* The coordinate frame (unit and up axis) of the document that holds `element`, which is referenced
 * from frame `outside`: the same frame in the same document, else that of the other document's
 * <asset>. enter() adds the <asset>s of the element and of its library. */
static struct frame home_of(struct loader *ld, const xmlNode *element, const struct frame *outside)
{
    struct frame home = {.doc = element->doc, .unit = 1};
    if (element->doc == outside->doc)
        return *outside;
    read_asset(ld, xmlDocGetRootElement(element->doc), &home);
    return home;
}

/* Sets *inside to the frame of an element in the frame `outside`; returns the matrix from inside to outside. */
static mat4 enter(struct loader *ld, const xmlNode *element, const struct frame *outside,
                  struct frame *inside)
{
    *inside = *outside;
    if (element != NULL) {
        *inside = home_of(ld, element, outside);
        if (strncmp((const char *)element->parent->name, "library_", 8) == 0)
            read_asset(ld, element->parent, inside);
        read_asset(ld, element, inside);
    }
    return change_axes(inside->up, outside->up, inside->unit / outside->unit);
}

static mat4 make_lookat(struct loader *ld, const xmlNode *n, const double *v)
{
    dvec3 eye = d3(v[0], v[1], v[2]), up = d3(v[6], v[7], v[8]);
    dvec3 backward = d3_sub(eye, d3(v[3], v[4], v[5]));
    bool ok = d3_normalize(&backward) && d3_normalize(&up);
    dvec3 right = d3_cross(up, backward);
    if (!ok || !(d3_length(right) > 1e-9) || !d3_normalize(&right))
        fail_at(ld, n, "<lookat>: no direction, or up along it");
    return mat4_columns(right, d3_cross(backward, right), backward, eye);
}

/* Points move along the second axis by the tangent of the angle times their coordinate along the
 * first. */
static mat4 make_skew(struct loader *ld, const xmlNode *n, const double *v)
{
    dvec3 from = d3(v[1], v[2], v[3]), along = d3(v[4], v[5], v[6]);
    if (!d3_normalize(&from) || !d3_normalize(&along))
        fail_at(ld, n, "<skew> by an axis of no length");
    along = d3_scale(along, tan(v[0] * DEGREE));
    mat4 m = mat4_columns(d3_scale(along, from.x), d3_scale(along, from.y), d3_scale(along, from.z),
                          d3(0, 0, 0));
    for (int i = 0; i < 3; i++)
        m.m[i][i] += 1;
    return m;
}

static mat4 make_rotate(struct loader *ld, const xmlNode *n, const double *v)
{
    dvec3 axis = d3(v[0], v[1], v[2]);
    if (!d3_normalize(&axis))
        fail_at(ld, n, "<rotate> about an axis of no length");
    return mat4_rotate(axis, v[3] * DEGREE);
}

static mat4 make_matrix(struct loader *ld, const xmlNode *n, const double *v)
{
    mat4 m;
    memcpy(m.m, v, sizeof m.m);
    if (ld->dialect == DIALECT_COLLADA && !mat4_is_affine(&m))
        fail_at(ld, n, "the last row of the <matrix> is not 0 0 0 1");
    return m;
}

/* The element's matrix; the identity if it is not a transform. */
static mat4 read_transform(struct loader *ld, const xmlNode *n)
{
    enum { LOOKAT, MATRIX, ROTATE, SCALE, SKEW, TRANSLATE };
    static const size_t COUNT[] = {9, 16, 4, 3, 7, 3}; /* of numbers */
    int kind =
        element_place_among((const char *)n->name, "lookat matrix rotate scale skew translate");
    double v[16];
    if (kind >= 0)
        text_read_numbers(ld, n, v, kind == MATRIX && ld->dialect == DIALECT_CGL ? 1 : COUNT[kind],
                          COUNT[kind]);
    switch (ld->failed ? -1 : kind) {
    case LOOKAT: return make_lookat(ld, n, v);
    case MATRIX: return make_matrix(ld, n, v);
    case ROTATE: return make_rotate(ld, n, v);
    case SCALE: return mat4_scale(d3(v[0], v[1], v[2]));
    case SKEW: return make_skew(ld, n, v);
    case TRANSLATE: return mat4_translate(d3(v[0], v[1], v[2]));
    default: return mat4_identity();
    }
}

static const char *name_of(const xmlNode *node)
{
    const char *name = element_attribute(node, "name"), *id = element_attribute(node, "id");
    return name != NULL ? name : id != NULL ? id : "node";
}

/* Adds the triangles of a mesh group, transformed, as an object. */
static void add_group(struct loader *ld, const xmlNode *instance, const struct mesh *mesh,
                      const struct mesh_group *group, const mat4 *to_world, const char *name)
{
    size_t set;
    double sign = build_transform_sign(ld, instance, to_world);
    uint32_t material = material_get(ld, instance, group->node, group->symbol, group, &set);
    if (material == NO_SURFACE)
        return;
    build_begin_object(ld, name, mesh->num_groups > 1 ? group->symbol : NULL, material, false);
    const bool uses_uv = !ld->failed && material_has_map(&ld->scene.materials[material]);
    for (size_t t = group->first; t < group->first + group->count && !ld->failed; t++) {
        const struct corner *c = mesh->corners + 3 * t;
        struct uv uv[3];
        for (int k = 0; uses_uv && k < 3; k++)
            uv[k] = mesh->uv[c[k].uv + set];
        build_add_triangle(ld, instance, to_world, sign, c, uses_uv ? uv : NULL);
    }
}

static void instance_geometry(struct loader *ld, const xmlNode *instance, const struct place *at)
{
    size_t set;
    struct frame inside;
    const char *name = name_of(at->node);
    const xmlNode *geometry = reference_follow(ld, instance, "url", "geometry");
    const mat4 change = enter(ld, geometry, &at->frame, &inside),
               to_world = mat4_mul(&at->to_world, &change);
    const struct mesh *mesh = mesh_of_geometry(ld, geometry);
    if (ld->failed)
        return;
    if (mesh->is_sphere) {
        build_transform_sign(ld, instance, &to_world);
        uint32_t material = material_get(ld, instance, geometry, NULL, NULL, &set);
        if (material == NO_SURFACE)
            return;
        build_begin_object(ld, name, NULL, material, false);
        build_add_sphere(ld, instance, &to_world, mesh->radius, mesh->normal_out);
    }
    for (size_t g = 0; g < mesh->num_groups && !ld->failed; g++)
        add_group(ld, instance, mesh, &mesh->groups[g], &to_world, name);
}

static void walk(struct loader *ld, const xmlNode *node, const struct place *above);

static void instance_node(struct loader *ld, const xmlNode *instance, const struct place *at)
{
    element_check(ld, instance, "extra*");
    const xmlNode *node = reference_follow(ld, instance, "url", "node");
    for (const struct place *p = at; p != NULL; p = p->above)
        if (p->node == node)
            fail_at(ld, instance, "<instance_node>: '%.60s' contains itself",
                    element_attribute(instance, "url"));
    if (!ld->failed)
        walk(ld, node, at);
}

/* Adds an <instance_light> or <instance_camera>. */
static void instance_light_or_camera(struct loader *ld, const xmlNode *c, const struct place *at)
{
    bool is_light = element_is(c, "instance_light");
    struct frame inside;
    const xmlNode *target = reference_follow(ld, c, "url", is_light ? "light" : "camera");
    enter(ld, target, &at->frame, &inside);
    if (ld->failed)
        return;
    ld->unit = inside.unit;
    if (is_light) {
        light_instance(ld, c, target, name_of(at->node), &at->to_world);
        return;
    }
    /* A camera's own axes turn it as they would turn what it sees. */
    const struct frame home = home_of(ld, target, &at->frame);
    const mat4 change = change_axes(home.up, inside.up, 1),
               to_world = mat4_mul(&at->to_world, &change);
    camera_instance(ld, c, target, name_of(at->node), &to_world);
}

static void walk(struct loader *ld, const xmlNode *node, const struct place *above)
{
    struct place at = {.above = above, .node = node, .depth = above->depth + 1};
    if (at.depth > MAX_NODE_DEPTH)
        fail_at(ld, node, "nodes nested deeper than %d", MAX_NODE_DEPTH);
    if (ld->num_nodes++ >= MAX_NODES)
        fail_at(ld, node, "more than %d instances of nodes", MAX_NODES);
    element_check(ld, node,
                  "asset? lookat* matrix* rotate* scale* skew* translate* instance_camera* "
                  "instance_geometry* instance_light* instance_node* node* extra*");
    mat4 m = enter(ld, node, &above->frame, &at.frame);
    at.to_world = mat4_mul(&above->to_world, &m);
    for (const xmlNode *c = element_first(node); c != NULL; c = element_next(c)) {
        m = read_transform(ld, c);
        at.to_world = mat4_mul(&at.to_world, &m);
    }
    for (const xmlNode *c = element_first(node); c != NULL && !ld->failed; c = element_next(c)) {
        if (element_is(c, "node"))
            walk(ld, c, &at);
        else if (element_is(c, "instance_node"))
            instance_node(ld, c, &at);
        else if (element_is(c, "instance_geometry"))
            instance_geometry(ld, c, &at);
        else if (element_is_one_of(c, "instance_light instance_camera"))
            instance_light_or_camera(ld, c, &at);
    }
}

/* Adds a sentence to the scene's note. */
static void add_note(struct loader *ld, const char *text)
{
    char *note = ld->scene.note;
    size_t n = strlen(note);
    snprintf(note + n, sizeof ld->scene.note - n, "%s%s", n > 0 ? "; " : "", text);
}

static void write_notes(struct loader *ld)
{
    static const char *const LEFT_OUT[NUM_LEFT_OUT] = {
        "%u animations, controllers or bodies are left out: a still image shows where things stand",
        "%u groups of lines are left out",
        "%u surfaces are wholly transparent, so left out",
        "%u surfaces without material are grey (0.8)",
        "%u materials, which reflect more than all light together, are darkened",
        "%u polygons cross themselves, so are cut from their first corner",
        "%u lights of Blender have no radius here: set theirs to 0, or give an area light",
        "%u spots of Blender have a sharp edge here: set their blend to 0",
        "%u upright cameras of Blender: right if its sensor fit is horizontal"};
    char text[160];
    for (int i = 0; i < NUM_LEFT_OUT; i++) {
        snprintf(text, sizeof text, LEFT_OUT[i], ld->num_left_out[i]);
        if (ld->num_left_out[i] > 0)
            add_note(ld, text);
    }
    if (ld->scene.num_cameras > 1 && ld->dialect == DIALECT_COLLADA) {
        snprintf(text, sizeof text, "the first of %u cameras, '%s' (--list-cameras, --camera NAME)",
                 ld->scene.num_cameras, ld->scene.camera.name);
        add_note(ld, text);
    }
    if (ld->is_course_export)
        add_note(ld, "written by Blender 2.72 or 2.74, so read as a scene of CS184 (--dialect "
                     "collada: as any other file)");
    if (ld->num_specular > 0)
        add_note(ld, "specular terms are left out, as the assignment does");
}

/* Counts what is animated, which a still image shows in its rest position. Any other library must be
 * empty, as exporters leave them. */
static void check_libraries(struct loader *ld, const xmlNode *root)
{
    static const char SHOWN[] = "asset scene extra library_cameras library_lights library_images "
                                "library_effects library_materials library_geometries "
                                "library_nodes library_visual_scenes";
    static const char MOVING[] =
        "library_animations library_animation_clips library_controllers library_formulas "
        "library_force_fields library_physics_materials library_physics_models "
        "library_physics_scenes library_joints library_kinematics_models "
        "library_kinematics_scenes library_articulated_systems";
    for (const xmlNode *c = element_first(root); c != NULL; c = element_next(c)) {
        if (element_is_one_of(c, SHOWN))
            continue;
        if (strncmp((const char *)c->name, "library_", 8) != 0)
            element_fail_unexpected(ld, c);
        if (!element_is_one_of(c, MOVING))
            element_check(ld, c, "asset? extra*");
        for (const xmlNode *i = element_first(c); i != NULL; i = element_next(i))
            ld->num_left_out[LEFT_OUT_MOVING] += !element_is_one_of(i, "asset extra");
    }
}

/* For a file without <scene>: its only <visual_scene>, NULL if it has none. Fails if it has several. */
static const xmlNode *find_only_visual_scene(struct loader *ld, const xmlNode *root)
{
    const xmlNode *only = NULL;
    for (const xmlNode *c = element_first(root); c != NULL; c = element_next(c)) {
        const xmlNode *v = element_is(c, "library_visual_scenes") ? element_first(c) : NULL;
        for (; v != NULL; v = element_next(v)) {
            if (!element_is(v, "visual_scene"))
                continue;
            if (only != NULL)
                fail_at(ld, root, "no <scene>, and more than one <visual_scene>");
            only = v;
        }
    }
    return only;
}

static const xmlNode *find_visual_scene(struct loader *ld, const xmlNode *root)
{
    element_check(ld, root, "scene? *");
    const xmlNode *scene = element_child(root, "scene"),
                  *instance = element_child(scene, "instance_visual_scene");
    if (scene == NULL)
        return find_only_visual_scene(ld, root);
    element_check(ld, scene,
                  "instance_visual_scene instance_physics_scene* instance_kinematics_scene? "
                  "extra*");
    element_check(ld, instance, "extra*");
    return reference_follow(ld, instance, "url", "visual_scene");
}

static bool read_scene(struct loader *ld, const xmlNode *root)
{
    const struct frame world = {.unit = 1};
    struct place top = {.depth = 0};
    check_libraries(ld, root);
    const xmlNode *visual = find_visual_scene(ld, root);
    element_check(ld, visual, "asset? node* extra*");
    top.to_world = enter(ld, visual, &world, &top.frame);
    /* A document that is not Y_UP is also turned by 180 degrees about y, as in the assignment. */
    if (top.frame.up != 0)
        for (int j = 0; j < 3; j++) {
            top.to_world.m[0][j] = -top.to_world.m[0][j];
            top.to_world.m[2][j] = -top.to_world.m[2][j];
        }
    for (const xmlNode *c = element_first(visual); c != NULL && !ld->failed; c = element_next(c))
        if (element_is(c, "node"))
            walk(ld, c, &top);
    light_finish(ld);
    if (ld->failed)
        return false;
    if (scene_num_primitives(&ld->scene) == 0)
        add_note(ld, visual == NULL ? "nothing to see: no <scene>"
                                    : "nothing to see: no triangles, no spheres");
    else if (element_child(root, "scene") == NULL)
        add_note(ld, "no <scene>: the only <visual_scene> is shown");
    ld->scene.dialect = ld->dialect;
    write_notes(ld);
    if (ld->dialect == DIALECT_COLLADA)
        return scene_finish(&ld->scene, ld->path, ld->err);
    if (!ld->scene.camera.present)
        camera_default(ld);
    /* The assignment frames all its objects, including a mesh that is dropped below for its area light. */
    vec3 lo, hi;
    bool has_frame = build_find_bounds(ld, false, &lo, &hi);
    build_drop_twin_lamps(ld);
    if (!scene_finish(&ld->scene, ld->path, ld->err))
        return false;
    if (has_frame) {
        ld->scene.frame_min = lo;
        ld->scene.frame_max = hi;
    }
    return true;
}

/* Loads the open file, of that path or of a text in memory, and closes it. */
static bool load(FILE *file, bool is_file, const char *path, enum dialect dialect,
                 struct scene *out, struct err *e)
{
    struct loader ld = {.path = path, .err = e, .dialect = dialect};
    const struct document *d = xml_open(&ld, path, file, is_file);
    bool ok = d != NULL && read_scene(&ld, xmlDocGetRootElement(d->doc));
    fclose(file);
    if (ok)
        *out = ld.scene;
    else
        scene_free(&ld.scene);
    for (size_t i = 0; i < ld.num_meshes; i++)
        mesh_release(&ld.meshes[i]);
    for (size_t i = 0; i < ld.num_documents; i++) {
        xmlFreeDoc(ld.documents[i]->doc);
        xmlHashFree(ld.documents[i]->ids, NULL);
        free(ld.documents[i]);
    }
    free(ld.documents);
    free(ld.meshes);
    free(ld.slots);
    free(ld.is_lamp);
    return ok;
}

bool collada_parse(const char *text, size_t size, const char *path, enum dialect dialect,
                   struct scene *out, struct err *e)
{
    FILE *file = fmemopen((char *)text, size, "r");
    return file != NULL ? load(file, false, path, dialect, out, e)
                        : err_set(e, "%s: out of memory", path);
}

/* Formats that people try first, told by the ending of the name. */
static bool is_other_format(const char *path)
{
    static const char *const ENDINGS[] = {".obj",  ".gltf", ".glb", ".usd", ".usda",
                                          ".usdc", ".usdz", ".fbx", ".ply", ".blend",
                                          ".stl",  ".pbrt", ".pov"};
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot != NULL && i < sizeof ENDINGS / sizeof *ENDINGS; i++)
        if (strcasecmp(dot, ENDINGS[i]) == 0)
            return true;
    return false;
}

bool collada_load(const char *path, enum dialect dialect, struct scene *out, struct err *e)
{
    FILE *file = fs_open(path);
    if (file == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    if (!is_other_format(path))
        return load(file, true, path, dialect, out, e);
    fclose(file);
    return err_set(e, "%s: only COLLADA (.dae) is read", path);
}
