/* Command lines: a table of options that gives the --help text, where each value is stored and which
 * values are valid; and strict number parsing. Shared by both programs. An option may take several
 * arguments, like the assignment's -r W H; W H may also be written as one word, 480x360. */
#ifndef ASSAY_CLI_H
#define ASSAY_CLI_H

#include "err.h"

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/* A positive number is multiplied by the value of its one-character suffix or, without a suffix, by
 * that of the row whose name is NULL. */
struct cli_unit {
    const char *name;
    double value;
};
extern const struct cli_unit cli_time_units[]; /* 90, 90s, 5m or 2h, in seconds */

enum cli_kind {
    CLI_READ,
    CLI_FLAG,
    CLI_INT,
    CLI_UINT32,
    CLI_UINT64,
    CLI_DOUBLE,
    CLI_TEXT,
    CLI_LIST,
    CLI_RANGE,
    CLI_REST
};

/* A row of the table. The value is stored in a member of the command's settings struct, whose type
 * decides how it is parsed. A table ends with a row without a name, which describes the positional
 * arguments: {0} if the command takes none. */
struct cli_option {
    char short_name;       /* 0: none */
    const char *long_name; /* without dashes */
    const char *args;      /* as shown in the help, a word for each of up to 4: "W H"; "": none */
    const char *help;      /* with default and unit; '\n' starts a new line */
    enum cli_kind kind;    /* this and `to`: set by one of the macros below */
    size_t to;
    double lo,
        hi; /* range; lo: also of an int without arguments, or with the first of the names */
    const char *const *names;    /* valid words; an int becomes lo + the index; NULL: any */
    const struct cli_unit *unit; /* of a double: the suffixes it may have (cli_time_units: s, m, h).
                                  * The number before the suffix is then at least 1e-9 and at most
                                  * hi; lo is not used. NULL: no suffix */
    size_t num;                  /* CLI_LIST: offset of the int that counts the texts */
    const char *noun;            /* CLI_LIST, CLI_RANGE: what an element is called in messages */
    bool (*read)(void *settings, const char *const value[4], struct err *e); /* CLI_READ: does it */
    bool stops;        /* no word after it is read */
    const char *usage; /* of --help: cli_read() prints this and the table, and stops; else NULL */
};

/* Sets kind and offset from a member of struct `type`. Several arguments are stored in as many consecutive members. */
#define CLI_TO(type, member)                                                                       \
    .kind = _Generic(((type *)0)->member,                                                          \
                     bool: CLI_FLAG,                                                               \
                     int: CLI_INT,                                                                 \
                     int *: CLI_INT,                                                               \
                     uint32_t: CLI_UINT32, /* or an enum, with names or without arguments */       \
                     uint64_t: CLI_UINT64,                                                         \
                     double: CLI_DOUBLE,                                                           \
                     const char *: CLI_TEXT,                                                       \
                     const char **: CLI_TEXT),                                                     \
    .to = offsetof(type, member)
/* An option that may be repeated: `member` is an array of texts, `count` the int that counts them. */
#define CLI_TO_LIST(type, member, count)                                                           \
    .kind = CLI_LIST, .to = offsetof(type, member), .num = offsetof(type, count),                  \
    .hi = sizeof((type *)0)->member / sizeof(const char *)
/* A:B, 0 <= A < B <= hi, stored in the int `member` and the int after it. */
#define CLI_TO_RANGE(type, member) .kind = CLI_RANGE, .to = offsetof(type, member)
/* For the last row: the first word that is no option starts another command; stores its index in argv. */
#define CLI_TO_REST(type, member) .kind = CLI_REST, .to = offsetof(type, member), .stops = true
/* Parses the command line into *settings, which must hold the defaults. False with a line on an
 * unknown option, an invalid value or an excess argument. Texts point into argv. */
NODISCARD bool cli_read(const struct cli_option *options, int argc, char **argv, void *settings,
                        struct err *e);

struct cli {
    const struct cli_option *options; /* ends with a NULL long_name */
    int argc;
    char **argv;
    int next;             /* next argv to look at; starts at 1 */
    bool only_positional; /* after "--" */
    const char *value[4]; /* the arguments of the option just returned */
    const char *name;     /* the option as the user wrote it, for messages */
    char size[16];        /* W and H of "480x360", which value points into */
    const char *letters;  /* short options left in that word, NULL: none */
};

enum { CLI_END = -1, CLI_POSITIONAL = -2, CLI_ERROR = -3 };

/* Returns the table's index of the next option, CLI_POSITIONAL (value[0] holds it), CLI_END or
 * CLI_ERROR (with a line in *e). As with getopt, "--" ends the options, --name=value and -nvalue
 * work for options with one argument, and short options without arguments may be joined. */
int cli_next(struct cli *c, struct err *e);

/* The words of a command line that has parsed without error, with short options split ("-qj4" into
 * "-q -j 4"), for callers that store commands or drop words: a NULL-terminated array, some of whose
 * words point into argv. The caller frees it. NULL: out of memory. */
NODISCARD char **cli_apart(const struct cli_option *options, int argc, char **argv);

/* Prints the text and then the table in two columns on stdout. */
void cli_print_help(const char *usage, const struct cli_option *options);

/* The whole of `text` must be a number within [lo, hi]; `what` names it in the error line. cli_int()
 * also accepts 1e3; cli_uint64() and cli_uint32() also 0x... and octal. */
NODISCARD bool cli_int(const char *what, const char *text, long lo, long hi, int *out,
                       struct err *e);
NODISCARD bool cli_uint64(const char *what, const char *text, uint64_t *out, struct err *e);
NODISCARD bool cli_uint32(const char *what, const char *text, uint32_t *out, struct err *e);
NODISCARD bool cli_double(const char *what, const char *text, double lo, double hi, double *out,
                          struct err *e);

/* Index of `text` in a NULL-terminated list of words. Fails with a line that lists the words. */
NODISCARD bool cli_choice(const char *what, const char *text, const char *const *words, int *out,
                          struct err *e);

/* Among the words next(list, 0), next(list, 1), ... up to NULL, the one that `word` (up to its '=')
 * was probably meant to be: the fewest letters to change, insert, delete or swap with a neighbour,
 * at most a third of its length. NULL if none is that close. */
const char *cli_nearest(const char *word, const char *(*next)(const void *list, size_t i),
                        const void *list);

/* Default of --threads: the number of processors that are online, 1 to 1024. */
int cli_processors(void);

#endif
