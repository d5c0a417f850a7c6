/* What may replace a stored reference: candidates whose truth is known, since they are drawn here. */
#include "reference/base/json_file.h"
#include "reference/base/process.h"
#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"
#include "tools/golden/approve.h"
#include "tests/support/simulate.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

enum { SIDE = 64, REPLICATES = 16 };

struct fixture {
    char dir[64], from[96], golden[96];
    struct suite_scene scene;
    struct suite_reference ref;
    struct approve_options opt;
    bool is_noisy;   /* render() writes single images of unknown noise */
    char said[4096]; /* what the last approve() printed */
    struct err e;
};

static int setup(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    static int number;
    struct err e;
    char name[16];
    snprintf(name, sizeof name, "%d", number++);
    snprintf(f->dir, sizeof f->dir, "%s", test_path(name));
    MUST(fs_make_dirs(f->dir, &e));
    snprintf(f->from, sizeof f->from, "%s/from", f->dir);
    snprintf(f->golden, sizeof f->golden, "%s/golden", f->dir);
    f->scene = (struct suite_scene){.name = "12_plane",
                                    .references_of = "12_plane",
                                    .sha256 = "abc",
                                    .width = SIDE,
                                    .height = SIDE,
                                    .depth = 5,
                                    .tile = 16};
    f->ref = (struct suite_reference){.engine = "cycles",
                                      .replicates = REPLICATES,
                                      .spp = 4,
                                      .margin_global = 0.02,
                                      .margin_tile = 0.1};
    f->scene.reference[0] = f->ref;
    f->scene.num_references = 1;
    f->opt = (struct approve_options){.from_dir = f->from, .golden_dir = f->golden, .alpha = 1e-3};
    *state = f;
    return 0;
}

static int teardown(void **state)
{
    free(*state);
    return 0;
}

static void render_many(struct fixture *f, const char *dir, double scale, int replicates,
                        uint64_t seed)
{
    OWN(moments) m = new_moments(f->scene.width, f->scene.height, "replicate");
    simulate(&m, LAW_NORMAL, scale, replicates, true, &seed);
    m.spp = 4;
    if (f->is_noisy) {
        size_t pixels = (size_t)m.width * (size_t)m.height;
        strcpy(m.unit, "picture");
        memset(m.m2, 0, 3 * pixels * sizeof *m.m2);
        memset(m.m3, 0, 3 * pixels * sizeof *m.m3);
        for (size_t p = 0; p < pixels; p++)
            m.n[p] = 3;
    }
    json_auto_t *manifest = json_pack(
        "{ss,ss,ss,ss,si,si,si,si,si,si,sI,ss,ss,s[I]}", "scene", "12_plane", "scene_sha256",
        f->scene.sha256, "engine", f->ref.engine, "unit", m.unit, "width", m.width, "height",
        m.height, "depth", 5, "replicates", replicates, "spp", 4, "subgrid", 0, "seed",
        (json_int_t)seed, "version", "Blender 3.4.1", "key", "k", "seeds", (json_int_t)77);
    struct err e;
    MUST(golden_write(dir, "12_plane", f->ref.engine, &m, manifest, &e));
}

/* Writes a reference of mean `scale` into a directory; noise of 30 % in each of 16 replicates, so one
 * standard error of the image is 0.12 %, of a tile 0.5 %. */
static void render(struct fixture *f, const char *dir, double scale, uint64_t seed)
{
    render_many(f, dir, scale, REPLICATES, seed);
}

static enum approval run(struct fixture *f)
{
    FILE *out = fmemopen(f->said, sizeof f->said, "w");
    f->e = (struct err){0};
    enum approval done = approve(&f->opt, &f->scene, &f->ref, out, &f->e);
    fclose(out);
    return done;
}

static void hash(const char *dir, const char *file, char hex[65])
{
    const struct path path = fs_path("%s/12_plane/%s", dir, file);
    struct err e;
    memset(hex, 0, 65);
    if (access(path.s, F_OK) != 0)
        strcpy(hex, "none");
    else
        MUST(sha256_file(path.s, hex, &e));
}

