/* The Mitsuba 3 scene is read back with libxml2, its meshes from their bytes, and held against the
 * scene by routes of its own: sums over triangles, rays through the matrix and the angle in the file,
 * Mitsuba's interpolation of its environment as its documentation has it. Mitsuba itself was not to be
 * had; a path tracer that reads the same file is run by end_to_end.sh. */
#define _GNU_SOURCE
#include "tests/support/build_scene.h"

#include "reference/mitsuba/export_mitsuba.h"
#include "reference/base/image_oiio.h"
#include "renderer/scene/environment.h"
#include "renderer/base/fs.h"
#include "renderer/image/image.h"
#include "tests/support/test.h"

#include <gsl/gsl_math.h>
#include <libxml/parser.h>
#include <libxml/tree.h>

#define assert_near(a, b, epsilon) assert_true(fabs((double)(a) - (double)(b)) <= (epsilon))

static char dir[64];

static int set_up(void **state)
{
    (void)state;
    strcpy(dir, "/tmp/assay_mitsuba_XXXXXX");
    return mkdtemp(dir) != NULL ? 0 : -1;
}
static int tear_down(void **state)
{
    (void)state;
    struct err e;
    return fs_remove_tree(dir, &e) ? 0 : -1;
}

static const char *path_of(const char *name)
{
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", dir, name);
    return path;
}

static struct camera finish(struct scene *s)
{
    struct err e;
    struct camera c = {0};
    if (!scene_finish(s, "test", &e) || !camera_init(&c, s, 40, 30, &e))
        fail_msg("%s", e.msg);
    return c;
}

static xmlNode *child(xmlNode *n, const char *tag, const char *name)
{
    for (xmlNode *c = n->children; c != NULL; c = c->next) {
        xmlChar *value = xmlGetProp(c, BAD_CAST "name");
        bool found = xmlStrEqual(c->name, BAD_CAST tag) &&
                     (name == NULL || xmlStrEqual(value, BAD_CAST name));
        xmlFree(value);
        if (found)
            return c;
    }
    return NULL;
}

static void get(xmlNode *n, const char *attribute, char out[512])
{
    assert_non_null(n);
    xmlChar *value = xmlGetProp(n, BAD_CAST attribute);
    assert_non_null(value);
    snprintf(out, 512, "%s", (char *)value);
    xmlFree(value);
}

static bool has(xmlNode *n, const char *attribute, const char *want)
{
    char text[512];
    get(n, attribute, text);
    return strcmp(text, want) == 0;
}

static double number(xmlNode *parent, const char *tag, const char *name)
{
    char text[512], *end;
    get(child(parent, tag, name), "value", text);
    double v = strtod(text, &end);
    assert_true(end != text && *end == '\0');
    return v;
}

static void assert_rgb(xmlNode *parent, const char *name, double r, double g, double b)
{
    char text[512];
    double v[3];
    get(child(parent, "rgb", name), "value", text);
    assert_int_equal(sscanf(text, "%lf, %lf, %lf", &v[0], &v[1], &v[2]), 3);
    assert_near(v[0], r, 1e-6 * fabs(r));
    assert_near(v[1], g, 1e-6 * fabs(g));
    assert_near(v[2], b, 1e-6 * fabs(b));
}

static void assert_xyz(xmlNode *n, double x, double y, double z)
{
    const double want[3] = {x, y, z};
    for (int k = 0; k < 3; k++) {
        char text[512];
        get(n, (const char *[]){"x", "y", "z"}[k], text);
        assert_near(atof(text), want[k], 1e-6);
    }
}

static void matrix(xmlNode *parent, double m[16])
{
    char text[512], *at = text;
    get(child(child(parent, "transform", "to_world"), "matrix", NULL), "value", text);
    for (int i = 0; i < 16; i++)
        m[i] = strtod(at, &at);
    assert_true(*at == '\0');
    assert_true(m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1);
}

