/* One mistake costs points once: images made from the catalogue's effects, graded as submissions are. Checks of
 * images that are not in the catalogue, and those that correct images of flat cells do not pass, are left out. */

#include "tools/grade/carried.h"
#include "tools/grade/mistake.h"
#include "bug_images.h"
#include "submit_codes.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

static struct bug_images of;

static bool is_made(const struct rubric_check *c)
{
    bool all = c->kind == CHECK_EQUAL || c->kind == CHECK_EXACT || c->kind == CHECK_AGREE ||
               c->kind == CHECK_SUM;
    for (int k = 0; k < c->num_images; k++)
        all = all && of.bugs.view[0][c->images[k]] >= 0;
    return all;
}

static void keep(bool (*is_kept)(const struct rubric_check *))
{
    int num = 0;
    for (int i = 0; i < of.rubric->num_checks; i++)
        if (is_kept(&of.rubric->check[i]))
            of.rubric->check[num++] = of.rubric->check[i];
    of.rubric->num_checks = num;
}

static struct submitted_images *right;

static bool is_passed(const struct rubric_check *c)
{
    OWN(result) result;
    struct err e;
    MUST(grade_checks_run(&(struct grading){of.rubric, of.answers, right, 1e-5, NULL}, c, 0,
                          &result, &e));
    bool passed = result.share == 1;
    return passed;
}

static int set_up(void **state)
{
    (void)state;
    if (!bug_images_start(&of, "tools/rubrics/cs184-3-1.rubric"))
        return -1;
    keep(is_made);
    right = bug_images_hand_in(&of, 0, -1, -1, 1);
    keep(is_passed);
    bug_images_take_back(&of, right);
    return of.rubric->num_checks >= 14 ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    bug_images_end(&of);
    return 0;
}

struct outcome {
    double plain[RUBRIC_CHECKS], share[RUBRIC_CHECKS]; /* against right images; in the end */
    struct mistake mistake;
};

static struct outcome grade(struct submitted_images *h)
{
    static struct result result[RUBRIC_CHECKS];
    struct outcome v;
    struct err e;
    int set;
    const struct grading g = {of.rubric, of.answers, h, 1e-5, &of.bugs};
    MUST(grade_all_checks(&g, result, &set, &e));
    for (int i = 0; i < of.rubric->num_checks; i++)
        v.plain[i] = result[i].share;
    MUST(mistake_judge(&g, &set, result, &v.mistake, &e));
    for (int i = 0; i < of.rubric->num_checks; i++) {
        v.share[i] = result[i].share;
        if (v.share[i] > v.plain[i] && result[i].carried[0] == '\0')
            fail_msg("%s has more points and does not say why", of.rubric->check[i].name);
        result_free(&result[i]);
    }
    return v;
}

static struct outcome grade_bugs(int bug, int second)
{
    struct submitted_images *h = bug_images_hand_in(&of, 0, bug, second, 1);
    struct outcome v = grade(h);
    bug_images_take_back(&of, h);
    return v;
}

/* A bug as if it were not known: what it does is taken out of the catalogue, and put back. */
static void forget(int bug, struct effect **kept)
{
    struct catalogue *c = &of.bugs.catalogue;
    for (int v = 0; v < c->num_views; v++) {
        kept[v] = c->view[v].effect[bug];
        c->view[v].effect[bug] = NULL;
    }
}

static void remember(int bug, struct effect **kept)
{
    for (int v = 0; v < of.bugs.catalogue.num_views; v++)
        of.bugs.catalogue.view[v].effect[bug] = kept[v];
}

static bool lost(const struct outcome *v, const char *part, bool in_the_end)
{
    for (int i = 0; i < of.rubric->num_checks; i++)
        if (strcmp(of.rubric->part[of.rubric->check[i].part].number, part) == 0 &&
            (in_the_end ? v->share : v->plain)[i] < 1)
            return true;
    return false;
}

static const char *const parts[] = {"1", "2", "3", "4", "5"};

/* Points are lost in these parts and in no other. */
static void only(const struct outcome *v, const char *bug, const char *first, const char *second,
                 bool in_the_end)
{
    for (size_t p = 0; p < COUNT(parts); p++) {
        bool expected = strcmp(parts[p], first) == 0 || strcmp(parts[p], second) == 0;
        if (lost(v, parts[p], in_the_end) != expected)
            fail_msg("%s: Part %s %s points", bug, parts[p], expected ? "keeps" : "loses");
    }
}

