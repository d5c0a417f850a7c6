/* Camera files: what is refused, with the file's name, and where the rays of one that is read go. Pixel filters against their
 * closed forms. */
#include "renderer/scene/camera.h"
#include "renderer/scene/pixel_filter_simd.h"
#include "tests/support/test.h"

/* The lines of a file: angles and clip distances; position and target; the assignment's own idea of
 * both; the matrix by rows; the screen; focal distance and lens radius. */
#define ANGLES   "50 35 1.5 0.1 100\n"
#define POSITION "0.1 0.9 4.2 0 0.8 0\n"
#define ORBIT    "90 0 4.2 0.01 100\n"
#define UPRIGHT  "1 0 0 0 1 0 0 0 1\n"
#define SCREEN   "480 360 570\n"
#define LENS     "4.7 0.05\n"

static bool read_text(const char *text, struct camera *c, struct err *e)
{
    const char *path = test_path("camera");
    test_write_text(path, text);
    *c = (struct camera){.width = 40, .height = 30};
    bool ok = camera_read_file(c, path, e);
    if (!ok)
        assert_memory_equal(e->msg, path, strlen(path));
    return ok;
}

TEST(refuses_what_has_no_rays)
{
    static const struct {
        const char *text, *why;
    } bad[] = {
        {"179.99999 35 1.5 0.1 100\n" POSITION ORBIT UPRIGHT SCREEN LENS, "angles of view"},
        {"0 35 1.5 0.1 100\n" POSITION ORBIT UPRIGHT SCREEN LENS, "angles of view"},
        {"50 35 1.5 2 1\n" POSITION ORBIT UPRIGHT SCREEN LENS, "clip distances"},
        {ANGLES "0 -2e18 0 0 0 0\n" ORBIT UPRIGHT SCREEN LENS, "beyond 1e+18"},
        {ANGLES POSITION ORBIT "1 0 0 0 2 0 0 0 1\n" SCREEN LENS, "column 2"},
        {ANGLES POSITION ORBIT "1 .6 0 0 .8 0 0 0 1\n" SCREEN LENS, "not a rotation"},
        {ANGLES POSITION ORBIT "-1 0 0 0 1 0 0 0 1\n" SCREEN LENS, "not a rotation"},
        {ANGLES POSITION ORBIT UPRIGHT SCREEN "0 0.05\n", "focal distance"},
        {ANGLES POSITION ORBIT UPRIGHT SCREEN "1e300 0.05\n", "focal distance"},
        {ANGLES POSITION ORBIT UPRIGHT SCREEN "4.7 -1\n", "lens radius"},
        {ANGLES POSITION ORBIT UPRIGHT SCREEN "4.7 nan\n", "'nan' is not a number"},
        {ANGLES POSITION ORBIT UPRIGHT SCREEN "4.7\n", "29 numbers"},
        {ANGLES POSITION ORBIT UPRIGHT SCREEN LENS "1", "more than the 30"},
    };
    for (size_t i = 0; i < COUNT(bad); i++) {
        struct camera c;
        struct err e = {""};
        REFUSES(read_text(bad[i].text, &c, &e), bad[i].why);
    }
    /* The largest and the least that are taken. */
    static const char *const good[] = {"1e9 1e6\n", "1e-6 0\n"};
    for (size_t i = 0; i < COUNT(good); i++) {
        char text[512];
        struct camera c;
        struct err e = {""};
        snprintf(text, sizeof text, "%s%s", ANGLES POSITION ORBIT UPRIGHT SCREEN, good[i]);
        MUST(read_text(text, &c, &e));
    }
}

/* A point of the plane in focus is where all rays of its pixel meet: the pixel that sees (sx, sy) of
 * the image plane looks at eye + 2 (sx tan(25), sy tan(17.5), -1) for a focal distance of 2, by the
 * thin lens. The eye is 2^20 away, where float32 has steps of 1/8: the positions are lost in them, the
 * directions must not be. */
TEST(lens_far_from_the_origin)
{
    struct camera c;
    struct err e = {""};
    assert_true(read_text(ANGLES "1048576 0 0 0 0 0\n" ORBIT UPRIGHT SCREEN "2 0.01\n", &c, &e));
    const double degree = acos(-1) / 180;
    double sx = 2 * 10.5 / 40 - 1, sy = 1 - 2 * 20.5 / 30;
    double focus[3] = {2 * sx * tan(25 * degree), 2 * sy * tan(17.5 * degree), -2};
    for (int i = 0; i < 64; i++) {
        float u = ((float)(i % 8) + .5f) / 8, v = ((float)(i / 8) + .5f) / 8;
        ray r = camera_ray(&c, 10.5f, 20.5f, u, v);
        assert_true(fabsf(length(r.d) - 1) < 1e-6f);
        /* Back along the ray from the focus to the lens, z = 0: within its radius of the axis. */
        double t = 2 / -(double)r.d.z, x = focus[0] - t * r.d.x, y = focus[1] - t * r.d.y;
        assert_true(x * x + y * y < 1.001 * .01 * .01);
        /* And not all through its middle. */
        if (i == 0)
            assert_true(x * x + y * y > .5 * .01 * .01);
    }
}

