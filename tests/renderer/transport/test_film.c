/* Stopping and going on, adaptive sampling, layers. */
#include "renderer/image/image_oiio.h"
#include "renderer/pathtracer/heatmap.h"
#include "renderer/pathtracer/output.h"
#include "renderer/pathtracer/checkpoint.h"
#include "tests/support/build_scene.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

struct fixture {
    struct scene scene;
    struct camera camera;
    struct bvh *bvh;
};

static void finish(struct fixture *f, int width, int height)
{
    struct err e = {0};
    f->camera = build_finish(&f->scene, width, height);
    f->bvh = bvh_build(&f->scene, BVH_SAH, &e);
    MUST(f->bvh != NULL);
}

static void drop(struct fixture *f)
{
    bvh_free(f->bvh);
    scene_free(&f->scene);
}

enum { SIZE = 32 };
#define DIM    1.0
#define BRIGHT 51.0
#define PART   0.02

/* Every pixel has the same distribution with rare bright samples: 51 with probability 0.02, else 1; mean 2,
 * variance 0.02 * 0.98 * 50^2 = 49. The scene: a wall of radiance 1, and in front of it, along each column of
 * pixels, a strip of radiance 51 that is 2 % of a pixel wide. */
static void rare_bright_samples(struct fixture *f)
{
    f->scene = build_scene();
    uint32_t dim = build_material(&f->scene, (rgb){0, 0, 0}, grey((float)DIM));
    uint32_t bright = build_material(&f->scene, (rgb){0, 0, 0}, grey((float)BRIGHT));
    const float pixel = 2.0f / SIZE; /* at z = -1, by the angle of view of 90 degrees */
    build_quad(&f->scene, v3(-9, -9, -2), v3(18, 0, 0), v3(0, 18, 0), dim);
    for (int i = 0; i < SIZE; i++)
        build_quad(&f->scene, v3(-1 + pixel * ((float)i + 0.4f), -2, -1),
                   v3((float)PART * pixel, 0, 0), v3(0, 4, 0), bright);
    build_camera(&f->scene, v3(0, 0, 0), 90);
    finish(f, SIZE, SIZE);
}

static struct render_options options_of(int spp)
{
    return (struct render_options){.integrator = {.direct = DIRECT_MIS,
                                                  .light_samples = 1,
                                                  .roulette = ROULETTE_THROUGHPUT,
                                                  .sampler = {SAMPLER_INDEPENDENT, 77}},
                                   .width = SIZE,
                                   .height = SIZE,
                                   .num_samples = (uint32_t)spp,
                                   .threads = 2,
                                   .pilot_max = (uint32_t)spp};
}

static struct render_stats go_on(const struct fixture *f, const struct render_options *o,
                                 const struct render_control *c, struct film *film)
{
    struct err e = {0};
    struct render_stats stats;
    struct progress p;
    progress_start(&p, "test", NULL, true);
    MUST(render_film(&f->scene, &f->camera, f->bvh, o, c, &p, film, &stats, &e));
    return stats;
}

static struct film start(const struct fixture *f, const struct render_options *o,
                         const struct render_control *c, bool first_hits)
{
    struct err e = {0};
    struct film film;
    assert_true(film_alloc(&film, o->width, o->height, first_hits, &e));
    go_on(f, o, c, &film);
    return film;
}

static bool same_doubles(const double *a, const double *b, size_t n)
{
    return memcmp(a, b, n * sizeof *a) == 0;
}

static bool same_films(const struct film *a, const struct film *b)
{
    size_t n = (size_t)a->m.width * (size_t)a->m.height;
    return same_doubles(a->m.n, b->m.n, n) && same_doubles(a->m.mean, b->m.mean, 3 * n) &&
           same_doubles(a->m.m2, b->m.m2, 3 * n) && same_doubles(a->m.m3, b->m.m3, 3 * n) &&
           same_doubles(a->s1, b->s1, n) && same_doubles(a->s2, b->s2, n) &&
           (a->first == NULL || memcmp(a->first, b->first, n * sizeof *a->first) == 0) &&
           (a->target == NULL || memcmp(a->target, b->target, n * sizeof *a->target) == 0);
}

