#include "collada_internal.h"

#include "renderer/base/fs.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Where the walk is: one per level, so that a node that contains itself is seen. */
struct place {
    const struct place *above;
    const xmlNode *node;
    mat4 to_world;
    int depth;
};

static bool read_asset(struct loader *ld, const xmlNode *root, mat4 *axes)
{
    xmlNode *asset, *unit, *up;
    *axes = mat4_identity();
    if (!element_one_child(ld, root, "asset", &asset))
        return false;
    if (asset == NULL)
        return true;
    if (!element_only_children(
            ld, asset,
            "contributor coverage created keywords modified revision subject title unit "
            "up_axis extra") ||
        !element_one_child(ld, asset, "unit", &unit) ||
        !element_one_child(ld, asset, "up_axis", &up))
        return false;
    const char *meter = unit != NULL ? element_attribute(unit, "meter") : NULL;
    if (meter != NULL && ld->dialect == DIALECT_COLLADA) {
        char *end;
        bool plain = meter[0] != '\0' && meter[strspn(meter, "0123456789+-.eE")] == '\0';
        ld->unit = strtod(meter, &end);
        if (!plain || *end != '\0' || !(ld->unit >= 1e-18 && ld->unit <= FARTHEST))
            return fail_at(ld, unit, "<unit>: meter=\"%.60s\" is not a positive number", meter);
    }
    if (up == NULL)
        return true;
    char *axis = text_read_word(ld, up);
    if (axis == NULL)
        return false;
    bool known = true;
    if (strcmp(axis, "X_UP") == 0)
        *axes = (mat4){{{0, 1, 0, 0}, {1, 0, 0, 0}, {0, 0, -1, 0}, {0, 0, 0, 1}}};
    else if (strcmp(axis, "Z_UP") == 0)
        *axes = (mat4){{{-1, 0, 0, 0}, {0, 0, 1, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}}};
    else
        known = strcmp(axis, "Y_UP") == 0 || fail_at(ld, up, "unknown <up_axis> '%.60s'", axis);
    free(axis);
    return known;
}

static bool read_matrix(struct loader *ld, const xmlNode *n, mat4 *out)
{
    double v[16];
    bool ok = ld->dialect == DIALECT_CGL ? text_read_up_to(ld, n, v, 16)
                                         : text_read_exactly(ld, n, v, 16);
    if (ok)
        memcpy(out->m, v, sizeof v);
    if (ok && ld->dialect == DIALECT_COLLADA && !mat4_is_affine(out))
        return fail_at(ld, n, "the last row of the <matrix> is not 0 0 0 1");
    return ok;
}

static bool read_lookat(struct loader *ld, const xmlNode *n, mat4 *out)
{
    double v[9];
    if (!text_read_exactly(ld, n, v, 9))
        return false;
    dvec3 eye = d3(v[0], v[1], v[2]), up = d3(v[6], v[7], v[8]);
    dvec3 backward = d3_sub(eye, d3(v[3], v[4], v[5]));
    bool ok = d3_normalize(&backward) && d3_normalize(&up);
    dvec3 right = d3_cross(up, backward);
    if (!ok || !(d3_length(right) > 1e-9) || !d3_normalize(&right))
        return fail_at(ld, n, "<lookat>: no direction, or up along it");
    *out = mat4_columns(right, d3_cross(backward, right), backward, eye);
    return true;
}

/* The element's matrix, which is the identity for what is no transform. */
static bool read_transform(struct loader *ld, const xmlNode *n, mat4 *out)
{
    double v[4];
    *out = mat4_identity();
    if (element_is(n, "matrix"))
        return read_matrix(ld, n, out);
    if (element_is(n, "lookat"))
        return read_lookat(ld, n, out);
    if (element_is(n, "skew"))
        return fail_at(ld, n, "<skew> is not supported");
    if (element_is(n, "translate")) {
        if (!text_read_exactly(ld, n, v, 3))
            return false;
        *out = mat4_translate(d3(v[0], v[1], v[2]));
        return true;
    }
    if (element_is(n, "scale")) {
        if (!text_read_exactly(ld, n, v, 3))
            return false;
        *out = mat4_scale(d3(v[0], v[1], v[2]));
        return true;
    }
    if (element_is(n, "rotate")) {
        if (!text_read_exactly(ld, n, v, 4))
            return false;
        dvec3 axis = d3(v[0], v[1], v[2]);
        if (!d3_normalize(&axis))
            return fail_at(ld, n, "<rotate> about an axis of no length");
        *out = mat4_rotate(axis, v[3] * (3.14159265358979323846 / 180));
        return true;
    }
    return true;
}

static const char *name_of(const xmlNode *node)
{
    const char *name = element_attribute(node, "name"), *id = element_attribute(node, "id");
    return name != NULL ? name : id != NULL ? id : "node";
}

