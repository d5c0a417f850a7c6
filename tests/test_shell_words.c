/* Words to a command line and back: by a shell, and by our own reader. */
#include "../renderer/shell_words.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char *const words[] = {
    "pathtracer", "-f", "it's here.exr", "",    "a  b",       "$(id)",
    "\\",         "''", "ünïcode",       "*?[", "--name=x y", "a\nb"};
enum { NUM_WORDS = sizeof words / sizeof words[0] };

static void join(char *text, size_t size)
{
    text[0] = '\0';
    for (int i = 0; i < NUM_WORDS; i++)
        assert_true(shell_append(text, size, words[i]));
}

static void what_was_joined_is_split(void **state)
{
    (void)state;
    char text[1024];
    int num;
    struct err e;
    join(text, sizeof text);
    char **got = shell_split(text, &num, &e);
    assert_non_null(got);
    assert_int_equal(num, NUM_WORDS);
    for (int i = 0; i < NUM_WORDS; i++)
        assert_string_equal(got[i], words[i]);
    assert_null(got[num]);
    free(got);
}

/* The shell is another reader: printf prints each of its arguments and a bar. */
static void a_shell_reads_the_same_words(void **state)
{
    (void)state;
    char text[1024], command[1200], got[1024] = "", want[1024] = "";
    join(text, sizeof text);
    snprintf(command, sizeof command, "printf '%%s|' %s", text);
    FILE *f = popen(command, "r");
    assert_non_null(f);
    size_t n = fread(got, 1, sizeof got - 1, f);
    assert_int_equal(pclose(f), 0);
    got[n] = '\0';
    for (int i = 0; i < NUM_WORDS; i++) {
        strcat(want, words[i]);
        strcat(want, "|");
    }
    assert_string_equal(got, want);
}

static void what_a_shell_would_act_on_is_refused(void **state)
{
    (void)state;
    static const char *const bad[] = {"a; b",  "a | b", "$HOME", "`id`", "a > b", "'open",
                                      "\"a\"", "a & b", "*",     "a\nb", "~"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        int num;
        struct err e = {""};
        if (shell_split(bad[i], &num, &e) != NULL)
            fail_msg("'%s' is accepted", bad[i]);
        assert_non_null(strstr(e.msg, "not a plain command"));
    }
}

static void what_does_not_fit_is_not_begun(void **state)
{
    (void)state;
    /* "ab 'c d'" has 8 characters. */
    for (size_t size = 3; size < 12; size++) {
        char text[16] = "ab";
        assert_true(shell_append(text, size, "c d") == (size >= 9));
        assert_string_equal(text, size >= 9 ? "ab 'c d'" : "ab");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_was_joined_is_split),
        cmocka_unit_test(a_shell_reads_the_same_words),
        cmocka_unit_test(what_a_shell_would_act_on_is_refused),
        cmocka_unit_test(what_does_not_fit_is_not_begun),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
