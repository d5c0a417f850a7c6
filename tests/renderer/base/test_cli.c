/* Command lines as getopt's users write them. */

#include "renderer/base/cli.h"
#include "tests/support/test.h"

static const struct cli_option options[] = {{'j', "jobs", "N", .help = "jobs"},
                                            {'q', "quiet", "", .help = "quiet"},
                                            {'H', "hemisphere", "", .help = "hemisphere"},
                                            {'r', "resolution", "W H", .help = "pixels"},
                                            {'s', "spp", "N", .help = "samples"},
                                            {0, "seed", "N", .help = "seed"},
                                            {0}};

/* out: "LONG=VALUE,VALUE " for each option and "VALUE " for each positional word; or the error's
 * message. */
static void read_all(char *text, char out[512])
{
    char *argv[16] = {"program"};
    struct cli c = {.options = options, .argc = 1, .argv = argv, .next = 1};
    struct err e = {""};
    for (char *word = strtok(text, " "); word != NULL; word = strtok(NULL, " "))
        argv[c.argc++] = word;
    out[0] = '\0';
    for (int i; (i = cli_next(&c, &e)) != CLI_END;) {
        size_t n = strlen(out);
        if (i == CLI_ERROR) {
            snprintf(out, 512, "%.500s", e.msg);
            return;
        }
        if (i == CLI_POSITIONAL)
            snprintf(out + n, 512 - n, "%s ", c.value[0]);
        else
            snprintf(out + n, 512 - n, "%s=%s%s%s ", options[i].long_name,
                     options[i].args[0] != '\0' ? c.value[0] : "",
                     strlen(options[i].args) > 1 ? "," : "",
                     strlen(options[i].args) > 1 ? c.value[1] : "");
    }
}

