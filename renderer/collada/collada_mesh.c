/* Reads <geometry>: meshes of polygons, which become triangles, and the analytic sphere of our extras. */
#include "collada_internal.h"
#include "renderer/scene/triangulate.h"

#include <stdlib.h>
#include <string.h>

/* How the corners of a <p> make polygons. */
enum cut { CUT_TRIANGLES, CUT_BY_VCOUNT, CUT_WHOLE, CUT_STRIP, CUT_FAN };
static const struct {
    const char *name, *children;
    enum cut cut;
} KINDS[] = {
    {"triangles", "input* p? extra*", CUT_TRIANGLES},
    {"polylist", "input* vcount? p? extra*", CUT_BY_VCOUNT},
    {"polygons", "input* p* extra*", CUT_WHOLE},
    {"tristrips", "input* p* extra*", CUT_STRIP},
    {"trifans", "input* p* extra*", CUT_FAN},
};

/* Scratch memory for one polygon. */
struct polygon {
    struct corner corners[MAX_POLYGON_CORNERS];
    dvec3 points[MAX_POLYGON_CORNERS];
    uint32_t index[3 * MAX_POLYGON_CORNERS];
};

/* The mesh that is being read, and its current primitive. */
struct work {
    struct mesh *mesh;
    struct sources all;
    enum cut cut;
    struct inputs in;
    struct uints sizes; /* CUT_BY_VCOUNT */
    size_t found;       /* polygons */
    struct polygon *polygon;
};

void mesh_release(struct mesh *m)
{
    free(m->corners);
    free(m->groups);
    free(m->uv);
}

/* Largest texture coordinate: beyond it floats have too few digits. */
#define MOST_UV 1e6

/* Value of an input for the corner with these indices. what: its name in errors. */
static dvec3 look_up(struct loader *ld, const xmlNode *p, const struct work *w,
                     const struct input *in, const uint32_t *numbers, const char *what)
{
    const struct source *s = &w->all.data[in->source];
    uint32_t i = numbers[in->offset];
    if (i >= s->count) {
        fail_at(ld, p, "%s index %u out of range: there are %u", what, i, (unsigned)s->count);
        return d3(0, 0, 0);
    }
    const double *x = s->array.data + s->size * (size_t)i;
    return d3(x[0], x[1], s->size > 2 ? x[2] : 0);
}

/* The corner with the indices in `numbers`; appends its texture coordinates to the mesh. */
static struct corner read_corner(struct loader *ld, const xmlNode *p, const struct work *w,
                                 const uint32_t *numbers)
{
    struct mesh *m = w->mesh;
    const struct inputs *in = &w->in;
    struct corner c = {.uv = (uint32_t)m->num_uv};
    dvec3 x = look_up(ld, p, w, &in->position, numbers, "vertex");
    if (fabs(x.x) > FARTHEST || fabs(x.y) > FARTHEST || fabs(x.z) > FARTHEST)
        fail_at(ld, p, "vertex %u: a coordinate is beyond %g", numbers[in->position.offset],
                FARTHEST);
    c.position = x;
    for (size_t k = 0; k < in->num_uv; k++) {
        x = look_up(ld, p, w, &in->uv[k], numbers, "texture coordinate");
        if (fabs(x.x) > MOST_UV || fabs(x.y) > MOST_UV || m->num_uv >= UINT32_MAX)
            fail_at(ld, p, "texture coordinate %u is beyond %g", numbers[in->uv[k].offset],
                    MOST_UV);
        m->uv = build_grow(ld, m->uv, sizeof *m->uv, m->num_uv);
        if (!ld->failed)
            m->uv[m->num_uv++] = (struct uv){(float)x.x, (float)x.y};
    }
    if (!in->normal.present)
        return c;
    x = look_up(ld, p, w, &in->normal, numbers, "normal");
    if (d3_normalize(&x))
        c.normal = build_to_float(x);
    else
        ld->scene.num_zero_normals++;
    return c;
}

/* Number, among the corners of <p>, of corner k of the polygon that begins at corner `at`. Every other
 * triangle of a strip runs backwards. */
