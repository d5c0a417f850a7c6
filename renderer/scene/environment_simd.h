/* Environment light by lanes: look-up, sampling of directions, density. */
#ifndef ASSAY_ENVIRONMENT_SIMD_H
#define ASSAY_ENVIRONMENT_SIMD_H

#include "environment.h"
#include "renderer/math/discrete.h"
#include "renderer/math/warp.h"

enum {
    /* Largest numbers of rows and columns of regions. Regions are chosen from a table for each unit
     * normal, rounded to multiples of 1/NORMAL_STEPS. */
    REGION_ROWS = 16,
    REGION_COLUMNS = 32,
    NORMAL_STEPS = 3,
    NORMAL_SIDE = 2 * NORMAL_STEPS + 1
};

struct environment {
    enum environment_kind kind;
    rgb radiance; /* constant, upper half */
    double total;
    /* Image. Cells are `width` columns, of which column c lies between the centres of texels c-1
     * and c, and height+1 rows, of which the first and the last are half as high. */
    uint32_t width, height;
    rgb *texel;
    /* Per row of cells: sin^2(theta/2) at its upper edge, which is proportional to the solid angle
     * up to the nearer pole and precise near it, and the growth of that to the lower edge. theta is
     * taken from the top in the upper half, from the bottom in the lower. */
    float *begin, *growth;
    uint32_t num_rows, num_columns;      /* of regions */
    uint8_t *region_row, *region_column; /* by row and by column of cells */
    uint32_t row_first[REGION_ROWS + 1], column_first[REGION_COLUMNS + 1]; /* first of a region */
    uint32_t
        *region_end; /* per normal: steps of the rows of regions, then of the columns in each row */
    uint32_t *row_end; /* per column of regions: steps of the rows of cells, anew for each region */
    float *row_pdf_w; /* likewise: probability of the row, divided by the solid angle of one cell */
    uint32_t *column_end; /* `width` steps per row of cells, anew for each region */
};

/* Cells, and positions in them: `right` and `down` are 0 at the texel centres of column c-1 and row
 * r-1, and 1 at those of c and r. */
struct skyplacev {
    vi row, column;
    vf down, right;
};

INLINE rgbv mixv(rgbv a, rgbv b, vf t)
{
    return rgb_addv(rgb_scalev(a, 1 - t), rgb_scalev(b, t));
}

/* Radiance, interpolated bilinearly between four texels. */
INLINE rgbv sky_radiance(const struct environment *env, const struct skyplacev *p)
{
    const vi first = vi_set(0), last = vi_set((int32_t)env->height - 1);
    const vi rows[2] = {vi_select(vi_lt(first, p->row), p->row - 1, first),
                        vi_select(vi_lt(last, p->row), last, p->row)};
    const int32_t width = (int32_t)env->width;
    const vi columns[2] = {vi_select(vi_lt(first, p->column), p->column, vi_set(width)) - 1,
                           p->column};
    rgbv c[4];
    for (int i = 0; i < 4; i++) {
        int32_t texel[LANES];
        vf q[COLUMNS];
        vi_store_any(texel, rows[i / 2] * width + columns[i % 2]);
        gather_columns(&env->texel->r, 3, texel, q);
        c[i] = (rgbv){q[0], q[1], q[2]};
    }
    return mixv(mixv(c[0], c[1], p->right), mixv(c[2], c[3], p->right), p->down);
}

/* Places of the unit directions in the lanes of the mask; other lanes get an arbitrary valid place. */
INLINE struct skyplacev sky_place(const struct environment *env, vec3v w, unsigned mask)
{
    const int32_t width = (int32_t)env->width, height = (int32_t)env->height;
    vf theta = trig_atan2(vf_hypot(w.x, w.z), w.y), phi = trig_atan2(-w.z, w.x);
    vf x = (phi * (0.5f * INV_PI_F) + 0.5f) * (float)width + 0.5f,
       y = theta * INV_PI_F * (float)height + 0.5f;
    const vm there = lanes_of(mask);
    vi row = vi_where(there, vi_truncate(y)), column = vi_where(there, vi_truncate(x));
    row = vi_select(vi_lt(vi_set(height), row), vi_set(height), row);
    struct skyplacev p = {.row = row, .down = y - vf_of_int(row), .right = x - vf_of_int(column)};
    p.column = vi_select(vi_lt(column, vi_set(width)), column, column - width);
    return p;
}

