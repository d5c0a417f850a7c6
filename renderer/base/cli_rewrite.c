#include "cli_rewrite.h"

#include <string.h>

const struct option_words cli_rewrite_render[] = {
    {"-f", 1},       {"--out", 1},     {"--samples", 1},
    {"-t", 1},       {"--threads", 1}, {"--time", 1},
    {"--error", 1},  {"--slurm", 1},   {"--write-every", 1},
    {"--resume", 1}, {"--heatmap", 1}, {"--keep-state", 0},
    {"-q", 0},       {"--quiet", 0},   {0}};

/* Number of words at word[0] that the table drops: 0, or an option with its arguments; at most `left`. */
static int cli_rewrite_to_drop(const struct option_words *table, char *const *word, int left)
{
    for (const struct option_words *o = table; o->name != NULL; o++) {
        size_t n = strlen(o->name);
        if (strcmp(word[0], o->name) == 0)
            return 1 + o->args < left ? 1 + o->args : left;
        if (n > 2 && strncmp(word[0], o->name, n) == 0 && word[0][n] == '=')
            return 1;
    }
    return 0;
}

bool cli_rewrite_has_word(int argc, char *const *argv, const char *short_name,
                          const char *long_name)
{
    const struct option_words table[] = {{short_name, 0}, {long_name, 0}, {0}};
    for (int i = 1; i < argc; i++)
        if (cli_rewrite_to_drop(table, &argv[i], 1) > 0)
            return true;
    return false;
}

int cli_rewrite_kept(const struct option_words *table, int num, char *const *word, char **kept)
{
    int n = 0;
    for (int i = 0; i < num;) {
        int drop = cli_rewrite_to_drop(table, &word[i], num - i);
        if (drop == 0)
            kept[n++] = word[i];
        i += drop > 0 ? drop : 1;
    }
    return n;
}
