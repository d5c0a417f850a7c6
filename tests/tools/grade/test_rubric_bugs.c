/* Bugs named by 8-bit images alone, with the catalogue that ships. Images are made here of what the catalogue says: flat
 * cells of the right mean and of the bug's effect, normal noise of as much as a render of ours has, written as PNG by the
 * assignment's curve and read back. So this is about codes, clipping and noise; what real renders give is measured by
 * make grade-show. */

#include "renderer/image/tone.h"
#include "tools/grade/rubric_bugs.h"
#include "tests/support/test.h"

#include <gsl/gsl_randist.h>

static gsl_rng *rng;
static struct suite suite;
static struct rubric *rubric;
static struct answer_key *answers;
static struct rubric_bugs bugs;

static const struct view *view_of(int image, int set)
{
    char name[128], key[65];
    struct err e;
    MUST(rubric_bugs_key(rubric, image, set, name, key, &e));
    return catalogue_view(&bugs.catalogue, name);
}

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
static void make_answer(const struct view *v, int image, struct moments *m)
{
    const struct rubric_image *p = &rubric->image[image];
    struct err e;
    assert_true(moments_alloc(m, p->width, p->height, &e));
    for (size_t i = 0; i < 3 * (size_t)p->width * (size_t)p->height; i++) {
        int at = value_at(v, i / 3) + (int)(i % 3);
        double n = p->reference_spp;
        m->n[i / 3] = n;
        m->mean[i] = v->correct.mean[at];
        m->m2[i] = variance_at(v, p->spp, at) * p->spp * (n - 1);
    }
}

static int set_up(void **state)
{
    struct rubric_mistakes mistakes;
    struct err e;
    (void)state;
    rng = gsl_rng_alloc(gsl_rng_mt19937);
    gsl_rng_set(rng, 20261121);
    rubric = calloc(1, sizeof *rubric);
    answers = calloc(1, sizeof *answers);
    if (rubric == NULL || answers == NULL || !suite_load("reference/scenes", &suite, &e) ||
        !rubric_read("tools/rubrics/cs184-3-1.rubric", &suite, rubric, &mistakes, &e) ||
        mistakes.num > 0 || !catalogue_read("tools/rubrics/cs184-bugs", &bugs.catalogue, &e))
        return -1;
    for (int k = 0; k < rubric->num_sets; k++)
        for (int i = 0; i < rubric->num_images; i++) {
            /* All deviations together may look like one of them. */
            const struct view *v = view_of(i, k);
            for (int j = 1; j < k && v == NULL && k == rubric->num_sets - 1; j++)
                v = view_of(i, j);
            if (v != NULL)
                make_answer(v, i, &answers->of[k][i].m);
        }
    catalogue_free(&bugs.catalogue);
    return rubric_bugs_open(rubric, answers, &bugs, &e) ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    rubric_bugs_close(&bugs);
    answer_key_free(answers);
    free(answers);
    free(rubric);
    suite_free(&suite);
    gsl_rng_free(rng);
    return 0;
}

/* What one or two bugs (-1: none) make of a value: two that change light by factors multiply. */
static double wrong_value(const struct view *v, int bug, int second, int at)
{
    const struct effect *a = bug >= 0 ? v->effect[bug] : NULL,
                        *b = second >= 0 ? v->effect[second] : NULL;
    double c = v->correct.mean[at], x = a != NULL ? (double)a->mean[at] : 0,
           y = b != NULL ? (double)b->mean[at] : 0;
    return x == 0 || y == 0 ? c + x + y : (c + x) * (c + y) / c;
}

/* Noise: variance over ours. */
static void hand_in(int set, int bug, int second, double noise, struct submitted_images *h)
{
    static uint8_t rgb8[3 * 128 * 96];
    for (int i = 0; i < rubric->num_images; i++) {
        const struct rubric_image *p = &rubric->image[i];
        const char *path = test_path("submitted.png");
        struct err e;
        if (bugs.view[set][i] < 0)
            continue;
        const struct view *v = &bugs.catalogue.view[bugs.view[set][i]];
        for (size_t k = 0; k < 3 * (size_t)p->width * (size_t)p->height; k++) {
            int at = value_at(v, k / 3) + (int)(k % 3);
            double sd = sqrt(noise * variance_at(v, p->spp, at));
            double mean = wrong_value(v, bug, second, at);
            rgb8[k] = tone_map(TONE_CGL, fmax(0, mean + gsl_ran_gaussian(rng, sd)));
        }
        MUST(image_write_png(path, p->width, p->height, rgb8, &e));
        MUST(submitted_image_read(path, rubric->curve, p->width, p->height, &h->image[i], &e));
    }
}

/* without: a bug that is taken to be unknown; NULL: none. */
static struct diagnosis find(int set, int bug, int second, double noise, int graded,
                             const char *without, int *with)
{
    struct submitted_images *h = calloc(1, sizeof *h);
    struct diagnosis found;
    struct err e;
    assert_non_null(h);
    hand_in(set, bug, second, noise, h);
    MUST(rubric_bugs_diagnose(&bugs, rubric, answers, h, graded, 1e-5, without, &found, with, &e));
    for (int i = 0; i < rubric->num_images; i++)
        submitted_image_free(&h->image[i]);
    free(h);
    return found;
}

