/* The loader by the cases of geometry.cases, look.cases and light.cases, whose expected numbers were derived by hand beside
 * each case, of refused.cases, and by documents that no file should hold. A case:
 *     = NAME            or "+ NAME", which keeps the pieces of the case before, and what is expected where it says nothing of it
 *     dialect cgl       or collada; without it the file's own
 *     asset, effect, mesh, libraries, nodes: the pieces of dae.h; a line that begins with a blank goes on
 *     fails KEYWORD     in the line of the error; or, as many as tell something:
 *     KEY VALUES        what dump() below writes of the scene, the same as float32
 *     KEY~ VALUES       to 2e-6, of the largest of them where that is above 1
 *     KEY~TOLERANCE VALUES
 *     KEY* WORDS        which are a part of it */
#define _GNU_SOURCE
#include "renderer/scene/environment.h"
#include "dae.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <ctype.h>
#include <stdarg.h>

__attribute__((format(printf, 3, 4))) static void put(FILE *f, vec3 v, const char *key, ...)
{
    va_list number;
    va_start(number, key);
    vfprintf(f, key, number);
    va_end(number);
    fprintf(f, " %.9g %.9g %.9g\n", (double)v.x, (double)v.y, (double)v.z);
}

static vec3 of_rgb(rgb c)
{
    return v3(c.r, c.g, c.b);
}

static const vec3 *corners(const struct scene *s, uint32_t triangle)
{
    return s->position + 3 * (size_t)triangle;
}

/* By the winding. */
static vec3 front(const vec3 *p)
{
    return cross(sub(p[1], p[0]), sub(p[2], p[0]));
}

static void put_triangles(FILE *f, const struct scene *s)
{
    double area = 0;
    int notch = 0; /* triangles whose middle is beyond x = y = 1 */
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        const vec3 *p = corners(s, i), n = front(p);
        area += 0.5 * length(n);
        notch += p[0].x + p[1].x + p[2].x > 3 && p[0].y + p[1].y + p[2].y > 3;
        put(f, normalize(n), "t%u.front", i);
        fprintf(f, "t%u.object %s\nt%u.material %s\nt%u.light %d\n", i,
                s->objects[s->tri_object[i]].name, i, s->materials[s->tri_material[i]].name, i,
                s->tri_light[i]);
        for (uint32_t k = 3 * i; k < 3 * i + 3; k++) {
            put(f, s->position[k], "p%u", k);
            put(f, s->normal[k], "n%u", k);
        }
    }
    fprintf(f, "area %.9g\nnotch %d\n", area, notch);
}

static int by_place(const void *a, const void *b)
{
    const vec3 *p = a, *q = b;
    return p->x != q->x ? (p->x > q->x) - (p->x < q->x) : (p->y > q->y) - (p->y < q->y);
}

/* The corners that differ. */
static void put_corners(FILE *f, const struct scene *s, const struct light *l)
{
    vec3 p[6];
    if (l->count != 2)
        return;
    memcpy(p, corners(s, l->first), sizeof p);
    qsort(p, 6, sizeof *p, by_place);
    for (int i = 0; i < 6; i++)
        if (i == 0 || by_place(&p[i - 1], &p[i]) != 0)
            fprintf(f, " %.9g %.9g %.9g", (double)p[i].x, (double)p[i].y, (double)p[i].z);
}

static void put_lights(FILE *f, const struct scene *s)
{
    static const char *const kind[] = {"point",     "spot",   "directional",
                                       "triangles", "sphere", "environment"};
    for (uint32_t i = 0; i < s->num_lights; i++) {
        const struct light *l = &s->lights[i];
        fprintf(
            f, "l%u.kind %s\nl%u.cos_cutoff %.9g\nl%u.exponent %.9g\nl%u.area %.9g\nl%u.count %u\n",
            i, kind[l->kind], i, (double)l->cos_cutoff, i, (double)l->exponent, i, (double)l->area,
            i, l->count);
        put(f, of_rgb(l->value), "l%u.value", i);
        put(f, l->position, "l%u.position", i);
        put(f, l->axis, "l%u.axis", i);
        put(f, l->to_light, "l%u.to_light", i);
        put(f, v3(l->attenuation[0], l->attenuation[1], l->attenuation[2]), "l%u.attenuation", i);
        fprintf(f, "l%u.corners", i);
        if (l->kind == LIGHT_TRIANGLES)
            put_corners(f, s, l);
        fputc('\n', f);
    }
    if (s->environment != NULL) {
        put(f, of_rgb(environment_radiance(s->environment, v3(0, 1, 0))), "sky.above");
        put(f, of_rgb(environment_radiance(s->environment, v3(0, -1, 0))), "sky.below");
        fprintf(f, "sky.hidden %d\nsky.light %d\n", environment_is_hidden(s->environment),
                s->environment_light);
    }
}

