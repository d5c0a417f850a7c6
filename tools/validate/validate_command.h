/* The command line of `assay validate`, and what it does with results. */
#ifndef ASSAY_VALIDATE_COMMAND_H
#define ASSAY_VALIDATE_COMMAND_H

#include "tools/base/data_dirs.h"
#include "validate.h"

struct validate_command {
    struct validate_options opt;
    struct engine engine;    /* opt.engine, where there is one; the caller calls engine_free() */
    const char *engine_file; /* or a name; NULL: none */
    char own_engine[4096];   /* what a suite.json names instead; empty: none */
    bool has_reference_seed;
    bool slurm, help;    /* help: it was printed, and opt is not complete */
    struct data_dirs at; /* for the options that are not given */
};

/* *c has to stay where it is. */
NODISCARD bool validate_command_read(int argc, char **argv, struct validate_command *c,
                                     struct err *e);
/* Adds what the claims that differ share to the results, writes results.json, junit.xml and the page, prints the table;
 * the exit code. */
int validate_command_finish(const struct validate_command *c, json_t *results, struct err *e);

#endif
