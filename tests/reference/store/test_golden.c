/* Stored references: what was written comes back, and nothing else is accepted. Seeds of replicates.
 */
#include "reference/store/reference_render.h"
#include "renderer/base/sha256.h"
#include "renderer/base/fs.h"
#include "reference/base/json_file.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

enum { WIDTH = 4, HEIGHT = 2, REPLICATES = 3, SPP = 16 };

struct fixture {
    char dir[64], exr[128], json[128];
    struct suite_scene scene;
    struct suite_reference ref;
    struct moments m;
    json_t *manifest;
};

static int setup(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    struct err e;
    strcpy(f->dir, "/tmp/test_golden.XXXXXX");
    assert_non_null(mkdtemp(f->dir));
    snprintf(f->exr, sizeof f->exr, "%s/12_plane/cycles.exr", f->dir);
    snprintf(f->json, sizeof f->json, "%s/12_plane/manifest.json", f->dir);
    f->scene = (struct suite_scene){
        .name = "12_plane", .sha256 = "abc", .width = WIDTH, .height = HEIGHT, .depth = 5};
    f->ref = (struct suite_reference){.engine = "cycles", .replicates = REPLICATES, .spp = SPP};
    assert_true(moments_alloc(&f->m, WIDTH, HEIGHT, &e));
    strcpy(f->m.unit, "replicate");
    f->m.spp = SPP;
    for (int k = 0; k < REPLICATES; k++) {
        float rgb_image[3 * WIDTH * HEIGHT];
        for (int i = 0; i < 3 * WIDTH * HEIGHT; i++)
            rgb_image[i] = (float)(i + k * k);
        moments_add_image(&f->m, rgb_image);
    }
    f->manifest =
        json_pack("{ss,ss,ss,ss,si,si,si,si,si,si}", "scene", "12_plane", "scene_sha256", "abc",
                  "engine", "cycles", "unit", "replicate", "width", WIDTH, "height", HEIGHT,
                  "depth", 5, "replicates", REPLICATES, "spp", SPP, "subgrid", 0);
    assert_non_null(f->manifest);
    *state = f;
    return 0;
}

static int teardown(void **state)
{
    struct fixture *f = *state;
    struct err e;
    bool ok = fs_remove_tree(f->dir, &e);
    moments_free(&f->m);
    json_decref(f->manifest);
    free(f);
    return ok ? 0 : -1;
}

#define STORE(name) TEST_OF(fixture, name, setup, teardown)

static void write_golden(struct fixture *f)
{
    struct err e;
    MUST(golden_write(f->dir, "12_plane", "cycles", &f->m, f->manifest, &e));
}

static void assert_refused(struct fixture *f, const char *why)
{
    struct err e = {""};
    struct moments m;
    json_t *manifest;
    REFUSES(golden_read(f->dir, &f->scene, &f->ref, &m, &manifest, &e), why);
}

STORE(what_was_written_comes_back)
{
    struct err e;
    OWN(moments) m;
    json_t *manifest;
    write_golden(f);
    MUST(golden_read(f->dir, &f->scene, &f->ref, &m, &manifest, &e));
    assert_int_equal(m.width, WIDTH);
    assert_int_equal(m.height, HEIGHT);
    assert_string_equal(m.unit, "replicate");
    /* Observations i, i+1, i+4: mean i + 5/3, M2 = 26/3 by hand. */
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++) {
        assert_float_equal(m.mean[i], i + 5.0 / 3, 1e-5);
        assert_float_equal(m.m2[i], 26.0 / 3, 1e-5);
        assert_true(m.n[i / 3] == REPLICATES);
    }
    assert_string_equal(json_string_value(json_object_get(manifest, "scene")), "12_plane");
    char sha256[65];
    assert_true(sha256_file(f->exr, sha256, &e));
    assert_string_equal(json_string_value(json_object_get(manifest, "exr_sha256")), sha256);
    assert_null(json_object_get(f->manifest, "exr_sha256")); /* the caller's is untouched */
    json_decref(manifest);
}

/* No clock gets into the image: dates are the manifest's. */
STORE(the_same_moments_have_the_same_bytes)
{
    struct err e;
    char first[65], second[65];
    write_golden(f);
    assert_true(sha256_file(f->exr, first, &e));
    sleep(1);
    write_golden(f);
    assert_true(sha256_file(f->exr, second, &e));
    assert_string_equal(first, second);
}

STORE(engines_share_a_manifest)
{
    struct err e;
    OWN(moments) m;
    json_t *manifest;
    write_golden(f);
    json_t *other = json_deep_copy(f->manifest);
    json_object_set_new(other, "engine", json_string("povray"));
    assert_true(golden_write(f->dir, "12_plane", "povray", &f->m, other, &e));
    json_decref(other);
    write_golden(f); /* again: replaces its own entry only */
    strcpy(f->ref.engine, "povray");
    assert_true(golden_read(f->dir, &f->scene, &f->ref, &m, &manifest, &e));
    json_decref(manifest);
    json_t *all = json_load_file(f->json, 0, NULL);
    assert_int_equal(json_object_size(all), 2);
    json_decref(all);
}

