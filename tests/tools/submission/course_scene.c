#include "course_scene.h"
#include "renderer/base/fs.h"
#include "tests/support/test.h"

#include <libxml/parser.h>
#include <libxml/xpathInternals.h>
#include <math.h>

enum { MOST = 1 << 17, LEAF = 4 };

struct primitive {
    double low[3], high[3];
};

/* One scene. Rules are told by their first breach. */
struct walk {
    xmlXPathContext *xpath;
    char breach[300];
    struct primitive *primitive;
    int num_primitives;
};

/* What XPath [XML Path Language 1.0] can say of a scene: whatever is found breaks the rule. An id has its # here, so that references
 * are equal to it; numbers() is how many a text has. */
#define CGL "extra/technique[@profile = 'CGL']"
/* Of a light: what it is by that, else by the common technique. */
#define KIND "(" CGL " | self::*[not(" CGL ")]/technique_common)/*[1]"
/* Effects, and the geometry that has them. */
#define DIFFUSE "profile_COMMON/technique/phong/diffuse/color"
#define SHINING CGL "/emission"
#define LIT                                                                                        \
    CGL "[not(emission)] or "                                                                      \
        "not(" CGL ") and not(starts-with(normalize-space(" DIFFUSE "), '0 0 0 '))"
#define GEOMETRY_OF(effect)                                                                        \
    "//node/instance_geometry[.//instance_material/@target = "                                     \
    "//material[instance_effect/@url = //effect[" effect "]/@id]/@id]"

static const struct {
    const char *found, *rule;
} rules[] = {
    {"/*[not(self::COLLADA) or not(asset/up_axis = 'Z_UP')]", "a COLLADA document with Z_UP"},
    {"/*[not(scene/instance_visual_scene/@url = //visual_scene/@id)]", "a visual scene"},
    {"//visual_scene/node[not(@id and @name)]", "a node has an id and a name"},
    {"//visual_scene/node[translate or rotate or scale or numbers(matrix) != 16]",
     "a node is placed by one matrix of 16 numbers"},
    {"//visual_scene/node[node or count(instance_camera | instance_light | instance_geometry) != 1 or "
     "not(instance_camera/@url = //camera/@id or instance_light/@url = //light/@id or "
     "instance_geometry/@url = //geometry/@id)]",
     "a node shows one thing that is in the file"},
    {"(//camera | //light | //geometry)[not(@id and @name)]",
     "cameras, lights and geometries have an id and a name"},
    {"//camera[not(optics/technique_common/perspective[yfov or aspect_ratio])]",
     "a camera is a perspective with yfov or aspect_ratio"},
    {"//visual_scene[count(node/instance_camera) != 1]", "one camera"},
    {"//visual_scene[not(node/instance_light or $environment)]",
     "a light: directions of the hemisphere are counted by lights"},
    {"//extra/technique[not(@profile)]", "a technique without a profile"},
    {"//light[not(" KIND "[self::area or self::point or self::directional or self::ambient]"
     "[numbers(color) = 3])]",
     "a light is area, point, directional or ambient, with a color"},
    {"//light[extra/technique/@profile != 'CGL' or not(extra/technique)]",
     "a light has an extra of CGL: the starter code of 2025 crashes without one"},
    {"//light[" KIND "[self::point][numbers(constant_attenuation) != 1 or "
     "numbers(linear_attenuation) != 1 or numbers(quadratic_attenuation) != 1]]",
     "a point light has all three attenuations"},
    {"//node/instance_geometry[not(bind_material/technique_common/instance_material/@target = "
     "//material[@name and instance_effect/@url = //effect/@id]/@id)]",
     "a material has id, name and effect"},
    {"//profile_COMMON/technique[not(@sid)]", "a technique without a sid"},
    {"//effect/" CGL "/*[not(self::emission or self::mirror or self::microfacet or "
     "self::refraction or self::glass)]",
     "a material of an unknown kind"},
    {"//effect/" CGL "/*[self::emission and not(radiance) or self::mirror and not(reflectance) or "
     "self::microfacet and not(alpha and eta and k) or "
     "self::refraction and not(transmittance and roughness and ior) or "
     "self::glass and not(transmittance and reflectance and roughness and ior)]",
     "a material lacks one of its numbers"},
    {"//visual_scene[" GEOMETRY_OF(LIT) " and count(" GEOMETRY_OF(
         SHINING) ") > "
                  "count(node/instance_light[@url = //light[" KIND "[self::area]]/@id])]",
     "a mesh that shines on something has an area light"},
    {"//geometry[not(mesh or " CGL "/sphere[numbers(radius) = 1])]",
     "a geometry is a mesh or a sphere with a radius"},
    {"//mesh/source[not(@id) or numbers(float_array) != float_array/@count]",
     "a source has an id and as many numbers as it says"},
    {"//mesh[count(polylist) != 1 or triangles or not(vertices/@id)]",
     "a mesh has vertices with an id and one polylist"},
    {"//polylist/input[not(@semantic = 'VERTEX' and @source = ../../vertices/@id or "
     "@semantic = 'NORMAL' and @source = ../../source/@id)]",
     "a polylist has VERTEX, of its mesh's vertices, and at most NORMAL"},
    {"//polylist[not(input/@semantic = 'VERTEX' and ../vertices/input/@source = ../source/@id) or "
     "input[not(@offset < count(../input))] or numbers(vcount) != @count or "
     "numbers(p) != 3 * @count * count(input)]",
     "a polylist has as many numbers as it says"},
    {"//vcount[translate(normalize-space(.), ' 3', '') != '' or contains(., '33')]",
     "of a polygon only the first three corners are seen"},
};

