/* Every allocation fails in turn in what grades pictures: no student loses points for want of our memory. Pictures
 * are read by OpenImageIO, which may end the program where its own memory is out, so only our allocations fail. */
#include "tests/support/alloc_fail.h"
#include "tests/support/simulate.h"

#include "reference/base/gsl_errors.h"
#include "renderer/base/fs.h"
#include "renderer/image/image.h"
#include "renderer/image/tone.h"
#include "tools/gradebook/grade_batch.h"
#include "tools/gradebook/same_noise.h"
#include "tools/grade/grade_checks.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { WIDTH = 32, HEIGHT = 24, PIXELS = WIDTH * HEIGHT, SPP = 64, REFERENCE = 1024 };

static char dir[] = "/tmp/test_memory_grade_XXXXXX";
static char path_text[4][128];
static struct moments reference;
static struct rubric *rubric;
static struct answer_key *answers;

static const char *file(int slot, const char *name)
{
    snprintf(path_text[slot], sizeof path_text[slot], "%s/%s", dir, name);
    return path_text[slot];
}

static double truth(int p)
{
    return 0.05 + 0.25 * (p % WIDTH) / WIDTH;
}

/* The mean of n exponential samples of that mean, as of a normal law. */
static double rendered(int p, int n, uint64_t *seed)
{
    return truth(p) * (1 + (draw(LAW_NORMAL, seed) - 1) / 0.3 / sqrt(n));
}

static void write_png(const char *path, uint64_t seed)
{
    static uint8_t rgb8[3 * PIXELS];
    struct err e;
    for (int p = 0; p < PIXELS; p++) {
        double v = rendered(p, SPP, &seed);
        for (int c = 0; c < 3; c++)
            rgb8[3 * p + c] = tone_map(TONE_CGL, v);
    }
    assert_true(fs_make_parent_dirs(path, &e) && image_write_png(path, WIDTH, HEIGHT, rgb8, &e));
}

static void make_rubric(void)
{
    static const enum check_kind kind[] = {CHECK_EQUAL, CHECK_AGREE, CHECK_SUM, CHECK_EXACT,
                                           CHECK_NOISE};
    rubric = calloc(1, sizeof *rubric);
    answers = calloc(1, sizeof *answers);
    assert_true(rubric != NULL && answers != NULL);
    rubric->num_parts = rubric->num_sets = 1;
    rubric->num_pictures = 2;
    strcpy(rubric->curve, "cgl");
    rubric->num_checks = sizeof kind / sizeof kind[0];
    for (int i = 0; i < 2; i++) {
        rubric->picture[i] = (struct rubric_picture){.width = WIDTH,
                                                     .height = HEIGHT,
                                                     .spp = SPP,
                                                     .reference = REFERENCE_OURS,
                                                     .reference_spp = REFERENCE};
        snprintf(rubric->picture[i].name, sizeof rubric->picture[i].name, "p%d", i);
        answers->of[0][i].m = answers->of[0][i].noise = reference;
    }
    for (int i = 0; i < rubric->num_checks; i++) {
        struct rubric_check *c = &rubric->check[i];
        *c = (struct rubric_check){.points = 10,
                                   .kind = kind[i],
                                   .picture = {0, 1},
                                   .num_pictures =
                                       kind[i] == CHECK_EQUAL || kind[i] == CHECK_EXACT ? 1 : 2,
                                   .image = {0.05, 0.2, true},
                                   .tile = {0.3, 0.9, true},
                                   .share = {0.1, 0.5, true},
                                   .log_ratio = {0.7, 1.5, true}};
        snprintf(c->name, sizeof c->name, "%s", rubric_check_kind_name[kind[i]]);
    }
}

static int set_up(void **state)
{
    (void)state;
    uint64_t seed = 1;
    alloc_json(ALLOC_JSON_ENDS, NULL);
    gsl_errors_of_memory_return();
    if (mkdtemp(dir) == NULL)
        return -1;
    reference = new_moments(WIDTH, HEIGHT, "sample");
    for (int p = 0; p < PIXELS; p++) {
        double v = rendered(p, REFERENCE, &seed);
        reference.n[p] = REFERENCE;
        for (int i = 3 * p; i < 3 * p + 3; i++) {
            reference.mean[i] = v;
            reference.m2[i] = REFERENCE * v * v;
            reference.m3[i] = 2 * REFERENCE * v * v * v;
        }
    }
    make_rubric();
    write_png(file(0, "class/ada/p0.png"), 11);
    write_png(file(0, "class/ada/p1.png"), 12);
    write_png(file(0, "class/bob/p0.png"), 11); /* the same noise */
    write_png(file(0, "class/bob/p1.png"), 13);
    return 0;
}

static int tear_down(void **state)
{
    struct err e;
    alloc_fail_sum(state);
    moments_free(&reference);
    free(rubric);
    free(answers);
    return fs_remove_tree(dir, &e) ? 0 : -1;
}

static bool read_student(void *ctx, struct err *e)
{
    double *right = ctx;
    struct submitted_image s = {0};
    bool ok = submitted_image_read(file(0, "class/ada/p0.png"), "cgl", WIDTH, HEIGHT, &s, e);
    alloc_fail_off();
    assert_true(ok || err_is_of_memory(e));
    if (ok) {
        if (*right == 0)
            *right = s.mean[100];
        assert_true(s.mean[100] == *right);
        submitted_image_free(&s);
    }
    return ok;
}

struct work {
    struct submitted_images h;
    double points;
};

