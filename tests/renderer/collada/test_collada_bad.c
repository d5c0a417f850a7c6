/* Scenes that must be refused. A line of tests/bad/expected has a scene's name, ":DIALECT" if it is not read in its
 * own, and a part of the error message. Each file is 00_valid.dae with one fault, the one of its name, on the line
 * with the comment <!-- fault -->, by which the test finds the expected line number. */
#define _GNU_SOURCE
#include "renderer/collada/collada.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <glob.h>
#include <sys/stat.h>

/* 1-based; 0 if no line is marked. */
static long marked_line(const char *path)
{
    char *text = test_read(path), *rest = text, *at;
    long line = 0, marked = 0;
    while ((at = strsep(&rest, "\n")) != NULL) {
        line++;
        if (strstr(at, "<!-- fault -->") != NULL)
            marked = line;
    }
    free(text);
    return marked;
}

TEST(each_fault_is_named_with_its_line)
{
    char *table = test_read("tests/bad/expected"), *rest = table, *line;
    size_t failures = 0, rows = 0;
    while ((line = strsep(&rest, "\n")) != NULL && *line != '\0') {
        char *name = strsep(&line, " "), *keyword = line, path[512], start[600];
        const char *word = strchr(name, ':');
        enum dialect dialect = word == NULL                    ? DIALECT_AUTO
                               : strcmp(word, ":collada") == 0 ? DIALECT_COLLADA
                                                               : DIALECT_CGL;
        snprintf(path, sizeof path, "tests/bad/%.*s.dae", (int)strcspn(name, ":"), name);
        snprintf(start, sizeof start, "%s:%ld: ", path, marked_line(path));
        struct scene s = {0};
        struct err e = {""};
        rows++;
        if (collada_load(path, dialect, &s, &e)) {
            print_error("%s: loads\n", path);
            scene_free(&s);
            failures++;
        } else if (strncmp(e.msg, start, strlen(start)) != 0 ||
                   strstr(e.msg + strlen(start), keyword) == NULL || strchr(e.msg, '\n') != NULL) {
            print_error("expected '%s...%s...', got '%s'\n", start, keyword, e.msg);
            failures++;
        }
    }
    free(table);
    assert_int_equal(failures, 0);
    /* No file of the folder is left out of the table. */
    glob_t files;
    assert_int_equal(glob("tests/bad/*.dae", 0, NULL, &files), 0);
    assert_int_equal(files.gl_pathc, rows + 1);
    globfree(&files);
}

/* Negative control: without a fault the scene loads, so the faults are what is refused. */
TEST(scene_without_fault_loads)
{
    OWN(scene) s = {0};
    struct err e = {""};
    MUST(collada_load("tests/bad/00_valid.dae", DIALECT_AUTO, &s, &e));
    assert_int_equal(s.num_triangles, 2);
    assert_int_equal(s.num_spheres, 1);
}

TEST(unreadable_file_is_an_error)
{
    struct scene s = {0};
    struct err e = {""};
    REFUSES(collada_load("tests/bad/no_such_file.dae", DIALECT_AUTO, &s, &e),
            "no_such_file.dae: cannot read");
    REFUSES(collada_load("tests", DIALECT_AUTO, &s, &e), "tests: cannot read");
}

/* Writes a document of that body, which is as it stands. */
static void write_document(const char *name, const char *body)
{
    char text[4096];
    snprintf(
        text, sizeof text,
        "<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'>\n%s</COLLADA>",
        body);
    test_write_text(test_path(name), text);
}

/* A scene over four files: main.dae -> "part s.dae" (centimetres, Z_UP: a node and a geometry that name each other's file) ->
 * back, and a material of a third. The point (1,2,3) cm of Z_UP is (1,3,-2)/100 m in Y_UP. */
