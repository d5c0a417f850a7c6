/* The POV-Ray driver: the images of a replicate, an engine that fails (a shell script that is
 * called povray), and POV-Ray itself against closed forms and against our own renderer. */
#include "tests/support/build_scene.h"
#include "povray_fixture.h"

#include "reference/truth/truth_lamps.h"
#include "reference/povray/povray_replicate_parts.h"
#include "reference/truth/truth.h"
#include "renderer/base/fs.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <gsl/gsl_math.h>
#include <sys/stat.h>

static const struct povray_passes bright = {
    .pass = {{.sources = true, .glow = true, .recursion = 4, .levels = 60, .levels_indirect = 60}},
    .num_passes = 1,
    .num_lamps = 1,
    .extent = 3,
    .radiance = 10};

static bool same_variant(const struct povray_variant *a, const struct povray_variant *b)
{
    return memcmp(a->rotation, b->rotation, sizeof a->rotation) == 0 && a->pass == b->pass &&
           a->lamp_cells == b->lamp_cells && a->rule == b->rule &&
           a->indirect_levels == b->indirect_levels && a->lamp_seed == b->lamp_seed &&
           a->shift_x == b->shift_x && a->shift_y == b->shift_y && a->roulette == b->roulette &&
           a->scale == b->scale;
}

/* The pair differs in radiosity only; two replicates differ in all that stands for a seed. */
TEST(test_replicate_pair)
{
    bool seen[65] = {false};
    for (int i = 0; i < 61; i++) {
        uint32_t seed = replicate_seed(3, i);
        struct povray_image a = povray_replicate(&bright, 128, 64, 4, i, seed, 0, true);
        struct povray_image b = povray_replicate(&bright, 128, 64, 4, i, seed, 0, false);
        struct povray_image c =
            povray_replicate(&bright, 128, 64, 4, i + 1, replicate_seed(3, i + 1), 0, true);
        assert_true(a.variant.indirect && !b.variant.indirect);
        assert_true(same_variant(&a.variant, &b.variant));
        assert_true(a.block == b.block && a.grid == 4 && b.grid == 4);
        assert_string_not_equal(a.name, b.name);
        assert_true(a.variant.rotation[0][0] != c.variant.rotation[0][0]);
        assert_true(a.variant.lamp_seed != c.variant.lamp_seed);
        assert_true(a.variant.shift_x != c.variant.shift_x);
        assert_true(a.block >= 4 && a.block <= 64 && !seen[a.block]);
        seen[a.block] = true;
        /* Half a sub-pixel at most; within the octave above 16/10. */
        assert_true(fabs(a.variant.shift_x) <= .5 / (4 * 128) &&
                    fabs(a.variant.shift_y) <= .5 / (4 * 64));
        assert_true(a.variant.scale >= 1.6 && a.variant.scale <= 3.2);
        for (int r = 0; r < 3; r++)
            for (int k = 0; k < 3; k++) {
                const double(*m)[3] = a.variant.rotation;
                double product = m[r][0] * m[k][0] + m[r][1] * m[k][1] + m[r][2] * m[k][2];
                assert_near(product, r == k, 1e-12);
                /* Each entry is its own cofactor: determinant +1. */
                int r1 = (r + 1) % 3, r2 = (r + 2) % 3, k1 = (k + 1) % 3, k2 = (k + 2) % 3;
                assert_near(m[r][k], m[r1][k1] * m[r2][k2] - m[r1][k2] * m[r2][k1], 1e-12);
            }
    }
}

/* Each of the 32 windows has a column and a row of the sub-pixel to itself; together they are
 * centred. */
