/* What is told of submissions without running them; tests/end_to_end/source.sh has those that are built and run. */
#include "tools/submission/submission.h"
#include "renderer/base/fs.h"
#include "tests/support/test.h"

TEST(a_name_is_that_of_the_folder_or_of_the_archive)
{
    static const char *const of[][2] = {
        {"subs/ada", "ada"},          {"subs/ada/", "ada"},    {"ada.zip", "ada"},
        {"subs/ada.ZIP", "ada"},      {"x/ada.tar.gz", "ada"}, {"ada.tgz", "ada"},
        {"ada.b.zip", "ada.b"},       {"subs.zip/ada", "ada"}, {".zip", ".zip"},
        {"pathtracer", "pathtracer"},
    };
    for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
        char id[128];
        submission_id(of[i][0], id);
        assert_string_equal(id, of[i][1]);
    }
}

/* Of a directory that holds these files. */
static enum submission_kind kind_with(const struct rubric *r, const char *const *files)
{
    struct submission s;
    struct err e;
    char name[64];
    MUST(fs_remove_tree(test_path("handed"), &e) && fs_make_dirs(test_path("handed"), &e));
    for (; *files != NULL; files++) {
        snprintf(name, sizeof name, "handed/%s", *files);
        test_write(test_path(name), "x", 1);
    }
    MUST(submission_open(r, test_path("handed"), test_path("work"), &s, &e));
    return s.kind;
}

TEST(images_beside_a_program_are_not_what_is_graded)
{
    static struct rubric r = {.program = "pt", .num_images = 1, .limit = {.disk = 1 << 20}};
    snprintf(r.image[0].name, sizeof r.image[0].name, "box");
    static const char *const both[] = {"box.png", "pt", NULL}, *const alone[] = {"box.png", NULL},
                             *const sources[] = {"box.png", "Makefile", NULL};
    for (int allowed = 0; allowed < 2; allowed++) {
        r.images = allowed > 0;
        r.build[0] = '\0';
        assert_int_equal(kind_with(&r, alone), SUBMISSION_IMAGES);
        assert_int_equal(kind_with(&r, both), allowed ? SUBMISSION_IMAGES : SUBMISSION_PROGRAM);
        assert_int_equal(kind_with(&r, sources), SUBMISSION_IMAGES);
        snprintf(r.build, sizeof r.build, "make");
        assert_int_equal(kind_with(&r, alone), SUBMISSION_IMAGES);
        assert_int_equal(kind_with(&r, sources), allowed ? SUBMISSION_IMAGES : SUBMISSION_SOURCE);
    }
}

/* What the image of p asks for: samples of a size, on a scene. */
static void ask(struct rubric_image *p, const char *name, const char *scene, int spp)
{
    *p = (struct rubric_image){.width = 64, .height = 64, .spp = spp, .lights = 1, .bounces = 1};
    snprintf(p->name, sizeof p->name, "%s", name);
    snprintf(p->scene, sizeof p->scene, "%s", scene);
}

TEST(a_scene_on_which_it_hung_is_not_run_again)
{
    static struct rubric r;
    struct made made[6] = {0}, out;
    ask(&r.image[0], "a", "box.dae", 64);
    ask(&r.image[1], "b", "box.dae", 64);
    ask(&r.image[2], "c", "room.dae", 64);
    ask(&r.image[3], "d", "box.dae", 4);
    assert_false(submission_will_hang(&r, made, 0, &out));
    made[0] = (struct made){.end = SANDBOX_WALL, .wall_s = 60};
    assert_true(submission_will_hang(&r, made, 1, &out));
    assert_int_equal(out.end, SANDBOX_WALL);
    assert_string_equal(out.why,
                        "not run, as the program did not end on this scene before (image 'a')");
    assert_false(submission_will_hang(&r, made, 2, &out));
    /* It may have been slow: 16 times fewer samples are another matter. */
    assert_false(submission_will_hang(&r, made, 3, &out));
    made[0].end = SANDBOX_FAILED;
    assert_false(submission_will_hang(&r, made, 1, &out));
}

TEST(three_scenes_are_enough_for_a_program_that_shows_nothing)
{
    static struct rubric r;
    struct made made[4] = {0}, out;
    for (int i = 0; i < 4; i++) {
        char scene[24];
        snprintf(scene, sizeof scene, "%d.dae", i);
        ask(&r.image[i], scene, scene, 64);
        made[i] = (struct made){.end = i < 3 ? SANDBOX_CPU : SANDBOX_OK, .wall_s = 60};
    }
    assert_false(submission_will_hang(&r, made, 2, &out));
    assert_true(submission_will_hang(&r, made, 3, &out));
    snprintf(made[0].path, sizeof made[0].path, "a.png");
    assert_false(submission_will_hang(&r, made, 3, &out));
}

TEST(usage_is_a_line_that_begins_with_the_word)
{
    static const struct {
        const char *log, *why; /* NULL: none */
    } of[] = {
        {"Usage: ./pathtracer [options] <scenefile>\n  -s\n",
         "Usage: ./pathtracer [options] <scenefile>"},
        {"./pathtracer: invalid option -- 'o'\nUsage: ./pathtracer\n",
         "./pathtracer: invalid option -- 'o'"},
        {"[PathTracer] reading\n usage of memory: 3\n", "usage of memory: 3"},
        {"[PathTracer] usage is odd\n", NULL},
        {"Usages\n", NULL},
        {"", NULL},
    };
    for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
        char why[200];
        test_write(test_path("log"), of[i].log, strlen(of[i].log));
        assert_int_equal(submission_printed_usage(test_path("log"), why, sizeof why),
                         of[i].why != NULL);
        if (of[i].why != NULL)
            assert_string_equal(why, of[i].why);
    }
}

TEST_GROUP(NULL, NULL)
