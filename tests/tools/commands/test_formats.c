/* The manuals of file formats (tools/docs/formats): the real reader accepts every example, and a page's tables list
 * exactly the keys that the reader knows. These are found by trying every quoted word in the reader's source folder
 * as a key. */
#include "tests/support/suite_files.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include "reference/external/engine_description.h"
#include "reference/suite/features.h"
#include "renderer/base/fs.h"
#include "renderer/base/version.h"
#include "tools/submission/rubric.h"
#include "tools/gradebook/grade_batch.h"
#include "tools/jobs/plan.h"
#include "tools/results/results.h"

#include <ctype.h>
#include <dirent.h>

enum { TEXT = 1 << 16, WORDS = 2048 };

static struct rubric one, *const rubric = &one;

static const char *write_text(const char *name, const char *text)
{
    const char *path = test_path(name);
    test_write(path, text, strlen(text));
    return path;
}

/* The block number k of a page, of that language, up to its closing fence. */
static void read_block(const char *page, const char *language, int k, char block[TEXT])
{
    char fence[32];
    OWN_TEXT text = test_read(fs_path("tools/docs/formats/%s", page).s);
    snprintf(fence, sizeof fence, "```%s\n", language);
    const char *at = text;
    for (; k >= 0; k--)
        if ((at = strstr(at, fence)) != NULL)
            at += strlen(fence);
        else
            fail_msg("%s: not so many examples of %s", page, language);
    const char *end = strstr(at, "\n```");
    assert_non_null(end);
    snprintf(block, TEXT, "%.*s\n", (int)(end - at), at);
}

static json_t *load_block(const char *page, int k)
{
    static char block[TEXT];
    json_error_t why;
    read_block(page, "json", k, block);
    json_t *json = json_loads(block, JSON_REJECT_DUPLICATES, &why);
    if (json == NULL)
        fail_msg("%s: line %d of example %d: %s", page, why.line, k, why.text);
    return json;
}

struct words {
    char word[WORDS][48];
    int num;
};

static bool words_have(const struct words *w, const char *word)
{
    for (int i = 0; i < w->num; i++)
        if (strcmp(w->word[i], word) == 0)
            return true;
    return false;
}

static void words_add(struct words *w, const char *word, size_t n)
{
    char text[48];
    if (n == 0 || n >= sizeof text)
        return;
    snprintf(text, sizeof text, "%.*s", (int)n, word);
    if (words_have(w, text))
        return;
    assert_true(w->num < WORDS);
    strcpy(w->word[w->num++], text);
}

/* Length of a name of small letters, digits and _. */
static size_t name_length(const char *text)
{
    return islower((unsigned char)*text) ? strspn(text, "abcdefghijklmnopqrstuvwxyz0123456789_")
                                         : 0;
}

/* First cells of the tables that have this heading over it: the name that each piece of code begins with. */
static void page_words(const char *page, const char *heading, struct words *out)
{
    char head[64];
    bool in = false;
    snprintf(head, sizeof head, "| %s |", heading);
    OWN_TEXT text = test_read(fs_path("tools/docs/formats/%s", page).s);
    *out = (struct words){.num = 0};
    for (char *line = text, *next; line != NULL; line = next) {
        next = strchr(line, '\n');
        if (next != NULL)
            *next++ = '\0';
        if (line[0] != '|' || strncmp(line, head, strlen(head)) == 0) {
            in = line[0] == '|';
            continue;
        }
        line[1 + strcspn(line + 1, "|")] = '\0';
        for (char *c = strchr(line, '`'); in && c != NULL; c = strchr(c + 1, '`')) {
            const char *word = c + 1 + (c[1] == '{');
            words_add(out, word, name_length(word));
            c = strchr(c + 1, '`');
            assert_non_null(c);
        }
    }
    if (out->num == 0)
        fail_msg("%s: no table of '%s'", page, heading);
}