/* By a bug alone, the part that pays and at least another that loses points too if nothing is carried on; NULL: its scenes do not
 * show the bug. */
static const struct {
    const char *bug, *part, *other;
} known[] = {
    {"upside_down", "1", "2"},        {"pixels_minus_one", "1", NULL},
    {"sphere_far_hit", "1", NULL},    {"bvh_leaf_loses_last", "2", "1"},
    {"cosine_missing", "3", "4"},     {"diffuse_without_pi", "3", "4"},
    {"light_area_doubled", "3", "5"}, {"light_pdf_no_cosine", "3", NULL},
    {"indirect_missing", "4", "5"},   {"roulette_squared", "4", "5"},
    {"emission_missing", "1", "2"}, /* its own part shows no lamp */
    {"bvh_leaf_first_hit", "2", "1"}, {"sphere_far_side_in_range", "1", NULL},
};

TEST(a_bug_costs_points_in_its_own_part)
{
    for (size_t i = 0; i < COUNT(known); i++) {
        struct outcome v = grade_bugs(bug_images_number(&of, known[i].bug), -1);
        if (known[i].other == NULL)
            only(&v, known[i].bug, known[i].part, known[i].part, false);
        else if (!lost(&v, known[i].other, false))
            fail_msg("%s: Part %s would keep its points anyway", known[i].bug, known[i].other);
        if (v.mistake.found.num_named == 0)
            fail_msg("%s has no name", known[i].bug);
        only(&v, known[i].bug, known[i].part, known[i].part, true);
    }
}

TEST(two_bugs_cost_points_in_both_parts)
{
    static const char *const pairs[][4] = {{"cosine_missing", "3", "indirect_missing", "4"},
                                           {"sphere_far_hit", "1", "light_area_doubled", "3"},
                                           {"diffuse_without_pi", "3", "roulette_squared", "4"}};
    for (size_t i = 0; i < COUNT(pairs); i++) {
        struct outcome v =
            grade_bugs(bug_images_number(&of, pairs[i][0]), bug_images_number(&of, pairs[i][2]));
        only(&v, pairs[i][0], pairs[i][1], pairs[i][3], true);
    }
}

/* As if the bugs were not known. second -1: none. */
static struct outcome grade_unknown(int bug, int second)
{
    struct effect *kept[2][256];
    assert_true(of.bugs.catalogue.num_views < 256);
    struct submitted_images *h = bug_images_hand_in(&of, 0, bug, second, 1);
    forget(bug, kept[0]);
    if (second >= 0)
        forget(second, kept[1]);
    struct outcome v = grade(h);
    remember(bug, kept[0]);
    if (second >= 0)
        remember(second, kept[1]);
    bug_images_take_back(&of, h);
    assert_int_equal(v.mistake.found.num_named, 0);
    return v;
}

static int check_number(const char *name)
{
    for (int i = 0; i < of.rubric->num_checks; i++)
        if (strcmp(of.rubric->check[i].name, name) == 0)
            return i;
    fail_msg("no check '%s'", name);
    return -1;
}

static double share_of(const struct outcome *v, const char *check)
{
    return v->share[check_number(check)];
}

static int image_number(const char *name)
{
    for (int i = 0; i < of.rubric->num_images; i++)
        if (strcmp(of.rubric->image[i].name, name) == 0)
            return i;
    fail_msg("no image '%s'", name);
    return -1;
}

/* What makes all light brighter by the same factor, and no known bug: 4 and 5 are held against what 3 has shown. */
TEST(a_mistake_without_a_name_is_paid_once)
{
    struct outcome v = grade_unknown(bug_images_number(&of, "light_area_doubled"), -1);
    assert_true(share_of(&v, "shadow_rays") == 0);
    assert_true(share_of(&v, "five_bounces") == 1);
    assert_true(share_of(&v, "adaptive") == 1);
}

