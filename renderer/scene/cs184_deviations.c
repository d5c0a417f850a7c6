#include "cs184_deviations.h"

const char *const cs184_deviation_names[NUM_CS184_DEVIATIONS + 1] = {"light-pdf", "turned-lamp",
                                                                     "beckmann", NULL};

vec3 cs184_deviations_turn(const struct scene *s, const struct light *l, vec3 p)
{
    const vec3 *q = s->position + 3 * (size_t)l->first;
    if (l->count != 2)
        return p;
    vec3 n = normalize(cross(sub(q[1], q[0]), sub(q[2], q[0]))), sum = v3(0, 0, 0);
    for (int i = 0; i < 6; i++)
        sum = add(sum, q[i]);
    vec3 centre = scale(sum, 1.0f / 6); /* of both triangles, which have the same area */
    return add(centre, cross(n, sub(p, centre)));
}

static void turn_lamp(struct scene *s, const struct light *l)
{
    vec3 *q = s->position + 3 * (size_t)l->first, turned[6];
    if (l->count != 2)
        return;
    for (int i = 0; i < 6; i++)
        turned[i] = cs184_deviations_turn(s, l, q[i]);
    for (int i = 0; i < 6; i++) {
        q[i] = turned[i];
        s->bounds_min = vmin(s->bounds_min, q[i]);
        s->bounds_max = vmax(s->bounds_max, q[i]);
    }
}

void cs184_deviations_apply(struct scene *s, unsigned bits)
{
    s->starter = bits;
    for (uint32_t l = 0; l < s->num_lights && starter_has(s, CS184_TURNED_LAMP); l++)
        if (s->lights[l].kind == LIGHT_TRIANGLES)
            turn_lamp(s, &s->lights[l]);
    for (uint32_t m = 0; m < s->num_materials && starter_has(s, CS184_BECKMANN); m++)
        if (s->materials[m].microfacet == MICROFACET_BECKMANN)
            s->materials[m].microfacet = MICROFACET_BECKMANN_STARTER;
}