static bool breach(struct walk *w, const xmlNode *n, const char *rule)
{
    xmlChar *id = xmlGetProp(n, BAD_CAST "id");
    snprintf(w->breach, sizeof w->breach, "<%s %s>: %s", (const char *)n->name,
             id != NULL ? (const char *)id : "", rule);
    xmlFree(id);
    return false;
}

/* The nodes that an expression finds, from n on; the caller frees. */
static xmlXPathObject *find(const struct walk *w, const xmlNode *n, const char *expression)
{
    xmlXPathSetContextNode((xmlNode *)n, w->xpath);
    xmlXPathObject *found = xmlXPathEval(BAD_CAST expression, w->xpath);
    if (found == NULL)
        fail_msg("%s", expression);
    return found;
}

/* The first; NULL: none. */
static xmlNode *first(const struct walk *w, const xmlNode *n, const char *expression)
{
    xmlXPathObject *found = find(w, n, expression);
    xmlNode *node = xmlXPathNodeSetItem(found->nodesetval, 0);
    xmlXPathFreeObject(found);
    return node;
}

/* How many numbers a text has. */
static int numbers_of(const char *text, double *out, int most)
{
    int num = 0;
    char *end;
    for (; num < most; text = end, num++) {
        out[num] = strtod(text, &end);
        if (end == text)
            break;
    }
    return num;
}

static int numbers(const struct walk *w, const xmlNode *n, const char *expression, double *out,
                   int most)
{
    xmlChar *text = xmlNodeGetContent(first(w, n, expression));
    int num = text != NULL ? numbers_of((const char *)text, out, most) : 0;
    xmlFree(text);
    return num;
}

static void numbers_in_xpath(xmlXPathParserContext *c, int arguments)
{
    static double ignored[MOST];
    assert_int_equal(arguments, 1);
    xmlChar *text = xmlXPathPopString(c);
    xmlXPathReturnNumber(c, numbers_of((const char *)text, ignored, MOST));
    xmlFree(text);
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
    static double points[MOST], normals[MOST], index[MOST];
    static int corner[MOST], normal[MOST];
    static struct side side[MOST];
    struct mesh m = {.p = points, .corner = corner, .normal = normal};
    double stride, vertex, n = 0;
    numbers(w, g, "mesh/polylist/@count", &stride, 1);
    m.num_triangles = (int)stride;
    numbers(w, g, "mesh/polylist/input[@semantic = 'VERTEX']/@offset", &vertex, 1);
    if (numbers(w, g, "mesh/polylist/input[@semantic = 'NORMAL']/@offset", &n, 1) == 1 &&
        numbers(w, g,
                "mesh/source[@id = ../polylist/input[@semantic = 'NORMAL']/@source]/float_array",
                normals, MOST) > 0)
        m.n = normals;
    m.num_points =
        numbers(w, g, "mesh/source[@id = ../vertices/input/@source]/float_array", points, MOST) / 3;
    stride = numbers(w, g, "mesh/polylist/p", index, MOST) / (3.0 * m.num_triangles);
    for (int i = 0; i < 3 * m.num_triangles; i++) {
        corner[i] = (int)index[(int)(i * stride + vertex)];
        normal[i] = (int)index[(int)(i * stride + n)];
        assert_in_range(corner[i], 0, m.num_points - 1);
    }
    add_triangles(w, &m, to);
    return walk_sides(w, g, &m, side);
}

