#include "cs184_deviations.h"

#include <stdlib.h>

const char *const cs184_deviation_names[NUM_CS184_DEVIATIONS + 1] = {"light-pdf", "turned-lamp",
                                                                     "beckmann", "normals", NULL};

vec3 cs184_deviations_turn(const struct scene *s, const struct light *l, vec3 p)
{
    const vec3 *q = s->position + 3 * (size_t)l->first;
    if (l->count != 2)
        return p;
    vec3 n = normalize(cross(sub(q[1], q[0]), sub(q[2], q[0]))), sum = v3(0, 0, 0);
    for (int i = 0; i < 6; i++)
        sum = add(sum, q[i]);
    vec3 centre = scale(sum, 1.0f / 6); /* of both triangles, which have the same area */
    return add(centre, cross(n, sub(p, centre)));
}

static void turn_lamp(struct scene *s, const struct light *l)
{
    vec3 *q = s->position + 3 * (size_t)l->first, turned[6];
    if (l->count != 2)
        return;
    for (int i = 0; i < 6; i++)
        turned[i] = cs184_deviations_turn(s, l, q[i]);
    for (int i = 0; i < 6; i++) {
        q[i] = turned[i];
        s->bounds_min = vmin(s->bounds_min, q[i]);
        s->bounds_max = vmax(s->bounds_max, q[i]);
    }
}

/* A corner of a triangle, in the order of its object and place: corners of one vertex are neighbours. */
struct corner {
    uint32_t object, at; /* at: index into scene.position */
    vec3 p;
};

static int compare_places(vec3 a, vec3 b)
{
    if (a.x != b.x)
        return a.x < b.x ? -1 : 1;
    return a.y != b.y ? (a.y < b.y ? -1 : 1) : (a.z > b.z) - (a.z < b.z);
}

static int compare_corners(const void *a, const void *b)
{
    const struct corner *c = a, *d = b;
    if (c->object != d->object)
        return c->object < d->object ? -1 : 1;
    int by_place = compare_places(c->p, d->p);
    return by_place != 0 ? by_place : (c->at > d->at) - (c->at < d->at);
}

/* The place of the next corner of its triangle, or of the one after. */
static vec3 neighbour(const struct scene *s, const struct corner *c, uint32_t step)
{
    return s->position[c->at / 3 * 3 + (c->at + step) % 3];
}

/* Is there an edge at this vertex (num corners) that a single triangle has? */
static bool is_boundary(const struct scene *s, const struct corner *c, size_t num)
{
    for (size_t i = 0; i < num; i++) {
        bool shared = false;
        for (size_t k = 0; k < num && !shared; k++)
            shared = compare_places(neighbour(s, &c[i], 1), neighbour(s, &c[k], 2)) == 0;
        if (!shared)
            return true;
    }
    return false;
}

static bool use_mesh_normals(struct scene *s, struct err *e)
{
    const size_t num = 3 * (size_t)s->num_triangles;
    struct corner *c = malloc((num > 0 ? num : 1) * sizeof *c);
    if (c == NULL)
        return err_set(e, "out of memory");
    for (uint32_t i = 0; i < num; i++)
        c[i] = (struct corner){s->tri_object[i / 3], i, s->position[i]};
    qsort(c, num, sizeof *c, compare_corners);
    for (size_t first = 0, end; first < num; first = end) {
        vec3 n = v3(0, 0, 0);
        for (end = first; end < num && c[end].object == c[first].object &&
                          compare_places(c[end].p, c[first].p) == 0;
             end++)
            n = add(n, cross(sub(neighbour(s, &c[end], 1), c[end].p),
                             sub(neighbour(s, &c[end], 2), c[end].p)));
        n = is_boundary(s, c + first, end - first) ? scale(n, -1) : n;
        for (size_t i = first; i < end && dot(n, n) > 0; i++)
            s->normal[c[i].at] = normalize(n);
    }
    free(c);
    return true;
}

bool cs184_deviations_apply(struct scene *s, unsigned bits, struct err *e)
{
    s->starter = bits;
    for (uint32_t l = 0; l < s->num_lights && starter_has(s, CS184_TURNED_LAMP); l++)
        if (s->lights[l].kind == LIGHT_TRIANGLES)
            turn_lamp(s, &s->lights[l]);
    for (uint32_t m = 0; m < s->num_materials && starter_has(s, CS184_BECKMANN); m++)
        if (s->materials[m].microfacet == MICROFACET_BECKMANN)
            s->materials[m].microfacet = MICROFACET_BECKMANN_STARTER;
    return !starter_has(s, CS184_NORMALS) || use_mesh_normals(s, e);
}