/* The element of that tag and type, the nth. */
static xmlNode *typed(xmlNode *root, const char *tag, const char *type, int nth)
{
    for (xmlNode *n = root->children; n != NULL; n = n->next)
        if (n->type == XML_ELEMENT_NODE && xmlStrEqual(n->name, BAD_CAST tag) &&
            has(n, "type", type) && nth-- == 0)
            return n;
    return NULL;
}

/* Every file that is named exists; every reference has its element; no id twice. */
static void check_references(xmlNode *root, xmlNode *n)
{
    char text[512], path[1024];
    for (xmlNode *c = n->children; c != NULL; c = c->next) {
        if (c->type != XML_ELEMENT_NODE)
            continue;
        if (xmlStrEqual(c->name, BAD_CAST "ref")) {
            int found = 0;
            get(c, "id", text);
            for (xmlNode *b = root->children; b != NULL; b = b->next)
                found += b->type == XML_ELEMENT_NODE && xmlHasProp(b, BAD_CAST "id") != NULL &&
                         has(b, "id", text);
            assert_int_equal(found, 1);
        }
        if (xmlStrEqual(c->name, BAD_CAST "string") && has(c, "name", "filename")) {
            get(c, "value", text);
            assert_null(strchr(text, '/'));
            snprintf(path, sizeof path, "%s/%s", dir, text);
            assert_int_equal(access(path, R_OK), 0);
        }
        check_references(root, c);
    }
}

static xmlDoc *export(const struct scene *s, const struct camera *c, int depth)
{
    struct err e;
    MUST(export_mitsuba(s, c, depth, path_of("scene.xml"), &e));
    xmlDoc *doc = xmlReadFile(path_of("scene.xml"), NULL, XML_PARSE_NONET);
    assert_non_null(doc);
    xmlNode *root = xmlDocGetRootElement(doc);
    assert_true(xmlStrEqual(root->name, BAD_CAST "scene"));
    assert_true(has(root, "version", "3.0.0"));
    check_references(root, root);
    return doc;
}

/* What is summed over a mesh: triangles, area, the sum of positions weighted by 1, 2, 3 .. over the
 * vertices (so that order matters), of normals likewise. */
struct sums {
    uint32_t triangles;
    double area, position[3], normal[3];
};

static void add_triangle(struct sums *s, const vec3 p[3], const vec3 *n)
{
    vec3 x = cross(sub(p[1], p[0]), sub(p[2], p[0]));
    s->area += 0.5 * sqrt((double)dot(x, x));
    for (int k = 0; k < 3; k++) {
        double weight = 3.0 * s->triangles + k + 1;
        s->position[0] += weight * (double)p[k].x;
        s->position[1] += weight * (double)p[k].y;
        s->position[2] += weight * (double)p[k].z;
        if (n != NULL) {
            s->normal[0] += weight * (double)n[k].x;
            s->normal[1] += weight * (double)n[k].y;
            s->normal[2] += weight * (double)n[k].z;
        }
    }
    s->triangles++;
}

static void assert_same(const struct sums *a, const struct sums *b)
{
    assert_int_equal(a->triangles, b->triangles);
    assert_near(a->area, b->area, 1e-6);
    for (int k = 0; k < 3; k++) {
        assert_near(a->position[k], b->position[k], 1e-5);
        assert_near(a->normal[k], b->normal[k], 1e-5);
    }
}