struct stop {
    const struct film *film;
    bool has_pilot;
};

/* Asks to stop at once, but lets a pilot finish, since a stopped pilot starts again from nothing. */
static bool at_once(void *arg)
{
    const struct stop *s = arg;
    return !s->has_pilot || s->film->target != NULL;
}

static const struct render_id some_id = {.scene = "5ce4e",
                                         .settings = "integrator path",
                                         .adaptive = "off",
                                         .seed = "77",
                                         .cell = "0 0 32 32 of 32 32"};

/* A render that is stopped after every pass, written, read and resumed, by 1 and 2 threads in turn, has the same bits
 * as an uninterrupted one: plain, with layers, with the assignment's adaptive rule, with a pilot. */
TEST(resumed_equals_uninterrupted)
{
    struct fixture f;
    rare_bright_samples(&f);
    const char *path = test_path("x.state");
    for (int mode = 0; mode < 4; mode++) {
        struct render_options o = options_of(13);
        o.first_sample = 5;
        o.adaptive_batch = mode == 2 ? 4 : 0;
        o.pilot_samples = mode == 3 ? 4 : 0;
        o.adaptive_tolerance = o.pilot_tolerance = 0.5;
        struct err e = {0};
        struct film whole = start(&f, &o, NULL, mode == 1), film;
        struct stop when = {.film = &film, .has_pilot = mode == 3};
        const struct render_control stop = {.asked_to_stop = at_once, .arg = &when};
        assert_true(film_alloc(&film, SIZE, SIZE, mode == 1, &e));
        int stops = 0;
        while (go_on(&f, &o, &stop, &film).end == RENDER_ASKED) {
            struct film read;
            o.threads = 3 - o.threads;
            assert_true(film_alloc(&read, SIZE, SIZE, mode == 1, &e));
            MUST(checkpoint_write(path, &some_id, &film, &e) &&
                 checkpoint_read(path, &some_id, &read, &e));
            film_free(&film);
            film = read;
            stops++;
        }
        assert_true(stops >= 5);
        assert_true(same_films(&whole, &film));
        film_free(&film);
        film_free(&whole);
    }
    unlink(path);
    drop(&f);
}

/* Negative control of the above: sums that went through float32, as images have them, and another
 * seed do not give the same bits. */
TEST(rounded_state_differs)
{
    struct fixture f;
    rare_bright_samples(&f);
    struct render_options half = options_of(11), all = options_of(23), other = all;
    other.integrator.sampler.seed++;
    struct film whole = start(&f, &all, NULL, false), film = start(&f, &half, NULL, false);
    for (size_t i = 0; i < 3 * SIZE * SIZE; i++)
        film.m.mean[i] = (float)film.m.mean[i];
    go_on(&f, &all, NULL, &film);
    assert_false(same_films(&whole, &film));
    film_free(&film);
    film = start(&f, &other, NULL, false);
    assert_false(same_films(&whole, &film));
    film_free(&film);
    film_free(&whole);
    drop(&f);
}

static bool near(const double *a, const double *b, size_t num, double tolerance)
{
    for (size_t i = 0; i < num; i++)
        if (!(fabs(a[i] - b[i]) <= tolerance))
            return false;
    return true;
}

/* Counts, targets and first objects are equal; sums agree within the rounding of their additions, no sample being
 * above BRIGHT. */
static bool near_films(const struct film *a, const struct film *b)
{
    enum { SUMS = sizeof(struct first_hit_sums) / sizeof(double) };
    const double eps = 32 * 2.3e-16 * 13;
    size_t n = SIZE * SIZE;
    bool same = same_doubles(a->m.n, b->m.n, n) &&
                near(a->m.mean, b->m.mean, 3 * n, eps * BRIGHT) &&
                near(a->m.m2, b->m.m2, 3 * n, eps * BRIGHT * BRIGHT) &&
                near(a->m.m3, b->m.m3, 3 * n, eps * BRIGHT * BRIGHT * BRIGHT) &&
                near(a->s1, b->s1, n, eps * BRIGHT) && near(a->s2, b->s2, n, eps * BRIGHT * BRIGHT);
    for (size_t p = 0; p < n && same && a->first != NULL; p++)
        same = a->first[p].hits == b->first[p].hits && a->first[p].object == b->first[p].object &&
               near(&a->first[p].hits, &b->first[p].hits, SUMS, eps * 9);
    return same && (a->target == NULL || memcmp(a->target, b->target, n * sizeof *a->target) == 0);
}

