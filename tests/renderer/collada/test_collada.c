/* Transforms, meshes and spheres of the COLLADA loader. Expected numbers are derived by hand beside
 * each test. */

#include "dae.h"
#include "tests/support/test.h"

/* One node around the triangle (0,0,0) (1,0,0) (0,1,0). */
#define NODE(transforms) "<node name=\"n\">" transforms INSTANCE("tri") "</node>"

/* Elements compose as matrices from left to right, so the last acts first.
 * T R S: (1,0,0) -S-> (2,0,0) -R-> (0,2,0) -T-> (1,4,3); (0,1,0) -> (0,1,0) -> (-1,0,0) -> (0,2,3).
 * S R T: (0,0,0) -T-> (1,2,3) -R-> (-2,1,3) -S-> (-4,1,3); (1,0,0) -> (2,2,3) -> (-2,2,3) ->
 * (-4,2,3). */
TEST(transforms_compose_in_document_order)
{
    struct scene s = dae_must_load(
        (struct dae){.nodes = NODE("<translate>1 2 3</translate><rotate>0 0 1 90</rotate>"
                                   "<scale>2 1 1</scale>")},
        DIALECT_AUTO);
    assert_vec(s.position[0], 1, 2, 3);
    assert_vec(s.position[1], 1, 4, 3);
    assert_vec(s.position[2], 0, 2, 3);
    scene_free(&s);
    s = dae_must_load((struct dae){.nodes = NODE("<scale>2 1 1</scale><rotate>0 0 1 90</rotate>"
                                                 "<translate>1 2 3</translate>")},
                      DIALECT_AUTO);
    assert_vec(s.position[0], -4, 1, 3);
    assert_vec(s.position[1], -4, 2, 3);
    scene_free(&s);
}

/* A third of a turn about (1,1,1), whatever its length, takes x to y and y to z. */
TEST(rotation_about_a_skew_axis)
{
    struct scene s =
        dae_must_load((struct dae){.nodes = NODE("<rotate>3 3 3 120</rotate>")}, DIALECT_AUTO);
    assert_vec(s.position[1], 0, 1, 0);
    assert_vec(s.position[2], 0, 0, 1);
    scene_free(&s);
}

/* Row-major, column vectors: (1,0,0) -> column 1 + column 4 = (1+10, 4+20, 7+30). */
TEST(matrix_is_row_major)
{
    struct scene s = dae_must_load(
        (struct dae){.nodes = NODE("<matrix>1 2 3 10  4 5 6 20  7 8 -9 30  0 0 0 1</matrix>")},
        DIALECT_AUTO);
    assert_vec(s.position[0], 10, 20, 30);
    /* The determinant 1(5*-9-6*8) - 2(4*-9-6*7) + 3(4*8-5*7) = -93+156-9 = 54 is positive, so the
     * corners keep their order. */
    assert_vec(s.position[1], 11, 24, 37);
    assert_vec(s.position[2], 12, 25, 38);
    scene_free(&s);
}

/* From (5,0,0) at the origin: backward = +x, right = up x backward = y x x = -z, up = y.
 * (1,0,0) -> eye + right = (5,0,-1); (0,1,0) -> (5,1,0). */
TEST(lookat_places_the_node)
{
    struct scene s = dae_must_load(
        (struct dae){.nodes = NODE("<lookat>5 0 0  0 0 0  0 2 0</lookat>")}, DIALECT_AUTO);
    assert_vec(s.position[0], 5, 0, 0);
    assert_vec(s.position[1], 5, 0, -1);
    assert_vec(s.position[2], 5, 1, 0);
    scene_free(&s);
}

/* Outer translation, inner rotation: (1,0,0) -> (0,1,0) -> (10,1,0). The same through an instance of
 * a node of a library, which brings (0,0,4) of its own: -> (10,1,4). */
TEST(nodes_nest)
{
    struct scene s = dae_must_load(
        (struct dae){.libraries = "<library_nodes><node id=\"part\"><translate>0 0 4</translate>"
                                  "<node name=\"deep\">" INSTANCE("tri") "</node></node>"
                                                                         "</library_nodes>",
                     .nodes = "<node><translate>10 0 0</translate><node name=\"inner\">"
                              "<rotate>0 0 1 90</rotate>" INSTANCE("tri")
                                  INSTANCE("tri") "<instance_node url=\"#part\"/></node></node>"},
        DIALECT_AUTO);
    assert_int_equal(s.num_triangles, 3);
    assert_int_equal(s.num_objects, 3);
    assert_string_equal(s.objects[0].name, "inner");
    assert_string_equal(s.objects[2].name, "deep");
    assert_vec(s.position[1], 10, 1, 0);
    assert_vec(s.position[4], 10, 1, 0);
    assert_vec(s.position[7], 10, 1, 4);
    assert_int_equal(s.tri_object[2], 2);
    scene_free(&s);
}

