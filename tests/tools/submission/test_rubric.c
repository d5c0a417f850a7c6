/* Rubrics: what is read, and that every mistake is named with its line. Each text below has one mistake (or those
 * that are listed), put in by hand. */

#include "renderer/base/fs.h"
#include "tools/submission/rubric_variant.h"
#include "tests/support/suite_files.h"
#include "tests/support/test.h"

static struct rubric one, *const rubric = &one;
static struct rubric_mistakes mistakes;

static void read_text(const char *text)
{
    struct err e;
    test_write(test_path("rubric"), text, strlen(text));
    MUST(rubric_read(test_path("rubric"), suite_shipped(), 0, rubric, &mistakes, &e));
}

static const char head[] = "rubric A course\n"           /* 1 */
                           "image p\n"                   /* 2 */
                           " scene 12_point_plane\n"     /* 3 */
                           " size 64 64\n"               /* 4 */
                           " spp 16\n"                   /* 5 */
                           " bounces 1\n"                /* 6 */
                           " reference truth\n"          /* 7 */
                           "part 1 Light  # a remark\n"; /* 8 */
static const char check[] = "check c 4 equal p\n"        /* 9 */
                            " image 0.01 0.05\n"         /* 10 */
                            " tile 0.03 0.1\n";          /* 11 */

TEST(several_lines_of_build_are_one_script)
{
    char text[2048];
    snprintf(text, sizeof text,
             "%s%s"
             "build cmake -S . -B build\nbuild make -C build\npackages cmake g++\nlimit build 60\n"
             "limit build-memory 1000\n",
             head, check);
    read_text(text);
    assert_int_equal(mistakes.num, 0);
    assert_string_equal(rubric->build, "cmake -S . -B build\nmake -C build");
    assert_string_equal(rubric->packages, "cmake g++");
    assert_true(rubric->build_s == 60 && rubric->build_memory == (size_t)1000 << 20);
    assert_true(rubric->limit.memory == sandbox_default.memory);
}

/* A line of head, or of check, replaced by another. */
static const char *with(int line, const char *other)
{
    static char out[4096];
    char text[2048];
    size_t n = 0;
    int k = 0;
    snprintf(text, sizeof text, "%s%s", head, check);
    for (char *at = text; *at != '\0'; at += strcspn(at, "\n") + 1) {
        bool here = ++k == line;
        int length = (int)(here ? strlen(other) : strcspn(at, "\n"));
        n += (size_t)snprintf(out + n, sizeof out - n, "%.*s\n", length, here ? other : at);
    }
    return out;
}

TEST(a_right_one_is_read)
{
    read_text(with(0, ""));
    if (mistakes.num > 0)
        fail_msg("%d: %s", mistakes.at[0].line, mistakes.at[0].text);
    assert_string_equal(rubric->title, "A course");
    assert_int_equal(rubric->num_images, 1);
    assert_int_equal(rubric->image[0].spp, 16);
    assert_int_equal(rubric->image[0].lights, 1);
    assert_int_equal(rubric->image[0].reference, REFERENCE_TRUTH);
    assert_string_equal(rubric->part[0].title, "Light");
    assert_int_equal(rubric->num_checks, 1);
    assert_int_equal(rubric->check[0].kind, CHECK_EQUAL);
    assert_true(rubric->check[0].points == 4 && rubric->check[0].image.full == 0.01 &&
                rubric->check[0].tile.none == 0.1);
    assert_string_equal(rubric->check[0].visibility, "visible");
    assert_string_equal(rubric->curve, "cgl");
    assert_non_null(strstr(rubric->command, "{scene}"));
    assert_true(rubric_points(rubric) == 4);
}

TEST(what_is_carried_on)
{
    read_text(with(
        11,
        " tile 0.1 0.2\npart 2 More\ncheck d 1 equal p\n image 0.1 0.2\n tile 0.1 0.2\n after p"));
    assert_int_equal(mistakes.num, 0);
    assert_int_equal(rubric->check[0].after, -1);
    assert_int_equal(rubric->check[1].after, 0);
    assert_int_equal(rubric_line_of(rubric->check[1].lines, "after", rubric->check[1].line), 16);
    assert_int_equal(rubric_line_of(rubric->check[1].lines, "hint", rubric->check[1].line), 13);
    assert_true(rubric->check[1].carried.full == 0.15 && rubric->check[1].carried.none == 0.5);
}