static void put_materials(FILE *f, const struct scene *s)
{
    static const char *const kind[] = {"diffuse", "mirror",     "refraction",
                                       "glass",   "microfacet", "plastic"};
    for (uint32_t i = 0; i < s->num_materials; i++) {
        const struct material *m = &s->materials[i];
        fprintf(
            f,
            "m%u.name %s\nm%u.kind %s\nm%u.both_sides %d\nm%u.ior %.9g\nm%u.schlick %d\nm%u.alpha %.9g\n",
            i, m->name, i, kind[m->kind], i, m->radiance_both_sides, i, (double)m->ior, i,
            m->schlick, i, (double)m->alpha);
        fprintf(f, "m%u.microfacet %s %s %s\n", i,
                m->microfacet == MICROFACET_GGX ? "ggx" : "beckmann",
                m->separable ? "separable" : "correlated", m->conductor ? "conductor" : "constant");
        put(f, of_rgb(m->reflectance), "m%u.reflectance", i);
        put(f, of_rgb(m->transmittance), "m%u.transmittance", i);
        put(f, of_rgb(m->radiance), "m%u.radiance", i);
        put(f, of_rgb(m->eta), "m%u.eta", i);
        put(f, of_rgb(m->k), "m%u.k", i);
        put(f, of_rgb(m->specular), "m%u.specular", i);
        put(f, of_rgb(m->mirror), "m%u.mirror", i);
    }
}

static char *dump(const struct scene *s)
{
    char *text;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    const struct scene_camera *c = &s->camera;
    fprintf(
        f,
        "\nread_as %s\ntriangles %u\nspheres %u\nobjects %u\nmaterials %u\nlights %u\ndegenerate %u\n",
        s->dialect == DIALECT_CGL ? "cgl" : "collada", s->num_triangles, s->num_spheres,
        s->num_objects, s->num_materials, s->num_lights, s->num_degenerate);
    fprintf(
        f,
        "zero_normals %u\nnote %s\ncamera %d\nhfov %.9g\nvfov %.9g\naspect %.9g\nnear %.9g\nfar %.9g\n",
        s->num_zero_normals, s->note, c->present, (double)c->hfov, (double)c->vfov,
        (double)c->aspect, (double)c->near, (double)c->far);
    fprintf(f, "xmag %.9g\nymag %.9g\ncameras", (double)c->xmag, (double)c->ymag);
    for (uint32_t i = 0; i < s->num_cameras; i++)
        fprintf(f, " %s", s->cameras[i].name);
    fputc('\n', f);
    put(f, c->right, "right");
    put(f, c->up, "up");
    put(f, c->backward, "backward");
    put(f, c->eye, "eye");
    put(f, s->bounds_min, "bounds_min");
    put(f, s->bounds_max, "bounds_max");
    put(f, s->frame_min, "frame_min");
    put(f, s->frame_max, "frame_max");
    for (uint32_t i = 0; i < s->num_objects; i++)
        fprintf(f, "o%u.name %s\no%u.material %u\no%u.triangles %u %u\no%u.spheres %u %u\n", i,
                s->objects[i].name, i, s->objects[i].material, i, s->objects[i].first_triangle,
                s->objects[i].num_triangles, i, s->objects[i].first_sphere,
                s->objects[i].num_spheres);
    for (uint32_t i = 0; i < s->num_spheres; i++) {
        const struct sphere *b = &s->spheres[i];
        fprintf(f, "s%u.radius %.9g\ns%u.normal_out %.9g\n", i, (double)b->radius, i,
                (double)b->normal_out);
        put(f, b->centre, "s%u.centre", i);
    }
    put_triangles(f, s);
    put_lights(f, s);
    put_materials(f, s);
    fclose(f);
    return text;
}

/* Whether words are equal and numbers agree within the tolerance; below 0: when both are rounded to float32. */
static bool same(const char *got, const char *want, double tolerance)
{
    for (;;) {
        char *got_end, *want_end;
        got += strspn(got, " ");
        want += strspn(want, " ");
        double a = strtod(got, &got_end), b = strtod(want, &want_end);
        if (*want == '\0' || *got == '\0')
            return *want == *got;
        if (got_end != got && want_end != want) {
            if (tolerance < 0 ? (float)a != (float)b : !(fabs(a - b) <= tolerance))
                return false;
            got = got_end;
            want = want_end;
        } else if (*got++ != *want++) {
            return false;
        }
    }
}