STORE(a_missing_golden_is_named)
{
    assert_refused(f, "cycles.exr: no golden of cycles");
    write_golden(f);
    strcpy(f->ref.engine, "povray");
    assert_refused(f, "povray.exr: no golden of povray");
}

STORE(a_golden_of_another_scene_or_setting_is_refused)
{
    write_golden(f);
    const struct suite_scene scene = f->scene;
    const struct suite_reference ref = f->ref;
    strcpy(f->scene.sha256, "abd");
    assert_refused(f, "stale golden: the scene file has changed");
    f->scene = scene;
    f->scene.depth = 4;
    assert_refused(f, "golden has depth 5, the suite wants 4");
    f->scene = scene;
    f->scene.width = 5;
    assert_refused(f, "golden has width 4, the suite wants 5");
    f->scene = scene;
    f->ref.spp = 32;
    assert_refused(f, "golden has spp 16, the suite wants 32");
    f->ref = ref;
    f->ref.replicates = 4;
    assert_refused(f, "golden has replicates 3, the suite wants 4");
    f->ref = ref;
    f->ref.subgrid = 2;
    assert_refused(f, "golden has subgrid 0, the suite wants 2");
}

/* A new image whose manifest was never written: the state after a crash in golden_write(). */
STORE(an_image_without_its_manifest_is_refused)
{
    struct err e;
    write_golden(f);
    f->m.mean[0] += 1;
    assert_true(moments_write(f->exr, &f->m, NULL, 0, &e));
    assert_refused(f, "cycles.exr: not the image that its manifest describes");
    assert_int_equal(unlink(f->exr), 0);
    assert_refused(f, "cycles.exr: ");
}

static void assert_first_value(struct fixture *f, double want)
{
    struct err e = {""};
    OWN(moments) m;
    json_t *manifest;
    MUST(golden_read(f->dir, &f->scene, &f->ref, &m, &manifest, &e));
    assert_float_equal(m.mean[0], want, 1e-6);
    json_decref(manifest);
}

/* Every state that a kill in golden_write() can leave: the new image waits, the manifest is the old one; the manifest
 * is the new one, the image waits still. Then another update. Mean of pixel 0: 5/3, by hand above. */
STORE(a_killed_update_leaves_the_old_pair_or_the_new)
{
    char next[160], old[160];
    snprintf(next, sizeof next, "%s.next", f->exr);
    snprintf(old, sizeof old, "%s.old", f->exr);
    write_golden(f);
    assert_int_equal(rename(f->exr, old), 0);
    f->m.mean[0] += 1;
    write_golden(f);
    assert_true(access(next, F_OK) != 0);
    assert_first_value(f, 5.0 / 3 + 1);
    assert_int_equal(rename(f->exr, next), 0);
    assert_int_equal(rename(old, f->exr), 0);
    assert_first_value(f, 5.0 / 3 + 1);
    f->m.mean[0] += 1;
    write_golden(f);
    assert_first_value(f, 5.0 / 3 + 2);
    assert_true(access(next, F_OK) != 0);
    struct err e;
    assert_true(moments_write(next, &f->m, NULL, 0, &e));
    assert_first_value(f, 5.0 / 3 + 2);
    /* Without a further update the interrupted one is completed; where none was interrupted, nothing happens. */
    assert_int_equal(rename(f->exr, old), 0);
    f->m.mean[0] += 1;
    write_golden(f);
    assert_int_equal(rename(f->exr, next), 0);
    assert_int_equal(rename(old, f->exr), 0);
    assert_true(golden_settle(f->dir, "12_plane", "cycles", &e));
    assert_true(access(next, F_OK) != 0);
    assert_first_value(f, 5.0 / 3 + 3);
    f->m.mean[0] += 1;
    assert_true(moments_write(next, &f->m, NULL, 0, &e));
    assert_true(golden_settle(f->dir, "12_plane", "cycles", &e));
    assert_true(access(next, F_OK) != 0);
    assert_first_value(f, 5.0 / 3 + 3);
    assert_true(golden_settle(f->dir, "12_plane", "cycles", &e));
    assert_true(moments_write(next, &f->m, NULL, 0, &e));
    assert_true(golden_remove(f->dir, "12_plane", "cycles", &e));
    assert_true(access(next, F_OK) != 0);
}

STORE(a_broken_manifest_is_an_error_and_is_not_overwritten)
{
    struct err e;
    write_golden(f);
    test_write_json(f->json, "{\n'cycles': ");
    assert_refused(f, "manifest.json:2: ");
    REFUSES(golden_write(f->dir, "12_plane", "cycles", &f->m, f->manifest, &e),
            "manifest.json:2: ");
    test_write_text(f->json, "[]");
    assert_refused(f, "manifest.json: not a JSON object");
    test_write_json(f->json, "{'cycles': {}}");
    assert_refused(f, "'scene_sha256' is missing");
    test_write_json(f->json, "{'cycles': {'scene_sha256': 'abc', 'engine': 'cycles'}}");
    assert_refused(f, "'width' is missing");
}