/* The same, and Part 4 is not there at all. */
TEST(what_is_missing_is_not_carried_on)
{
    struct outcome v = grade_unknown(bug_images_number(&of, "light_area_doubled"),
                                     bug_images_number(&of, "indirect_missing"));
    assert_true(share_of(&v, "five_bounces") == 0);
    assert_true(share_of(&v, "second_bounce") == 0);
}

/* Nor is it to an image that is the file of another depth, however near. Control: a_mistake_without_a_name_is_paid_once. */
TEST(one_image_for_two_depths_is_not_carried_on)
{
    struct effect *kept[256];
    const int bug = bug_images_number(&of, "light_area_doubled");
    struct submitted_images *h = bug_images_hand_in(&of, 0, bug, -1, 1);
    strcpy(h->image[image_number("corner_only_2")].sha256, h->image[image_number("corner")].sha256);
    forget(bug, kept);
    struct outcome v = grade(h);
    remember(bug, kept);
    bug_images_take_back(&of, h);
    assert_true(share_of(&v, "five_bounces") == 0);
    assert_true(share_of(&v, "third_bounce") == 1);
}

/* Nor is it where direct light, too dark by 20 %, happens to lie as far below that image as the bounces lie above
 * it. */
TEST(an_image_without_bounces_is_not_carried_on)
{
    struct submitted_images *h =
        bug_images_hand_in(&of, 0, bug_images_number(&of, "indirect_missing"), -1, 1);
    struct submitted_image *p = &h->image[image_number("corner_direct")];
    for (size_t k = 0; k < 3 * (size_t)p->width * (size_t)p->height; k++)
        p->mean[k] *= 0.8;
    struct outcome v = grade(h);
    bug_images_take_back(&of, h);
    assert_true(share_of(&v, "corner") == 0);
    assert_true(share_of(&v, "five_bounces") == 0);
}

TEST(a_mistake_without_a_name_is_located)
{
    static const struct {
        const char *bug, *text;
    } cases[] = {{"hemisphere_without_weight", "only by uniform directions (-H)"},
                 {"indirect_albedo_squared", "only in light that bounced off a surface first"},
                 {"gamma_in_linear_file", "in every image"}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        struct outcome v = grade_unknown(bug_images_number(&of, cases[i].bug), -1);
        if (strstr(v.mistake.located.text, cases[i].text) == NULL)
            fail_msg("%s: '%s'", cases[i].bug, v.mistake.located.text);
    }
}

/* What is said of a bug while only the checks of the first `shown` parts may be seen. */
static struct mistake told_of(const char *bug, int shown)
{
    static struct result result[RUBRIC_CHECKS];
    struct submitted_images *h = bug_images_hand_in(&of, 0, bug_images_number(&of, bug), -1, 1);
    const struct grading g = {of.rubric, of.answers, h, 1e-5, &of.bugs};
    double share[RUBRIC_CHECKS];
    struct mistake told;
    struct err e;
    int set;
    MUST(grade_all_checks(&g, result, &set, &e));
    for (int i = 0; i < of.rubric->num_checks; i++) {
        struct rubric_check *c = &of.rubric->check[i];
        share[i] = result[i].share;
        snprintf(c->visibility, sizeof c->visibility, c->part < shown ? "visible" : "hidden");
        result_free(&result[i]);
    }
    MUST(mistake_shown(&g, set, share, &told, &e));
    for (int i = 0; i < of.rubric->num_checks; i++)
        snprintf(of.rubric->check[i].visibility, sizeof of.rubric->check[i].visibility, "visible");
    bug_images_take_back(&of, h);
    return told;
}

/* Indirect light is Part 4's: who may see the checks of Parts 1 to 3 is told nothing of it. */
TEST(a_mistake_that_only_hidden_checks_show_is_not_told)
{
    struct mistake all = told_of("indirect_albedo_squared", 5),
                   early = told_of("indirect_albedo_squared", 3),
                   direct = told_of("cosine_missing", 3);
    assert_true(all.judged && all.found.num_named > 0);
    assert_true(!early.judged && early.found.num_named == 0 && early.located.text[0] == '\0');
    assert_true(direct.judged && direct.found.num_named > 0);
}

