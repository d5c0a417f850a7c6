/* Results made again (reproduce.h): the JSON that validate, compare, converge and grade write, of a class too. */
#ifndef ASSAY_REPRODUCE_RESULTS_H
#define ASSAY_REPRODUCE_RESULTS_H

#include "reproduce.h"

#include <jansson.h>

/* Runs the command that the file names again, from the current directory, its outputs into `dir`, which exists, and compares every
 * value but those of the run itself: command, date, machine, version, and what was timed. False if it cannot be judged: no
 * command, a --budget that was over before all was decided, then or now, files that are gone, a program that fails. */
bool reproduce_results(const char *path, const struct reproduce_options *opt, const char *dir,
                       struct reproduced *out, struct err *e) __attribute__((warn_unused_result));

/* The first half: runs the command, `num` words, again; product: the file of results, in `dir`. then: what is known of them. */
enum { RESULTS_PATH = 4096 + 64 };
bool results_run_again(const char *path, const json_t *then, int num, char **word, const char *dir,
                       char product[RESULTS_PATH], struct reproduced *out, struct err *e)
    __attribute__((warn_unused_result));

#endif
