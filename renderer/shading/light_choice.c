#include "light_choice.h"

#include "light_choice_simd.h"
#include "renderer/math/mat4.h"

#include <stdlib.h>

/* Lights order[lo .. hi-1], and where to split them: at `middle` of the key that varies most. */
struct group {
    uint32_t lo, hi;
    int key;
    double extent, middle;
};

struct builder {
    const struct light_bounds *b;
    uint32_t *order;
    double size; /* extent of the lights; counts as much as a turn by a radian */
};

/* Keys: place (3), direction (3), and whether infinitely far, which separates lights most. */
enum { KEYS = 7 };
static double key_of(const struct builder *w, uint32_t light, int key)
{
    const struct light_bounds *b = &w->b[light];
    const vec3 v = key < 3 ? b->centre : b->axis;
    if (key == KEYS - 1)
        return b->near ? 1e30 : 0;
    return (key < 3 ? 1 : w->size) * (double)(key % 3 == 0 ? v.x : key % 3 == 1 ? v.y : v.z);
}

static struct group group_of(const struct builder *w, uint32_t lo, uint32_t hi)
{
    struct group g = {.lo = lo, .hi = hi};
    for (int key = 0; key < KEYS; key++) {
        double least = INFINITY, most = -INFINITY;
        for (uint32_t i = lo; i < hi; i++) {
            const double k = key_of(w, w->order[i], key);
            least = fmin(least, k);
            most = fmax(most, k);
        }
        if (most - least > g.extent)
            g = (struct group){lo, hi, key, most - least, 0.5 * (least + most)};
    }
    return g;
}

/* Moves the lights beyond the middle to the end and returns where these begin; if a part would be empty, half-way. */
static uint32_t cut_group(struct builder *w, const struct group *g)
{
    uint32_t lo = g->lo, hi = g->hi;
    while (lo < hi) {
        const uint32_t light = w->order[lo];
        if (key_of(w, light, g->key) <= g->middle) {
            lo++;
        } else {
            w->order[lo] = w->order[--hi];
            w->order[hi] = light;
        }
    }
    return lo > g->lo && lo < g->hi ? lo : g->lo + (g->hi - g->lo) / 2;
}

/* Splits the widest group until there are MOST_CLUSTERS. Parts stay side by side, so that groups that are near each
 * other remain neighbours. Returns the number of groups. */
static int build_groups(struct builder *w, uint32_t num_lights, struct group *group)
{
    int num = 1;
    for (group[0] = group_of(w, 0, num_lights); num < MOST_CLUSTERS; num++) {
        int widest = -1;
        for (int k = 0; k < num; k++)
            if (group[k].hi - group[k].lo > 1 &&
                (widest < 0 || group[k].extent > group[widest].extent))
                widest = k;
        if (widest < 0)
            break;
        const struct group g = group[widest];
        const uint32_t cut = cut_group(w, &g);
        for (int k = num; k > widest + 1; k--)
            group[k] = group[k - 1];
        group[widest] = group_of(w, g.lo, cut);
        group[widest + 1] = group_of(w, cut, g.hi);
    }
    return num;
}

