/* Words of a command line that are to be left out when it is run again in another way. */
#ifndef ASSAY_COMMAND_WORDS_H
#define ASSAY_COMMAND_WORDS_H

struct option_words {
    const char *name; /* "-t" or "--threads" */
    int args;
};

/* What says how far, where to, where or how a render of pathtracer goes on, not what it is of. Ends with a NULL name. */
extern const struct option_words render_how[];

/* How many words from word[0] on to leave out by the table: 0, or an option and its arguments, `left` at most. */
int words_to_drop(const struct option_words *table, char *const *word, int left);

#endif
