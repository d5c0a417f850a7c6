/* Test programs. A file of tests is a list of
 *     TEST(name)
 *     {
 *         ...
 *     }
 * and has no main(): that stands in test.c and runs them in the order of the file, by cmocka. */
#ifndef ASSAY_TESTS_TEST_H
#define ASSAY_TESTS_TEST_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

void test_add(const char *name, CMUnitTestFunction run, CMFixtureFunction set_up,
              CMFixtureFunction tear_down);
void test_add_group(CMFixtureFunction set_up, CMFixtureFunction tear_down);

#define TEST(name) TEST_WITH(name, NULL, NULL)
/* set_up leaves in *state what the test gets, and tear_down frees it. */
#define TEST_WITH(name, set_up, tear_down)                                                         \
    static void name(void **state);                                                                \
    static __attribute__((constructor)) void name##_add(void)                                      \
    {                                                                                              \
        test_add(#name, name, set_up, tear_down);                                                  \
    }                                                                                              \
    static void name(__attribute__((unused)) void **state)
/* The same for a `struct fixture`, which is `f` in the test. */
#define TEST_OF(fixture, name, set_up, tear_down)                                                  \
    static void name##_of(struct fixture *f);                                                      \
    TEST_WITH(name, set_up, tear_down)                                                             \
    {                                                                                              \
        name##_of(*state);                                                                         \
    }                                                                                              \
    static void name##_of(struct fixture *f)
/* set_up runs once before all tests of the file, tear_down once after them. */
#define TEST_GROUP(set_up, tear_down)                                                              \
    static __attribute__((constructor)) void group_add(void)                                       \
    {                                                                                              \
        test_add_group(set_up, tear_down);                                                         \
    }

#define COUNT(a) (sizeof(a) / sizeof *(a))

/* "DIR/name" in a directory of this program's own, which is made when it is first asked for and removed with all that is
 * in it after the tests. One of 16 buffers, which take turns. */
const char *test_path(const char *name);
/* Returns the whole file with a 0 behind it, which the caller frees. Writes a file. Both fail the
 * test on errors. */
char *test_read(const char *path);
void test_write(const char *path, const void *bytes, size_t size);
/* Writes a text; one of JSON may have ' for ", which makes it legible in C. */
void test_write_text(const char *path, const char *text);
void test_write_json(const char *path, const char *json);
/* The text with " for each '; the caller frees. */
char *test_json(const char *text);

/* Path of one of the assignment's files, which are not ours to ship (ASSAY_CS184 says where they
 * are); skips the test, and says so, if it is not there. A static buffer. */
const char *test_course_file(const char *name);

/* Fails at the first line of the text that differs from that of the file `expected`. Numbers may
 * differ by 1e-6 of the expected one. Lines of the file that begin with "; " are comments. */
void test_same_text(const char *text, const char *expected);

/* text: what these calls write to the stream `f`; the caller frees. */
#define PRINTED(text, ...)                                                                         \
    do {                                                                                           \
        size_t size_;                                                                              \
        FILE *f = open_memstream(&(text), &size_);                                                 \
        assert_non_null(f);                                                                        \
        __VA_ARGS__;                                                                               \
        assert_int_equal(fclose(f), 0);                                                            \
    } while (0)

/* In double precision, unlike cmocka's own. */
#define assert_near(a, b, tolerance)                                                               \
    do {                                                                                           \
        double a_ = (double)(a), b_ = (double)(b);                                                 \
        if (!(fabs(a_ - b_) <= (tolerance)))                                                       \
            fail_msg("%s is %.15g, expected %.15g", #a, a_, b_);                                   \
    } while (0)

/* A call that the test relies on: if it fails, so does the test, with the line in `e`. */
#define MUST(call)                                                                                 \
    do {                                                                                           \
        if (!(call))                                                                               \
            fail_msg("%s", e.msg);                                                                 \
    } while (0)

/* The call must fail, with one line in `e` that holds `why`. */
#define REFUSES(call, why)                                                                         \
    do {                                                                                           \
        const char *why_ = (why);                                                                  \
        e.msg[0] = '\0';                                                                           \
        if (call)                                                                                  \
            fail_msg("does not fail with '%s'", why_);                                             \
        if (strstr(e.msg, why_) == NULL || strchr(e.msg, '\n') != NULL)                            \
            fail_msg("'%s' does not say '%s'", e.msg, why_);                                       \
    } while (0)

#endif
