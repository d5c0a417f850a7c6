/* Chooses among many lights (light_choice.h), by lanes: about in proportion to the luminance of the
 * irradiance from a light; never one that sends nothing to the side of the normal. */
#ifndef ASSAY_LIGHT_CHOICE_SIMD_H
#define ASSAY_LIGHT_CHOICE_SIMD_H

#include "light_choice.h"
#include "renderer/math/discrete.h"
#include "renderer/math/vec_simd.h"

/* Lengths are in units of the lights' extent. */
struct light_cluster {
    vec3 centre, axis;
    float near; /* scale of the receiver's place; 0 if the lights are infinitely far */
    float radius,
        blur2;    /* half of radius^2, added to squared distances so that none is too small */
    float spread; /* upper bound of cos(a - angle) - cos(a) */
    float reach, even, falloff[3], value;
};

struct light_clusters {
    int num;
    struct light_cluster cluster[MOST_CLUSTERS];
    uint32_t first[MOST_CLUSTERS + 1]; /* cluster k has places first[k] .. first[k + 1] - 1 */
    uint32_t *light, *end;             /* by place: light; steps of the choice in its cluster */
    uint32_t *place;                   /* by light; UINT32_MAX: never chosen */
};

/* The weight of a cluster at p with the normal n. */
INLINE vf cluster_weight(const struct light_cluster *c, vec3v p, vec3v n)
{
    const vf zero = vf_set(0);
    const vec3v to = subv(v3_all(c->centre), scalev(p, vf_set(c->near)));
    const vf d2 = dotv(to, to) + c->blur2, d = vf_sqrt(d2);
    /* Upper bounds over the sphere, rounding included, of the height above the surface and of the distance ahead of the
     * light. */
    const vf reach = c->radius + 1e-5f * d;
    const vf height = dotv(n, to) + reach,
             ahead = reach + c->spread * d - dotv(v3_all(c->axis), to);
    const vf sent = c->even * d + (1 - c->even) * ahead;
    const vf w =
        c->value * height * sent / (d2 * (c->falloff[0] + d * c->falloff[1] + d2 * c->falloff[2]));
    const vm lit = vf_lt(zero, height) & vf_lt(c->reach * (d - reach), ahead) & vf_lt(zero, w);
    return vf_select(lit, vf_min(w, vf_set(1e30f)), zero);
}

/* Chooses a cluster for each lane by 0 <= u < 1. *weight: its weight; *all: the sum of all weights, 0 if none sends
 * anything; *rest: position of u within the choice, 0 to 1. */
INLINE vi choose_cluster(const struct light_clusters *t, vec3v p, vec3v n, vf u, vf *weight,
                         vf *all, vf *rest)
{
    vf upto[MOST_CLUSTERS], sum = vf_set(0);
    for (int i = 0; i < t->num; i++) {
        sum = sum + cluster_weight(&t->cluster[i], p, n);
        upto[i] = sum;
    }
    /* Below the sum, even where rounding makes them equal. */
    const vf target = vf_min(u * sum, sum * (1 - 0x1p-24f));
    vf before = vf_set(0), there = sum;
    vi taken = vi_set(0);
    for (int i = 0; i < t->num; i++) {
        vm beyond = vf_le(upto[i], target);
        taken += vi_where(beyond, vi_set(1));
        before = vf_select(beyond, upto[i], before);
        there = vf_select(beyond, there, vf_min(there, upto[i]));
    }
    *weight = there - before;
    *all = sum;
    *rest = vf_min((target - before) / *weight, vf_set(1 - 0x1p-24f));
    return taken;
}

/* Chooses a light of a cluster by 0 <= *u < 1, which becomes the position within the choice. *probability: within the
 * cluster. */
static inline uint32_t choose_in_cluster(const struct light_clusters *t, int cluster, float *u,
                                         float *probability)
{
    const uint32_t first = t->first[cluster], count = t->first[cluster + 1] - first;
    uint32_t i = 0;
    if (count > 1) {
        i = discrete_pick(t->end + first, count, *u);
        *u = minf(discrete_part(t->end + first, i, *u), 1 - 0x1p-24f);
    }
    *probability = discrete_probability(t->end + first, i);
    return t->light[first + i];
}

/* Probability with which choose_cluster() and choose_in_cluster() choose a light at p with normal n. all: as given by
 * choose_cluster() there. */
static inline float chosen_probability(const struct light_clusters *t, uint32_t light, vec3 p,
                                       vec3 n, float all)
{
    const uint32_t place = t->place[light];
    int c = 0;
    while (c < t->num && place >= t->first[c + 1])
        c++;
    if (c == t->num || !(all > 0))
        return 0;
    vf weight = cluster_weight(&t->cluster[c], v3_all(p), v3_all(n));
    return LANE(weight, 0) / all * discrete_probability(t->end + t->first[c], place - t->first[c]);
}

#endif
