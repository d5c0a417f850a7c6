/* Scenes that must fail. tests/bad/expected has the name of each, the dialect it is read as if not its own, and what the
 * line of the error must hold. Each file is 00_valid.dae with the one fault of its name, on the
 * line that carries the comment <!-- fault -->; the expected line number is found by that comment,
 * not by the loader. */
#define _GNU_SOURCE
#include "renderer/collada/collada.h"
#include "tests/support/test.h"

#include <glob.h>

/* 1-based; 0 if no line is marked. */
static long marked_line(const char *path)
{
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    char text[1024];
    long line = 0, marked = 0;
    while (fgets(text, sizeof text, f) != NULL) {
        line++;
        if (strstr(text, "<!-- fault -->") != NULL)
            marked = line;
    }
    fclose(f);
    return marked;
}

TEST(each_fault_is_named_with_its_line)
{
    char *table = test_read("tests/bad/expected"), *rest = table, *line;
    size_t failures = 0, rows = 0;
    while ((line = strsep(&rest, "\n")) != NULL && *line != '\0') {
        char *name = strsep(&line, " "), *keyword = line, path[512], start[600];
        const char *word = strchr(name, ':');
        enum dialect dialect = word == NULL                    ? DIALECT_AUTO
                               : strcmp(word, ":collada") == 0 ? DIALECT_COLLADA
                                                               : DIALECT_CGL;
        snprintf(path, sizeof path, "tests/bad/%.*s.dae", (int)strcspn(name, ":"), name);
        snprintf(start, sizeof start, "%s:%ld: ", path, marked_line(path));
        struct scene s = {0};
        struct err e = {""};
        rows++;
        if (collada_load(path, dialect, &s, &e)) {
            print_error("%s: loads\n", path);
            scene_free(&s);
            failures++;
        } else if (strncmp(e.msg, start, strlen(start)) != 0 ||
                   strstr(e.msg + strlen(start), keyword) == NULL || strchr(e.msg, '\n') != NULL) {
            print_error("expected '%s...%s...', got '%s'\n", start, keyword, e.msg);
            failures++;
        }
    }
    free(table);
    assert_int_equal(failures, 0);
    /* No file of the folder is left out of the table. */
    glob_t files;
    assert_int_equal(glob("tests/bad/*.dae", 0, NULL, &files), 0);
    assert_int_equal(files.gl_pathc, rows + 1);
    globfree(&files);
}

/* Negative control: without a fault the scene loads, so the faults are what is refused. */
TEST(scene_without_fault_loads)
{
    struct scene s = {0};
    struct err e = {""};
    MUST(collada_load("tests/bad/00_valid.dae", DIALECT_AUTO, &s, &e));
    assert_int_equal(s.num_triangles, 2);
    assert_int_equal(s.num_spheres, 1);
    scene_free(&s);
}

TEST(unreadable_file_is_an_error)
{
    struct scene s = {0};
    struct err e = {""};
    REFUSES(collada_load("tests/bad/no_such_file.dae", DIALECT_AUTO, &s, &e),
            "no_such_file.dae: cannot read");
    REFUSES(collada_load("tests", DIALECT_AUTO, &s, &e), "tests: cannot read");
}