/* Both files of the store, so that a refusal can be shown to leave them alone. */
static void hash_store(struct fixture *f, char hex[2][65])
{
    hash(f->golden, "cycles.exr", hex[0]);
    hash(f->golden, "manifest.json", hex[1]);
}

static void assert_refused(struct fixture *f, enum approval how, const char *why)
{
    char before[2][65], after[2][65];
    hash_store(f, before);
    assert_int_equal(run(f), how);
    if (strstr(how == APPROVE_IMPOSSIBLE ? f->e.msg : f->said, why) == NULL)
        fail_msg("neither '%s' nor '%s' says '%s'", f->said, f->e.msg, why);
    hash_store(f, after);
    assert_memory_equal(before, after, sizeof before);
}

/* The stored entry's newest change; the caller frees. */
static json_t *last_change(struct fixture *f, size_t count)
{
    json_auto_t *all = json_load_file(fs_path("%s/12_plane/manifest.json", f->golden).s, 0, NULL);
    json_t *changes = json_object_get(json_object_get(all, "cycles"), "changes");
    assert_int_equal(json_array_size(changes), count);
    json_t *last = json_deep_copy(json_array_get(changes, count - 1));
    assert_non_null(json_object_get(last, "date"));
    return last;
}

static void assert_accepted(struct fixture *f, size_t count, const char *verdict)
{
    char candidate[65], stored[65];
    if (run(f) != APPROVE_ACCEPTED)
        fail_msg("refused: %s%s", f->said, f->e.msg);
    hash(f->from, "cycles.exr", candidate);
    hash(f->golden, "cycles.exr", stored);
    assert_string_equal(candidate, stored);
    OWN(golden) g;
    golden_inspect(f->golden, &f->scene, &f->ref, &g);
    assert_int_equal(g.state, GOLDEN_CURRENT);
    json_auto_t *change = last_change(f, count);
    assert_string_equal(json_string_value(json_object_get(change, "verdict")), verdict);
}

TEST_OF(fixture, a_new_one_has_to_be_called_new, setup, teardown)
{
    render(f, f->from, 1, 1);
    f->opt.why = "because";
    assert_refused(f, APPROVE_IMPOSSIBLE, "12_plane/cycles: nothing is stored");
    f->opt.accept_new = true;
    assert_accepted(f, 1, "NEW");
    assert_int_equal(run(f), APPROVE_UNCHANGED); /* the same bits again */
    assert_non_null(strstr(f->said, "IDENTICAL"));
    strcpy(f->scene.sha256, "def"); /* another scene file that changed nothing */
    render(f, f->from, 1, 1);
    assert_accepted(f, 2, "IDENTICAL");
}

/* A kill before the image's last rename: the manifest is the new one, so nothing is left to approve, but the image is not yet
 * in its place. */
TEST_OF(fixture, an_interrupted_approval_is_ended, setup, teardown)
{
    const struct path exr = fs_path("%s/12_plane/cycles.exr", f->golden);
    char old[65], now[65];
    render(f, f->from, 1, 2);
    render(f, f->golden, 1, 2);
    hash(f->golden, "cycles.exr", old);
    assert_int_equal(rename(exr.s, fs_path("%s.next", exr.s).s), 0);
    test_write(exr.s, "", 0);
    assert_int_equal(run(f), APPROVE_UNCHANGED);
    hash(f->golden, "cycles.exr", now);
    assert_string_equal(now, old);
    hash(f->golden, "cycles.exr.next", now);
    assert_string_equal(now, "none");
}

