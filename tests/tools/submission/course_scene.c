#include "course_scene.h"
#include "tests/support/test.h"

#include <libxml/parser.h>
#include <math.h>

enum { MOST = 1 << 17, LEAF = 4 };

struct primitive {
    double low[3], high[3];
};

/* One scene. Rules are told by their first breach. */
struct walk {
    xmlDoc *doc;
    char breach[300];
    int num_cameras, num_lights, num_areas, num_lit, num_emissive;
    struct primitive *primitive;
    int num_primitives;
};

static bool breach(struct walk *w, const xmlNode *n, const char *rule)
{
    xmlChar *name = n != NULL ? xmlGetProp(n, BAD_CAST "id") : NULL;
    snprintf(w->breach, sizeof w->breach, "<%s%s%s>: %s", n != NULL ? (const char *)n->name : "",
             name != NULL ? " " : "", name != NULL ? (const char *)name : "", rule);
    xmlFree(name);
    return false;
}

static bool has(const xmlNode *n, const char *attribute)
{
    return xmlHasProp(n, BAD_CAST attribute) != NULL;
}

static bool is(const xmlNode *n, const char *name)
{
    return n->type == XML_ELEMENT_NODE && strcmp((const char *)n->name, name) == 0;
}

static xmlNode *next(xmlNode *n, const char *name)
{
    while (n != NULL && !is(n, name))
        n = n->next;
    return n;
}

/* By a path a/b/c of first children, as the starter code finds its way. */
static xmlNode *at(const xmlNode *n, const char *path)
{
    char names[200];
    snprintf(names, sizeof names, "%s", path);
    char *rest, *name = strtok_r(names, "/", &rest);
    xmlNode *found = (xmlNode *)n;
    for (; found != NULL && name != NULL; name = strtok_r(NULL, "/", &rest))
        found = next(found->children, name);
    return found;
}

static xmlNode *by_id(xmlNode *n, const char *id)
{
    for (; n != NULL; n = n->next) {
        xmlChar *own = n->type == XML_ELEMENT_NODE ? xmlGetProp(n, BAD_CAST "id") : NULL;
        bool same = own != NULL && strcmp((const char *)own, id) == 0;
        xmlFree(own);
        xmlNode *below = same ? n : by_id(n->children, id);
        if (below != NULL)
            return below;
    }
    return NULL;
}

/* NULL: no such attribute, or nothing of that id. */
static xmlNode *target(const struct walk *w, const xmlNode *n, const char *attribute)
{
    xmlChar *url = n != NULL ? xmlGetProp(n, BAD_CAST attribute) : NULL;
    xmlNode *found = url != NULL && url[0] == '#'
                         ? by_id(xmlDocGetRootElement(w->doc), (const char *)url + 1)
                         : NULL;
    xmlFree(url);
    return found;
}

/* How many numbers it has; NULL: none. */
static int numbers(const xmlNode *n, double *out, int most)
{
    xmlChar *text = n != NULL ? xmlNodeGetContent(n) : NULL;
    int num = 0;
    char *p = (char *)text, *end = p;
    for (; p != NULL && num < most; p = end, num++) {
        out[num] = strtod(p, &end);
        if (end == p)
            break;
    }
    xmlFree(text);
    return num;
}

static double attribute(const xmlNode *n, const char *name)
{
    xmlChar *text = xmlGetProp(n, BAD_CAST name);
    double v = text != NULL ? strtod((const char *)text, NULL) : -1;
    xmlFree(text);
    return v;
}

/* The first extra's technique CGL. Every technique before it needs its profile. */
static bool find_cgl(struct walk *w, const xmlNode *n, xmlNode **out)
{
    for (*out = at(n, "extra/technique"); *out != NULL; *out = next((*out)->next, "technique")) {
        xmlChar *profile = xmlGetProp(*out, BAD_CAST "profile");
        bool cgl = profile != NULL && strcmp((const char *)profile, "CGL") == 0,
             any = profile != NULL;
        xmlFree(profile);
        if (!any)
            return breach(w, n, "a technique without a profile");
        if (cgl)
            return true;
    }
    return true;
}

static bool has_numbers(const xmlNode *n, const char *path, int num)
{
    double v[8];
    return numbers(at(n, path), v, 8) == num;
}