TEST(scene_of_several_files)
{
    assert_int_equal(mkdir(test_path("paint"), 0700), 0);
    write_document(
        "main.dae",
        "<library_geometries><geometry id='tri'><mesh><source id='p'><float_array id='a' count='9'>"
        "1 2 3 2 2 3 1 3 3</float_array><technique_common><accessor source='#a' count='3' stride='3'>"
        "<param name='X'/><param name='Y'/><param name='Z'/></accessor></technique_common></source>"
        "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices><triangles material='m' "
        "count='1'><input semantic='VERTEX' source='#v' offset='0'/><p>0 1 2</p></triangles></mesh>"
        "</geometry></library_geometries><library_visual_scenes><visual_scene id='w'><node id='here'>"
        "<instance_node url='part%20s.dae#here'/></node></visual_scene></library_visual_scenes>"
        "<scene><instance_visual_scene url='./main.dae#w'/></scene>");
    write_document(
        "part s.dae",
        "<asset><unit meter='.01'/><up_axis>Z_UP</up_axis></asset><library_nodes><node id='here'>"
        "<translate>1 2 3</translate><instance_geometry url='main.dae#tri'><bind_material>"
        "<technique_common><instance_material symbol='m' target='paint/red.dae#red'/></technique_common>"
        "</bind_material></instance_geometry></node></library_nodes>");
    write_document(
        "paint/red.dae",
        "<library_materials><material id='red'><instance_effect url='../paint/red.dae#red-fx'/></material>"
        "</library_materials><library_effects><effect id='red-fx'><profile_COMMON><technique sid='c'>"
        "<lambert><diffuse><color>.7 0 0 1</color></diffuse></lambert></technique></profile_COMMON></effect>"
        "</library_effects>");
    struct scene s = {0};
    struct err e = {""};
    char path[256];
    snprintf(path, sizeof path, "%s", test_path("main.dae"));
    MUST(collada_load(path, DIALECT_AUTO, &s, &e));
    assert_int_equal(s.num_triangles, 1);
    assert_int_equal(s.num_documents, 2);
    assert_non_null(strstr(s.documents[1], "red.dae"));
    assert_true(s.materials[0].reflectance.r == 0.7f);
    /* The geometry is of main.dae, so in metres and Y_UP, about the node's place. */
    const vec3 expected[3] = {{1.01f, 2.03f, 2.98f}, {2.01f, 2.03f, 2.98f}, {1.01f, 3.03f, 2.98f}};
    for (int k = 0; k < 3; k++)
        assert_true(length(sub(s.position[k], expected[k])) < 1e-5f);
    scene_free(&s);
    /* A fault has the name of its own file. */
    write_document("paint/red.dae", "<library_materials/>");
    REFUSES(collada_load(path, DIALECT_AUTO, &s, &e), "part s.dae:2: no element with id 'red'");
    write_document("paint/red.dae", "<library_materials><bad></library_materials>");
    REFUSES(collada_load(path, DIALECT_AUTO, &s, &e), "paint/red.dae:2: not well-formed");
    /* Only files, and only of relative names; never from memory. */
    static const char *const urls[] = {"/etc/passwd#w", "http://example.org/a.dae#w",
                                       "file:///tmp/a.dae#w", "other.dae"};
    static const char *const why[] = {"leads elsewhere", "leads elsewhere", "leads elsewhere",
                                      "without '#'"};
    for (size_t i = 0; i < COUNT(urls); i++) {
        char body[256];
        snprintf(body, sizeof body, "<scene><instance_visual_scene url='%s'/></scene>", urls[i]);
        write_document("main.dae", body);
        REFUSES(collada_load(path, DIALECT_AUTO, &s, &e), why[i]);
    }
    static const char text[] =
        "<COLLADA version='1.4.1'><scene><instance_visual_scene url='main.dae#w'/></scene></COLLADA>";
    REFUSES(collada_parse(text, strlen(text), path, DIALECT_AUTO, &s, &e), "leads elsewhere");
}

/* Without <scene>: the only <visual_scene>, nothing if there is none, and an error if there are two. */
TEST(file_without_scene)
{
#define VISUAL(id)                                                                                 \
    "<library_visual_scenes><visual_scene id='" id "'><node><instance_camera url='#c'/></node>"    \
    "</visual_scene></library_visual_scenes>"
    static const struct {
        const char *body, *says;
        bool loads, sees;
    } of[] = {
        {"", "nothing to see: no <scene>", true, false},
        {"<library_nodes><node id='n'/></library_nodes>", "nothing to see: no <scene>", true,
         false},
        {VISUAL("a"), "nothing to see: no triangles", true, true},
        {VISUAL("a") VISUAL("b"), "no <scene>, and more than one <visual_scene>", false, false}};
    for (size_t i = 0; i < COUNT(of); i++) {
        char text[2048];
        OWN(scene) s = {0};
        struct err e = {""};
        snprintf(
            text, sizeof text,
            "<COLLADA version='1.4.1'><library_cameras><camera id='c'><optics><technique_common>"
            "<perspective><yfov>60</yfov><znear>.5</znear><zfar>50</zfar></perspective>"
            "</technique_common></optics></camera></library_cameras>%s</COLLADA>",
            of[i].body);
        const bool ok = collada_parse(text, strlen(text), "x.dae", DIALECT_AUTO, &s, &e);
        assert_int_equal(ok, of[i].loads);
        assert_non_null(strstr(ok ? s.note : e.msg, of[i].says));
        assert_int_equal(s.camera.present, of[i].sees);
    }
#undef VISUAL
}
