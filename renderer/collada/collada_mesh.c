/* <geometry>: meshes of polygons into triangles, and the analytic sphere of our extras. */
#include "collada_internal.h"
#include "renderer/scene/triangulate.h"

#include <stdlib.h>
#include <string.h>

/* One polygon at work. */
struct polygon {
    struct corner *corners;
    dvec3 *points;
    uint32_t *index;
    size_t capacity;
};

void mesh_release(struct mesh *m)
{
    free(m->corners);
    free(m->groups);
    free(m->uv);
    *m = (struct mesh){0};
}

static bool reserve_polygon(struct loader *ld, struct polygon *work, size_t n)
{
    if (n <= work->capacity)
        return true;
    struct corner *corners = realloc(work->corners, n * sizeof *corners);
    work->corners = corners != NULL ? corners : work->corners;
    dvec3 *points = realloc(work->points, n * sizeof *points);
    work->points = points != NULL ? points : work->points;
    uint32_t *index = realloc(work->index, 3 * n * sizeof *index);
    work->index = index != NULL ? index : work->index;
    if (corners == NULL || points == NULL || index == NULL)
        return fail_memory(ld);
    work->capacity = n;
    return true;
}

/* Texture coordinates beyond float's digits are none. */
#define MOST_UV 1e6

/* All sets of a corner. */
static bool read_uv(struct loader *ld, struct mesh *m, const xmlNode *p, const struct sources *all,
                    const struct inputs *in, const uint32_t *numbers, struct corner *out)
{
    out->uv = (uint32_t)m->num_uv;
    for (size_t k = 0; k < in->num_uv; k++) {
        const struct source *from = &all->data[in->uv[k].source];
        uint32_t i = numbers[in->uv[k].by_vertex ? in->vertex_offset : in->uv[k].offset];
        struct uv *grown = build_grow(ld, m->uv, sizeof *grown, m->num_uv, &m->cap_uv);
        if (grown == NULL)
            return false;
        m->uv = grown;
        if (i >= from->count)
            return fail_at(ld, p, "texture coordinate index %u out of range: there are %u", i,
                           from->count);
        const double *x = from->xyz + 2 * (size_t)i;
        if (!(fabs(x[0]) <= MOST_UV && fabs(x[1]) <= MOST_UV) || m->num_uv >= UINT32_MAX)
            return fail_at(ld, p, "texture coordinate %u is beyond %g", i, MOST_UV);
        grown[m->num_uv++] = (struct uv){(float)x[0], (float)x[1]};
    }
    return true;
}

static bool read_corner(struct loader *ld, struct mesh *m, const xmlNode *p,
                        const struct sources *all, const struct inputs *in, const uint32_t *numbers,
                        struct corner *out)
{
    const struct source *position = &all->data[in->position];
    uint32_t i = numbers[in->vertex_offset];
    if (i >= position->count)
        return fail_at(ld, p, "vertex index %u out of range: there are %u", i, position->count);
    const double *x = position->xyz + 3 * (size_t)i;
    out->position = d3(x[0], x[1], x[2]);
    for (int k = 0; k < 3; k++)
        if (fabs(x[k]) > FARTHEST)
            return fail_at(ld, p, "vertex %u: a coordinate is beyond %g", i, FARTHEST);
    memset(out->normal, 0, sizeof out->normal);
    if (!read_uv(ld, m, p, all, in, numbers, out))
        return false;
    if (in->normal < 0)
        return true;
    const struct source *normal = &all->data[in->normal];
    if (!in->normal_by_vertex)
        i = numbers[in->normal_offset];
    if (i >= normal->count)
        return fail_at(ld, p, "normal index %u out of range: there are %u", i, normal->count);
    dvec3 n = d3(normal->xyz[3 * (size_t)i], normal->xyz[3 * (size_t)i + 1],
                 normal->xyz[3 * (size_t)i + 2]);
    if (d3_normalize(&n)) {
        out->normal[0] = (float)n.x;
        out->normal[1] = (float)n.y;
        out->normal[2] = (float)n.z;
    } else {
        ld->scene.num_zero_normals++;
    }
    return true;
}

