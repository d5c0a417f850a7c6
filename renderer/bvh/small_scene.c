#include "small_scene.h"

#include "renderer/math/mat4.h"

#include <string.h>

static uint8_t find_corner(struct small_scene *f, vec3 p)
{
    const float q[3] = {p.x, p.y, p.z};
    for (int i = 0; i < f->num_corners; i++)
        /* NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): edges are shared bit for bit or not at all. */
        if (memcmp(f->corner[i], q, sizeof q) == 0)
            return (uint8_t)i;
    memcpy(f->corner[f->num_corners], q, sizeof q);
    return (uint8_t)f->num_corners++;
}

static uint8_t find_edge(struct small_scene *f, uint8_t from, uint8_t to)
{
    for (int i = 0; i < f->num_edges; i++) {
        if (f->edge[i][0] == from && f->edge[i][1] == to)
            return (uint8_t)(2 * i);
        if (f->edge[i][0] == to && f->edge[i][1] == from)
            return (uint8_t)(2 * i + 1);
    }
    f->edge[f->num_edges][0] = from;
    f->edge[f->num_edges][1] = to;
    return (uint8_t)(2 * f->num_edges++);
}

static dvec3 corner_of(const struct small_scene *f, int triangle, int k)
{
    const float *p = f->corner[f->triangle[triangle].corner[k]];
    return d3((double)p[0], (double)p[1], (double)p[2]);
}

static void set_row(float row[4], dvec3 a, double scale, dvec3 origin)
{
    row[0] = (float)(a.x * scale);
    row[1] = (float)(a.y * scale);
    row[2] = (float)(a.z * scale);
    row[3] = (float)(-d3_dot(a, origin) * scale);
}

/* Fills a face with corner k of triangle i as its origin; false if rounding could exceed a few hundredths
 * of its size. */
static bool set_face(const struct small_scene *f, int i, int k, struct flat_face *face)
{
    dvec3 o = corner_of(f, i, k);
    dvec3 eu = d3_sub(corner_of(f, i, (k + 1) % 3), o);
    dvec3 ev = d3_sub(corner_of(f, i, (k + 2) % 3), o);
    dvec3 n = d3_cross(eu, ev);
    double area2 = d3_dot(n, n), area = sqrt(area2);
    if (!(FLAT_ERROR * (double)f->reach * (double)f->reach < 0.05 * area))
        return false;
    set_row(face->u_row, d3_cross(ev, n), 1 / area2, o);
    set_row(face->v_row, d3_cross(n, eu), 1 / area2, o);
    float plane[4];
    set_row(plane, n, 1 / area, o);
    memcpy(face->normal, plane, sizeof face->normal);
    face->offset = -plane[3];
    face->per_area = (float)(1 / area);
    const dvec3 ew = d3_sub(eu, ev);
    double longest = sqrt(fmax(d3_dot(eu, eu), fmax(d3_dot(ev, ev), d3_dot(ew, ew))));
    face->slack = (float)fmax(1, (double)f->reach * longest / (FLAT_THIN * area));
    face->prim[0] = face->prim[1] = i;
    face->is_triangle = true;
    return true;
}

/* True if triangle j completes triangle i to a parallelogram, with the new corner opposite to corner k. */
static bool completes(const struct small_scene *f, int i, int k, int j)
{
    const uint8_t *a = f->triangle[i].corner, *b = f->triangle[j].corner;
    int other = -1, shared = 0;
    for (int c = 0; c < 3; c++) {
        if (b[c] == a[(k + 1) % 3] || b[c] == a[(k + 2) % 3])
            shared++;
        else
            other = c;
    }
    if (shared != 2 || other < 0)
        return false;
    dvec3 o = corner_of(f, i, k), s = corner_of(f, i, (k + 1) % 3);
    dvec3 t = corner_of(f, i, (k + 2) % 3), q = corner_of(f, j, other);
    const dvec3 off = d3_sub(q, d3_sub(d3_add(s, t), o));
    const double most = FLAT_TOLERANCE * (double)f->reach;
    return fabs(off.x) <= most && fabs(off.y) <= most && fabs(off.z) <= most;
}

