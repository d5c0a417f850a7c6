/* Scenes that must fail. Each file in tests/bad is 00_valid.dae with the one fault of its name, on the
 * line that carries the comment <!-- fault -->; the expected line number is found by that comment,
 * not by the loader. */
#include "renderer/collada/collada.h"
#include "tests/support/test.h"

#include <dirent.h>

struct bad {
    const char *name;
    enum dialect dialect;
    const char *keyword; /* must be in the message */
};

static const struct bad TABLE[] = {
    {"doctype_entity_bomb", DIALECT_AUTO, "DOCTYPE"},
    {"doctype_external_entity", DIALECT_AUTO, "DOCTYPE"},
    {"xml_mismatched_tag", DIALECT_AUTO, "mismatch"},
    {"xml_undefined_entity", DIALECT_AUTO, "not well-formed"},
    {"root_not_collada", DIALECT_AUTO, "root"},
    {"root_version_1_3", DIALECT_AUTO, "version"},
    {"root_unknown_element", DIALECT_AUTO, "unexpected"},
    {"stray_text", DIALECT_AUTO, "stray text"},
    {"unit_zero", DIALECT_AUTO, "meter"},
    {"up_axis_unknown", DIALECT_AUTO, "up_axis"},
    {"asset_of_its_own_unit", DIALECT_AUTO, "whole document"},
    {"scene_missing", DIALECT_AUTO, "no <scene>"},
    {"scene_physics", DIALECT_AUTO, "instance_physics_scene"},
    {"scene_without_geometry", DIALECT_AUTO, "nothing to render"},
    {"library_animations", DIALECT_AUTO, "animation"},
    {"library_controllers", DIALECT_AUTO, "controller"},
    {"instance_controller", DIALECT_AUTO, "instance_controller"},
    {"reference_dangling", DIALECT_AUTO, "no element with id"},
    {"reference_external", DIALECT_AUTO, "out of the file"},
    {"reference_to_wrong_kind", DIALECT_AUTO, "not a <light>"},
    {"reference_ambiguous", DIALECT_AUTO, "more than one"},
    {"node_contains_itself", DIALECT_AUTO, "contains itself"},
    {"node_skew", DIALECT_AUTO, "skew"},
    {"node_matrix_of_15", DIALECT_AUTO, "15 numbers"},
    {"node_matrix_projective", DIALECT_AUTO, "last row"},
    {"node_transform_singular", DIALECT_AUTO, "singular"},
    {"node_rotate_no_axis", DIALECT_AUTO, "axis"},
    {"node_lookat_up_along_view", DIALECT_AUTO, "lookat"},
    {"node_translate_of_2", DIALECT_AUTO, "2 numbers"},
    {"node_unknown_element", DIALECT_AUTO, "unexpected"},
    {"number_nan", DIALECT_AUTO, "not a finite number"},
    {"number_infinite", DIALECT_AUTO, "not a finite number"},
    {"number_word", DIALECT_AUTO, "not a finite number"},
    {"number_hexadecimal", DIALECT_AUTO, "not a finite number"},
    {"array_count_differs", DIALECT_AUTO, "its count says 15"},
    {"array_coordinate_too_large", DIALECT_AUTO, "beyond"},
    {"accessor_too_long", DIALECT_AUTO, "beyond the end"},
    {"accessor_absurd_count", DIALECT_AUTO, "not a number below"},
    {"accessor_of_two_params", DIALECT_AUTO, "named <param>s"},
    {"index_of_vertex", DIALECT_AUTO, "vertex index 4"},
    {"index_of_normal", DIALECT_AUTO, "normal index 1"},
    {"index_negative", DIALECT_AUTO, "not an index"},
    {"index_list_short", DIALECT_AUTO, "7 indices"},
    {"vcount_differs", DIALECT_AUTO, "vcount"},
    {"vcount_two_corners", DIALECT_AUTO, "2 corners"},
    {"polygon_crosses_itself", DIALECT_AUTO, "crosses itself"},
    {"polygons_with_hole", DIALECT_AUTO, "hole"},
    {"mesh_tristrips", DIALECT_AUTO, "tristrips"},
    {"mesh_lines", DIALECT_AUTO, "lines"},
    {"mesh_vertex_colors", DIALECT_AUTO, "COLOR"},
    {"mesh_without_vertex", DIALECT_AUTO, "VERTEX"},
    {"mesh_convex", DIALECT_AUTO, "convex_mesh"},
    {"sphere_scaled_unevenly", DIALECT_AUTO, "not uniform"},
    {"sphere_radius_negative", DIALECT_AUTO, "radius"},
    {"sphere_facing_up", DIALECT_AUTO, "facing"},
    {"geometry_unknown_tag", DIALECT_AUTO, "torus"},
    {"material_not_bound", DIALECT_AUTO, "symbol 'paint'"},
    {"material_specular", DIALECT_AUTO, "--dialect cgl"},
    {"material_transparent", DIALECT_AUTO, "transparency"},
    {"material_mirror_common", DIALECT_AUTO, "mirror"},
    {"material_texture", DIALECT_AUTO, "texture"},
    {"material_reflectance_above_1", DIALECT_AUTO, "above 1"},
    {"material_color_negative", DIALECT_AUTO, "negative"},
    {"material_unknown_tag", DIALECT_AUTO, "unknown material tag 'toon'"},
    {"material_mirror_no_reflectance", DIALECT_AUTO, "<mirror> without <reflectance>"},
    {"material_mirror_above_1", DIALECT_AUTO, "<reflectance> above 1"},
    {"material_mirror_unknown_child", DIALECT_AUTO, "unexpected <roughness>"},
    {"material_glass_no_transmittance", DIALECT_AUTO, "<glass> without <transmittance>"},
    {"material_glass_no_ior", DIALECT_AUTO, "<glass> without <ior>"},
    {"material_glass_ior_zero", DIALECT_AUTO, "<ior> is 0"},
    {"material_glass_rough", DIALECT_AUTO, "rough glass"},
    {"material_glass_unknown_child", DIALECT_AUTO, "unexpected <dispersion>"},
    {"material_glass_two_iors", DIALECT_AUTO, "second <ior>"},
    {"material_refraction_no_transmittance", DIALECT_AUTO, "<refraction> without <transmittance>"},
    {"material_refraction_above_1", DIALECT_AUTO, "<transmittance> above 1"},
    {"material_refraction_ior_huge", DIALECT_AUTO, "<ior> is 1e+30"},
    {"material_refraction_unknown_child", DIALECT_AUTO, "unexpected <reflectance>"},
    {"material_microfacet_no_k", DIALECT_AUTO, "<microfacet> without <k>"},
    {"material_microfacet_no_alpha", DIALECT_AUTO, "<microfacet> without <alpha>"},
    {"material_microfacet_alpha_zero", DIALECT_AUTO, "<alpha> is 0"},
    {"material_microfacet_alpha_11", DIALECT_AUTO, "<alpha> is 11"},
    {"material_microfacet_eta_negative", DIALECT_AUTO, "negative"},
    {"material_microfacet_unknown_child", DIALECT_AUTO, "unexpected <distribution>"},
    {"material_microfacet_two_fresnels", DIALECT_AUTO, "unexpected <eta>"},
    {"material_microfacet_distribution", DIALECT_AUTO, "neither 'ggx' nor 'beckmann'"},
    {"material_cgl_in_collada", DIALECT_COLLADA, "--dialect cgl"},
    {"material_emission_three_sides", DIALECT_AUTO, "sides"},
    {"material_profile_cmu462", DIALECT_AUTO, "CMU462"},
    {"extra_of_ours_in_a_node", DIALECT_AUTO, "no meaning here"},
    {"light_spot_angle", DIALECT_AUTO, "181 degrees"},
    {"light_spot_exponent", DIALECT_AUTO, "falloff_exponent"},
    {"light_spot_of_the_assignment", DIALECT_CGL, "spot"},
    {"light_spot_unknown_tag", DIALECT_AUTO, "penumbra"},
    {"light_ambient_twice", DIALECT_AUTO, "second ambient"},
    {"light_attenuation_zero", DIALECT_AUTO, "attenuation"},
    {"light_rectangle_no_width", DIALECT_AUTO, "width"},
    {"light_unknown_tag", DIALECT_AUTO, "unknown light tag"},
    {"camera_orthographic", DIALECT_AUTO, "orthographic"},
    {"camera_no_angle", DIALECT_AUTO, "xfov"},
    {"camera_angle_of_180", DIALECT_AUTO, "180"},
    {"camera_far_before_near", DIALECT_AUTO, "zfar"},
    {"camera_twice", DIALECT_AUTO, "second camera"},
    {"camera_mirrored", DIALECT_AUTO, "mirror"},
};
enum { TABLE_SIZE = sizeof TABLE / sizeof *TABLE };