static struct sums read_ply(const char *name, bool smooth)
{
    char line[128], header[1024] = "";
    unsigned vertices = 0, faces = 0;
    FILE *f = fopen(path_of(name), "rb");
    assert_non_null(f);
    while (fgets(line, sizeof line, f) != NULL && strcmp(line, "end_header\n") != 0) {
        strcat(header, line);
        sscanf(line, "element vertex %u", &vertices);
        sscanf(line, "element face %u", &faces);
    }
    assert_non_null(strstr(header, "ply\nformat binary_little_endian 1.0\n"));
    assert_int_equal(strstr(header, "property float nz\n") != NULL, smooth);
    float v[64][6] = {{0}};
    assert_true(vertices <= 64);
    for (unsigned i = 0; i < vertices; i++)
        assert_int_equal(fread(v[i], sizeof(float), smooth ? 6 : 3, f), smooth ? 6 : 3);
    struct sums sums = {0};
    for (unsigned i = 0; i < faces; i++) {
        uint32_t at[3];
        vec3 p[3], n[3];
        assert_int_equal(fgetc(f), 3);
        assert_int_equal(fread(at, 4, 3, f), 3);
        for (int k = 0; k < 3; k++) {
            assert_true(at[k] < vertices);
            p[k] = v3(v[at[k]][0], v[at[k]][1], v[at[k]][2]);
            n[k] = v3(v[at[k]][3], v[at[k]][4], v[at[k]][5]);
        }
        add_triangle(&sums, p, smooth ? n : NULL);
    }
    assert_int_equal(fgetc(f), EOF);
    fclose(f);
    return sums;
}

static struct sums sums_of(const struct scene *s, uint32_t object, bool smooth)
{
    const struct object *o = &s->objects[object];
    struct sums sums = {0};
    for (size_t i = o->first_triangle; i < o->first_triangle + o->num_triangles; i++)
        add_triangle(&sums, s->position + 3 * i, smooth ? s->normal + 3 * i : NULL);
    return sums;
}

TEST(meshes_and_spheres)
{
    struct scene s = build_scene();
    uint32_t grey_half = build_material(&s, grey(.5f), grey(0));
    uint32_t lamp = build_material(&s, (rgb){.1f, .2f, .3f}, (rgb){4, 5, 6});
    build_quad(&s, v3(-1, 0, -5), v3(2, 0, 0), v3(0, 3, 0.5f), grey_half);
    build_triangle(&s, v3(0, 0, -4), v3(1, 0, -4), v3(0, 1, -4.5f), lamp);
    build_triangle(&s, v3(0, 0, -3), v3(1, 0, -3), v3(0, 1, -3.5f), grey_half);
    s.normal[3 * 3 + 1] = normalize(v3(.3f, .4f, 1));
    build_sphere(&s, v3(.25f, .5f, -6), 1.5f, -1, lamp);
    build_camera(&s, v3(0, 0, 0), 50);
    struct camera c = finish(&s);
    xmlDoc *doc = export(&s, &c, 3);
    xmlNode *root = xmlDocGetRootElement(doc);

    struct sums got[3] = {read_ply("scene_object_0.ply", false),
                          read_ply("scene_object_1.ply", false),
                          read_ply("scene_object_2.ply", true)};
    for (uint32_t i = 0; i < 3; i++) {
        struct sums want = sums_of(&s, i, i == 2);
        assert_same(&got[i], &want);
        xmlNode *shape = typed(root, "shape", "ply", (int)i);
        assert_true(
            has(child(shape, "boolean", "face_normals"), "value", i == 2 ? "false" : "true"));
        assert_true(has(child(shape, "ref", NULL), "id", i == 1 ? "material_1" : "material_0"));
        assert_int_equal(child(shape, "emitter", NULL) != NULL, i == 1);
    }
    /* The quad: |(2,0,0) x (0,3,.5)| = 2 sqrt(9.25). */
    assert_near(got[0].area, 2 * sqrt(9.25), 1e-6);
    assert_rgb(child(typed(root, "shape", "ply", 1), "emitter", NULL), "radiance", 4, 5, 6);
    xmlNode *ball = typed(root, "shape", "sphere", 0);
    assert_xyz(child(ball, "point", "center"), .25, .5, -6);
    assert_near(number(ball, "float", "radius"), 1.5, 0);
    assert_true(has(child(ball, "boolean", "flip_normals"), "value", "true"));
    assert_rgb(child(ball, "emitter", NULL), "radiance", 4, 5, 6);
    /* Mitsuba counts the light that is seen directly as one. */
    assert_true(number(child(root, "integrator", NULL), "integer", "max_depth") == 4);
    xmlFreeDoc(doc);
    scene_free(&s);
}

