/* The driver of Blender: with a stand-in that misbehaves in every way, then, where there is a
 * Blender, with the real one against closed forms. */
#include "cycles_probe.h"

#include "renderer/base/fs.h"
#include "tests/support/own.h"
#include "tests/support/test.h"
#include "tests/support/vectors.h"

#include <sys/stat.h>

static void plain_scene(struct probe *f)
{
    build_quad(&f->s, v3(-1, -1, -2), v3(2, 0, 0), v3(0, 2, 0),
               build_material(&f->s, grey(.5f), grey(1)));
    build_camera(&f->s, v3(0, 0, 0), 60);
    probe_finish(f);
}

/* Puts a shell script in Blender's place. */
static void stand_in(struct probe *f, const char *script)
{
    char path[128], text[1024], dirs[4096 + 128];
    snprintf(path, sizeof path, "%s/blender", f->bin);
    snprintf(text, sizeof text, "#!/bin/sh\n%s\n", script);
    test_write_text(path, text);
    assert_int_equal(chmod(path, 0755), 0);
    snprintf(dirs, sizeof dirs, "%s:%s", f->bin, f->path);
    setenv("PATH", dirs, 1);
}

#define OK "echo 'ASSAY OK {\"version\": \"Blender 0\", \"settings\": {\"a\": 1}}'"

/* What Blender would have written: replicate k is `value` plus k `step`, in the first pixel more. */
static void write_replicate(struct probe *f, int k, int width, float value, float first)
{
    char path[128];
    OWN(image) im = build_image(width, 4);
    struct err e;
    snprintf(path, sizeof path, "%s/replicate_%04d.exr", f->work, k);
    for (int i = 0; i < width * 4 * 3; i++)
        im.data[i] = value;
    im.data[0] = first;
    MUST(image_write_exr(path, &im, &e));
}

static void assert_fails(struct probe *f, const char *why)
{
    struct err e = {""};
    struct moments m;
    json_t *manifest = json_object();
    REFUSES(engine_driver_render(&cycles_driver, &f->job, &m, manifest, &e), why);
    json_decref(manifest);
}

PROBE(replicates_are_folded_and_described)
{
    struct err e;
    OWN(moments) m;
    json_t *manifest = json_object();
    plain_scene(f);
    for (int k = 0; k < 3; k++)
        write_replicate(f, k, 4, (float)(k * k), 9);
    stand_in(f, "echo \"$@\" > args; " OK);
    MUST(engine_driver_render(&cycles_driver, &f->job, &m, manifest, &e));
    assert_string_equal(m.unit, "replicate");
    assert_true(m.spp == 16);
    /* 0, 1, 4: mean 5/3, M2 = 26/3 by hand. */
    assert_float_equal(m.mean[5], 5.0 / 3, 1e-12);
    assert_float_equal(m.m2[5], 26.0 / 3, 1e-12);
    assert_true(m.mean[0] == 9 && m.n[0] == 3);
    assert_string_equal(json_string_value(json_object_get(manifest, "version")), "Blender 0");
    assert_int_equal(strlen(json_string_value(json_object_get(manifest, "binary_sha256"))), 64);
    assert_string_equal(json_string_value(json_object_get(manifest, "command")),
                        "blender -b --factory-startup -noaudio --python-exit-code 3 -P cycles.py "
                        "-- --scene scene.json --spp 16 --threads 1 --seeds seeds.json");
    const json_t *seeds = json_object_get(manifest, "seeds");
    char path[128];
    snprintf(path, sizeof path, "%s/seeds.json", f->work);
    json_t *file = json_load_file(path, 0, NULL);
    assert_true(json_equal(file, seeds));
    assert_int_equal(json_array_size(seeds), 3);
    for (int k = 0; k < 3; k++)
        assert_int_equal(json_integer_value(json_array_get(seeds, (size_t)k)),
                         replicate_seed(7, k));
    json_decref(file);
    json_decref(manifest);
}

