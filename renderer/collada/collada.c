#include "collada_internal.h"

#include "renderer/base/fs.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* What coordinates mean: of a document, or of an element with an <asset> of its own. */
struct frame {
    const xmlDoc *doc;
    double unit; /* metres */
    int up;      /* index into AXES */
};

/* Where the walk is: one per level, so that a node that contains itself is seen. */
struct place {
    const struct place *above;
    const xmlNode *node;
    struct frame frame;
    mat4 to_world;
    int depth;
};

/* To Y_UP, by the table of the specification. */
static const struct axes {
    const char *name;
    double m[3][3];
} AXES[] = {{"Y_UP", {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
            {"X_UP", {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}},
            {"Z_UP", {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}}};

/* The element's own <asset>, on top of what is in *f. */
static bool read_asset(struct loader *ld, const xmlNode *element, struct frame *f)
{
    xmlNode *asset, *unit, *up;
    if (!element_one_child(ld, element, "asset", &asset))
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
        f->unit = strtod(meter, &end);
        if (!plain || *end != '\0' || !(f->unit >= 1e-18 && f->unit <= FARTHEST))
            return fail_at(ld, unit, "<unit>: meter=\"%.60s\" is not a positive number", meter);
    }
    if (up == NULL)
        return true;
    if (element_is_one_of(element, "light library_lights"))
        return fail_at(ld, up, "<up_axis> of a <%s> is not supported", (const char *)element->name);
    char *axis = text_read_word(ld, up);
    if (axis == NULL)
        return false;
    int i = 2;
    while (i >= 0 && strcmp(axis, AXES[i].name) != 0)
        i--;
    bool known = i >= 0 || fail_at(ld, up, "unknown <up_axis> '%.60s'", axis);
    f->up = i;
    free(axis);
    return known;
}

/* Takes coordinates from one frame to another, lengths times `size`. */
static mat4 change_axes(int from, int to, double size)
{
    mat4 m = mat4_identity();
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            m.m[i][j] = 0;
            for (int k = 0; k < 3; k++)
                m.m[i][j] += AXES[to].m[k][i] * AXES[from].m[k][j] * size;
        }
    return m;
}