/* Samples 5 .. 17 in three ranges, each added row by row to those before, against one render of all: plain, with layers, with a pilot,
 * which decides for all ranges alike. Negative controls: without the second range, which is one sample, and from it on with another seed. */
TEST(ranges_add_up)
{
    const uint32_t at[] = {5, 9, 10, 18};
    struct fixture f;
    struct err e = {0};
    rare_bright_samples(&f);
    for (int mode = 0; mode < 3; mode++)
        for (int bug = 0; bug < 3; bug++) {
            struct render_options o = options_of(18);
            o.pilot_samples = mode == 2 ? 6 : 0;
            o.pilot_tolerance = 0.5;
            o.first_sample = at[0];
            o.num_samples = at[3] - at[0];
            struct film whole = start(&f, &o, NULL, mode == 1), sum = {0};
            for (int r = 0; r < 3; r++) {
                o.first_sample = at[r];
                o.num_samples = at[r + 1] - at[r];
                o.integrator.sampler.seed += bug == 2 && r == 1;
                struct film range = start(&f, &o, NULL, mode == 1);
                if (r == 0) {
                    sum = range;
                    continue;
                }
                for (size_t row = 0; row < SIZE && (bug != 1 || r != 1); row++)
                    MUST(film_merge(&sum, &range, row * SIZE, SIZE, &e));
                film_free(&range);
            }
            assert_true(near_films(&whole, &sum) == (bug == 0));
            film_free(&whole);
            film_free(&sum);
        }
    drop(&f);
}

static void expect_no_state(const char *path, const struct render_id *id, const char *why)
{
    struct err e = {0};
    OWN(film) film;
    assert_true(film_alloc(&film, SIZE, SIZE, false, &e));
    REFUSES(checkpoint_read(path, id, &film, &e), why);
    assert_memory_equal(e.msg, path, strlen(path));
}

TEST(bad_states)
{
    const char *path = test_path("bad.state");
    struct err e = {0};
    OWN(film) film;
    expect_no_state(path, &some_id, "No such file");
    assert_true(film_alloc(&film, SIZE, SIZE, false, &e));
    assert_true(checkpoint_write(path, &some_id, &film, &e));
    struct render_id id = some_id;
    strcpy(id.seed, "78");
    expect_no_state(path, &id, "'seed 77' there, 'seed 78' here");
    id = some_id;
    strcpy(id.cell, "0 0 32 32 of 64 32");
    expect_no_state(path, &id, "cell");
    id = some_id;
    id.first_sample = 9;
    expect_no_state(path, &id, "first sample");
    /* One bit of one sum; a byte too many; cut in the sums; cut in the head; not a state. */
    FILE *f = fopen(path, "r+b");
    assert_non_null(f);
    fseek(f, 5000, SEEK_SET);
    int c = getc(f);
    fseek(f, 5000, SEEK_SET);
    putc(c ^ 1, f);
    fflush(f);
    expect_no_state(path, &some_id, "damaged");
    fseek(f, 5000, SEEK_SET);
    putc(c, f);
    fseek(f, 0, SEEK_END);
    putc('x', f);
    fflush(f);
    expect_no_state(path, &some_id, "damaged");
    assert_int_equal(ftruncate(fileno(f), 3000), 0);
    expect_no_state(path, &some_id, "damaged");
    assert_int_equal(ftruncate(fileno(f), 40), 0);
    expect_no_state(path, &some_id, "not a state file");
    rewind(f);
    putc('Z', f);
    fflush(f);
    expect_no_state(path, &some_id, "not a state file");
    fclose(f);
}

/* The relative error against two passes over the same numbers; and a render that stops by it stops at the
 * same sample on any number of threads, at the first multiple of 16 that is good enough. */