/* The three conventions, and metres: (1,2,3) of the file. Z_UP (x,y,z) -> (-x,z,y), X_UP -> (y,x,-z):
 * both turn without mirroring, so the front of a triangle that looks to +Z turns with it, to +Y and
 * to -Z. */
TEST(up_axis_and_unit)
{
    static const struct {
        const char *asset;
        double p[3], n[3];
    } CASES[] = {
        {"", {1, 2, 3}, {0, 0, 1}},
        {"<up_axis>Y_UP</up_axis>", {1, 2, 3}, {0, 0, 1}},
        {"<up_axis>Z_UP</up_axis>", {-1, 3, 2}, {0, 1, 0}},
        {"<up_axis> X_UP </up_axis>", {2, 1, -3}, {0, 0, -1}},
        {"<unit meter=\"0.01\"/><up_axis>Z_UP</up_axis>", {-0.01, 0.03, 0.02}, {0, 1, 0}},
    };
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        const struct dae d = {.asset = CASES[i].asset,
                              .nodes = NODE("<translate>1 2 3</translate>")};
        struct scene s = dae_must_load(d, DIALECT_AUTO);
        assert_vec(s.position[0], CASES[i].p[0], CASES[i].p[1], CASES[i].p[2]);
        assert_vec(front(&s, 0), CASES[i].n[0], CASES[i].n[1], CASES[i].n[2]);
        scene_free(&s);
    }
    /* The assignment does not know units. */
    struct scene s = dae_must_load((struct dae){.asset = "<unit meter=\"0.01\"/>",
                                                .nodes = NODE("<translate>1 2 3</translate>")},
                                   DIALECT_CGL);
    assert_vec(s.position[0], 1, 2, 3);
    scene_free(&s);
}

/* A mirror image keeps its front: mirrored in x the front of the triangle is still +Z, mirrored in z
 * it is -Z, turned by two mirrors it is +Z again. */
TEST(mirrors_keep_the_front_side)
{
    static const struct {
        const char *nodes;
        double z;
    } CASES[] = {{NODE("<scale>-1 1 1</scale>"), 1},
                 {NODE("<scale>1 1 -1</scale>"), -1},
                 {NODE("<scale>-1 -1 1</scale>"), 1},
                 {NODE("<scale>-2 -3 -4</scale>"), -1}};
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        struct scene s = dae_must_load((struct dae){.nodes = CASES[i].nodes}, DIALECT_AUTO);
        assert_vec(front(&s, 0), 0, 0, CASES[i].z);
        assert_vec(s.normal[0], 0, 0, CASES[i].z);
        scene_free(&s);
    }
}

/* Meshes. `body` stands after the sources of 8 points: the corners of an L of area 3 in the plane
 * z = 0, then (0,0,1) and (5,5,5). */
#define MESH(body)                                                                                 \
    "<library_geometries>" GEOMETRY(                                                               \
        "g", SOURCE("p", 24, 8, "0 0 0 2 0 0 2 1 0 1 1 0 1 2 0 0 2 0 0 0 1 5 5 5")                 \
                 SOURCE("n", 12, 4, "0 0 1 1 1 0 0 0 0 0 0 -2") VERTICES("v", "p")                 \
                     body) "</library_geometries>"
#define VERTEX "<input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/>"
#define NORMAL "<input semantic=\"NORMAL\" source=\"#n\" offset=\"1\"/>"
#define SHOW   "<node name=\"n\">" INSTANCE("g") "</node>"

static double total_area(const struct scene *s)
{
    double sum = 0;
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        const vec3 *p = s->position + 3 * (size_t)i;
        sum += 0.5 * length(cross(sub(p[1], p[0]), sub(p[2], p[0])));
    }
    return sum;
}

/* The L has 6 corners, so 4 triangles; none may reach into its notch x, y > 1; all look to +Z. */
static void check_l(const struct scene *s, uint32_t first)
{
    for (uint32_t i = first; i < first + 4; i++) {
        const vec3 *p = s->position + 3 * (size_t)i;
        vec3 c = scale(add(p[0], add(p[1], p[2])), 1.0f / 3);
        assert_false(c.x > 1 && c.y > 1);
        assert_vec(front(s, i), 0, 0, 1);
    }
}

