/* The pbrt-v4 scene is read back by a small reader of its file format (pbrt.org/fileformat-v4): which
 * statements there are and in which order, which parameters of which type each of them takes, how many
 * numbers. Then its numbers are held against the scene. pbrt itself was not to be had. */
#define _GNU_SOURCE
#include "tests/support/build_scene.h"

#include "reference/pbrt/export_pbrt.h"
#include "renderer/scene/environment.h"
#include "tests/support/test.h"

#include <ctype.h>
#include <gsl/gsl_math.h>

#define assert_near(a, b, epsilon) assert_true(fabs((double)(a) - (double)(b)) <= (epsilon))

enum { MAX_STATEMENTS = 64, MAX_PARAMETERS = 8, MAX_NUMBERS = 256 };

struct parameter {
    char type[16], name[32], text[64]; /* text: of a string or bool */
    double number[MAX_NUMBERS];
    int count;
};

struct statement {
    char name[64], plugin[64];
    double number[16]; /* Transform, Translate */
    struct parameter parameter[MAX_PARAMETERS];
    int parameters;
};

static struct statement file[MAX_STATEMENTS];
static int statements;

/* What each plugin takes, from the description of the format; only what is used here. */
static const struct {
    const char *statement, *plugin, *parameters;
} LEGAL[] = {
    {"Integrator", "path", "integer maxdepth,bool regularize,string lightsampler,"},
    {"Camera", "perspective",
     "float fov,float screenwindow,float lensradius,float focaldistance,float frameaspectratio,"},
    {"Film", "rgb", "integer xresolution,integer yresolution,bool savefp16,string filename,"},
    {"PixelFilter", "box", "float xradius,float yradius,"},
    {"Sampler", "independent", "integer pixelsamples,integer seed,"},
    {"LightSource", "point", "rgb I,float scale,float power,point3 from,"},
    {"LightSource", "spot",
     "rgb I,float scale,float power,point3 from,point3 to,float coneangle,float conedeltaangle,"},
    {"LightSource", "distant", "rgb L,float scale,float illuminance,point3 from,point3 to,"},
    {"LightSource", "infinite", "rgb L,float scale,float illuminance,string filename,"},
    {"AreaLightSource", "diffuse", "rgb L,float scale,float power,bool twosided,"},
    {"Shape", "trianglemesh", "integer indices,point3 P,normal N,point2 uv,"},
    {"Shape", "sphere", "float radius,float zmin,float zmax,float phimax,"},
    {"MakeNamedMaterial", NULL,
     "string type,rgb reflectance,rgb eta,rgb k,float eta,float roughness,bool remaproughness,"},
    {"NamedMaterial", NULL, ""},
};

/* Takes one token: a quoted text (without quotes, *quoted), a bracket, or a word. */
static bool token(const char **at, char out[64], bool *quoted)
{
    for (;;) {
        *at += strspn(*at, " \n");
        if (**at != '#')
            break;
        *at += strcspn(*at, "\n");
    }
    if (**at == '\0')
        return false;
    *quoted = **at == '"';
    size_t n = *quoted              ? strcspn(*at + 1, "\"\n")
               : strchr("[]", **at) ? 1
                                    : strcspn(*at, " \n[]\"#");
    assert_true(n < 64);
    memcpy(out, *at + *quoted, n);
    out[n] = '\0';
    *at += n + *quoted;
    if (*quoted) {
        assert_true(**at == '"');
        ++*at;
    }
    return true;
}

static double to_number(const char *text)
{
    char *end;
    double v = strtod(text, &end);
    if (end == text || *end != '\0' || !isfinite(v))
        fail_msg("'%s' is not a number", text);
    return v;
}

static int numbers_of(const char *type)
{
    return strcmp(type, "rgb") == 0 || strcmp(type, "point3") == 0 || strcmp(type, "normal") == 0
               ? 3
               : 1;
}

/* "type name" was read; its values in brackets follow. */
static void read_parameter(const char **at, const char *head, struct statement *s)
{
    assert_true(s->parameters < MAX_PARAMETERS);
    struct parameter *p = &s->parameter[s->parameters++];
    char t[64];
    bool quoted;
    assert_int_equal(sscanf(head, "%15s %31s", p->type, p->name), 2);
    assert_true(token(at, t, &quoted) && !quoted && strcmp(t, "[") == 0);
    while (token(at, t, &quoted) && strcmp(t, "]") != 0) {
        assert_int_equal(quoted, strcmp(p->type, "string") == 0);
        assert_true(p->count < MAX_NUMBERS);
        if (quoted || strcmp(p->type, "bool") == 0)
            strcpy(p->text, t);
        else
            p->number[p->count] = to_number(t);
        if (strcmp(p->type, "integer") == 0)
            assert_null(strpbrk(t, ".e"));
        if (strcmp(p->type, "bool") == 0)
            assert_true(strcmp(t, "true") == 0 || strcmp(t, "false") == 0);
        p->count++;
    }
    assert_string_equal(t, "]");
    assert_true(p->count > 0 && p->count % numbers_of(p->type) == 0);
}

