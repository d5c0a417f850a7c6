#include "wide_parts.h"
#include "alloc_large.h"

#include <assert.h>
#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_FREE_DEPTH = 64 };

struct build {
    const struct wide_splitter *splitter;
    struct wide_item *item;
    uint32_t num_triangles;
    struct wide_parts *parts;
};

static bool is_sphere(const struct build *b, uint32_t item)
{
    return b->item[item].prim >= b->num_triangles;
}

/* A leaf is of triangles or of spheres. */
static bool fits_leaf(const struct build *b, const struct wide_range *r)
{
    if (r->count > WIDTH)
        return false;
    for (uint32_t i = 1; i < r->count; i++)
        if (is_sphere(b, r->first + i) != is_sphere(b, r->first))
            return false;
    return true;
}

static uint32_t spheres_last(struct build *b, struct wide_range *r)
{
    uint32_t left = 0;
    for (uint32_t i = 0; i < r->count; i++)
        if (!is_sphere(b, r->first + i)) {
            struct wide_item swap = b->item[r->first + i];
            b->item[r->first + i] = b->item[r->first + left];
            b->item[r->first + left++] = swap;
        }
    return left;
}

/* Cuts r in two: what is left of it, and *right. */
static void cut(struct build *b, struct wide_range *r, struct wide_range *right)
{
    const struct wide_splitter *k = b->splitter;
    struct wide_item *item = b->item + r->first;
    struct wide_split s = {.cost = FLT_MAX};
    struct wide_range l = {.first = r->first, .depth = r->depth + 1};
    *right = (struct wide_range){.depth = r->depth + 1};
    if (r->count > WIDTH && r->depth < MAX_FREE_DEPTH)
        k->split(item, r->count, &r->centres, &s);
    if (s.cost < FLT_MAX) {
        l.count = k->partition(item, r->count, &s, &l.centres, &right->centres);
        l.box = s.left;
        right->box = s.right;
    } else {
        /* Eight or fewer of both kinds; or coincident centres, or a tree grown too deep. */
        l.count = r->count <= WIDTH ? spheres_last(b, r) : r->count / 2;
        k->bounds(item, l.count, &l.box, &l.centres);
        k->bounds(item + l.count, r->count - l.count, &right->box, &right->centres);
    }
    right->first = l.first + l.count;
    right->count = r->count - l.count;
    *r = l;
}

/* Room for two more. */
static bool reserve(struct wide_parts *p)
{
    if (p->num + 2 <= p->room)
        return true;
    size_t room = p->room + p->room / 2 + 64;
    struct wide_part *larger = alloc_large(room * sizeof *larger);
    if (larger == NULL)
        return false;
    if (p->part != NULL)
        memcpy(larger, p->part, p->num * sizeof *larger);
    free(p->part);
    p->part = larger;
    p->room = room;
    return true;
}

/* The best ways to hang part i on 1 to 8 children, by those of its halves [Ylitie17]. */
static void best_slots(struct build *b, uint32_t i)
{
    struct wide_part *p = &b->parts->part[i];
    const struct wide_part *l = &b->parts->part[p->left], *r = l + 1;
    float split[WIDTH + 1];
    uint8_t left[WIDTH + 1];
    for (int n = 2; n <= WIDTH; n++) {
        split[n] = INFINITY;
        for (int k = 1; k < n; k++) {
            float c = l->cost[k - 1] + r->cost[n - k - 1];
            if (c < split[n]) {
                split[n] = c;
                left[n] = (uint8_t)k;
            }
        }
    }
    p->cost[0] = wide_half_area(&p->box) + split[WIDTH];
    p->left_slots[0] = left[WIDTH];
    for (int n = 2; n <= WIDTH; n++) {
        bool better = split[n] < p->cost[n - 2];
        bool inherit = !better && n > 2;
        p->cost[n - 1] = better ? split[n] : p->cost[n - 2];
        p->left_slots[n - 1] = better ? left[n] : inherit ? p->left_slots[n - 2] : 0;
    }
}

/* Cuts range r in two until each part is a leaf; part i is the whole. False if out of memory. */
static bool add_part(struct build *b, uint32_t i, struct wide_range *r)
{
    b->parts->part[i] = (struct wide_part){.box = r->box, .first = r->first, .count = r->count};
    if (fits_leaf(b, r)) {
        for (int k = 0; k < WIDTH; k++)
            b->parts->part[i].cost[k] = wide_half_area(&r->box);
        return true;
    }
    if (!reserve(b->parts))
        return false;
    uint32_t left = (uint32_t)b->parts->num;
    b->parts->num += 2;
    struct wide_range right;
    cut(b, r, &right);
    if (!add_part(b, left, r) || !add_part(b, left + 1, &right))
        return false;
    b->parts->part[i].left = left;
    best_slots(b, i);
    return true;
}

/* The parts that become children: those of part i, which has `slots` of them. */
static int gather_children(const struct wide_parts *p, uint32_t i, int slots, uint32_t *child,
                           int n)
{
    const struct wide_part *c = &p->part[i];
    int left = c->left == 0 || slots == 1 ? 0 : c->left_slots[slots - 1];
    if (left == 0) {
        child[n] = i;
        return n + 1;
    }
    n = gather_children(p, c->left, left, child, n);
    return gather_children(p, c->left + 1, slots - left, child, n);
}

bool wide_parts_build(const struct wide_splitter *s, struct wide_item *item, uint32_t num_triangles,
                      const struct wide_range *all, struct wide_parts *p)
{
    struct build b = {.splitter = s, .item = item, .num_triangles = num_triangles, .parts = p};
    struct wide_range r = *all;
    if (!reserve(p))
        return false;
    p->num = 1;
    return add_part(&b, 0, &r);
}

int wide_parts_children(const struct wide_parts *p, uint32_t i, uint32_t child[WIDTH])
{
    uint32_t left = p->part[i].left;
    int slots = p->part[i].left_slots[0];
    assert(left != 0);
    int n = gather_children(p, left, slots, child, 0);
    return gather_children(p, left + 1, WIDTH - slots, child, n);
}

void wide_parts_free(struct wide_parts *p)
{
    free(p->part);
}
