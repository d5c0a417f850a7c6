#include "located.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Is it one of the words? */
static bool has_word(const char *words, const char *word)
{
    size_t n = strlen(word);
    for (const char *at = words; (at = strstr(at, word)) != NULL; at += n)
        if ((at == words || at[-1] == ' ') && (at[n] == '\0' || at[n] == ' '))
            return true;
    return false;
}

static bool is_hemisphere(const struct rubric_image *p, const char *scene)
{
    (void)scene;
    return has_word(p->options, "-H");
}

static bool is_adaptive(const struct rubric_image *p, const char *scene)
{
    (void)scene;
    return rubric_is_adaptive(p);
}

static bool is_lens(const struct rubric_image *p, const char *scene)
{
    (void)scene;
    return has_word(p->options, "-b");
}

static bool has_sky(const struct rubric_image *p, const char *scene)
{
    (void)scene;
    return p->environment[0] != '\0';
}

static bool has_glass(const struct rubric_image *p, const char *scene)
{
    (void)p;
    return strstr(scene, "<glass") != NULL || strstr(scene, "<refraction") != NULL;
}

static bool has_mirror(const struct rubric_image *p, const char *scene)
{
    (void)p;
    return strstr(scene, "<mirror") != NULL;
}

static bool has_microfacet(const struct rubric_image *p, const char *scene)
{
    (void)p;
    return strstr(scene, "<microfacet") != NULL;
}

static bool is_lit(const struct rubric_image *p, const char *scene)
{
    (void)scene;
    return p->bounces >= 1;
}

static bool is_bounced(const struct rubric_image *p, const char *scene)
{
    (void)scene;
    return p->bounces >= 2;
}

static bool is_far(const struct rubric_image *p, const char *scene)
{
    (void)scene;
    return p->bounces >= 3;
}

/* The narrowest first. */
static const struct {
    const char *text;
    bool (*is)(const struct rubric_image *, const char *scene);
} facts[] = {
    {"only by uniform directions (-H)", is_hemisphere},
    {"only with adaptive sampling (-a)", is_adaptive},
    {"only through the lens (-b, -d)", is_lens},
    {"only in light of the surroundings", has_sky},
    {"only in scenes with glass", has_glass},
    {"only in scenes with a mirror", has_mirror},
    {"only in scenes with rough metal", has_microfacet},
    {"only in light that bounced off two surfaces first", is_far},
    {"only in light that bounced off a surface first", is_bounced},
    {"only in light that a surface reflects: what shines by itself is right", is_lit},
};

/* "" where it cannot be read. The caller frees it. */
static char *read_scene(const struct rubric *r, const struct rubric_image *p)
{
    enum { MOST = 1 << 22 };
    char path[8192];
    if (p->suite != NULL)
        snprintf(path, sizeof path, "%s", p->suite->dae);
    else
        snprintf(path, sizeof path, "%s/%s", r->dir, p->scene);
    char *text = calloc(MOST, 1);
    FILE *f = text != NULL ? fopen(path, "r") : NULL;
    if (f != NULL) {
        text[fread(text, 1, MOST - 1, f)] = '\0';
        fclose(f);
    }
    return text;
}

enum state { NOT_KNOWN, RIGHT, WRONG };

/* That an adaptive image is right says little: the rule of stopping is biased. */
static void find_states(const struct rubric *r, const struct submitted_images *h,
                        const double *share, enum state *state)
{
    for (int i = 0; i < r->num_checks; i++) {
        const struct rubric_check *c = &r->check[i];
        int image = c->images[0];
        if ((c->kind != CHECK_EQUAL && c->kind != CHECK_EXACT) || h->image[image].mean == NULL)
            continue;
        if (share[i] < 1)
            state[image] = WRONG;
        else if (!rubric_is_adaptive(&r->image[image]) && state[image] == NOT_KNOWN)
            state[image] = RIGHT;
    }
}

struct located located_by(const struct rubric *r, const struct submitted_images *h,
                          const double *share)
{
    enum { NUM_FACTS_HERE = sizeof facts / sizeof *facts };
    enum state state[RUBRIC_IMAGES] = {NOT_KNOWN};
    bool holds[NUM_FACTS_HERE];
    struct located out = {.image = -1};
    int right = 0, wrong = 0;
    memset(holds, true, sizeof holds);
    find_states(r, h, share, state);
    for (int i = 0; i < r->num_images; i++) {
        if (state[i] == NOT_KNOWN)
            continue;
        right += state[i] == RIGHT;
        wrong += state[i] == WRONG;
        out.image = state[i] == WRONG && out.image < 0 ? i : out.image;
        char *scene = read_scene(r, &r->image[i]);
        for (int f = 0; scene != NULL && f < NUM_FACTS_HERE; f++)
            holds[f] = holds[f] && facts[f].is(&r->image[i], scene) == (state[i] == WRONG);
        free(scene);
    }
    if (wrong == 0)
        return out;
    for (int f = NUM_FACTS_HERE - 1; right > 0 && f >= 0; f--)
        if (holds[f])
            snprintf(out.text, sizeof out.text, "%s", facts[f].text);
    if (right == 0)
        snprintf(out.text, sizeof out.text,
                 "in every image: the camera, the geometry, the lights or the files themselves");
    else if (out.text[0] == '\0')
        snprintf(out.text, sizeof out.text, "in %d of %d images, '%.47s' the first of them", wrong,
                 right + wrong, r->image[out.image].name);
    return out;
}