/* How the corners of a <p> make polygons. */
enum cut { CUT_TRIANGLES, CUT_BY_VCOUNT, CUT_WHOLE, CUT_STRIP, CUT_FAN, CUT_NOTHING };
static const struct primitive_kind {
    const char *name, *children;
    enum cut cut;
} KINDS[] = {
    {"triangles", "input p extra", CUT_TRIANGLES},
    {"polylist", "input vcount p extra", CUT_BY_VCOUNT},
    {"polygons", "input p ph extra", CUT_WHOLE},
    {"tristrips", "input p extra", CUT_STRIP},
    {"trifans", "input p extra", CUT_FAN},
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
static bool add_polygon(struct loader *ld, struct mesh *m, const xmlNode *p, struct primitive *of,
                        const uint32_t *numbers, size_t at, size_t n)
{
    size_t which = of->found++;
    struct polygon *work = of->work;
    if (n < 3 || n > MAX_POLYGON_CORNERS)
        return fail_at(ld, p, "polygon %zu has %zu corners; 3 to %d are supported", which, n,
                       MAX_POLYGON_CORNERS);
    if (!reserve_polygon(ld, work, n))
        return false;
    for (size_t k = 0; k < n; k++) {
        if (!read_corner(ld, m, p, of->all, &of->in,
                         numbers + corner_of(of->kind->cut, at, k) * of->in.stride,
                         &work->corners[k]))
            return false;
        work->points[k] = work->corners[k].position;
    }
    switch (triangulate(work->points, (uint32_t)n, work->index)) {
    case TRIANGULATE_OK:
    case TRIANGULATE_FLAT: break;
    case TRIANGULATE_CROSSED: ld->num_left_out[LEFT_OUT_CROSSED]++; break;
    case TRIANGULATE_MEMORY: return fail_memory(ld);
    }
    for (size_t t = 0; t < n - 2; t++) {
        if (m->num_triangles >= MAX_TRIANGLES)
            return fail_at(ld, p, "more than %d triangles", MAX_TRIANGLES);
        struct corner *c =
            build_grow(ld, m->corners, 3 * sizeof *c, m->num_triangles, &m->capacity);
        if (c == NULL)
            return false;
        m->corners = c;
        for (size_t k = 0; k < 3; k++)
            c[3 * m->num_triangles + k] = work->corners[work->index[3 * t + k]];
        m->num_triangles++;
    }
    return true;
}

/* One <p>. */
static bool read_p(struct loader *ld, struct mesh *m, const xmlNode *node, struct primitive *of)
{
    struct uints p = {NULL, 0, 0};
    enum cut cut = of->kind->cut;
    bool slides = cut == CUT_STRIP || cut == CUT_FAN;
    bool ok = text_read_uints(ld, node, &p);
    size_t corners = p.count / of->in.stride, at = 0;
    if (ok && p.count % of->in.stride != 0)
        ok = fail_at(ld, node, "<p> has %zu indices, which is not a multiple of %llu", p.count,
                     (unsigned long long)of->in.stride);
    while (ok && at < corners - (slides && corners > 2 ? 2 : 0)) {
        size_t left = corners - at, n = slides ? (left < 3 ? left : 3) : 3;
        if (cut == CUT_WHOLE)
            n = corners;
        else if (cut == CUT_BY_VCOUNT && of->found < of->sizes.count)
            n = of->sizes.data[of->found];
        else if (cut == CUT_BY_VCOUNT)
            n = left + 1;
        ok = n <= left ? add_polygon(ld, m, node, of, p.data, at, n)
                       : fail_at(ld, node, "<p> has %zu corners, which do not end with polygon %zu",
                                 corners, of->found);
        at += slides ? 1 : n;
    }
    free(p.data);
    return ok;
}

static bool read_all_p(struct loader *ld, struct mesh *m, const xmlNode *primitive,
                       struct primitive *of, uint64_t count)
{
    xmlNode *vcount;
    size_t num_p = 0;
    enum cut cut = of->kind->cut;
    if (!element_one_child(ld, primitive, "vcount", &vcount) ||
        (vcount != NULL && !text_read_uints(ld, vcount, &of->sizes)))
        return false;
    if (cut == CUT_BY_VCOUNT && of->sizes.count != count)
        return fail_at(ld, vcount != NULL ? vcount : primitive,
                       "<vcount> has %zu numbers, the count is %llu", of->sizes.count,
                       (unsigned long long)count);
    for (const xmlNode *c = element_first_child(primitive); c != NULL;
         c = element_next_sibling(c)) {
        if (element_is(c, "ph"))
            return fail_at(ld, c, "polygons with holes (<ph>) are not supported");
        if (!element_is(c, "p"))
            continue;
        if (num_p++ > 0 && (cut == CUT_TRIANGLES || cut == CUT_BY_VCOUNT))
            return fail_at(ld, c, "a second <p> in <%s>", of->kind->name);
        if (!read_p(ld, m, c, of))
            return false;
    }
    bool by_polygon = cut == CUT_TRIANGLES || cut == CUT_BY_VCOUNT;
    size_t found = by_polygon ? of->found : num_p;
    return found == count ||
           fail_at(ld, primitive, "<%s> has %zu %s, its count says %llu", of->kind->name, found,
                   by_polygon ? "polygons" : "<p>", (unsigned long long)count);
}

static bool read_primitive(struct loader *ld, struct mesh *m, const xmlNode *primitive,
                           const struct primitive_kind *kind, struct sources *all,
                           struct polygon *work)
{
    struct primitive of = {.kind = kind, .all = all, .work = work};
    uint64_t count;
    if (!element_only_children(ld, primitive, kind->children) ||
        !element_attribute_count(ld, primitive, "count", &count) ||
        !source_read_inputs(ld, all, primitive, &of.in))
        return false;
    struct mesh_group *g = realloc(m->groups, (m->num_groups + 1) * sizeof *g);
    if (g == NULL)
        return fail_memory(ld);
    m->groups = g;
    g = &g[m->num_groups++];
    *g = (struct mesh_group){.symbol = element_attribute(primitive, "material"),
                             .node = primitive,
                             .first = m->num_triangles,
                             .num_uv = of.in.num_uv};
    for (size_t k = 0; k < of.in.num_uv; k++)
        g->uv_set[k] = of.in.uv[k].set;
    bool ok = read_all_p(ld, m, primitive, &of, count);
    free(of.sizes.data);
    g->count = m->num_triangles - g->first;
    return ok;
}

static bool read_mesh(struct loader *ld, struct mesh *m, const xmlNode *node)
{
    struct sources all = {NULL, 0, 0};
    struct polygon work = {NULL, NULL, NULL, 0};
    bool ok = true;
    for (const xmlNode *c = element_first_child(node); ok && c != NULL;
         c = element_next_sibling(c)) {
        size_t k = 0;
        while (k < sizeof KINDS / sizeof *KINDS && !element_is(c, KINDS[k].name))
            k++;
        if (k == sizeof KINDS / sizeof *KINDS)
            ok = element_is_one_of(c, "source vertices extra") || element_fail_unexpected(ld, c);
        else if (KINDS[k].cut == CUT_NOTHING)
            ld->num_left_out[LEFT_OUT_LINES]++;
        else
            ok = read_primitive(ld, m, c, &KINDS[k], &all, &work);
    }
    source_release(&all);
    free(work.corners);
    free(work.points);
    free(work.index);
    return ok;
}

static bool read_sphere(struct loader *ld, struct mesh *m, const xmlNode *technique)
{
    const struct field radius = {"radius", FIELD_NUMBER, &m->radius,
                                 true,     .lo = 1e-300, .hi = 1e300};
    xmlNode *sphere;
    bool inward = false;
    if (!element_technique_content(ld, technique, &sphere))
        return false;
    if (!element_is(sphere, "sphere"))
        return fail_at(ld, sphere, "unknown geometry tag '%.60s'", (const char *)sphere->name);
    bool is_assay = strcmp(element_attribute(technique, "profile"), "ASSAY") == 0;
    if (!(is_assay ? field_read_all(
                         ld, sphere,
                         FIELDS(radius, {"facing", FIELD_CHOICE, &inward, .words = {"out", "in"}}))
                   : field_read_all(ld, sphere, &radius, 1)))
        return false;
    m->is_sphere = true;
    m->normal_out = inward ? -1 : 1;
    return true;
}

static bool read_geometry(struct loader *ld, const xmlNode *geometry, struct mesh *m)
{
    xmlNode *technique;
    for (const xmlNode *c = element_first_child(geometry); c != NULL; c = element_next_sibling(c)) {
        if (element_is_one_of(c, "convex_mesh spline brep"))
            return fail_at(ld, c, "<%s> is not supported", (const char *)c->name);
        if (!element_is_one_of(c, "asset mesh extra"))
            return element_fail_unexpected(ld, c);
    }
    xmlNode *mesh;
    if (!element_own_technique(ld, geometry, &technique) ||
        !element_one_child(ld, geometry, "mesh", &mesh))
        return false;
    if (technique != NULL && mesh != NULL)
        return fail_at(ld, technique, "a <geometry> with both a <mesh> and a technique of '%s'",
                       element_attribute(technique, "profile"));
    if (technique != NULL)
        return read_sphere(ld, m, technique);
    if (mesh == NULL)
        return fail_at(ld, geometry, "<geometry> without a <mesh>");
    return read_mesh(ld, m, mesh);
}

bool geometry_get(struct loader *ld, const xmlNode *geometry, const struct mesh **out)
{
    for (size_t i = 0; i < ld->num_meshes; i++) {
        if (ld->meshes[i].node == geometry) {
            *out = &ld->meshes[i];
            return true;
        }
    }
    struct mesh *grown = build_grow(ld, ld->meshes, sizeof *grown, ld->num_meshes, &ld->cap_meshes);
    if (grown == NULL)
        return false;
    ld->meshes = grown;
    struct mesh *m = &grown[ld->num_meshes];
    *m = (struct mesh){.node = geometry};
    if (!read_geometry(ld, geometry, m)) {
        mesh_release(m);
        return false;
    }
    ld->num_meshes++;
    *out = m;
    return true;
}