TEST_OF(fixture, other_seeds_are_accepted_with_their_effect, setup, teardown)
{
    render(f, f->golden, 1, 1);
    render(f, f->from, 1, 2);
    assert_accepted(f, 1, "EQUIVALENT");
    assert_non_null(strstr(f->said, "difference "));
    assert_non_null(strstr(f->said, "smallest detectable: image "));
    assert_non_null(strstr(f->said, "stored    Blender 3.4.1, 1 seeds of seed "));
    json_auto_t *change = last_change(f, 1);
    double d = json_number_value(json_object_get(change, "difference"));
    json_t *ci = json_object_get(change, "ci");
    /* Both means are 1 up to 0.12 %: five standard errors of their difference. */
    assert_float_equal(d, 0, 0.0085);
    assert_true(json_number_value(json_array_get(ci, 0)) < d &&
                d < json_number_value(json_array_get(ci, 1)));
    assert_string_equal(
        json_string_value(json_object_get(json_object_get(change, "was"), "scene_sha256")), "abc");
}

TEST_OF(fixture, a_difference_needs_a_reason, setup, teardown)
{
    render(f, f->golden, 1, 1);
    render(f, f->from, 1.1, 2);
    f->opt.accept_new = true;
    assert_refused(f, APPROVE_DIFFERENT, "--accept-difference");
    assert_non_null(strstr(f->said, "DIFFERENT"));
    f->opt.why = "the lamp is brighter now";
    assert_accepted(f, 1, "DIFFERENT");
    json_auto_t *change = last_change(f, 1);
    assert_string_equal(json_string_value(json_object_get(change, "why")),
                        "the lamp is brighter now");
    assert_float_equal(json_number_value(json_object_get(change, "difference")), 0.1, 0.01);
    f->opt.why = NULL;
    render(f, f->from, 1.1, 3);
    assert_accepted(f, 2, "EQUIVALENT"); /* the log goes on */
}

static enum verdict compared(struct fixture *f)
{
    char before[2][65], after[2][65];
    enum verdict verdict = VERDICT_INCONCLUSIVE;
    struct err e;
    FILE *out = fmemopen(f->said, sizeof f->said, "w");
    hash_store(f, before);
    MUST(approve_compare(&f->opt, &f->scene, &f->ref, out, &verdict, &e));
    fclose(out);
    hash_store(f, after);
    assert_memory_equal(before, after, sizeof before);
    return verdict;
}

/* Nothing is stored; the difference put there is found, and what is missing is said. */
TEST_OF(fixture, a_table_compares_without_storing, setup, teardown)
{
    enum verdict verdict;
    struct err e;
    render(f, f->golden, 1, 1);
    REFUSES(approve_compare(&f->opt, &f->scene, &f->ref, stderr, &verdict, &e), "missing in ");
    render(f, f->from, 1, 1);
    assert_int_equal(compared(f), VERDICT_EQUIVALENT);
    assert_non_null(strstr(f->said, "the same bits"));
    render(f, f->from, 1, 2);
    assert_int_equal(compared(f), VERDICT_EQUIVALENT);
    render(f, f->from, 1.1, 2);
    assert_int_equal(compared(f), VERDICT_DIFFERENT);
    assert_non_null(strstr(f->said, "Blender 3.4.1"));
    assert_non_null(strchr(f->said, '+'));
    assert_float_equal(strtod(strchr(f->said, '+'), NULL), 10, 1); /* % */
}

/* Equal means, but margins far below what can be resolved with the noise of the two. */
TEST_OF(fixture, an_inconclusive_one_is_refused_whatever_is_said, setup, teardown)
{
    render(f, f->golden, 1, 1);
    render(f, f->from, 1, 2);
    f->ref.margin_global = 0.001;
    f->ref.margin_tile = 0.004;
    f->opt.accept_new = true;
    f->opt.why = "I want it";
    assert_refused(f, APPROVE_INCONCLUSIVE, "INCONCLUSIVE");
}

