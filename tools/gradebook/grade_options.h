/* The command line of `assay grade`. */
#ifndef ASSAY_GRADE_OPTIONS_H
#define ASSAY_GRADE_OPTIONS_H

#include "tools/base/data_dirs.h"

#include <stdint.h>

struct grade_settings {
    const char *rubric, *out, *pathtracer, *golden, *suite, *references, *build_cache, *before,
        *appeals;            /* before: out, if nothing else is said; NULL: none */
    const char **submission; /* num of them, words of the command */
    int num, jobs, threads, variant;
    uint64_t seed;
    double alpha;
    bool only_check, prepare, fill, again, unsafe, quiet, slurm, help;
};

/* at: gets the paths that the options do not give. submission: NULL out of memory, else room for argc + 1, which the caller frees. */
struct grade_settings grade_options_default(int argc, struct data_dirs *at);
/* On top of the defaults. */
NODISCARD bool grade_options_parse(int argc, char **argv, struct grade_settings *s, struct err *e);
/* The words that decide a grade: "grade", the options and the rubric, without the submissions, where outputs go, how many at a
 * time and the variant, which the references know: a NULL-terminated array of num words, to free(). NULL out of memory. */
NODISCARD char **grade_options_words(int argc, char **argv, const struct grade_settings *s,
                                     int *num);
void grade_options_help(void);

/* Where references are kept. */
struct path grade_options_references(const struct grade_settings *s);

/* What they ask for but --help and --slurm; argv: where they were read from. The exit code (results.h); with EXIT_NOT_JUDGED, e has
 * the line. */
int grade_command(const struct grade_settings *s, int argc, char **argv, struct err *e);

#endif