static void check_legal(const struct statement *s)
{
    for (size_t i = 0; i < sizeof LEGAL / sizeof *LEGAL; i++) {
        if (strcmp(LEGAL[i].statement, s->name) != 0 ||
            (LEGAL[i].plugin != NULL && strcmp(LEGAL[i].plugin, s->plugin) != 0))
            continue;
        for (int k = 0; k < s->parameters; k++) {
            char entry[64];
            snprintf(entry, sizeof entry, "%s %s,", s->parameter[k].type, s->parameter[k].name);
            if (strstr(LEGAL[i].parameters, entry) == NULL)
                fail_msg("%s \"%s\" takes no %s", s->name, s->plugin, entry);
        }
        return;
    }
    fail_msg("unknown statement %s \"%s\"", s->name, s->plugin);
}

static void read_statement(const char **at, const char *name)
{
    assert_true(statements < MAX_STATEMENTS);
    struct statement *s = &file[statements++];
    char t[64];
    bool quoted;
    *s = (struct statement){0};
    snprintf(s->name, sizeof s->name, "%s", name);
    bool alone = strcmp(name, "WorldBegin") == 0 || strcmp(name, "AttributeBegin") == 0 ||
                 strcmp(name, "AttributeEnd") == 0 || strcmp(name, "ReverseOrientation") == 0;
    bool is_transform = strcmp(name, "Transform") == 0;
    if (alone)
        return;
    if (is_transform || strcmp(name, "Translate") == 0) {
        if (is_transform)
            assert_true(token(at, t, &quoted) && strcmp(t, "[") == 0);
        for (int k = 0; k < (is_transform ? 16 : 3); k++) {
            assert_true(token(at, t, &quoted) && !quoted);
            s->number[k] = to_number(t);
        }
        if (is_transform)
            assert_true(token(at, t, &quoted) && strcmp(t, "]") == 0);
        return;
    }
    assert_true(token(at, t, &quoted) && quoted);
    snprintf(s->plugin, sizeof s->plugin, "%s", t);
    for (const char *next = *at; token(&next, t, &quoted) && quoted; next = *at) {
        *at = next;
        read_parameter(at, t, s);
    }
    check_legal(s);
}

static const struct statement *find(const char *name, const char *plugin, int nth)
{
    for (int i = 0; i < statements; i++)
        if (strcmp(file[i].name, name) == 0 &&
            (plugin == NULL || strcmp(file[i].plugin, plugin) == 0) && nth-- == 0)
            return &file[i];
    return NULL;
}

static const struct parameter *get(const struct statement *s, const char *name)
{
    assert_non_null(s);
    for (int i = 0; i < s->parameters; i++)
        if (strcmp(s->parameter[i].name, name) == 0)
            return &s->parameter[i];
    return NULL;
}

static void assert_numbers(const struct statement *s, const char *name, int n, double a, double b,
                           double c)
{
    const double want[3] = {a, b, c};
    const struct parameter *p = get(s, name);
    assert_non_null(p);
    assert_int_equal(p->count, n);
    for (int k = 0; k < n; k++)
        assert_near(p->number[k], want[k], 1e-6 * fabs(want[k]));
}

/* Options before WorldBegin, the rest after it; attributes nest; materials are made before use. */
static void check_order(void)
{
    int depth = 0, world = 0;
    for (int i = 0; i < statements; i++) {
        const char *n = file[i].name;
        bool option = strcmp(n, "Integrator") == 0 || strcmp(n, "Camera") == 0 ||
                      strcmp(n, "Film") == 0 || strcmp(n, "PixelFilter") == 0 ||
                      strcmp(n, "Sampler") == 0 || strcmp(n, "Transform") == 0;
        world += strcmp(n, "WorldBegin") == 0;
        depth += strcmp(n, "AttributeBegin") == 0;
        depth -= strcmp(n, "AttributeEnd") == 0;
        assert_true(depth >= 0);
        assert_int_equal(world, option ? 0 : 1);
        if (strcmp(n, "NamedMaterial") == 0) {
            const struct statement *made = find("MakeNamedMaterial", file[i].plugin, 0);
            assert_true(made != NULL && made < &file[i]);
        }
    }
    assert_int_equal(depth, 0);
    assert_int_equal(world, 1);
}