/* The same with more replicates: refused with what would help, until it has enough samples and a reason is given. */
TEST_OF(fixture, an_undecided_one_with_more_samples_may_replace_a_noisy_one, setup, teardown)
{
    render(f, f->golden, 1, 1);
    f->ref.margin_global = 0.001;
    f->ref.margin_tile = 0.004;
    f->opt.why = "the stored one is too noisy";
    f->ref.replicates = 19;
    render_many(f, f->from, 1, 19, 2);
    assert_refused(f, APPROVE_INCONCLUSIVE,
                   "at least 1.25 times its samples (it has 16 replicates of 4)");
    f->ref.replicates = 40;
    render_many(f, f->from, 1, 40, 2);
    f->opt.why = NULL;
    assert_refused(f, APPROVE_BETTER, "the candidate has 2.5 times the samples");
    f->opt.why = "the stored one is too noisy";
    assert_accepted(f, 1, "INCONCLUSIVE");
    json_auto_t *change = last_change(f, 1);
    assert_string_equal(json_string_value(json_object_get(change, "why")), f->opt.why);
    f->opt.why = NULL; /* many more samples do not excuse a difference */
    f->ref.replicates = 400;
    render_many(f, f->from, 1.1, 400, 3);
    assert_refused(f, APPROVE_DIFFERENT, "--accept-difference");
}

/* What is stored has 64 times the replicates: more of the candidate's decide. */
TEST_OF(fixture, an_undecided_one_is_told_how_many_replicates_it_takes, setup, teardown)
{
    render_many(f, f->golden, 1, 1024, 1);
    render(f, f->from, 1, 2);
    f->ref.margin_global = 0.003;
    f->ref.margin_tile = 0.012;
    assert_refused(f, APPROVE_INCONCLUSIVE, "times the replicates of the candidate would decide");
}

/* Single images of unknown noise, as of a program without seeds: 7.5 % in each pixel of both, which must not pass for a
 * difference; 20 % does. */
TEST_OF(fixture, the_noise_of_single_images_counts, setup, teardown)
{
    f->is_noisy = true;
    render(f, f->golden, 1, 1);
    render(f, f->from, 1, 2);
    assert_int_equal(compared(f), VERDICT_EQUIVALENT);
    assert_accepted(f, 1, "EQUIVALENT");
    json_auto_t *change = last_change(f, 1);
    json_t *ci = json_object_get(change, "ci");
    /* At least two standard errors of 7.5 % sqrt(2) / 64 to each side. */
    assert_true(json_number_value(json_array_get(ci, 1)) -
                    json_number_value(json_array_get(ci, 0)) >
                0.0066);
    render(f, f->from, 1.2, 3);
    assert_refused(f, APPROVE_DIFFERENT, "--accept-difference");
}

TEST_OF(fixture, what_is_missing_or_damaged_is_refused, setup, teardown)
{
    f->opt.accept_new = true;
    f->opt.why = "I want it";
    render(f, f->golden, 1, 1);
    assert_refused(f, APPROVE_IMPOSSIBLE, "no candidate in ");
    render(f, f->from, 1, 2);
    strcpy(f->scene.sha256, "def");
    assert_refused(f, APPROVE_IMPOSSIBLE, "stale candidate");
    strcpy(f->scene.sha256, "abc");
    FILE *out = fopen(fs_path("%s/12_plane/cycles.exr", f->from).s, "ab");
    fputc('x', out);
    fclose(out);
    assert_refused(f, APPROVE_IMPOSSIBLE, "damaged candidate");
    render(f, f->from, 1, 2);
    assert_int_equal(unlink(fs_path("%s/12_plane/cycles.exr", f->golden).s), 0);
    assert_refused(f, APPROVE_IMPOSSIBLE, "nothing to compare with");
}

/* A stale reference is still what a candidate is compared with, unless its size has changed. */
TEST_OF(fixture, a_stale_one_is_what_is_compared_with, setup, teardown)
{
    strcpy(f->scene.sha256, "old");
    render(f, f->golden, 1, 1);
    strcpy(f->scene.sha256, "abc");
    render(f, f->from, 1.1, 2);
    assert_refused(f, APPROVE_DIFFERENT, "DIFFERENT");
    render(f, f->from, 1, 2);
    assert_accepted(f, 1, "EQUIVALENT");
    f->scene.width = 32;
    render(f, f->from, 1, 2);
    assert_refused(f, APPROVE_DIFFERENT, "NOT COMPARABLE: 32 x 64 pixels, stored are 64 x 64");
    f->opt.why = "smaller is enough";
    assert_accepted(f, 2, "NOT COMPARABLE");
}

