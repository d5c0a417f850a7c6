#include "shared_features.h"

#include "claim_traits.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MOST_KEPT = 16, MOST_TOLD = 3, MOST_NAMED = 6, FEW_SCENES = 6 };

/* The largest ratio of likelihoods at which a less likely place is still reported. */
static const double tie = 20;
/* Probability that a claim without the trait differs. */
static const double astray = 1e-3;

/* A place where the mistake may be: all claims with one trait or two (bits); none: all claims. */
struct place {
    uint64_t bits;
    double log_likelihood;
};

static uint64_t bit(int trait)
{
    return (uint64_t)1 << trait;
}

static bool has(const struct claim_traits *c, uint64_t bits)
{
    return (c->bits & bits) == bits;
}

/* Log of prior times marginal likelihood. A claim of the place differs with an unknown probability, uniform on [0,
 * 1] and integrated out; any other with probability `astray`. Prior: about one over the number of places of as many
 * traits. */
static double log_likelihood(const struct traits *t, uint64_t bits, int num_traits)
{
    double differ = 0, all = 0, outside = 0;
    for (int i = 0; i < t->num_claims; i++) {
        const struct claim_traits *c = &t->claim[i];
        double w = c->weight;
        all += has(c, bits) ? w : 0;
        differ += has(c, bits) && c->differs ? w : 0;
        outside += !has(c, bits) && c->differs ? w : 0;
    }
    return lgamma(differ + 1) + lgamma(all - differ + 1) - lgamma(all + 2) + outside * log(astray) -
           num_traits * log(t->num);
}

/* Inserts p into the list of the likeliest places, sorted. */
static void keep(struct place best[MOST_KEPT], struct place p)
{
    for (int i = 0; i < MOST_KEPT; i++)
        if (p.log_likelihood > best[i].log_likelihood) {
            struct place swap = best[i];
            best[i] = p;
            p = swap;
        }
}

static void find_places(const struct traits *t, struct place best[MOST_KEPT])
{
    for (int i = 0; i < MOST_KEPT; i++)
        best[i].log_likelihood = -INFINITY;
    keep(best, (struct place){0, log_likelihood(t, 0, 0)});
    for (int i = 0; i < t->num; i++)
        for (int k = 0; k <= i; k++) {
            uint64_t bits = bit(i) | bit(k);
            keep(best, (struct place){bits, log_likelihood(t, bits, i == k ? 1 : 2)});
        }
}

static void name_place(const struct traits *t, uint64_t bits, FILE *to)
{
    const char *between = "";
    for (int i = 0; i < t->num; i++)
        if (bits & bit(i)) {
            fprintf(to, "%s%s", between, t->name[i]);
            between = " with ";
        }
}

/* Counts the claims of a place that differ and that agree. */
static void count(const struct traits *t, uint64_t bits, int *differ, int *agree)
{
    *differ = *agree = 0;
    for (int i = 0; i < t->num_claims; i++) {
        *differ += t->claim[i].differs && has(&t->claim[i], bits);
        *agree += !t->claim[i].differs && has(&t->claim[i], bits);
    }
}

static void name_scenes(const struct traits *t, FILE *to)
{
    const char *last = "", *between = " Scenes: ";
    int num = 0;
    for (int i = 0; i < t->num_claims; i++) {
        const struct claim_traits *c = &t->claim[i];
        if (!c->differs || strcmp(c->scene, last) == 0)
            continue;
        last = c->scene;
        if (++num <= MOST_NAMED)
            fprintf(to, "%s%s", between, c->scene);
        between = ", ";
    }
    if (num > MOST_NAMED)
        fprintf(to, " and %d more", num - MOST_NAMED);
    fprintf(to, ".");
}

static void tell_place(const struct traits *t, uint64_t bits, FILE *to)
{
    int all = t->num_claims - t->num_differ, differ, agree;
    count(t, bits, &differ, &agree);
    if (differ < t->num_differ)
        fprintf(to, "Of the %d claims that differ %d have ", t->num_differ, differ);
    else if (differ == 1)
        fprintf(to, "The claim that differs has ");
    else
        fprintf(to, "All %d claims that differ have ", differ);
    name_place(t, bits, to);
    if (agree == 0)
        fprintf(to, "; none of the %d that agree has.", all);
    else
        fprintf(to, "; %d of the %d that agree have, too.", agree, all);
}

static int num_scenes(const struct traits *t)
{
    int num = 0;
    for (int i = 0; i < t->num_claims; i++)
        num += i == 0 || strcmp(t->claim[i].scene, t->claim[i - 1].scene) != 0;
    return num;
}

/* The one scene whose claims differ; NULL if there are more. */
static const char *only_scene(const struct traits *t)
{
    const char *scene = NULL;
    for (int i = 0; i < t->num_claims; i++) {
        if (!t->claim[i].differs)
            continue;
        if (scene != NULL && strcmp(scene, t->claim[i].scene) != 0)
            return NULL;
        scene = t->claim[i].scene;
    }
    return scene;
}

static void tell(const struct traits *t, FILE *to)
{
    struct place best[MOST_KEPT];
    find_places(t, best);
    const char *only = only_scene(t);
    if (best[0].bits == 0 && num_scenes(t) < FEW_SCENES)
        return;
    if (best[0].bits == 0 && t->num_differ == t->num_claims)
        fprintf(
            to,
            "Every claim differs, all %d: look at what all scenes need, such as the camera, the "
            "loader, the film.",
            t->num_claims);
    else if (best[0].bits == 0 && only != NULL) {
        fprintf(to,
                "Only %s differs, although scenes that agree have each thing that it has: look at "
                "what it has together, and at what its description says.",
                only);
        return;
    } else if (best[0].bits == 0)
        fprintf(
            to,
            "The %d claims that differ have nothing in common that the %d that agree lack: several "
            "mistakes, or one in what all scenes need (camera, loader, film). Begin with the first.",
            t->num_differ, t->num_claims - t->num_differ);
    if (best[0].bits == 0) {
        name_scenes(t, to);
        return;
    }
    tell_place(t, best[0].bits, to);
    int told = 1;
    for (int i = 1; i < MOST_KEPT && told <= MOST_TOLD &&
                    best[0].log_likelihood - best[i].log_likelihood <= log(tie);
         i++) {
        int differ, agree;
        count(t, best[i].bits, &differ, &agree);
        /* Skip a part of the best place, unless it excludes all claims that agree. */
        if ((best[i].bits & best[0].bits) == best[0].bits && agree > 0)
            continue;
        fputs(told++ == 1 ? " Nearly as likely: " : "; or ", to);
        if (told > MOST_TOLD) {
            fprintf(to, "others");
            break;
        }
        if (best[i].bits == 0) {
            fprintf(to, "nothing that they share");
            continue;
        }
        name_place(t, best[i].bits, to);
        fprintf(to, " (%d of those that differ, %d of the others)", differ, agree);
    }
    fputs(told > 1 ? "." : "", to);
    name_scenes(t, to);
}

bool shared_features_tell(const json_t *results, const char *suite_dir, char *text, size_t size,
                          struct err *e)
{
    struct traits t;
    memset(text, 0, size);
    if (!claim_traits_collect(results, suite_dir, &t, e))
        return false;
    FILE *to = t.num_differ > 0 ? fmemopen(text, size - 1, "w") : NULL;
    bool ok = to != NULL || t.num_differ == 0 || err_set(e, "out of memory");
    if (to != NULL) {
        tell(&t, to);
        fclose(to); /* what does not fit is left out */
    }
    claim_traits_free(&t);
    return ok;
}
