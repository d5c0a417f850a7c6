/* The command line of `assay grade`. */
#ifndef ASSAY_GRADE_OPTIONS_H
#define ASSAY_GRADE_OPTIONS_H

#include "tools/base/data_dirs.h"

#include <stdint.h>

struct grade_settings {
    const char *rubric, *out, *pathtracer, *golden, *suite, *references, *build_cache, *before,
        *appeals;            /* before: `out` unless given; appeals: NULL none */
    const char **submission; /* num of them; the texts are argv's */
    int num, jobs, threads, variant;
    uint64_t seed;
    double alpha;
    bool only_check, prepare, fill, again, unsafe, quiet, slurm, help;
};

/* at: gets the paths that the options do not give. submission: NULL out of memory, else room for argc + 1, which the caller frees. */
struct grade_settings grade_options_default(int argc, struct data_dirs *at);
/* On top of the defaults. */
NODISCARD bool grade_options_parse(int argc, char **argv, struct grade_settings *s, struct err *e);
/* The words that decide a grade: "grade", the options and the rubric, without submissions, --out,
 * --jobs and the like, and --variant, which is kept with the references. A NULL-terminated array of
 * *num words, for free(); NULL: out of memory. */
NODISCARD char **grade_options_words(int argc, char **argv, const struct grade_settings *s,
                                     int *num);
void grade_options_help(void);

/* Where references are kept. */
struct path grade_options_references(const struct grade_settings *s);

/* Does what the settings ask for, except --help and --slurm. argv: the words that they were read
 * from. Returns the exit code (results.h); with EXIT_NOT_JUDGED, *e has the line. */
int grade_command(const struct grade_settings *s, int argc, char **argv, struct err *e);

#endif