/* From the frame outside to that of an element; *change takes coordinates from there to outside. */
static bool enter(struct loader *ld, const xmlNode *element, const struct frame *outside,
                  struct frame *inside, mat4 *change)
{
    *inside = *outside;
    if (element->doc != outside->doc) {
        *inside = (struct frame){.doc = element->doc, .unit = 1};
        if (!read_asset(ld, xmlDocGetRootElement(element->doc), inside))
            return false;
    }
    bool is_in_library = strncmp((const char *)element->parent->name, "library_", 8) == 0;
    if ((is_in_library && !read_asset(ld, element->parent, inside)) ||
        !read_asset(ld, element, inside))
        return false;
    *change = change_axes(inside->up, outside->up, inside->unit / outside->unit);
    return true;
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

/* Points move along the second axis by the tangent of the angle times how far they are along the
 * first. */
static bool read_skew(struct loader *ld, const xmlNode *n, mat4 *out)
{
    double v[7];
    if (!text_read_exactly(ld, n, v, 7))
        return false;
    dvec3 from = d3(v[1], v[2], v[3]), along = d3(v[4], v[5], v[6]);
    if (!d3_normalize(&from) || !d3_normalize(&along))
        return fail_at(ld, n, "<skew> by an axis of no length");
    along = d3_scale(along, tan(v[0] * (3.14159265358979323846 / 180)));
    const mat4 shift = mat4_columns(d3_scale(along, from.x), d3_scale(along, from.y),
                                    d3_scale(along, from.z), d3(0, 0, 0));
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out->m[i][j] += shift.m[i][j];
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
        return read_skew(ld, n, out);
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
    struct frame inside;
    mat4 change;
    double sign;
    uint32_t material;
    size_t set;
    const char *name = name_of(at->node);
    if (!reference_follow(ld, instance, "url", "geometry", &geometry) ||
        !enter(ld, geometry, &at->frame, &inside, &change) || !geometry_get(ld, geometry, &mesh))
        return false;
    const mat4 to_world = mat4_mul(&at->to_world, &change);
    if (!build_transform_sign(ld, instance, &to_world, &sign))
        return false;
    if (mesh->is_sphere)
        return material_get(ld, instance, geometry, NULL, NULL, &material, &set) &&
               (material == NO_SURFACE ||
                (build_begin_object(ld, name, NULL, material, false) &&
                 build_add_sphere(ld, instance, &to_world, mesh->radius, mesh->normal_out)));
    for (size_t g = 0; g < mesh->num_groups; g++) {
        const struct mesh_group *group = &mesh->groups[g];
        const char *suffix = mesh->num_groups > 1 ? group->symbol : NULL;
        if (!material_get(ld, instance, group->node, group->symbol, group, &material, &set))
            return false;
        if (material == NO_SURFACE)
            continue;
        if (!build_begin_object(ld, name, suffix, material, false))
            return false;
        const bool uses_uv = material_has_map(&ld->scene.materials[material]);
        for (size_t t = group->first; t < group->first + group->count; t++) {
            const struct corner *c = mesh->corners + 3 * t;
            struct uv uv[3];
            for (int k = 0; uses_uv && k < 3; k++)
                uv[k] = mesh->uv[c[k].uv + set];
            if (!build_add_triangle(ld, instance, &to_world, sign, c, uses_uv ? uv : NULL))
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
        !reference_follow(ld, instance, "url", "node", &node))
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
    struct frame inside;
    mat4 change;
    if (element_is(c, "node"))
        return walk(ld, c, at);
    if (element_is(c, "instance_node"))
        return instance_node(ld, c, at);
    if (element_is(c, "instance_geometry"))
        return instance_geometry(ld, c, at);
    bool is_light = element_is(c, "instance_light");
    if (is_light || element_is(c, "instance_camera")) {
        if (!reference_follow(ld, c, "url", is_light ? "light" : "camera", &target) ||
            !enter(ld, target, &at->frame, &inside, &change))
            return false;
        ld->unit = inside.unit;
        if (is_light)
            return light_instance(ld, c, target, name_of(at->node), &at->to_world);
        /* A camera's own axes turn it as they would turn what it sees. */
        struct frame home = target->doc == at->frame.doc ? at->frame : (struct frame){.unit = 1};
        if (target->doc != at->frame.doc &&
            !read_asset(ld, xmlDocGetRootElement(target->doc), &home))
            return false;
        change = change_axes(home.up, inside.up, 1);
        const mat4 to_world = mat4_mul(&at->to_world, &change);
        return camera_instance(ld, c, target, name_of(at->node), &to_world);
    }
    if (element_is_one_of(c, "matrix lookat translate rotate scale skew asset extra"))
        return true;
    if (element_is(c, "instance_controller"))
        return fail_at(ld, c, "<instance_controller>: skins and morphs are not supported");
    return element_fail_unexpected(ld, c);
}

static bool walk(struct loader *ld, const xmlNode *node, const struct place *above)
{
    struct place at = {.above = above, .node = node, .depth = above->depth + 1};
    mat4 m;
    if (at.depth > MAX_NODE_DEPTH)
        return fail_at(ld, node, "nodes nested deeper than %d", MAX_NODE_DEPTH);
    if (ld->num_nodes++ >= MAX_NODES)
        return fail_at(ld, node, "more than %d instances of nodes", MAX_NODES);
    if (!enter(ld, node, &above->frame, &at.frame, &m))
        return false;
    at.to_world = mat4_mul(&above->to_world, &m);
    for (const xmlNode *c = element_first_child(node); c != NULL; c = element_next_sibling(c)) {
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
        "%u groups of lines are left out",
        "%u surfaces are wholly transparent, so left out",
        "%u surfaces without material are grey (0.8)",
        "%u materials, which reflect more than all light together, are darkened",
        "%u polygons cross themselves, so are cut from their first corner",
        "%u lights of Blender have no radius here: set theirs to 0, or give an area light",
        "%u spots of Blender have a sharp edge here: set their blend to 0",
        "%u upright cameras of Blender: right if its sensor fit is horizontal"};
    for (int i = 0; i < NUM_LEFT_OUT; i++) {
        char text[128];
        snprintf(text, sizeof text, LEFT_OUT[i], ld->num_left_out[i]);
        if (ld->num_left_out[i] > 0)
            add_note(ld, text);
    }
    if (ld->scene.num_cameras > 1 && ld->dialect == DIALECT_COLLADA) {
        char text[160];
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

/* Of a file that shows none: its only one, NULL if there is none. */
static bool find_only_visual_scene(struct loader *ld, const xmlNode *root, const xmlNode **out)
{
    *out = NULL;
    for (const xmlNode *c = element_first_child(root); c != NULL; c = element_next_sibling(c))
        for (const xmlNode *v = element_is(c, "library_visual_scenes") ? element_first_child(c)
                                                                       : NULL;
             v != NULL; v = element_next_sibling(v)) {
            if (!element_is(v, "visual_scene"))
                continue;
            if (*out != NULL)
                return fail_at(ld, root, "no <scene>, and more than one <visual_scene>");
            *out = v;
        }
    return true;
}

static bool find_visual_scene(struct loader *ld, const xmlNode *root, const xmlNode **out)
{
    xmlNode *scene, *instance;
    if (!element_one_child(ld, root, "scene", &scene))
        return false;
    if (scene == NULL)
        return find_only_visual_scene(ld, root, out);
    if (!element_only_children(ld, scene,
                               "instance_visual_scene instance_physics_scene "
                               "instance_kinematics_scene extra") ||
        !element_one_child(ld, scene, "instance_visual_scene", &instance))
        return false;
    if (instance == NULL)
        return fail_at(ld, scene, "<scene> without <instance_visual_scene>");
    return element_only_children(ld, instance, "extra") &&
           reference_follow(ld, instance, "url", "visual_scene", out);
}

static bool read_scene(struct loader *ld, const xmlNode *root)
{
    const xmlNode *visual;
    const struct frame world = {.unit = 1};
    struct place top = {.depth = 0};
    if (!check_libraries(ld, root) || !find_visual_scene(ld, root, &visual))
        return false;
    if (visual != NULL && (!element_only_children(ld, visual, "asset node extra") ||
                           !enter(ld, visual, &world, &top.frame, &top.to_world)))
        return false;
    /* Other documents than those of Y_UP are turned, too, as the assignment turns them. */
    if (top.frame.up != 0)
        for (int j = 0; j < 3; j++) {
            top.to_world.m[0][j] = -top.to_world.m[0][j];
            top.to_world.m[2][j] = -top.to_world.m[2][j];
        }
    for (const xmlNode *c = visual != NULL ? element_first_child(visual) : NULL; c != NULL;
         c = element_next_sibling(c))
        if (element_is(c, "node") && !walk(ld, c, &top))
            return false;
    if (!light_finish(ld))
        return false;
    if (scene_num_primitives(&ld->scene) == 0)
        add_note(ld, visual == NULL ? "nothing to see: no <scene>"
                                    : "nothing to see: no triangles, no spheres");
    else if (element_child_named(root, "scene") == NULL)
        add_note(ld, "no <scene>: the only <visual_scene> is shown");
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

/* Gives the scene the paths of all documents but its own. */
static bool name_documents(struct loader *ld)
{
    struct scene *s = &ld->scene;
    s->documents = malloc(ld->num_documents * sizeof *s->documents);
    if (s->documents == NULL)
        return fail_memory(ld);
    for (size_t i = 1; i < ld->num_documents; i++) {
        s->documents[s->num_documents++] = ld->documents[i]->path;
        ld->documents[i]->path = NULL;
    }
    return true;
}

static bool load(struct text_input *in, const char *path, enum dialect dialect, struct scene *out,
                 struct err *e)
{
    struct loader ld = {.path = path, .err = e, .dialect = dialect};
    struct document *d;
    bool ok = xml_open(&ld, path, in, &d) && read_scene(&ld, xmlDocGetRootElement(d->doc)) &&
              name_documents(&ld);
    if (ok)
        *out = ld.scene;
    else
        scene_free(&ld.scene);
    for (size_t i = 0; i < ld.num_meshes; i++)
        mesh_release(&ld.meshes[i]);
    for (size_t i = 0; i < ld.num_documents; i++) {
        xmlFreeDoc(ld.documents[i]->doc);
        free(ld.documents[i]->ids);
        free(ld.documents[i]->path);
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