TEST(test_windows)
{
    bool column[32] = {false}, row[32] = {false};
    double sum_x = 0, sum_y = 0;
    for (int j = 0; j < POVRAY_WINDOWS; j++) {
        struct povray_image p = povray_window(&bright, 100, 50, j, 0);
        double x = p.variant.shift_x * p.grid * 100 + .5, y = p.variant.shift_y * p.grid * 50 + .5;
        assert_true(x > 0 && x < 1 && y > 0 && y < 1);
        assert_false(column[(int)(32 * x)] || row[(int)(32 * y)]);
        column[(int)(32 * x)] = row[(int)(32 * y)] = true;
        sum_x += x;
        sum_y += y;
        assert_true(!p.variant.indirect && p.variant.rule == POVRAY_GAUSS &&
                    p.variant.roulette == 0);
    }
    assert_near(sum_x, 16, 1e-9);
    assert_near(sum_y, 16, 1e-9);
}

/* Sum over n rotations of component k of a turned axis. */
static double sum_of_component(int n, int row, int column, double power)
{
    double sum = 0;
    for (int i = 0; i < n; i++) {
        struct povray_image p =
            povray_replicate(&bright, 8, 8, 1, i, replicate_seed(20261121, i), 0, true);
        sum += pow(p.variant.rotation[row][column], power);
    }
    return sum;
}

/* H0: rotations are uniform. A turned axis is then uniform on the sphere: each component has mean 0
 * and variance 1/3, its square mean 1/3 and variance 1/5 - 1/9 = 4/45. n = 4000, 18 z-tests, each at
 * alpha = 1e-6 (4.89). Power: an axis that stays within 84 degrees of where it was moves a mean
 * square by 0.038, 8 standard errors. Negative control: turns about one axis only, whose squares have
 * mean 1/2, are rejected. */
TEST(test_rotations_are_uniform)
{
    const int n = 4000;
    for (int r = 0; r < 3; r++)
        for (int k = 0; k < 3; k++) {
            double z1 = sum_of_component(n, r, k, 1) / sqrt(n / 3.0);
            double z2 = (sum_of_component(n, r, k, 2) - n / 3.0) / sqrt(n * 4 / 45.0);
            assert_true(fabs(z1) < 4.89 && fabs(z2) < 4.89);
        }
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += pow(cos(2 * M_PI * (i + .5) / n), 2);
    assert_true(fabs((sum - n / 3.0) / sqrt(n * 4 / 45.0)) > 4.89);
}

static const rgb plane_albedo = {.8f, .5f, .3f};

static struct scene plane(void)
{
    struct scene s = build_scene();
    build_quad(&s, v3(-2, 0, -2), v3(0, 0, 4), v3(4, 0, 0),
               build_material(&s, plane_albedo, grey(0)));
    look_down(&s, .5f);
    return s;
}

/* A corner of three walls and a ball, lit by a lamp above the image: indirect light without a
 * bright edge in view. */
static struct scene corner(void)
{
    struct scene s = build_scene();
    uint32_t white = build_material(&s, grey(.6f), grey(0));
    uint32_t red = build_material(&s, (rgb){.6f, .2f, .2f}, grey(0));
    build_quad(&s, v3(-1, 0, -1), v3(0, 0, 2), v3(2, 0, 0), white);
    build_quad(&s, v3(-1, 0, -1), v3(2, 0, 0), v3(0, 1.5f, 0), white);
    build_quad(&s, v3(-1, 0, -1), v3(0, 1.5f, 0), v3(0, 0, 2), red);
    build_sphere(&s, v3(.2f, .3f, 0), .3f, 1, build_material(&s, grey(.8f), grey(0)));
    build_quad(&s, v3(-.3f, 1.49f, -.4f), v3(.6f, 0, 0), v3(0, 0, .8f),
               build_material(&s, grey(0), grey(10)));
    build_camera(&s, v3(0, .5f, 3), 25);
    return s;
}