static bool walk_camera(struct walk *w, const xmlNode *n)
{
    const xmlNode *p = at(n, "optics/technique_common/perspective");
    w->num_cameras++;
    if (p == NULL || (at(p, "yfov") == NULL && at(p, "aspect_ratio") == NULL))
        return breach(w, n, "a camera is a perspective with yfov or aspect_ratio");
    return true;
}

static bool walk_light(struct walk *w, const xmlNode *n, const double *m)
{
    xmlNode *technique;
    if (!find_cgl(w, n, &technique))
        return false;
    technique = technique != NULL ? technique : at(n, "technique_common");
    xmlNode *kind = technique != NULL ? xmlFirstElementChild(technique) : NULL;
    w->num_lights++;
    if (kind == NULL ||
        !(is(kind, "area") || is(kind, "point") || is(kind, "directional") ||
          is(kind, "ambient")) ||
        !has_numbers(kind, "color", 3))
        return breach(w, n, "a light is area, point, directional or ambient, with a color");
    if (is(kind, "point") && (!has_numbers(kind, "constant_attenuation", 1) ||
                              !has_numbers(kind, "linear_attenuation", 1) ||
                              !has_numbers(kind, "quadratic_attenuation", 1)))
        return breach(w, n, "a point light has all three attenuations");
    for (int i = 0; i < 3 && is(kind, "directional"); i++)
        for (int k = 0; k < 3; k++)
            if (fabs(m[4 * i + 3] * m[4 * k + 2] - m[4 * k + 3] * m[4 * i + 2]) > 1e-3)
                return breach(w, n, "a directional light lies on its own axis");
    w->num_areas += is(kind, "area");
    return true;
}

static bool walk_material(struct walk *w, const xmlNode *node)
{
    static const struct {
        const char *tag, *child[4];
    } known[] = {{"emission", {"radiance"}},
                 {"mirror", {"reflectance"}},
                 {"microfacet", {"alpha", "eta", "k"}},
                 {"refraction", {"transmittance", "roughness", "ior"}},
                 {"glass", {"transmittance", "reflectance", "roughness", "ior"}}};
    const xmlNode *m =
        target(w, at(node, "instance_geometry/bind_material/technique_common/instance_material"),
               "target");
    const xmlNode *effect = m != NULL ? target(w, at(m, "instance_effect"), "url") : NULL;
    if (effect == NULL || !has(m, "id") || !has(m, "name"))
        return breach(w, node, "a material has id, name and effect");
    for (xmlNode *t = at(effect, "profile_COMMON/technique"); t != NULL;
         t = next(t->next, "technique"))
        if (!has(t, "sid"))
            return breach(w, effect, "a technique without a sid");
    xmlNode *cgl;
    if (!find_cgl(w, effect, &cgl))
        return false;
    for (xmlNode *tag = cgl != NULL ? xmlFirstElementChild(cgl) : NULL; tag != NULL;
         tag = xmlNextElementSibling(tag)) {
        size_t i = 0;
        while (i < sizeof known / sizeof *known && !is(tag, known[i].tag))
            i++;
        if (i == sizeof known / sizeof *known)
            return breach(w, effect, "a material of an unknown kind");
        for (int c = 0; c < 4 && known[i].child[c] != NULL; c++)
            if (at(tag, known[i].child[c]) == NULL)
                return breach(w, effect, "a material lacks one of its numbers");
    }
    if (at(cgl, "emission") != NULL)
        w->num_emissive++;
    double color[4] = {0};
    if (cgl == NULL) {
        numbers(at(effect, "profile_COMMON/technique/phong/diffuse/color"), color, 4);
        w->num_lit += color[0] + color[1] + color[2] > 0;
    } else if (at(cgl, "emission") == NULL) {
        w->num_lit++;
    }
    return true;
}

struct mesh {
    const double *p; /* points, 3 numbers each */
    const double *n; /* normals by corner of a point, as stored; NULL: none */
    int num_points, num_triangles;
    int *corner, *normal; /* 3 a triangle */
};

/* A side of a triangle, a to b, with its third corner. */
struct side {
    int a, b, c;
};

