/* Our loader against Blender's importer: the comparison itself, on a scene made here and all that it has to
 * find; and then with Blender, where there is one. */
#include "reference/import_check/import_check.h"
#include "reference/base/process.h"
#include "tools/validate/import_result.h"
#include "tests/support/build_scene.h"
#include "tests/support/test.h"

struct fixture {
    struct scene s;
    struct camera c;
    char axis; /* of the file that Blender is said to have read */
    json_t *dump;
};

/* What Blender has where we have p: the file's axes by renderer/docs/dialect.md, then turned to Z up as Blender's
 * manual says (Y_UP: about x by 90 degrees; X_UP: about y by -90 degrees). */
static json_t *blender(const struct fixture *f, vec3 p)
{
    double x = (double)p.x, y = (double)p.y, z = (double)p.z;
    switch (f->axis) {
    case 'Z': return json_pack("[f,f,f]", -x, z, y);
    case 'X': return json_pack("[f,f,f]", z, x, y);
    default: return json_pack("[f,f,f]", x, -z, y);
    }
}

/* A polygon of n corners, with one normal, added to the first mesh of the dump. */
static void add_polygon(struct fixture *f, int n, const vec3 *p, vec3 normal)
{
    json_t *mesh = json_array_get(json_object_get(f->dump, "meshes"), 0);
    json_array_append_new(json_object_get(mesh, "sizes"), json_integer(n));
    for (int i = 0; i < n; i++) {
        json_t *corner = blender(f, p[i]), *direction = blender(f, normal);
        json_array_extend(json_object_get(mesh, "corners"), corner);
        json_array_extend(json_object_get(mesh, "normals"), direction);
        json_decref(corner);
        json_decref(direction);
    }
}

static void add_light(struct fixture *f, const char *kind, vec3 position, vec3 direction)
{
    json_array_append_new(json_object_get(f->dump, "lights"),
                          json_pack("{s:s, s:s, s:o, s:o}", "name", "a light", "kind", kind,
                                    "position", blender(f, position), "direction",
                                    blender(f, direction)));
}

/* A floor that Blender keeps as one polygon of four corners, a wall of one triangle, a rectangle of light, a
 * sphere, and a light of each kind; then the dump that Blender would have written. */
static void make(struct fixture *f, char axis)
{
    *f = (struct fixture){.axis = axis, .s = build_scene()};
    uint32_t grey_one = build_material(&f->s, grey(.5f), grey(0));
    uint32_t lamp = build_material(&f->s, grey(0), grey(10));
    vec3 wall[3] = {{2, 0, -1}, {2, 0, 1}, {2, 1.5f, 0}};
    build_quad(&f->s, v3(-1, 0, 1), v3(2, 0, 0), v3(0, 0, -3), grey_one);
    build_triangle(&f->s, wall[0], wall[1], wall[2], grey_one);
    build_quad(&f->s, v3(0, 2, 0), v3(0, 0, .5f), v3(-.5f, 0, 0), lamp);
    build_sphere(&f->s, v3(0, 1, 0), .25f, 1, grey_one);
    build_point(&f->s, v3(.5f, 1, .25f), grey(1));
    build_spot(&f->s, v3(-.5f, 1, 0), v3(0, -.6f, .8f), .5f, 0, grey(1));
    build_sun(&f->s, v3(.6f, .8f, 0), grey(1));
    build_camera(&f->s, v3(.1f, 1, 4), 45);
    f->c = build_finish(&f->s, 60, 40);
    char up[] = "?_UP";
    up[0] = axis;
    f->dump = json_pack("{s:s, s:i, s:[{s:s, s:b, s:[], s:[], s:[]}], s:[], s:[]}", "up_axis", up,
                        "num_ambient", 0, "meshes", "name", "mesh", "custom", 0, "sizes", "corners",
                        "normals", "cameras", "lights");
    const vec3 floor_quad[4] = {{-1, 0, 1}, {1, 0, 1}, {1, 0, -2}, {-1, 0, -2}};
    add_polygon(f, 4, floor_quad, v3(0, 1, 0));
    add_polygon(f, 3, wall, v3(-1, 0, 0));
    add_light(f, "POINT", v3(.5f, 1, .25f), v3(0, 0, -1));
    add_light(f, "SPOT", v3(-.5f, 1, 0), v3(0, -.6f, .8f));
    add_light(f, "SUN", v3(7, 7, 7), v3(-.6f, -.8f, 0));
    add_light(f, "POINT", v3(-.25f, 2, .25f), v3(0, -1, 0)); /* at the rectangle's centre */
    json_array_append_new(json_object_get(f->dump, "cameras"),
                          json_pack("{s:s, s:o, s:o, s:o, s:o, s:f}", "name", "eye", "right",
                                    blender(f, v3(1, 0, 0)), "up", blender(f, v3(0, 1, 0)),
                                    "backward", blender(f, v3(0, 0, 1)), "eye",
                                    blender(f, v3(.1f, 1, 4)), "tan_h", tan(3.14159265358979 / 8)));
}

