#include "bug_images.h"
#include "submit_codes.h"

#include "renderer/base/fs.h"
#include "renderer/image/tone.h"
#include "tests/support/test.h"

#include <gsl/gsl_randist.h>

/* The first of the three values of pixel p's cell; the variance of a pixel of one image. */
static int value_at(const struct view *v, size_t p)
{
    size_t cell = (size_t)v->correct.cell, width = (size_t)v->width;
    return 3 * (int)(p / width / cell * (size_t)v->correct.columns + p % width / cell);
}

static double variance_at(const struct view *v, int spp, int i)
{
    return v->correct.var[i] * v->correct.n / spp;
}

/* Flat cells, so that cells of the reference are those of the catalogue. */
static bool make_answer(const struct view *v, const struct rubric_image *p, double growth,
                        struct moments *m)
{
    struct err e;
    if (!moments_alloc(m, p->width, p->height, &e))
        return false;
    for (size_t i = 0; i < 3 * (size_t)p->width * (size_t)p->height; i++) {
        int at = value_at(v, i / 3) + (int)(i % 3);
        double n = p->reference_spp, x = (double)(at / 3 % v->correct.columns) / v->correct.columns;
        m->n[i / 3] = n;
        m->mean[i] = v->correct.mean[at] * (1 + growth * x);
        m->m2[i] = variance_at(v, p->spp, at) * p->spp * (n - 1);
    }
    return true;
}

/* With the deviations of a set: as the catalogue has it, else brighter from left to right; empty where they change nothing. */
static bool make_answer_of(const struct rubric *r, const struct catalogue *c, int set, int image,
                           struct moments *m)
{
    char name[128], key[65];
    struct err e;
    const struct rubric_image *p = &r->image[image];
    if (!rubric_bugs_measures(r, set))
        return make_answer(catalogue_view(c, p->name), p, 0.3, m);
    if (!rubric_bugs_key(r, set, image, name, key, &e))
        return false;
    const struct view *v = catalogue_view(c, name);
    return v == NULL || make_answer(v, p, 0, m);
}

bool bug_images_start(struct bug_images *b, const char *rubric)
{
    struct rubric_mistakes mistakes;
    struct catalogue c;
    struct err e;
    *b = (struct bug_images){.rng = gsl_rng_alloc(gsl_rng_mt19937),
                             .rubric = calloc(1, sizeof *b->rubric),
                             .answers = calloc(1, sizeof *b->answers)};
    gsl_rng_set(b->rng, 20261121);
    if (b->rubric == NULL || b->answers == NULL || !suite_load("reference/scenes", &b->suite, &e) ||
        !rubric_read(rubric, &b->suite, 0, b->rubric, &mistakes, &e) || mistakes.num > 0 ||
        !catalogue_read(fs_path("%s/%s", b->rubric->dir, b->rubric->bugs).s, &c, &e))
        return false;
    bool ok = true;
    for (int i = 0; i < b->rubric->num_images; i++) {
        const struct rubric_image *p = &b->rubric->image[i];
        const struct view *v = catalogue_view(&c, p->name);
        for (int k = 0; ok && v != NULL && k < b->rubric->num_sets; k++)
            ok = make_answer_of(b->rubric, &c, k, i, &b->answers->of[k][i].m);
        ok = ok && (v == NULL || make_answer(v, p, 0, &b->answers->of[0][i].noise));
    }
    catalogue_free(&c);
    return ok && rubric_bugs_open(b->rubric, b->answers, &b->bugs, &e);
}

void bug_images_end(struct bug_images *b)
{
    rubric_bugs_close(&b->bugs);
    answer_key_free(b->answers);
    free(b->answers);
    free(b->rubric);
    suite_free(&b->suite);
    gsl_rng_free(b->rng);
}

int bug_images_number(const struct bug_images *b, const char *name)
{
    int bug = catalogue_bug(&b->bugs.catalogue, name);
    if (bug < 0)
        fail_msg("no bug '%s'", name);
    return bug;
}

/* What one or two bugs make of a value. */
static double wrong_value(const struct bug_images *of, const struct view *v, int bug, int second,
                          int at)
{
    const struct effect *a = bug >= 0 ? v->effect[bug] : NULL,
                        *b = second >= 0 ? v->effect[second] : NULL;
    double c = v->correct.mean[at], x = a != NULL ? (double)a->mean[at] : 0,
           y = b != NULL ? (double)b->mean[at] : 0;
    return x == 0 || y == 0 ? c + x + y : fmax(0, c + x + y + (1 - of->apart) * x * y / c);
}

struct submitted_images *bug_images_hand_in(const struct bug_images *b, int set, int bug,
                                            int second, double noise)
{
    static uint8_t rgb8[3 * 128 * 96];
    struct submitted_images *h = calloc(1, sizeof *h);
    assert_non_null(h);
    h->can_buy = true; /* what is too noisy costs nothing yet */
    for (int i = 0; i < b->rubric->num_images; i++) {
        const struct rubric_image *p = &b->rubric->image[i];
        if (b->bugs.view[set][i] < 0)
            continue;
        const struct view *v = &b->bugs.catalogue.view[b->bugs.view[set][i]];
        for (size_t k = 0; k < 3 * (size_t)p->width * (size_t)p->height; k++) {
            int at = value_at(v, k / 3) + (int)(k % 3);
            double mean = wrong_value(b, v, bug, second, at), right = v->correct.mean[at];
            double sd = sqrt(noise * variance_at(v, p->spp, at));
            if (mean < right) /* what is darker is less noisy */
                sd *= fmax(0, mean / right);
            rgb8[k] = tone_map(TONE_CGL, fmax(0, mean + gsl_ran_gaussian(b->rng, sd)));
        }
        h->image[i] = submit_codes(rgb8, p->width, p->height);
    }
    return h;
}

void bug_images_take_back(const struct bug_images *b, struct submitted_images *h)
{
    for (int i = 0; i < b->rubric->num_images; i++)
        submitted_image_free(&h->image[i]);
    free(h);
}
