#include "claim_traits.h"

#include "reference/suite/features.h"
#include "reference/suite/suite.h"
#include "renderer/shading/light.h"
#include "tools/results/noise_results.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    TRAIT_SPECULAR = NUM_FEATURES,
    TRAIT_BOUNDARY,
    TRAIT_ROUGH,
    TRAIT_CONDUCTOR,
    TRAIT_LAMP_TRIANGLES,
    TRAIT_LAMP_SPHERE,
    TRAIT_POINTLIKE,
    TRAIT_DELTA_LIGHT,
    TRAIT_SKY_IMAGE,
    TRAIT_SEVERAL_LIGHTS,
    TRAIT_CHOSEN_LIGHTS,
    TRAIT_TRIANGLES,
    TRAIT_MANY_TRIANGLES,
    TRAIT_BOUNCED,
    TRAIT_DEEP,
    TRAIT_NOT_SQUARE,
    TRAIT_PART_TILES,
    TRAIT_ROTATE,
    TRAIT_SCALE,
    TRAIT_LOOKAT,
    NUM_FIXED,
    MANY_TRIANGLES = 1000,
    TILE_SIDE = 16
};

/* Texts of the traits that are not features. */
static const char *const trait_texts[NUM_FIXED] = {
    [TRAIT_SPECULAR] = "a mirror, glass or refraction",
    [TRAIT_BOUNDARY] = "glass or refraction",
    [TRAIT_ROUGH] = "rough metal",
    [TRAIT_CONDUCTOR] = "a metal's index of refraction",
    [TRAIT_LAMP_TRIANGLES] = "glowing triangles",
    [TRAIT_LAMP_SPHERE] = "glowing spheres",
    [TRAIT_POINTLIKE] = "a point or spot light",
    [TRAIT_DELTA_LIGHT] = "a point, spot or directional light",
    [TRAIT_SKY_IMAGE] = "an image of the sky",
    [TRAIT_SEVERAL_LIGHTS] = "several lights",
    [TRAIT_CHOSEN_LIGHTS] = "so many lights that one is chosen",
    [TRAIT_TRIANGLES] = "triangles",
    [TRAIT_MANY_TRIANGLES] = "many triangles",
    [TRAIT_BOUNCED] = "light of more than one bounce",
    [TRAIT_DEEP] = "light of more than two bounces",
    [TRAIT_NOT_SQUARE] = "an image that is not square",
    [TRAIT_PART_TILES] = "sides that are no multiple of 16",
    [TRAIT_ROTATE] = "<rotate> in its file",
    [TRAIT_SCALE] = "<scale> in its file",
    [TRAIT_LOOKAT] = "<lookat> in its file",
};

/* The features that make up each class. */
static const struct {
    int trait;
    unsigned of;
} classes[] = {
    {TRAIT_SPECULAR, FEATURES_SPECULAR},
    {TRAIT_BOUNDARY, FEATURES_BOUNDARY},
    {TRAIT_ROUGH, FEATURES_ROUGH_METAL},
    {TRAIT_POINTLIKE, 1u << FEATURE_POINT | 1u << FEATURE_SPOT},
    {TRAIT_DELTA_LIGHT, 1u << FEATURE_POINT | 1u << FEATURE_SPOT | 1u << FEATURE_DIRECTIONAL},
};

static uint64_t bit(int trait)
{
    return (uint64_t)1 << trait;
}

/* The bit of a reference or a side, a new one if need be; 0 without a name or once all bits are used. */
static uint64_t named_trait(struct traits *t, const char *what, const char *name)
{
    char full[sizeof *t->name];
    if (name == NULL)
        return 0;
    snprintf(full, sizeof full, "%s %s", what, name);
    for (int i = NUM_FIXED; i < t->num; i++)
        if (strcmp(t->name[i], full) == 0)
            return bit(i);
    if (t->num == MAX_TRAITS)
        return 0;
    strcpy(t->name[t->num], full);
    return bit(t->num++);
}

static bool file_traits(const char *path, uint64_t *bits, struct err *e)
{
    static const struct {
        int trait;
        const char *word;
    } words[] = {{TRAIT_ROTATE, "<rotate"}, {TRAIT_SCALE, "<scale"}, {TRAIT_LOOKAT, "<lookat"}};
    char line[4096];
    FILE *f = fopen(path, "r");
    if (f == NULL)
        return err_set(e, "%s: cannot read", path);
    while (fgets(line, sizeof line, f) != NULL)
        for (size_t i = 0; i < sizeof words / sizeof *words; i++)
            *bits |= strstr(line, words[i].word) != NULL ? bit(words[i].trait) : 0;
    fclose(f);
    return true;
}