/* The one-line error of a render with a shell script that is called povray; NULL: with none in PATH. */
static void engine_fails(const char *script, double timeout_s, const char *const *says)
{
    struct fixture f;
    struct moments m;
    struct err e = {"nothing"};
    json_t *manifest = json_object();
    fixture_init(&f, corner(), 4, 2);
    f.opt.timeout_s = timeout_s;
    const char *file = test_path("bin/povray");
    char *path = strdup(getenv("PATH")), text[1024], dirs[8192];
    MUST(fs_make_dirs(test_path("bin"), &e));
    if (script != NULL) {
        snprintf(text, sizeof text,
                 "#!/bin/sh\nif [ \"$1\" = --version ]; then echo POV-Ray 9; exit; fi\n%s\n",
                 script);
        test_write_text(file, text);
        assert_int_equal(chmod(file, 0755), 0);
    }
    snprintf(dirs, sizeof dirs, "%s:%s", test_path("bin"), script != NULL ? path : "/nonexistent");
    setenv("PATH", dirs, 1);
    bool ok = engine_driver_render(&povray_driver, &f.job, &m, manifest, &e);
    setenv("PATH", path, 1);
    free(path);
    (void)unlink(file);
    assert_false(ok);
    for (; *says != NULL; says++)
        if (strstr(e.msg, *says) == NULL)
            fail_msg("'%s' does not say '%s'", e.msg, *says);
    assert_null(strchr(e.msg, '\n'));
    json_decref(manifest);
    fixture_free(&f);
}

TEST(test_engine_failures)
{
    engine_fails(NULL, 60, (const char *[]){"no such program", NULL});
    engine_fails("echo; echo Parse Error: No matching brace >&2; exit 1", 60,
                 (const char *[]){"exit status 1", "No matching brace", NULL});
    engine_fails("echo rendering; kill -SEGV $$", 60, (const char *[]){"signal 11", NULL});
    engine_fails("exit 139", 60, (const char *[]){"exit status 139", NULL});
    engine_fails("sleep 30", .2, (const char *[]){"no end after 0.2 s", NULL});
    engine_fails("true", 60, (const char *[]){"scene.exr", NULL});
}

/* What slow threads do is tried again, ten times at most; a crash while rendering is not. The script leaves a line in its
 * count for each start, with the image's directory. */
TEST(test_slow_start_is_tried_again)
{
    static const struct {
        const char *script, *says;
        int starts;
    } cases[] = {
        {"echo Timed out waiting for worker thread startup; exit 1", "worker thread startup", 10},
        {"echo '==== [Parsing...] ===='; kill -SEGV $$", "signal 11", 10},
        {"echo '==== [Parsing...] ===='; echo '==== [Rendering...] ===='; kill -SEGV $$",
         "signal 11", 1}};
    const char *count = test_path("count");
    for (size_t k = 0; k < COUNT(cases); k++) {
        char script[256];
        snprintf(script, sizeof script, "pwd >>%s; %s", count, cases[k].script);
        engine_fails(script, 60, (const char *[]){cases[k].says, NULL});
        char *lines = test_read(count);
        const size_t first = strcspn(lines, "\n") + 1;
        int starts = 0;
        for (const char *at = lines; *at != '\0'; at += strcspn(at, "\n") + 1)
            starts += strncmp(at, lines, first) == 0;
        free(lines);
        assert_int_equal(unlink(count), 0);
        assert_int_equal(starts, cases[k].starts);
    }
}

/* A grey image of side x side for the fakes to hand out. */
static const char *grey_exr(const char *name, int side)
{
    struct err e;
    OWN(image) im = build_image(side, side);
    for (int i = 0; i < 3 * side * side; i++)
        im.data[i] = .5f;
    MUST(image_write_exr(test_path(name), &im, &e));
    return test_path(name);
}

/* Images that look fine but must not be believed. 4 x 4 pixels: windows are 8 x 8, the images of
 * replicates at subgrid 1 are 4 x 4. */
TEST(test_implausible_images)
{
    const char *small = grey_exr("small.exr", 4), *large = grey_exr("large.exr", 8);
    char script[512];
    const char *give = "case \"$*\" in *+W8*) cp %s scene.exr;; *) cp %s scene.exr;; esac; %s";
    snprintf(script, sizeof script, give, small, small, "");
    engine_fails(script, 60, (const char *[]){"4 x 4 x 3 values, not 8 x 8", NULL});
    snprintf(script, sizeof script, give, large, small, "");
    engine_fails(script, 60, (const char *[]){"does not say that it traced indirect light", NULL});
    snprintf(script, sizeof script, give, large, small, "echo '  retained for re-use:   17'");
    engine_fails(script, 60, (const char *[]){"kept 17 radiosity samples", NULL});
    snprintf(script, sizeof script, give, large, small, "echo '  retained for re-use:   0'");
    engine_fails(script, 60, (const char *[]){"replicates 0 and 1 are the same", NULL});
}

