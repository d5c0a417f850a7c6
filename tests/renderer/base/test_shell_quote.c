/* Words to a command line and back: by a shell, and by our own reader. */
#include "renderer/base/shell_quote.h"
#include "tools/results/claim_result.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

static const char *const words[] = {
    "pathtracer", "-f",      "it's here.exr", "",           "a  b", "$(id)", "\\",
    "''",         "ünïcode", "*?[",           "--name=x y", "a\nb", NULL};
enum { NUM_WORDS = sizeof words / sizeof words[0] - 1 };

static void expect_words(const char *text, const char *const *want)
{
    int num;
    struct err e = {""};
    char **got = shell_quote_split(text, &num, &e);
    assert_non_null(got);
    for (int i = 0; i < num; i++)
        assert_string_equal(got[i], want[i]);
    assert_null(want[num]);
    assert_null(got[num]);
    free(got);
}

TEST(what_was_joined_is_split)
{
    char *text = shell_quote_join(NULL, words);
    expect_words(text, words);
    free(text);
    text = shell_quote_join(words[0], words + 1);
    expect_words(text, words);
    free(text);
    text = shell_quote_join(NULL, words + NUM_WORDS);
    assert_string_equal(text, "");
    free(text);
}

/* Three quarters of a megabyte, each word of it as long in quotes as a word can get. */
TEST(no_word_is_lost_however_many)
{
    enum { MANY = 6000 };
    static const char *many[MANY + 1];
    for (int i = 0; i < MANY; i++)
        many[i] = i % 2 == 0 ? "''''''''''''''''''''''''''''''''" : "b";
    OWN_TEXT text = shell_quote_join(NULL, many);
    assert_int_equal(strlen(text), MANY / 2 * (2 + 4 * 32 + 1) + MANY - 1);
    expect_words(text, many);
}

/* What results.json says of its origin, too. */
TEST(the_command_of_results_is_read_back)
{
    static const char *const want[] = {"assay", "compare", "it's a.exr", "b  c.exr", "", NULL};
    char *argv[] = {"compare", "it's a.exr", "b  c.exr", "", NULL};
    struct err e = {""};
    json_t *root = claim_result_new_results(4, argv, 0.01, &e);
    assert_non_null(root);
    expect_words(json_string_value(json_object_get(root, "command")), want);
    json_decref(root);
}

/* The shell is another reader: printf prints each of its arguments and a bar. */
TEST(a_shell_reads_the_same_words)
{
    char command[1200], got[1024] = "", want[1024] = "", *text = shell_quote_join(NULL, words);
    snprintf(command, sizeof command, "printf '%%s|' %s", text);
    free(text);
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

TEST(what_a_shell_would_act_on_is_refused)
{
    static const char *const bad[] = {"a; b",  "a | b", "$HOME", "`id`", "a > b", "'open",
                                      "\"a\"", "a & b", "*",     "a\nb", "~"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        int num;
        struct err e = {""};
        if (shell_quote_split(bad[i], &num, &e) != NULL)
            fail_msg("'%s' is accepted", bad[i]);
        assert_non_null(strstr(e.msg, "not a plain command"));
    }
}
