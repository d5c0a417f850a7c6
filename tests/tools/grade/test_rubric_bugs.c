/* Bugs named by 8-bit images alone, with the catalogue that ships, on images made of what it says. */

#include "bug_images.h"
#include "tests/tools/diagnose/catalogue_write.h"
#include "tests/support/test.h"

static struct bug_images of;

static int set_up(void **state)
{
    (void)state;
    return bug_images_start(&of, "tools/rubrics/cs184-3-1.rubric") ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    bug_images_end(&of);
    return 0;
}

/* without: a bug that is taken to be unknown; NULL: none. */
static struct diagnosis find(const struct bug_images *b, int set, int bug, int second, double noise,
                             int graded, const char *without, int *with)
{
    struct submitted_images *h = bug_images_hand_in(b, set, bug, second, noise);
    struct diagnosis found;
    struct err e;
    MUST(rubric_bugs_diagnose(&(struct grading){b->rubric, b->answers, h, 1e-5, &b->bugs}, graded,
                              without, &found, with, &e));
    bug_images_take_back(b, h);
    return found;
}

/* The name of the likeliest, "" if there is none. */
static const char *name(int set, int bug, double noise, int graded, int *with, int *named)
{
    struct diagnosis found = find(&of, set, bug, -1, noise, graded, NULL, with);
    *named = found.num_named;
    return found.num_named > 0 ? of.bugs.catalogue.bug[found.candidate[0].bug].name : "";
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
    static const char *const known[] = {"cosine_missing",  "diffuse_without_pi",
                                        "depth_one_short", "emission_twice",
                                        "sphere_far_hit",  "cosine_missing-light"};
    for (size_t i = 0; i < COUNT(known); i++) {
        int bug = bug_images_number(&of, known[i]), with, named;
        const char *found = name(0, bug, 1, 0, &with, &named);
        if (strcmp(found, known[i]) != 0 || with != 0)
            fail_msg("%s: '%s', set %d", known[i], found, with);
    }
    for (int graded = 0; graded < 2; graded++) {
        int bug = bug_images_number(&of, "indirect_albedo_squared"), with, named;
        const char *found = name(1, bug, 1, graded, &with, &named);
        if (strcmp(found, "indirect_albedo_squared") != 0 || with != 1)
            fail_msg("on top of set 1, graded with %d: '%s', set %d", graded, found, with);
    }
}

/* A rubric whose images have a mask: what it hides is no evidence. */
TEST(masked_images_have_names)
{
    static const char *const known[] = {"upside_down", "sky_upside_down", "metal_without_shadowing",
                                        "mirror_back", "lens_square"};
    struct bug_images masked;
    assert_true(bug_images_start(&masked, "tools/rubrics/cs184-3-2.rubric"));
    assert_true(masked.rubric->mask[2] > 0);
    for (size_t i = 0; i < COUNT(known); i++) {
        int bug = bug_images_number(&masked, known[i]), with;
        struct diagnosis found = find(&masked, 0, bug, -1, 1, 0, NULL, &with);
        if (found.num_named != 1 || found.candidate[0].bug != bug)
            fail_msg("%s: %d named", known[i], found.num_named);
    }
    bug_images_end(&masked);
}

/* Whether both, in either order, and no others, are named where their effects are that far apart (struct bug_images). */
static bool both_are_named(const char *one, const char *two, double apart, double *excess)
{
    const int a = bug_images_number(&of, one), b = bug_images_number(&of, two);
    int with;
    of.apart = apart;
    struct diagnosis found = find(&of, 0, a, b, 1, 0, NULL, &with);
    of.apart = 0;
    assert_int_equal(with, 0);
    const struct candidate *c = &found.candidate[0];
    *excess = c->excess;
    return found.num_named == 1 &&
           ((c->bug == a && c->second == b) || (c->bug == b && c->second == a));
}

/* Two of different parts. */
TEST(two_bugs_have_both_names)
{
    static const char *const known[][2] = {{"cosine_missing", "depth_one_short"},
                                           {"upside_down", "emission_twice"},
                                           {"diffuse_without_pi", "roulette_not_divided"},
                                           {"light_area_doubled", "roulette_squared"}};
    double excess;
    for (size_t i = 0; i < COUNT(known); i++)
        if (!both_are_named(known[i][0], known[i][1], 0, &excess))
            fail_msg("%s and %s", known[i][0], known[i][1]);
}

/* Emission found by bounces adds to the remaining direct light; a wider view shows other parts of the floor, so that
 * more than noise remains unexplained. Controls: effects further apart than either model allows. */
TEST(two_bugs_that_do_not_multiply_have_both_names)
{
    static const char *const adds[] = {"hemisphere_in_world_frame-direct", "emission_twice-mesh"},
                             *const near[] = {"cosine_missing-light", "angle_not_halved-each"};
    double excess;
    assert_true(both_are_named(adds[0], adds[1], 1, &excess) && excess < 4);
    assert_false(both_are_named(adds[0], adds[1], 4, &excess));
    assert_true(both_are_named(near[0], near[1], -1.5, &excess) && excess > 6);
    assert_false(both_are_named(near[0], near[1], 3, &excess));
}