/* The name of the likeliest, "" if there is none. */
static const char *name(int set, int bug, double noise, int graded, int *with, int *named)
{
    struct diagnosis found = find(set, bug, -1, noise, graded, NULL, with);
    *named = found.num_named;
    return found.num_named > 0 ? bugs.catalogue.bug[found.candidate[0].bug].name : "";
}

/* H0: right programs are told a name with a probability of at most 1e-5 a set. 6 of them, as noisy as ours and 4 times so; and
 * those with the first accepted deviation, which are graded with it. */
TEST(right_images_have_no_name)
{
    for (int k = 0; k < 6; k++) {
        int with, named, set = k % 2;
        const char *bug = name(set, -1, k % 4 < 2 ? 1 : 4, set, &with, &named);
        if (named > 0)
            fail_msg("set %d is said to be %s", set, bug);
    }
}

/* Bugs of all parts, each with its name first; on top of the accepted deviation as well, graded with it or not. */
TEST(bugs_have_their_names)
{
    static const char *const known[] = {
        "cosine_missing", "diffuse_without_pi",      "depth_one_short", "emission_twice",
        "mirror_back",    "metal_without_shadowing", "sphere_far_hit",  "roulette_not_divided"};
    (void)state;
    for (size_t i = 0; i < COUNT(known); i++) {
        int bug = catalogue_bug(&bugs.catalogue, known[i]), with, named;
        assert_true(bug >= 0);
        const char *found = name(0, bug, 1, 0, &with, &named);
        if (strcmp(found, known[i]) != 0 || with != 0)
            fail_msg("%s: '%s', set %d", known[i], found, with);
    }
    for (int graded = 0; graded < 2; graded++) {
        int bug = catalogue_bug(&bugs.catalogue, "indirect_missing"), with, named;
        const char *found = name(1, bug, 1, graded, &with, &named);
        if (strcmp(found, "indirect_missing") != 0 || with != 1)
            fail_msg("on top of set 1, graded with %d: '%s', set %d", graded, found, with);
    }
}

static int bug_number(const char *name)
{
    int bug = catalogue_bug(&bugs.catalogue, name);
    if (bug < 0)
        fail_msg("no bug '%s'", name);
    return bug;
}

/* Two of different parts, in either order. */
TEST(two_bugs_have_both_names)
{
    static const char *const known[][2] = {{"cosine_missing", "depth_one_short"},
                                           {"upside_down", "emission_twice"},
                                           {"diffuse_without_pi", "roulette_not_divided"},
                                           {"light_area_doubled", "sky_upside_down"}};
    (void)state;
    for (size_t i = 0; i < COUNT(known); i++) {
        int a = bug_number(known[i][0]), b = bug_number(known[i][1]), with;
        struct diagnosis found = find(0, a, b, 1, 0, NULL, &with);
        const struct candidate *c = &found.candidate[0];
        if (found.num_named != 1 || with != 0 ||
            !((c->bug == a && c->second == b) || (c->bug == b && c->second == a)))
            fail_msg("%s and %s: %d named", known[i][0], known[i][1], found.num_named);
    }
}

/* A bug that is not in the catalogue is not called by the name of a relative: each of these has some that look like it. */
TEST(an_unknown_bug_has_no_name)
{
    static const char *const unknown[] = {
        "fresnel_swapped",           "indirect_missing",    "indirect_times_pdf",
        "hemisphere_in_world_frame", "bvh_leaf_loses_last", "emission_twice",
        "mirror_times_cosine",       "roulette_squared",    "light_area_doubled",
        "lens_centre_heavy",         "sky_upside_down",     "gamma_in_linear_file"};
    (void)state;
    for (size_t i = 0; i < COUNT(unknown); i++) {
        int with;
        struct diagnosis found = find(0, bug_number(unknown[i]), -1, 1, 0, unknown[i], &with);
        if (found.num_named > 0)
            fail_msg("%s is called %s", unknown[i],
                     bugs.catalogue.bug[found.candidate[0].bug].name);
    }
}

TEST(every_bug_is_in_it)
{
    struct err e;
    (void)state;
    if (!catalogue_current(&bugs.catalogue, "tests/mutants", &e))
        fail_msg("%s (make rubric-bugs)", e.msg);
}

/* A catalogue of other images is refused. */
TEST(another_rubric_is_refused)
{
    struct rubric_bugs other;
    struct err e;
    (void)state;
    for (int i = 0; i < rubric->num_images; i++)
        if (strcmp(rubric->image[i].name, "box") == 0) {
            rubric->image[i].bounces++;
            REFUSES(rubric_bugs_open(rubric, answers, &other, &e), "'box'");
            rubric->image[i].bounces--;
        }
}

TEST_GROUP(set_up, tear_down)