static bool walk_sphere(struct walk *w, const xmlNode *g, double radius, const double *m)
{
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

/* What a node places: a light that is directional, a sphere, a mesh. */
static bool walk_node(struct walk *w, const xmlNode *n)
{
    double m[16], radius;
    numbers(w, n, "matrix", m, 16);
    xmlChar *url = xmlGetProp(first(w, n, "*[@url]"), BAD_CAST "url");
    const xmlNode *what = first(w, n, fs_path("//*[@id = '%s']", (const char *)url).s);
    xmlFree(url);
    for (int i = 0; i < 3 && first(w, what, KIND "[self::directional]") != NULL; i++)
        for (int k = 0; k < 3; k++)
            if (fabs(m[4 * i + 3] * m[4 * k + 2] - m[4 * k + 3] * m[4 * i + 2]) > 1e-3)
                return breach(w, what, "a directional light lies on its own axis");
    if (first(w, what, "mesh") != NULL)
        return walk_mesh(w, what, m);
    return numbers(w, what, CGL "/sphere/radius", &radius, 1) == 0 ||
           walk_sphere(w, what, radius, m);
}

static double centre(const struct primitive *p, int axis)
{
    return (p->low[axis] + p->high[axis]) / 2;
}

/* Does splitting at the mean of the centroids on the longest axis, the usual first BVH, end in leaves of at most
 * LEAF? */
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

static bool walk_scene(struct walk *w, const xmlNode *root)
{
    for (size_t i = 0; i < COUNT(rules); i++) {
        const xmlNode *n = first(w, root, rules[i].found);
        if (n != NULL)
            return breach(w, n, rules[i].rule);
    }
    const xmlNode *scene = first(w, root, "//visual_scene");
    xmlXPathObject *nodes = find(w, scene, "node");
    bool ok = true;
    for (int i = 0; ok && i < xmlXPathNodeSetGetLength(nodes->nodesetval); i++)
        ok = walk_node(w, xmlXPathNodeSetItem(nodes->nodesetval, i));
    xmlXPathFreeObject(nodes);
    return ok && (splits(w->primitive, w->num_primitives) ||
                  breach(w, scene, "centres that no plane parts"));
}

/* Without name spaces, and ids as references have them. */
static void prepare(xmlNode *n)
{
    for (; n != NULL; n = n->next) {
        xmlChar *id = n->type == XML_ELEMENT_NODE ? xmlGetProp(n, BAD_CAST "id") : NULL;
        if (id != NULL)
            xmlSetProp(n, BAD_CAST "id", BAD_CAST fs_path("#%s", (const char *)id).s);
        xmlFree(id);
        n->ns = NULL;
        prepare(n->children);
    }
}

const char *course_scene_breach(const char *text, bool has_environment)
{
    static struct primitive primitive[MOST];
    static struct walk w;
    xmlDoc *doc = xmlReadMemory(text, (int)strlen(text), "scene", NULL, XML_PARSE_NONET);
    assert_non_null(doc);
    prepare(xmlDocGetRootElement(doc));
    w = (struct walk){.xpath = xmlXPathNewContext(doc), .primitive = primitive};
    assert_non_null(w.xpath);
    xmlXPathRegisterVariable(w.xpath, BAD_CAST "environment", xmlXPathNewBoolean(has_environment));
    xmlXPathRegisterFunc(w.xpath, BAD_CAST "numbers", numbers_in_xpath);
    walk_scene(&w, xmlDocGetRootElement(doc));
    xmlXPathFreeContext(w.xpath);
    xmlFreeDoc(doc);
    return w.breach;
}
