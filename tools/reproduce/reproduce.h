/* Makes a render, a golden or a results.json again from what the file says of its origin, and compares. */
#ifndef ASSAY_REPRODUCE_H
#define ASSAY_REPRODUCE_H

#include "renderer/base/err.h"

struct reproduce_options {
    const char *pathtracer; /* NULL: the one beside this program */
    const char *scene;      /* NULL: where the command says, from the current directory */
    const char *keep;       /* file that gets what was made again; NULL: none */
    int threads;            /* 0: all processors */
    bool run_foreign;       /* run programs that results name, too */
};

struct reproduced {
    char *command; /* that was run, or "assay merge ..." */
    char made_by
        [128]; /* version and commit of the program that wrote the file; "" if it does not say */
    double num_values, num_different;
    char first[300]; /* where and what, of the first value that differs */
    char note[300];  /* "", or what else may be why */
};

/* Also of one that is zero. */
void reproduced_free(struct reproduced *r);

/* False if it cannot be judged: no provenance, a scene, camera or environment file that is not the one of then, a program that fails
 * or is not ours. That values differ is no failure but num_different > 0. */
NODISCARD bool reproduce(const char *path, const struct reproduce_options *opt,
                         struct reproduced *out, struct err *e);

#endif