/* Both hashes match, but the image's observations are not those that its manifest states. */
STORE(an_image_that_contradicts_its_manifest_is_refused)
{
    f->m.n[3] = 2;
    write_golden(f);
    assert_refused(f, "pixel 3 holds 2 observations, not 3");
    f->m.n[3] = 3;
    strcpy(f->m.unit, "sample");
    write_golden(f);
    assert_refused(f, "its unit is not that of its manifest");
}

STORE(a_closed_form_with_other_numbers_is_refused)
{
    struct err e;
    OWN(moments) m;
    json_t *back, *one = json_pack("{sf}", "radiance", 1.0),
                  *two = json_pack("{sf}", "radiance", 2.0);
    strcpy(f->ref.engine, "truth");
    strcpy(f->ref.kind, "constant");
    f->ref.values = one;
    strcpy(f->m.unit, "exact");
    for (int p = 0; p < WIDTH * HEIGHT; p++)
        f->m.n[p] = 1;
    json_object_set_new(f->manifest, "engine", json_string("truth"));
    json_object_set_new(f->manifest, "unit", json_string("exact"));
    json_object_set_new(f->manifest, "kind", json_string("constant"));
    json_object_set(f->manifest, "values", one);
    assert_true(golden_write(f->dir, "12_plane", "truth", &f->m, f->manifest, &e));
    MUST(golden_read(f->dir, &f->scene, &f->ref, &m, &back, &e));
    json_decref(back);
    f->ref.values = two;
    assert_refused(f, "the closed form's values have changed");
    f->ref.values = one;
    strcpy(f->ref.kind, "other");
    assert_refused(f, "golden of another closed form");
    json_decref(one);
    json_decref(two);
}

static int compare_seeds(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return x < y ? -1 : x > y;
}

/* 31 bits, never 0, and no two replicates of one run alike. */
TEST(seeds_are_distinct_and_in_range)
{
    enum { COUNT = 100000 };
    static const uint32_t seeds[] = {0, 1, 2, 0x7fffffff, 0xffffffff, 12345};
    uint32_t *x = malloc(COUNT * sizeof *x);
    for (size_t s = 0; s < sizeof seeds / sizeof *seeds; s++) {
        for (int k = 0; k < COUNT; k++) {
            x[k] = replicate_seed(seeds[s], k);
            assert_in_range(x[k], 1, 0x7fffffff);
        }
        qsort(x, COUNT, sizeof *x, compare_seeds);
        for (int k = 1; k < COUNT; k++)
            assert_int_not_equal(x[k], x[k - 1]);
    }
    free(x);
}

/* H0: the bits of seeds that belong to neighbouring k, or neighbouring runs, are independent coins.
 * Each of 31 bits differs between the two in n = 20000 pairs with probability 1/2: |z| < 5.5 for all
 * 62 counts, alpha = 62 * 3.8e-8 = 2.4e-6. A bit that agrees in 55 % of the pairs has z = 14. The
 * negative control is the seed that just adds: its lowest bit always differs. */
static double worst_bit(uint32_t (*next)(int i), int n)
{
    double worst = 0;
    for (int bit = 0; bit < 31; bit++) {
        int differ = 0;
        for (int i = 0; i < n; i++)
            differ += (next(2 * i) ^ next(2 * i + 1)) >> bit & 1;
        double z = (differ - 0.5 * n) / (0.5 * sqrt(n));
        worst = fmax(worst, fabs(z));
    }
    return worst;
}

static uint32_t next_replicate(int i)
{
    return replicate_seed(1, i);
}
static uint32_t next_run(int i)
{
    return replicate_seed((uint32_t)i, 0);
}
static uint32_t next_sum(int i)
{
    return (uint32_t)i + 1;
}

TEST(neighbouring_seeds_have_nothing_in_common)
{
    assert_true(worst_bit(next_replicate, 20000) < 5.5);
    assert_true(worst_bit(next_run, 20000) < 5.5);
    assert_true(worst_bit(next_sum, 20000) > 5.5);
}

STORE(a_reference_that_cannot_be_made_says_which)
{
    struct err e;
    struct moments m;
    json_t *manifest;
    struct reference_options opt = {
        .seed = 1, .threads = 1, .work_dir = f->dir, .share_dir = "reference"};
    strcpy(f->ref.engine, "mental_ray");
    assert_false(reference_render(&f->scene, &f->ref, &opt, &m, &manifest, &e));
    assert_string_equal(e.msg, "12_plane: unknown reference engine 'mental_ray'");
    strcpy(f->ref.engine, "cycles");
    strcpy(f->scene.dae, "/assay/none.dae");
    REFUSES(reference_render(&f->scene, &f->ref, &opt, &m, &manifest, &e),
            "12_plane, cycles: /assay/none.dae");
    assert_null(strstr(e.msg, "see ")); /* an empty directory is not kept */
    opt.work_dir = "/assay/none";
    REFUSES(reference_render(&f->scene, &f->ref, &opt, &m, &manifest, &e),
            "/assay/none: cannot make a directory in it: ");
}