/* All pixels of all replicates alike: no random number had any effect. */
PROBE(light_without_noise_is_exact)
{
    struct err e;
    OWN(moments) m;
    json_t *manifest = json_object();
    plain_scene(f);
    for (int k = 0; k < 3; k++)
        write_replicate(f, k, 4, .25f, .25f);
    stand_in(f, OK);
    MUST(engine_driver_render(&cycles_driver, &f->job, &m, manifest, &e));
    assert_string_equal(m.unit, "exact");
    for (int p = 0; p < 16; p++)
        assert_true(m.n[p] == 1 && m.mean[3 * p] == .25 && m.m2[3 * p] == 0);
    json_decref(manifest);
}

PROBE(equal_replicates_are_refused)
{
    plain_scene(f);
    write_replicate(f, 0, 4, 1, 2);
    write_replicate(f, 1, 4, 1, 3);
    write_replicate(f, 2, 4, 1, 2);
    stand_in(f, OK);
    assert_fails(f, "Cycles: replicate 2 is the same image as an earlier one");
    write_replicate(f, 1, 4, 1, 1); /* constant but not equal to the others */
    write_replicate(f, 2, 4, 1, 1);
    assert_fails(f, "Cycles: replicate 2 is the same image as an earlier one");
}

/* 16 x 16 pixels of noise, uniform in 1 .. 2; a replicate that shares all but `own` of its pixels with the
 * one before it. */
static void write_noise(struct probe *f, int k, size_t own, uint64_t *random, struct image *im)
{
    char path[128];
    struct err e;
    for (size_t i = 0; i < 3 * own; i++) {
        *random = *random * 6364136223846793005u + 1442695040888963407u;
        im->data[i] = 1 + (float)(*random >> 40) * 0x1p-24f;
    }
    snprintf(path, sizeof path, "%s/replicate_%04d.exr", f->work, k);
    MUST(image_write_exr(path, im, &e));
}

/* Different images all, but two were made with the same random numbers up to the last row. */
PROBE(replicates_that_share_their_noise_are_refused)
{
    OWN(image) im = build_image(16, 16);
    OWN(moments) m;
    struct err e;
    uint64_t random = 1;
    json_t *manifest = json_object();
    f->suite.width = f->suite.height = 16;
    f->ref.replicates = 4;
    plain_scene(f);
    stand_in(f, OK);
    for (int k = 0; k < 4; k++)
        write_noise(f, k, 256, &random, &im);
    MUST(engine_driver_render(&cycles_driver, &f->job, &m, manifest,
                              &e)); /* these are independent */
    const json_t *test = json_object_get(manifest, "independence");
    assert_true(json_is_true(json_object_get(test, "tested")));
    assert_true(json_is_true(json_object_get(test, "passed")));
    json_decref(manifest);
    for (int k = 0; k < 4; k++)
        write_noise(f, k, k == 3 ? 16 : 256, &random, &im);
    assert_fails(f, "Cycles: replicates 2 and 3 are not independent");
}

PROBE(unusable_images_are_refused)
{
    plain_scene(f);
    stand_in(f, OK);
    assert_fails(f, "/replicate_0000.exr");
    write_replicate(f, 0, 4, 1, 2);
    write_replicate(f, 1, 5, 1, 3);
    assert_fails(f, "replicate_0001.exr: 5 x 4 pixels, not 4 x 4");
    write_replicate(f, 1, 4, 1, NAN);
    assert_fails(f, "replicate_0001.exr: pixel 0,0 is negative or not finite");
    write_replicate(f, 1, 4, 1, -1);
    assert_fails(f, "replicate_0001.exr: pixel 0,0 is negative or not finite");
}

PROBE(a_blender_that_fails_is_quoted)
{
    plain_scene(f);
    for (int k = 0; k < 3; k++)
        write_replicate(f, k, 4, (float)k, 9);
    stand_in(f, "exit 0");
    assert_fails(f, "blender: ended without the OK line of cycles.py");
    stand_in(f, "echo ASSAY OK nonsense");
    assert_fails(f, "blender: ended without the OK line of cycles.py");
    stand_in(f, "echo 'Error: Python'; echo 'ValueError: lens became 5'; " OK "; exit 3");
    assert_fails(f, "blender: exit status 3: Error: Python | ValueError: lens became 5 | ASSAY OK");
    stand_in(f, "kill -KILL $$");
    assert_fails(f, "blender: killed by signal 9");
    f->opt.timeout_s = 1;
    stand_in(f, "sleep 1000");
    assert_fails(f, "blender: no end after 1 s");
}