/* What stands in quotes in the C files of a folder. */
static void source_words(const char *folder, struct words *out)
{
    struct dirent *entry;
    DIR *d = opendir(folder);
    if (d == NULL)
        fail_msg("%s: no such folder", folder);
    while ((entry = readdir(d)) != NULL) {
        const char *dot = strrchr(entry->d_name, '.');
        if (dot == NULL || strcmp(dot, ".c") != 0)
            continue;
        OWN_TEXT text = test_read(fs_path("%s/%s", folder, entry->d_name).s);
        for (const char *c = strchr(text, '"'); c != NULL; c = strchr(c + 1, '"')) {
            size_t n = name_length(c + 1);
            if (c[1 + n] == '"')
                words_add(out, c + 1, n);
        }
    }
    closedir(d);
}

/* A word that only one of them has, or NULL. */
static const char *difference(const struct words *a, const struct words *b)
{
    for (int i = 0; i < a->num; i++)
        if (!words_have(b, a->word[i]))
            return a->word[i];
    for (int i = 0; i < b->num; i++)
        if (!words_have(a, b->word[i]))
            return b->word[i];
    return NULL;
}

/* The page's words under `heading` are those of the reader's folders that the reader knows. */
static void compare(const char *page, const char *heading, const char *const *folders,
                    bool (*knows)(const char *word))
{
    static struct words listed, tried, known;
    page_words(page, heading, &listed);
    tried = listed; /* wherever the reader has them from */
    known.num = 0;
    for (; *folders != NULL; folders++)
        source_words(*folders, &tried);
    for (int i = 0; i < tried.num; i++)
        if (knows(tried.word[i]))
            words_add(&known, tried.word[i], strlen(tried.word[i]));
    const char *only = difference(&listed, &known);
    if (only != NULL)
        fail_msg("%s: '%s' is %s", page, only,
                 words_have(&listed, only) ? "in no reader" : "not in its tables");
    /* Controls: a word too many, and one too few, on either side. */
    assert_false(knows("no_such_word"));
    words_add(&listed, "no_such_word", strlen("no_such_word"));
    assert_string_equal(difference(&listed, &known), "no_such_word");
    listed.num -= 2;
    assert_string_equal(difference(&listed, &known), listed.word[listed.num]);
}

/* Is there an object of the example below `at` that may have this key, with a nonsense value, without the reader
 * reporting an unknown key? */
static bool is_known_in(json_t *whole, json_t *at, const char *word, bool (*reads)(json_t *whole))
{
    bool known = false;
    const char *key;
    json_t *v;
    size_t i;
    if (json_is_object(at)) {
        json_t *before = json_incref(json_object_get(at, word));
        json_object_set_new(at, word, json_pack("[[]]"));
        known = reads(whole);
        if (before != NULL)
            json_object_set_new(at, word, before);
        else
            json_object_del(at, word);
        json_object_foreach(at, key, v) {
            known = known || (strcmp(key, "values") != 0 && is_known_in(whole, v, word, reads));
        }
    }
    if (json_is_array(at))
        json_array_foreach(at, i, v) {
            known = known || is_known_in(whole, v, word, reads);
        }
    return known;
}

static void dump(const json_t *json, const char *name)
{
    assert_int_equal(json_dump_file(json, test_path(name), 0), 0);
}

static void write_scene(const char *name, json_t *json)
{
    char file[64];
    snprintf(file, sizeof file, "suite/%s.dae", name);
    write_text(file, "<COLLADA/>"); /* it is hashed, not read */
    snprintf(file, sizeof file, "suite/%s.json", name);
    dump(json, file);
}

/* The page's scenes by the names that it gives them. */
static bool load_scenes(json_t *equal, json_t *differs, struct suite *out, struct err *e)
{
    if (!fs_make_dirs(test_path("suite"), e))
        return false;
    write_scene("13_square_patch", equal);
    write_scene("95_one_bounce_less", differs);
    return suite_load(test_path("suite"), out, e);
}