TEST(concave_polygon_is_covered_once)
{
    static const char *const BODIES[] = {
        "<polylist material=\"m\" count=\"1\">" VERTEX "<vcount>6</vcount><p>0 1 2 3 4 5</p>"
        "</polylist>",
        "<polygons material=\"m\" count=\"1\">" VERTEX "<p>0 1 2 3 4 5</p></polygons>",
        /* Two unread numbers and a comment between. */
        "<polylist material=\"m\" count=\"1\">" VERTEX
        "<input semantic=\"TEXCOORD\" source=\"#n\" offset=\"2\" set=\"0\"/><vcount>6</vcount>"
        "<p>0 9 9 1 9 9 2 9 9<!-- half -->3 9 9 4 9 9 5 9 9</p></polylist>",
    };
    for (size_t i = 0; i < sizeof BODIES / sizeof *BODIES; i++) {
        char libraries[4096];
        static const char FRAME[] = MESH("%s");
        snprintf(libraries, sizeof libraries, FRAME, BODIES[i]);
        struct scene s =
            dae_must_load((struct dae){.libraries = libraries, .nodes = SHOW}, DIALECT_AUTO);
        assert_int_equal(s.num_triangles, 4);
        assert_near(total_area(&s), 3, 1e-6);
        check_l(&s, 0);
        scene_free(&s);
    }
}

/* Triangle, L and quadrilateral in one list. */
TEST(polygons_of_different_sizes_share_a_list)
{
    struct scene s =
        dae_must_load((struct dae){.libraries = MESH("<polylist material=\"m\" count=\"3\">" VERTEX
                                                     "<vcount>3 6 4</vcount>"
                                                     "<p>3 2 4 0 1 2 3 4 5 0 1 2 3</p></polylist>"),
                                   .nodes = SHOW},
                      DIALECT_AUTO);
    /* The last polygon 0 1 2 3 is the trapezium (0,0) (2,0) (2,1) (1,1) of area 1.5. */
    assert_int_equal(s.num_triangles, 1 + 4 + 2);
    assert_near(total_area(&s), 0.5 + 3 + 1.5, 1e-6);
    check_l(&s, 1);
    scene_free(&s);
}

TEST(triangles_without_area_are_counted)
{
    struct scene s = dae_must_load(
        (struct dae){.libraries = MESH("<triangles material=\"m\" count=\"4\">" VERTEX
                                       "<p>0 1 5 0 0 1 1 1 1 0 1 1</p></triangles>"
                                       "<polylist material=\"m\" count=\"1\">" VERTEX
                                       "<vcount>5</vcount><p>0 1 0 1 0</p></polylist>"),
                     .nodes = SHOW},
        DIALECT_AUTO);
    assert_int_equal(s.num_triangles, 1);
    assert_int_equal(s.num_degenerate, 3 + 3);
    scene_free(&s);
}

/* Offset 2, stride 6, the second number of each triple unnamed: x = number 0, y = 2, z = 3 after the
 * offset. */
TEST(accessor_offset_stride_and_unnamed_params)
{
    struct scene s = dae_must_load(
        (struct dae){
            .libraries =
                "<library_geometries><geometry id=\"g\"><mesh><source id=\"p\">"
                "<float_array id=\"a\" count=\"20\">99 98 1 97 2 3 96 95 4 94 5 6 93 92 7 91 8 10 "
                "90 "
                "89</float_array><technique_common>"
                "<accessor source=\"#a\" count=\"3\" stride=\"6\" offset=\"2\"><param name=\"X\"/>"
                "<param/><param name=\"Y\"/><param name=\"Z\"/></accessor></technique_common>"
                "</source>" VERTICES(
                    "v", "p") "<triangles material=\"m\" count=\"1\">" VERTEX
                              "<p>0 1 2</p></triangles></mesh></geometry></library_geometries>",
            .nodes = SHOW},
        DIALECT_AUTO);
    assert_vec(s.position[0], 1, 2, 3);
    assert_vec(s.position[1], 4, 5, 6);
    assert_vec(s.position[2], 7, 8, 10);
    scene_free(&s);
}