/* Hands in one grey level for all images (like -1), or image number `like` in the place of every other. */
static struct submitted_images *hand_in_same(int like, uint8_t level)
{
    static uint8_t rgb8[3 * 128 * 96];
    struct submitted_images *h = bug_images_hand_in(&of, 0, -1, -1, 1);
    struct err e;
    for (int i = 0; i < of.rubric->num_images; i++) {
        const struct rubric_image *p = &of.rubric->image[i];
        if (h->image[i].mean == NULL || i == like)
            continue;
        submitted_image_free(&h->image[i]);
        if (like >= 0) {
            MUST(submitted_image_copy(&h->image[like], &h->image[i], &e));
            memcpy(h->image[i].sha256, h->image[like].sha256, sizeof h->image[i].sha256);
            continue;
        }
        memset(rgb8, level, sizeof rgb8);
        h->image[i] = submit_codes(rgb8, p->width, p->height);
    }
    return h;
}

/* White ones are the control. */
TEST(where_all_images_are_black_that_is_said)
{
    for (int white = 0; white < 2; white++) {
        struct submitted_images *h = hand_in_same(-1, white ? 255 : 0);
        struct outcome v = grade(h);
        bug_images_take_back(&of, h);
        assert_non_null(strstr(v.mistake.located.text, "in every image"));
        assert_true((strstr(v.mistake.located.text, "all are black") == NULL) == white);
    }
}

/* An unknown mistake of Part 2 and a known one of Part 4: no bug explains all images, those of Part 4 one does; it explains those
 * of Part 5 as well, but is no bug of that. Black images (without direct light, unknown, too) are explained by several bugs. */
TEST(a_part_is_named_by_itself)
{
    static struct effect *kept[2][256];
    const int unknown = bug_images_number(&of, "bvh_misses_flat_boxes"),
              known_one = bug_images_number(&of, "indirect_twice"),
              black = bug_images_number(&of, "shadow_ray_without_end");
    for (int k = 0; k < 2; k++) {
        const int second = k == 0 ? known_one : black;
        struct submitted_images *h = bug_images_hand_in(&of, 0, unknown, second, 1);
        forget(unknown, kept[0]);
        if (k == 1)
            forget(black, kept[1]);
        struct outcome v = grade(h);
        remember(unknown, kept[0]);
        if (k == 1)
            remember(black, kept[1]);
        bug_images_take_back(&of, h);
        assert_int_equal(v.mistake.found.num_named, 0);
        assert_true(lost(&v, "2", false) && lost(&v, k == 0 ? "4" : "3", false));
        for (int p = 0; p < of.rubric->num_parts; p++) {
            const struct diagnosis *d = &v.mistake.of_part[p];
            bool expected = k == 0 && strcmp(of.rubric->part[p].number, "4") == 0;
            if (d->num_named != expected || (expected && d->candidate[0].bug != known_one))
                fail_msg("Part %s: %d named, the first %s", of.rubric->part[p].number, d->num_named,
                         d->num_named > 0 ? of.bugs.catalogue.bug[d->candidate[0].bug].name : "-");
        }
    }
}

/* Where shadow rays are not traced, Part 2's shadows are missing, too. If those are there, what Part 3's images look like is
 * no such bug; asked of nothing else, Part 3 alone has its name. */
TEST(a_right_image_denies_a_name)
{
    const int bug = bug_images_number(&of, "light_without_shadow"), part = 2;
    struct submitted_images *h = bug_images_hand_in(&of, 0, bug, -1, 1),
                            *other = bug_images_hand_in(&of, 0, -1, -1, 1);
    bool none[RUBRIC_IMAGES] = {false}, is_right[RUBRIC_IMAGES] = {false};
    assert_string_equal(of.rubric->part[part].number, "3");
    for (int i = of.rubric->num_checks - 1; i >= 0; i--)
        for (int k = 0; k < of.rubric->check[i].num_images; k++)
            is_right[of.rubric->check[i].images[k]] = of.rubric->check[i].part != part;
    for (int i = 0; i < of.rubric->num_images; i++)
        if (is_right[i]) {
            const struct submitted_image was = h->image[i];
            h->image[i] = other->image[i];
            other->image[i] = was;
        }
    const struct grading g = {of.rubric, of.answers, h, 1e-5, &of.bugs};
    for (int asked = 0; asked < 2; asked++) {
        struct diagnosis d;
        struct err e;
        MUST(rubric_bugs_diagnose_part(&g, 0, part, asked ? is_right : none, &d, &e));
        assert_int_equal(d.num_named, asked ? 0 : 1);
        assert_true(asked || d.candidate[0].bug == bug);
    }
    bug_images_take_back(&of, h);
    bug_images_take_back(&of, other);
}

