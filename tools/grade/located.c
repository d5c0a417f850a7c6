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

/* Facts about an image, the most specific first. */
static const char *const facts[] = {
    "only by uniform directions (-H)",
    "only with adaptive sampling (-a)",
    "only through the lens (-b, -d)",
    "only in light of the surroundings",
    "only in scenes with glass",
    "only in scenes with a mirror",
    "only in scenes with rough metal",
    "only in light that bounced off two surfaces first",
    "only in light that bounced off a surface first",
    "only in light that a surface reflects: what shines by itself is right",
};
enum { NUM_FACTS_HERE = sizeof facts / sizeof *facts };

/* Which facts hold for an image of this scene. */
static void look(const struct rubric_image *p, const char *scene, bool holds[NUM_FACTS_HERE])
{
    const bool is[NUM_FACTS_HERE] = {
        has_word(p->options, "-H"),
        rubric_is_adaptive(p),
        has_word(p->options, "-b"),
        p->environment[0] != '\0',
        strstr(scene, "<glass") != NULL || strstr(scene, "<refraction") != NULL,
        strstr(scene, "<mirror") != NULL,
        strstr(scene, "<microfacet") != NULL,
        p->bounces >= 3,
        p->bounces >= 2,
        p->bounces >= 1,
    };
    memcpy(holds, is, sizeof is);
}

/* The text of the image's scene, which the caller frees; "" if it cannot be read, NULL out of
 * memory. */
static char *read_scene(const struct rubric *r, const struct rubric_image *p)
{
    enum { MOST = 1 << 22 };
    char *text = calloc(MOST, 1);
    FILE *f = text != NULL ? fopen(rubric_scene(r, p).s, "r") : NULL;
    if (f != NULL) {
        text[fread(text, 1, MOST - 1, f)] = '\0';
        fclose(f);
    }
    return text;
}

enum state { NOT_KNOWN, RIGHT, WRONG };

/* A right adaptive image proves nothing, as the stopping rule is biased: its state stays
 * NOT_KNOWN. */
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

struct located located_by(const struct grading *g, const double *share)
{
    enum state state[RUBRIC_IMAGES] = {NOT_KNOWN};
    bool holds[NUM_FACTS_HERE], here[NUM_FACTS_HERE];
    struct located out = {.image = -1};
    int right = 0, wrong = 0, black = 0;
    memset(holds, true, sizeof holds);
    find_states(g->r, g->h, share, state);
    for (int i = 0; i < g->r->num_images; i++) {
        if (state[i] == NOT_KNOWN)
            continue;
        right += state[i] == RIGHT;
        wrong += state[i] == WRONG;
        black += submitted_image_is_black(&g->h->image[i]);
        out.image = state[i] == WRONG && out.image < 0 ? i : out.image;
        char *scene = read_scene(g->r, &g->r->image[i]);
        if (scene != NULL)
            look(&g->r->image[i], scene, here);
        for (int f = 0; scene != NULL && f < NUM_FACTS_HERE; f++)
            holds[f] = holds[f] && here[f] == (state[i] == WRONG);
        free(scene);
    }
    if (wrong == 0)
        return out;
    for (int f = NUM_FACTS_HERE - 1; right > 0 && f >= 0; f--)
        if (holds[f])
            snprintf(out.text, sizeof out.text, "%s", facts[f]);
    if (right == 0)
        snprintf(
            out.text, sizeof out.text, "%s",
            black == wrong
                ? "in every image, and all are black: rays hit nothing, or a variable is "
                  "used before it is set"
                : "in every image: the camera, the geometry, the lights or the files themselves");
    else if (out.text[0] == '\0')
        snprintf(out.text, sizeof out.text, "in %d of %d images, '%.47s' the first of them", wrong,
                 right + wrong, g->r->image[out.image].name);
    return out;
}
