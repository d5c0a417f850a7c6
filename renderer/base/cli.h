/* Command lines: a table of options that is also the --help text, and strict number parsing. Shared
 * by both programs. An option may take several arguments, as the assignment's -r W H does. */
#ifndef ASSAY_CLI_H
#define ASSAY_CLI_H

#include "err.h"

#include <stdint.h>
#include <stdio.h>

struct cli_option {
    char short_name;       /* 0: none */
    const char *long_name; /* without dashes */
    int num_args;          /* 0 .. 4 */
    const char *args;      /* as shown in the help: "W H" */
    const char *help;      /* with default and unit; '\n' starts a new line */
};

struct cli {
    const struct cli_option *options; /* ends with a NULL long_name */
    int argc;
    char **argv;
    int next;             /* next argv to look at; starts at 1 */
    bool only_positional; /* after "--" */
    const char *value[4]; /* the arguments of the option just returned */
    const char *name;     /* the option as the user wrote it, for messages */
    const char *letters;  /* short options left in that word, NULL: none */
};

enum { CLI_END = -1, CLI_POSITIONAL = -2, CLI_ERROR = -3 };

/* The index of the next option in the table, CLI_POSITIONAL (value[0] holds it), CLI_END or
 * CLI_ERROR (e says what). "--" ends the options; --name=value and -nvalue work for one
 * argument, and short options without any may stand together, as getopt has it. */
int cli_next(struct cli *c, struct err *e);

/* The words of a command that parsed, each short option and its argument by itself ("-qj4" as "-q -j 4"), for who stores
 * commands or leaves words out: a NULL-terminated array that points into argv too, to free(). NULL: out of memory. */
char **cli_apart(const struct cli_option *options, int argc, char **argv)
    __attribute__((warn_unused_result));

/* Prints the table, two columns. */
void cli_print_options(FILE *f, const struct cli_option *options);

/* The whole of `text` must be a number inside [lo, hi]; `what` names it in the line. */
bool cli_int(const char *what, const char *text, long lo, long hi, int *out, struct err *e)
    __attribute__((warn_unused_result));
bool cli_uint64(const char *what, const char *text, uint64_t *out, struct err *e)
    __attribute__((warn_unused_result));
bool cli_double(const char *what, const char *text, double lo, double hi, double *out,
                struct err *e) __attribute__((warn_unused_result));

/* A number above 0 and at most hi, times the value of the unit (one character) behind it or, without
 * one, of the last, whose name is NULL. */
struct cli_unit {
    const char *name;
    double value;
};
extern const struct cli_unit cli_time_units[]; /* 90, 90s, 5m or 2h, in seconds */
bool cli_with_unit(const char *what, const char *text, const struct cli_unit *unit, double hi,
                   double *out, struct err *e) __attribute__((warn_unused_result));

/* What --threads is where nobody says: the processors of the machine, at most 1024. */
int cli_processors(void);

/* Index of `text` in a NULL-terminated list of words; fails naming the list. */
bool cli_choice(const char *what, const char *text, const char *const *words, int *out,
                struct err *e) __attribute__((warn_unused_result));

#endif