static int by_ends(const void *x, const void *y)
{
    const struct side *p = x, *q = y;
    return p->a != q->a ? p->a - q->a : p->b - q->b;
}

static const struct side *find_side(const struct side *s, int num, int a, int b)
{
    return bsearch(&(struct side){a, b, 0}, s, (size_t)num, sizeof *s, by_ends);
}

/* The normals of the starter code: of a closed mesh the mean of its triangles' by area, at the rim of one or two triangles
 * the reverse of theirs. */
static bool walk_normals(struct walk *w, const xmlNode *g, const struct mesh *m, bool closed)
{
    double *sum = calloc(3 * (size_t)m->num_points, sizeof *sum);
    bool ok = true;
    assert_non_null(sum);
    for (int t = 0; t < m->num_triangles; t++) {
        const int *corner = m->corner + 3 * t;
        const double *q = m->p + 3 * corner[0], *r = m->p + 3 * corner[1],
                     *s = m->p + 3 * corner[2];
        for (int k = 0; k < 9; k++) {
            int i = (k + 1) % 3, j = (k + 2) % 3;
            double c = (r[i] - q[i]) * (s[j] - q[j]) - (r[j] - q[j]) * (s[i] - q[i]);
            sum[3 * corner[k / 3] + k % 3] += closed ? c : -c;
        }
    }
    for (int i = 0; m->n != NULL && i < 3 * m->num_triangles; i++) {
        const double *s = sum + 3 * m->corner[i], *n = m->n + 3 * m->normal[i];
        ok = ok && s[0] * n[0] + s[1] * n[1] + s[2] * n[2] >
                       (1 - 1e-4) * sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
    }
    free(sum);
    return ok || breach(w, g, "the normals in the file are not those that its triangles give");
}

static bool walk_sides(struct walk *w, const xmlNode *g, const struct mesh *m, struct side *s)
{
    int num = 3 * m->num_triangles, rim = 0, points = 0, turns;
    for (int i = 0; i < num; i++) {
        const int *corner = m->corner + i / 3 * 3;
        s[i] = (struct side){corner[i % 3], corner[(i + 1) % 3], corner[(i + 2) % 3]};
        if (s[i].a == s[i].b)
            return breach(w, g, "a triangle uses a point twice");
    }
    qsort(s, (size_t)num, sizeof *s, by_ends);
    for (int i = 0; i < num; i++) {
        if (i > 0 && by_ends(&s[i - 1], &s[i]) == 0)
            return breach(w, g, "two triangles go along a side in the same direction");
        points += i == 0 || s[i].a != s[i - 1].a;
        rim += find_side(s, num, s[i].b, s[i].a) == NULL;
    }
    if (points != m->num_points)
        return breach(w, g, "a point that no triangle uses");
    if (rim > 0 && m->n == NULL)
        return true;
    if (rim > 0 && (m->num_triangles > 2 || m->num_points != m->num_triangles + 2))
        return breach(w, g, "a mesh with normals is closed, or a triangle or quadrangle");
    for (int i = 0, fan; rim == 0 && i < num; i += fan) {
        const struct side *turn = &s[i];
        for (fan = 0; i + fan < num && s[i + fan].a == s[i].a;)
            fan++;
        for (turns = 1; (turn = find_side(s, num, turn->a, turn->c)) != &s[i]; turns++)
            ;
        if (turns != fan)
            return breach(w, g, "two fans of triangles meet in a point");
    }
    return walk_normals(w, g, m, rim == 0);
}

static struct primitive *add_primitive(struct walk *w)
{
    assert_true(w->num_primitives < MOST);
    return &w->primitive[w->num_primitives++];
}

/* Triangles as the starter code has them: moved by the node, with Y up. */
static void add_triangles(struct walk *w, const struct mesh *m, const double *to)
{
    for (int t = 0; t < m->num_triangles; t++) {
        struct primitive *p = add_primitive(w);
        for (int k = 0; k < 9; k++) {
            const double *q = m->p + 3 * m->corner[3 * t + k / 3], *row = to + 4 * (k % 3);
            double v = row[0] * q[0] + row[1] * q[1] + row[2] * q[2] + row[3];
            int axis = k % 3 == 0 ? 0 : 3 - k % 3;
            v = axis == 0 ? -v : v;
            p->low[axis] = k < 3 ? v : fmin(p->low[axis], v);
            p->high[axis] = k < 3 ? v : fmax(p->high[axis], v);
        }
    }
}

