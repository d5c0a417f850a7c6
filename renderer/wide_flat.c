#include "wide_flat.h"

#include <string.h>

static uint8_t find_corner(struct wide_flat *f, vec3 p)
{
    const float q[3] = {p.x, p.y, p.z};
    for (int i = 0; i < f->num_corners; i++)
        if (memcmp(f->corner[i], q, sizeof q) == 0)
            return (uint8_t)i;
    memcpy(f->corner[f->num_corners], q, sizeof q);
    return (uint8_t)f->num_corners++;
}

static uint8_t find_edge(struct wide_flat *f, uint8_t from, uint8_t to)
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

void wide_flat_fill(const struct scene *s, struct wide_flat *f)
{
    *f = (struct wide_flat){.num_triangles = (int)s->num_triangles,
                            .num_spheres = (int)s->num_spheres};
    for (int i = 0; i < f->num_triangles; i++) {
        uint8_t *c = f->triangle[i].corner, *e = f->triangle[i].edge;
        for (int k = 0; k < 3; k++)
            c[k] = find_corner(f, s->position[3 * i + k]);
        e[0] = find_edge(f, c[1], c[2]);
        e[1] = find_edge(f, c[2], c[0]);
        e[2] = find_edge(f, c[0], c[1]);
    }
    for (int i = 0; i < f->num_spheres; i++) {
        const struct sphere *sp = &s->spheres[i];
        const float q[4] = {sp->centre.x, sp->centre.y, sp->centre.z, sp->radius};
        memcpy(f->sphere[i], q, sizeof q);
    }
}