/* Number of the table for a unit normal. */
INLINE vi sky_table(vec3v n)
{
    vi i[3];
    const vf c[3] = {n.x, n.y, n.z};
    for (int k = 0; k < 3; k++)
        i[k] = vi_truncate((c[k] + 1) * (float)NORMAL_STEPS + 0.5f);
    return (i[0] * NORMAL_SIDE + i[1]) * NORMAL_SIDE + i[2];
}

static inline const uint32_t *sky_regions(const struct environment *env, int32_t table)
{
    return env->region_end + (size_t)table * env->num_rows * (1 + env->num_columns);
}

/* Density, per steradian, of the directions of a cell under a table. */
static inline float cell_pdf_w(const struct environment *env, int32_t table, uint32_t row,
                               uint32_t column)
{
    const uint32_t *end = sky_regions(env, table), i = env->region_row[row],
                   j = env->region_column[column];
    const uint32_t *columns = end + env->num_rows + i * env->num_columns,
                   first = env->column_first[j];
    return discrete_probability(end, i) * discrete_probability(columns, j) *
           env->row_pdf_w[(size_t)j * (env->height + 1) + row] *
           discrete_probability(env->column_end + (size_t)row * env->width + first, column - first);
}

/* Discrete choices side by side: thing[i] is the one of count[i] things, with cumulative steps at end[i], that owns
 * step[i] (discrete.h). */
struct picks {
    const uint32_t *end[LANES];
    uint32_t count[LANES], step[LANES], thing[LANES];
};

/* Makes `num` choices by the numbers u in [0, 1). All searches advance in step, since the processor overlaps look-ups
 * that do not depend on each other. Uses up count[]. */
static inline void pick_each(struct picks *p, int num, const float *u)
{
    uint32_t most = 1;
    for (int i = 0; i < num; i++) {
        p->step[i] = (uint32_t)(u[i] * DISCRETE_STEPS);
        p->thing[i] = 0;
        most = p->count[i] > most ? p->count[i] : most;
    }
    for (; most > 1; most -= most / 2)
        for (int i = 0; i < num; i++) {
            const uint32_t half = p->count[i] / 2, last = half - (half > 0);
            p->thing[i] += half & -(uint32_t)(p->end[i][p->thing[i] + last] <= p->step[i]);
            p->count[i] -= half;
        }
}

/* Chooses cells for the lanes of the mask, positions in them from 0 to 1 (by what is left of the
 * numbers that chose the region) and the density. Leaves lanes alone to whose side no light comes. */
static inline void pick_cells(const struct environment *env, const int32_t table[LANES],
                              const vf u[4], unsigned mask, int32_t row[LANES],
                              int32_t column[LANES], float part[2][LANES], float pdf_w[LANES])
{
    int lane[LANES] = {0}, num = 0;
    float number[4][LANES] = {{0}};
    uint32_t region[2][LANES];
    struct picks p = {.count = {0}};
    for (; mask; mask &= mask - 1) {
        const int i = __builtin_ctz(mask);
        const uint32_t *end = sky_regions(env, table[i]);
        if (end[env->num_rows - 1] == 0)
            continue;
        for (int k = 0; k < 4; k++)
            number[k][num] = LANE(u[k], i);
        p.end[num] = end;
        p.count[num] = env->num_rows;
        lane[num++] = i;
    }
    for (int k = 0; k < 2; k++) {
        pick_each(&p, num, number[2 + k]);
        for (int i = 0; i < num; i++) {
            part[k][lane[i]] = discrete_part(p.end[i], p.thing[i], number[2 + k][i]);
            region[k][i] = p.thing[i];
            p.end[i] += env->num_rows + p.thing[i] * env->num_columns;
            p.count[i] = env->num_columns;
        }
    }
    for (int i = 0; i < num; i++) {
        const uint32_t *first = env->row_first + region[0][i];
        p.end[i] = env->row_end + (size_t)region[1][i] * (env->height + 1) + *first;
        p.count[i] = first[1] - *first;
    }
    pick_each(&p, num, number[0]);
    for (int i = 0; i < num; i++) {
        const uint32_t *first = env->column_first + region[1][i],
                       r = env->row_first[region[0][i]] + p.thing[i];
        row[lane[i]] = (int32_t)r;
        p.end[i] = env->column_end + (size_t)r * env->width + *first;
        p.count[i] = first[1] - *first;
    }
    pick_each(&p, num, number[1]);
    for (int i = 0; i < num; i++) {
        const int k = lane[i];
        column[k] = (int32_t)(env->column_first[region[1][i]] + p.thing[i]);
        pdf_w[k] = cell_pdf_w(env, table[k], (uint32_t)row[k], (uint32_t)column[k]);
    }
}