/* The effect of shared random numbers stored in the catalogue is one random draw, so it must not be named beside
 * another bug. */
TEST(a_throw_is_not_one_of_two)
{
    double excess;
    assert_false(
        both_are_named("cosine_sample_uniform_pdf", "pixels_share_random_numbers", 0, &excess));
}

/* A rule that stops at e^-1 of the samples, as no other bug does, beside one that shows in images alone. Its effect in the
 * image is but noise, which is no reason to leave it out. */
TEST(a_rule_of_stopping_is_one_of_two)
{
    const struct catalogue *c = &of.bugs.catalogue;
    const int light = bug_images_number(&of, "hemisphere_pdf_pi"),
              rule = bug_images_number(&of, "adaptive_one_sigma");
    struct submitted_images *h = bug_images_hand_in(&of, 0, light, -1, 1);
    const struct grading g = {of.rubric, of.answers, h, 1e-5, &of.bugs};
    struct observation *clue = calloc(RUBRIC_IMAGES, sizeof *clue);
    struct effect *mine = calloc((size_t)c->num_bugs, sizeof *mine);
    struct view own[RUBRIC_IMAGES];
    int num = 0, counts = 0;
    struct err e;
    for (int i = 0; i < of.rubric->num_images; i++) {
        if (!rubric_bugs_can_observe(&g, 0, i))
            continue;
        MUST(rubric_bugs_observe(&g, 0, i, &clue[num], &e));
        const struct view *plain = clue[num++].view;
        if (!rubric_sight_counts(of.rubric, i) || counts > 0)
            continue;
        own[counts] = *plain;
        own[counts].effect = calloc((size_t)c->num_bugs, sizeof *own[counts].effect);
        own[counts].correct.fact[FACT_SAMPLES] = 0;
        own[counts].correct.fact_sd[FACT_SAMPLES] = 0.05;
        for (int k = 0; k < c->num_bugs; k++) {
            if (plain->effect[k] != NULL)
                mine[k] = *plain->effect[k];
            for (int f = 0; plain->effect[k] == NULL && f < NUM_FACTS; f++)
                mine[k].fact[f] = mine[k].fact_sd[f] = NAN;
            mine[k].fact[FACT_SAMPLES] = k == rule ? -1 : 0;
            mine[k].fact_sd[FACT_SAMPLES] = 0.05;
            own[counts].effect[k] = &mine[k];
        }
        clue[num - 1].view = &own[counts++];
        clue[num - 1].seen.fact[FACT_SAMPLES] = -1;
        clue[num - 1].seen.fact_sd[FACT_SAMPLES] = 0.02;
    }
    assert_int_equal(counts, 1);
    const struct diagnose_options opt = {
        .alpha = 1e-5, .by_likelihood = true, .pairs = true, .clip = rubric_sight_clip(of.rubric)};
    struct diagnosis found;
    MUST(diagnose(c, clue, num, &opt, &found, &e));
    const struct candidate *best = &found.candidate[0];
    assert_int_equal(found.num_named, 1);
    assert_true((best->bug == light && best->second == rule) ||
                (best->bug == rule && best->second == light));
    free(own[0].effect);
    free(mine);
    free(clue);
    bug_images_take_back(&of, h);
}

/* A bug that is not in the catalogue is not called by the name of a relative: each of these has some that look like it. */
TEST(an_unknown_bug_has_no_name)
{
    static const char *const unknown[] = {
        "fresnel_swapped",     "indirect_albedo_squared", "hemisphere_in_world_frame",
        "bvh_leaf_loses_last", "emission_twice",          "mirror_times_cosine",
        "roulette_squared",    "light_area_doubled",      "lens_centre_heavy",
        "sky_upside_down",     "gamma_in_linear_file"};
    for (size_t i = 0; i < COUNT(unknown); i++) {
        int with;
        struct diagnosis found =
            find(&of, 0, bug_images_number(&of, unknown[i]), -1, 1, 0, unknown[i], &with);
        if (found.num_named > 0)
            fail_msg("%s is called %s", unknown[i],
                     of.bugs.catalogue.bug[found.candidate[0].bug].name);
    }
}

TEST(every_bug_is_in_it)
{
    struct err e;
    if (!catalogue_current(&of.bugs.catalogue, "tests/mutants", "tests/studies/grading/bugs", &e))
        fail_msg("%s (make rubric-bugs)", e.msg);
}

/* A catalogue of other images is refused. */
TEST(another_rubric_is_refused)
{
    struct rubric_bugs other;
    struct err e;
    for (int i = 0; i < of.rubric->num_images; i++)
        if (strcmp(of.rubric->image[i].name, "corner") == 0) {
            of.rubric->image[i].bounces++;
            REFUSES(rubric_bugs_open(of.rubric, of.answers, &other, &e), "'corner'");
            of.rubric->image[i].bounces--;
        }
}

TEST_GROUP(set_up, tear_down)