TEST(an_editors_mark_of_utf8_is_passed_over)
{
    char text[64];
    snprintf(text, sizeof text, "\xef\xbb\xbf%s", "rubric A course");
    read_text(with(1, text));
    assert_int_equal(mistakes.num, 0);
    assert_string_equal(rubric->title, "A course");
}

TEST(images_may_be_allowed)
{
    read_text(with(0, ""));
    assert_false(rubric->images);
    read_text(with(1, "rubric A course\nallow images"));
    assert_int_equal(mistakes.num, 0);
    assert_true(rubric->images);
}

TEST(images_by_their_old_word)
{
    read_text(with(2, "picture p"));
    assert_int_equal(mistakes.num, 0);
    assert_int_equal(rubric->old_word_line, 2);
    assert_string_equal(rubric->image[0].name, "p");
    read_text(with(0, ""));
    assert_int_equal(rubric->old_word_line, 0);
}

/* Below a check the same word is a margin, of two numbers. */
TEST(images_below_a_check)
{
    read_text(with(11, " tile 0.03 0.1\nimage 2nd\n scene 12_point_plane"));
    assert_int_equal(rubric->num_images, 2);
    assert_string_equal(rubric->image[1].name, "2nd");
    assert_true(rubric->check[0].image.full == 0.01);
}

TEST(the_shipped_ones_are_right)
{
    static const char *const paths[] = {
        "tools/rubrics/cs184-3-1.rubric", "tools/rubrics/cs184-3-1-before-2024.rubric",
        "tools/rubrics/cs184-3-2.rubric", "tools/rubrics/template.rubric",
        "tools/rubrics/deviations.rubric"};
    static const double points[] = {100, 100, 100, 10, 10};
    static const int sets[] = {3, 3, 4, 1, 8};
    struct err e;
    for (int i = 0; i < 5; i++) {
        assert_true(rubric_read(paths[i], suite_shipped(), 0, rubric, &mistakes, &e));
        if (mistakes.num > 0)
            fail_msg("%s:%d: %s", paths[i], mistakes.at[0].line, mistakes.at[0].text);
        assert_true(rubric_points(rubric) == points[i]);
        assert_int_equal(rubric->num_sets, sets[i]);
    }
    /* Every choice, by its bits. */
    assert_string_equal(rubric->set[0].name, "");
    assert_string_equal(rubric->set[5].name, "light_pdf, camera_crop");
    assert_string_equal(rubric->set[5].words, "--starter light-pdf --frame crop");
    REFUSES(rubric_read("/nowhere.rubric", suite_shipped(), 0, rubric, &mistakes, &e),
            "/nowhere.rubric: cannot read");
}

/* In that line; 0: in any. */
static bool is_told(int line, const char *words)
{
    bool told = false;
    for (int i = 0; i < mistakes.num; i++)
        told = told || ((line == 0 || mistakes.at[i].line == line) &&
                        strstr(mistakes.at[i].text, words) != NULL);
    return told;
}