INLINE void sample_sky(const struct environment *env, vec3v n, const vf u[4], unsigned mask,
                       vec3v *wi, rgbv *radiance, vf *pdf_w)
{
    int32_t table[LANES], row[LANES] = {0}, column[LANES] = {0};
    float part[2][LANES] = {{0}}, begin[LANES] = {0}, growth[LANES] = {0}, pdf[LANES] = {0};
    vi_store_any(table, sky_table(n));
    pick_cells(env, table, u, mask, row, column, part, pdf);
    for (int i = 0; i < LANES; i++) {
        begin[i] = env->begin[row[i]];
        growth[i] = env->growth[row[i]];
    }
    const float width = (float)env->width, height = (float)env->height;
    struct skyplacev p = {
        .row = vi_load_any(row), .column = vi_load_any(column), .right = vf_load_any(part[1])};
    const vf s = vf_load_any(begin) + vf_load_any(part[0]) * vf_load_any(growth),
             from_pole = vf_sqrt(s), along = vf_sqrt(1 - s);
    const vm lower = vi_lt(vi_set((int32_t)env->height / 2), p.row);
    const vf rows = trig_atan2(from_pole, along) * (2 * INV_PI_F * height), r = vf_of_int(p.row);
    p.down = vf_select(lower, height - r + 0.5f - rows, rows + 0.5f - r);
    vf turn = (vf_of_int(p.column) - 0.5f + p.right) / width, sine, cosine,
       sin_theta = 2 * from_pole * along, y = 1 - 2 * s;
    trig_turn(vf_select(vf_lt(turn, vf_set(0)), turn + 1, turn), &sine, &cosine);
    *wi = v3v(-(sin_theta * cosine), vf_negate_if(lower, y), sin_theta * sine);
    *radiance = sky_radiance(env, &p);
    *pdf_w = vf_load_any(pdf);
}

/* Density of cosine-weighted directions about n; for the upper half, of such directions with those
 * that point down mirrored up. */
INLINE vf even_sky_pdf_w(const struct environment *env, vec3v n, vec3v w)
{
    const vf zero = vf_set(0);
    vf density = warp_cosine_hemisphere_pdf_w(vf_max(zero, dotv(n, w)));
    if (env->kind == ENVIRONMENT_CONSTANT)
        return density;
    density = density + warp_cosine_hemisphere_pdf_w(vf_max(zero, dotv(n, v3v(w.x, -w.y, w.z))));
    return vf_select(vf_lt(zero, w.y), density, zero);
}

/* Samples directions for surfaces with unit normals n, by u in [0,1)^4, for the lanes of the mask. *pdf_w, per
 * steradian, is 0 if no light comes to that side. */
INLINE void sample_environment_from(const struct environment *env, vec3v n, const vf u[4],
                                    unsigned mask, vec3v *wi, rgbv *radiance, vf *pdf_w)
{
    if (env->kind == ENVIRONMENT_IMAGE) {
        sample_sky(env, n, u, mask, wi, radiance, pdf_w);
        return;
    }
    const framev f = frame_from_normalv(n);
    *wi = frame_to_worldv(&f, warp_cosine_hemisphere(u[0], u[1]));
    if (env->kind == ENVIRONMENT_UPPER_HALF)
        wi->y = vf_abs(wi->y);
    *radiance = rgb_all(env->radiance);
    *pdf_w = even_sky_pdf_w(env, n, *wi);
}

/* Radiance from the unit directions w, for the lanes of the mask. Unless n is NULL, *pdf_w is the
 * density with which these are sampled at normals n. */
INLINE rgbv look_up_environment(const struct environment *env, const vec3v *n, vec3v w,
                                unsigned mask, vf *pdf_w)
{
    if (env->kind != ENVIRONMENT_IMAGE) {
        if (n != NULL)
            *pdf_w = even_sky_pdf_w(env, *n, w);
        const vm lit = env->kind == ENVIRONMENT_CONSTANT ? vm_set(true) : vf_lt(vf_set(0), w.y);
        return rgb_where(lit, rgb_all(env->radiance));
    }
    const struct skyplacev p = sky_place(env, w, mask);
    if (n != NULL) {
        const vi table = sky_table(*n);
        *pdf_w = vf_set(0);
        for (; mask; mask &= mask - 1) {
            const int i = __builtin_ctz(mask);
            LANE(*pdf_w, i) = cell_pdf_w(env, LANE(table, i), (uint32_t)LANE(p.row, i),
                                         (uint32_t)LANE(p.column, i));
        }
    }
    return sky_radiance(env, &p);
}

#endif