/* Rays of the file's camera: +X is left, +Z forward, the angle is that of the width. */
TEST(camera_rays)
{
    for (int lens = 0; lens < 2; lens++) {
        struct scene s = build_scene();
        build_quad(&s, v3(-50, -50, -20), v3(100, 0, 0), v3(0, 100, 0),
                   build_material(&s, grey(.5f), grey(0)));
        build_camera(&s, v3(1, 2, 3), 65);
        s.camera.right = v3(.6f, 0, -.8f);
        s.camera.backward = v3(.8f, 0, .6f);
        struct camera c = finish(&s);
        c.lens_radius = lens ? 0.25f : 0;
        c.focal_distance = lens ? 7 : 0;
        xmlDoc *doc = export(&s, &c, 0);
        xmlNode *sensor =
            typed(xmlDocGetRootElement(doc), "sensor", lens ? "thinlens" : "perspective", 0);
        double m[16], half = tan(number(sensor, "float", "fov") * M_PI / 360);
        assert_true(has(child(sensor, "string", "fov_axis"), "value", "x"));
        xmlNode *film = child(sensor, "film", NULL);
        double w = number(film, "integer", "width"), h = number(film, "integer", "height");
        assert_true(w == 40 && h == 30);
        assert_true(has(child(film, "rfilter", NULL), "type", "box"));
        assert_true(has(child(film, "string", "component_format"), "value", "float32"));
        assert_true(
            has(child(child(sensor, "sampler", NULL), "integer", "seed"), "value", "$seed"));
        matrix(sensor, m);
        if (lens) {
            assert_near(number(sensor, "float", "aperture_radius"), .25, 0);
            assert_near(number(sensor, "float", "focus_distance"), 7, 0);
        }
        c.lens_radius = 0;
        for (int i = 0; i < 12; i++) {
            double x = 37.3 * (i % 4) / 3, y = 29.1 * (i / 4) / 2;
            ray want = camera_ray(&c, (float)x, (float)y, 0, 0);
            double a = (1 - 2 * x / w) * half, b = (1 - 2 * y / h) * half * h / w;
            double d[3], length2 = a * a + b * b + 1;
            for (int k = 0; k < 3; k++)
                d[k] = (m[4 * k] * a + m[4 * k + 1] * b + m[4 * k + 2]) / sqrt(length2);
            assert_near(d[0], want.d.x, 1e-6);
            assert_near(d[1], want.d.y, 1e-6);
            assert_near(d[2], want.d.z, 1e-6);
            assert_near(m[3], want.o.x, 1e-6);
            assert_near(m[7], want.o.y, 1e-6);
            assert_near(m[11], want.o.z, 1e-6);
        }
        xmlFreeDoc(doc);
        scene_free(&s);
    }
}