/* Triangle (0,0,0) (2,0,0) (0,0,1) looks to -Y. Its file normals: (0,0,1); (1,1,0); none. Under
 * scale (2,1,1) a normal (a,b,c) becomes (a/2, b, c): (1,1,0) -> (1,2,0)/sqrt 5. The zero one is
 * replaced by the geometric normal (0,-1,0). Sum = (0.447, 0.894-1, 1), and its y is negative: it is on
 * the front side, so nothing is turned. */
TEST(normals_go_by_the_inverse_transpose)
{
    struct scene s = dae_must_load(
        (struct dae){.libraries = MESH("<triangles material=\"m\" count=\"1\">" VERTEX NORMAL
                                       "<p>0 0 1 1 6 2</p></triangles>"),
                     .nodes = "<node><scale>2 1 1</scale>" INSTANCE("g") "</node>"},
        DIALECT_AUTO);
    assert_vec(front(&s, 0), 0, -1, 0);
    assert_vec(s.normal[0], 0, 0, 1);
    assert_vec(s.normal[1], 1 / sqrt(5), 2 / sqrt(5), 0);
    assert_vec(s.normal[2], 0, -1, 0);
    assert_int_equal(s.num_zero_normals, 1);
    scene_free(&s);
}

/* Winding says +Z, the file's normals say -Z, as on the walls of the assignment's Cornell boxes: the
 * winding wins and the normals are turned. */
TEST(normals_against_the_winding_are_turned)
{
    struct scene s = dae_must_load(
        (struct dae){.libraries = MESH("<triangles material=\"m\" count=\"1\">" VERTEX NORMAL
                                       "<p>0 3 1 3 2 3</p></triangles>"),
                     .nodes = SHOW},
        DIALECT_AUTO);
    for (int k = 0; k < 3; k++)
        assert_vec(s.normal[k], 0, 0, 1);
    assert_int_equal(s.num_zero_normals, 0);
    scene_free(&s);
}

/* Mirrored in x the triangle still looks to +Z, and so do its two file normals and the geometric one
 * that stands in for the third, which is zero in the file. */
TEST(normals_are_mirrored_with_their_triangle)
{
    struct scene s = dae_must_load(
        (struct dae){.libraries = MESH("<triangles material=\"m\" count=\"1\">" VERTEX NORMAL
                                       "<p>0 0 1 0 2 2</p></triangles>"),
                     .nodes = "<node><scale>-1 1 1</scale>" INSTANCE("g") "</node>"},
        DIALECT_AUTO);
    for (int k = 0; k < 3; k++)
        assert_vec(s.normal[k], 0, 0, 1);
    scene_free(&s);
}

/* Normals that come with the vertices, unless the primitive has its own. */
TEST(normals_by_vertex)
{
#define BY_VERTEX                                                                                  \
    "<library_geometries><geometry id=\"g\"><mesh>" SOURCE("p", 9, 3, "0 0 0 1 0 0 0 1 0") SOURCE( \
        "n", 9, 3,                                                                                 \
        "0 3 4 3 0 4 0 0 1") "<vertices id=\"v\"><input semantic=\"POSITION\" "                    \
                             "source=\"#p\"/><input semantic=\"NORMAL\" "                          \
                             "source=\"#n\"/></vertices><triangles material=\"m\" count=\"1\">"
    struct scene s = dae_must_load((struct dae){.libraries = BY_VERTEX VERTEX
                                                "<p>0 1 2</p></triangles></mesh></geometry>"
                                                "</library_geometries>",
                                                .nodes = SHOW},
                                   DIALECT_AUTO);
    assert_vec(s.normal[0], 0, 0.6, 0.8);
    assert_vec(s.normal[1], 0.6, 0, 0.8);
    assert_vec(s.normal[2], 0, 0, 1);
    scene_free(&s);
    s = dae_must_load((struct dae){.libraries = BY_VERTEX VERTEX NORMAL
                                   "<p>0 2 1 2 2 2</p></triangles></mesh></geometry>"
                                   "</library_geometries>",
                                   .nodes = SHOW},
                      DIALECT_AUTO);
    assert_vec(s.normal[0], 0, 0, 1);
    scene_free(&s);
}

#define SPHERE(profile, body)                                                                      \
    "<library_geometries><geometry id=\"g\">" EXTRA(                                               \
        profile, "<sphere>" body "</sphere>") "</geometry></library_geometries>"