TEST(words_are_read_as_by_getopt)
{
    static const struct {
        const char *words, *read, *error; /* a part of it */
    } cases[] = {
        {"-j 2 x", "jobs=2 x ", NULL},
        {"-j2 x", "jobs=2 x ", NULL},
        {"-j-2", "jobs=-2 ", NULL},
        {"--jobs=2 --jobs 3", "jobs=2 jobs=3 ", NULL},
        {"-qH x", "quiet= hemisphere= x ", NULL},
        {"-qHj4 -s 5", "quiet= hemisphere= jobs=4 spp=5 ", NULL},
        {"-qj 4 -s5", "quiet= jobs=4 spp=5 ", NULL},
        {"-r 64 48 -q", "resolution=64,48 quiet= ", NULL},
        {"-qr 64 48", "quiet= resolution=64,48 ", NULL},
        {"-- -j2", "-j2 ", NULL},
        {"-", "- ", NULL},
        {"-r64 48", NULL, "option '-r' takes W H, each a word of its own, not '-r64'"},
        {"-r64", NULL, "each a word of its own"},
        {"-qz", NULL, "unknown option '-qz'"},
        {"-z", NULL, "unknown option '-z'"},
        {"-seed 3", NULL, "unknown option '-seed': long options have two dashes, --seed"},
        {"-spp=3", NULL, "long options have two dashes, --spp=3"},
        {"-qj", NULL, "option '-qj' needs N"},
        {"-j", NULL, "option '-j' needs N"},
        {"--quiet=1", NULL, "takes 0 arguments"},
        {"--sed", NULL, "unknown option '--sed', did you mean --seed? (see --help)"},
        {"--qiuet", NULL, "did you mean --quiet?"},
        {"--jobss=4", NULL, "did you mean --jobs?"},
        {"--jbxs", NULL, "unknown option '--jbxs' (see --help)"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char words[128], out[512];
        snprintf(words, sizeof words, "%s", cases[i].words);
        read_all(words, out);
        if (cases[i].read != NULL ? strcmp(out, cases[i].read) != 0
                                  : strstr(out, cases[i].error) == NULL)
            fail_msg("%s: '%s', not '%s'", cases[i].words, out,
                     cases[i].read != NULL ? cases[i].read : cases[i].error);
    }
}

TEST(words_are_set_apart)
{
    static const char *const cases[][2] = {
        {"-j2 x", "-j 2 x"},
        {"-qHj4 -s 5 --jobs=2", "-q -H -j 4 -s 5 --jobs=2"},
        {"-qr 64 48 -j -2 y", "-q -r 64 48 -j -2 y"},
        {"x -- -j2 -q", "x -- -j2 -q"},
        {"", ""},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char words[128] = "", out[512] = "", *argv[16] = {"program"};
        int argc = 1;
        snprintf(words, sizeof words, "%s", cases[i][0]);
        for (char *w = strtok(words, " "); w != NULL; w = strtok(NULL, " "))
            argv[argc++] = w;
        char **apart = cli_apart(options, argc, argv);
        assert_non_null(apart);
        for (int k = 1; apart[k] != NULL; k++) {
            strcat(out, k > 1 ? " " : "");
            strcat(out, apart[k]);
        }
        assert_string_equal(apart[0], "program");
        assert_string_equal(out, cases[i][1]);
        free(apart);
    }
}

enum kind { KIND_A, KIND_B };

struct settings {
    bool flag, stop;
    int number, pair[2], first, last, choice, constant, num_list, num_words, read;
    enum kind kind;
    uint32_t small;
    uint64_t big;
    double real, seconds;
    const char *text, *one_of, *pair_of_texts[2], *list[2], *word[2];
};

static bool read_it(void *settings, const char *const v[4], struct err *e)
{
    struct settings *s = settings;
    s->read = (int)strlen(v[0]) + 10 * (int)strlen(v[1]);
    return s->read != 11 || err_set(e, "read: 11");
}

#define TO(member) CLI_TO(struct settings, member)
static const char *const names[] = {"a", "b", NULL};
static const struct cli_option bound[] = {
    {'f', "flag", "", "", TO(flag)},
    {'n', "number", "N", "", TO(number), -3, 7},
    {0, "pair", "A B", "", TO(pair), 0, 9},
    {0, "size", "W H", "", TO(pair), 1, 4000},
    {0, "range", "A:B", "", CLI_TO_RANGE(struct settings, first), 0, 8, .noun = "sample"},
    {0, "choice", "X", "", TO(choice), 5, .names = names},
    {0, "kind", "X", "", TO(kind), .names = names},
    {0, "kind-b", "", "", TO(kind), KIND_B},
    {0, "constant", "", "", TO(constant), 42},
    {0, "small", "N", "", TO(small)},
    {0, "big", "N", "", TO(big)},
    {0, "real", "X", "", TO(real), 0.5, 2},
    {0, "seconds", "T", "", TO(seconds), 0, 100, .unit = cli_time_units},
    {'t', "text", "T", "", TO(text)},
    {0, "one-of", "T", "", TO(one_of), .names = names},
    {0, "texts", "A B", "", TO(pair_of_texts)},
    {'l', "list", "T", "", CLI_TO_LIST(struct settings, list, num_list), .noun = "things"},
    {0, "read", "A B", "", .read = read_it},
    {0, "stop", "", "", TO(stop), .stops = true},
    {.args = "two words", CLI_TO_LIST(struct settings, word, num_words)}};

static bool read_bound(const char *text, char words[128], struct settings *s, struct err *e)
{
    char *argv[32] = {"verb"};
    int argc = 1;
    snprintf(words, 128, "%s", text);
    for (char *word = strtok(words, " "); word != NULL; word = strtok(NULL, " "))
        argv[argc++] = word;
    *s = (struct settings){.real = 1};
    *e = (struct err){""};
    return cli_read(bound, argc, argv, s, e);
}

TEST(values_go_where_the_table_says)
{
    struct settings s;
    struct err e;
    char words[128];
    assert_true(read_bound("x -fn -3 --pair 4 9 --range 0:8 --choice b --kind b --constant y",
                           words, &s, &e));
    assert_true(s.flag && !s.stop);
    assert_int_equal(s.number, -3);
    assert_int_equal(s.pair[0], 4);
    assert_int_equal(s.pair[1], 9);
    assert_int_equal(s.first, 0);
    assert_int_equal(s.last, 8);
    assert_int_equal(s.choice, 6);
    assert_int_equal(s.kind, KIND_B);
    assert_int_equal(s.constant, 42);
    assert_int_equal(s.num_words, 2);
    assert_string_equal(s.word[0], "x");
    assert_string_equal(s.word[1], "y");
    assert_true(s.real == 1);
    assert_true(
        read_bound("--small 4294967295 --big 0xffffffffffffffff --kind-b --real 0.5 --seconds 1.5m",
                   words, &s, &e));
    assert_int_equal(s.small, UINT32_MAX);
    assert_true(s.big == UINT64_MAX);
    assert_int_equal(s.kind, KIND_B);
    assert_true(s.real == 0.5);
    assert_true(s.seconds == 90);
    assert_true(
        read_bound("-t u -t v --one-of b --texts p q -l 1 -l 2 --read ab cde", words, &s, &e));
    assert_string_equal(s.text, "v");
    assert_string_equal(s.one_of, "b");
    assert_string_equal(s.pair_of_texts[0], "p");
    assert_string_equal(s.pair_of_texts[1], "q");
    assert_int_equal(s.num_list, 2);
    assert_string_equal(s.list[1], "2");
    assert_int_equal(s.read, 32);
    assert_true(read_bound("--size 480x360 -f -n 3e0", words, &s, &e));
    assert_true(s.flag && s.pair[0] == 480 && s.pair[1] == 360);
    assert_int_equal(s.number, 3);
    assert_true(read_bound("--size=1x2", words, &s, &e));
    assert_true(s.pair[0] == 1 && s.pair[1] == 2);
    assert_true(read_bound("-f --stop --nonsense", words, &s, &e));
    assert_true(s.flag && s.stop);
    assert_true(read_bound("--big 010", words, &s, &e)); /* not octal */
    assert_true(s.big == 10);
}

TEST(values_are_checked)
{
    static const char *const cases[][2] = {
        {"-n 8", "--number: '8' is not a whole number from -3 to 7"},
        {"-n -4", "--number: '-4' is not a whole number from -3 to 7"},
        {"-n 25e-1", "--number: '25e-1' is not a whole number from -3 to 7"},
        {"-n 1e1", "--number: '1e1' is not a whole number from -3 to 7"},
        {"-n 1e", "--number: '1e' is not a whole number from -3 to 7"},
        {"--size 4x 3", "--size: '4x' is not a whole number from 1 to 4000"},
        {"--size 4x5000", "--size: '5000' is not a whole number from 1 to 4000"},
        {"--pair 1x2", "option '--pair' needs A B"},
        {"--pair 1 10", "--pair: '10' is not a whole number from 0 to 9"},
        {"--range 3", "--range: '3' is not a range A:B"},
        {"--range 3:3", "--range: no sample in '3:3'"},
        {"--range 3:9", "--range: '9' is not a whole number from 1 to 8"},
        {"--choice c", "--choice: 'c' is none of: a, b"},
        {"--one-of c", "--one-of: 'c' is none of: a, b"},
        {"--small 4294967296", "--small: '4294967296' is above 2^32-1"},
        {"--big -1", "--big: '-1' is not a whole number from 0 to 2^64-1"},
        {"--real 2.5", "--real: '2.5' is not a number from 0.5 to 2"},
        {"--seconds 101m", "--seconds: '101' is not a number from 1e-09 to 100"},
        {"-l 1 -l 2 -l 3", "--list: at most 2 things"},
        {"--read a b", "read: 11"},
        {"x y z", "verb takes two words, 'z' is one more"},
        {"--nonsense", "unknown option '--nonsense' (see --help)"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct settings s;
        struct err e;
        char words[128];
        assert_false(read_bound(cases[i][0], words, &s, &e));
        assert_string_equal(e.msg, cases[i][1]);
    }
}
