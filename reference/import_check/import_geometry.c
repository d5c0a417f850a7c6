#include "import_geometry.h"

#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum { LARGEST_POLYGON = 16384 };
static const uint32_t none = UINT32_MAX;

void import_geometry_differ(struct import_pair *pair, const char *fmt, ...)
{
    if (!pair->out->agrees)
        return;
    va_list args;
    va_start(args, fmt);
    vsnprintf(pair->out->what, sizeof pair->out->what, fmt, args);
    va_end(args);
    pair->out->agrees = false;
}

/* The state of one comparison. Corners of our triangles that are closer than the tolerance are welded into
 * one vertex. */
struct check {
    struct import_pair *pair;
    double tolerance;
    uint32_t *corner_vertex; /* per corner of ours */
    dvec3 *vertex;
    uint32_t num_vertices;
    uint32_t *bucket, *next; /* hash grid over vertices */
    uint32_t num_buckets;
    uint32_t *first_use, *next_use; /* per vertex: chain over the corners at it */
    bool *found;                    /* per triangle of ours; the caller's */
};

/* Blender converts each file to Z up, we to Y up (renderer/docs/dialect.md). A point of the file in both:
 * file (x,y,z)    Blender     ours
 *   Y_UP         (x,-z,y)   (x,y,z)
 *   Z_UP         (x,y,z)    (-x,z,y)
 *   X_UP         (-z,y,x)   (y,x,-z) */
dvec3 import_geometry_point(const struct import_pair *pair, dvec3 b)
{
    switch (pair->axis) {
    case 'Z': return (dvec3){-b.x, b.z, b.y};
    case 'X': return (dvec3){b.y, b.z, b.x};
    default: return (dvec3){b.x, b.z, -b.y};
    }
}

static uint32_t bucket_of(const struct check *c, int64_t i, int64_t j, int64_t k)
{
    uint64_t h = (uint64_t)i * 0x9e3779b97f4a7c15u ^ (uint64_t)j * 0xc2b2ae3d27d4eb4fu ^
                 (uint64_t)k * 0x165667b19e3779f9u;
    return (uint32_t)((h ^ h >> 29) % c->num_buckets);
}

/* The nearest vertex within the tolerance, or none. Cells are two tolerances wide. */
static uint32_t find_vertex(const struct check *c, dvec3 p)
{
    double cell = 2 * c->tolerance, best = c->tolerance;
    int64_t i0 = (int64_t)floor(p.x / cell), j0 = (int64_t)floor(p.y / cell),
            k0 = (int64_t)floor(p.z / cell);
    uint32_t nearest = none;
    for (int64_t n = 0; n < 27; n++) {
        uint32_t b = bucket_of(c, i0 + n % 3 - 1, j0 + n / 3 % 3 - 1, k0 + n / 9 - 1);
        for (uint32_t v = c->bucket[b]; v != none; v = c->next[v]) {
            double d = d3_length(d3_sub(c->vertex[v], p));
            if (d <= best) {
                best = d;
                nearest = v;
            }
        }
    }
    return nearest;
}

static uint32_t add_vertex(struct check *c, dvec3 p)
{
    uint32_t v = find_vertex(c, p);
    if (v != none)
        return v;
    v = c->num_vertices++;
    double cell = 2 * c->tolerance;
    uint32_t b = bucket_of(c, (int64_t)floor(p.x / cell), (int64_t)floor(p.y / cell),
                           (int64_t)floor(p.z / cell));
    c->vertex[v] = p;
    c->next[v] = c->bucket[b];
    c->bucket[b] = v;
    c->first_use[v] = none;
    return v;
}

