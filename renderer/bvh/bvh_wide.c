#include "bvh_wide.h"
#include "renderer/base/huge_alloc.h"
#include "renderer/base/parallel.h"
#include "small_scene.h"
#include "traverse.h"
#include "wide_build.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* Rays advance in turns, one step each (single_in_turns()), if the tree has more than IN_TURNS_FROM
 * bytes, as its nodes are then rarely in the cache, and if a random ray costs fewer than
 * IN_TURNS_TESTS tests. More tests mean boxes that overlap heavily: then all rays visit the same
 * nodes, which are in the cache. */
enum { IN_TURNS_FROM = 16 << 20, IN_TURNS_TESTS = 64 };

/* A leaf that has its place and is not filled yet. */
struct empty_leaf {
    uint32_t place, first, count;
};

struct build {
    struct wide *w;
    int threads;
    struct wide_build parts;
    const struct sah_split_passes *splitter;
    const struct scene *scene;
    struct wide_item *item;
    size_t capacity; /* bytes of the arena */
    struct empty_leaf *leaf;
    size_t leaf_room;
    double root_area;
};

/* Makes room for `size` more bytes in the arena, which may move. False if out of memory or references. */
static bool reserve(struct build *b, size_t size)
{
    struct wide *w = b->w;
    if (w->used + size <= b->capacity)
        return true;
    if (w->used + size > WIDE_PLACE)
        return false; /* largest offset of a reference, at about 8e7 triangles */
    size_t capacity = b->capacity + b->capacity / 2 + size;
    char *larger = huge_alloc(capacity);
    if (larger == NULL)
        return false;
    memcpy(larger, w->arena, w->used);
    free(w->arena);
    w->arena = larger;
    b->capacity = capacity;
    return true;
}

static void set_item(const struct scene *s, uint32_t prim, struct wide_item *it)
{
    vec3 low, high;
    scene_primitive_bounds(s, prim, &low, &high);
    *it = (struct wide_item){
        .min = {low.x, low.y, low.z}, .prim = prim, .minus_max = {-high.x, -high.y, -high.z}};
}

static void set_items(void *ctx, size_t first, size_t last)
{
    const struct build *b = ctx;
    for (size_t i = first; i < last; i++)
        set_item(b->scene, (uint32_t)i, &b->item[i]);
}

static bool is_sphere(const struct build *b, uint32_t item)
{
    return b->item[item].prim >= b->scene->num_triangles;
}

/* Row `row` of the node or leaf at a place of the arena (bvh_wide.h). */
static void *row_of(const struct build *b, size_t place, uint32_t row)
{
    return b->w->arena + place + sizeof(float) * row * b->parts.width;
}

static void set_corner(float *to, uint32_t width, vec3 p)
{
    to[0] = p.x;
    to[width] = p.y;
    to[2 * width] = p.z;
}

static void fill_leaf(const struct build *b, const struct empty_leaf *leaf)
{
    const struct scene *s = b->scene;
    const struct wide_item *item = b->item + leaf->first;
    const uint32_t width = b->parts.width, count = leaf->count;
    float *corner = row_of(b, leaf->place, 0);
    uint32_t *number = row_of(b, leaf->place, 9);
    for (uint32_t i = 0; i < 9 * width; i++)
        corner[i] = NAN;
    for (uint32_t i = 0; i < width; i++)
        number[i] = NO_HIT;
    for (uint32_t k = 0; k < count; k++) {
        const uint32_t prim = item[k].prim;
        uint32_t i = 0;
        for (uint32_t j = 0; j < count; j++)
            i += item[j].prim < prim;
        number[i] = prim;
        float *to = corner + i;
        if (prim >= s->num_triangles) {
            const struct sphere *sp = &s->spheres[prim - s->num_triangles];
            set_corner(to, width, sp->centre);
            to[3 * width] = sp->radius;
            continue;
        }
        for (size_t c = 0; c < 3; c++)
            set_corner(to + 3 * c * width, width, s->position[3 * (size_t)prim + c]);
    }
}

static void fill_leaves(void *ctx, size_t first, size_t last)
{
    const struct build *b = ctx;
    for (size_t i = first; i < last; i++)
        fill_leaf(b, &b->leaf[i]);
}

