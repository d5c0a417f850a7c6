/* Many lights (light_choice.h), by lanes: in proportion to about the irradiance (its luminance) that
 * comes from a light; never one that sends nothing to the side of the normal. */
#ifndef ASSAY_LIGHT_CHOICE_SIMD_H
#define ASSAY_LIGHT_CHOICE_SIMD_H

#include "light_choice.h"
#include "renderer/math/discrete.h"
#include "renderer/math/vec_simd.h"

/* Lengths are in units of the lights' extent. */
struct light_cluster {
    vec3 centre, axis;
    float near; /* what places are multiplied by: 0 where the lights are infinitely far */
    float radius,
        blur2;    /* blur2: half of its square, by which distances grow so that none is too near */
    float spread; /* cos(a - angle) - cos(a) is no more than this */
    float reach, even, falloff[3], value;
};

struct light_clusters {
    int num;
    struct light_cluster cluster[MOST_CLUSTERS];
    uint32_t first[MOST_CLUSTERS + 1]; /* its lights' places */
    uint32_t *light, *end;             /* by place: a light; of the choice within its cluster */
    uint32_t *place;                   /* by light: and back */
};

/* The weight of a cluster at p with the normal n. */
INLINE vf cluster_weight(const struct light_cluster *c, vec3v p, vec3v n)
{
    const vf zero = vf_set(0);
    const vec3v to = subv(v3_all(c->centre), scalev(p, vf_set(c->near)));
    const vf d2 = dotv(to, to) + c->blur2, d = vf_sqrt(d2);
    /* No part of the sphere is higher above the surface, or further ahead of the light; nor is what rounding hides. */
    const vf reach = c->radius + 1e-5f * d;
    const vf height = dotv(n, to) + reach,
             ahead = reach + c->spread * d - dotv(v3_all(c->axis), to);
    const vf sent = c->even * d + (1 - c->even) * ahead;
    const vf w =
        c->value * height * sent / (d2 * (c->falloff[0] + d * c->falloff[1] + d2 * c->falloff[2]));
    const vi lit = vf_lt(zero, height) & vf_lt(c->reach * (d - reach), ahead) & vf_lt(zero, w);
    return vf_select(lit, vf_min(w, vf_set(1e30f)), zero);
}

/* A cluster for each lane, 0 <= u < 1, its weight and that of all: 0, if none sends anything. *rest: what is left of u,
 * 0 to 1. */
INLINE vi choose_cluster(const struct light_clusters *t, vec3v p, vec3v n, vf u, vf *weight,
                         vf *all, vf *rest)
{
    vf upto[MOST_CLUSTERS], sum = vf_set(0);
    for (int i = 0; i < t->num; i++) {
        sum = sum + cluster_weight(&t->cluster[i], p, n);
        upto[i] = sum;
    }
    /* Below it even where rounding makes it as much. */
    const vf target = vf_min(u * sum, sum * (1 - 0x1p-24f));
    vf before = vf_set(0), there = sum;
    vi taken = vi_set(0);
    for (int i = 0; i < t->num; i++) {
        vi beyond = vf_le(upto[i], target);
        taken = taken - beyond;
        before = vf_select(beyond, upto[i], before);
        there = vf_select(beyond, there, vf_min(there, upto[i]));
    }
    *weight = there - before;
    *all = sum;
    *rest = vf_min((target - before) / *weight, vf_set(1 - 0x1p-24f));
    return taken;
}

/* A light of a cluster, and with what probability. 0 <= *u < 1, likewise. */
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

/* The probability that these two have for a light at p with the normal n, where `all` is the weight of all. */
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
