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

static bool read_corner(struct loader *ld, const xmlNode *p, const struct sources *all,
                        const struct inputs *in, const uint32_t *numbers, struct corner *out)
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

/* n corners, whose numbers start at `numbers`, into triangles of the mesh. */
static bool add_polygon(struct loader *ld, struct mesh *m, const xmlNode *p,
                        const struct sources *all, const struct inputs *in, struct polygon *work,
                        const uint32_t *numbers, size_t n, size_t which)
{
    if (n < 3 || n > MAX_POLYGON_CORNERS)
        return fail_at(ld, p, "polygon %zu has %zu corners; 3 to %d are supported", which, n,
                       MAX_POLYGON_CORNERS);
    if (!reserve_polygon(ld, work, n))
        return false;
    for (size_t k = 0; k < n; k++) {
        if (!read_corner(ld, p, all, in, numbers + k * in->stride, &work->corners[k]))
            return false;
        work->points[k] = work->corners[k].position;
    }
    switch (triangulate(work->points, (uint32_t)n, work->index)) {
    case TRIANGULATE_OK:
    case TRIANGULATE_FLAT: break;
    case TRIANGULATE_CROSSED: return fail_at(ld, p, "polygon %zu crosses itself", which);
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

/* <polylist> and <triangles>: one <p> for all. vcount is NULL for triangles. */
static bool read_list(struct loader *ld, struct mesh *m, const xmlNode *primitive,
                      const struct sources *all, const struct inputs *in, struct polygon *work,
                      uint64_t count)
{
    struct uints p = {NULL, 0, 0}, sizes = {NULL, 0, 0};
    bool ok = false;
    xmlNode *p_node, *size_node;
    bool is_polylist = element_is(primitive, "polylist");
    if (!element_one_child(ld, primitive, "p", &p_node) ||
        !element_one_child(ld, primitive, "vcount", &size_node))
        goto done;
    if (p_node != NULL && !text_read_uints(ld, p_node, &p))
        goto done;
    if (is_polylist && size_node != NULL && !text_read_uints(ld, size_node, &sizes))
        goto done;
    if (is_polylist && sizes.count != count) {
        fail_at(ld, size_node != NULL ? size_node : primitive,
                "<vcount> has %zu numbers, the count is %llu", sizes.count,
                (unsigned long long)count);
        goto done;
    }
    uint64_t corners = is_polylist ? 0 : 3 * count;
    for (size_t i = 0; i < sizes.count; i++)
        corners += sizes.data[i];
    if (p.count % in->stride != 0 || corners != p.count / in->stride) {
        fail_at(ld, p_node != NULL ? p_node : primitive,
                "<p> has %zu indices where %llu corners of %llu each are announced", p.count,
                (unsigned long long)corners, (unsigned long long)in->stride);
        goto done;
    }
    size_t at = 0;
    for (size_t i = 0; i < count; i++) {
        size_t n = is_polylist ? sizes.data[i] : 3;
        if (!add_polygon(ld, m, p_node, all, in, work, p.data + at, n, i))
            goto done;
        at += n * in->stride;
    }
    ok = true;
done:
    free(p.data);
    free(sizes.data);
    return ok;
}

/* <polygons>: a <p> for each. */
static bool read_polygons(struct loader *ld, struct mesh *m, const xmlNode *primitive,
                          const struct sources *all, const struct inputs *in, struct polygon *work,
                          uint64_t count)
{
    uint64_t found = 0;
    for (const xmlNode *c = element_first_child(primitive); c != NULL;
         c = element_next_sibling(c)) {
        if (element_is(c, "ph"))
            return fail_at(ld, c, "polygons with holes (<ph>) are not supported");
        if (!element_is(c, "p"))
            continue;
        struct uints p = {NULL, 0, 0};
        bool ok = text_read_uints(ld, c, &p);
        if (ok && p.count % in->stride != 0)
            ok = fail_at(ld, c, "<p> has %zu indices, which is not a multiple of %llu", p.count,
                         (unsigned long long)in->stride);
        if (ok)
            ok = add_polygon(ld, m, c, all, in, work, p.data, p.count / in->stride, found);
        free(p.data);
        if (!ok)
            return false;
        found++;
    }
    if (found != count)
        return fail_at(ld, primitive, "<polygons> has %llu <p>, its count says %llu",
                       (unsigned long long)found, (unsigned long long)count);
    return true;
}

static bool read_primitive(struct loader *ld, struct mesh *m, const xmlNode *primitive,
                           struct sources *all, struct polygon *work)
{
    struct inputs in;
    uint64_t count;
    const char *children = element_is(primitive, "polylist")   ? "input vcount p extra"
                           : element_is(primitive, "polygons") ? "input p ph extra"
                                                               : "input p extra";
    if (!element_only_children(ld, primitive, children) ||
        !element_attribute_count(ld, primitive, "count", &count) ||
        !source_read_inputs(ld, all, primitive, &in))
        return false;
    struct mesh_group *g = realloc(m->groups, (m->num_groups + 1) * sizeof *g);
    if (g == NULL)
        return fail_memory(ld);
    m->groups = g;
    g = &g[m->num_groups++];
    *g = (struct mesh_group){.symbol = element_attribute(primitive, "material"),
                             .node = primitive,
                             .first = m->num_triangles};
    bool ok = element_is(primitive, "polygons")
                  ? read_polygons(ld, m, primitive, all, &in, work, count)
                  : read_list(ld, m, primitive, all, &in, work, count);
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
        if (element_is_one_of(c, "polylist triangles polygons"))
            ok = read_primitive(ld, m, c, &all, &work);
        else if (element_is_one_of(c, "lines linestrips trifans tristrips"))
            ok = fail_at(ld, c, "<%s> is not supported", (const char *)c->name);
        else if (!element_is_one_of(c, "source vertices extra"))
            ok = element_fail_unexpected(ld, c);
    }
    source_release(&all);
    free(work.corners);
    free(work.points);
    free(work.index);
    return ok;
}

static bool read_sphere(struct loader *ld, struct mesh *m, const xmlNode *technique)
{
    xmlNode *sphere;
    if (!element_technique_content(ld, technique, &sphere))
        return false;
    if (!element_is(sphere, "sphere"))
        return fail_at(ld, sphere, "unknown geometry tag '%.60s'", (const char *)sphere->name);
    bool is_assay = strcmp(element_attribute(technique, "profile"), "ASSAY") == 0;
    if (!element_only_children(ld, sphere, is_assay ? "radius facing" : "radius"))
        return false;
    xmlNode *radius, *facing;
    if (!element_one_child(ld, sphere, "radius", &radius) ||
        !element_one_child(ld, sphere, "facing", &facing))
        return false;
    if (radius == NULL)
        return fail_at(ld, sphere, "<sphere> without <radius>");
    if (!text_read_exactly(ld, radius, &m->radius, 1))
        return false;
    if (!(m->radius > 0))
        return fail_at(ld, radius, "a sphere's radius must be positive, not %g", m->radius);
    m->is_sphere = true;
    m->normal_out = 1;
    if (facing == NULL)
        return true;
    char *word = text_read_word(ld, facing);
    if (word == NULL)
        return false;
    bool in = strcmp(word, "in") == 0, ok = in || strcmp(word, "out") == 0;
    if (!ok)
        fail_at(ld, facing, "<facing> is '%.60s': only 'in' and 'out' are known", word);
    m->normal_out = in ? -1 : 1;
    free(word);
    return ok;
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
