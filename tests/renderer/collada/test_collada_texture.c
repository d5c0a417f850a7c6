/* Textures of COLLADA files: which file an image is, what its sampler says, and which coordinates an instance binds. */
#include "renderer/base/fs.h"
#include "renderer/collada/collada.h"
#include "tests/support/build_scene.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

/* A quadrangle with corners (0,0), (1,0), (1,1), (0,1) and two sets of texture coordinates: set 4, of the vertices, u
 * = 1 - x, v = y; set 7, of the corners, u = 2 x, v = 3 y, with a third param. */
static const char DOCUMENT[] =
    "<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'><asset/>\n"
    "<library_images>%s</library_images>\n"
    "<library_effects><effect id='fx'><profile_COMMON><newparam sid='s'><surface type='2D'><init_from>i</init_from></surface>"
    "</newparam><newparam sid='t'><sampler2D><source>s</source>%s</sampler2D></newparam><newparam sid='o'><sampler2D><source>s"
    "</source></sampler2D></newparam><technique sid='c'><lambert>%s</lambert></technique></profile_COMMON></effect>"
    "</library_effects>\n"
    "<library_materials><material id='m'><instance_effect url='#fx'/></material></library_materials>\n"
    "<library_geometries><geometry id='g'><mesh><source id='p'><float_array id='pa' count='12'>0 0 0 1 0 0 1 1 0 0 1 0"
    "</float_array><technique_common><accessor source='#pa' count='4' stride='3'><param name='X' type='float'/><param name='Y' "
    "type='float'/><param name='Z' type='float'/></accessor></technique_common></source><source id='a'><float_array id='aa' "
    "count='8'>1 0 0 0 0 1 1 1</float_array><technique_common><accessor source='#aa' count='4' stride='2'><param name='S' "
    "type='float'/><param name='T' type='float'/></accessor></technique_common></source><source id='b'><float_array id='ba' "
    "count='12'>2 3 9 0 0 9 2 0 9 0 3 9</float_array><technique_common><accessor source='#ba' count='4' stride='3'><param "
    "name='S' type='float'/><param name='T' type='float'/><param name='P' type='float'/></accessor></technique_common></source>"
    "<vertices id='v'><input semantic='POSITION' source='#p'/>%s</vertices><polylist material='x' count='1'><input "
    "semantic='VERTEX' source='#v' offset='0'/>%s<vcount>4</vcount><p>0 1 1 2 2 0 3 3</p></polylist></mesh></geometry>"
    "<geometry id='ball'><extra><technique profile='ASSAY'><sphere><radius>1</radius></sphere></technique></extra></geometry>"
    "</library_geometries>\n"
    "<library_visual_scenes><visual_scene id='w'><node><scale>%s</scale><instance_geometry url='#%s'><bind_material>"
    "<technique_common><instance_material symbol='x' target='#m'>%s</instance_material></technique_common></bind_material>"
    "</instance_geometry></node></visual_scene></library_visual_scenes>\n"
    "<scene><instance_visual_scene url='#w'/></scene></COLLADA>\n";

#define BY_VERTEX "<input semantic='TEXCOORD' source='#a' set='4'/>"
#define BY_CORNER "<input semantic='TEXCOORD' source='#b' offset='1' set='7'/>"
#define BIND(set)                                                                                  \
    "<bind_vertex_input semantic='UV' input_semantic='TEXCOORD' input_set='" #set "'/>"
#define DIFFUSE "<diffuse><texture texture='t' texcoord='UV'/></diffuse>"

struct pieces {
    const char *image, *sampler, *channels, *vertices, *inputs, *scale, *geometry, *bind;
};
static const struct pieces PLAIN = {
    "<image id='i'><init_from>sub/a%20%62.png</init_from></image>",
    "<wrap_s>MIRROR</wrap_s><wrap_t>CLAMP</wrap_t><minfilter>LINEAR_MIPMAP_LINEAR</minfilter>"
    "<magfilter>NEAREST</magfilter>",
    DIFFUSE,
    BY_VERTEX,
    BY_CORNER,
    "1 1 1",
    "g",
    BIND(7)};

