/* Dropping options from a command line that is to be run again in another way. */
#ifndef ASSAY_CLI_REWRITE_H
#define ASSAY_CLI_REWRITE_H

#include <stdbool.h>

struct option_words {
    const char *name; /* "-t" or "--threads" */
    int args;
};

/* Options of pathtracer that do not say what is rendered: which samples, where output goes,
 * threads, time and error limits, checkpoints, resuming, Slurm, messages. Ends with a NULL name. */
extern const struct option_words cli_rewrite_render[];

/* Is an option among the words, as -t, --threads or --threads=N? */
bool cli_rewrite_has_word(int argc, char *const *argv, const char *short_name,
                          const char *long_name);

/* Copies to kept[] (room for num; may be word) the words that the table does not drop; returns how many. */
int cli_rewrite_kept(const struct option_words *table, int num, char *const *word, char **kept);

#endif