static bool walk_mesh(struct walk *w, const xmlNode *g, const double *to)
{
    static double points[MOST], normals[MOST], index[MOST], count[MOST];
    static int corner[MOST], normal[MOST];
    static struct side side[MOST];
    const xmlNode *mesh = at(g, "mesh"), *list = at(mesh, "polylist"),
                  *vertices = at(mesh, "vertices");
    struct mesh m = {.p = points, .corner = corner, .normal = normal};
    int stride = 0, vertex = -1, n = -1;
    for (xmlNode *s = at(mesh, "source"); s != NULL; s = next(s->next, "source"))
        if (!has(s, "id") ||
            numbers(at(s, "float_array"), points, MOST) != attribute(at(s, "float_array"), "count"))
            return breach(w, g, "a source has an id and as many numbers as it says");
    if (list == NULL || next(list->next, "polylist") != NULL || at(mesh, "triangles") != NULL ||
        vertices == NULL || !has(vertices, "id"))
        return breach(w, g, "a mesh has vertices with an id and one polylist");
    for (xmlNode *i = at(list, "input"); i != NULL; i = next(i->next, "input"), stride++) {
        xmlChar *semantic = xmlGetProp(i, BAD_CAST "semantic");
        const xmlNode *source = target(w, i, "source");
        bool is_vertex = xmlStrEqual(semantic, BAD_CAST "VERTEX"),
             is_normal = xmlStrEqual(semantic, BAD_CAST "NORMAL");
        xmlFree(semantic);
        if (source == NULL || (is_vertex && source != vertices) || !(is_vertex || is_normal))
            return breach(w, g,
                          "a polylist has VERTEX, of its mesh's vertices, and at most NORMAL");
        *(is_vertex ? &vertex : &n) = (int)attribute(i, "offset");
        if (is_normal && numbers(at(source, "float_array"), normals, MOST) > 0)
            m.n = normals;
    }
    m.num_points =
        numbers(at(target(w, at(vertices, "input"), "source"), "float_array"), points, MOST) / 3;
    m.num_triangles = (int)attribute(list, "count");
    if (m.num_points == 0 || vertex < 0 || vertex >= stride || n >= stride ||
        numbers(at(list, "vcount"), count, MOST) != m.num_triangles ||
        numbers(at(list, "p"), index, MOST) != 3 * m.num_triangles * stride)
        return breach(w, g, "a polylist has as many numbers as it says");
    for (int i = 0; i < m.num_triangles; i++)
        if (count[i] != 3)
            return breach(w, g, "of a polygon only the first three corners are seen");
    for (int i = 0; i < 3 * m.num_triangles; i++) {
        corner[i] = (int)index[i * stride + vertex];
        normal[i] = n >= 0 ? (int)index[i * stride + n] : 0;
        assert_in_range(corner[i], 0, m.num_points - 1);
    }
    add_triangles(w, &m, to);
    return walk_sides(w, g, &m, side);
}

static bool walk_geometry(struct walk *w, const xmlNode *g, const double *m)
{
    double radius;
    xmlNode *cgl;
    if (at(g, "mesh") != NULL)
        return walk_mesh(w, g, m);
    if (!find_cgl(w, g, &cgl))
        return false;
    if (cgl == NULL || numbers(at(cgl, "sphere/radius"), &radius, 1) != 1)
        return breach(w, g, "a geometry is a mesh or a sphere with a radius");
    struct primitive *p = add_primitive(w);
    for (int k = 0; k < 3; k++) {
        int axis = k == 0 ? 0 : 3 - k;
        double centre = k == 0 ? -m[3] : m[4 * k + 3], length = 0;
        for (int i = 0; i < 3; i++)
            length += m[4 * i + k] * m[4 * i + k];
        if (fabs(length - 1) > 1e-6)
            return breach(w, g, "a sphere is not scaled");
        p->low[axis] = centre - radius;
        p->high[axis] = centre + radius;
    }
    return true;
}