TEST(one_image_for_all_is_not_carried_on)
{
    const int like[] = {-1, -1, -1, image_number("corner")}, level[] = {0, 120, 240, 0};
    for (size_t k = 0; k < COUNT(like); k++) {
        struct submitted_images *h = hand_in_same(like[k], (uint8_t)level[k]);
        struct outcome v = grade(h);
        bug_images_take_back(&of, h);
        for (int i = 0; i < of.rubric->num_checks; i++)
            if (v.share[i] > v.plain[i])
                fail_msg("image %d, level %d: %s", like[k], level[k], of.rubric->check[i].name);
    }
}

/* The deviations that a diagnosis prefers can leave all points, though it names a bug: no part has paid for it. */
TEST(nothing_is_carried_on_where_no_points_are_lost)
{
    static struct result result[RUBRIC_CHECKS];
    bool paid[RUBRIC_PARTS] = {false};
    struct submitted_images *h = bug_images_hand_in(&of, 0, -1, -1, 1);
    const struct grading g = {of.rubric, of.answers, h, 1e-5, &of.bugs};
    const struct diagnosis found = {.finding = FINDING_BUG,
                                    .candidate = {{.bug = bug_images_number(&of, "cosine_missing"),
                                                   .second = -1,
                                                   .amplitude = 1}},
                                    .num_candidates = 1,
                                    .num_named = 1};
    struct err e;
    int set;
    MUST(grade_all_checks(&g, result, &set, &e));
    MUST(carried_by_name(&g, set, &found, result, paid, &e));
    for (int i = 0; i < of.rubric->num_checks; i++) {
        assert_true(result[i].share == 1);
        assert_string_equal(result[i].carried, "");
        result_free(&result[i]);
    }
    for (int i = 0; i < RUBRIC_PARTS; i++)
        assert_false(paid[i]);
    bug_images_take_back(&of, h);
}

/* Lamps are black, and so are all images of Part 2 but those of its shadows: points come back if these are right, and not
 * if these lost points too. */
TEST(what_a_bug_makes_black_needs_another_check_that_is_right)
{
    static struct result result[RUBRIC_CHECKS];
    const struct diagnosis found = {
        .finding = FINDING_BUG,
        .candidate = {{.bug = bug_images_number(&of, "emission_missing"),
                       .second = -1,
                       .amplitude = 1}},
        .num_candidates = 1,
        .num_named = 1};
    struct submitted_images *h = bug_images_hand_in(&of, 0, found.candidate[0].bug, -1, 1);
    const struct grading g = {of.rubric, of.answers, h, 1e-5, &of.bugs};
    const int triangles = check_number("triangles"), shadows = check_number("shadows");
    for (int wrong = 0; wrong < 2; wrong++) {
        bool paid[RUBRIC_PARTS] = {false};
        struct err e;
        int set;
        MUST(grade_all_checks(&g, result, &set, &e));
        assert_true(result[triangles].share == 0 && result[shadows].share == 1);
        if (wrong)
            result[shadows].share = 0;
        MUST(carried_by_name(&g, set, &found, result, paid, &e));
        assert_true(result[triangles].share == (wrong ? 0 : 1));
        for (int i = 0; i < of.rubric->num_checks; i++)
            result_free(&result[i]);
    }
    bug_images_take_back(&of, h);
}

/* Where a bug stands is told by the words of the patch and of the rubric. */
TEST(bugs_have_their_parts)
{
    static const struct {
        struct bug bug;
        const char *part; /* "": none */
    } cases[] = {{{.where = "part 3, direct light: cos(theta)"}, "3"},
                 {{.where = "part 1, rays: generate_ray"}, "1"},
                 {{.where = "project 3-2, glass: Fresnel"}, ""},
                 {{.where = "starter code, image files"}, ""}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        int part = carried_part_of(of.rubric, &cases[i].bug);
        assert_string_equal(part >= 0 ? of.rubric->part[part].number : "", cases[i].part);
    }
}

TEST_GROUP(set_up, tear_down)