TEST(materials)
{
    static const struct material all[] = {
        {.kind = MATERIAL_DIFFUSE, .reflectance = {.1f, .2f, .3f}},
        {.kind = MATERIAL_MIRROR, .reflectance = {.9f, .8f, .7f}},
        {.kind = MATERIAL_GLASS,
         .ior = 1.5f,
         .reflectance = {1, .5f, .25f},
         .transmittance = {.2f, .4f, .8f}},
        {.kind = MATERIAL_MICROFACET,
         .microfacet = MICROFACET_GGX,
         .alpha = .25f,
         .separable = true,
         .conductor = true,
         .eta = {.2f, 1.5f, 1.25f},
         .k = {3, 3, 3}},
        {.kind = MATERIAL_MICROFACET,
         .microfacet = MICROFACET_BECKMANN,
         .alpha = .5f,
         .separable = true,
         .reflectance = {.9f, .8f, .7f}},
    };
    enum { NUM = sizeof all / sizeof *all };
    struct scene s = build_scene();
    for (uint32_t i = 0; i < NUM; i++) {
        uint32_t m = build_material(&s, grey(0), grey(0));
        s.materials[m] = all[i];
        build_triangle(&s, v3(0, 0, -4), v3(1, 0, -4), v3(0, 1, -4), m);
    }
    build_camera(&s, v3(0, 0, 0), 50);
    struct camera c = finish(&s);
    xmlDoc *doc = export(&s, &c, 3);
    xmlNode *root = xmlDocGetRootElement(doc), *b[NUM];
    for (int i = 0, t = 0; i < NUM; i++) {
        xmlNode *n =
            i == 2 ? typed(root, "bsdf", "dielectric", 0) : typed(root, "bsdf", "twosided", t++);
        char id[32];
        snprintf(id, sizeof id, "material_%d", i);
        assert_true(has(n, "id", id));
        b[i] = i == 2 ? n : child(n, "bsdf", NULL);
        assert_non_null(b[i]);
    }
    assert_true(has(b[0], "type", "diffuse"));
    assert_rgb(b[0], "reflectance", .1, .2, .3);
    assert_true(has(b[1], "type", "conductor"));
    assert_true(has(child(b[1], "string", "material"), "value", "none"));
    assert_rgb(b[1], "specular_reflectance", .9, .8, .7);
    assert_near(number(b[2], "float", "int_ior"), 1.5, 0);
    assert_near(number(b[2], "float", "ext_ior"), 1, 0);
    assert_rgb(b[2], "specular_reflectance", 1, .5, .25);
    assert_rgb(b[2], "specular_transmittance", .2, .4, .8);
    assert_true(has(b[3], "type", "roughconductor"));
    assert_true(has(child(b[3], "string", "distribution"), "value", "ggx"));
    assert_near(number(b[3], "float", "alpha"), .25, 0);
    /* Grey: a number. Coloured and above 1: a picture. */
    assert_near(number(b[3], "spectrum", "k"), 3, 0);
    char name[512];
    get(child(child(b[3], "texture", "eta"), "string", "filename"), "value", name);
    assert_true(has(child(child(b[3], "texture", "eta"), "boolean", "raw"), "value", "true"));
    struct image im;
    struct err e;
    bool half;
    MUST(image_read(path_of(name), &im, &half, &e));
    assert_false(half);
    for (int i = 0; i < im.width * im.height; i++)
        assert_true(im.data[3 * i] == .2f && im.data[3 * i + 1] == 1.5f &&
                    im.data[3 * i + 2] == 1.25f);
    image_free(&im);
    assert_true(has(child(b[4], "string", "distribution"), "value", "beckmann"));
    assert_rgb(b[4], "specular_reflectance", .9, .8, .7);
    xmlFreeDoc(doc);
    scene_free(&s);
}

static struct scene lit_by(struct light l)
{
    struct scene s = build_scene();
    build_triangle(&s, v3(0, 0, -4), v3(1, 0, -4), v3(0, 1, -4),
                   build_material(&s, grey(.5f), grey(0)));
    build_light(&s, l);
    build_camera(&s, v3(0, 0, 0), 50);
    return s;
}