static size_t corner_of(enum cut cut, size_t at, size_t k)
{
    if (cut == CUT_FAN && k == 0)
        return 0;
    return at + (cut == CUT_STRIP && at % 2 == 1 && k > 0 ? 3 - k : k);
}

/* Adds a polygon of n corners to the mesh, as triangles. */
static void add_polygon(struct loader *ld, const xmlNode *p, struct work *w,
                        const uint32_t *numbers, size_t at, size_t n)
{
    struct mesh *m = w->mesh;
    struct polygon *work = w->polygon;
    size_t which = w->found++;
    if (n < 3 || n > MAX_POLYGON_CORNERS)
        fail_at(ld, p, "polygon %zu has %zu corners; 3 to %d are supported", which, n,
                MAX_POLYGON_CORNERS);
    for (size_t k = 0; k < n && !ld->failed; k++) {
        size_t corner = corner_of(w->cut, at, k);
        work->corners[k] = read_corner(ld, p, w, numbers + corner * w->in.stride);
        work->points[k] = work->corners[k].position;
    }
    if (ld->failed)
        return;
    enum triangulate_result result = triangulate(work->points, (uint32_t)n, work->index);
    ld->num_left_out[LEFT_OUT_CROSSED] += result == TRIANGULATE_CROSSED;
    if (result == TRIANGULATE_MEMORY)
        element_fail_memory(ld);
    for (size_t t = 0; t < n - 2; t++) {
        if (m->num_triangles >= MAX_TRIANGLES)
            fail_at(ld, p, "more than %d triangles", MAX_TRIANGLES);
        m->corners = build_grow(ld, m->corners, 3 * sizeof *m->corners, m->num_triangles);
        if (ld->failed)
            return;
        for (size_t k = 0; k < 3; k++)
            m->corners[3 * m->num_triangles + k] = work->corners[work->index[3 * t + k]];
        m->num_triangles++;
    }
}

/* Reads one <p>. */
static void read_p(struct loader *ld, const xmlNode *node, struct work *w)
{
    struct uints p = {NULL, 0};
    bool slides = w->cut == CUT_STRIP || w->cut == CUT_FAN;
    text_read_uints(ld, node, &p);
    size_t corners = p.count / w->in.stride, at = 0;
    if (p.count % w->in.stride != 0)
        fail_at(ld, node, "<p> has %zu indices, which is not a multiple of %llu", p.count,
                (unsigned long long)w->in.stride);
    while (!ld->failed && at < corners - (slides && corners > 2 ? 2 : 0)) {
        size_t left = corners - at, n = slides && left < 3 ? left : 3;
        if (w->cut == CUT_WHOLE)
            n = corners;
        if (w->cut == CUT_BY_VCOUNT)
            n = w->found < w->sizes.count ? w->sizes.data[w->found] : left + 1;
        if (n <= left)
            add_polygon(ld, node, w, p.data, at, n);
        else
            fail_at(ld, node, "<p> has %zu corners, which do not end with polygon %zu", corners,
                    w->found);
        at += slides ? 1 : n;
    }
    free(p.data);
}

static void read_all_p(struct loader *ld, const xmlNode *primitive, struct work *w)
{
    const xmlNode *vcount = element_child(primitive, "vcount");
    uint64_t count = element_count(ld, primitive, "count");
    size_t num_p = 0;
    bool by_polygon = w->cut == CUT_TRIANGLES || w->cut == CUT_BY_VCOUNT;
    if (vcount != NULL)
        text_read_uints(ld, vcount, &w->sizes);
    if (w->cut == CUT_BY_VCOUNT && w->sizes.count != count)
        fail_at(ld, vcount != NULL ? vcount : primitive,
                "<vcount> has %zu numbers, the count is %llu", w->sizes.count,
                (unsigned long long)count);
    for (const xmlNode *c = element_first(primitive); c != NULL && !ld->failed;
         c = element_next(c)) {
        if (!element_is(c, "p"))
            continue;
        num_p++;
        read_p(ld, c, w);
    }
    size_t found = by_polygon ? w->found : num_p;
    if (found != count)
        fail_at(ld, primitive, "<%s> has %zu %s, its count says %llu",
                (const char *)primitive->name, found, by_polygon ? "polygons" : "<p>",
                (unsigned long long)count);
}

