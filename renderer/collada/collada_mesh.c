/* <geometry>: meshes of polygons into triangles, and the analytic sphere of our extras. */
#include "collada_internal.h"
#include "renderer/scene/triangulate.h"

#include <stdlib.h>
#include <string.h>

/* One polygon at work. */
struct polygon {
    struct corner corners[MAX_POLYGON_CORNERS];
    dvec3 points[MAX_POLYGON_CORNERS];
    uint32_t index[3 * MAX_POLYGON_CORNERS];
};

void mesh_release(struct mesh *m)
{
    free(m->corners);
    free(m->groups);
    free(m->uv);
}

/* Texture coordinates beyond float's digits are none. */
#define MOST_UV 1e6

/* What an input says of a corner of these indices; `what` it is. */
static dvec3 look_up(struct loader *ld, const xmlNode *p, const struct sources *all,
                     const struct input *in, const uint32_t *numbers, const char *what)
{
    const struct source *s = &all->data[in->source];
    uint32_t i = numbers[in->offset];
    if (i >= s->count) {
        fail_at(ld, p, "%s index %u out of range: there are %u", what, i, (unsigned)s->count);
        return d3(0, 0, 0);
    }
    const double *x = s->array.data + s->size * (size_t)i;
    return d3(x[0], x[1], s->size > 2 ? x[2] : 0);
}

/* Of the indices in `numbers`. */
static struct corner read_corner(struct loader *ld, struct mesh *m, const xmlNode *p,
                                 const struct sources *all, const struct inputs *in,
                                 const uint32_t *numbers)
{
    struct corner c = {.uv = (uint32_t)m->num_uv};
    dvec3 x = look_up(ld, p, all, &in->position, numbers, "vertex");
    if (fabs(x.x) > FARTHEST || fabs(x.y) > FARTHEST || fabs(x.z) > FARTHEST)
        fail_at(ld, p, "vertex %u: a coordinate is beyond %g", numbers[in->position.offset],
                FARTHEST);
    c.position = x;
    for (size_t k = 0; k < in->num_uv; k++) {
        x = look_up(ld, p, all, &in->uv[k], numbers, "texture coordinate");
        if (fabs(x.x) > MOST_UV || fabs(x.y) > MOST_UV || m->num_uv >= UINT32_MAX)
            fail_at(ld, p, "texture coordinate %u is beyond %g", numbers[in->uv[k].offset],
                    MOST_UV);
        m->uv = build_grow(ld, m->uv, sizeof *m->uv, m->num_uv);
        if (!ld->failed)
            m->uv[m->num_uv++] = (struct uv){(float)x.x, (float)x.y};
    }
    if (!in->normal.present)
        return c;
    x = look_up(ld, p, all, &in->normal, numbers, "normal");
    if (d3_normalize(&x)) {
        c.normal[0] = (float)x.x;
        c.normal[1] = (float)x.y;
        c.normal[2] = (float)x.z;
    } else {
        ld->scene.num_zero_normals++;
    }
    return c;
}

/* How the corners of a <p> make polygons. */
enum cut { CUT_TRIANGLES, CUT_BY_VCOUNT, CUT_WHOLE, CUT_STRIP, CUT_FAN, CUT_NOTHING };
static const struct primitive_kind {
    const char *name, *children;
    enum cut cut;
} KINDS[] = {
    {"triangles", "input* p? extra*", CUT_TRIANGLES},
    {"polylist", "input* vcount? p? extra*", CUT_BY_VCOUNT},
    {"polygons", "input* p* extra*", CUT_WHOLE},
    {"tristrips", "input* p* extra*", CUT_STRIP},
    {"trifans", "input* p* extra*", CUT_FAN},
    {"lines", NULL, CUT_NOTHING},
    {"linestrips", NULL, CUT_NOTHING},
};

/* What reading one primitive needs. */
struct primitive {
    const struct primitive_kind *kind;
    const struct sources *all;
    struct inputs in;
    struct polygon *work;
    struct uints sizes; /* CUT_BY_VCOUNT */
    size_t found;       /* polygons */
};

/* The place in <p> of corner k of the polygon that begins at corner `at`. Every other triangle of a
 * strip runs backwards. */
static size_t corner_of(enum cut cut, size_t at, size_t k)
{
    if (cut == CUT_FAN && k == 0)
        return 0;
    return at + (cut == CUT_STRIP && at % 2 == 1 && k > 0 ? 3 - k : k);
}