static bool load(struct pieces p, struct scene *s, struct err *e)
{
    char text[16384];
    int n = snprintf(text, sizeof text, DOCUMENT, p.image, p.sampler, p.channels, p.vertices,
                     p.inputs, p.scale, p.geometry, p.bind);
    assert_true(n > 0 && (size_t)n < sizeof text);
    return collada_parse(text, (size_t)n, test_path("scene.dae"), DIALECT_COLLADA, s, e);
}

/* u = a + b x, v = c y at every corner of a quadrangle that may be mirrored in x. */
static void assert_uv(const struct scene *s, float a, float b, float c)
{
    assert_int_equal(s->num_triangles, 2);
    assert_non_null(s->uv);
    for (int k = 0; k < 6; k++) {
        assert_near(s->uv[k].u, a + b * fabsf(s->position[k].x), 1e-6);
        assert_near(s->uv[k].v, c * s->position[k].y, 1e-6);
    }
}

TEST(a_texture_of_a_diffuse_surface)
{
    OWN(scene) s;
    struct err e = {""};
    MUST(load(PLAIN, &s, &e));
    assert_int_equal(s.num_images, 1);
    assert_int_equal(s.num_textures, 1);
    assert_int_equal(s.materials[0].reflectance_map, 1);
    assert_int_equal(s.materials[0].radiance_map, 0);
    assert_near(s.materials[0].reflectance.g, 1, 0);
    const struct texture *t = s.textures;
    assert_true(t->width == 3 && t->height == 2 && t->nearest);
    assert_int_equal(t->wrap[0], TEXTURE_MIRROR);
    assert_int_equal(t->wrap[1], TEXTURE_CLAMP);
    /* Byte 102 is 0.4, linear ((0.4 + 0.055)/1.055)^2.4 = 0.13287; 10 is 10/255/12.92. The lower left texel is the fourth. */
    rgb c = texture_lookup(t, (struct uv){0.1f, 0.1f});
    assert_near(c.r, 0.13287, 1e-5);
    assert_near(c.g, 10 / 255. / 12.92, 1e-6);
    assert_near(c.b, 1, 1e-6);
    assert_uv(&s, 0, 2, 3);
}

TEST(coordinates_by_binding)
{
    struct scene s;
    struct err e = {""};
    struct pieces p = PLAIN;
    p.bind = BIND(4);
    MUST(load(p, &s, &e));
    assert_uv(&s, 1, -1, 1);
    scene_free(&s);
    p.scale = "-1 1 1"; /* turns the winding */
    MUST(load(p, &s, &e));
    assert_uv(&s, 1, -1, 1);
    scene_free(&s);
    p.bind = ""; /* unbound: the first, which is that of the vertices */
    MUST(load(p, &s, &e));
    assert_uv(&s, 1, -1, 1);
    scene_free(&s);
    p.vertices = "";
    MUST(load(p, &s, &e));
    assert_uv(&s, 0, 2, 3);
    scene_free(&s);
}

TEST(images_are_read_once)
{
    OWN(scene) s;
    struct err e = {""};
    struct pieces p = PLAIN;
    p.channels = DIFFUSE "<emission><texture texture='o' texcoord='UV'/></emission>";
    MUST(load(p, &s, &e));
    assert_int_equal(s.num_images, 1);
    assert_int_equal(s.num_textures, 2);
    assert_false(s.textures[s.materials[0].radiance_map - 1].nearest ==
                 s.textures[s.materials[0].reflectance_map - 1].nearest);
    assert_int_equal(s.textures[s.materials[0].radiance_map - 1].wrap[0] +
                         s.textures[s.materials[0].radiance_map - 1].wrap[1],
                     0);
    assert_int_equal(s.num_lights, 1);
    assert_true(s.lights[0].textured);
}