static void path_of(char path[512], const char *name)
{
    snprintf(path, 512, "tests/bad/%s.dae", name);
}

/* 1-based; 0 if no line is marked. */
static long marked_line(const char *path)
{
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    char text[1024];
    long line = 0, marked = 0;
    while (fgets(text, sizeof text, f) != NULL) {
        line++;
        if (strstr(text, "<!-- fault -->") != NULL)
            marked = line;
    }
    fclose(f);
    return marked;
}

TEST(each_fault_is_named_with_its_line)
{
    int failures = 0;
    for (size_t i = 0; i < TABLE_SIZE; i++) {
        char path[512], start[600];
        path_of(path, TABLE[i].name);
        snprintf(start, sizeof start, "%s:%ld: ", path, marked_line(path));
        struct scene s = {0};
        struct err e = {""};
        if (collada_load(path, TABLE[i].dialect, &s, &e)) {
            print_error("%s: loads\n", path);
            scene_free(&s);
            failures++;
        } else if (strncmp(e.msg, start, strlen(start)) != 0 ||
                   strstr(e.msg + strlen(start), TABLE[i].keyword) == NULL ||
                   strchr(e.msg, '\n') != NULL) {
            print_error("expected '%s...%s...', got '%s'\n", start, TABLE[i].keyword, e.msg);
            failures++;
        }
    }
    assert_int_equal(failures, 0);
}