TEST(stops_by_error)
{
    struct fixture f;
    rare_bright_samples(&f);
    struct render_options o = options_of(4096);
    struct render_control c = {.max_error = 0.5};
    struct film film = start(&f, &o, &c, false);
    uint32_t n = film.num_samples;
    /* In expectation 7/sqrt(n)/2 = 0.5 at n = 49; the estimate over 1024 pixels varies by a few per
     * cent. */
    assert_true(n == 48 || n == 64);
    assert_true(film_relative_error(&film) <= 0.5);
    double squares = 0, luminance = 0;
    for (size_t p = 0; p < SIZE * SIZE; p++) {
        squares += moments_var_of_mean(&film.m, p, 1); /* grey: luminance is any channel */
        luminance += film.m.mean[3 * p + 1];
    }
    double pixels = SIZE * SIZE, expected = sqrt(squares / pixels) / (luminance / pixels);
    assert_true(fabs(film_relative_error(&film) - expected) < 1e-6 * expected);
    film_free(&film);
    o.threads = 1;
    film = start(&f, &o, &c, false);
    assert_true(film.num_samples == n);
    film_free(&film);
    o.num_samples = n - 16;
    film = start(&f, &o, NULL, false);
    assert_true(film_relative_error(&film) > 0.5);
    film_free(&film);
    drop(&f);
}

TEST(stops_by_time)
{
    struct fixture f;
    rare_bright_samples(&f);
    struct render_options o = options_of(1 << 24);
    struct render_control c = {.max_seconds = 0.2};
    OWN(film) film;
    struct err e = {0};
    assert_true(film_alloc(&film, SIZE, SIZE, false, &e));
    struct render_stats stats = go_on(&f, &o, &c, &film);
    assert_true(stats.end == RENDER_TIME && film.num_samples >= 1);
    for (size_t p = 0; p < SIZE * SIZE; p++)
        assert_true(film.m.n[p] == film.num_samples);
    drop(&f);
}

struct estimate {
    double mean, std_error; /* of the mean over the pixels, which are independent and alike */
    double count;
};

static struct estimate over_pixels(const struct film *film)
{
    double n = SIZE * SIZE, s1 = 0, s2 = 0, count = 0;
    for (size_t p = 0; p < SIZE * SIZE; p++) {
        s1 += film->m.mean[3 * p];
        s2 += film->m.mean[3 * p] * film->m.mean[3 * p];
        count += film->m.n[p];
    }
    return (struct estimate){s1 / n, sqrt((s2 / n - s1 / n * s1 / n) / (n - 1)), count / n};
}

enum { BATCH = 32, BATCHES = 32 };
#define TOLERANCE 0.25

/* Expected mean and count of one pixel under the assignment's rule, exactly: the distribution of the
 * number k of bright samples of the pixels that still go on, batch by batch. The rule reads
 * (1.96/tol)^2 s^2 <= n mean^2 with mean = 1 + 50 k/n and s^2 = 2500 k (n-k) / (n (n-1)). */
static struct estimate rule_in_closed_form(void)
{
    static double on[BATCH * BATCHES + 1], next[BATCH * BATCHES + 1];
    double mean = 0, count = 0, binomial[BATCH + 1];
    for (int j = 0; j <= BATCH; j++)
        binomial[j] = exp(lgamma(BATCH + 1) - lgamma(j + 1) - lgamma(BATCH - j + 1) +
                          j * log(PART) + (BATCH - j) * log1p(-PART));
    on[0] = 1;
    for (int b = 1; b <= BATCHES; b++) {
        int n = b * BATCH;
        memset(next, 0, sizeof next);
        for (int k = 0; k <= n - BATCH; k++)
            for (int j = 0; j <= BATCH; j++)
                next[k + j] += on[k] * binomial[j];
        for (int k = 0; k <= n; k++) {
            double m = DIM + (BRIGHT - DIM) * k / n;
            double s2 = 2500.0 * k * (n - k) / ((double)n * (n - 1));
            bool stops = 1.96 * 1.96 * s2 <= TOLERANCE * TOLERANCE * n * m * m || b == BATCHES;
            mean += stops ? next[k] * m : 0;
            count += stops ? next[k] * n : 0;
            on[k] = stops ? 0 : next[k];
        }
    }
    return (struct estimate){.mean = mean, .count = count};
}