PROBE(what_is_missing_is_named)
{
    plain_scene(f);
    setenv("PATH", f->bin, 1);
    assert_fails(f, "blender: no such program in PATH");
    stand_in(f, "touch started; " OK);
    f->opt.share_dir = "/assay/none";
    assert_fails(f, "/assay/none/cycles/cycles.py: ");
    f->opt.share_dir = "reference";
    f->suite.depth = 2000;
    assert_fails(f, "Cycles: depth 2000");
    char path[128];
    snprintf(path, sizeof path, "%s/started", f->work);
    assert_int_equal(access(path, F_OK), -1);
}

/* From here on the real program. */

/* A wall of albedo (.5, .25, .8) at z = -2, seen from the origin; a point light of intensity
 * (7, 5, 3) at (.7, .4, -1.2): L = albedo/pi I cos / r^2 with cos = .8 / r. */
static void point_light_radiance(const double d[3], double out[3], const void *data)
{
    (void)data;
    static const double albedo[3] = {.5, .25, .8}, intensity[3] = {7, 5, 3};
    double x = 2 * d[0] - .7, y = 2 * d[1] - .4, r2 = x * x + y * y + .8 * .8;
    for (int c = 0; c < 3; c++)
        out[c] = albedo[c] / M_PI * intensity[c] * .8 / (r2 * sqrt(r2));
}

PROBE(point_light_on_a_wall)
{
    probe_size(f, 24, 16);
    build_quad(&f->s, v3(-5, -5, -2), v3(10, 0, 0), v3(0, 10, 0),
               build_material(&f->s, (rgb){.5f, .25f, .8f}, grey(0)));
    build_light(&f->s, (struct light){.kind = LIGHT_POINT,
                                      .value = {14, 10, 6},
                                      .position = {.7f, .4f, -1.2f},
                                      .attenuation = {0, 0, 2}});
    build_camera(&f->s, v3(0, 0, 0), 60);
    /* float32, and the midpoint rule */
    probe_check(f, tan(M_PI / 6), 16, point_light_radiance, NULL, 1e-4, false);
}

/* The same wall but smaller; an emitter of radiance 10, x = .5 (its plane stands on the wall), y in -.4 .. .4,
 * z in -1.3 .. -.7, emits towards -x. Nothing arrives behind it. */
static void standing_emitter_radiance(const double d[3], double out[3], const void *data)
{
    (void)data;
    static const double albedo[3] = {.5, .25, .8};
    static const double corner[4][3] = {
        {.5, -.4, -1.3}, {.5, .4, -1.3}, {.5, .4, -.7}, {.5, -.4, -.7}};
    const double p[3] = {2 * d[0], 2 * d[1], -2}, n[3] = {0, 0, 1};
    for (int c = 0; c < 3; c++)
        out[c] = p[0] < .5 ? albedo[c] / M_PI * 10 * fabs(lambert_irradiance(corner, 4, p, n)) : 0;
}

PROBE(emitter_that_stands_on_the_wall)
{
    probe_size(f, 24, 16);
    build_quad(&f->s, v3(-1, -1, -2), v3(2, 0, 0), v3(0, 2, 0),
               build_material(&f->s, (rgb){.5f, .25f, .8f}, grey(0)));
    build_quad(&f->s, v3(.5f, -.4f, -1.3f), v3(0, 0, .6f), v3(0, .8f, 0),
               build_material(&f->s, grey(0), grey(10)));
    /* The wall is small, so that the emitter is large against the scene and an emitter that is not
     * cut is sampled wrongly. The view is narrow enough not to see the emitter, whose near edge is at .5 / 1.3 = .38. */
    build_camera(&f->s, v3(0, 0, 0), (float)(2 * atan(.36) * 180 / M_PI));
    /* the midpoint rule, and the strip of 1.5e-5 of the emitter's edge of reference/cycles/README.md */
    probe_check(f, .36, 16, standing_emitter_radiance, NULL, 1e-4, false);
}