/* Fills *c with bounds of all lights of a group. all: the value of all lights. */
static void fill_cluster(const struct builder *w, const struct group *g, double all,
                         struct light_cluster *c)
{
    const struct light_bounds *first = &w->b[w->order[g->lo]];
    const float unit = first->near ? (float)(1 / w->size) : 1;
    vec3 least = first->centre, most = first->centre;
    double value = 0, even = 0, falloff[3] = {0}, reach = 1, radius = 0, angle = 0;
    dvec3 axis = d3(0, 0, 0);
    for (uint32_t i = g->lo; i < g->hi; i++) {
        const struct light_bounds *b = &w->b[w->order[i]];
        const vec3 r = v3(b->radius, b->radius, b->radius);
        least = vmin(least, sub(b->centre, r));
        most = vmax(most, add(b->centre, r));
        axis = d3_add(axis, d3_scale(d3_of(b->axis), b->value / all));
        reach = fmin(reach, (double)b->reach);
        value += b->value;
        even += b->value * (double)b->even;
        for (int k = 0; k < 3; k++)
            falloff[k] += b->value * (double)b->falloff[k];
    }
    const vec3 centre = scale(add(least, most), 0.5f);
    if (!d3_normalize(&axis))
        axis = d3(0, 0, 1);
    for (uint32_t i = g->lo; i < g->hi; i++) {
        const struct light_bounds *b = &w->b[w->order[i]];
        const double cosine = d3_dot(axis, d3_of(b->axis));
        radius = fmax(radius, (double)(length(sub(b->centre, centre)) + b->radius));
        angle = fmax(angle, acos(fmax(-1, fmin(1, cosine))) + (double)b->angle);
    }
    radius *= (double)unit;
    *c =
        (struct light_cluster){.centre = scale(centre, unit),
                               .axis = v3((float)axis.x, (float)axis.y, (float)axis.z),
                               .near = first->near ? unit : 0,
                               .radius = (float)radius,
                               .blur2 = (float)fmax(0.5 * radius * radius, 1e-30),
                               .spread = (float)(2 * sin(0.5 * fmin(angle, 3.14159265358979))),
                               .reach = (float)reach,
                               .even = (float)(even / value),
                               .falloff = {(float)(falloff[0] / value), (float)(falloff[1] / value),
                                           (float)(falloff[2] / value)},
                               .value = (float)(value / all)};
}

/* Rescales the falloff to lengths in units of `size`, so that it is 1 at that distance, and `value` to match. */
static void scale_falloff(struct light_bounds *b, double size)
{
    double f[3] = {b->falloff[0], size * (double)b->falloff[1],
                   size * size * (double)b->falloff[2]};
    const double there = f[0] + f[1] + f[2];
    for (int k = 0; k < 3; k++)
        b->falloff[k] = (float)(f[k] / there);
    b->value /= there;
}

struct light_clusters *light_clusters_build(struct light_bounds *b, uint32_t n)
{
    struct light_clusters *t = calloc(1, sizeof *t);
    double *value = malloc(((size_t)n + 1) * sizeof *value), all = 0;
    uint32_t num = 0;
    if (t != NULL) {
        t->light = malloc(((size_t)n + 1) * sizeof *t->light);
        t->end = malloc(((size_t)n + 1) * sizeof *t->end);
        t->place = malloc(((size_t)n + 1) * sizeof *t->place);
    }
    if (t == NULL || value == NULL || t->light == NULL || t->end == NULL || t->place == NULL) {
        free(value);
        light_clusters_free(t);
        return NULL;
    }
    vec3 least = v3(INFINITY, INFINITY, INFINITY), most = neg(least);
    for (uint32_t i = 0; i < n; i++) {
        t->place[i] = UINT32_MAX;
        if (!(b[i].value > 0))
            continue;
        t->light[num++] = i;
        const vec3 r = v3(b[i].radius, b[i].radius, b[i].radius);
        least = b[i].near ? vmin(least, sub(b[i].centre, r)) : least;
        most = b[i].near ? vmax(most, add(b[i].centre, r)) : most;
    }
    const double size = least.x <= most.x ? (double)length(sub(most, least)) : 0;
    struct builder w = {b, t->light, size > 0 ? size : 1};
    for (uint32_t i = 0; i < num; i++) {
        scale_falloff(&b[t->light[i]], w.size);
        all += b[t->light[i]].value;
    }
    struct group group[MOST_CLUSTERS];
    t->num = num > 0 ? build_groups(&w, num, group) : 0;
    for (int k = 0; k < t->num; k++) {
        fill_cluster(&w, &group[k], all, &t->cluster[k]);
        t->first[k + 1] = group[k].hi;
        for (uint32_t i = group[k].lo; i < group[k].hi; i++) {
            t->place[t->light[i]] = i;
            value[i] = b[t->light[i]].value;
        }
        discrete_build(value + group[k].lo, group[k].hi - group[k].lo, t->end + group[k].lo);
    }
    free(value);
    return t;
}

void light_clusters_free(struct light_clusters *t)
{
    if (t == NULL)
        return;
    free(t->light);
    free(t->end);
    free(t->place);
    free(t);
}
