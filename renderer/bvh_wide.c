#define _DEFAULT_SOURCE /* madvise */
#include "bvh_wide.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

enum { MAX_FREE_DEPTH = 64, HUGE_PAGE = 2 << 20 };

/* Items [first, first + count) that will be one child. */
struct range {
    uint32_t first, count;
    int depth; /* cuts on the way here */
    struct wide_box box, centres;
};

/* The binary tree that the wide one is made of. cost[i]: expected tests of the best wide tree of this
 * part that hangs on at most i + 1 children of the node above; left_slots[i]: how many of these go to
 * the left half, 0: all of it is one child; left_slots[0]: if it is a node, how many of its eight. */
struct part {
    struct wide_box box;
    uint32_t first, count;
    uint32_t left; /* left and left + 1 are the halves; 0: a leaf */
    float cost[WIDTH];
    uint8_t left_slots[WIDTH];
};

struct build {
    struct wide *w;
    struct part *part; /* 0 is the root */
    size_t num_parts, room_for_parts;
    const struct scene *scene;
    struct wide_item *item;
    size_t capacity; /* bytes of the arena */
    double root_area;
};

/* Large arrays lie on large pages, where the system has them: fewer misses of the page table. */
static void *alloc_aligned(size_t size)
{
    size_t page = size >= HUGE_PAGE ? HUGE_PAGE : WIDE_LINE;
    size = (size + page - 1) / page * page;
    void *p = aligned_alloc(page, size);
    if (p != NULL && page == HUGE_PAGE)
        madvise(p, size, MADV_HUGEPAGE); /* only advice: without it all works as well */
    return p;
}

/* Room for `size` bytes more; what there is may move. */
static bool reserve(struct build *b, size_t size)
{
    struct wide *w = b->w;
    if (w->used + size <= b->capacity)
        return true;
    if (w->used + size > WIDE_PLACE)
        return false; /* references end here, at some 8 10^7 triangles */
    size_t capacity = b->capacity + b->capacity / 2 + size;
    char *larger = alloc_aligned(capacity);
    if (larger == NULL)
        return false;
    memcpy(larger, w->arena, w->used);
    free(w->arena);
    w->arena = larger;
    b->capacity = capacity;
    return true;
}

static float half_area(const struct wide_box *b)
{
    float x = -b->v[4] - b->v[0], y = -b->v[5] - b->v[1], z = -b->v[6] - b->v[2];
    return x * y + y * z + z * x;
}

static void set_item(const struct scene *s, uint32_t prim, struct wide_item *it)
{
    vec3 low, high;
    if (prim < s->num_triangles) {
        const vec3 *p = s->position + 3 * (size_t)prim;
        low = vmin(vmin(p[0], p[1]), p[2]);
        high = vmax(vmax(p[0], p[1]), p[2]);
    } else {
        const struct sphere *sp = &s->spheres[prim - s->num_triangles];
        vec3 r = v3(sp->radius, sp->radius, sp->radius);
        low = sub(sp->centre, r);
        high = add(sp->centre, r);
    }
    *it = (struct wide_item){
        .min = {low.x, low.y, low.z}, .prim = prim, .minus_max = {-high.x, -high.y, -high.z}};
}

static bool is_sphere(const struct build *b, uint32_t item)
{
    return b->item[item].prim >= b->scene->num_triangles;
}

/* A leaf is of triangles or of spheres. */
static bool fits_leaf(const struct build *b, const struct range *r)
{
    if (r->count > WIDTH)
        return false;
    for (uint32_t i = 1; i < r->count; i++)
        if (is_sphere(b, r->first + i) != is_sphere(b, r->first))
            return false;
    return true;
}

static int by_number(const void *a, const void *b)
{
    uint32_t x = ((const struct wide_item *)a)->prim, y = ((const struct wide_item *)b)->prim;
    return (x > y) - (x < y);
}

static void fill_leaf(const struct build *b, struct wide_item *item, uint32_t count,
                      struct wide_leaf *l)
{
    const struct scene *s = b->scene;
    qsort(item, count, sizeof *item, by_number);
    for (int c = 0; c < 3; c++)
        for (int a = 0; a < 3; a++)
            for (int i = 0; i < WIDTH; i++)
                l->p[c][a][i] = NAN;
    for (uint32_t i = 0; i < WIDTH; i++)
        l->prim[i] = i < count ? item[i].prim : NO_HIT;
    for (uint32_t i = 0; i < count; i++) {
        if (item[i].prim >= s->num_triangles) {
            const struct sphere *sp = &s->spheres[item[i].prim - s->num_triangles];
            l->p[0][0][i] = sp->centre.x;
            l->p[0][1][i] = sp->centre.y;
            l->p[0][2][i] = sp->centre.z;
            l->p[1][0][i] = sp->radius;
            continue;
        }
        const vec3 *p = s->position + 3 * (size_t)item[i].prim;
        for (int c = 0; c < 3; c++) {
            l->p[c][0][i] = p[c].x;
            l->p[c][1][i] = p[c].y;
            l->p[c][2][i] = p[c].z;
        }
    }
}