/* Radius 0.5 times 3, also where two axes are mirrored and turned; centre by the translation. */
TEST(spheres)
{
    struct scene s = dae_must_load(
        (struct dae){.libraries = SPHERE("ASSAY", "<radius>.5</radius><facing> in </facing>"),
                     .nodes =
                         "<node name=\"s\"><translate>1 2 3</translate>"
                         "<rotate>1 2 3 40</rotate><scale>3 -3 3</scale>" INSTANCE("g") "</node>"},
        DIALECT_AUTO);
    assert_int_equal(s.num_spheres, 1);
    assert_int_equal(s.num_triangles, 0);
    assert_vec(s.spheres[0].centre, 1, 2, 3);
    assert_near(s.spheres[0].radius, 1.5, 1e-6);
    assert_true(s.spheres[0].normal_out == -1);
    assert_string_equal(s.objects[0].name, "s");
    assert_int_equal(s.objects[0].num_spheres, 1);
    scene_free(&s);
    s = dae_must_load((struct dae){.libraries = SPHERE("CGL", "<radius>2</radius>"), .nodes = SHOW},
                      DIALECT_AUTO);
    assert_int_equal(s.dialect, DIALECT_CGL);
    assert_true(s.spheres[0].normal_out == 1);
    assert_near(s.spheres[0].radius, 2, 0);
    scene_free(&s);
}

/* 2^40 instances of a node, each level of a chain naming the next one twice. */
TEST(explosion_of_instances_is_an_error)
{
    char libraries[8192] = "<library_nodes>";
    for (int i = 0; i < 40; i++) {
        char node[160];
        snprintf(node, sizeof node,
                 "<node id=\"k%d\"><instance_node url=\"#k%d\"/><instance_node url=\"#k%d\"/>"
                 "</node>",
                 i, i + 1, i + 1);
        strcat(libraries, node);
    }
    strcat(libraries, "<node id=\"k40\"/></library_nodes>");
    dae_must_fail(
        (struct dae){.libraries = libraries, .nodes = "<node><instance_node url=\"#k0\"/></node>"},
        DIALECT_AUTO, "instances of nodes");
}

static void repeat(char *out, const char *s, int times)
{
    for (; times > 0; times--)
        out = stpcpy(out, s);
}

TEST(deep_nesting_is_an_error)
{
    enum { DEEP = 30000 };
    char *nodes = calloc(16 * DEEP + 1, 1);
    assert_non_null(nodes);
    repeat(nodes, "<node>", DEEP);
    repeat(nodes + strlen(nodes), "</node>", DEEP);
    dae_must_fail((struct dae){.nodes = nodes}, DIALECT_AUTO, "nested deeper");
    free(nodes);
}

/* The parser counts lines up to 65535 only; the document's own 5th line is where `nodes` starts. */
TEST(lines_are_right_far_down)
{
    enum { LINES = 100000 };
    char *nodes = calloc(LINES + 200, 1);
    assert_non_null(nodes);
    repeat(nodes, "\n", LINES);
    strcat(nodes, "<node><translate>1\n2\nthree</translate></node>");
    struct dae d = {.nodes = nodes};
    char *text = dae_text(&d), expected[64];
    const char *fault = strstr(text, "three");
    long line = 1;
    for (const char *c = text; c < fault; c++)
        line += *c == '\n';
    assert_true(line > LINES);
    snprintf(expected, sizeof expected, "test.dae:%ld: <translate>: 'three'", line);
    free(text);
    dae_must_fail(d, DIALECT_AUTO, expected);
    free(nodes);
}

TEST(failure_leaves_the_scene_alone)
{
    struct scene s, before;
    struct err e = {""};
    memset(&s, 0x5a, sizeof s);
    before = s;
    struct dae d = {.nodes = NODE("<skew>1</skew>")};
    assert_false(dae_load(&d, DIALECT_AUTO, &s, &e));
    assert_memory_equal(&s, &before, sizeof s);
}

/* Names end at a whole character of UTF-8 and hold no control characters. */
TEST(names_are_cut_and_cleaned)
{
    /* 62 letters and one character of two bytes need 64 bytes; 63 fit before the end. */
    struct scene s = dae_must_load(
        (struct dae){
            .nodes = "<node name=\"aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"
                     "\xc3\xa9\">" INSTANCE("tri") "</node><node name=\"two&#10;lines\">" INSTANCE(
                         "tri") "</node>"},
        DIALECT_AUTO);
    assert_int_equal(strlen(s.objects[0].name), 62);
    assert_string_equal(s.objects[1].name, "two_lines");
    scene_free(&s);
}