static bool weld(struct check *c, struct err *e)
{
    size_t corners = 3 * (size_t)c->pair->s->num_triangles + 1;
    c->num_buckets = 2 * (uint32_t)corners;
    /* All as one block: the vertices, then lists of numbers. */
    c->vertex = malloc(corners * (sizeof *c->vertex + 6 * sizeof *c->next));
    if (c->vertex == NULL || c->num_buckets == 0)
        return err_set(e, "import check: out of memory");
    c->corner_vertex = (uint32_t *)(c->vertex + corners);
    c->next = c->corner_vertex + corners;
    c->first_use = c->next + corners;
    c->next_use = c->first_use + corners;
    c->bucket = c->next_use + corners; /* twice as many */
    for (uint32_t b = 0; b < c->num_buckets; b++)
        c->bucket[b] = none;
    for (uint32_t k = 0; k < 3 * c->pair->s->num_triangles; k++) {
        uint32_t v = c->corner_vertex[k] = add_vertex(c, d3_of(c->pair->s->position[k]));
        c->next_use[k] = c->first_use[v];
        c->first_use[v] = k;
    }
    return true;
}

/* One polygon of Blender's. */
struct polygon {
    const char *object;
    size_t n, index;
    dvec3 *corners, *normals; /* normals: NULL where Blender made its own */
    double normal_tolerance;
    uint32_t *vertex;
};

static void check_normal(struct check *c, uint32_t corner, dvec3 theirs, double tolerance)
{
    dvec3 ours = d3_of(c->pair->s->normal[corner]);
    double angle = import_geometry_angle(ours, theirs);
    c->pair->out->normal_error = fmax(c->pair->out->normal_error, angle);
    c->pair->out->normals++;
    if (!(angle <= tolerance))
        import_geometry_differ(c->pair, "normal at (%.4f, %.4f, %.4f): %.4f rad from Blender's",
                               (double)c->pair->s->position[corner].x,
                               (double)c->pair->s->position[corner].y,
                               (double)c->pair->s->position[corner].z, angle);
}

static size_t corner_of(const struct polygon *p, uint32_t vertex)
{
    for (size_t i = 0; i < p->n; i++)
        if (p->vertex[i] == vertex)
            return i;
    return p->n;
}

static dvec3 vector_area(const struct check *c, uint32_t triangle)
{
    dvec3 a = c->vertex[c->corner_vertex[3 * triangle]],
          b = c->vertex[c->corner_vertex[3 * triangle + 1]],
          d = c->vertex[c->corner_vertex[3 * triangle + 2]];
    dvec3 n = d3_cross(d3_sub(b, a), d3_sub(d, a));
    return (dvec3){n.x / 2, n.y / 2, n.z / 2};
}

/* Is t an unmatched triangle of ours whose corners are among the polygon's and that faces the same way? */
static bool belongs(const struct check *c, const struct polygon *p, uint32_t t, dvec3 area)
{
    return !c->found[t] && d3_dot(vector_area(c, t), area) > 0 &&
           corner_of(p, c->corner_vertex[3 * t]) < p->n &&
           corner_of(p, c->corner_vertex[3 * t + 1]) < p->n &&
           corner_of(p, c->corner_vertex[3 * t + 2]) < p->n;
}

/* Matches a polygon with the triangles of ours that make it up (one, if it has three corners). */
static void match_polygon(struct check *c, const struct polygon *p)
{
    dvec3 area = {0}, covered = {0};
    double around = 0;
    for (size_t i = 0; i < p->n; i++) {
        dvec3 a = p->corners[i], b = p->corners[(i + 1) % p->n];
        dvec3 n = d3_cross(d3_sub(a, p->corners[0]), d3_sub(b, p->corners[0]));
        area = d3_add(area, (dvec3){n.x / 2, n.y / 2, n.z / 2});
        around += d3_length(d3_sub(b, a));
        p->vertex[i] = find_vertex(c, a);
        if (p->vertex[i] == none) {
            import_geometry_differ(
                c->pair,
                "%s, polygon %zu: Blender has a corner at (%.5f, %.5f, %.5f), we have none",
                p->object, p->index, a.x, a.y, a.z);
            return;
        }
        c->pair->out->place_error =
            fmax(c->pair->out->place_error,
                 d3_length(d3_sub(c->vertex[p->vertex[i]], a)) / c->pair->extent);
    }
    double tolerance = c->tolerance * around;
    size_t taken = 0;
    for (size_t i = 0; i < p->n; i++) {
        if (taken > 0 && d3_length(d3_sub(area, covered)) <= tolerance)
            break;
        for (uint32_t k = c->first_use[p->vertex[i]]; k != none; k = c->next_use[k]) {
            uint32_t t = k / 3;
            if (!belongs(c, p, t, area))
                continue;
            dvec3 with = d3_add(covered, vector_area(c, t));
            if (d3_length(d3_sub(area, with)) > d3_length(d3_sub(area, covered)))
                continue;
            covered = with;
            c->found[t] = true;
            taken++;
            for (uint32_t m = 3 * t; m < 3 * t + 3; m++)
                if (p->normals != NULL)
                    check_normal(c, m, p->normals[corner_of(p, c->corner_vertex[m])],
                                 p->normal_tolerance);
                else
                    c->pair->out->unread_normals++;
        }
    }
    c->pair->out->triangles += taken;
    c->pair->out->polygons++;
    if (!(d3_length(d3_sub(area, covered)) <= tolerance))
        import_geometry_differ(
            c->pair, "%s, polygon %zu: our triangles do not make it up, by %.3g of its area",
            p->object, p->index, d3_length(d3_sub(area, covered)) / d3_length(area));
}