/* H0: the mean over 1024 independent pixels is 2. Two-sided z at alpha = 1e-3 (3.29). The rule stops more
 * than half of the pixels after 32 dim samples; its bias (-0.50, by the closed form) is 29 standard
 * errors, so it is rejected with power 1: that is the negative control. The pilot's mean must not be
 * rejected; its standard error is near 0.03, so half of the rule's bias would be found with power 1 - 1e-6, a tenth
 * of it hardly ever. */
TEST(rule_is_biased_and_pilot_is_not)
{
    const double truth = DIM + PART * (BRIGHT - DIM);
    struct fixture f;
    rare_bright_samples(&f);
    struct render_options o = options_of(BATCH * BATCHES);
    o.adaptive_batch = BATCH;
    o.adaptive_tolerance = TOLERANCE;
    struct film film = start(&f, &o, NULL, false);
    struct estimate rule = over_pixels(&film), exact = rule_in_closed_form();
    print_message("rule: %.3f +- %.3f, closed form %.3f, n %.0f and %.0f\n", rule.mean,
                  rule.std_error, exact.mean, rule.count, exact.count);
    assert_true(fabs(rule.mean - truth) > 3.29 * rule.std_error);
    assert_true(rule.mean < truth);
    assert_true(fabs(rule.mean - exact.mean) < 3.29 * rule.std_error);
    for (size_t p = 0; p < SIZE * SIZE; p++)
        assert_true(fmod(film.m.n[p], BATCH) == 0);
    film_free(&film);

    o.adaptive_batch = 0;
    o.pilot_samples = BATCH;
    o.pilot_tolerance = TOLERANCE;
    film = start(&f, &o, NULL, false);
    struct estimate pilot = over_pixels(&film);
    print_message("pilot: %.3f +- %.3f, n %.0f\n", pilot.mean, pilot.std_error, pilot.count);
    assert_true(fabs(pilot.mean - truth) < 3.29 * pilot.std_error);
    for (size_t p = 0; p < SIZE * SIZE; p++)
        assert_true(film.m.n[p] == film.target[p] && film.m.n[p] >= BATCH &&
                    film.m.n[p] <= BATCH * BATCHES);
    /* It does spend unevenly, so the test above is about adaptive sampling. */
    assert_true(pilot.count > 1.5 * BATCH && pilot.count < 0.9 * BATCH * BATCHES);

    /* A share of the samples obeys the same decisions. */
    struct render_options share = o;
    share.first_sample = 40;
    share.num_samples = 100;
    OWN(film) part = start(&f, &share, NULL, false);
    for (size_t p = 0; p < SIZE * SIZE; p++) {
        double n = film.m.n[p] - 40;
        assert_true(part.target[p] == film.target[p]);
        assert_true(part.m.n[p] == (n < 0 ? 0 : n > 100 ? 100 : n));
    }
    film_free(&film);
    drop(&f);
}

/* A wall that fills the left half of the view, parallel to the image, 3 away from a camera that looks along
 * -X: depth 3 everywhere on it, whatever the angle; normal towards the camera. */
