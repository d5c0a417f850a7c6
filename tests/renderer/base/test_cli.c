/* Command lines as getopt's users write them. */

#include "renderer/base/cli.h"
#include "tests/support/test.h"

static const struct cli_option options[] = {{'j', "jobs", 1, "N", "jobs"},
                                            {'q', "quiet", 0, "", "quiet"},
                                            {'H', "hemisphere", 0, "", "hemisphere"},
                                            {'r', "resolution", 2, "W H", "pixels"},
                                            {'s', "spp", 1, "N", "samples"},
                                            {0, "seed", 1, "N", "seed"},
                                            {0}};

/* "LONG=VALUE,VALUE " of each option, "VALUE " of what is none; or the line of the error. */
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
                     options[i].num_args > 0 ? c.value[0] : "", options[i].num_args > 1 ? "," : "",
                     options[i].num_args > 1 ? c.value[1] : "");
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
        {"--sed", NULL, "unknown option '--sed'"},
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