static void export(const struct scene *s, const struct camera *c, int depth)
{
    char *text, t[64];
    size_t size;
    struct err e;
    bool quoted;
    FILE *f = open_memstream(&text, &size);
    assert_non_null(f);
    MUST(export_pbrt(s, c, depth, f, &e));
    fclose(f);
    statements = 0;
    for (const char *at = text; token(&at, t, &quoted);) {
        assert_false(quoted);
        read_statement(&at, t);
    }
    free(text);
    check_order();
}

static struct camera finish(struct scene *s)
{
    struct err e;
    struct camera c = {0};
    if (!scene_finish(s, "test", &e) || !camera_init(&c, s, 40, 30, &e))
        fail_msg("%s", e.msg);
    return c;
}

static struct scene triangle_of(struct material m)
{
    struct scene s = build_scene();
    uint32_t index = build_material(&s, grey(0), grey(0));
    s.materials[index] = m;
    build_triangle(&s, v3(0, 0, -4), v3(1, 0, -4), v3(0, 1, -4), index);
    build_camera(&s, v3(0, 0, 0), 50);
    return s;
}

static const struct material GREY = {.kind = MATERIAL_DIFFUSE, .reflectance = {.5f, .5f, .5f}};

TEST(shapes)
{
    struct scene s = build_scene();
    uint32_t m = build_material(&s, (rgb){.1f, .2f, .3f}, grey(0));
    uint32_t lamp = build_material(&s, grey(0), (rgb){4, 5, 6});
    s.materials[lamp].radiance_both_sides = true;
    build_quad(&s, v3(-1, 0, -5), v3(2, 0, 0), v3(0, 3, 0.5f), m);
    build_triangle(&s, v3(0, 0, -3), v3(1, 0, -3), v3(0, 1, -3.5f), m);
    s.normal[7] = normalize(v3(.3f, .4f, 1));
    build_sphere(&s, v3(.25f, .5f, -6), 1.5f, 1, m);
    build_sphere(&s, v3(2, 3, -7), .5f, -1, lamp);
    build_camera(&s, v3(0, 0, 0), 50);
    struct camera c = finish(&s);
    export(&s, &c, 3);
    assert_numbers(find("Integrator", "path", 0), "maxdepth", 1, 3, 0, 0);
    for (int i = 0; i < 2; i++) {
        const struct statement *mesh = find("Shape", "trianglemesh", i);
        const struct parameter *p = get(mesh, "P"), *at = get(mesh, "indices"), *n = get(mesh, "N");
        assert_int_equal(at->count, 3 * (int)s.objects[i].num_triangles);
        assert_int_equal(n != NULL, i == 1);
        double area = 0, want = 0;
        for (int t = 0; t < at->count / 3; t++) {
            double v[3][3];
            for (int k = 0; k < 3; k++) {
                int index = (int)at->number[3 * t + k];
                const vec3 q =
                    s.position[3 * s.objects[i].first_triangle + 3 * (uint32_t)t + (uint32_t)k];
                assert_true(index >= 0 && 3 * index + 2 < p->count);
                for (int a = 0; a < 3; a++)
                    v[k][a] = p->number[3 * index + a];
                assert_near(v[k][0], q.x, 1e-6);
                assert_near(v[k][1], q.y, 1e-6);
                assert_near(v[k][2], q.z, 1e-6);
            }
            double x[3], l2 = 0;
            for (int a = 0; a < 3; a++) {
                int b = (a + 1) % 3, d = (a + 2) % 3;
                x[a] = (v[1][b] - v[0][b]) * (v[2][d] - v[0][d]) -
                       (v[1][d] - v[0][d]) * (v[2][b] - v[0][b]);
                l2 += x[a] * x[a];
            }
            area += sqrt(l2) / 2;
        }
        /* |(2,0,0) x (0,3,.5)|; half of |(1,0,0) x (0,1,-.5)|. */
        want = i == 0 ? 2 * sqrt(9.25) : sqrt(1.25) / 2;
        assert_near(area, want, 1e-6);
        if (n != NULL) {
            assert_int_equal(n->count, 9);
            assert_near(n->number[3], .3 / sqrt(1.25), 1e-6);
            assert_near(n->number[4], .4 / sqrt(1.25), 1e-6);
            assert_near(n->number[8], cos(atan(.5)), 1e-6); /* of the tilted triangle */
        }
    }
    const struct statement *ball = find("Shape", "sphere", 0), *inner = find("Shape", "sphere", 1);
    assert_numbers(ball, "radius", 1, 1.5, 0, 0);
    assert_string_equal(ball[-1].name, "Translate");
    assert_true(ball[-1].number[0] == .25 && ball[-1].number[1] == .5 && ball[-1].number[2] == -6);
    assert_numbers(inner, "radius", 1, .5, 0, 0);
    assert_string_equal(inner[-1].name, "ReverseOrientation");
    const struct statement *light = find("AreaLightSource", "diffuse", 0);
    assert_null(find("AreaLightSource", "diffuse", 1));
    assert_numbers(light, "L", 3, 4, 5, 6);
    assert_string_equal(get(light, "twosided")->text, "true");
    assert_true(light < inner && light > ball);
    scene_free(&s);
}

