/* What stands in the files that a render leaves, and what is said of it. Tone curves by hand: sRGB is 12.92 x up to 0.0031308, else
 * 1.055 x^(1/2.4) - 0.055, times 255, rounded; the assignment's (sqrt(2) x)^(1/2.2) times 255, cut off. */
#define _GNU_SOURCE
#include "renderer/image/image_oiio.h"
#include "renderer/image/tone.h"
#include "renderer/pathtracer/output.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <sys/stat.h>

TEST(tone_curves)
{
    static const struct {
        double radiance;
        int srgb, cgl;
    } of[] = {
        {0, 0, 0},        {-1, 0, 0},        {NAN, 0, 0},       {0.002, 7, 17}, /* 6.59; 17.70 */
        {0.0031, 10, 21},                                                       /* 10.21; 21.60 */
        {0.18, 118, 136},                                                       /* 117.6; 136.9 */
        {0.5, 188, 217},                                                        /* 187.5; 217.8 */
        {0.7, 218, 253},  {0.708, 219, 255}, {0.999, 255, 255}, {1e30, 255, 255}};
    for (size_t i = 0; i < COUNT(of); i++) {
        assert_int_equal(tone_map(TONE_SRGB, of[i].radiance), of[i].srgb);
        assert_int_equal(tone_map(TONE_CGL, of[i].radiance), of[i].cgl);
    }
}

/* cs184: up to 1/2 blue to green, else green to red, linearly. */
static const struct {
    int n; /* of 16 samples */
    uint8_t rgb8[3];
} rates[] = {
    {0, {0, 0, 255}}, {4, {0, 127, 127}}, {8, {0, 255, 0}}, {12, {127, 127, 0}}, {16, {255, 0, 0}}};

TEST(colours_of_rates)
{
    for (size_t i = 0; i < COUNT(rates); i++) {
        uint8_t rgb8[3];
        rate_colour(rates[i].n / 16.0, rgb8);
        assert_memory_equal(rgb8, rates[i].rgb8, 3);
    }
}

/* A render of samples 4 to 19, three pixels wide. */
enum { WIDTH = 3, FIRST = 4, LAST = 20 };
struct render {
    struct scene scene;
    struct render_id id;
    struct options opt;
    struct output out;
};
static char *words[] = {(char *)"pathtracer", (char *)"-s", (char *)"4", NULL};

static void set(struct render *r, const char *a, const char *b)
{
    *r = (struct render){.scene = {.dialect = DIALECT_COLLADA},
                         .id = {.scene = "abc",
                                .settings = "path",
                                .adaptive = "off",
                                .seed = "7",
                                .cell = "0 0 3 18 of 3 18"},
                         .opt = {.output = {a, b},
                                 .num_outputs = b != NULL ? 2 : 1,
                                 .first = FIRST,
                                 .last = LAST,
                                 .pilot_tolerance = -1,
                                 .sampler = SAMPLER_INDEPENDENT,
                                 .quiet = true}};
    r->out = (struct output){.opt = &r->opt,
                             .id = &r->id,
                             .scene = &r->scene,
                             .accel = "brute force",
                             .argc = 3,
                             .argv = words};
}

/* Fills rows from .. from+height-1: pixel p takes rates[] and level[] in turn, by p. */
static const double level[3] = {0.18, 0.5, 0.002};
static const int code[2][3] = {{118, 188, 7}, {136, 217, 17}};

static void fill(struct film *f, int from, int height)
{
    struct err e = {0};
    MUST(film_alloc(f, WIDTH, height, false, &e));
    f->num_samples = LAST - FIRST;
    for (int i = 0; i < WIDTH * height; i++) {
        int p = WIDTH * from + i;
        f->m.n[i] = rates[4 - p % 4].n;
        for (int c = 0; c < 3; c++) {
            f->m.mean[3 * i + c] = level[(p + c) % 3];
            f->m.m2[3 * i + c] = p + 0.25 * c;
        }
    }
}

static void check_pixels(const char *path, int height, const int *grey, bool rate)
{
    struct err e = {0};
    OWN(image) im;
    MUST(image_read(path, &im, NULL, &e));
    assert_int_equal(im.width, WIDTH);
    assert_int_equal(im.height, height);
    for (int p = 0; p < WIDTH * height; p++)
        for (int c = 0; c < 3; c++)
            assert_int_equal(lrintf(255 * im.data[p * im.channels + c]),
                             rate ? rates[4 - p % 4].rgb8[c] : grey[(p + c) % 3]);
}

static void check_picture(const char *path, int height, bool cgl)
{
    check_pixels(path, height, code[cgl], false);
}