static bool grade_pictures(void *ctx, struct err *e)
{
    struct work *w = ctx;
    static struct result result[RUBRIC_CHECKS];
    int set;
    memset(result, 0, sizeof result);
    bool ok = grade_all_checks(rubric, answers, &w->h, 1e-4, result, &set, e);
    alloc_fail_off();
    double points = 1;
    for (int i = 0; ok && i < rubric->num_checks; i++) {
        points += (i + 1) * result[i].share;
        assert_true(result[i].judged);
        result_free(&result[i]);
    }
    if (ok && w->points == 0)
        w->points = points;
    assert_true(!ok || points == w->points);
    return ok;
}

static bool find_same_noise(void *ctx, struct err *e)
{
    struct work *w = ctx;
    struct noise_print n = {0};
    bool ok = same_noise_of(&w->h.picture[0], &reference, SPP, &n, e);
    alloc_fail_off();
    assert_true(!ok || n.blocks == PIXELS / 4);
    if (ok)
        same_noise_free(&n);
    return ok;
}

static void students(void **state)
{
    (void)state;
    static struct work w;
    struct err e;
    double right = 0;
    alloc_fail_each("student_read", ALLOC_OURS, read_student, &right);
    for (int i = 0; i < 2; i++)
        assert_true(submitted_image_read(file(0, i == 0 ? "class/ada/p0.png" : "class/ada/p1.png"),
                                         "cgl", WIDTH, HEIGHT, &w.h.picture[i], &e));
    alloc_fail_each("grading_all", ALLOC_ALL, grade_pictures, &w);
    assert_true(w.points > 10); /* the pictures are right, so the checks got that far */
    alloc_fail_each("alike_noise_of", ALLOC_ALL, find_same_noise, &w);
    for (int i = 0; i < 2; i++)
        submitted_image_free(&w.h.picture[i]);
}

static json_t *a_class(double share)
{
    json_t *grades = json_array();
    static const char *const id[] = {"ada", "bob"};
    for (int k = 0; k < 2; k++) {
        json_t *check = json_pack(
            "{ss, ss, ss, ss, sf, sf, sf, sf, sb, ss, ss, ss, ss, ss, ss, ss, ss, sn, sn, s[]}",
            "kind", "equal", "part", "1", "name", "equal", "title", "Light", "points", 10.0 * share,
            "of", 10.0, "share", share, "chance", 1e-7, "judged", 1, "expected", "the mean", "seen",
            "the mean", "hint", "", "where", "", "visibility", "visible", "accepted", "", "flag",
            "", "picture", "p0", "tile", "relative", "intervals");
        json_array_append_new(
            grades,
            json_pack("{si, ss, ss, ss, sf, sf, sf, sf, sn, sn, ss, s[o], s[{ss, ss, sf, sf}], "
                      "s[{ss, ss, ss, ss, sf, sf, si, si, ss}, {ss, ss, ss, ss, sf, sf, si, si, "
                      "ss}], sn}",
                      "assay_grade", 1, "id", id[k], "kind", "images", "rubric", "Light", "points",
                      10.0, "of", 10.0, "chance", 1e-7, "cpu_s", 1.0, "trouble", "wrong",
                      "accepted", "", "checks", check, "parts", "number", "1", "title", "Light",
                      "points", 10.0, "of", 10.0, "pictures", "name", "p0", "file", "p0.png", "why",
                      "", "end", "ok", "cpu_s", 0.5, "wall_s", 0.5, "width", WIDTH, "height",
                      HEIGHT, "sha256", "0", "name", "p1", "file", "p1.png", "why", "", "end", "ok",
                      "cpu_s", 0.5, "wall_s", 0.5, "width", WIDTH, "height", HEIGHT, "sha256", "1",
                      "diagnosis"));
    }
    assert_int_equal(json_array_size(grades), 2);
    return grades;
}

static bool find_alike(void *ctx, struct err *e)
{
    (void)ctx;
    alloc_fail_off();
    json_t *grades = a_class(1);
    alloc_fail_on();
    bool ok = same_noise(file(0, "class"), rubric, answers, grades, e);
    alloc_fail_off();
    if (ok)
        assert_int_equal(json_array_size(json_object_get(json_array_get(grades, 0), "alike")), 1);
    json_decref(grades);
    return ok;
}

static bool write_class(void *ctx, struct err *e)
{
    long *right = ctx;
    static const char *const name[] = {"grades.json",     "grades.csv", "junit.xml",
                                       "grades.tap",      "index.html", "ada/index.html",
                                       "ada/results.json"};
    alloc_fail_off();
    json_t *grades = a_class(0.5); /* what costs points is shown */
    alloc_fail_on();
    bool ok = grade_write(file(0, "class"), grades, e);
    alloc_fail_off();
    json_decref(grades);
    long sum = 0;
    for (size_t i = 0; i < sizeof name / sizeof name[0]; i++) {
        char path[200];
        snprintf(path, sizeof path, "%s/class/%s", dir, name[i]);
        assert_true(!ok || access(path, F_OK) == 0);
        sum += ok ? (long)(i + 1) * alloc_fail_file_size(path) : 0;
        unlink(path);
    }
    unlink(file(2, "class/bob/index.html"));
    unlink(file(2, "class/bob/results.json"));
    if (ok && *right == 0)
        *right = sum;
    assert_true(!ok || sum == *right);
    return ok;
}

static void classes(void **state)
{
    (void)state;
    long right = 0;
    alloc_fail_each("grade_alike", ALLOC_OURS, find_alike, NULL);
    alloc_fail_each("grade_write", ALLOC_OURS, write_class, &right);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(students, alloc_fail_tell),
        cmocka_unit_test_teardown(classes, alloc_fail_tell),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