static void free_all(struct fixture *f)
{
    json_decref(f->dump);
    scene_free(&f->s);
}

static int set_up(void **state)
{
    static struct fixture f;
    make(&f, 'Y');
    *state = &f;
    return 0;
}

static int tear_down(void **state)
{
    free_all(*state);
    return 0;
}

#define WITH_Y_UP(name) TEST_OF(fixture, name, set_up, tear_down)

static struct import_report compare(struct fixture *f)
{
    struct import_report r;
    struct err e;
    MUST(import_check_compare(&f->s, &f->c, f->dump, &r, &e));
    return r;
}

TEST(readers_that_agree)
{
    for (const char *axis = "YZX"; *axis != '\0'; axis++) {
        struct fixture f;
        make(&f, *axis);
        struct import_report r = compare(&f);
        if (!r.agrees)
            fail_msg("%c_UP: %s", *axis, r.what);
        assert_int_equal(r.triangles, 3);
        assert_int_equal(r.polygons, 2);
        assert_int_equal(r.normals, 9);
        assert_int_equal(r.lights, 3);
        assert_int_equal(r.spheres, 1);
        assert_int_equal(r.rectangles, 1);
        assert_true(r.place_error < 1e-6);
        free_all(&f);
    }
}

/* The comparison must find a difference, with that reason; then the fixture is made anew. */
static void assert_differ(struct fixture *f, const char *why)
{
    struct import_report r = compare(f);
    if (r.agrees)
        fail_msg("agrees, although: %s", why);
    if (strstr(r.what, why) == NULL)
        fail_msg("'%s' does not say '%s'", r.what, why);
    free_all(f);
    make(f, 'Y');
}

static json_t *first_mesh(const struct fixture *f)
{
    return json_array_get(json_object_get(f->dump, "meshes"), 0);
}

/* 1e-4 of the extent; the least that is allowed is 1e-5. */
WITH_Y_UP(a_shifted_vertex_is_found)
{
    double extent = (double)length(sub(f->s.bounds_max, f->s.bounds_min));
    f->s.position[6].y += (float)(1e-4 * extent); /* of the wall */
    assert_differ(f, "polygon 1: Blender has a corner at (2.00000, 0.00000, -1.00000)");
    /* of the floor, of which each corner counts once */
    f->s.position[1].x += (float)(1e-4 * extent);
    assert_differ(f, "polygon 0");
}

WITH_Y_UP(a_swapped_axis_is_found)
{
    for (uint32_t k = 0; k < 3 * f->s.num_triangles; k++) {
        vec3 *p = &f->s.position[k];
        *p = v3(p->z, p->y, p->x);
    }
    assert_differ(f, "polygon 0");
    free_all(f);
    make(f, 'Z'); /* the file said Z up, and one of the two has not read that */
    json_object_set_new(f->dump, "up_axis", json_string("Y_UP"));
    assert_differ(f, "polygon 0");
}

WITH_Y_UP(triangles_too_many_too_few_or_turned_are_found)
{
    vec3 p = f->s.position[7];
    f->s.position[7] = f->s.position[8];
    f->s.position[8] = p;
    assert_differ(f, "polygon 1: our triangles do not make it up");
    const vec3 more[3] = {{-1, 0, 1}, {1, 0, 1}, {2, 1.5f, 0}};
    add_polygon(f, 3, more, v3(0, 1, 0));
    assert_differ(f, "polygon 2: our triangles do not make it up");
    json_array_remove(json_object_get(first_mesh(f), "sizes"), 1);
    assert_differ(f, "1 triangles of ours are none of Blender's");
}

WITH_Y_UP(a_turned_normal_is_found)
{
    f->s.normal[6] = normalize(v3(-1, 1e-3f, 0));
    assert_differ(f, "normal at (2.0000, 0.0000, -1.0000): 0.0010 rad");
    /* where Blender rounds, that much passes, but not a degree and a half */
    json_object_set_new(first_mesh(f), "custom", json_true());
    f->s.normal[6] = normalize(v3(-1, 1e-3f, 0));
    assert_true(compare(f).agrees);
    f->s.normal[6] = normalize(v3(-1, .026f, 0));
    assert_differ(f, "0.0260 rad");
}

WITH_Y_UP(another_camera_is_found)
{
    f->c.tan_h = tanf(1.01f * 3.14159265f / 8); /* an angle of view 1 % larger */
    assert_differ(f, "angle of view");
    f->c.eye.z += 1e-3f;
    assert_differ(f, "camera: ");
    f->c.right = v3(1, 1e-4f, 0);
    assert_differ(f, "'right' is 0.0001 rad");
    json_array_clear(json_object_get(f->dump, "cameras"));
    assert_differ(f, "Blender has 0 cameras");
}