static bool near(vec3 a, double x, double y, double z)
{
    return fabs((double)a.x - x) < 1e-5 && fabs((double)a.y - y) < 1e-5 &&
           fabs((double)a.z - z) < 1e-5;
}

/* A box of 4 x 4 x 7 about (1, 2, 3): its diagonal is 9, so the eye stands 13.5 from (1, 2, 3) towards where the file's camera
 * looks from, whatever place the file gives it. The angle is the vertical one of 35 degrees at 800 x 600 where the file's angles
 * are those of a wider shape, else such that the horizontal one fits; fewer pixels see less. */
TEST(the_assignment_frames_the_scene)
{
    const double degree = acos(-1) / 180;
    struct scene s = {.dialect = DIALECT_CGL,
                      .frame_min = {-1, 0, -0.5f},
                      .frame_max = {3, 4, 6.5f},
                      .camera = {.present = true, .eye = {9, 9, 9}, .backward = {0, 3, 4}}};
    struct camera c;
    struct err e;
    s.camera.hfov = (float)(40 * degree);
    s.camera.vfov = (float)(35 * degree);
    assert_true(camera_init(&c, &s, 800, 600, &e));
    assert_true(near(c.eye, 1, 2 + 13.5 * 0.6, 3 + 13.5 * 0.8));
    assert_true(near(c.backward, 0, 0.6, 0.8) && near(c.right, 1, 0, 0) &&
                near(c.up, 0, 0.8, -0.6));
    assert_true(fabs((double)c.tan_v - tan(17.5 * degree)) < 1e-6);
    assert_true(fabs((double)c.tan_h - tan(17.5 * degree) * 4 / 3) < 1e-6);
    /* 400 x 300 crops to the middle, unless the whole is asked for. */
    assert_true(camera_init(&c, &s, 400, 300, &e));
    assert_true(fabs((double)c.tan_v - tan(17.5 * degree) / 2) < 1e-6);
    camera_show_whole(&c);
    assert_true(fabs((double)c.tan_v - tan(17.5 * degree)) < 1e-6);
    assert_true(fabs((double)c.tan_h - tan(17.5 * degree) * 4 / 3) < 1e-6);
    /* A shape of its own: as much as fits. */
    assert_true(camera_init(&c, &s, 400, 600, &e));
    camera_show_whole(&c);
    assert_true(fabs((double)c.tan_h - tan(17.5 * degree) * 4 / 3) < 1e-6);
    assert_true(fabs((double)c.tan_v - 1.5 * (double)c.tan_h) < 1e-6);
    s.camera.hfov = (float)(90 * degree);
    assert_true(camera_init(&c, &s, 800, 600, &e));
    assert_true(fabs((double)c.tan_h - 1) < 1e-6 && fabs((double)c.tan_v - 0.75) < 1e-6);
    /* From straight above the image's up is -Z, from straight below it is +Z; right is +X in both. */
    s.camera.backward = (vec3){0, 2, 0};
    assert_true(camera_init(&c, &s, 800, 600, &e));
    assert_true(near(c.eye, 1, 15.5, 3) && near(c.up, 0, 0, -1) && near(c.right, 1, 0, 0));
    s.camera.backward = (vec3){0, -2, 0};
    assert_true(camera_init(&c, &s, 800, 600, &e));
    assert_true(near(c.eye, 1, -11.5, 3) && near(c.up, 0, 0, 1) && near(c.right, 1, 0, 0));
}

/* COLLADA: the file's horizontal angle, or its vertical one, and square pixels. */
TEST(collada_keeps_the_angle_of_the_file)
{
    struct scene s = {.dialect = DIALECT_COLLADA, .camera = {.present = true, .vfov = 1}};
    struct camera c;
    struct err e = {""};
    assert_true(camera_init(&c, &s, 300, 200, &e));
    assert_true(fabs((double)c.tan_v - tan(0.5)) < 1e-6 &&
                fabs((double)c.tan_h - 1.5 * tan(0.5)) < 1e-6);
    s.camera.hfov = 1;
    assert_true(camera_init(&c, &s, 300, 200, &e));
    assert_true(fabs((double)c.tan_h - tan(0.5)) < 1e-6 &&
                fabs((double)c.tan_v - tan(0.5) / 1.5) < 1e-6);
    s.camera.present = false;
    REFUSES(camera_init(&c, &s, 300, 200, &e), "no camera");
}

/* Half a width of 3 on 40 x 20 pixels is half a height of 1.5: pixel edge (x, y) lies at (3 (x/20 - 1), 1.5 (1 - y/10), 5), and
 * all rays go along -Z. Where only a half height of 1.5 is given it is the same. */
