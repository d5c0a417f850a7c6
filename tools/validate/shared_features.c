#include "shared_features.h"

#include "reference/suite/features.h"
#include "reference/suite/suite.h"
#include "tools/results/results.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    TRAIT_BOUNCED = NUM_FEATURES,
    TRAIT_SEVERAL_LIGHTS,
    TRAIT_MANY_TRIANGLES,
    TRAIT_NOT_SQUARE,
    NUM_FIXED,
    MAX_TRAITS = 64,
    MANY_TRIANGLES = 1000,
    MOST_TOLD = 3
};

static const char *const fixed_names[NUM_FIXED] = {
    [FEATURE_DIFFUSE] = "matt surfaces",
    [FEATURE_MIRROR] = "a mirror",
    [FEATURE_GLASS] = "glass",
    [FEATURE_REFRACTION] = "a boundary that only refracts",
    [FEATURE_SCHLICK] = "glass by Schlick's approximation",
    [FEATURE_MICROFACET] = "rough metal (GGX)",
    [FEATURE_BECKMANN] = "rough metal (Beckmann)",
    [FEATURE_AREA] = "glowing surfaces",
    [FEATURE_TWO_SIDED] = "surfaces that glow on both sides",
    [FEATURE_POINT] = "a point light",
    [FEATURE_SPOT] = "a spot light",
    [FEATURE_FALLOFF] = "a light without inverse square falloff",
    [FEATURE_DIRECTIONAL] = "a directional light",
    [FEATURE_ENVIRONMENT] = "a sky",
    [FEATURE_SPHERE] = "spheres",
    [FEATURE_SMOOTH] = "shading normals",
    [FEATURE_LENS] = "a lens",
    [FEATURE_CLIP] = "a near or far plane",
    [TRAIT_BOUNCED] = "light of more than one bounce",
    [TRAIT_SEVERAL_LIGHTS] = "several lights",
    [TRAIT_MANY_TRIANGLES] = "many triangles",
    [TRAIT_NOT_SQUARE] = "an image that is not square",
};

struct claim_traits {
    uint64_t bits;
    bool differs;
};

struct traits {
    char name[MAX_TRAITS][128];
    int num;
    struct claim_traits *claim;
    int num_claims, num_differ;
};

static uint64_t bit(int trait)
{
    return (uint64_t)1 << trait;
}

/* Of a reference or a variant. Those beyond the last that has room are not told apart. */
static uint64_t named_trait(struct traits *t, const char *what, const char *name)
{
    char full[sizeof *t->name];
    snprintf(full, sizeof full, "%s %s", what, name);
    for (int i = NUM_FIXED; i < t->num; i++)
        if (strcmp(t->name[i], full) == 0)
            return bit(i);
    if (t->num == MAX_TRAITS)
        return 0;
    strcpy(t->name[t->num], full);
    return bit(t->num++);
}

static bool scene_traits(const struct suite_scene *s, uint64_t *bits, struct err *e)
{
    struct scene scene;
    struct camera camera;
    if (!suite_open(s, &scene, &camera, e))
        return false;
    *bits = features_of_scene(&scene, &camera);
    *bits |= s->depth > 1 ? bit(TRAIT_BOUNCED) : 0;
    *bits |= scene.num_lights > 1 ? bit(TRAIT_SEVERAL_LIGHTS) : 0;
    *bits |= scene.num_triangles > MANY_TRIANGLES ? bit(TRAIT_MANY_TRIANGLES) : 0;
    *bits |= s->width != s->height ? bit(TRAIT_NOT_SQUARE) : 0;
    scene_free(&scene);
    return true;
}

static bool is_verdict(const json_t *claim, const char *member, enum verdict v)
{
    const char *text = member_text(claim, member);
    return text != NULL && strcmp(text, verdict_name(v)) == 0;
}

static bool is_wrongly_different(const json_t *claim)
{
    return is_verdict(claim, "expected", VERDICT_EQUIVALENT) &&
           is_verdict(claim, "verdict", VERDICT_DIFFERENT);
}