static void check_rates(const char *path, int height)
{
    check_pixels(path, height, NULL, true);
}

static void check_moments(const char *path, int height, const char *seconds)
{
    struct err e = {0};
    OWN(image) im;
    OWN(moments) m;
    MUST(moments_read(path, &m, &im, &e));
    assert_int_equal(m.width, WIDTH);
    assert_int_equal(m.height, height);
    for (int p = 0; p < WIDTH * height; p++) {
        assert_int_equal(m.n[p], rates[4 - p % 4].n);
        for (int c = 0; c < 3; c++) {
            assert_near(m.mean[3 * p + c], level[(p + c) % 3], 1e-7);
            assert_near(m.m2[3 * p + c], p + 0.25 * c, 1e-6);
        }
    }
    static const char *const texts[][2] = {{"assay:command", "pathtracer -s 4"},
                                           {"assay:scene", "abc"},
                                           {"assay:settings", "path"},
                                           {"assay:adaptive", "off"},
                                           {"assay:seed", "7"},
                                           {"assay:cell", "0 0 3 18 of 3 18"},
                                           {"assay:samples", "4:20"},
                                           {"assay:sampler", "independent"},
                                           {"assay:accel", "brute force"}};
    for (size_t i = 0; i < COUNT(texts); i++)
        assert_string_equal(image_get_attr(&im, texts[i][0]), texts[i][1]);
    const char *said = image_get_attr(&im, "assay:seconds");
    assert_true((said == NULL) == (seconds == NULL));
    if (seconds != NULL) {
        assert_string_equal(said, seconds);
        assert_string_equal(image_get_attr(&im, "assay:rays"),
                            "7 rays, 5 box tests, 3 primitive tests");
    }
}

/* A tEXt chunk: name, 0, text. */
static bool says(const char *path, const char *name, const char *text)
{
    size_t size, length = strlen(name) + 1 + strlen(text);
    OWN(image) im;
    struct err e = {0};
    MUST(image_read(path, &im, NULL, &e));
    FILE *f = fopen(path, "rb");
    char bytes[4096], wanted[128];
    size = fread(bytes, 1, sizeof bytes, f);
    fclose(f);
    snprintf(wanted, sizeof wanted, "%s%c%s", name, 0, text);
    return memmem(bytes, size, wanted, length) != NULL;
}

TEST(whole_images)
{
    const char *exr = test_path("a.exr"), *png = test_path("a.png");
    const struct render_stats stats = {.rays = {.rays = 7, .box_tests = 5, .primitive_tests = 3},
                                       .wall_seconds = 1.5,
                                       .cpu_seconds = 2.25};
    struct err e = {0};
    struct render r;
    struct film f;
    set(&r, exr, png);
    fill(&f, 0, 2);
    MUST(output_images(&r.out, &f, &stats, &e));
    check_moments(exr, 2, "1.500 wall, 2.250 cpu");
    check_picture(png, 2, false);
    assert_true(says(png, "assay:samples", "4:20")); /* the most that a pixel has is 16 */
    assert_true(says(png, "assay:cell", "0 0 3 18 of 3 18"));
    assert_false(says(png, "assay:samples", "4:21"));
    assert_int_equal(access(test_path("a_rate.png"), F_OK), -1);
    film_free(&f);
    fill(&f, 0, 1); /* where the first alone has it */
    MUST(output_images(&r.out, &f, &stats, &e));
    assert_true(says(png, "assay:samples", "4:20"));
    film_free(&f);
    fill(&f, 0, 2);
    r.scene.dialect = DIALECT_CGL;
    r.opt.adaptive_batch = 4;
    MUST(output_images(&r.out, &f, NULL, &e));
    check_moments(exr, 2, NULL);
    check_picture(png, 2, true);
    check_rates(test_path("a_rate.png"), 2);
    film_free(&f);
}

/* Bands of 16 rows and 2: the second begins in the middle of everything. */
TEST(images_in_bands)
{
    const char *exr = test_path("b.exr"), *png = test_path("b.png");
    struct err e = {0};
    struct render r;
    struct film band[2];
    set(&r, png, exr);
    r.opt.pilot_tolerance = 0.1;
    fill(&band[0], 0, IMAGE_BAND);
    fill(&band[1], IMAGE_BAND, 2);
    struct output_writer *w = output_open(&r.out, WIDTH, IMAGE_BAND + 2, LAST - FIRST, NULL, &e);
    MUST(w != NULL && output_rows(w, &band[0], &e) && output_rows(w, &band[1], &e));
    assert_int_equal(access(png, F_OK), -1);
    MUST(output_close(w, &e));
    check_moments(exr, IMAGE_BAND + 2, NULL);
    check_picture(png, IMAGE_BAND + 2, false);
    check_rates(test_path("b_rate.png"), IMAGE_BAND + 2);
    film_free(&band[0]);
    film_free(&band[1]);
}