TEST(layers_of_a_wall)
{
    struct fixture f = {.scene = build_scene()};
    uint32_t m = build_material(&f.scene, (rgb){0.25f, 0.5f, 0.75f}, grey(1));
    build_quad(&f.scene, v3(50, 50, 50), v3(1, 0, 0), v3(0, 1, 0), m);
    /* Seen from +X with Y up, right is -Z: the left half is z > 0.3. */
    build_quad(&f.scene, v3(-2, -30, 0.3f), v3(0, 60, 0), v3(0, 0, 30), m);
    build_camera(&f.scene, v3(1, 0, 0), 60);
    f.scene.camera.backward = v3(1, 0, 0);
    f.scene.camera.right = v3(0, 0, -1);
    finish(&f, SIZE, SIZE);
    struct render_options o = options_of(16);
    struct film film = start(&f, &o, NULL, true), without = start(&f, &o, NULL, false);
    assert_true(same_doubles(film.m.m3, without.m.m3, 3 * SIZE * SIZE));
    struct err e = {0};
    OWN(image) im;
    assert_true(film_layers(&film, &im, &e));
    const float *z = im.data + image_channel(&im, "depth.Z");
    const float *hits = im.data + image_channel(&im, "depth.hits");
    const float *normal = im.data + image_channel(&im, "normal.X");
    const float *albedo = im.data + image_channel(&im, "albedo.R");
    const float *id = im.data + image_channel(&im, "id.object");
    const float *variance = im.data + image_channel(&im, "variance.R");
    int seen[3] = {0};
    for (size_t p = 0; p < SIZE * SIZE; p++) {
        size_t i = NUM_LAYERS * p;
        float part = hits[i] / 16;
        seen[part == 0 ? 0 : part == 1 ? 2 : 1]++;
        assert_true(part == 0 ? z[i] == 1e10f : fabsf(z[i] - 3) < 1e-5f);
        assert_true(normal[i] == part && normal[i + 1] == 0 && normal[i + 2] == 0);
        assert_true(albedo[i] == 0.25f * part && albedo[i + 2] == 0.75f * part);
        assert_true(part == 0 ? id[i] == 0 : part == 1 ? id[i] == 2 : id[i] == 0 || id[i] == 2);
        /* Emission 1 or nothing: a Bernoulli law, n/(n-1) p(1-p). */
        assert_true(fabsf(variance[i] - part * (1 - part) * 16 / 15) < 1e-6f);
        assert_true(fabsf(variance[i + 3] - sqrtf(variance[i] / 16)) < 1e-6f);
    }
    /* The edge, 0.3/3 from the middle of an image 2 tan(30 deg) wide, crosses one column of pixels. */
    assert_true(seen[0] > 500 && seen[1] == SIZE && seen[2] > 300);
    film_free(&film);
    film_free(&without);
    drop(&f);
}

/* The albedo layer is the reflectance at normal incidence, whatever the view: of a metal
 * ((eta-1)^2 + k^2)/((eta+1)^2 + k^2), of glass R x reflectance + (1 - R) x transmittance, R = ((n-1)/(n+1))^2. */
TEST(albedo_layer_of_materials)
{
    static const struct {
        struct material m;
        double albedo[3];
    } of[] = {{{.kind = MATERIAL_DIFFUSE, .reflectance = {0.1f, 0.2f, 0.3f}}, {0.1, 0.2, 0.3}},
              {{.kind = MATERIAL_MIRROR, .reflectance = {0.1f, 0.2f, 0.3f}}, {0.1, 0.2, 0.3}},
              {{.kind = MATERIAL_REFRACTION, .transmittance = {0.1f, 0.2f, 0.3f}, .ior = 1.5f},
               {0.1, 0.2, 0.3}},
              /* R = 1/25 */
              {{.kind = MATERIAL_GLASS,
                .reflectance = {1, 0.5f, 0},
                .transmittance = {0.5f, 1, 0.25f},
                .ior = 1.5f},
               {0.04 + 0.48, 0.02 + 0.96, 0.24}},
              /* (1 + 9)/(9 + 9), 0/(4 + 0), (0.25 + 1)/(6.25 + 1) */
              {{.kind = MATERIAL_MICROFACET,
                .conductor = true,
                .eta = {2, 1, 1.5f},
                .k = {3, 0, 1},
                .alpha = 0.3f},
               {10.0 / 18, 0, 1.25 / 7.25}},
              {{.kind = MATERIAL_PLASTIC,
                .reflectance = {0.1f, 0.2f, 0.3f},
                .specular = {0.2f, 0.2f, 0.1f},
                .mirror = {0.1f, 0, 0.2f},
                .alpha = 0.3f},
               {0.4, 0.4, 0.6}}};
    for (size_t i = 0; i < COUNT(of); i++) {
        struct fixture f = {.scene = build_scene()};
        build_quad(&f.scene, v3(-30, -30, -3), v3(60, 0, 0), v3(0, 60, 0),
                   build_like(&f.scene, of[i].m));
        build_camera(&f.scene, v3(0, 0, 0), 60);
        finish(&f, SIZE, SIZE);
        struct render_options o = options_of(2);
        OWN(film) film = start(&f, &o, NULL, true);
        struct err e = {0};
        OWN(image) im;
        MUST(film_layers(&film, &im, &e));
        const float *albedo = im.data + image_channel(&im, "albedo.R");
        for (size_t p = 0; p < SIZE * SIZE; p++)
            for (size_t c = 0; c < 3; c++)
                assert_near(albedo[NUM_LAYERS * p + c], of[i].albedo[c], 1e-6);
        drop(&f);
    }
}