static bool instance_geometry(struct loader *ld, const xmlNode *instance, const struct place *at)
{
    const xmlNode *geometry;
    const struct mesh *mesh;
    double sign;
    uint32_t material;
    size_t set;
    const char *name = name_of(at->node);
    if (!element_follow(ld, instance, "url", "geometry", &geometry) ||
        !build_transform_sign(ld, instance, &at->to_world, &sign) ||
        !geometry_get(ld, geometry, &mesh))
        return false;
    if (mesh->is_sphere)
        return material_get(ld, instance, geometry, NULL, NULL, &material, &set) &&
               build_begin_object(ld, name, NULL, material, false) &&
               build_add_sphere(ld, instance, &at->to_world, mesh->radius, mesh->normal_out);
    for (size_t g = 0; g < mesh->num_groups; g++) {
        const struct mesh_group *group = &mesh->groups[g];
        if (group->symbol == NULL && ld->dialect == DIALECT_COLLADA)
            return fail_at(ld, group->node, "<%s> without attribute 'material'",
                           (const char *)group->node->name);
        const char *suffix = mesh->num_groups > 1 ? group->symbol : NULL;
        if (!material_get(ld, instance, group->node, group->symbol, group, &material, &set) ||
            !build_begin_object(ld, name, suffix, material, false))
            return false;
        const bool uses_uv = material_has_map(&ld->scene.materials[material]);
        for (size_t t = group->first; t < group->first + group->count; t++) {
            const struct corner *c = mesh->corners + 3 * t;
            struct uv uv[3];
            for (int k = 0; uses_uv && k < 3; k++)
                uv[k] = mesh->uv[c[k].uv + set];
            if (!build_add_triangle(ld, instance, &at->to_world, sign, c, uses_uv ? uv : NULL))
                return false;
        }
    }
    return true;
}

static bool walk(struct loader *ld, const xmlNode *node, const struct place *above);

static bool instance_node(struct loader *ld, const xmlNode *instance, const struct place *at)
{
    const xmlNode *node;
    if (!element_only_children(ld, instance, "extra") ||
        !element_follow(ld, instance, "url", "node", &node))
        return false;
    for (const struct place *p = at; p != NULL; p = p->above)
        if (p->node == node)
            return fail_at(ld, instance, "<instance_node>: '%.60s' contains itself",
                           element_attribute(instance, "url"));
    return walk(ld, node, at);
}

static bool read_content(struct loader *ld, const xmlNode *c, const struct place *at)
{
    const xmlNode *target;
    if (element_is(c, "node"))
        return walk(ld, c, at);
    if (element_is(c, "instance_node"))
        return instance_node(ld, c, at);
    if (element_is(c, "instance_geometry"))
        return instance_geometry(ld, c, at);
    if (element_is(c, "instance_light"))
        return element_follow(ld, c, "url", "light", &target) &&
               light_instance(ld, c, target, name_of(at->node), &at->to_world);
    if (element_is(c, "instance_camera"))
        return element_follow(ld, c, "url", "camera", &target) &&
               camera_instance(ld, c, target, &at->to_world);
    if (element_is_one_of(c, "matrix lookat translate rotate scale asset extra"))
        return true;
    if (element_is(c, "instance_controller"))
        return fail_at(ld, c, "<instance_controller> is not supported");
    return element_fail_unexpected(ld, c);
}

static bool walk(struct loader *ld, const xmlNode *node, const struct place *above)
{
    struct place at = {above, node, above->to_world, above->depth + 1};
    if (at.depth > MAX_NODE_DEPTH)
        return fail_at(ld, node, "nodes nested deeper than %d", MAX_NODE_DEPTH);
    if (ld->num_nodes++ >= MAX_NODES)
        return fail_at(ld, node, "more than %d instances of nodes", MAX_NODES);
    for (const xmlNode *c = element_first_child(node); c != NULL; c = element_next_sibling(c)) {
        mat4 m;
        if (!read_transform(ld, c, &m))
            return false;
        at.to_world = mat4_mul(&at.to_world, &m);
    }
    for (const xmlNode *c = element_first_child(node); c != NULL; c = element_next_sibling(c))
        if (!read_content(ld, c, &at))
            return false;
    return true;
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
        "%u groups of lines are left out"};
    for (int i = 0; i < NUM_LEFT_OUT; i++) {
        char text[128];
        snprintf(text, sizeof text, LEFT_OUT[i], ld->num_left_out[i]);
        if (ld->num_left_out[i] > 0)
            add_note(ld, text);
    }
    if (ld->is_course_export)
        add_note(ld, "written by Blender 2.72 or 2.74, so read as a scene of CS184 (--dialect "
                     "collada: as any other file)");
    if (ld->num_specular > 0)
        add_note(ld, "specular terms are left out, as the assignment does");
}