bool import_geometry_read_point(const json_t *array, size_t at, dvec3 *out)
{
    const json_t *v[3];
    for (size_t i = 0; i < 3; i++) {
        v[i] = json_array_get(array, at + i);
        if (!json_is_number(v[i]))
            return false;
    }
    *out = (dvec3){json_number_value(v[0]), json_number_value(v[1]), json_number_value(v[2])};
    return true;
}

/* The same, converted to our axes. */
static bool read_turned(const struct check *c, const json_t *array, size_t at, dvec3 *out)
{
    if (!import_geometry_read_point(array, at, out))
        return false;
    *out = import_geometry_point(c->pair, *out);
    return true;
}

static bool check_mesh(struct check *c, const json_t *mesh, struct err *e)
{
    const json_t *sizes = json_object_get(mesh, "sizes"),
                 *corners = json_object_get(mesh, "corners");
    const json_t *normals = json_object_get(mesh, "normals");
    bool custom = json_is_true(json_object_get(mesh, "custom"));
    const char *name = json_string_value(json_object_get(mesh, "name"));
    if (name == NULL || !json_is_array(sizes) || !json_is_array(corners))
        return err_set(e, "blender_import.py: a mesh without its members");
    dvec3 *places = malloc(LARGEST_POLYGON * sizeof *places);
    dvec3 *directions = malloc(LARGEST_POLYGON * sizeof *directions);
    uint32_t *vertex = malloc(LARGEST_POLYGON * sizeof *vertex);
    bool ok = (places != NULL && directions != NULL && vertex != NULL) ||
              err_set(e, "import check: out of memory");
    size_t at = 0;
    for (size_t i = 0; ok && i < json_array_size(sizes); i++) {
        json_int_t n = json_integer_value(json_array_get(sizes, i));
        ok = n >= 3 && n <= LARGEST_POLYGON;
        for (size_t k = 0; ok && k < (size_t)n; k++, at += 3)
            ok = read_turned(c, corners, at, &places[k]) &&
                 (!json_is_array(normals) || read_turned(c, normals, at, &directions[k]));
        if (!ok) {
            err_set(e, "blender_import.py: mesh '%s', polygon %zu: not numbers", name, i);
            break;
        }
        match_polygon(c, &(struct polygon){.object = name,
                                           .index = i,
                                           .n = (size_t)n,
                                           .corners = places,
                                           .normals = json_is_array(normals) ? directions : NULL,
                                           .normal_tolerance = custom ? IMPORT_CUSTOM_TOLERANCE
                                                                      : IMPORT_NORMAL_TOLERANCE,
                                           .vertex = vertex});
    }
    free(places);
    free(directions);
    free(vertex);
    return ok;
}

bool import_geometry_compare(struct import_pair *pair, const json_t *meshes, bool *found,
                             struct err *e)
{
    struct check c = {
        .pair = pair, .tolerance = IMPORT_PLACE_TOLERANCE * pair->extent, .found = found};
    bool ok = weld(&c, e);
    for (size_t i = 0; ok && i < json_array_size(meshes); i++)
        ok = check_mesh(&c, json_array_get(meshes, i), e);
    free(c.vertex);
    return ok;
}