/* Seen normals as colours, (n + 1)/2: of a triangle towards the camera, interpolated to (0.6, -0.48, 0.64); of a ball around
 * the camera, inwards, -d; and black where nothing is. */
TEST(normals_as_colours)
{
    for (int what = 0; what < 3; what++) {
        struct fixture f = {.scene = build_scene()};
        uint32_t m = build_material(&f.scene, grey(0.5f), grey(0));
        build_quad(&f.scene, v3(-30, -30, what == 2 ? 3 : -3), v3(60, 0, 0), v3(0, 60, 0), m);
        for (int k = 0; k < 6; k++)
            f.scene.normal[k] = v3(0.6f, -0.48f, 0.64f);
        if (what == 1)
            build_sphere(&f.scene, v3(0, 0, 0), 1, -1, m);
        build_camera(&f.scene, v3(0, 0, 0), 2);
        finish(&f, SIZE, SIZE);
        struct render_options o = options_of(1);
        o.integrator.kind = INTEGRATE_NORMALS;
        OWN(film) film = start(&f, &o, NULL, false);
        const double colour[3][3] = {{0.8, 0.26, 0.82}, {0.5, 0.5, 1}, {0, 0, 0}};
        for (size_t p = 0; p < SIZE * SIZE; p++)
            for (size_t c = 0; c < 3; c++) /* of the ball within an image of 2 degrees */
                assert_near(film.m.mean[3 * p + c], colour[what][c], what == 1 ? 0.02 : 1e-6);
        drop(&f);
    }
}

/* Lightness by another formula than the one the map is made with: CIE L*, which Oklab's follows closely. */
static double cie_lightness(const uint8_t rgb8[3])
{
    double y = 0;
    static const double weight[3] = {0.2126, 0.7152, 0.0722};
    for (int c = 0; c < 3; c++) {
        double v = rgb8[c] / 255.0;
        y += weight[c] * (v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4));
    }
    return y > 0.008856 ? 116 * cbrt(y) - 16 : 903.3 * y;
}

TEST(heatmap_of_one_triangle)
{
    double last = -1;
    for (int i = 0; i <= 20; i++) {
        uint8_t c[3];
        heatmap_colour(i / 20.0, c);
        double lightness = cie_lightness(c);
        if (i > 0)
            assert_true(lightness - last > 2 && lightness - last < 8);
        last = lightness;
    }
    /* One primitive is one node; a ray that leaves it aside visits it too. */
    struct fixture f = {.scene = build_scene()};
    uint32_t m = build_material(&f.scene, grey(0.5f), grey(1));
    build_triangle(&f.scene, v3(0, 0, -1), v3(1, 0, -1), v3(0, 1, -1), m);
    build_camera(&f.scene, v3(0, 0, 0), 60);
    finish(&f, 8, 4);
    const char *path = test_path("heat.png");
    struct err e = {0};
    OWN(image) im;
    uint64_t most;
    MUST(heatmap_write(path, f.bvh, &f.camera, 1, 0, 7, 4, &most, &e) &&
         image_read(path, &im, NULL, &e));
    uint8_t top[3];
    heatmap_colour(1, top);
    assert_true(most == 1 && im.width == 7 && im.height == 4);
    for (size_t i = 0; i < 3 * 7 * 4; i++)
        assert_true(fabsf(im.data[i] * 255 - top[i % 3]) < 0.01f);
    unlink(path);
    drop(&f);
}