TEST(each_mistake_is_named_with_its_line)
{
    enum { ALONE = 10 };
    static const struct {
        int at, line;
        const char *other, *words;
    } cases[] = {
        /* There is no other mistake. */
        {4, 4, " size 64", "needs a whole number"},
        {7, 7, " referense truth\n reference truth", "'referense'"},
        {7, 7, " refer\x1b[31mense\x7f truth\n reference truth", "'refer?[31mense?'"},
        {10, 10, " image 0.05 0.01", "must be less"},
        {10, 9, "", "needs 'image'"},
        {11, 12, " tile 0.1 0.2\ncheck c 1 equal p\n image 0.1 0.2\n tile 0.1 0.2",
         "already in line 9"},
        {10, 10, " image 2 8", "all points up to 200 %"},
        {11, 11, " tile 1 8", "all points up to 100 %"},
        {7, 7, " reference ours 16 --nonsense", "our renderer: unknown option '--nonsense'"},
        {6, 7, " bounces 1\n options --scene scenes/a.txt", "(see 'reference ours SPP none')"},
        /* There may be others. */
        {1, 1, "rubric", "needs a text"},
        {1, 1, "", "no 'rubric TITLE'"},
        {1, 2, "rubric a\ncurve film", "curve 'film'"},
        {1, 2, "rubric a\ncommand ./x {scene} {outt} {out}", "{outt}"},
        {1, 2, "rubric a\ncommand ./x {scene}", "without {out}"},
        {1, 2, "rubric a\noutput ../x.png", "no file name"},
        {1, 2, "rubric a\noutput x.jpg", "no file name"},
        {1, 2, "rubric a\nprogram /bin/sh", "not inside"},
        {1, 2, "rubric a\ntotal 5", "add up to 4"},
        {1, 2, "rubric a\nbugs nowhere", "no directory 'nowhere'"},
        {1, 2, "rubric a\nbugs a/b", "no name"},
        {1, 3, "rubric a\nbugs a\nbugs b", "a second 'bugs'"},
        {1, 3, "rubric a\ntotal 10\ntotal 20", "a second 'total'"},
        {1, 2, "rubric a\ndiagnose ./x {scene} {out}",
         "'diagnose' is no statement here: 'bugs DIR'"},
        {1, 2, "rubric a\nlimit patience 5", "limit: 'patience' is none of: wall"},
        {1, 2, "rubric a\nbudget wall 5", "of cpu"},
        {1, 2, "rubric a\nlimit wall long", "limit wall"},
        {1, 4, "rubric a\nlimit wall 5\nlimit cpu 5\nlimit wall 6", "a second 'limit wall'"},
        {1, 3, "rubric a\nbudget cpu 5\nbudget cpu 6", "a second 'budget'"},
        {1, 2, "rubric a\nlimit build-memory 1", "limit build-memory"},
        {1, 2, "rubric a\nbuild", "needs a text"},
        {1, 2, "rubric a\nrubric b", "second"},
        {1, 2, "rubric a\nvariants 1", "variants"},
        {1, 3, "rubric a\nvariants 2\nvariants 3", "a second 'variants'"},
        {3, 3, " scene x_{variant}.dae", "without a line 'variants NUMBER' above"},
        {1, 2, "rubric a\ncommand ./x {scene} {out} {variant}", "{variant}"},
        {1, 2, "rubric a\nallow programs", "only images can be allowed"},
        {1, 2, "rubric a\nmask 0 0 48", "needs a whole number"},
        {1, 3, "rubric a\nmask 0 0 48 5\nmask 0 0 4 5", "second 'mask'"},
        {1, 2, "rubric a\naccept slow", "needs a text"},
        {1, 3, "rubric a\naccept x -a\naccept x -b", "already accepted in line 2"},
        {1, 3, "rubric a\naccept x -a\nexplain y why", "no deviation 'y' is accepted above"},
        {1, 5, "rubric a\naccept x a\naccept y b\naccept z c\naccept t d", "more than 3"},
        {7, 8, " reference truth\n accept x nowhere.exr", "no file"},
        {7, 8, " reference truth\n accept x --fresnel schlick", "needs 'reference ours'"},
        {2, 2, "image p/q", "no name"},
        {3, 2, " scene 99_nothing", "no scene"},
        {3, 2, " scene nowhere.dae", "no file"},
        {4, 2, " size 60 60", "whole tiles"},
        {5, 5, " spp many", "spp"},
        {5, 6, " spp 4\n spp 8", "a second 'spp'"},
        {4, 5, " size 64 64\n size 32 32", "a second 'size'"},
        {10, 11, " image 1 2\n image 2 3", "a second 'image'"},
        {6, 6, " bounces", "needs a whole number"},
        {7, 7, " reference luck", "reference 'luck'"},
        {7, 2, " bounces 3\n reference cycles", "the golden of"},
        {8, 8, "part 1 Light\npart 2 Nothing", "has no checks"},
        {9, 9, "check c 4 equal q", "no image 'q'"},
        {9, 9, "check c four equal p", "points"},
        {9, 9, "check c 4 equals p", "'equals'"},
        {9, 9, "check c 4 growth p p p p\n image 1 2\n tile 1 2", "needs 'ratio'"},
        {9, 9, "check c 4 equal p p", "takes 1"},
        {10, 10, " image 0.01", "'image' needs a number"},
        {10, 10, " image 0.01 0.05 0.1", "too much"},
        {10, 10, " imagine 0.01 0.05", "'imagine'"},
        {11, 9, " tile 0.1 0.2\n ratio 0.1 0.2", "not for 'equal'"},
        {11, 9, " tile 0.1 0.2\n visibility never", "'never'"},
        {11, 12, " tile 0.1 0.2\n after q", "no image 'q'"},
        {11, 12, " tile 0.1 0.2\n after p", "no check of an earlier part"},
        {11, 12, " tile 0.1 0.2\n carried 0.1 0.2", "needs 'after"},
        {11, 16,
         " tile 0.1 0.2\npart 2 Light\ncheck d 1 agree p p\n image 1 2\n tile 1 2\n after p",
         "is for 'equal'"},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        read_text(with(cases[i].at, cases[i].other));
        if (!is_told(cases[i].line, cases[i].words) || (i < ALONE && mistakes.num > 1))
            fail_msg("case %zu (%s): no '%s' in line %d among %d mistakes, the first: %d: %s", i,
                     cases[i].other, cases[i].words, cases[i].line, mistakes.num,
                     mistakes.at[0].line, mistakes.at[0].text);
    }
}

