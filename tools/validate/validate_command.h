/* The command line of `assay validate`, and what it does with results. */
#ifndef ASSAY_VALIDATE_COMMAND_H
#define ASSAY_VALIDATE_COMMAND_H

#include "tools/base/data_dirs.h"
#include "validate.h"

struct validate_command {
    struct validate_options opt;
    struct engine engine;    /* what opt.engine points to; the caller calls engine_free() */
    const char *engine_file; /* or a name; NULL: none */
    char own_engine[4096];   /* the file that suite.json names instead; empty: none */
    bool has_reference_seed;
    bool slurm, help;    /* help: has been printed; opt is then incomplete */
    struct data_dirs at; /* defaults of the options that name directories */
};

/* Reads the command line into *c, which must not be moved afterwards: opt points into it. */
NODISCARD bool validate_command_read(int argc, char **argv, struct validate_command *c,
                                     struct err *e);
/* Adds to the results what the claims that differ have in common ("located"), writes results.json, junit.xml and
 * the page, prints the table, and returns the exit code. */
int validate_command_finish(const struct validate_command *c, json_t *results, struct err *e);

#endif