TEST(orthographic_rays_are_parallel)
{
    for (int only_height = 0; only_height < 2; only_height++) {
        struct camera c;
        struct err e = {""};
        struct scene s = {.dialect = DIALECT_COLLADA,
                          .camera = {.present = true,
                                     .right = {1, 0, 0},
                                     .up = {0, 1, 0},
                                     .backward = {0, 0, 1},
                                     .eye = {0, 0, 5},
                                     .xmag = only_height ? 0 : 3,
                                     .ymag = only_height ? 1.5f : 0,
                                     .near = 0.5f,
                                     .far = 9}};
        MUST(camera_init(&c, &s, 40, 20, &e));
        for (int i = 0; i < 16; i++) {
            float x = (float)(i % 4) * 12.5f, y = (float)(i / 4) * 6.25f;
            ray r = camera_ray(&c, x, y, 0.3f, 0.6f);
            assert_true(r.d.x == 0 && r.d.y == 0 && r.d.z == -1);
            assert_true(fabsf(r.o.x - 3 * (x / 20 - 1)) < 1e-6f);
            assert_true(fabsf(r.o.y - 1.5f * (1 - y / 10)) < 1e-6f);
            assert_true(r.o.z == 5 && r.tmin == 0.5f && r.tmax == 9);
        }
    }
}

/* Cumulative distribution function of a filter along one axis. Tent of radius r: 1/2 + x/r - x^2/(2 r^2) for x > 0.
 * Gauss minus its value g = exp(-r^2/(2 s^2)) at the radius: with c = s sqrt(pi/2), 1/2 + (c erf(x/(s sqrt 2)) - g x)
 * / (2 (c erf(r/(s sqrt 2)) - g r)). All minus 1/2 are odd in x. The filter is the derivative, which the test takes
 * by differences. */
static double share_below(const struct pixel_filter *f, double x)
{
    double y = fabs(x), r = f->radius, g = exp(-0.5 * r * r / (f->sigma * f->sigma)),
           c = f->sigma * sqrt(acos(-1) / 2), half;
    if (f->kind == PIXEL_FILTER_BOX)
        half = y / (2 * r);
    else if (f->kind == PIXEL_FILTER_TENT)
        half = y / r - y * y / (2 * r * r);
    else
        half = (c * erf(y / (f->sigma * sqrt(2))) - g * y) /
               (c * erf(r / (f->sigma * sqrt(2))) - g * r) / 2;
    return 0.5 + copysign(half, x);
}

TEST(filters_are_drawn_by_their_law)
{
    static const char *const texts[] = {"box:1.25",    "tent:1",      "tent:0.5",
                                        "gauss:0.5:2", "gauss:0.5:3", "gauss:2:1"};
    for (size_t i = 0; i < COUNT(texts); i++) {
        struct pixel_filter f;
        struct err e = {""};
        char text[PIXEL_FILTER_TEXT];
        MUST(pixel_filter_parse(texts[i], &f, &e));
        pixel_filter_print(&f, text);
        assert_string_equal(text, texts[i]);
        for (int k = 0; k < 10000; k++) {
            float u = (float)k / 10000;
            double x = (double)filter_places(&f, u), h = 1e-5;
            if (!(fabs(share_below(&f, x) - (double)u) < 1e-6) || fabs(x) > f.radius)
                fail_msg("%s: %g at %g, where %g lies below", text, (double)u, x,
                         share_below(&f, x));
            if (fabs(x) > 1e-4 && fabs(x) < f.radius - 1e-4)
                assert_true(fabs((share_below(&f, x + h) - share_below(&f, x - h)) / (2 * h) -
                                 pixel_filter_value(&f, x)) < 1e-5);
        }
        assert_true(pixel_filter_value(&f, f.radius + 1e-9) == 0);
    }
}

/* pixel_filter_sharing(f, k) is 1 over the integral of f^k, squared for the two axes. Tent of radius 1: the integrals
 * of f^2 and f^3 are 2/3 and 1/2, so 1.5^2 and 2^2. Box two pixels wide, f = 1/2: integrals 1/2 and 1/4, so 2^2 and
 * 4^2. Both sum to 1 over the pixels. */
TEST(what_pixels_share_is_known)
{
    struct pixel_filter f = {0};
    struct err e = {""};
    assert_true(pixel_filter_sharing(&f, 2) == 1 && pixel_filter_value(&f, 0.4) == 1);
    MUST(pixel_filter_parse("tent:1", &f, &e));
    assert_true(fabs(pixel_filter_sharing(&f, 2) - 2.25) < 1e-5 &&
                fabs(pixel_filter_sharing(&f, 3) - 4) < 1e-5);
    MUST(pixel_filter_parse("box:1", &f, &e));
    assert_true(fabs(pixel_filter_sharing(&f, 2) - 4) < 1e-5 &&
                fabs(pixel_filter_sharing(&f, 3) - 16) < 1e-5);
    MUST(pixel_filter_parse("box:0.5", &f, &e));
    assert_true(f.radius == 0);
}

TEST(filters_are_refused)
{
    static const char *const bad[] = {
        "",         "mitchell",  "gauss",       "gauss:0.5:",   "tent:1:2", "box:x",
        "tent:0.4", "gauss:9:2", "gauss:nan:2", "gauss:0.5:17", "box:inf",  "tent:1 "};
    for (size_t i = 0; i < COUNT(bad); i++) {
        struct pixel_filter f;
        struct err e = {""};
        assert_false(pixel_filter_parse(bad[i], &f, &e));
        assert_non_null(strstr(e.msg, "a pixel filter"));
    }
}