/* What moves is counted, as a still image shows where it stands; other libraries may only be empty,
 * as exporters leave them. */
static bool check_libraries(struct loader *ld, const xmlNode *root)
{
    static const char MOVING[] =
        "library_animations library_animation_clips library_controllers library_formulas "
        "library_force_fields library_physics_materials library_physics_models "
        "library_physics_scenes library_joints library_kinematics_models "
        "library_kinematics_scenes library_articulated_systems";
    for (const xmlNode *c = element_first_child(root); c != NULL; c = element_next_sibling(c)) {
        if (element_is_one_of(c,
                              "asset scene extra library_cameras library_lights library_images "
                              "library_effects library_materials library_geometries library_nodes "
                              "library_visual_scenes"))
            continue;
        if (strncmp((const char *)c->name, "library_", 8) != 0)
            return element_fail_unexpected(ld, c);
        for (const xmlNode *item = element_first_child(c); item != NULL;
             item = element_next_sibling(item))
            if (element_is_one_of(item, "asset extra"))
                continue;
            else if (element_is_one_of(c, MOVING))
                ld->num_left_out[LEFT_OUT_MOVING]++;
            else
                return fail_at(ld, item, "<%.60s> in <%.60s> is not supported",
                               (const char *)item->name, (const char *)c->name);
    }
    return true;
}

static bool find_visual_scene(struct loader *ld, const xmlNode *root, const xmlNode **out)
{
    xmlNode *scene, *instance;
    if (!element_one_child(ld, root, "scene", &scene))
        return false;
    if (scene == NULL)
        return fail_at(ld, root, "no <scene>");
    if (!element_only_children(ld, scene,
                               "instance_visual_scene instance_physics_scene "
                               "instance_kinematics_scene extra") ||
        !element_one_child(ld, scene, "instance_visual_scene", &instance))
        return false;
    if (instance == NULL)
        return fail_at(ld, scene, "<scene> without <instance_visual_scene>");
    return element_only_children(ld, instance, "extra") &&
           element_follow(ld, instance, "url", "visual_scene", out);
}

static bool read_scene(struct loader *ld)
{
    const xmlNode *root = xmlDocGetRootElement(ld->doc);
    const xmlNode *visual;
    mat4 axes;
    if (!check_libraries(ld, root) || !read_asset(ld, root, &axes) ||
        !find_visual_scene(ld, root, &visual) ||
        !element_only_children(ld, visual, "asset node extra"))
        return false;
    mat4 unit = mat4_scale(d3(ld->unit, ld->unit, ld->unit));
    struct place top = {NULL, NULL, mat4_mul(&axes, &unit), 0};
    for (const xmlNode *c = element_first_child(visual); c != NULL; c = element_next_sibling(c))
        if (element_is(c, "node") && !walk(ld, c, &top))
            return false;
    if (!light_finish(ld))
        return false;
    if (scene_num_primitives(&ld->scene) == 0)
        return fail_at(ld, visual, "nothing to render: no triangles, no spheres");
    ld->scene.dialect = ld->dialect;
    write_notes(ld);
    if (ld->dialect == DIALECT_COLLADA)
        return scene_finish(&ld->scene, ld->path, ld->err);
    if (!ld->scene.camera.present)
        camera_default(ld);
    /* The assignment frames its objects, among them a mesh that gives way to its lamp. */
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

static bool load(struct text_input *in, const char *path, enum dialect dialect, struct scene *out,
                 struct err *e)
{
    struct loader ld = {.path = path, .err = e, .dialect = dialect, .unit = 1};
    bool ok = xml_open(&ld, in) && read_scene(&ld);
    if (ok)
        *out = ld.scene;
    else
        scene_free(&ld.scene);
    for (size_t i = 0; i < ld.num_meshes; i++)
        mesh_release(&ld.meshes[i]);
    free(ld.meshes);
    free(ld.slots);
    free(ld.is_lamp);
    free(ld.ids);
    xmlFreeDoc(ld.doc);
    return ok;
}

bool collada_parse(const char *text, size_t size, const char *path, enum dialect dialect,
                   struct scene *out, struct err *e)
{
    struct text_input in = {.text = text, .size = size};
    return load(&in, path, dialect, out, e);
}

/* What people try first, by its ending. */
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
    struct text_input in = {.file = fs_open(path)};
    if (in.file == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    if (is_other_format(path)) {
        fclose(in.file);
        return err_set(e, "%s: only COLLADA (.dae) is read", path);
    }
    bool ok = load(&in, path, dialect, out, e);
    fclose(in.file);
    return ok;
}
