/* Makes a render, a golden or a results.json again from what the file says of its origin, and compares. */
#ifndef ASSAY_REPRODUCE_H
#define ASSAY_REPRODUCE_H

#include "renderer/base/err.h"

struct reproduce_options {
    const char *pathtracer; /* NULL: the one beside this program */
    const char *scene;      /* NULL: where the command says, from the current directory */
    const char *keep;       /* file that gets what was made again; NULL: none */
    int threads;            /* 0: all processors */
    bool run_foreign;       /* also run programs, other than ours, that results.json names */
};

struct reproduced {
    char *command; /* that was run, or "assay merge ..."; owned */
    char made_by
        [128]; /* version and commit of the program that wrote the file; "" if it does not say */
    double num_values, num_different;
    char first[300]; /* the first value that differs: where, then and now */
    char note[300];  /* "", or another possible cause of differences */
};

/* Frees it and sets it to zero; *r may be zero. */
void reproduced_free(struct reproduced *r);

/* Makes the file at path again and compares. False if that is impossible: it does not state its origin, a scene,
 * camera or environment file has changed, or a program fails or is not ours. Values that differ are not a failure:
 * num_different > 0. The caller calls reproduced_free(). */
NODISCARD bool reproduce(const char *path, const struct reproduce_options *opt,
                         struct reproduced *out, struct err *e);

#endif