static bool collect(const json_t *claims, const struct suite *suite, struct traits *t,
                    struct err *e)
{
    const struct suite_scene *last = NULL;
    uint64_t bits = 0;
    for (size_t i = 0; i < json_array_size(claims); i++) {
        const json_t *c = json_array_get(claims, i);
        const struct suite_scene *s = suite_find(suite, member_text(c, "scene"));
        bool differs = is_verdict(c, "verdict", VERDICT_DIFFERENT);
        if (s == NULL || !is_verdict(c, "expected", VERDICT_EQUIVALENT) ||
            (!differs && !is_verdict(c, "verdict", VERDICT_EQUIVALENT)))
            continue;
        if (s != last && !scene_traits(s, &bits, e))
            return false;
        last = s;
        t->claim[t->num_claims++] =
            (struct claim_traits){bits | named_trait(t, "the side", member_text(c, "a")) |
                                      named_trait(t, "the reference", member_text(c, "b")),
                                  differs};
        t->num_differ += differs;
    }
    return true;
}

/* Of the claims that agree, how many have all of these; -1 if a claim that differs lacks one. */
static int agreeing(const struct traits *t, uint64_t bits)
{
    int num = 0;
    for (int i = 0; i < t->num_claims; i++) {
        bool has = (t->claim[i].bits & bits) == bits;
        if (t->claim[i].differs && !has)
            return -1;
        num += !t->claim[i].differs && has;
    }
    return num;
}

/* Single features, or pairs, of all that differ: the first few of those that fewest of the others have. Returns how many
 * there are. */
static int find_rarest(const struct traits *t, bool pairs, uint64_t found[MOST_TOLD], int *others)
{
    int num = 0;
    *others = t->num_claims - t->num_differ;
    for (int i = 0; i < t->num; i++)
        for (int k = pairs ? 0 : i; pairs ? k < i : k == i; k++) {
            int n = agreeing(t, bit(i) | bit(k));
            if (n < 0 || n > *others)
                continue;
            if (n < *others)
                num = 0;
            *others = n;
            if (num < MOST_TOLD)
                found[num] = bit(i) | bit(k);
            num++;
        }
    return num;
}

static void name_traits(const struct traits *t, uint64_t bits, char *text, size_t size)
{
    size_t used = strlen(text);
    const char *between = "";
    for (int i = 0; i < t->num; i++)
        if (bits & bit(i) && used < size) {
            used += (size_t)snprintf(text + used, size - used, "%s%s", between, t->name[i]);
            between = " with ";
        }
}

static void tell(const struct traits *t, char *text, size_t size)
{
    uint64_t found[MOST_TOLD], pair[MOST_TOLD];
    int all = t->num_claims - t->num_differ, others, of_pairs;
    int num = find_rarest(t, false, found, &others), pairs = find_rarest(t, true, pair, &of_pairs);
    if (pairs > 0 && of_pairs < others) {
        memcpy(found, pair, sizeof found);
        num = pairs;
        others = of_pairs;
    }
    if (num == 0 || 2 * others >= all) {
        snprintf(
            text, size,
            "The claims that differ have nothing in common that those that agree lack: look at "
            "what all scenes need, such as the camera, the loader, the film.");
        return;
    }
    if (t->num_differ == 1)
        snprintf(text, size, "The claim that differs has ");
    else
        snprintf(text, size, "All %d claims that differ have ", t->num_differ);
    for (int i = 0; i < num && i < MOST_TOLD; i++) {
        if (i > 0)
            strncat(text, ", and ", size - strlen(text) - 1);
        name_traits(t, found[i], text, size);
    }
    size_t used = strlen(text);
    if (others == 0)
        snprintf(text + used, size - used, "; none of the %d that agree has.", all);
    else
        snprintf(text + used, size - used, "; %d of the %d that agree have, too.", others, all);
}

bool shared_features_tell(const json_t *results, const char *suite_dir, char *text, size_t size,
                          struct err *e)
{
    const json_t *claims = json_object_get(results, "claims");
    struct traits t = {.num = NUM_FIXED};
    struct suite suite = {0};
    bool differs = false;
    *text = '\0';
    for (size_t i = 0; i < json_array_size(claims); i++)
        differs = differs || is_wrongly_different(json_array_get(claims, i));
    if (!differs)
        return true;
    for (int i = 0; i < NUM_FIXED; i++)
        strcpy(t.name[i], fixed_names[i]);
    t.claim = calloc(json_array_size(claims), sizeof *t.claim);
    bool ok = (t.claim != NULL || err_set(e, "out of memory")) &&
              suite_load(suite_dir, &suite, e) && collect(claims, &suite, &t, e);
    if (ok && t.num_differ > 0)
        tell(&t, text, size);
    suite_free(&suite);
    free(t.claim);
    return ok;
}
