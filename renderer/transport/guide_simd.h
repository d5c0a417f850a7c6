/* Tables of a guide (guide.h), looked up by lanes. */
#ifndef ASSAY_GUIDE_SIMD_H
#define ASSAY_GUIDE_SIMD_H

#include "guide.h"
#include "renderer/math/vec_simd.h"

_Static_assert((int)GUIDE_SIDE == (int)COLUMNS, "a row of a table is one of gather_columns()");

/* Cell and class of surfaces at p with normals n; of any p and n, NaN too, a place that there is. */
INLINE vi guide_place(const struct guide *g, vec3v p, vec3v n)
{
    const vf zero = vf_set(0), most = vf_set(GUIDE_CELLS - 1);
    vec3v at = subv(p, v3_all(g->low));
    vi x = vi_truncate(vf_min(vf_max(at.x * g->cells_per_unit.x, zero), most));
    vi y = vi_truncate(vf_min(vf_max(at.y * g->cells_per_unit.y, zero), most));
    vi z = vi_truncate(vf_min(vf_max(at.z * g->cells_per_unit.z, zero), most));
    vf ax = vf_abs(n.x), ay = vf_abs(n.y), az = vf_abs(n.z);
    vm is_x = vf_lt(ay, ax) & vf_lt(az, ax), is_y = ~is_x & vf_lt(az, ay);
    vi sign = vi_select(is_x, as_vi(n.x), vi_select(is_y, as_vi(n.y), as_vi(n.z)));
    vi kind = vi_where(is_x, vi_set(4)) + vi_where(is_y, vi_set(8));
    kind += vi_where(vi_lt(sign, vi_set(0)), vi_set(2)) +
            vi_where(vi_lt(as_vi(n.z), vi_set(0)), vi_set(1));
    return ((z * GUIDE_CELLS + y) * GUIDE_CELLS + x) * GUIDE_CLASSES + kind;
}

/* Moves u to the bin of its quantile in these rows of the table, stretched to the bin's width. Returns the density
 * there. */
INLINE vf guide_bin(const float *table, vi row, vf *u, vi *bin)
{
    const vf below_one = vf_set(0x1.fffffep-1f);
    int32_t rows[LANES];
    vf end[COLUMNS];
    vi_store_any(rows, row);
    gather_columns(table, COLUMNS, rows, end);
    vf low = vf_set(0), high = end[0];
    *bin = vi_set(0);
    for (int k = 0; k + 1 < COLUMNS; k++) {
        vm past = vf_le(end[k], *u);
        low = vf_select(past, end[k], low);
        high = vf_select(past, end[k + 1], high);
        *bin += vi_where(past, vi_set(1));
    }
    vf width = high - low;
    *u = vf_min((vf_of_int(*bin) + (*u - low) / width) * (1.0f / COLUMNS), below_one);
    return width * COLUMNS;
}

/* The guided numbers of a direction. Returns their density, and the bin within the place. */
INLINE vf guide_direction(const struct guide *g, vi place, vf u[2], vi *bin)
{
    vi column, row = place * GUIDE_ROWS, within;
    vf density = guide_bin(g->table, row, &u[0], &column);
    density *= guide_bin(g->table, row + 1 + column, &u[1], &within);
    *bin = column * GUIDE_SIDE + within;
    return density;
}

#endif