/* A line of the four kinds about a scene. Inlined, gcc 12 takes `at` for a pointer to a variable of dump(). */
static void __attribute__((noinline)) expect(const char *scene, const char *line)
{
    char key[64], lines[80];
    double tolerance = -1;
    size_t n = strcspn(line, " ~*");
    const char *values = line + strcspn(line, " ");
    snprintf(key, sizeof key, "%.*s", (int)n, line);
    if (line[n] == '~' && line[n + 1] != ' ') {
        tolerance = atof(line + n + 1);
    } else if (line[n] == '~') {
        double largest = 1;
        char *at = (char *)(uintptr_t)values, *end;
        for (double v = strtod(at, &end); end != at; v = strtod(at = end, &end))
            largest = fmax(largest, fabs(v));
        tolerance = 2e-6 * largest;
    }
    snprintf(lines, sizeof lines, "\n%s ", key);
    const char *at = strstr(scene, lines);
    if (at == NULL)
        fail_msg("no '%s' in %s", key, scene);
    at += strlen(lines);
    OWN_TEXT got = strndup(at, strcspn(at, "\n"));
    if (line[n] == '*' ? strstr(got, values + 1) == NULL : !same(got, values, tolerance))
        fail_msg("%s is %s, expected %s", key, got, values);
}

struct test_case {
    char *line; /* = NAME, + NAME; points into the file */
    struct dae d;
    enum dialect dialect;
    const char *fails;
    const char *expected[32];
    int num_expected;
};

/* What emits has a light, and what does not has none. */
static void check_lights(const struct scene *s)
{
    for (uint32_t i = 0; i < s->num_triangles; i++)
        assert_int_equal(s->tri_light[i] >= 0,
                         !rgb_is_zero(s->materials[s->tri_material[i]].radiance));
}

static void run(const struct test_case *c)
{
    struct scene s = {0};
    struct err e = {""};
    print_message("%s\n", c->line);
    if (c->fails != NULL) {
        assert_int_equal(c->num_expected, 0);
        dae_must_fail(c->d, c->dialect, c->fails);
        return;
    }
    assert_true(c->num_expected > 0);
    MUST(dae_load(&c->d, c->dialect, &s, &e));
    check_lights(&s);
    assert_null(strchr(s.note, '\n'));
    OWN_TEXT text = dump(&s);
    for (int i = 0; i < c->num_expected; i++)
        expect(text, c->expected[i]);
    scene_free(&s);
}

static void add_line(struct test_case *c, char *line)
{
    const struct {
        const char *key, **piece;
    } pieces[] = {{"asset ", &c->d.asset}, {"effect ", &c->d.effect},
                  {"mesh ", &c->d.mesh},   {"libraries ", &c->d.libraries},
                  {"nodes ", &c->d.nodes}, {"fails ", &c->fails}};
    for (size_t i = 0; i < COUNT(pieces); i++)
        if (strncmp(line, pieces[i].key, strlen(pieces[i].key)) == 0) {
            *pieces[i].piece = line + strlen(pieces[i].key);
            return;
        }
    if (strncmp(line, "dialect ", 8) == 0 && c->num_expected == 0) {
        c->dialect = strcmp(line, "dialect cgl") == 0       ? DIALECT_CGL
                     : strcmp(line, "dialect collada") == 0 ? DIALECT_COLLADA
                                                            : DIALECT_AUTO;
        return;
    }
    assert_true(c->num_expected < (int)COUNT(c->expected));
    c->expected[c->num_expected++] = line;
}

/* A "+" case that states no expectation inherits that of the case before. */
static const struct test_case *complete(struct test_case *c, const struct test_case *before)
{
    if (*c->line == '+' && c->fails == NULL && c->num_expected == 0) {
        c->fails = before->fails;
        c->num_expected = before->num_expected;
        memcpy(c->expected, before->expected, sizeof c->expected);
    }
    return c;
}

static void run_file(const char *path, int cases)
{
    char *text = test_read(path), *rest = text, *line;
    /* Lines that go on become one. */
    for (char *at = text; (at = strstr(at, "\n ")) != NULL;)
        *at = ' ';
    struct test_case c = {0}, before = {0};
    int num = 0;
    while ((line = strsep(&rest, "\n")) != NULL) {
        if (*line == '\0' || *line == '#')
            continue;
        if (*line != '=' && *line != '+') {
            add_line(&c, line);
            continue;
        }
        if (num++ > 0)
            run(complete(&c, &before));
        before = c;
        c = (struct test_case){.line = line};
        if (*line == '+') {
            c.d = before.d;
            c.dialect = before.dialect;
        }
    }
    run(complete(&c, &before));
    assert_int_equal(num, cases);
    free(text);
}