TEST(lights)
{
    const struct light all[] = {
        {.kind = LIGHT_POINT, .value = {2, 4, 6}, .position = {1, 2, 3}, .attenuation = {0, 0, 2}},
        {.kind = LIGHT_DIRECTIONAL, .value = {2, 4, 6}, .to_light = {0, .6f, .8f}},
        {.kind = LIGHT_SPOT,
         .value = {2, 4, 6},
         .position = {1, 2, 3},
         .axis = {.6f, 0, -.8f},
         .cos_cutoff = .5f,
         .attenuation = {0, 0, 1}},
    };
    for (int i = 0; i < 3; i++) {
        struct scene s = lit_by(all[i]);
        struct camera c = finish(&s);
        xmlDoc *doc = export(&s, &c, 1);
        xmlNode *n = child(xmlDocGetRootElement(doc), "emitter", NULL);
        if (i == 0) {
            assert_true(has(n, "type", "point"));
            assert_xyz(child(n, "point", "position"), 1, 2, 3);
            assert_rgb(n, "intensity", 1, 2, 3); /* value / attenuation */
        } else if (i == 1) {
            assert_true(has(n, "type", "directional"));
            assert_xyz(child(n, "vector", "direction"), 0, -.6, -.8); /* the way it travels */
            assert_rgb(n, "irradiance", 2, 4, 6);
        } else {
            double m[16];
            assert_true(has(n, "type", "spot"));
            assert_rgb(n, "intensity", 2, 4, 6);
            assert_near(number(n, "float", "cutoff_angle"), 60, 1e-5);
            assert_near(number(n, "float", "beam_width"), 60, 1e-5);
            matrix(n, m); /* +Z to the axis, the origin to the position, and a rotation */
            assert_near(m[2], .6, 1e-6);
            assert_near(m[6], 0, 1e-6);
            assert_near(m[10], -.8, 1e-6);
            assert_true(m[3] == 1 && m[7] == 2 && m[11] == 3);
            for (int a = 0; a < 3; a++)
                for (int b = 0; b < 3; b++)
                    assert_near(m[a] * m[b] + m[4 + a] * m[4 + b] + m[8 + a] * m[8 + b], a == b,
                                1e-6);
        }
        xmlFreeDoc(doc);
        scene_free(&s);
    }
}

/* Mitsuba's radiance from direction w: local = to_world^-1 w, u = atan2(x, -z) / 2 pi, v = acos(y) / pi;
 * texels are at u = (column + 1/2)/W and v = row/(H-1), bilinear, around in u. */
static double mitsuba_sky(const struct image *im, const double m[16], vec3 w, int channel)
{
    double l[3];
    for (int k = 0; k < 3; k++)
        l[k] = m[k] * (double)w.x + m[4 + k] * (double)w.y + m[8 + k] * (double)w.z;
    double u = atan2(l[0], -l[2]) / (2 * M_PI), v = acos(l[1]) / M_PI;
    double x = (u - floor(u)) * im->width - 0.5, y = v * (im->height - 1);
    int row = (int)fmin(y, im->height - 2), column = (int)floor(x);
    double fx = x - column, fy = y - row, sum = 0;
    for (int k = 0; k < 4; k++) {
        int c = (column + k % 2 + im->width) % im->width, r = row + k / 2;
        sum += (k % 2 ? fx : 1 - fx) * (k / 2 ? fy : 1 - fy) *
               (double)im->data[3 * (r * im->width + c) + channel];
    }
    return sum;
}

TEST(environment_pictures)
{
    static const char *const names[3] = {"R", "G", "B"};
    struct err e;
    struct image im, got;
    bool half;
    assert_true(image_alloc(&im, 6, 5, 3, names, &e));
    srand(7);
    for (int i = 0; i < 6 * 5 * 3; i++)
        im.data[i] = (float)(rand() % 1000) / 100;
    struct scene s = lit_by(
        (struct light){.kind = LIGHT_DIRECTIONAL, .value = {1, 1, 1}, .to_light = {0, 1, 0}});
    struct camera c = finish(&s);
    assert_true(scene_add_environment(&s, environment_from_image(&im, "test", &e), &e));
    xmlDoc *doc = export(&s, &c, 1);
    xmlNode *n = typed(xmlDocGetRootElement(doc), "emitter", "envmap", 0);
    double m[16];
    matrix(n, m);
    char name[512];
    get(child(n, "string", "filename"), "value", name);
    MUST(image_read(path_of(name), &got, &half, &e));
    assert_false(half);
    for (int i = 0; i < 2000; i++) {
        double y = 1 - 2 * (i + .5) / 2000, phi = 2.399963 * i, r = sqrt(1 - y * y);
        vec3 w = v3((float)(r * cos(phi)), (float)y, (float)(r * sin(phi)));
        rgb want = environment_radiance(s.environment, w);
        assert_near(mitsuba_sky(&got, m, w, 0), want.r, 2e-4);
        assert_near(mitsuba_sky(&got, m, w, 1), want.g, 2e-4);
        assert_near(mitsuba_sky(&got, m, w, 2), want.b, 2e-4);
    }
    /* Turned the other way around it is another sky: the comparison can fail. */
    double turned[16], worst = 0;
    memcpy(turned, m, sizeof turned);
    for (int k = 0; k < 3; k++)
        turned[4 * k] = -turned[4 * k];
    for (int i = 0; i < 100; i++) {
        vec3 w = normalize(v3((float)cos(i), .3f, (float)sin(i)));
        worst = fmax(worst, fabs(mitsuba_sky(&got, turned, w, 0) -
                                 (double)environment_radiance(s.environment, w).r));
    }
    assert_true(worst > 0.1);
    image_free(&im);
    image_free(&got);
    xmlFreeDoc(doc);
    scene_free(&s);

    s = lit_by(
        (struct light){.kind = LIGHT_DIRECTIONAL, .value = {1, 1, 1}, .to_light = {0, 1, 0}});
    c = finish(&s);
    assert_true(scene_add_environment(&s, environment_constant((rgb){1, 2, 3}, &e), &e));
    doc = export(&s, &c, 1);
    n = typed(xmlDocGetRootElement(doc), "emitter", "constant", 0);
    assert_rgb(n, "radiance", 1, 2, 3);
    xmlFreeDoc(doc);
    scene_free(&s);
}

