/* A path tracer as a student might hand it in, and an engine of its own: it shares no code with the
 * renderer, not even a vector type, and knows the scene only from the Mitsuba XML of `assay export`.
 *
 *     student_tracer SCENE.xml SPP SEED OUT.pfm [GAIN]
 *
 * Diffuse surfaces, triangles and spheres, area, point and directional lights and a constant sky;
 * anything else in the file is an error. Lamps of triangles are sampled by area, one at each vertex;
 * all else that glows is found by the path. Every ray looks at every triangle. GAIN (1) multiplies the
 * image: a renderer that is wrong by so much. */
#include <libxml/parser.h>
#include <libxml/tree.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    double x, y, z;
} V;

struct shape { /* a triangle a, a+b, a+c, or a sphere around a */
    bool ball;
    V a, b, c, n;    /* n: unit normal of a triangle */
    double r, side;  /* sphere: radius, and -1 if its normals point inwards */
    V albedo, light; /* light: radiance on the side of the normal */
};

struct lamp { /* without extent */
    bool sun;
    V at, light; /* sun: unit direction to it, irradiance; else position, intensity */
};

static struct {
    struct shape *shape;
    struct lamp lamp[64];
    struct {
        char id[32];
        V albedo;
    } material[256];
    int shapes, lamps, materials, *glow, glows, depth, width, height;
    double eye[12], tan_half;
    V sky;
} S;
static uint64_t state;

static _Noreturn void die(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vfprintf(stderr, format, args);
    va_end(args);
    fputc('\n', stderr);
    exit(1);
}