/* Appends a leaf, to be filled later. Returns its reference, or WIDE_PLACE if out of memory. */
static uint32_t add_leaf(struct build *b, const struct wide_range *r)
{
    struct wide *w = b->w;
    if (w->num_leaves == b->leaf_room) {
        size_t room = b->leaf_room + b->leaf_room / 2 + 64;
        struct empty_leaf *larger = realloc(b->leaf, room * sizeof *larger);
        if (larger == NULL)
            return WIDE_PLACE;
        b->leaf = larger;
        b->leaf_room = room;
    }
    if (!reserve(b, WIDE_LEAF_SIZE(b->parts.width)))
        return WIDE_PLACE;
    uint32_t ref = (uint32_t)w->used | WIDE_LEAF;
    if (is_sphere(b, r->first))
        ref |= WIDE_SPHERES;
    b->leaf[w->num_leaves++] = (struct empty_leaf){(uint32_t)w->used, r->first, r->count};
    w->used += WIDE_LEAF_SIZE(b->parts.width);
    return ref;
}

/* Probability that a random ray through the scene meets the box. */
static double chance(const struct build *b, const struct wide_box *box)
{
    return b->root_area > 0 ? (double)wide_half_area(box) / b->root_area : 1;
}

/* Appends part i as a node, with its subtree. False if out of memory. */
static bool add_node(struct build *b, uint32_t i, int depth)
{
    const struct wide_part *part = b->parts.part;
    uint32_t child[WIDE_MOST], ref[WIDE_MOST] = {0};
    int n = wide_build_children(&b->parts, i, child);
    struct wide *w = b->w;
    if (!reserve(b, WIDE_NODE_SIZE(b->parts.width)))
        return false;
    size_t place = w->used;
    w->used += WIDE_NODE_SIZE(b->parts.width);
    w->num_nodes++;
    if (depth > w->depth)
        w->depth = depth;
    w->cost += chance(b, &part[i].box);
    for (uint32_t a = 0; a < 3; a++) {
        float *low = row_of(b, place, 2 * a), *high = row_of(b, place, 2 * a + 1);
        for (int k = 0; k < (int)b->parts.width; k++) {
            low[k] = k < n ? part[child[k]].box.v[a] : INFINITY;
            high[k] = k < n ? -part[child[k]].box.v[4 + a] : -INFINITY;
        }
    }
    /* Leaves are stored right after their node. */
    for (int k = 0; k < n; k++) {
        const struct wide_part *c = &part[child[k]];
        if (c->left != 0)
            continue;
        const struct wide_range r = {.first = c->first, .count = c->count};
        if ((ref[k] = add_leaf(b, &r)) == WIDE_PLACE)
            return false;
        w->cost += chance(b, &c->box);
    }
    for (int k = 0; k < n; k++)
        if (part[child[k]].left != 0) {
            ref[k] = (uint32_t)w->used;
            if (!add_node(b, child[k], depth + 1))
                return false;
        }
    memcpy(row_of(b, place, 6), ref, sizeof *ref * b->parts.width);
    return true;
}

static bool add_tree(struct build *b, const struct wide_range *all)
{
    return wide_build_make(b->splitter, b->item, b->scene->num_triangles, all, b->threads,
                           &b->parts) &&
           add_node(b, 0, 0);
}

/* Makes the list, of `num` primitives. False if out of memory. */
static bool add_list(struct build *b, const uint32_t *prim, uint32_t num)
{
    struct wide *w = b->w;
    if ((w->flat = malloc(sizeof *w->flat)) == NULL)
        return false;
    small_scene_fill(b->scene, prim, (int)num, w->flat);
    w->num_list_leaves = (num + b->parts.width - 1) / b->parts.width;
    w->cost = w->num_list_leaves;
    return true;
}

static bool add_all_as_list(struct build *b, uint32_t num)
{
    uint32_t prim[WIDE_FLAT];
    for (uint32_t i = 0; i < num; i++)
        prim[i] = i;
    return add_list(b, prim, num);
}

/* Large primitives, such as the walls of a room, would lie in every ray's way through the tree. take_large()
 * moves them to the list: those whose boxes a random ray through the scene meets with a probability above
 * LARGE_PART, if there are at most MOST_LARGE. The others stay in `all`, in their order. False if out of memory. */