/* Appends; the reference, or WIDE_PLACE if out of memory. */
static uint32_t add_leaf(struct build *b, const struct range *r)
{
    if (!reserve(b, sizeof(struct wide_leaf)))
        return WIDE_PLACE;
    struct wide *w = b->w;
    uint32_t ref = (uint32_t)w->used | WIDE_LEAF;
    if (is_sphere(b, r->first))
        ref |= WIDE_SPHERES;
    fill_leaf(b, b->item + r->first, r->count, (struct wide_leaf *)(w->arena + w->used));
    w->used += sizeof(struct wide_leaf);
    w->num_leaves++;
    return ref;
}

static uint32_t spheres_last(struct build *b, struct range *r)
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
static void cut(struct build *b, struct range *r, struct range *right)
{
    const struct wide_kernel *k = b->w->kernel;
    struct wide_item *item = b->item + r->first;
    struct wide_split s = {.cost = FLT_MAX};
    struct range l = {.first = r->first, .depth = r->depth + 1};
    *right = (struct range){.depth = r->depth + 1};
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

static bool reserve_parts(struct build *b)
{
    if (b->num_parts + 2 <= b->room_for_parts)
        return true;
    size_t room = b->room_for_parts + b->room_for_parts / 2 + 64;
    struct part *larger = alloc_aligned(room * sizeof *larger);
    if (larger == NULL)
        return false;
    if (b->part != NULL)
        memcpy(larger, b->part, b->num_parts * sizeof *larger);
    free(b->part);
    b->part = larger;
    b->room_for_parts = room;
    return true;
}

/* The best ways to hang part i on 1 to 8 children, by those of its halves [Ylitie17]. */
static void best_slots(struct build *b, uint32_t i)
{
    struct part *p = &b->part[i];
    const struct part *l = &b->part[p->left], *r = l + 1;
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
    p->cost[0] = half_area(&p->box) + split[WIDTH];
    p->left_slots[0] = left[WIDTH];
    for (int n = 2; n <= WIDTH; n++) {
        bool better = split[n] < p->cost[n - 2];
        bool inherit = !better && n > 2;
        p->cost[n - 1] = better ? split[n] : p->cost[n - 2];
        p->left_slots[n - 1] = better ? left[n] : inherit ? p->left_slots[n - 2] : 0;
    }
}

/* Cuts range r in two until each part is a leaf; part i is the whole. False if out of memory. */
static bool add_part(struct build *b, uint32_t i, struct range *r)
{
    b->part[i] = (struct part){.box = r->box, .first = r->first, .count = r->count};
    if (fits_leaf(b, r)) {
        for (int k = 0; k < WIDTH; k++)
            b->part[i].cost[k] = half_area(&r->box);
        return true;
    }
    if (!reserve_parts(b))
        return false;
    uint32_t left = (uint32_t)b->num_parts;
    b->num_parts += 2;
    struct range right;
    cut(b, r, &right);
    if (!add_part(b, left, r) || !add_part(b, left + 1, &right))
        return false;
    b->part[i].left = left;
    best_slots(b, i);
    return true;
}

/* The parts that become children: those of part i, which has `slots` of them. */
static int gather_children(const struct build *b, uint32_t i, int slots, uint32_t *child, int n)
{
    const struct part *p = &b->part[i];
    int left = p->left == 0 || slots == 1 ? 0 : p->left_slots[slots - 1];
    if (left == 0) {
        child[n] = i;
        return n + 1;
    }
    n = gather_children(b, p->left, left, child, n);
    return gather_children(b, p->left + 1, slots - left, child, n);
}

static double chance(const struct build *b, const struct wide_box *box)
{
    return b->root_area > 0 ? (double)half_area(box) / b->root_area : 1;
}

/* Part i as a node and what is below. False if out of memory. */
static bool add_node(struct build *b, uint32_t i, int depth)
{
    const struct part *p = &b->part[i];
    uint32_t child[WIDTH];
    int n = 1, left = p->left_slots[0];
    child[0] = i; /* a scene that is one leaf has a node all the same */
    if (p->left != 0) {
        n = gather_children(b, p->left, left, child, 0);
        n = gather_children(b, p->left + 1, WIDTH - left, child, n);
    }
    struct wide *w = b->w;
    if (!reserve(b, sizeof(struct wide_node)))
        return false;
    size_t place = w->used;
    w->used += sizeof(struct wide_node);
    w->num_nodes++;
    if (depth > w->depth)
        w->depth = depth;
    w->cost += chance(b, &p->box);
    struct wide_node node = {.child = {0}};
    for (int k = 0; k < WIDTH; k++)
        for (int a = 0; a < 3; a++) {
            node.plane[2 * a][k] = k < n ? b->part[child[k]].box.v[a] : INFINITY;
            node.plane[2 * a + 1][k] = k < n ? -b->part[child[k]].box.v[4 + a] : -INFINITY;
        }
    /* Leaves lie behind their node. */
    for (int k = 0; k < n; k++) {
        const struct part *c = &b->part[child[k]];
        if (c->left != 0)
            continue;
        const struct range r = {.first = c->first, .count = c->count};
        if ((node.child[k] = add_leaf(b, &r)) == WIDE_PLACE)
            return false;
        w->cost += chance(b, &c->box);
    }
    for (int k = 0; k < n; k++)
        if (b->part[child[k]].left != 0) {
            node.child[k] = (uint32_t)w->used;
            if (!add_node(b, child[k], depth + 1))
                return false;
        }
    memcpy(w->arena + place, &node, sizeof node);
    return true;
}

static bool add_tree(struct build *b, struct range *all)
{
    if (!reserve_parts(b))
        return false;
    b->num_parts = 1;
    return add_part(b, 0, all) && add_node(b, 0, 0);
}

static bool add_list(struct build *b, struct range *all)
{
    uint32_t triangles = b->scene->num_triangles;
    for (uint32_t i = 0; i < all->count;) {
        uint32_t end = i < triangles ? triangles : all->count;
        struct range r = {.first = i, .count = end - i < WIDTH ? end - i : WIDTH};
        if (add_leaf(b, &r) == WIDE_PLACE)
            return false;
        b->w->num_sphere_leaves += i >= triangles;
        i += r.count;
    }
    b->w->cost = b->w->num_leaves;
    return true;
}

struct wide *wide_build(const struct scene *s, enum isa isa, struct err *e)
{
    static const struct wide_kernel *const kernels[] = {
        [ISA_SSE42] = &wide_kernel_sse42,
        [ISA_AVX2] = &wide_kernel_avx2,
        [ISA_AVX512] = &wide_kernel_avx512,
    };
    if (!isa_choose(&isa, e))
        return NULL;
    struct build b = {.scene = s};
    struct range all = {.count = scene_num_primitives(s)};
    struct wide *w = b.w = calloc(1, sizeof *w);
    if (w == NULL)
        goto fail;
    w->kernel = kernels[isa];
    w->num_triangles = s->num_triangles;
    b.capacity = 64 * (size_t)all.count + 4096;
    w->arena = alloc_aligned(b.capacity);
    b.item = alloc_aligned(all.count * sizeof *b.item);
    if (w->arena == NULL || b.item == NULL)
        goto fail;
    for (uint32_t i = 0; i < all.count; i++)
        set_item(s, i, &b.item[i]);
    w->kernel->bounds(b.item, all.count, &all.box, &all.centres);
    b.root_area = (double)half_area(&all.box);
    for (int a = 0; a < 3; a++) {
        w->min[a] = all.box.v[a];
        w->max[a] = -all.box.v[4 + a];
    }
    if (!(all.count <= WIDE_FLAT ? add_list(&b, &all) : add_tree(&b, &all)))
        goto fail;
    float extent = maxf(maxf(w->max[0] - w->min[0], w->max[1] - w->min[1]), w->max[2] - w->min[2]);
    w->alike = 2.5f * extent / sqrtf((float)w->num_leaves);
    free(b.item);
    free(b.part);
    return w;
fail:
    free(b.item);
    free(b.part);
    wide_free(w);
    err_set(e, "out of memory for the acceleration structure of %u primitives", all.count);
    return NULL;
}

void wide_free(struct wide *w)
{
    if (w == NULL)
        return;
    free(w->arena);
    free(w);
}
