#define _GNU_SOURCE
#include "own.h"
#include "test.h"

#include "renderer/base/fs.h"

#include <ctype.h>
#include <fnmatch.h>

enum { MOST_TESTS = 200 };
static struct CMUnitTest tests[MOST_TESTS];
static size_t num_tests;
static CMFixtureFunction group_set_up, group_tear_down;

void test_add(const char *name, CMUnitTestFunction run, CMFixtureFunction set_up,
              CMFixtureFunction tear_down)
{
    if (num_tests == MOST_TESTS)
        abort();
    tests[num_tests++] = (struct CMUnitTest){name, run, set_up, tear_down, NULL};
}

void test_add_group(CMFixtureFunction set_up, CMFixtureFunction tear_down)
{
    group_set_up = set_up;
    group_tear_down = tear_down;
}

static char dir[] = "/tmp/assay_test.XXXXXX";
static bool dir_is_made;

const char *test_path(const char *name)
{
    static char path[16][512];
    static int turn;
    if (!dir_is_made)
        assert_non_null(mkdtemp(dir));
    dir_is_made = true;
    char *out = path[turn++ % 16];
    assert_true(snprintf(out, sizeof *path, "%s/%s", dir, name) < (int)sizeof *path);
    return out;
}

char *test_read(const char *path)
{
    FILE *f = fopen(path, "rb");
    if (f == NULL)
        fail_msg("%s: cannot read", path);
    fseek(f, 0, SEEK_END);
    size_t size = (size_t)ftell(f);
    rewind(f);
    char *text = malloc(size + 1);
    assert_non_null(text);
    assert_int_equal(fread(text, 1, size, f), size);
    fclose(f);
    text[size] = '\0';
    return text;
}

const char *test_course_file(const char *name)
{
    static char path[4096];
    const char *root = getenv("ASSAY_CS184");
    snprintf(path, sizeof path, "%s/%s", root != NULL ? root : "../shared/scenes/cs184", name);
    if (access(path, R_OK) != 0) {
        print_message("SKIPPED: no %s (set ASSAY_CS184)\n", path);
        skip();
    }
    return path;
}

void test_write(const char *path, const void *bytes, size_t size)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(bytes, 1, size, f), size);
    assert_int_equal(fclose(f), 0);
}

void test_write_text(const char *path, const char *text)
{
    test_write(path, text, strlen(text));
}

char *test_json(const char *text)
{
    char *json = strdup(text);
    assert_non_null(json);
    for (char *at = json; (at = strchr(at, '\'')) != NULL;)
        *at = '"';
    return json;
}

void test_write_json(const char *path, const char *json)
{
    OWN_TEXT text = test_json(json);
    test_write_text(path, text);
}

static bool is_number(const char *at)
{
    return isdigit((unsigned char)at[strspn(at, "-.")]);
}

static bool same_line(const char *got, const char *want)
{
    while (*got != '\0' && *want != '\0') {
        char *got_end, *want_end;
        if (is_number(got) && is_number(want)) {
            double a = strtod(got, &got_end), b = strtod(want, &want_end);
            if (!(fabs(a - b) <= 1e-6 * fabs(b)))
                return false;
            got = got_end;
            want = want_end;
        } else if (*got++ != *want++) {
            return false;
        }
    }
    return *got == *want;
}

void test_same_text(const char *text, const char *expected)
{
    char *file = test_read(expected), *copy = strdup(text), *a = copy, *b = file;
    for (int line = 1; a != NULL || b != NULL; line++) {
        char *got = strsep(&a, "\n"), *want = strsep(&b, "\n");
        while (want != NULL && strncmp(want, "; ", 2) == 0)
            want = strsep(&b, "\n");
        if (got == NULL || want == NULL || !same_line(got, want))
            fail_msg("%s: line %d is\n%s\nnot\n%s", expected, line, got ? got : "(no more)",
                     want ? want : "(no more)");
    }
    free(copy);
    free(file);
}

/* Runs the tests whose names match the argument, a shell's pattern; without one, all. */
int main(int argc, char **argv)
{
    size_t wanted = 0;
    for (size_t i = 0; i < num_tests; i++)
        if (argc < 2 || fnmatch(argv[1], tests[i].name, 0) == 0)
            tests[wanted++] = tests[i];
    if (wanted == 0 && num_tests > 0) {
        fprintf(stderr, "no test matches '%s'\n", argv[1]);
        return 1;
    }
    num_tests = wanted;
    int failed = _cmocka_run_group_tests("tests", tests, num_tests, group_set_up, group_tear_down);
    struct err e;
    if (dir_is_made && !fs_remove_tree(dir, &e))
        return 1;
    return failed;
}