static V vec(double x, double y, double z)
{
    return (V){x, y, z};
}
static V plus(V a, V b)
{
    return vec(a.x + b.x, a.y + b.y, a.z + b.z);
}
static V minus(V a, V b)
{
    return vec(a.x - b.x, a.y - b.y, a.z - b.z);
}
static V times(V a, double s)
{
    return vec(a.x * s, a.y * s, a.z * s);
}
static V tint(V a, V b)
{
    return vec(a.x * b.x, a.y * b.y, a.z * b.z);
}
static double dot(V a, V b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static V cross(V a, V b)
{
    return vec(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static V unit(V a)
{
    return times(a, 1 / sqrt(dot(a, a)));
}

/* xorshift64* */
static double rnd(void)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (double)((state * 0x2545f4914f6cdd1dULL) >> 11) * 0x1p-53;
}

/* The file. */

static const char *get(xmlNode *n, const char *name)
{
    static char text[8][256];
    static int turn;
    char *out = text[turn++ % 8];
    xmlChar *value = xmlGetProp(n, BAD_CAST name);
    snprintf(out, sizeof *text, "%s", value != NULL ? (char *)value : "");
    xmlFree(value);
    return out;
}

static bool is(xmlNode *n, const char *tag)
{
    return strcmp((const char *)n->name, tag) == 0;
}

static xmlNode *child(xmlNode *n, const char *tag, const char *name)
{
    for (xmlNode *c = n->children; c != NULL; c = c->next)
        if (c->type == XML_ELEMENT_NODE && is(c, tag) &&
            (name == NULL || strcmp(get(c, "name"), name) == 0))
            return c;
    return NULL;
}

static xmlNode *need(xmlNode *n, const char *tag, const char *name)
{
    xmlNode *c = child(n, tag, name);
    if (c == NULL)
        die("<%s> without <%s name=\"%s\">", (const char *)n->name, tag, name != NULL ? name : "");
    return c;
}

static double number(xmlNode *n, const char *tag, const char *name)
{
    return atof(get(need(n, tag, name), "value"));
}

static V colour(xmlNode *n, const char *name)
{
    V v;
    if (sscanf(get(need(n, "rgb", name), "value"), "%lf, %lf, %lf", &v.x, &v.y, &v.z) != 3)
        die("'%s' is not three numbers", name);
    return v;
}

static V place(xmlNode *n, const char *tag, const char *name)
{
    xmlNode *p = need(n, tag, name);
    return vec(atof(get(p, "x")), atof(get(p, "y")), atof(get(p, "z")));
}

static void only(xmlNode *n, const char *type)
{
    if (strcmp(get(n, "type"), type) != 0)
        die("no %s of type '%s'", (const char *)n->name, get(n, "type"));
}

static void read_camera(xmlNode *n)
{
    xmlNode *film = need(n, "film", NULL);
    only(n, "perspective");
    only(need(film, "rfilter", NULL), "box");
    S.width = (int)number(film, "integer", "width");
    S.height = (int)number(film, "integer", "height");
    S.tan_half = tan(number(n, "float", "fov") * acos(-1) / 360);
    char *at = (char *)get(need(need(n, "transform", "to_world"), "matrix", NULL), "value");
    for (int i = 0; i < 12; i++)
        S.eye[i] = strtod(at, &at);
}

static void read_material(xmlNode *n)
{
    only(n, "twosided");
    xmlNode *inner = need(n, "bsdf", NULL);
    only(inner, "diffuse");
    if (S.materials == 256)
        die("too many materials");
    snprintf(S.material[S.materials].id, sizeof S.material->id, "%s", get(n, "id"));
    S.material[S.materials++].albedo = colour(inner, "reflectance");
}

static struct shape *add_shape(xmlNode *n)
{
    const char *id = get(need(n, "ref", NULL), "id");
    struct shape s = {.side = 1};
    int m = 0;
    while (m < S.materials && strcmp(S.material[m].id, id) != 0)
        m++;
    if (m == S.materials)
        die("no material '%s'", id);
    s.albedo = S.material[m].albedo;
    xmlNode *emitter = child(n, "emitter", NULL);
    if (emitter != NULL)
        s.light = colour(emitter, "radiance");
    S.shape = realloc(S.shape, ((size_t)S.shapes + 1) * sizeof s);
    S.glow = realloc(S.glow, ((size_t)S.shapes + 1) * sizeof *S.glow);
    if (S.shape == NULL || S.glow == NULL)
        die("out of memory");
    S.shape[S.shapes] = s;
    return &S.shape[S.shapes++];
}

static void read_mesh(xmlNode *n, const char *scene)
{
    char path[4096], line[128];
    const char *slash = strrchr(scene, '/');
    unsigned vertices = 0, faces = 0, index[3];
    snprintf(path, sizeof path, "%.*s%s", slash != NULL ? (int)(slash - scene) + 1 : 0, scene,
             get(need(n, "string", "filename"), "value"));
    if (strcmp(get(need(n, "boolean", "face_normals"), "value"), "true") != 0)
        die("%s: no smooth meshes", path);
    FILE *f = fopen(path, "rb");
    if (f == NULL)
        die("%s: cannot read", path);
    while (fgets(line, sizeof line, f) != NULL && strcmp(line, "end_header\n") != 0)
        if (sscanf(line, "element vertex %u", &vertices) != 1)
            sscanf(line, "element face %u", &faces);
    float(*p)[3] = calloc(vertices + 1, sizeof *p);
    if (p == NULL || fread(p, sizeof *p, vertices, f) != vertices)
        die("%s: ends early", path);
    for (unsigned i = 0; i < faces; i++) {
        V v[3];
        if (fgetc(f) != 3 || fread(index, sizeof *index, 3, f) != 3)
            die("%s: ends early", path);
        for (int k = 0; k < 3; k++) {
            if (index[k] >= vertices)
                die("%s: no vertex %u", path, index[k]);
            v[k] = vec((double)p[index[k]][0], (double)p[index[k]][1], (double)p[index[k]][2]);
        }
        struct shape *s = add_shape(n);
        s->a = v[0];
        s->b = minus(v[1], v[0]);
        s->c = minus(v[2], v[0]);
        s->n = unit(cross(s->b, s->c));
        if (dot(s->light, s->light) > 0)
            S.glow[S.glows++] = S.shapes - 1;
    }
    free(p);
    fclose(f);
}

static void read_lamp(xmlNode *n)
{
    const char *type = get(n, "type");
    struct lamp l = {.sun = strcmp(type, "directional") == 0};
    if (strcmp(type, "constant") == 0) {
        S.sky = colour(n, "radiance");
        return;
    }
    if (l.sun) {
        l.at = times(unit(place(n, "vector", "direction")), -1);
        l.light = colour(n, "irradiance");
    } else {
        only(n, "point");
        l.at = place(n, "point", "position");
        l.light = colour(n, "intensity");
    }
    if (S.lamps == 64)
        die("too many lamps");
    S.lamp[S.lamps++] = l;
}

static void read_scene(const char *path)
{
    xmlDoc *doc = xmlReadFile(path, NULL, XML_PARSE_NONET);
    if (doc == NULL)
        die("%s: not XML", path);
    for (xmlNode *n = xmlDocGetRootElement(doc)->children; n != NULL; n = n->next) {
        if (n->type != XML_ELEMENT_NODE || is(n, "default"))
            continue;
        if (is(n, "integrator")) {
            S.depth = (int)number(n, "integer", "max_depth");
        } else if (is(n, "sensor")) {
            read_camera(n);
        } else if (is(n, "bsdf")) {
            read_material(n);
        } else if (is(n, "emitter")) {
            read_lamp(n);
        } else if (strcmp(get(n, "type"), "ply") == 0) {
            read_mesh(n, path);
        } else {
            only(n, "sphere");
            struct shape *s = add_shape(n);
            s->ball = true;
            s->a = place(n, "point", "center");
            s->r = number(n, "float", "radius");
            s->side =
                strcmp(get(need(n, "boolean", "flip_normals"), "value"), "true") == 0 ? -1 : 1;
        }
    }
    xmlFreeDoc(doc);
}

/* Light. */

static double hit_triangle(const struct shape *s, V o, V d)
{
    V p = cross(d, s->c), t = minus(o, s->a);
    double det = dot(s->b, p), u = dot(t, p) / det;
    if (!(u >= 0 && u <= 1))
        return INFINITY;
    V q = cross(t, s->b);
    double v = dot(d, q) / det;
    return v >= 0 && u + v <= 1 ? dot(s->c, q) / det : INFINITY;
}

static double hit_ball(const struct shape *s, V o, V d, double least)
{
    V t = minus(o, s->a);
    double b = dot(t, d), q = b * b - dot(t, t) + s->r * s->r;
    if (q < 0)
        return INFINITY;
    return -b - sqrt(q) > least ? -b - sqrt(q) : -b + sqrt(q);
}

/* The nearest shape from o along unit d, between 1e-7 and *distance, which it shortens. */
static const struct shape *trace(V o, V d, double *distance)
{
    const struct shape *nearest = NULL;
    const double least = 1e-7;
    for (int i = 0; i < S.shapes; i++) {
        const struct shape *s = &S.shape[i];
        double t = s->ball ? hit_ball(s, o, d, least) : hit_triangle(s, o, d);
        if (t > least && t < *distance) {
            *distance = t;
            nearest = s;
        }
    }
    return nearest;
}

/* The cosine at the surface times the light from `distance` away in direction d, or 0 if something
 * is in between. */
static V arriving(V p, V n, V d, double distance, V light)
{
    double cosine = dot(n, d), room = distance * (1 - 1e-7);
    return cosine > 0 && trace(p, d, &room) == NULL ? times(light, cosine) : vec(0, 0, 0);
}

/* Irradiance at p from lamps without extent and, by one sample, from glowing triangles. */
static V direct(V p, V n)
{
    V sum = {0, 0, 0};
    for (int i = 0; i < S.lamps; i++) {
        V to = minus(S.lamp[i].at, p);
        double d2 = dot(to, to);
        sum = plus(sum, S.lamp[i].sun
                            ? arriving(p, n, S.lamp[i].at, INFINITY, S.lamp[i].light)
                            : arriving(p, n, unit(to), sqrt(d2), times(S.lamp[i].light, 1 / d2)));
    }
    if (S.glows > 0) {
        const struct shape *s = &S.shape[S.glow[(int)(rnd() * S.glows)]];
        double u = rnd(), v = rnd();
        if (u + v > 1) {
            u = 1 - u;
            v = 1 - v;
        }
        V to = minus(plus(s->a, plus(times(s->b, u), times(s->c, v))), p),
          doubled = cross(s->b, s->c);
        double d2 = dot(to, to), area = sqrt(dot(doubled, doubled)) / 2,
               cosine = -dot(s->n, unit(to));
        if (cosine > 0)
            sum = plus(sum, arriving(p, n, unit(to), sqrt(d2),
                                     times(s->light, S.glows * area * cosine / d2)));
    }
    return sum;
}

static V lambert(V n)
{
    double phi = 2 * acos(-1) * rnd(), r2 = rnd();
    V s = unit(cross(fabs(n.x) < 0.5 ? vec(1, 0, 0) : vec(0, 1, 0), n)), t = cross(n, s);
    return unit(plus(times(n, sqrt(1 - r2)),
                     plus(times(s, sqrt(r2) * cos(phi)), times(t, sqrt(r2) * sin(phi)))));
}

static V radiance(V o, V d)
{
    V sum = {0, 0, 0}, weight = {1, 1, 1};
    for (int length = 1;; length++) {
        double t = INFINITY;
        const struct shape *s = trace(o, d, &t);
        if (s == NULL)
            return plus(sum, tint(weight, S.sky));
        V p = plus(o, times(d, t)), n = s->ball ? times(minus(p, s->a), s->side / s->r) : s->n;
        double facing = -dot(d, n);
        if (facing > 0 && (s->ball || length == 1)) /* triangles have been sampled before */
            sum = plus(sum, tint(weight, s->light));
        if (length == S.depth)
            return sum;
        n = facing > 0 ? n : times(n, -1);
        weight = tint(weight, s->albedo);
        sum = plus(sum, tint(weight, times(direct(p, n), 1 / acos(-1))));
        o = p;
        d = lambert(n);
    }
}

int main(int argc, char **argv)
{
    if (argc != 5 && argc != 6)
        die("usage: student_tracer SCENE.xml SPP SEED OUT.pfm [GAIN]");
    int spp = atoi(argv[2]);
    double gain = argc == 6 ? atof(argv[5]) : 1;
    state = (strtoull(argv[3], NULL, 10) + 1) * 0x9e3779b97f4a7c15ULL;
    read_scene(argv[1]);
    FILE *f = fopen(argv[4], "wb");
    if (f == NULL)
        die("%s: cannot write", argv[4]);
    fprintf(f, "PF\n%d %d\n-1.0\n", S.width, S.height);
    const double *m = S.eye;
    for (int y = S.height - 1; y >= 0; y--) /* from the bottom */
        for (int x = 0; x < S.width; x++) {
            V sum = {0, 0, 0};
            for (int i = 0; i < spp; i++) {
                double a = (1 - 2 * (x + rnd()) / S.width) * S.tan_half;
                double b = (1 - 2 * (y + rnd()) / S.height) * S.tan_half * S.height / S.width;
                V d = vec(m[0] * a + m[1] * b + m[2], m[4] * a + m[5] * b + m[6],
                          m[8] * a + m[9] * b + m[10]);
                sum = plus(sum, radiance(vec(m[3], m[7], m[11]), unit(d)));
            }
            const float px[3] = {(float)(gain * sum.x / spp), (float)(gain * sum.y / spp),
                                 (float)(gain * sum.z / spp)};
            fwrite(px, sizeof px, 1, f);
        }
    free(S.shape);
    free(S.glow);
    if (fclose(f) != 0)
        die("%s: cannot write", argv[4]);
    return 0;
}
