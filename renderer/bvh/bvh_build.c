/* Builds the binary trees of bvh.h: split at the mean centroid (as the assignment does) or by
 * the surface area heuristic, binned [Wald07]. */
#include "bvh_internal.h"

#include <float.h>
#include <stdlib.h>

enum {
    MAX_LEAF = 4,
    NUM_BINS = 16,
    /* Beyond this depth a node's list is halved: 32 halvings use up any list. */
    MAX_FREE_DEPTH = BVH_MAX_DEPTH - 32
};

static const struct box empty_box = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};

static struct box box_union(struct box a, struct box b)
{
    return (struct box){vmin(a.min, b.min), vmax(a.max, b.max)};
}

static struct box box_add(struct box a, vec3 p)
{
    return (struct box){vmin(a.min, p), vmax(a.max, p)};
}

static float axis_of(vec3 v, int axis)
{
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

static vec3 centre(struct box b)
{
    return scale(add(b.min, b.max), 0.5f);
}

struct build {
    struct bvh *bvh;
    enum bvh_kind kind;
    struct box *boxes; /* by primitive */
};

/* Where to cut entries [first, first + count) of the list: *axis, and *value, the mean centroid along
 * it. False if all centroids coincide. */
static bool choose_centroid_split(const struct build *b, uint32_t first, uint32_t count,
                                  struct box centroids, int *axis, float *value)
{
    vec3 extent = sub(centroids.max, centroids.min);
    *axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    double sum = 0;
    for (uint32_t i = first; i < first + count; i++)
        sum += axis_of(centre(b->boxes[b->bvh->order[i]]), *axis);
    *value = (float)(sum / count);
    return axis_of(extent, *axis) > 0;
}

static int bin_of(float c, float lo, float scale_to_bins)
{
    int k = (int)((c - lo) * scale_to_bins);
    return k < 0 ? 0 : k >= NUM_BINS ? NUM_BINS - 1 : k;
}

/* The same by the surface area heuristic: *value is the first bin that goes right. Also false where a
 * leaf costs no more. */
static bool choose_sah_split(const struct build *b, uint32_t first, uint32_t count, struct box node,
                             struct box centroids, int *axis, float *value)
{
    float best = FLT_MAX;
    for (int a = 0; a < 3; a++) {
        float lo = axis_of(centroids.min, a), hi = axis_of(centroids.max, a);
        if (!(hi > lo))
            continue;
        float to_bins = NUM_BINS / (hi - lo);
        struct box bin[NUM_BINS], right[NUM_BINS];
        uint32_t in_bin[NUM_BINS] = {0}, in_right[NUM_BINS];
        for (int k = 0; k < NUM_BINS; k++)
            bin[k] = empty_box;
        for (uint32_t i = first; i < first + count; i++) {
            struct box pb = b->boxes[b->bvh->order[i]];
            int k = bin_of(axis_of(centre(pb), a), lo, to_bins);
            bin[k] = box_union(bin[k], pb);
            in_bin[k]++;
        }
        struct box sweep = empty_box;
        uint32_t n = 0;
        for (int k = NUM_BINS - 1; k > 0; k--) {
            sweep = box_union(sweep, bin[k]);
            n += in_bin[k];
            right[k] = sweep;
            in_right[k] = n;
        }
        sweep = empty_box;
        n = 0;
        for (int k = 0; k + 1 < NUM_BINS; k++) {
            sweep = box_union(sweep, bin[k]);
            n += in_bin[k];
            if (n == 0 || in_right[k + 1] == 0)
                continue;
            float cost =
                half_area(sweep) * (float)n + half_area(right[k + 1]) * (float)in_right[k + 1];
            if (cost < best) {
                best = cost;
                *axis = a;
                *value = (float)(k + 1);
            }
        }
    }
    if (best == FLT_MAX)
        return false;
    return count > MAX_LEAF || best + half_area(node) < half_area(node) * (float)count;
}

/* Partitions the list by the chosen cut; returns how many went left. */
static uint32_t partition(const struct build *b, uint32_t first, uint32_t count,
                          struct box centroids, int axis, float value)
{
    float lo = axis_of(centroids.min, axis), hi = axis_of(centroids.max, axis);
    uint32_t *list = b->bvh->order + first, left = 0;
    for (uint32_t i = 0; i < count; i++) {
        float c = axis_of(centre(b->boxes[list[i]]), axis);
        bool goes_left =
            b->kind == BVH_SAH ? bin_of(c, lo, NUM_BINS / (hi - lo)) < (int)value : c < value;
        if (goes_left) {
            uint32_t swap = list[i];
            list[i] = list[left];
            list[left++] = swap;
        }
    }
    return left;
}

static void build_node(struct build *b, uint32_t index, uint32_t first, uint32_t count, int depth)
{
    struct bvh *t = b->bvh;
    struct box node = empty_box, centroids = empty_box;
    for (uint32_t i = first; i < first + count; i++) {
        struct box pb = b->boxes[t->order[i]];
        node = box_union(node, pb);
        centroids = box_add(centroids, centre(pb));
    }
    t->nodes[index] = (struct node){.box = node, .first = first, .count = (uint16_t)count};
    if (depth > t->depth)
        t->depth = depth;
    if (count <= (b->kind == BVH_SAH ? 1 : MAX_LEAF))
        return;
    int axis = 0;
    float value = 0;
    bool split = b->kind == BVH_SAH
                     ? choose_sah_split(b, first, count, node, centroids, &axis, &value)
                     : choose_centroid_split(b, first, count, centroids, &axis, &value);
    uint32_t left = 0;
    if (split && depth < MAX_FREE_DEPTH)
        left = partition(b, first, count, centroids, axis, value);
    if (left == 0 || left == count) {
        if (count <= MAX_LEAF)
            return;
        left = count / 2; /* coincident centroids, or a tree grown too deep */
    }
    uint32_t child = t->num_nodes;
    t->num_nodes += 2;
    t->nodes[index].first = child;
    t->nodes[index].count = 0;
    t->nodes[index].axis = (uint16_t)axis;
    build_node(b, child, first, left, depth + 1);
    build_node(b, child + 1, first + left, count - left, depth + 1);
}

bool bvh_build_tree(struct bvh *t, enum bvh_kind kind)
{
    struct build b = {.bvh = t, .kind = kind};
    b.boxes = malloc(t->num_primitives * sizeof *b.boxes);
    t->nodes = malloc(2 * (size_t)t->num_primitives * sizeof *t->nodes);
    if (b.boxes == NULL || t->nodes == NULL) {
        free(b.boxes);
        return false;
    }
    for (uint32_t i = 0; i < t->num_primitives; i++)
        scene_primitive_bounds(t->scene, i, &b.boxes[i].min, &b.boxes[i].max);
    t->num_nodes = 1;
    build_node(&b, 0, 0, t->num_primitives, 0);
    free(b.boxes);
    return true;
}