/* Largest relative difference of an image from a closed form, and that of the mean. The image
 * shows [-1/2, 1/2]^2; a pixel is the mean of 8 x 8 points. */
static void compare(const struct moments *m, double (*irradiance)(double, double), rgb light,
                    double *worst, double *of_mean)
{
    const double albedo[3] = {plane_albedo.r, plane_albedo.g, plane_albedo.b};
    const double power[3] = {light.r, light.g, light.b};
    double sum = 0, expected = 0;
    *worst = 0;
    for (int y = 0; y < m->height; y++)
        for (int x = 0; x < m->width; x++) {
            double e = 0;
            for (int i = 0; i < 64; i++)
                e += irradiance((x + (i % 8 + .5) / 8) / m->width - .5,
                                (y + (i / 8 + .5) / 8) / m->height - .5) /
                     64;
            for (int k = 0; k < 3; k++) {
                double is = m->mean[3 * (y * m->width + x) + k],
                       ought = albedo[k] / M_PI * e * power[k];
                *worst = fmax(*worst, fabs(is / ought - 1));
                sum += is;
                expected += ought;
            }
        }
    *of_mean = sum / expected - 1;
}

static double under_point(double x, double z)
{
    return truth_point_irradiance((double[]){.2, .7, .1}, x, z);
}

static double under_flat_point(double x, double z)
{
    return .7 / sqrt((x - .2) * (x - .2) + .49 + (z - .1) * (z - .1));
}

static double under_sun(double x, double z)
{
    (void)x;
    (void)z;
    return .8;
}

static double under_rectangle(double x, double z)
{
    return truth_rectangle_irradiance(.7, (double[]){-.3, .2}, (double[]){-.4, .3}, x, z);
}

/* Point light, point light without falloff, sun, rectangular lamp, over a Lambertian plane. The
 * bounds are half-float rounding with a little room (2^-11 = 4.9e-4 of a value, averaged over 128;
 * measured 1e-4 and 3e-6). Negative control: light that is 0.1 % brighter is outside. */
TEST(test_direct_light)
{
    need_povray();
    static double (*const truth[4])(double, double) = {under_point, under_flat_point, under_sun,
                                                       under_rectangle};
    const rgb value = {2, 1, 3};
    for (int i = 0; i < 4; i++) {
        struct fixture f;
        struct scene s = plane();
        struct light bulb = {.kind = LIGHT_POINT, .value = value, .position = {.2f, .7f, .1f}};
        bulb.attenuation[i == 0 ? 2 : 0] = 1;
        if (i < 2)
            build_light(&s, bulb);
        else if (i == 2)
            build_sun(&s, v3(0, .8f, .6f), value);
        else
            build_quad(&s, v3(-.3f, .7f, -.4f), v3(.5f, 0, 0), v3(0, 0, .7f),
                       build_material(&s, grey(0), value));
        fixture_init(&f, s, 16, 5);
        json_t *manifest = json_object();
        OWN(moments) m = must_render(&f, manifest);
        assert_string_equal(m.unit, "exact");
        assert_true(m.n[0] == 1 && m.m2[0] == 0 && m.spp == 0);
        assert_int_equal(json_array_size(json_object_get(manifest, "seeds")), 0);
        double worst, mean;
        compare(&m, truth[i], value, &worst, &mean);
        assert_true(worst < 3e-4 && fabs(mean) < 3e-5);
        compare(&m, truth[i], rgb_scale(value, 1.001f), &worst, &mean);
        assert_false(worst < 3e-4 || fabs(mean) < 3e-5);
        json_decref(manifest);
        fixture_free(&f);
    }
}