/* Negative control: without a fault the scene loads, so the faults are what is refused. */
TEST(scene_without_fault_loads)
{
    struct scene s = {0};
    struct err e = {""};
    MUST(collada_load("tests/bad/00_valid.dae", DIALECT_AUTO, &s, &e));
    assert_int_equal(s.num_triangles, 2);
    assert_int_equal(s.num_spheres, 1);
    scene_free(&s);
}

/* No file of the folder is left out of the table. */
TEST(table_is_complete)
{
    DIR *d = opendir("tests/bad");
    assert_non_null(d);
    size_t files = 0;
    for (struct dirent *f = readdir(d); f != NULL; f = readdir(d)) {
        size_t n = strlen(f->d_name);
        files += n > 4 && strcmp(f->d_name + n - 4, ".dae") == 0;
    }
    closedir(d);
    assert_int_equal(files, TABLE_SIZE + 1);
}

TEST(unreadable_file_is_an_error)
{
    struct scene s = {0};
    struct err e = {""};
    assert_false(collada_load("tests/bad/no_such_file.dae", DIALECT_AUTO, &s, &e));
    assert_non_null(strstr(e.msg, "no_such_file.dae: cannot read"));
    assert_false(collada_load("tests", DIALECT_AUTO, &s, &e));
    assert_non_null(strstr(e.msg, "tests: cannot read"));
}
