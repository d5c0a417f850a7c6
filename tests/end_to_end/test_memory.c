/* The tests of memory that runs out, tested: code that does not look, leaks, says nothing or leaves half of an output must be
 * caught, and code that does all of it right must pass. */
#include "tests/support/alloc_fail.h"

#include "renderer/base/err.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <jansson.h>

#include <cmocka.h>

static void *volatile kept; /* what the compiler cannot see through */

static bool careful(void *ctx, struct err *e)
{
    (void)ctx;
    char *a = malloc(100), *b = calloc(3, 5), *c = strdup("text");
    kept = a;
    bool ok = (a != NULL && b != NULL && c != NULL) || err_set(e, "out of memory");
    free(a);
    free(b);
    free(c);
    return ok;
}

static bool unchecked(void *ctx, struct err *e)
{
    (void)ctx;
    (void)e;
    char *a = malloc(100);
    kept = a;
    ((volatile char *)a)[1] = 1;
    free(a);
    return true;
}

static bool leaking(void *ctx, struct err *e)
{
    (void)ctx;
    char *a = malloc(100), *b = malloc(100);
    kept = a;
    if (b == NULL)
        return err_set(e, "out of memory");
    free(a);
    free(b);
    return true;
}

static bool silent(void *ctx, struct err *e)
{
    (void)ctx;
    (void)e;
    char *a = malloc(100);
    kept = a;
    bool ok = a != NULL;
    free(a);
    return ok;
}

static bool misleading(void *ctx, struct err *e)
{
    return silent(ctx, e) || err_set(e, "no such file");
}

static bool two_lines(void *ctx, struct err *e)
{
    return silent(ctx, e) || (strcpy(e->msg, "out\nof memory"), false);
}

static bool wrong_result(void *ctx, struct err *e)
{
    (void)ctx;
    (void)e;
    char *a = malloc(100);
    kept = a;
    int value = a != NULL ? 42 : 41;
    free(a);
    alloc_fail_off();
    assert_int_equal(value, 42);
    return true;
}

static bool broken_for_good(void *ctx, struct err *e)
{
    bool *broken = ctx;
    if (*broken)
        return err_set(e, "out of memory, still");
    *broken = !silent(NULL, e);
    return !*broken || err_set(e, "out of memory");
}

static bool json_too_late(void *ctx, struct err *e)
{
    (void)ctx;
    (void)e;
    json_decref(json_real(1));
    return true;
}

static bool json_unchecked(void *ctx, struct err *e)
{
    (void)ctx;
    (void)e;
    json_t *v = json_real(1.5);
    alloc_fail_off();
    assert_true(json_real_value(v) > 1);
    json_decref(v);
    return true;
}

static bool library(void *ctx, struct err *e)
{
    (void)ctx;
    FILE *f = fopen("/dev/null", "rb");
    if (f == NULL)
        return err_set(e, "/dev/null: %s", strerror(errno));
    return fclose(f) == 0;
}

/* In a process of its own, in which a failed assertion of cmocka is an abort(): whether alloc_fail_each() ends it, saying `why`. */
static bool is_caught(bool (*call)(void *ctx, struct err *e), void *ctx, const char *why)
{
    char said[4096];
    FILE *log = tmpfile();
    assert_non_null(log);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        if (dup2(fileno(log), STDERR_FILENO) >= 0 && dup2(fileno(log), STDOUT_FILENO) >= 0 &&
            setenv("CMOCKA_TEST_ABORT", "1", 1) == 0)
            alloc_fail_each("control", ALLOC_OURS, call, ctx);
        _exit(0);
    }
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    rewind(log);
    said[fread(said, 1, sizeof said - 1, log)] = '\0';
    fclose(log);
    const bool ended = !WIFEXITED(status) || WEXITSTATUS(status) != 0;
    if (ended && strstr(said, why) == NULL)
        fail_msg("caught, but not for '%s': %s", why, said);
    return ended;
}

static void careful_code_passes(void **state)
{
    (void)state;
    alloc_fail_each("careful", ALLOC_OURS, careful, NULL);
    assert_false(is_caught(careful, NULL, ""));
}

static void faults_are_caught(void **state)
{
    (void)state;
    bool broken = false;
    assert_true(is_caught(unchecked, NULL, ""));
    assert_true(is_caught(leaking, NULL, "1 blocks are left"));
    assert_true(is_caught(silent, NULL, "failed without a line"));
    assert_true(is_caught(misleading, NULL, "speaks of no memory"));
    assert_true(is_caught(two_lines, NULL, "more than one line"));
    assert_true(is_caught(wrong_result, NULL, "0x2a"));
    assert_true(is_caught(broken_for_good, &broken, "fails afterwards"));
    alloc_json(ALLOC_JSON_ENDS, "/dev/null");
    assert_true(is_caught(json_too_late, NULL, "/dev/null was there before"));
    alloc_json(ALLOC_JSON_ENDS, "/dev/null/none");
    assert_false(is_caught(json_too_late, NULL, ""));
    alloc_json(ALLOC_JSON_FAILS, NULL);
    assert_true(is_caught(json_unchecked, NULL, "json_real_value"));
}

/* Allocations of a shared library fail if all shall, and do not if only ours. */
static void libraries_fail_if_asked(void **state)
{
    (void)state;
    alloc_fail_each("fopen", ALLOC_ALL, library, NULL);
    assert_true(is_caught(library, NULL, "no allocation")); /* no allocation of ours */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(careful_code_passes, alloc_fail_tell),
        cmocka_unit_test_teardown(faults_are_caught, alloc_fail_tell),
        cmocka_unit_test_teardown(libraries_fail_if_asked, alloc_fail_tell),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