static bool reads_scenes(json_t *scenes)
{
    struct suite s;
    struct err e;
    if (!load_scenes(json_array_get(scenes, 0), json_array_get(scenes, 1), &s, &e))
        return strstr(e.msg, "unknown") == NULL;
    suite_free(&s);
    return true;
}

static bool knows_scene_key(const char *word)
{
    json_auto_t *scenes = json_pack("[o, o]", load_block("scene.md", 0), load_block("scene.md", 1));
    return is_known_in(scenes, scenes, word, reads_scenes);
}

TEST(scenes_are_as_their_page_says)
{
    OWN(suite) s;
    struct err e;
    json_auto_t *a = load_block("scene.md", 0), *b = load_block("scene.md", 1);
    MUST(load_scenes(a, b, &s, &e));
    assert_int_equal(s.num_scenes, 2);
    assert_int_equal(s.scene[0].num_references, 3);
    assert_int_equal(s.scene[1].expect, VERDICT_DIFFERENT);
    compare("scene.md", "key", (const char *const[]){"reference/suite", NULL}, knows_scene_key);
}

/* Names of scenes and references are free: a key is tried in the suite, in its first scene and in a reference of each kind. */
static bool knows_suite_key(const char *word)
{
    static const char *const places[][4] = {{NULL},
                                            {"scenes", "ball", NULL},
                                            {"scenes", "ball", "references", "other"},
                                            {"scenes", "ball", "references", "truth"},
                                            {"scenes", "ball", "references", "povray"}};
    bool known = false;
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        struct suite s;
        struct err e;
        json_t *suite = load_block("suite.md", 0), *at = suite;
        json_t *references = json_object_get(
            json_object_get(json_object_get(suite, "scenes"), "ball"), "references");
        json_object_set_new(references, "truth",
                            json_pack("{ss,s{}}", "kind", "furnace", "values"));
        json_object_set_new(references, "povray",
                            json_pack("{si,si}", "replicates", 8, "subgrid", 2));
        for (size_t k = 0; k < 4 && places[i][k] != NULL; k++)
            at = json_object_get(at, places[i][k]);
        assert_true(json_is_object(at));
        json_object_set_new(at, word, json_pack("[[]]"));
        dump(suite, "own/suite.json");
        json_decref(suite);
        if (suite_load(test_path("own"), &s, &e)) {
            suite_free(&s);
            known = true;
        } else {
            known |= strstr(e.msg, "unknown key") == NULL;
        }
    }
    return known;
}

TEST(suites_of_ones_own_are_as_their_page_says)
{
    static const char *const files[] = {"own/mine.json", "own/scenes/box.json",
                                        "own/scenes/wood.png", "own/scenes/ball.dae",
                                        "own/scenes/ball_dark.dae"};
    OWN(suite) s;
    struct err e;
    json_t *suite = load_block("suite.md", 0);
    MUST(fs_make_dirs(test_path("own/scenes"), &e));
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        write_text(files[i], "a file");
    dump(suite, "own/suite.json");
    json_decref(suite);
    MUST(suite_load(test_path("own"), &s, &e));
    assert_int_equal(s.num_scenes, 3);
    assert_int_equal(s.scene[0].num_references, 3);
    assert_int_equal(s.scene[1].expect, VERDICT_DIFFERENT);
    compare("suite.md", "key", (const char *const[]){"reference/suite", NULL}, knows_suite_key);
}

/* Loads a description; false where the error has these words. */
static bool loads_engine(const char *text, const char *not_known)
{
    struct engine en;
    struct err e;
    if (!engine_load(write_text("engine.json", text), &en, &e))
        return strstr(e.msg, not_known) == NULL;
    engine_free(&en);
    return true;
}

static bool reads_engine(json_t *description)
{
    OWN_TEXT text = json_dumps(description, 0);
    return loads_engine(text, "unknown");
}