enum { MOST_LARGE = 16 };
#define LARGE_PART (1.0 / 32)

static bool is_large(const struct build *b, const struct wide_item *it)
{
    float x = -it->minus_max[0] - it->min[0], y = -it->minus_max[1] - it->min[1];
    float z = -it->minus_max[2] - it->min[2];
    return x * y + y * z + z * x > LARGE_PART * b->root_area;
}

static bool take_large(struct build *b, struct wide_range *all)
{
    struct wide *w = b->w;
    uint32_t prim[MOST_LARGE], num = 0;
    for (uint32_t i = 0; i < all->count; i++) {
        if (!is_large(b, &b->item[i]))
            continue;
        if (num == MOST_LARGE)
            return true;
        prim[num++] = i;
    }
    if (num == 0)
        return true;
    if (!add_list(b, prim, num))
        return false;
    if (!w->flat->quick) {
        free(w->flat);
        w->flat = NULL;
        w->cost = 0;
        return true;
    }
    uint32_t to = all->count;
    for (uint32_t i = all->count; i-- > 0;)
        if (!is_large(b, &b->item[i]))
            b->item[--to] = b->item[i];
    all->first = num;
    all->count -= num;
    b->splitter->bounds(b->item + num, all->count, &all->box, &all->centres);
    return true;
}

struct wide *wide_build(const struct scene *s, enum isa isa, int threads, struct err *e)
{
    static const struct {
        const struct traverse *kernel;
        const struct small_scene_trace *list;
        const struct sah_split_passes *splitter;
    } code[] = {
        [ISA_SSE42] = {&traverse_sse42, &small_scene_trace_sse42, &sah_split_sse42},
        [ISA_AVX2] = {&traverse_avx2, &small_scene_trace_avx2, &sah_split_avx2},
        [ISA_AVX512] = {&traverse_avx512, &small_scene_trace_avx512, &sah_split_avx512},
    };
    if (!isa_choose(&isa, e))
        return NULL;
    struct build b = {.scene = s, .splitter = code[isa].splitter, .threads = threads};
    struct wide_range all = {.count = scene_num_primitives(s)};
    struct wide *w = b.w = calloc(1, sizeof *w);
    if (w == NULL)
        goto fail;
    w->kernel = code[isa].kernel;
    assert(w->kernel != NULL);
    b.parts.width = w->kernel->width;
    w->list = code[isa].list;
    w->num_triangles = s->num_triangles;
    b.capacity = 64 * (size_t)all.count + 4096;
    w->arena = huge_alloc(b.capacity);
    b.item = huge_alloc(all.count * sizeof *b.item);
    if (w->arena == NULL || b.item == NULL)
        goto fail;
    parallel_for(threads, all.count, set_items, &b);
    b.splitter->bounds(b.item, all.count, &all.box, &all.centres);
    b.root_area = (double)wide_half_area(&all.box);
    for (int a = 0; a < 3; a++) {
        w->min[a] = all.box.v[a];
        w->max[a] = -all.box.v[4 + a];
    }
    if (!(all.count <= WIDE_FLAT ? add_all_as_list(&b, all.count)
                                 : take_large(&b, &all) && add_tree(&b, &all)))
        goto fail;
    for (int a = 0; a < 3; a++) {
        w->tree_min[a] = all.box.v[a];
        w->tree_max[a] = -all.box.v[4 + a];
    }
    parallel_for(threads, w->num_leaves, fill_leaves, &b);
    float extent = maxf(maxf(w->max[0] - w->min[0], w->max[1] - w->min[1]), w->max[2] - w->min[2]);
    w->in_turns = w->used > IN_TURNS_FROM && w->cost < IN_TURNS_TESTS;
    w->alike = 2.5f * extent / sqrtf((float)w->num_leaves);
    free(b.item);
    free(b.leaf);
    wide_build_free(&b.parts);
    return w;
fail:
    free(b.item);
    free(b.leaf);
    wide_build_free(&b.parts);
    wide_free(w);
    err_set(e, "out of memory for the acceleration structure of %u primitives", all.count);
    return NULL;
}

void wide_free(struct wide *w)
{
    if (w == NULL)
        return;
    free(w->arena);
    free(w->flat);
    free(w);
}