TEST(names)
{
    char path[CHECKPOINT_PATH];
    struct err e = {0};
    struct render r;
    set(&r, "x.exr", NULL);
    MUST(output_state_path(&r.out, NULL, path, &e));
    assert_string_equal(path, "x.exr.state");
    MUST(output_state_path(&r.out, "y.png", path, &e));
    assert_string_equal(path, "y.png.state");
    char longest[CHECKPOINT_PATH];
    memset(longest, 'a', sizeof longest);
    longest[CHECKPOINT_PATH - 1 - strlen(".state")] = '\0'; /* with the 0 behind it, just room */
    MUST(output_state_path(&r.out, longest, path, &e));
    longest[CHECKPOINT_PATH - 1 - strlen(".state")] = 'a';
    longest[CHECKPOINT_PATH - strlen(".state")] = '\0';
    assert_false(output_state_path(&r.out, longest, path, &e));
    const char *folder = test_path("none/x.png");
    set(&r, test_path("x.exr"), folder);
    assert_false(output_check(&r.out, &e));
    r.opt.num_outputs = 1;
    MUST(output_check(&r.out, &e));
    r.opt.heatmap = folder;
    assert_false(output_check(&r.out, &e));
}

/* What `tell` writes to the stream, whose file descriptor is fd. */
static void caught(FILE *stream, int fd, void (*tell)(const struct output *, const struct film *),
                   const struct render *r, const struct film *f, const char *expected)
{
    fflush(stream);
    int before = dup(fd);
    assert_non_null(freopen(test_path("said"), "w", stream));
    tell(&r->out, f);
    fflush(stream);
    dup2(before, fd);
    close(before);
    OWN_TEXT text = test_read(test_path("said"));
    assert_string_equal(text, expected);
}

static void summary(const struct output *o, const struct film *f)
{
    static const struct render_stats stats = {.samples = 1};
    output_print_summary(o, f, &stats);
}

/* Six pixels of means p + c: 2.5 + c in the mean. Four samples each, M2 = 18 (c+1)^2: the variance of a pixel's mean is
 * M2/12, of the image's that over 6, and its root (c+1)/2. */
TEST(summary_of_the_image)
{
    struct err e = {0};
    struct render r;
    OWN(film) f;
    set(&r, "x.exr", NULL);
    MUST(film_alloc(&f, WIDTH, 2, false, &e));
    for (int p = 0; p < 6; p++) {
        f.m.n[p] = 4;
        for (int c = 0; c < 3; c++) {
            f.m.mean[3 * p + c] = p + c;
            f.m.m2[3 * p + c] = 18 * (c + 1) * (c + 1);
        }
    }
    caught(stdout, STDOUT_FILENO, summary, &r, &f, "mean radiance 2.5 3.5 4.5 +- 0.5 1 1.5\n");
    r.opt.sampler = SAMPLER_SOBOL;
    caught(stdout, STDOUT_FILENO, summary, &r, &f, "mean radiance 2.5 3.5 4.5, error unknown\n");
    f.num_samples = 3;
    caught(
        stderr, STDERR_FILENO, output_print_how_to_resume, &r, &f,
        "pathtracer: interrupted after 3 of 16 samples per pixel; to go on:\npathtracer --resume x.exr -s 4\n");
    r.opt.resume = "x.exr";
    caught(stderr, STDERR_FILENO, output_print_how_to_resume, &r, &f,
           "pathtracer: interrupted after 3 of 16 samples per pixel; to go on:\npathtracer -s 4\n");
}

static struct render_stats told_stats;

static void told(const struct output *o, const struct film *f)
{
    output_print_summary(o, f, &told_stats);
}

/* 24 samples; 8 rays with 20 box and 12 primitive tests: 2.5 and 1.5 per ray. In each of six pixels the mean
 * luminance of four samples is 2 and the variance of that mean 0.01: a relative error of 0.1 / 2 = 5 %. */