/* Points along camera_ray()'s rays, through the file's world-to-camera matrix, must fall on the screen
 * at the pixel: x from the left of the window, y from its top, z forward. */
TEST(camera_rays)
{
    struct scene s = build_scene();
    build_quad(&s, v3(-50, -50, -20), v3(100, 0, 0), v3(0, 100, 0),
               build_material(&s, grey(.5f), grey(0)));
    build_camera(&s, v3(1, 2, 3), 65);
    s.camera.right = v3(.6f, 0, -.8f);
    s.camera.backward = v3(.8f, 0, .6f);
    struct camera c = finish(&s);
    c.lens_radius = .25f;
    c.focal_distance = 7;
    export(&s, &c, 0);
    const struct statement *camera = find("Camera", "perspective", 0);
    const double *m = find("Transform", NULL, 0)->number, *w = get(camera, "screenwindow")->number;
    assert_int_equal(get(camera, "screenwindow")->count, 4);
    assert_numbers(camera, "fov", 1, 90, 0, 0); /* so that the screen is at z = 1 */
    assert_numbers(camera, "lensradius", 1, .25, 0, 0);
    assert_numbers(camera, "focaldistance", 1, 7, 0, 0);
    assert_numbers(find("Film", "rgb", 0), "xresolution", 1, 40, 0, 0);
    assert_numbers(find("Film", "rgb", 0), "yresolution", 1, 30, 0, 0);
    assert_string_equal(get(find("Film", "rgb", 0), "savefp16")->text, "false");
    assert_numbers(find("PixelFilter", "box", 0), "xradius", 1, .5, 0, 0);
    /* With a seed in the file the one on the command line would do nothing. */
    assert_null(get(find("Sampler", "independent", 0), "seed"));
    c.lens_radius = 0;
    for (int i = 0; i < 12; i++) {
        double x = 37.3 * (i % 4) / 3, y = 29.1 * (i / 4) / 2, q[3];
        ray r = camera_ray(&c, (float)x, (float)y, 0, 0);
        const double p[3] = {(double)r.o.x + 5 * (double)r.d.x, (double)r.o.y + 5 * (double)r.d.y,
                             (double)r.o.z + 5 * (double)r.d.z};
        for (int k = 0; k < 3; k++) /* columns */
            q[k] = m[k] * p[0] + m[4 + k] * p[1] + m[8 + k] * p[2] + m[12 + k];
        assert_true(q[2] > 0);
        assert_near((q[0] / q[2] - w[0]) / (w[1] - w[0]) * 40, x, 1e-4);
        assert_near((w[3] - q[1] / q[2]) / (w[3] - w[2]) * 30, y, 1e-4);
    }
    assert_true(m[3] == 0 && m[7] == 0 && m[11] == 0 && m[15] == 1);
    scene_free(&s);
}