static void refuse(struct scene *s, struct camera *c, const char *pattern)
{
    struct err e = {0};
    struct camera built = c != NULL ? *c : finish(s);
    assert_false(export_mitsuba(s, &built, 3, path_of("refused.xml"), &e));
    if (strstr(e.msg, pattern) == NULL)
        fail_msg("'%s' instead of '%s'", e.msg, pattern);
    assert_int_not_equal(access(path_of("refused.xml"), F_OK), 0);
    scene_free(s);
}

TEST(what_it_has_not_is_refused)
{
    const struct {
        struct material m;
        const char *pattern;
    } bad[] = {
        {{.kind = MATERIAL_REFRACTION, .ior = 1.5f}, "only refracts"},
        {{.kind = MATERIAL_GLASS, .ior = 1.5f, .schlick = true}, "Schlick"},
        {{.kind = MATERIAL_MICROFACET, .alpha = .2f}, "correlated"},
        {{.radiance = {1, 1, 1}, .radiance_both_sides = true}, "both sides"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct scene s = build_scene();
        uint32_t m = build_material(&s, grey(0), grey(0));
        s.materials[m] = bad[i].m;
        build_triangle(&s, v3(0, 0, -4), v3(1, 0, -4), v3(0, 1, -4), m);
        build_camera(&s, v3(0, 0, 0), 50);
        refuse(&s, NULL, bad[i].pattern);
    }
    const struct light point = {.kind = LIGHT_POINT, .value = {1, 1, 1}, .attenuation = {1, 0, 0}};
    struct scene s = lit_by(point);
    refuse(&s, NULL, "not the inverse square");
    s = lit_by((struct light){.kind = LIGHT_SPOT,
                              .value = {1, 1, 1},
                              .axis = {0, 1, 0},
                              .exponent = 2,
                              .attenuation = {0, 0, 1}});
    refuse(&s, NULL, "power of the cosine");
    for (int i = 0; i < 4; i++) {
        s = lit_by(
            (struct light){.kind = LIGHT_DIRECTIONAL, .value = {1, 1, 1}, .to_light = {0, 1, 0}});
        if (i == 3)
            s.normal[1] = normalize(v3(1, 0, -.1f));
        struct camera c = finish(&s);
        if (i == 0)
            c.tan_v *= 1.01f;
        if (i == 1)
            c.near = 5;
        if (i == 2)
            c.right = normalize(v3(1, .01f, 0));
        refuse(
            &s, &c,
            (const char *[]){"not square", "may cut", "not orthogonal", "behind its triangle"}[i]);
    }
}

TEST_GROUP(set_up, tear_down)