/* Several are named on one line and each stands for the same; nothing else of the line changes. */
TEST(a_variant_is_what_its_number_says)
{
    struct err e;
    read_text("rubric a\nvariants 12\nimage p\n options -a {variant} {variant}{variant}\n");
    for (int variant = 0; variant <= 12; variant++) {
        char options[32];
        int is = variant > 0 ? variant : 1;
        snprintf(options, sizeof options, "-a %d %d%d", is, is, is);
        assert_true(
            rubric_read(test_path("rubric"), suite_shipped(), variant, rubric, &mistakes, &e));
        assert_string_equal(rubric->image[0].options, options);
        assert_true(rubric->variants == 12 && rubric->variant == is);
    }
    assert_true(rubric_read(test_path("rubric"), suite_shipped(), 13, rubric, &mistakes, &e));
    assert_true(is_told(0, "no variant 13"));
    read_text("rubric a\nvariants 3\n");
    assert_true(is_told(0, "no '{variant}'"));
}

/* A drawn one stays; each of 5 is drawn in 200 drawings but with chance 5 (4/5)^200 < 1e-18. */
TEST(one_variant_is_drawn)
{
    struct err e, ignored;
    int variant, again, count[6] = {0};
    *rubric = (struct rubric){.path = "a", .variants = 5};
    for (int i = 0; i < 200; i++) {
        assert_true(fs_remove_tree(test_path("references"), &ignored));
        MUST(rubric_variant_draw(test_path("references"), rubric, 0, &variant, &e));
        MUST(rubric_variant_draw(test_path("references"), rubric, 0, &again, &e));
        assert_int_equal(variant, again);
        count[variant]++;
    }
    for (int k = 1; k <= 5; k++)
        assert_true(count[k] > 0);
    MUST(rubric_variant_draw(test_path("references"), rubric, variant, &again, &e));
    REFUSES(rubric_variant_draw(test_path("references"), rubric, variant % 5 + 1, &again, &e),
            "was drawn, not");
    REFUSES(rubric_variant_draw(test_path("references"), rubric, 6, &again, &e), "no variant 6");
    rubric->variants = variant - 1;
    if (variant > 1) /* else it has none */
        REFUSES(rubric_variant_draw(test_path("references"), rubric, 0, &again, &e), "was drawn");
    rubric->variants = 5;
    test_write(test_path("references/variant"), "two\n", 4);
    REFUSES(rubric_variant_draw(test_path("references"), rubric, 0, &again, &e), "not the number");
}

TEST(all_mistakes_are_found_at_once)
{
    read_text(with(4, " size 64 64\n sise 4 4\n spp -1"));
    assert_true(mistakes.num >= 2);
    for (int i = 1; i < mistakes.num; i++)
        assert_true(mistakes.at[i - 1].line <= mistakes.at[i].line);
    read_text("");
    assert_int_equal(mistakes.num, 2); /* no title, no checks */
}

/* Bytes that are no text, lines without end, more of everything than there is room for. */
TEST(rubbish_is_survived)
{
    static char text[1 << 18];
    srand(7);
    for (int round = 0; round < 50; round++) {
        size_t n = (size_t)rand() % (sizeof text - 1);
        for (size_t i = 0; i < n; i++)
            text[i] = (char)(1 + rand() % 255);
        text[n] = '\0';
        read_text(text);
        assert_true(mistakes.num > 0);
    }
    size_t n = 0;
    for (int i = 0; i < 400; i++)
        n += (size_t)sprintf(
            text + n, "image p%d\npart %d x\ncheck c%d 1 equal p%d\naccept a b.exr\n", i, i, i, i);
    read_text(text);
    assert_true(mistakes.num > 64);
    memset(text, 'x', 100000);
    text[100000] = '\0';
    read_text(text);
    assert_true(mistakes.num >= 1);
    assert_non_null(strstr(mistakes.at[0].text, "longer than"));
}