TEST(materials)
{
    static const struct {
        struct material m;
        const char *type, *parameter;
        double value[3];
        int count;
    } cases[] = {
        {{.kind = MATERIAL_DIFFUSE, .reflectance = {.1f, .2f, .3f}},
         "diffuse",
         "reflectance",
         {.1, .2, .3},
         3},
        {{.kind = MATERIAL_MIRROR, .reflectance = {1, 1, 1}},
         "conductor",
         "reflectance",
         {1, 1, 1},
         3},
        {{.kind = MATERIAL_GLASS,
          .ior = 1.5f,
          .reflectance = {1, 1, 1},
          .transmittance = {1, 1, 1}},
         "dielectric",
         "eta",
         {1.5},
         1},
        {{.kind = MATERIAL_MICROFACET,
          .alpha = .25f,
          .conductor = true,
          .eta = {.2f, 1.5f, 1},
          .k = {3, 2, 1}},
         "conductor",
         "eta",
         {.2, 1.5, 1},
         3},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct scene s = triangle_of(cases[i].m);
        struct camera c = finish(&s);
        export(&s, &c, 1);
        const struct statement *m = find("MakeNamedMaterial", NULL, 0);
        assert_string_equal(get(m, "type")->text, cases[i].type);
        assert_numbers(m, cases[i].parameter, cases[i].count, cases[i].value[0], cases[i].value[1],
                       cases[i].value[2]);
        if (i == 3) {
            assert_numbers(m, "k", 3, 3, 2, 1);
            assert_numbers(m, "roughness", 1, .25, 0, 0);
            assert_string_equal(get(m, "remaproughness")->text, "false");
        }
        scene_free(&s);
    }
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
    for (int i = 0; i < 4; i++) {
        struct err e;
        struct scene s = triangle_of(GREY);
        if (i < 3)
            build_light(&s, all[i]);
        struct camera c = finish(&s);
        if (i == 3)
            assert_true(scene_add_environment(&s, environment_constant((rgb){1, 2, 3}, &e), &e));
        export(&s, &c, 1);
        const struct statement *l = find("LightSource", NULL, 0);
        assert_non_null(l);
        const char *const plugin[] = {"point", "distant", "spot", "infinite"};
        assert_string_equal(l->plugin, plugin[i]);
        if (i == 0) {
            assert_numbers(l, "I", 3, 1, 2, 3);
            assert_numbers(l, "from", 3, 1, 2, 3);
        } else if (i == 1) {
            assert_numbers(l, "L", 3, 2, 4, 6);
            assert_numbers(l, "from", 3, 0, .6, .8);
            assert_numbers(l, "to", 3, 0, 0, 0);
        } else if (i == 2) {
            assert_numbers(l, "I", 3, 2, 4, 6);
            assert_numbers(l, "to", 3, 1.6, 2, 2.2);
            assert_numbers(l, "coneangle", 1, 60, 0, 0);
            assert_numbers(l, "conedeltaangle", 1, 0, 0, 0);
        } else {
            assert_numbers(l, "L", 3, 1, 2, 3);
        }
        scene_free(&s);
    }
}

static void refuse(struct scene *s, const char *pattern)
{
    struct err e = {0};
    struct camera c = finish(s);
    char *text;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    assert_false(export_pbrt(s, &c, 3, f, &e));
    fclose(f);
    free(text);
    if (strstr(e.msg, pattern) == NULL)
        fail_msg("'%s' instead of '%s'", e.msg, pattern);
    scene_free(s);
}

TEST(what_it_has_not_is_refused)
{
    static const struct {
        struct material m;
        const char *pattern;
    } bad[] = {
        {{.kind = MATERIAL_MIRROR, .reflectance = {1, .9f, 1}}, "a mirror whose"},
        {{.kind = MATERIAL_REFRACTION, .ior = 1.5f}, "only refracts"},
        {{.kind = MATERIAL_GLASS, .ior = 1.5f, .schlick = true}, "Schlick"},
        {{.kind = MATERIAL_GLASS,
          .ior = 1.5f,
          .reflectance = {1, 1, 1},
          .transmittance = {1, 1, .5f}},
         "tinted"},
        {{.kind = MATERIAL_MICROFACET, .alpha = .2f, .microfacet = MICROFACET_BECKMANN},
         "Beckmann"},
        {{.kind = MATERIAL_MICROFACET, .alpha = .2f, .separable = true}, "independent"},
        {{.kind = MATERIAL_MICROFACET, .alpha = .2f, .reflectance = {.5f, .5f, .5f}},
         "without an index"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct scene s = triangle_of(bad[i].m);
        refuse(&s, bad[i].pattern);
    }
    struct scene s = triangle_of(GREY);
    build_light(&s,
                (struct light){.kind = LIGHT_POINT, .value = {1, 1, 1}, .attenuation = {1, 0, 0}});
    refuse(&s, "not the inverse square");
    s = triangle_of(GREY);
    build_light(&s, (struct light){.kind = LIGHT_SPOT,
                                   .value = {1, 1, 1},
                                   .axis = {0, 1, 0},
                                   .exponent = 1,
                                   .attenuation = {0, 0, 1}});
    refuse(&s, "power of the cosine");
    s = triangle_of(GREY);
    s.camera.near = 10;
    refuse(&s, "may cut");
}
