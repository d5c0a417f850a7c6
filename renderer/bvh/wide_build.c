#include "wide_build.h"
#include "renderer/base/huge_alloc.h"
#include "renderer/base/parallel.h"

#include <assert.h>
#include <float.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_FREE_DEPTH = 64 };

struct build {
    const struct sah_split_passes *splitter;
    struct wide_item *item;
    uint32_t num_triangles;
    struct wide_build *parts;
};

static bool is_sphere(const struct build *b, uint32_t item)
{
    return b->item[item].prim >= b->num_triangles;
}

/* A leaf has up to `width` triangles or as many spheres. */
static bool fits_leaf(const struct build *b, const struct wide_range *r)
{
    if (r->count > b->parts->width)
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

/* Cuts a range in two: *r becomes its left part. */
static void cut(struct build *b, struct wide_range *r, struct wide_range *right)
{
    const struct sah_split_passes *k = b->splitter;
    struct wide_item *item = b->item + r->first;
    struct wide_split s = {.cost = FLT_MAX};
    struct wide_range l = {.first = r->first, .depth = r->depth + 1};
    *right = (struct wide_range){.depth = r->depth + 1};
    const uint32_t width = b->parts->width;
    if (r->count > width && r->depth < MAX_FREE_DEPTH)
        k->split(item, r->count, width, &r->centres, &s);
    if (s.cost < FLT_MAX) {
        l.count = k->partition(item, r->count, &s, &l.centres, &right->centres);
        l.box = s.left;
        right->box = s.right;
    } else {
        /* A leaf's worth of both kinds; or coincident centres, or a tree grown too deep. */
        l.count = r->count <= width ? spheres_last(b, r) : r->count / 2;
        k->bounds(item, l.count, &l.box, &l.centres);
        k->bounds(item + l.count, r->count - l.count, &right->box, &right->centres);
    }
    right->first = l.first + l.count;
    right->count = r->count - l.count;
    *r = l;
}

/* Makes room for `more` parts. False if out of memory. */
static bool reserve(struct wide_build *p, size_t more)
{
    if (p->num + more <= p->room)
        return true;
    size_t room = p->room + p->room / 2 + more + 64;
    struct wide_part *larger = huge_alloc(room * sizeof *larger);
    if (larger == NULL)
        return false;
    if (p->part != NULL)
        memcpy(larger, p->part, p->num * sizeof *larger);
    free(p->part);
    p->part = larger;
    p->room = room;
    return true;
}

/* Usually enough: two parts per leaf, and six items or more in a leaf. Untouched pages take no memory. */
static size_t most_parts(uint32_t items)
{
    return items / 3 + 2;
}

/* Fills part i's table of the best uses of 1 to `width` child slots, from those of its halves [Ylitie17]. */
static void best_slots(struct build *b, uint32_t i)
{
    struct wide_part *p = &b->parts->part[i];
    const struct wide_part *l = &b->parts->part[p->left], *r = l + 1;
    const uint32_t width = b->parts->width;
    float split[WIDE_MOST + 1] = {0};
    uint8_t left[WIDE_MOST + 1] = {0};
    for (uint32_t n = 2; n <= width; n++) {
        split[n] = INFINITY;
        left[n] = 1; /* costs that are infinite or not numbers are as good as each other */
        for (uint32_t k = 1; k < n; k++) {
            float c = l->cost[k - 1] + r->cost[n - k - 1];
            if (c < split[n]) {
                split[n] = c;
                left[n] = (uint8_t)k;
            }
        }
    }
    p->cost[0] = wide_half_area(&p->box) + split[width];
    p->left_slots[0] = left[width];
    for (uint32_t n = 2; n <= width; n++) {
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
        for (uint32_t k = 0; k < b->parts->width; k++)
            b->parts->part[i].cost[k] = wide_half_area(&r->box);
        return true;
    }
    if (!reserve(b->parts, 2))
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

/* Appends to child[n ..] the parts that become children for part i, which may use `slots` slots. Returns the new
 * number. */
static int gather_children(const struct wide_build *p, uint32_t i, int slots, uint32_t *child,
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

/* One thread's own part of the tree, which hangs on part `at` of the whole. */
struct branch {
    uint32_t at;
    struct wide_build parts;
};

/* State of a build on several threads: large ranges are cut one by one, smaller ones become branches. */
struct grove {
    struct build *b;
    pthread_mutex_t lock; /* guards b->parts, branch, num, room */
    uint32_t most;        /* largest branch, in items */
    struct branch *branch;
    size_t num, room;
};

struct grove_task {
    uint32_t at;
    struct wide_range range;
};
static_assert(sizeof(struct grove_task) <= PARALLEL_TASK, "a task is stored by value");

static struct parallel_task grove_task(uint32_t at, const struct wide_range *r)
{
    struct parallel_task t = {.size = r->count};
    memcpy(t.what, &(struct grove_task){at, *r}, sizeof(struct grove_task));
    return t;
}

static bool add_branch(struct grove *g, struct branch *n)
{
    if (g->num == g->room) {
        size_t room = 2 * g->room + 64;
        struct branch *larger = realloc(g->branch, room * sizeof *larger);
        if (larger == NULL)
            return false;
        g->branch = larger;
        g->room = room;
    }
    g->branch[g->num++] = *n;
    return true;
}

static int grow_range(void *ctx, const struct parallel_task *task, struct parallel_task more[2])
{
    struct grove *g = ctx;
    struct grove_task t;
    memcpy(&t, task->what, sizeof t);
    if (t.range.count <= g->most) {
        struct branch n = {.at = t.at, .parts.width = g->b->parts->width};
        struct build b = *g->b;
        b.parts = &n.parts;
        bool ok = reserve(&n.parts, most_parts(t.range.count));
        n.parts.num = 1;
        ok = ok && add_part(&b, 0, &t.range);
        pthread_mutex_lock(&g->lock);
        ok = ok && add_branch(g, &n);
        pthread_mutex_unlock(&g->lock);
        if (!ok)
            wide_build_free(&n.parts);
        return ok ? 0 : -1;
    }
    struct wide_range left = t.range, right;
    cut(g->b, &left, &right);
    pthread_mutex_lock(&g->lock);
    struct wide_build *p = g->b->parts;
    bool ok = reserve(p, 2);
    uint32_t i = (uint32_t)p->num;
    if (ok) {
        p->part[t.at] = (struct wide_part){
            .box = t.range.box, .first = t.range.first, .count = t.range.count, .left = i};
        p->num += 2;
    }
    pthread_mutex_unlock(&g->lock);
    more[0] = grove_task(i, &left);
    more[1] = grove_task(i + 1, &right);
    return ok ? 2 : -1;
}

/* Appends the branches' parts to those of the whole, and frees the branches. False if out of memory. */
static bool join_branches(struct grove *g)
{
    struct wide_build *p = g->b->parts;
    size_t more = 0;
    for (size_t k = 0; k < g->num; k++)
        more += g->branch[k].parts.num;
    if (!reserve(p, more))
        return false;
    for (size_t k = 0; k < g->num; k++) {
        const struct wide_build *from = &g->branch[k].parts;
        uint32_t shift = (uint32_t)p->num - 1;
        for (size_t i = 0; i < from->num; i++) {
            struct wide_part *to = &p->part[i == 0 ? g->branch[k].at : i + shift];
            *to = from->part[i];
            to->left += to->left != 0 ? shift : 0;
        }
        p->num += from->num - 1;
        wide_build_free(&g->branch[k].parts);
    }
    return true;
}

static bool grow_on_threads(struct build *b, const struct wide_range *all, int threads)
{
    struct grove g = {.b = b, .most = all->count / (16 * (uint32_t)threads)};
    pthread_mutex_init(&g.lock, NULL);
    const struct parallel_task first = grove_task(0, all);
    bool ok = parallel_divide(threads, &first, grow_range, &g);
    pthread_mutex_destroy(&g.lock);
    size_t num_cut = b->parts->num;
    /* Frees all branches, or none of them if it fails. */
    ok = ok && join_branches(&g);
    for (size_t k = 0; !ok && k < g.num; k++)
        wide_build_free(&g.branch[k].parts);
    free(g.branch);
    for (size_t i = num_cut; ok && i-- > 0;)
        if (b->parts->part[i].left != 0 && b->parts->part[i].left < num_cut)
            best_slots(b, (uint32_t)i);
    return ok;
}

bool wide_build_make(const struct sah_split_passes *s, struct wide_item *item,
                     uint32_t num_triangles, const struct wide_range *all, int threads,
                     struct wide_build *p)
{
    enum { LEAST_FOR_THREADS = 1 << 14 };
    struct build b = {.splitter = s, .item = item, .num_triangles = num_triangles, .parts = p};
    struct wide_range r = *all;
    const bool on_threads = threads > 1 && all->count >= LEAST_FOR_THREADS;
    if (!reserve(p, on_threads ? 2 : most_parts(all->count)))
        return false;
    p->num = 1;
    return on_threads ? grow_on_threads(&b, all, threads) : add_part(&b, 0, &r);
}

int wide_build_children(const struct wide_build *p, uint32_t i, uint32_t child[WIDE_MOST])
{
    uint32_t left = p->part[i].left;
    int slots = p->part[i].left_slots[0];
    assert(left != 0);
    int n = gather_children(p, left, slots, child, 0);
    return gather_children(p, left + 1, (int)p->width - slots, child, n);
}

void wide_build_free(struct wide_build *p)
{
    free(p->part);
}