static bool knows_engine_key(const char *word)
{
    json_auto_t *description = load_block("engine.md", 0);
    return is_known_in(description, description, word, reads_engine);
}

static bool knows_placeholder(const char *word)
{
    static const char *const all[] = {
        "{\"name\": \"x\", \"format\": \"mitsuba\", \"output\": \"mean\", \"expresses\": [], "
        "\"command\": [\"x\", \"{scene}\", \"{out}\", \"{seed}\", \"{%s}\"]}",
        "{\"name\": \"x\", \"format\": \"dae\", \"output\": \"mean\", \"expresses\": [\"lens\"], "
        "\"command\": [\"x\", \"{scene}\", \"{out}\", \"{seed}\"], \"lens_args\": [\"{%s}\"]}",
        "{\"name\": \"x\", \"format\": \"dae\", \"output\": \"mean\", \"expresses\": "
        "[\"environment\"], \"command\": [\"x\", \"{scene}\", \"{out}\", \"{seed}\"], "
        "\"environment_args\": [\"{%s}\"]}"};
    bool known = false;
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        const char *at = strstr(all[i], "{%s}");
        char text[512];
        snprintf(text, sizeof text, "%.*s{%s}%s", (int)(at - all[i]), all[i], word, at + 4);
        known |= loads_engine(text, "unknown placeholder");
    }
    return known;
}

static bool knows_feature(const char *word)
{
    char text[512];
    snprintf(
        text, sizeof text,
        "{\"name\": \"x\", \"format\": \"mitsuba\", \"output\": \"exact\", \"expresses\": [\"%s\"], "
        "\"command\": [\"x\", \"{scene}\", \"{out}\"]}",
        word);
    return loads_engine(text, "is no feature");
}

TEST(engines_are_as_their_page_says)
{
    static const char *const reader[] = {"reference/external", NULL};
    OWN(engine) en;
    struct err e;
    json_auto_t *description = load_block("engine.md", 0);
    dump(description, "example.json");
    MUST(engine_load(test_path("example.json"), &en, &e));
    assert_int_equal(en.replicates, 64);
    compare("engine.md", "key", reader, knows_engine_key);
    compare("engine.md", "placeholder", reader, knows_placeholder);
    compare("engine.md", "feature", (const char *const[]){"reference/suite", NULL}, knows_feature);
}

/* Do mistakes of that text speak so? */
static bool rubric_says(const char *text, const char *words)
{
    static struct rubric_mistakes m;
    struct err e;
    bool says = false;
    MUST(rubric_read(write_text("a.rubric", text), suite_shipped(), 0, rubric, &m, &e));
    for (int i = 0; i < m.num; i++)
        says |= strstr(m.at[i].text, words) != NULL;
    return says;
}

/* In the whole, in an image or in a check. */
static bool knows_statement(const char *word)
{
    static const char *const above[] = {"rubric A", "image p", "part 1 x\ncheck c 1 equal"};
    bool known = false;
    for (size_t i = 0; i < sizeof above / sizeof *above; i++) {
        char text[256], no_statement[96];
        snprintf(text, sizeof text, "%s\n%s\n", above[i], word);
        snprintf(no_statement, sizeof no_statement, "'%s' is no statement", word);
        known |= !rubric_says(text, no_statement);
    }
    return known;
}

static bool knows_in_command(const char *word)
{
    char text[256];
    snprintf(text, sizeof text, "rubric A\ncommand x {out} {%s}\n", word);
    return !rubric_says(text, "nothing that is replaced");
}

static bool knows_kind(const char *word)
{
    char text[256];
    snprintf(text, sizeof text, "rubric A\npart 1 x\ncheck c 1 %s\n", word);
    return !rubric_says(text, "is no kind");
}