/* Inside a sphere that emits (1, 2, 3) and reflects (.5, .8, .2): at depth 3 each pixel is
 * emission * (1 + a + a^2 + a^3). */
static void furnace_radiance(const double d[3], double out[3], const void *data)
{
    (void)data;
    static const double albedo[3] = {.5, .8, .2};
    (void)d;
    for (int c = 0; c < 3; c++)
        out[c] = (c + 1) * (1 - pow(albedo[c], 4)) / (1 - albedo[c]);
}

PROBE(furnace_inside_a_sphere)
{
    probe_size(f, 24, 16);
    f->suite.depth = 3;
    build_sphere(&f->s, v3(.1f, .2f, .3f), 1.5f, -1,
                 build_material(&f->s, (rgb){.5f, .8f, .2f}, (rgb){1, 2, 3}));
    build_camera(&f->s, v3(0, 0, 0), 60);
    /* the icosphere's edges: 1.8e-4 was measured at depth 5 */
    probe_check(f, tan(M_PI / 6), 16, furnace_radiance, NULL, 3e-4, true);
}

/* Depth 0, half of the view an emitter's front and half an emitter's back, which also reflects. The
 * line between them, x = .015, runs through the middle column of pixels, which spans -.0462 .. .0462
 * at that distance, so that two thirds of it are the front. */
PROBE(only_fronts_emit)
{
    OWN(moments) m;
    probe_size(f, 25, 40);
    f->suite.depth = 0;
    uint32_t glow = build_material(&f->s, grey(.5f), (rgb){1, 2, 3});
    build_quad(&f->s, v3(-5, -5, -2), v3(5.015f, 0, 0), v3(0, 10, 0), glow);
    build_quad(&f->s, v3(.015f, -5, -2), v3(0, 10, 0), v3(5, 0, 0), glow);
    build_sun(&f->s, v3(0, 0, 1), grey(1));
    build_camera(&f->s, v3(0, 0, 0), 60);
    probe_render(f, &m);
    bool ok = true;
    for (int i = 0; i < 3 * 25 * 40; i++) {
        int x = i / 3 % 25, c = i % 3;
        ok = ok &&
             (x == 12 ? fabs(m.mean[i] / (c + 1) - .66) < .05 : m.mean[i] == (x < 12 ? c + 1 : 0));
    }
    assert_true(ok);
}

/* The front alone, to x = .015, which is .1623 of a pixel right of the middle column's centre: under a Gauss of .8 pixels column x
 * sees Phi((.1623 + 12 - x)/.8) of it, by 8 x 40 x 64 samples, whose standard error is .0035 at most. Had Blender's width
 * another meaning, such as the whole support of 12 sigmas, column 13 would see .001 and not .148. */
PROBE(a_gauss_is_a_quarter_of_its_width)
{
    OWN(moments) m;
    struct err e = {""};
    probe_size(f, 25, 40);
    f->suite.depth = 0;
    build_quad(&f->s, v3(-5, -5, -2), v3(5.015f, 0, 0), v3(0, 10, 0),
               build_material(&f->s, grey(.5f), grey(1)));
    build_camera(&f->s, v3(0, 0, 0), 60);
    probe_finish(f);
    MUST(pixel_filter_parse("gauss:0.8:4.8", &f->c.filter, &e));
    probe_run(f, 64, &m);
    double edge = .015 * 25 / (4 * tan(M_PI / 6));
    for (int x = 0; x < 25; x++) {
        double sum = 0, want = 0.5 * erfc(-(edge + 12 - x) / (.8 * sqrt(2)));
        for (int y = 0; y < 40; y++)
            sum += m.mean[3 * (y * 25 + x)] / 40;
        if (!(fabs(sum - want) < 0.0175))
            fail_msg("column %d: %g, not %g", x, sum, want);
    }
}
