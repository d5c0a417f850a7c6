/* The verbs of the assay program: each reads its own options, does its job and returns the exit
 * code (results.h); with EXIT_NOT_JUDGED, e has the line. argv[0] is the verb. */
#ifndef ASSAY_COMMANDS_H
#define ASSAY_COMMANDS_H

#include "renderer/base/err.h"

int command_init(int argc, char **argv, struct err *e);
int command_validate(int argc, char **argv, struct err *e);
int command_compare(int argc, char **argv, struct err *e);
int command_converge(int argc, char **argv, struct err *e);
int command_reference(int argc, char **argv, struct err *e);
int command_golden(int argc, char **argv, struct err *e);
int command_export(int argc, char **argv, struct err *e);
int command_merge(int argc, char **argv, struct err *e);
int command_diagnose(int argc, char **argv, struct err *e);
int command_grade(int argc, char **argv, struct err *e);
int command_reproduce(int argc, char **argv, struct err *e);
int command_report(int argc, char **argv, struct err *e);
int command_plan(int argc, char **argv, struct err *e);
int command_run_job(int argc, char **argv, struct err *e);
int command_gather(int argc, char **argv, struct err *e);
int command_slurm(int argc, char **argv, struct err *e);

/* What `assay slurm` does with a command such as "grade ...": plans it in dir (NULL: OUTPUT.plan, removed in the
 * end), runs its jobs on the cluster, and gathers. w NULL: no wishes. */
struct plan_wishes;
int command_slurm_run(const char *dir, int argc, char **argv, const struct plan_wishes *w,
                      struct err *e);

#endif