/* A polygon of n corners into triangles of the mesh. */
static void add_polygon(struct loader *ld, struct mesh *m, const xmlNode *p, struct primitive *of,
                        const uint32_t *numbers, size_t at, size_t n)
{
    size_t which = of->found++;
    struct polygon *work = of->work;
    if (n < 3 || n > MAX_POLYGON_CORNERS) {
        fail_at(ld, p, "polygon %zu has %zu corners; 3 to %d are supported", which, n,
                MAX_POLYGON_CORNERS);
        return;
    }
    for (size_t k = 0; k < n && !ld->failed; k++) {
        const uint32_t *corner = numbers + corner_of(of->kind->cut, at, k) * of->in.stride;
        work->corners[k] = read_corner(ld, m, p, of->all, &of->in, corner);
        work->points[k] = work->corners[k].position;
    }
    if (ld->failed)
        return;
    switch (triangulate(work->points, (uint32_t)n, work->index)) {
    case TRIANGULATE_OK:
    case TRIANGULATE_FLAT: break;
    case TRIANGULATE_CROSSED: ld->num_left_out[LEFT_OUT_CROSSED]++; break;
    case TRIANGULATE_MEMORY: fail_memory(ld); return;
    }
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

/* One <p>. */
static void read_p(struct loader *ld, struct mesh *m, const xmlNode *node, struct primitive *of)
{
    struct uints p = {NULL, 0};
    enum cut cut = of->kind->cut;
    bool slides = cut == CUT_STRIP || cut == CUT_FAN;
    text_read_uints(ld, node, &p);
    size_t corners = p.count / of->in.stride, at = 0;
    if (p.count % of->in.stride != 0)
        fail_at(ld, node, "<p> has %zu indices, which is not a multiple of %llu", p.count,
                (unsigned long long)of->in.stride);
    while (!ld->failed && at < corners - (slides && corners > 2 ? 2 : 0)) {
        size_t left = corners - at, n = slides && left < 3 ? left : 3;
        if (cut == CUT_WHOLE)
            n = corners;
        if (cut == CUT_BY_VCOUNT)
            n = of->found < of->sizes.count ? of->sizes.data[of->found] : left + 1;
        if (n <= left)
            add_polygon(ld, m, node, of, p.data, at, n);
        else
            fail_at(ld, node, "<p> has %zu corners, which do not end with polygon %zu", corners,
                    of->found);
        at += slides ? 1 : n;
    }
    free(p.data);
}

static void read_all_p(struct loader *ld, struct mesh *m, const xmlNode *primitive,
                       struct primitive *of)
{
    const xmlNode *vcount = element_child(primitive, "vcount");
    uint64_t count = element_count(ld, primitive, "count");
    size_t num_p = 0;
    bool by_polygon = of->kind->cut == CUT_TRIANGLES || of->kind->cut == CUT_BY_VCOUNT;
    if (vcount != NULL)
        text_read_uints(ld, vcount, &of->sizes);
    if (of->kind->cut == CUT_BY_VCOUNT && of->sizes.count != count)
        fail_at(ld, vcount != NULL ? vcount : primitive,
                "<vcount> has %zu numbers, the count is %llu", of->sizes.count,
                (unsigned long long)count);
    for (const xmlNode *c = element_first_child(primitive); c != NULL && !ld->failed;
         c = element_next_sibling(c)) {
        if (!element_is(c, "p"))
            continue;
        num_p++;
        read_p(ld, m, c, of);
    }
    size_t found = by_polygon ? of->found : num_p;
    if (found != count)
        fail_at(ld, primitive, "<%s> has %zu %s, its count says %llu", of->kind->name, found,
                by_polygon ? "polygons" : "<p>", (unsigned long long)count);
}

static void read_primitive(struct loader *ld, struct mesh *m, const xmlNode *primitive,
                           const struct primitive_kind *kind, struct sources *all,
                           struct polygon *work)
{
    struct primitive of = {.kind = kind, .all = all, .work = work};
    if (kind->cut == CUT_NOTHING) {
        ld->num_left_out[LEFT_OUT_LINES]++;
        return;
    }
    element_check(ld, primitive, kind->children);
    of.in = source_read_inputs(ld, all, primitive);
    m->groups = build_grow(ld, m->groups, sizeof *m->groups, m->num_groups);
    if (ld->failed)
        return;
    struct mesh_group *g = &m->groups[m->num_groups++];
    *g = (struct mesh_group){.symbol = element_attribute(primitive, "material"),
                             .node = primitive,
                             .first = m->num_triangles,
                             .num_uv = of.in.num_uv};
    for (size_t k = 0; k < of.in.num_uv; k++)
        g->uv_set[k] = of.in.uv[k].set;
    read_all_p(ld, m, primitive, &of);
    free(of.sizes.data);
    g->count = m->num_triangles - g->first;
}

static void read_mesh(struct loader *ld, struct mesh *m, const xmlNode *node)
{
    struct sources all = {NULL, 0};
    struct polygon *work = malloc(sizeof *work);
    if (work == NULL)
        fail_memory(ld);
    for (const xmlNode *c = element_first_child(node); !ld->failed && c != NULL;
         c = element_next_sibling(c)) {
        size_t k = 0;
        while (k < sizeof KINDS / sizeof *KINDS && !element_is(c, KINDS[k].name))
            k++;
        if (k < sizeof KINDS / sizeof *KINDS)
            read_primitive(ld, m, c, &KINDS[k], &all, work);
        else if (!element_is_one_of(c, "source vertices extra"))
            element_fail_unexpected(ld, c);
    }
    source_release(&all);
    free(work);
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

const struct mesh *geometry_get(struct loader *ld, const xmlNode *geometry)
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