WITH_Y_UP(lights_that_moved_or_turned_are_found)
{
    f->s.lights[0].position.x += 1e-3f;
    assert_differ(f, "Blender's light 'a light' (POINT) is none of ours");
    f->s.lights[1].axis = v3(0, -.8f, .6f);
    assert_differ(f, "(SPOT) is none of ours");
    f->s.lights[2].to_light = v3(-.6f, .8f, 0);
    assert_differ(f, "(SUN) is none of ours");
    json_array_remove(json_object_get(f->dump, "lights"), 1);
    assert_differ(f, "light 1 of ours is none of Blender's");
    /* the point light that stands for the rectangle */
    json_array_remove(json_object_get(f->dump, "lights"), 3);
    assert_differ(f, "2 triangles of ours are none of Blender's");
    /* ambient light is not an excuse for any sun */
    add_light(f, "SUN", v3(0, 0, 0), v3(0, 1, 0));
    json_object_set_new(f->dump, "num_ambient", json_integer(1));
    assert_differ(f, "(SUN) is none of ours");
}

WITH_Y_UP(what_cannot_be_compared_is_no_agreement)
{
    struct import_report r;
    struct err e;
    json_object_set_new(f->dump, "error", json_string("the importer ended with CANCELLED"));
    REFUSES(import_check_compare(&f->s, &f->c, f->dump, &r, &e), "CANCELLED");
    json_object_del(f->dump, "error");
    json_object_del(f->dump, "lights");
    assert_false(import_check_compare(&f->s, &f->c, f->dump, &r, &e));
    free_all(f);
    make(f, 'Y');
    json_array_append_new(json_object_get(first_mesh(f), "sizes"),
                          json_integer(3)); /* without corners */
    assert_false(import_check_compare(&f->s, &f->c, f->dump, &r, &e));
    json_t *reports = json_pack("[{s:s, s:b}]", "scene", "x", "agrees", 1);
    assert_int_equal(import_result_exit_code(reports), 0);
    json_array_append_new(reports,
                          json_pack("{s:s, s:b, s:s}", "scene", "y", "agrees", 0, "what", "z"));
    assert_int_equal(import_result_exit_code(reports), 1);
    json_array_append_new(reports, json_pack("{s:s, s:s}", "scene", "z", "error", "why"));
    assert_int_equal(import_result_exit_code(reports), 3);
    json_decref(reports);
}

/* With Blender. tests/reference/import_check/import.dae has, by its text: shapes 2 + 4 + 1 triangles (a quadrangle, a hexagon, a
 * triangle), the tent and its mirror image 2 each; 3 normals each; three lights with a place or a direction. */
TEST(blender_reads_what_we_read)
{
    char path[4096];
    if (!process_find("blender", path, sizeof path))
        skip();
    struct suite_scene suite = {.name = "import",
                                .dae = "tests/reference/import_check/import.dae",
                                .width = 60,
                                .height = 40,
                                .depth = 1};
    const struct suite_scene *scenes[] = {&suite};
    const struct import_options opt = {
        .work_dir = test_path("."), .share_dir = "reference", .timeout_s = 300};
    json_t *dumps;
    struct err e;
    struct fixture f = {.axis = 'Z'};
    struct import_report r;
    MUST(import_check_run(scenes, 1, &opt, &dumps, &e));
    if (json_object_get(json_array_get(dumps, 0), "absent") != NULL) {
        json_decref(dumps);
        print_message("skipped: this Blender does not import COLLADA\n");
        skip();
    }
    MUST(suite_open(&suite, &f.s, &f.c, &e) &&
         import_check_compare(&f.s, &f.c, json_array_get(dumps, 0), &r, &e));
    if (!r.agrees)
        fail_msg("%s", r.what);
    assert_int_equal(r.triangles, 2 + 4 + 1 + 2 + 2);
    assert_int_equal(r.polygons, 3 + 2 + 2);
    assert_int_equal(r.normals + r.unread_normals, 3 * r.triangles);
    assert_int_equal(r.unread_normals, 0);
    assert_int_equal(r.lights, 3);
    assert_int_equal(r.rectangles, 1);
    assert_int_equal(r.spheres, 1);
    assert_int_equal(r.environments, 1);
    assert_int_equal(r.cameras, 0);
    assert_true(r.place_error < 1e-6 && r.angle_error < 1e-6);

    /* Negative control: one vertex of ours moved by 1e-4 of the extent. */
    f.s.position[0].x += 1e-4f * length(sub(f.s.bounds_max, f.s.bounds_min));
    assert_true(import_check_compare(&f.s, &f.c, json_array_get(dumps, 0), &r, &e));
    assert_false(r.agrees);
    json_decref(dumps);
    scene_free(&f.s);
}
