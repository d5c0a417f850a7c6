#include "test.h"

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

int main(void)
{
    return _cmocka_run_group_tests("tests", tests, num_tests, group_set_up, group_tear_down);
}