TEST(what_is_said_of_a_render)
{
    struct err e = {0};
    struct render r;
    OWN(film) f;
    set(&r, "x.exr", "folder/y.png");
    r.opt.quiet = false;
    MUST(film_alloc(&f, WIDTH, 2, false, &e));
    for (int p = 0; p < 6; p++) {
        f.m.n[p] = 4;
        f.s1[p] = 8;
        f.s2[p] = 16 + 4 * 3 * 0.01;
    }
    f.num_samples = 3;
    told_stats = (struct render_stats){.samples = 24,
                                       .rays = {.rays = 8, .box_tests = 20, .primitive_tests = 12},
                                       .wall_seconds = 1.5,
                                       .cpu_seconds = 2.25,
                                       .end = RENDER_TIME};
    caught(
        stderr, STDERR_FILENO, told, &r, &f,
        "24 paths, 8 rays in 1.50 s (2.25 CPU s); per ray 2.5 box and 1.5 primitive tests; brute force\n"
        "written: x.exr folder/y.png\n"
        "stopped by --time after 3 samples per pixel, relative error 5 %\n");
    r.opt.pilot_tolerance = 0; /* a tolerance, unlike -1 */
    told_stats.end = RENDER_ERROR;
    caught(
        stderr, STDERR_FILENO, told, &r, &f,
        "24 paths, 8 rays in 1.50 s (2.25 CPU s); per ray 2.5 box and 1.5 primitive tests; brute force\n"
        "written: x.exr folder/y.png folder/y_rate.png\n"
        "stopped by --error after 3 samples per pixel, relative error 5 %\n");
    r.opt.pilot_tolerance = -1;
    r.opt.adaptive_batch = 1;
    told_stats = (struct render_stats){.samples = 1, .end = RENDER_ASKED};
    caught(
        stderr, STDERR_FILENO, told, &r, &f,
        "1 paths, 0 rays in 0.00 s (0.00 CPU s); per ray 0.0 box and 0.0 primitive tests; brute force\n"
        "written: x.exr folder/y.png folder/y_rate.png\n");
}

/* Where the images cannot be: beside them, if only their names cannot; else in TMPDIR, all under new names, and the line
 * says so. */
TEST(rescued_images)
{
    struct err e = {0};
    struct render r;
    OWN(film) f;
    char words_said[1024], from[600];
    const char *folder = test_path("none/a.exr"), *tmp = test_path("spare");
    assert_int_equal(mkdir(tmp, 0700), 0);
    assert_non_null(getcwd(from, sizeof from));
    fill(&f, 0, 2);
    for (int beside = 0; beside < 2; beside++) {
        set(&r, beside ? test_path("a.exr") : folder, "b.png");
        r.opt.adaptive_batch = 4;
        assert_int_equal(setenv("TMPDIR", tmp, 1), 0);
        assert_int_equal(chdir("/proc"), 0); /* where no file can be made */
        err_set(&e, "disk full");
        assert_false(output_rescue(&r.out, &f, NULL, &e));
        assert_int_equal(chdir(from), 0);
        unsetenv("TMPDIR");
        char name[600];
        snprintf(name, sizeof name, "%srescued-%ld-", test_path(beside ? "" : "spare/"),
                 (long)getpid());
        snprintf(words_said, sizeof words_said, "disk full; the render is in %sa.exr instead",
                 name);
        assert_string_equal(e.msg, words_said);
        size_t length = strlen(name);
        snprintf(name + length, sizeof name - length, "a.exr");
        check_moments(name, 2, NULL);
        snprintf(name + length, sizeof name - length, "b.png");
        check_picture(name, 2, false);
        snprintf(name + length, sizeof name - length, "b_rate.png");
        check_rates(name, 2);
    }
    set(&r, folder, NULL);
    assert_int_equal(setenv("TMPDIR", folder, 1), 0);
    assert_int_equal(chdir("/proc"), 0);
    err_set(&e, "disk full");
    assert_false(output_rescue(&r.out, &f, NULL, &e));
    assert_int_equal(chdir(from), 0);
    unsetenv("TMPDIR");
    assert_string_equal(e.msg, "disk full");
}

/* A state and a rate map that cannot be are told before the render as images are. */
TEST(what_cannot_be_written)
{
    const char *resumed = test_path("c.exr.state"), *rate = test_path("d_rate.png");
    struct err e = {0};
    struct render r;
    set(&r, test_path("c.exr"), test_path("d.png"));
    MUST(output_check(&r.out, &e));
    assert_int_equal(mkdir(rate, 0700), 0);
    MUST(output_check(&r.out, &e)); /* not adaptive: no map */
    r.opt.adaptive_batch = 4;
    assert_false(output_check(&r.out, &e));
    assert_int_equal(rmdir(rate), 0);
    MUST(output_check(&r.out, &e));
    assert_int_equal(mkdir(resumed, 0700), 0);
    assert_false(output_check(&r.out, &e));
    assert_int_equal(rmdir(resumed), 0);
}