TEST_OF(fixture, states_have_names_and_orphans_are_found, setup, teardown)
{
    struct suite suite = {.scene = &f->scene, .num_scenes = 1};
    json_t *names;
    struct err e;
    assert_true(golden_orphans(f->golden, &suite, &names, &e));
    assert_int_equal(json_object_size(names), 0); /* no directory yet */
    json_decref(names);
    render(f, f->golden, 1, 1);
    strcpy(f->ref.engine, "povray");
    render(f, f->golden, 1, 1);
    assert_true(golden_orphans(f->golden, &suite, &names, &e));
    assert_int_equal(json_object_size(names), 1);
    assert_true(json_is_true(json_object_get(names, "12_plane/povray")));
    json_decref(names);
    assert_true(golden_remove(f->golden, "12_plane", "povray", &e));
    assert_true(golden_remove(f->golden, "12_plane", "povray", &e)); /* gone: fine */
    assert_true(golden_remove(f->golden, "12_other", "povray", &e));
    OWN(golden) g;
    golden_inspect(f->golden, &f->scene, &f->ref, &g);
    assert_int_equal(g.state, GOLDEN_MISSING);
    render(f, f->golden, 1, 1);
    suite.num_scenes = 0;
    assert_true(golden_orphans(f->golden, &suite, &names, &e));
    assert_int_equal(json_object_size(names), 2);
    json_decref(names);
    assert_string_equal(golden_state_name(GOLDEN_STALE), "stale");
}

/* Renders a small reference of a real scene twice with one seed and once with another. */
static void render_twice(struct fixture *f, const char *program, struct suite_scene scene,
                         struct suite_reference ref)
{
    char path[4096], hex[3][65], key[3][65];
    if (!process_find(program, path, sizeof path))
        skip();
    for (int i = 0; i < 3; i++) {
        const struct reference_options opt = {.seed = i < 2 ? 1 : 2,
                                              .threads = 1 + i, /* threads do not matter */
                                              .timeout_s = 600,
                                              .work_dir = f->dir,
                                              .share_dir = "reference"};
        OWN(moments) m = {0};
        json_auto_t *manifest = NULL;
        struct err e;
        if (!reference_key(&scene, &ref, &opt, key[i], &e) ||
            !reference_render(&scene, &ref, &opt, &m, &manifest, &e) ||
            !golden_write(f->from, scene.name, ref.engine, &m, manifest, &e))
            fail_msg("%s", e.msg);
        assert_string_equal(m.unit, "replicate");
        MUST(sha256_file(fs_path("%s/%s/%s.exr", f->from, scene.name, ref.engine).s, hex[i], &e));
    }
    assert_string_equal(hex[0], hex[1]);
    assert_string_equal(key[0], key[1]);
    assert_string_not_equal(hex[0], hex[2]);
    assert_string_not_equal(key[0], key[2]);
    ref.replicates++;
    const struct reference_options opt = {.seed = 1, .work_dir = f->dir, .share_dir = "reference"};
    struct err e;
    assert_true(reference_key(&scene, &ref, &opt, key[2], &e));
    assert_string_not_equal(key[0], key[2]);
}

static const struct suite_scene small_box = {.name = "41_cornell",
                                             .dae = "reference/scenes/41_cornell.dae",
                                             .sha256 = "abc",
                                             .width = 8,
                                             .height = 8,
                                             .depth = 2};

TEST_OF(fixture, cycles_gives_the_same_bits_again, setup, teardown)
{
    render_twice(f, "blender", small_box,
                 (struct suite_reference){.engine = "cycles", .replicates = 3, .spp = 4});
}

TEST_OF(fixture, povray_gives_the_same_bits_again, setup, teardown)
{
    render_twice(f, "povray", small_box,
                 (struct suite_reference){.engine = "povray", .replicates = 2, .subgrid = 1});
}