static bool scene_traits(const struct suite_scene *s, uint64_t *bits, struct err *e)
{
    struct scene scene;
    struct camera camera;
    *bits = s->width != s->height ? bit(TRAIT_NOT_SQUARE) : 0;
    if (s->is_opaque)
        return true;
    if (!suite_open(s, &scene, &camera, e))
        return false;
    const unsigned features = features_of_scene(&scene, &camera);
    *bits = features | (features & 1u << FEATURE_TWO_SIDED ? bit(FEATURE_AREA) : 0);
    for (size_t i = 0; i < sizeof classes / sizeof *classes; i++)
        *bits |= features & classes[i].of ? bit(classes[i].trait) : 0;
    for (uint32_t i = 0; i < scene.num_materials; i++)
        *bits |= scene.materials[i].conductor ? bit(TRAIT_CONDUCTOR) : 0;
    for (uint32_t i = 0; i < scene.num_lights; i++) {
        enum light_kind kind = scene.lights[i].kind;
        *bits |= kind == LIGHT_TRIANGLES ? bit(TRAIT_LAMP_TRIANGLES)
                 : kind == LIGHT_SPHERE  ? bit(TRAIT_LAMP_SPHERE)
                                         : 0;
    }
    const struct {
        int trait;
        bool is;
    } more[] = {
        {TRAIT_SKY_IMAGE, s->environment[0] != '\0'},
        {TRAIT_SEVERAL_LIGHTS, scene.num_lights > 1},
        {TRAIT_CHOSEN_LIGHTS, scene.num_lights > MANY_LIGHTS},
        {TRAIT_TRIANGLES, scene.num_triangles > 0},
        {TRAIT_MANY_TRIANGLES, scene.num_triangles > MANY_TRIANGLES},
        {TRAIT_BOUNCED, s->depth > 1},
        {TRAIT_DEEP, s->depth > 2},
        {TRAIT_NOT_SQUARE, s->width != s->height},
        {TRAIT_PART_TILES, s->width % TILE_SIDE != 0 || s->height % TILE_SIDE != 0},
    };
    for (size_t i = 0; i < sizeof more / sizeof *more; i++)
        *bits |= more[i].is ? bit(more[i].trait) : 0;
    scene_free(&scene);
    return file_traits(s->dae, bits, e);
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

/* If any row differs, appends all of them to `all` as claims of the side PROGRAM-KIND, the program being member
 * `key`. */
static void add_sides(json_t *all, const json_t *rows, const char *key, const char *kind)
{
    bool differs = false;
    json_each(c, rows)
        differs = differs || is_verdict(c, "verdict", VERDICT_DIFFERENT);
    if (!differs)
        return;
    json_each(c, rows) {
        char side[160];
        snprintf(side, sizeof side, "%s-%s", member_text(c, key), kind);
        json_array_append_new(all,
                              json_pack("{ss,ss,ss,ss*}", "scene", member_text(c, "scene"), "a",
                                        side, "expected", verdict_name(VERDICT_EQUIVALENT),
                                        "verdict", member_text(c, "verdict")));
    }
}

/* The claims, with those made of stated errors and of noise. A new reference. */
static json_t *all_claims(const json_t *results)
{
    json_t *all = json_array(), *noise = noise_results_claims(json_object_get(results, "noise"));
    json_array_extend(all, json_object_get(results, "claims"));
    add_sides(all, json_object_get(results, "consistency"), "engine", "consistency");
    add_sides(all, noise, "a", "noise");
    json_decref(noise);
    return all;
}

/* Is one the program of the other, as "pathtracer" of "pathtracer-adaptive"? */
static bool same_program(const char *a, const char *b)
{
    const size_t n = strcspn(a, "-");
    return strcspn(b, "-") == n && strncmp(a, b, n) == 0;
}

/* The program with most claims that wrongly differ, or a variant of it; "": none. */
static const char *accused(const json_t *claims)
{
    const char *best = "";
    int most = 0;
    json_each(c, claims) {
        const char *a = member_text(c, "a");
        if (a == NULL)
            continue;
        int num = 0;
        json_each(other, claims) {
            const char *b = member_text(other, "a");
            num += b != NULL && is_wrongly_different(other) && same_program(a, b);
        }
        if (num > most) {
            most = num;
            best = a;
        }
    }
    return best;
}

static bool collect(const struct suite *suite, struct traits *t, struct err *e)
{
    const struct suite_scene *last = NULL;
    uint64_t bits = 0;
    const char *program = accused(t->json);
    json_each(c, t->json) {
        const struct suite_scene *s = suite_find(suite, member_text(c, "scene"));
        const char *a = member_text(c, "a");
        bool differs = is_verdict(c, "verdict", VERDICT_DIFFERENT);
        if (s == NULL || a == NULL || !is_verdict(c, "expected", VERDICT_EQUIVALENT) ||
            (!differs && !is_verdict(c, "verdict", VERDICT_EQUIVALENT)) ||
            !same_program(a, program))
            continue;
        if (s != last && !scene_traits(s, &bits, e))
            return false;
        last = s;
        t->claim[t->num_claims++] =
            (struct claim_traits){.bits = bits | named_trait(t, "the side", a) |
                                          named_trait(t, "the reference", member_text(c, "b")),
                                  .differs = differs,
                                  .scene = member_text(c, "scene"),
                                  .a = a};
        t->num_differ += differs;
    }
    for (int i = 0; i < t->num_claims; i++) {
        int same = 0;
        for (int k = 0; k < t->num_claims; k++)
            same += strcmp(t->claim[i].scene, t->claim[k].scene) == 0 &&
                    strcmp(t->claim[i].a, t->claim[k].a) == 0;
        t->claim[i].weight = 1.0 / same;
    }
    return true;
}

bool claim_traits_collect(const json_t *results, const char *suite_dir, struct traits *out,
                          struct err *e)
{
    struct suite suite = {0};
    bool differs = false;
    *out = (struct traits){.num = NUM_FIXED, .json = all_claims(results)};
    for (size_t i = 0; i < json_array_size(out->json); i++)
        differs = differs || is_wrongly_different(json_array_get(out->json, i));
    if (!differs)
        return true;
    for (int i = 0; i < NUM_FIXED; i++)
        strcpy(out->name[i], i < NUM_FEATURES ? feature_texts[i] : trait_texts[i]);
    out->claim = calloc(json_array_size(out->json), sizeof *out->claim);
    bool ok = (out->claim != NULL || err_set(e, "out of memory")) &&
              suite_load(suite_dir, &suite, e) && collect(&suite, out, e);
    suite_free(&suite);
    if (!ok)
        claim_traits_free(out);
    return ok;
}

void claim_traits_free(struct traits *t)
{
    free(t->claim);
    json_decref(t->json);
    *t = (struct traits){0};
}