static bool walk_node(struct walk *w, const xmlNode *n)
{
    static const char *const instances[] = {"instance_camera", "instance_light",
                                            "instance_geometry"};
    const xmlNode *what = NULL;
    double m[17];
    int num = 0, kind = 0;
    if (!has(n, "id") || !has(n, "name"))
        return breach(w, n, "a node has an id and a name");
    if (at(n, "translate") != NULL || at(n, "rotate") != NULL || at(n, "scale") != NULL ||
        numbers(at(n, "matrix"), m, 17) != 16)
        return breach(w, n, "a node is placed by one matrix of 16 numbers");
    for (int i = 0; i < 3; i++)
        if (at(n, instances[i]) != NULL) {
            what = target(w, at(n, instances[i]), "url");
            kind = i;
            num++;
        }
    if (num != 1 || what == NULL || at(n, "node") != NULL)
        return breach(w, n, "a node shows one thing that is in the file");
    if (!has(what, "id") || !has(what, "name"))
        return breach(w, what, "cameras, lights and geometries have an id and a name");
    return kind == 0   ? walk_camera(w, what)
           : kind == 1 ? walk_light(w, what, m)
                       : walk_material(w, n) && walk_geometry(w, what, m);
}

static double centre(const struct primitive *p, int axis)
{
    return (p->low[axis] + p->high[axis]) / 2;
}

/* Splitting at the mean of the centres on the longest axis, as most write it first, ends in leaves of 4. */
static bool splits(struct primitive *p, int num)
{
    struct primitive box = p[0];
    double mean = 0, extent[3];
    int few = 0;
    if (num <= LEAF)
        return true;
    for (int i = 0; i < 3 * num; i++) {
        box.low[i % 3] = fmin(box.low[i % 3], p[i / 3].low[i % 3]);
        box.high[i % 3] = fmax(box.high[i % 3], p[i / 3].high[i % 3]);
    }
    for (int k = 0; k < 3; k++)
        extent[k] = box.high[k] - box.low[k];
    int axis = extent[0] > extent[1] && extent[0] > extent[2]   ? 0
               : extent[1] > extent[0] && extent[1] > extent[2] ? 1
                                                                : 2;
    for (int i = 0; i < num; i++)
        mean += centre(&p[i], axis) / num;
    for (int i = 0; i < num; i++)
        if (centre(&p[i], axis) <= mean - 1e-9) {
            struct primitive swapped = p[few];
            p[few++] = p[i];
            p[i] = swapped;
        }
    return few > 0 && few < num && splits(p, few) && splits(p + few, num - few);
}

static bool walk_scene(struct walk *w, bool has_environment)
{
    const xmlNode *root = xmlDocGetRootElement(w->doc);
    xmlChar *up = xmlNodeGetContent(at(root, "asset/up_axis"));
    bool z_up = xmlStrEqual(up, BAD_CAST "Z_UP");
    xmlFree(up);
    if (!is(root, "COLLADA") || !z_up)
        return breach(w, root, "a COLLADA document with Z_UP");
    const xmlNode *scene = target(w, at(root, "scene/instance_visual_scene"), "url");
    if (scene == NULL)
        return breach(w, root, "a visual scene");
    for (xmlNode *n = at(scene, "node"); n != NULL; n = next(n->next, "node"))
        if (!walk_node(w, n))
            return false;
    if (w->num_cameras != 1)
        return breach(w, scene, "one camera");
    if (w->num_lights == 0 && !has_environment)
        return breach(w, scene, "a light: directions of the hemisphere are counted by lights");
    if (w->num_lit > 0 && w->num_emissive > w->num_areas)
        return breach(w, scene, "a mesh that shines on something has an area light");
    return splits(w->primitive, w->num_primitives) ||
           breach(w, scene, "centres that no plane parts");
}

const char *course_scene_breach(const char *text, bool has_environment)
{
    static struct primitive primitive[MOST];
    static struct walk w;
    w = (struct walk){.doc = xmlReadMemory(text, (int)strlen(text), "scene", NULL, XML_PARSE_NONET),
                      .primitive = primitive};
    assert_non_null(w.doc);
    walk_scene(&w, has_environment);
    xmlFreeDoc(w.doc);
    return w.breach;
}
