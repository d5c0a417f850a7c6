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
/* What set_up leaves in *state is the test's, and tear_down frees it. */
#define TEST_WITH(name, set_up, tear_down)                                                         \
    static void name(void **state);                                                                \
    static __attribute__((constructor)) void name##_add(void)                                      \
    {                                                                                              \
        test_add(#name, name, set_up, tear_down);                                                  \
    }                                                                                              \
    static void name(__attribute__((unused)) void **state)
/* Once before all tests of the file, and once after them. */
#define TEST_GROUP(set_up, tear_down)                                                              \
    static __attribute__((constructor)) void group_add(void)                                       \
    {                                                                                              \
        test_add_group(set_up, tear_down);                                                         \
    }

/* What must not fail for the test to mean anything: else it fails with the line in `e`. */
#define MUST(call)                                                                                 \
    do {                                                                                           \
        if (!(call))                                                                               \
            fail_msg("%s", e.msg);                                                                 \
    } while (0)

#endif