TEST(rubrics_are_as_their_page_says)
{
    static const char *const reader[] = {"tools/grade", NULL};
    static char text[TEXT];
    struct rubric_mistakes m;
    struct err e;
    read_block("rubric.md", "rubric", 0, text);
    MUST(rubric_read(write_text("example.rubric", text), suite_shipped(), 0, rubric, &m, &e));
    if (m.num > 0)
        fail_msg("rubric.md: line %d of the example: %s", m.at[0].line, m.at[0].text);
    assert_true(rubric_points(rubric) == 10);
    compare("rubric.md", "statement", reader, knows_statement);
    compare("rubric.md", "placeholder", reader, knows_in_command);
    compare("rubric.md", "kind", reader, knows_kind);
}

/* With what only `assay validate` writes. */
static json_t *example_results(void)
{
    json_t *results = load_block("results.md", 0);
    json_t *claim = json_array_get(json_object_get(results, "claims"), 0);
    json_object_set_new(claim, "cost_s", json_pack("{sf, sf}", "a", 1.0, "b", 0.0));
    json_object_set_new(claim, "rays_a",
                        json_pack("{si, si, si}", "rays", 3, "box_tests", 2, "primitive_tests", 1));
    json_object_set_new(claim, "looks",
                        json_pack("[{si, si, sf, si, ss}]", "n_a", 64, "n_b", 64, "alpha", 0.001,
                                  "stage", 1, "verdict", "EQUIVALENT"));
    return results;
}

/* A reader of results ignores unknown keys, so the keys that it knows are those whose wrong value it refuses. */
static bool refuses_results(json_t *results)
{
    struct err e;
    json_auto_t *read = NULL;
    dump(results, "results.json");
    return !results_read(test_path("results.json"), &read, &e);
}

static bool knows_member(const char *word)
{
    json_auto_t *results = example_results();
    return is_known_in(results, results, word, refuses_results);
}

TEST(results_are_as_their_page_says)
{
    struct err e;
    json_t *results = load_block("results.md", 0), *read;
    dump(results, "results.json");
    MUST(results_read(test_path("results.json"), &read, &e));
    assert_int_equal(results_exit_code(read), 0);
    json_decref(read);
    json_decref(results);
    results = example_results();
    assert_false(refuses_results(results));
    json_decref(results);
    compare("results.md", "key", (const char *const[]){"tools/results", NULL}, knows_member);
}

/* Pages and Gradescope's file are made from the example; of keys, docs.sh asks a real one. */
TEST(grades_are_as_their_page_says)
{
    struct err e;
    json_auto_t *grades = json_pack("[o]", load_block("grades.md", 0));
    MUST(fs_make_dirs(test_path("grades/bob"), &e));
    MUST(grade_write(test_path("grades"), NULL, NULL, grades, &e));
    json_auto_t *gradescope = json_load_file(test_path("grades/bob/results.json"), 0, NULL);
    const json_t *test = json_array_get(json_object_get(gradescope, "tests"), 0);
    assert_string_equal(json_string_value(json_object_get(test, "status")), "failed");
    assert_true(json_number_value(json_object_get(test, "max_score")) == 6);
}

TEST(plans_are_as_their_page_says)
{
    static char text[TEXT], ours[TEXT + 128];
    OWN(plan) p;
    struct err e;
    read_block("plan.md", "jsonl", 0, text);
    char *version = strstr(text, "0.1 (commit ");
    assert_non_null(version);
    char *rest = strchr(version, ')');
    snprintf(ours, sizeof ours, "%.*s%s%s", (int)(version - text), text, assay_version, rest + 1);
    MUST(fs_make_dirs(test_path("plan"), &e));
    write_text("plan/plan.jsonl", ours);
    MUST(plan_read(test_path("plan"), &p, &e));
    assert_int_equal(p.num, 2);
    assert_string_equal(plan_text(&p, "kind"), "pathtracer");
    assert_false(job_run_is_made(&p, 1));
}