/* Inside a sphere that emits e and reflects a: e (1 + a + ... + a^depth). The value is the same
 * everywhere, so its rounding is too; 32 scales leave up to 2^-11 / sqrt(3 x 32) = 5e-5 (1 sigma).
 * Negative control: one bounce less or more. */
TEST(test_furnace)
{
    need_povray();
    for (int depth = 0; depth <= 5; depth += 5) {
        const rgb albedo = {.7f, .5f, .3f}, emission = {.3f, 1, 2};
        const double a[3] = {albedo.r, albedo.g, albedo.b};
        const double e[3] = {emission.r, emission.g, emission.b};
        struct fixture f;
        struct scene s = build_scene();
        build_sphere(&s, v3(0, 0, 0), 2, -1, build_material(&s, albedo, emission));
        build_camera(&s, v3(.1f, .2f, 1), 60);
        fixture_init(&f, s, 8, depth);
        OWN(moments) m = must_render(&f, NULL);
        assert_string_equal(m.unit, "exact");
        for (int i = 0; i < 3 * 8 * 8; i++) {
            double is = m.mean[i];
            assert_true(fabs(is / truth_furnace(e[i % 3], a[i % 3], depth) - 1) < 2.5e-4);
            assert_false(fabs(is / truth_furnace(e[i % 3], a[i % 3], depth + 1) - 1) < 2.5e-4);
        }
        fixture_free(&f);
    }
}

/* H0: POV-Ray's image mean is ours, to five bounces. 6 independent calls with a seed each give 6
 * image means of 4 replicates; t-test with 5 degrees of freedom (ours, known far better, only adds
 * variance), alpha = 1e-3 two-sided for each channel. Power: the standard error is 0.3 %
 * at most; two bounces instead of five are 5 to 8 % darker and are the negative control. */
TEST(test_indirect_light)
{
    need_povray();
    struct fixture f;
    double x[CALLS][3], ours[2][3], variance[2][3];
    fixture_init(&f, corner(), 8, 5);
    f.ref = (struct suite_reference){.replicates = 4, .subgrid = 4};
    for (int i = 0; i < CALLS; i++) {
        f.opt.seed = 1000 + (uint32_t)i;
        json_t *manifest = json_object();
        OWN(moments) m = must_render(&f, manifest);
        assert_string_equal(m.unit, "replicate");
        assert_true(m.n[0] == 4 && m.spp == 16);
        assert_int_equal(json_array_size(json_object_get(manifest, "seeds")), 4);
        assert_non_null(
            strstr(json_string_value(json_object_get(manifest, "version")), "POV-Ray 3"));
        for (int k = 0; k < 3; k++)
            x[i][k] = image_mean(&m, k);
        json_decref(manifest);
    }
    render_ours(&f, 5, ours[0], variance[0]);
    render_ours(&f, 2, ours[1], variance[1]);
    for (int k = 0; k < 3; k++)
        for (int depth = 0; depth < 2; depth++)
            assert_int_equal(means_agree(x, k, ours[depth][k], variance[depth][k]), depth == 0);
    fixture_free(&f);
}

/* One seed, the same bits, whatever the number of threads; another seed, other bits. */
TEST(test_reproducible)
{
    need_povray();
    struct moments m[3];
    size_t bytes = 8 * 8 * 3 * sizeof(double);
    for (int i = 0; i < 3; i++) {
        struct fixture f;
        fixture_init(&f, corner(), 8, 3);
        f.opt.threads = i == 0 ? 3 : THREADS;
        f.opt.seed = i == 2 ? 8 : 7;
        m[i] = must_render(&f, NULL);
        fixture_free(&f);
    }
    assert_memory_equal(m[0].mean, m[1].mean, bytes);
    assert_memory_equal(m[0].m2, m[1].m2, bytes);
    assert_memory_not_equal(m[0].mean, m[2].mean, bytes);
    for (int i = 0; i < 3; i++)
        moments_free(&m[i]);
}
