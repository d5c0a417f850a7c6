#include "sah_split.h"
#include "renderer/math/simd.h"

#include <float.h>
#include <stdbool.h>

/* Exchanges the halves: minimum and negated maximum, or a sum and its negative. */
INLINE vf swap_halves(vf a)
{
    return __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3);
}

INLINE vf item_box(const struct wide_item *i)
{
    return vf_load(i->min);
}

INLINE float half_area(vf box)
{
    vf d = -(box + swap_halves(box));
    return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
}

static void bounds(const struct wide_item *item, uint32_t n, struct wide_box *box,
                   struct wide_box *centres)
{
    vf b = vf_set(FLT_MAX), c = b;
    for (uint32_t i = 0; i < n; i++) {
        vf x = item_box(item + i);
        b = vf_min(x, b);
        c = vf_min(x - swap_halves(x), c);
    }
    vf_store(box->v, b);
    vf_store(centres->v, c);
}

static void split(const struct wide_item *item, uint32_t n, uint32_t width,
                  const struct wide_box *centres, struct wide_split *out)
{
    const uint32_t most = width - 1;
    const int log_width = __builtin_ctz(width);
    const int bins = n < 512 ? 16 : WIDE_MAX_BINS;
    vf low = vf_load(centres->v), extent = -(low + swap_halves(low)), to_bins = vf_set(0);
    bool usable[3];
    for (int a = 0; a < 3; a++) {
        float f = (float)bins * 0.9999f / extent[a];
        usable[a] = extent[a] > 0 && f < FLT_MAX;
        to_bins[a] = usable[a] ? f : 0;
    }
    /* Consecutive items tend to fall into the same bin: they go into two sets of bins in turn, so that one update need
     * not wait for the other. */
    const uint32_t other = n < 64 ? 0 : 1;
    vf both[2][3][WIDE_MAX_BINS], (*box)[WIDE_MAX_BINS] = both[0];
    uint32_t count[3][WIDE_MAX_BINS] = {{0}};
    for (uint32_t set = 0; set <= other; set++)
        for (int a = 0; a < 3; a++)
            for (int k = 0; k < bins; k++)
                both[set][a][k] = vf_set(FLT_MAX);
    for (uint32_t i = 0; i < n; i++) {
        vf x = item_box(item + i), (*to)[WIDE_MAX_BINS] = both[i & other];
        vi k = __builtin_convertvector((x - swap_halves(x) - low) * to_bins, vi);
        for (int a = 0; a < 3; a++) {
            to[a][k[a]] = vf_min(x, to[a][k[a]]);
            count[a][k[a]]++;
        }
    }
    for (int a = 0; a < 3; a++)
        for (int k = 0; other != 0 && k < bins; k++)
            box[a][k] = vf_min(both[1][a][k], box[a][k]);
    out->cost = FLT_MAX;
    for (int a = 0; a < 3; a++) {
        if (!usable[a])
            continue;
        vf right[WIDE_MAX_BINS];
        float cost[WIDE_MAX_BINS];
        vf sweep = vf_set(FLT_MAX);
        uint32_t m = 0;
        for (int k = bins - 1; k > 0; k--) {
            sweep = vf_min(box[a][k], sweep);
            m += count[a][k];
            right[k] = sweep;
            cost[k] = m == 0 ? FLT_MAX : half_area(sweep) * (float)((m + most) >> log_width);
        }
        sweep = vf_set(FLT_MAX);
        m = 0;
        for (int k = 1; k < bins; k++) {
            sweep = vf_min(box[a][k - 1], sweep);
            m += count[a][k - 1];
            if (m == 0)
                continue;
            float total = cost[k] + half_area(sweep) * (float)((m + most) >> log_width);
            if (total < out->cost) {
                out->cost = total;
                out->axis = a;
                out->bin = k;
                out->low = low[a];
                out->to_bins = to_bins[a];
                vf_store(out->left.v, sweep);
                vf_store(out->right.v, right[k]);
            }
        }
    }
}

/* Branch-free, since the side to which an item goes cannot be predicted. An item of the left side swaps places
 * with the first one of the right side. */
static uint32_t partition(struct wide_item *item, uint32_t n, const struct wide_split *s,
                          struct wide_box *left, struct wide_box *right)
{
    vf cl = vf_set(FLT_MAX), cr = cl;
    const vf none = cl;
    const int axis = s->axis;
    uint32_t num_left = 0;
    for (uint32_t i = 0; i < n; i++) {
        vf x = item_box(item + i), c = x - swap_halves(x);
        float at = item[i].min[axis] - item[i].minus_max[axis];
        int32_t goes_left = (int)((at - s->low) * s->to_bins) < s->bin;
        vi mask = vi_set(-goes_left);
        cl = vf_min(vf_select(mask, c, none), cl);
        cr = vf_min(vf_select(mask, none, c), cr);
        vf_store(item[i].min, item_box(item + num_left));
        vf_store(item[num_left].min, x);
        num_left += (uint32_t)goes_left;
    }
    vf_store(left->v, cl);
    vf_store(right->v, cr);
    return num_left;
}

const struct sah_split_passes FOR_ISA(sah_split) = {
    .split = split, .partition = partition, .bounds = bounds};