static void read_primitive(struct loader *ld, const xmlNode *primitive, struct work *w)
{
    struct mesh *m = w->mesh;
    w->in = source_read_inputs(ld, &w->all, primitive);
    w->found = w->sizes.count = 0;
    m->groups = build_grow(ld, m->groups, sizeof *m->groups, m->num_groups);
    if (ld->failed)
        return;
    struct mesh_group *g = &m->groups[m->num_groups++];
    *g = (struct mesh_group){.symbol = element_attribute(primitive, "material"),
                             .node = primitive,
                             .first = m->num_triangles,
                             .num_uv = w->in.num_uv};
    for (size_t k = 0; k < w->in.num_uv; k++)
        g->uv_set[k] = w->in.uv[k].set;
    read_all_p(ld, primitive, w);
    g->count = m->num_triangles - g->first;
}

static void read_mesh(struct loader *ld, struct mesh *m, const xmlNode *node)
{
    element_check(ld, node,
                  "source* vertices* triangles* polylist* polygons* tristrips* trifans* lines* "
                  "linestrips* extra*");
    struct work w = {.mesh = m, .polygon = malloc(sizeof *w.polygon)};
    if (w.polygon == NULL)
        element_fail_memory(ld);
    for (const xmlNode *c = element_first(node); !ld->failed && c != NULL; c = element_next(c)) {
        ld->num_left_out[LEFT_OUT_LINES] += element_is_one_of(c, "lines linestrips");
        for (size_t k = 0; k < sizeof KINDS / sizeof *KINDS; k++) {
            if (!element_is(c, KINDS[k].name))
                continue;
            element_check(ld, c, KINDS[k].children);
            w.cut = KINDS[k].cut;
            read_primitive(ld, c, &w);
        }
    }
    source_release(&w.all);
    free(w.sizes.data);
    free(w.polygon);
}

static void read_sphere(struct loader *ld, struct mesh *m, const xmlNode *technique)
{
    bool is_assay = strcmp(element_attribute(technique, "profile"), "ASSAY") == 0;
    element_check(ld, technique, "sphere");
    const xmlNode *sphere = element_child(technique, "sphere");
    element_check(ld, sphere, is_assay ? "radius facing?" : "radius");
    m->is_sphere = true;
    m->radius = field_number(ld, sphere, "radius", 0, ANY_LENGTH);
    m->normal_out = field_choice(ld, sphere, "facing", "out in", 0) == 0 ? 1 : -1;
}

static void read_geometry(struct loader *ld, const xmlNode *geometry, struct mesh *m)
{
    const xmlNode *technique = element_own_technique(ld, geometry),
                  *mesh = element_child(geometry, "mesh");
    element_check(ld, geometry, "asset? mesh? extra*");
    if (ld->failed)
        return;
    if (technique != NULL && mesh != NULL)
        fail_at(ld, technique, "a <geometry> with both a <mesh> and a technique of '%s'",
                element_attribute(technique, "profile"));
    else if (technique != NULL)
        read_sphere(ld, m, technique);
    else if (mesh != NULL)
        read_mesh(ld, m, mesh);
    else
        fail_at(ld, geometry, "<geometry> without a <mesh>");
}

const struct mesh *mesh_of_geometry(struct loader *ld, const xmlNode *geometry)
{
    for (size_t i = 0; i < ld->num_meshes; i++)
        if (ld->meshes[i].node == geometry)
            return &ld->meshes[i];
    ld->meshes = build_grow(ld, ld->meshes, sizeof *ld->meshes, ld->num_meshes);
    if (ld->failed)
        return NULL;
    struct mesh *m = &ld->meshes[ld->num_meshes++];
    *m = (struct mesh){.node = geometry};
    read_geometry(ld, geometry, m);
    return m;
}