static void fill_faces(struct small_scene *f)
{
    bool done[WIDE_FLAT] = {false};
    f->quick = f->reach > 1e-4f && f->reach < 1e4f;
    for (int i = 0; i < f->num_triangles && f->quick; i++) {
        if (done[i])
            continue;
        struct flat_face *face = &f->face[f->num_faces++];
        int corner = 0, partner = -1;
        for (int k = 0; k < 3 && partner < 0; k++)
            for (int j = i + 1; j < f->num_triangles && partner < 0; j++)
                if (!done[j] && completes(f, i, k, j)) {
                    corner = k;
                    partner = j;
                }
        f->quick = set_face(f, i, corner, face);
        if (partner >= 0) {
            done[partner] = true;
            face->prim[1] = partner;
            face->is_triangle = false;
        }
    }
}

/* The side of the box that a face fills, -1: none. A parallelogram whose four corners are corners of the box, all in one
 * side, fills that side. */
static int side_of(const struct small_scene *f, const struct flat_face *face)
{
    const float most = ROOM_TOLERANCE * f->reach;
    unsigned sides = face->is_triangle ? 0 : (1u << 6) - 1;
    for (int k = 0; k < 6; k++) {
        const float *p = f->corner[f->triangle[face->prim[k / 3]].corner[k % 3]];
        for (int a = 0; a < 3; a++) {
            const bool at_high = fabsf(p[a] - f->high[a]) <= most;
            const bool at_low = fabsf(p[a] - f->low[a]) <= most;
            if (!at_high && !at_low)
                return -1;
            sides &= ~((at_high ? 0 : 1u << 2 * a) | (at_low ? 0 : 2u << 2 * a));
        }
    }
    return sides == 0 ? -1 : __builtin_ctz(sides);
}

/* Finds the room, and moves its walls to the end of face[]. */
static void find_room(struct small_scene *f)
{
    struct flat_face wall[WIDE_FLAT] = {0};
    int num_open = 0;
    for (int a = 0; a < 3; a++) {
        f->low[a] = INFINITY;
        f->high[a] = -INFINITY;
        for (int i = 0; i < f->num_corners; i++) {
            f->low[a] = minf(f->low[a], f->corner[i][a]);
            f->high[a] = maxf(f->high[a], f->corner[i][a]);
        }
        if (!(f->high[a] - f->low[a] >= f->reach / 4))
            return;
    }
    for (int k = 0; k < 6; k++)
        memset(&f->side[k][SIDE_PRIM], 0xff, sizeof(int32_t));
    for (int i = 0; i < f->num_faces; i++) {
        const struct flat_face face = f->face[i];
        const int k = side_of(f, &face);
        int32_t taken = -1;
        if (k >= 0)
            memcpy(&taken, &f->side[k][SIDE_PRIM], sizeof taken);
        if (k < 0 || taken >= 0) {
            f->face[num_open++] = face;
            continue;
        }
        wall[f->num_walls++] = face;
        for (int a = 0; a < 4; a++)
            f->side[k][SIDE_DIAGONAL + a] = face.u_row[a] + face.v_row[a] - (a == 3);
        f->side[k][SIDE_PER_AREA] = face.per_area;
        memcpy(&f->side[k][SIDE_PRIM], face.prim, sizeof face.prim);
    }
    memcpy(f->face + num_open, wall, (size_t)f->num_walls * sizeof *wall);
    if (f->num_walls < 4)
        f->num_walls = 0;
}

void small_scene_fill(const struct scene *s, const uint32_t *prim, int num, struct small_scene *f)
{
    *f = (struct small_scene){0};
    for (int i = 0; i < num; i++)
        f->number[i] = (int32_t)prim[i];
    for (; f->num_triangles < num && prim[f->num_triangles] < s->num_triangles;
         f->num_triangles++) {
        const int i = f->num_triangles;
        uint8_t *c = f->triangle[i].corner, *e = f->triangle[i].edge;
        for (int k = 0; k < 3; k++)
            c[k] = find_corner(f, s->position[3 * (size_t)prim[i] + (size_t)k]);
        e[0] = find_edge(f, c[1], c[2]);
        e[1] = find_edge(f, c[2], c[0]);
        e[2] = find_edge(f, c[0], c[1]);
        for (int k = 0; k < 9; k++) {
            f->row[i][k] = f->corner[c[k / 3]][k % 3];
            f->reach = maxf(f->reach, fabsf(f->row[i][k]));
        }
    }
    for (int i = f->num_triangles; i < num; i++) {
        const struct sphere *sp = &s->spheres[prim[i] - s->num_triangles];
        const float q[4] = {sp->centre.x, sp->centre.y, sp->centre.z, sp->radius};
        memcpy(f->sphere[f->num_spheres++], q, sizeof q);
    }
    fill_faces(f);
    if (f->quick)
        find_room(f);
}