/* Absolute names, file:// and COLLADA 1.5's <ref>; a % that begins no escape stands for itself. */
TEST(other_names)
{
    static const char *const forms[] = {"%s/sub/a b.png", "file://%s/sub/a%%20b.png",
                                        "<ref>%s/sub/a b.png</ref>", "%s/sub/50%%.png"};
    for (int k = 0; k < 4; k++) {
        char uri[200], image[300];
        OWN(scene) s;
        struct err e = {""};
        struct pieces p = PLAIN;
        snprintf(uri, sizeof uri, forms[k],
                 test_path(".")); // NOLINT(clang-diagnostic-format-nonliteral)
        snprintf(image, sizeof image, "<image id='i'><init_from>%s</init_from></image>", uri);
        p.image = image;
        MUST(load(p, &s, &e));
        assert_int_equal(s.num_images, 1);
    }
}

#define OF(field) offsetof(struct pieces, field)

TEST(what_is_refused)
{
    static const struct {
        size_t field;
        const char *text, *says; /* NULL: it is not */
    } cases[] = {
        {OF(vertices), "", NULL},
        {OF(image), "<image id='i'/>", "scene.dae:2: <image> without <init_from>"},
        {OF(image), "<image id='i'><init_from>none.png</init_from></image>",
         "none.png: cannot read: No such file"},
        {OF(image), "<image id='i'><init_from>http://x/a.png</init_from></image>",
         "an image from 'http://x/a.png' is not"},
        {OF(image), "<image id='i'><init_from>text.png</init_from></image>",
         "text.png: cannot read: not an OpenEXR, PNG"},
        {OF(image), "<image id='i'><init_from>.</init_from></image>",
         "cannot read: Is a directory"},
        {OF(image), "<image id='i'><init_from>bright.exr</init_from></image>",
         "'m': reflectance outside [0,1] in its texture"},
        {OF(sampler), "<wrap_s>MIRROR_ONCE</wrap_s>",
         "scene.dae:3: <wrap_s> is 'MIRROR_ONCE', not one of: WRAP"},
        {OF(sampler), "<magfilter>CUBIC</magfilter>",
         "<magfilter> is 'CUBIC', not one of: NEAREST"},
        {OF(sampler), "<wrap_t>BORDER</wrap_t><border_color>1 0 0 1</border_color>",
         "<border_color> that is not black"},
        {OF(geometry), "ball", "scene.dae:6: a texture on a surface without texture coordinates"},
        {OF(bind), BIND(5), "scene.dae:6: no set 5 of texture coordinates"},
        {OF(channels), DIFFUSE "<emission><texture texture='t' texcoord='OTHER'/></emission>",
         "a second set of texture coordinates in one material"},
        {OF(channels), "<diffuse><texture texture='t'/><color>1 1 1</color></diffuse>",
         "unexpected <color> in <diffuse>"},
        {OF(inputs),
         "<input semantic='TEXCOORD' source='#p' offset='1'/><input semantic='TEXCOORD' source='#c' offset='1'/>",
         "no element with id 'c'"},
    };
    struct scene s;
    struct err e = {""};
    for (size_t k = 0; k < COUNT(cases); k++) {
        struct pieces p = PLAIN;
        memcpy((char *)&p + cases[k].field, &cases[k].text, sizeof cases[k].text);
        if (cases[k].says != NULL) {
            REFUSES(load(p, &s, &e), cases[k].says);
            continue;
        }
        MUST(load(p, &s, &e));
        scene_free(&s);
    }
    struct pieces p = PLAIN;
    p.vertices = "";
    p.inputs = "<input semantic='NORMAL' source='#p' offset='1'/>";
    REFUSES(load(p, &s, &e), "a texture on a surface without texture coordinates");
}

static int setup(void **state)
{
    (void)state;
    struct err e;
    OWN(image) bright = build_image(2, 2);
    const uint8_t pixel[3 * 6] = {0, 0, 0, 1, 1, 1, 2, 2, 2, 102, 10, 255, 4, 4, 4, 5, 5, 5};
    bright.data[4] = 1.5f;
    MUST(fs_make_dirs(test_path("sub"), &e) &&
         image_write_png(test_path("sub/a b.png"), 3, 2, pixel, &e) &&
         image_write_png(test_path("sub/50%.png"), 3, 2, pixel, &e) &&
         image_write_exr(test_path("bright.exr"), &bright, &e));
    test_write_text(test_path("text.png"), "no image");
    return 0;
}

TEST_GROUP(setup, NULL)