TEST(geometry)
{
    run_file("tests/renderer/collada/geometry.cases", 41);
}
TEST(materials)
{
    run_file("tests/renderer/collada/look.cases", 65);
}
TEST(lights_and_cameras)
{
    run_file("tests/renderer/collada/light.cases", 50);
}
TEST(refused)
{
    run_file("tests/renderer/collada/refused.cases", 73);
}

TEST(microfacet_of_ours)
{
    static const char *const DISTRIBUTION[] = {"", "<distribution>ggx</distribution>",
                                               "<distribution> beckmann </distribution>"};
    static const char *const SHADOWING[] = {"", "<shadowing>correlated</shadowing>",
                                            "<shadowing>separable</shadowing>"};
    for (int i = 0; i < 18; i++) {
        int d = i % 3, s = i / 3 % 3;
        bool conductor = i >= 9;
        char tag[768];
        snprintf(
            tag, sizeof tag,
            "<profile_COMMON><technique sid='c'><lambert><diffuse><color>.2 .3 .4</color></diffuse></lambert></technique>"
            "</profile_COMMON><extra><technique profile='ASSAY'><microfacet>%s%s<alpha>%s</alpha>%s</microfacet></technique></extra>",
            DISTRIBUTION[d], SHADOWING[s], conductor ? "0.0001" : "10",
            conductor ? "<eta>0 1 2</eta><k>3 4 5</k>" : "<reflectance>.7 .8 .9</reflectance>");
        char kind[64];
        snprintf(kind, sizeof kind, "m0.microfacet %s %s %s", d == 2 ? "beckmann" : "ggx",
                 s == 2 ? "separable" : "correlated", conductor ? "conductor" : "constant");
        run(&(struct test_case){.line = kind,
                                .d = {.effect = tag, .nodes = "<node>$tri:x</node>"},
                                .expected = {kind, "m0.kind microfacet",
                                             conductor ? "m0.alpha 1e-4" : "m0.alpha 10",
                                             conductor ? "m0.eta 0 1 2" : "m0.reflectance .7 .8 .9",
                                             conductor ? "m0.k 3 4 5" : "lights 0"},
                                .num_expected = 5});
    }
}

/* 2^40 instances of a node, each level of a chain naming the next one twice. */
TEST(explosion_of_instances_is_an_error)
{
    char libraries[8192] = "<library_nodes>";
    for (int i = 0; i < 40; i++) {
        char node[160];
        snprintf(node, sizeof node,
                 "<node id='k%d'><instance_node url='#k%d'/><instance_node url='#k%d'/></node>", i,
                 i + 1, i + 1);
        strcat(libraries, node);
    }
    strcat(libraries, "<node id='k40'/></library_nodes>");
    dae_must_fail(
        (struct dae){.libraries = libraries, .nodes = "<node><instance_node url='#k0'/></node>"},
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
    OWN_TEXT nodes = calloc(16 * DEEP + 1, 1);
    assert_non_null(nodes);
    repeat(nodes, "<node>", DEEP);
    repeat(nodes + strlen(nodes), "</node>", DEEP);
    dae_must_fail((struct dae){.nodes = nodes}, DIALECT_AUTO, "nested deeper");
}

/* The parser itself counts lines only up to 65535. */
TEST(lines_are_right_far_down)
{
    enum { LINES = 100000 };
    OWN_TEXT nodes = calloc(LINES + 200, 1);
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
}

/* The nodes are in line 7, so the comment ends in line 8 and the word is in line 9. */
TEST(line_behind_a_comment_in_a_text)
{
    dae_must_fail(
        (struct dae){.nodes = "<node><translate>1 2 <!-- of\ntwo -->\nx</translate></node>"},
        DIALECT_AUTO, "test.dae:9: <translate>: 'x' is not a finite number");
}

TEST(failure_leaves_the_scene_alone)
{
    struct scene s, before;
    struct err e = {""};
    memset(&s, 0x5a, sizeof s);
    before = s;
    struct dae d = {.nodes = "<node><skew>1</skew>$tri</node>"};
    assert_false(dae_load(&d, DIALECT_AUTO, &s, &e));
    assert_memory_equal(&s, &before, sizeof s);
}
