/* Command lines: a table of options that is the --help text and says where each value goes and what
 * it may be, and strict number parsing. Shared by both programs. An option may take several
 * arguments, as the assignment's -r W H does; those of W H may be one word, 480x360. */
#ifndef ASSAY_CLI_H
#define ASSAY_CLI_H

#include "err.h"

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/* A number above 0 is multiplied by the value of its suffix (one character) or else by that of the
 * row with a NULL name. */
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

/* A row. The value goes to a member of the command's settings, whose type says how it is read. A
 * table ends with a row without a name, which describes the positional arguments: {0} if the
 * command takes none. */
struct cli_option {
    char short_name;       /* 0: none */
    const char *long_name; /* without dashes */
    const char *args;      /* as shown in the help, a word for each of up to 4: "W H"; "": none */
    const char *help;      /* with default and unit; '\n' starts a new line */
    enum cli_kind kind;    /* this and the next by one of the macros below */
    size_t to;
    double lo,
        hi; /* of a number; lo: what an int becomes without arguments, or by the first of the names */
    const char *const *names;    /* a text is one of these, an int lo + its index; NULL: any */
    const struct cli_unit *unit; /* of a double: the suffixes it may have (cli_time_units: s, m, h).
                                  * The number before the suffix is then at least 1e-9 and at most
                                  * hi; lo is not used. NULL: no suffix */
    size_t num;                  /* CLI_LIST: where the int is that counts */
    const char *noun;            /* what a CLI_LIST or CLI_RANGE is of, for messages */
    bool (*read)(void *settings, const char *const value[4], struct err *e); /* CLI_READ: does it */
    bool stops;        /* nothing is read after it */
    const char *usage; /* of --help: stops, and prints this and the table; NULL: does not */
};

/* The kind and the place of a member of struct `type`. Several arguments go into as many members in a row. */
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
/* An option that may be given again: an array of texts, and the int that counts them. */
#define CLI_TO_LIST(type, member, count)                                                           \
    .kind = CLI_LIST, .to = offsetof(type, member), .num = offsetof(type, count),                  \
    .hi = sizeof((type *)0)->member / sizeof(const char *)
/* A:B, 0 <= A < B <= hi, into the int `member` and the one behind it. */
#define CLI_TO_RANGE(type, member) .kind = CLI_RANGE, .to = offsetof(type, member)
/* Of the last row: the words from the first that is no option on are another command; its index. */
#define CLI_TO_REST(type, member) .kind = CLI_REST, .to = offsetof(type, member), .stops = true
/* Reads the words into *settings, which hold the defaults. False with one line on what is no
 * option, no value of it, or one word too many. Text is that of argv. */
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

/* The index of the next option in the table, CLI_POSITIONAL (value[0] holds it), CLI_END or
 * CLI_ERROR (e says what). "--" ends the options; --name=value and -nvalue work for one
 * argument, and short options without any may stand together, as getopt has it. */
int cli_next(struct cli *c, struct err *e);

/* The words of a command that parsed, with short options split ("-qj4" into "-q -j 4"), for callers
 * that store commands or drop words: a NULL-terminated array, to free(), that points into argv too.
 * NULL: out of memory. */
NODISCARD char **cli_apart(const struct cli_option *options, int argc, char **argv);

/* Prints the text and then the table in two columns on stdout. */
void cli_print_help(const char *usage, const struct cli_option *options);

/* The whole of `text` must be a number inside [lo, hi]; `what` names it in the line. A whole one
 * may be written as 1e3. */
NODISCARD bool cli_int(const char *what, const char *text, long lo, long hi, int *out,
                       struct err *e);
NODISCARD bool cli_uint64(const char *what, const char *text, uint64_t *out, struct err *e);
NODISCARD bool cli_uint32(const char *what, const char *text, uint32_t *out, struct err *e);
NODISCARD bool cli_double(const char *what, const char *text, double lo, double hi, double *out,
                          struct err *e);

/* Index of `text` in a NULL-terminated list of words; fails naming the list. */
NODISCARD bool cli_choice(const char *what, const char *text, const char *const *words, int *out,
                          struct err *e);

/* Of the words next(list, i), i = 0, 1, .. until NULL, the one probably meant: with the fewest
 * letters to change, insert, drop or swap with their neighbours, at most a third of them; NULL:
 * none. */
const char *cli_nearest(const char *word, const char *(*next)(const void *list, size_t i),
                        const void *list);

/* What --threads is where nobody says: the processors of the machine, at most 1024. */
int cli_processors(void);

#endif
