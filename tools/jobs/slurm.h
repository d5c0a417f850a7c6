/* Jobs of a plan on a Slurm cluster whose nodes see the plan's directory under the same path. */
#ifndef ASSAY_SLURM_H
#define ASSAY_SLURM_H

#include "plan.h"

/* Until every job of the plan is made, submits those that are neither made nor in an array in the queue, as an array of at
 * most 1000 tasks, and follows them. Arrays that an earlier, interrupted run submitted are
 * followed, not repeated. DIR/assay-PLAN-R: the jobs of round R, a line for each task; DIR/log/assay-PLAN-R-TASK.txt: what
 * it printed (PLAN: hash of plan.jsonl). One line of progress on stderr where anything changes.
 * Fails with a line if Slurm cannot be asked for a minute, or on a job that came back three times without its artefact. On SIGINT and
 * SIGTERM the arrays are cancelled. */
NODISCARD bool slurm_make(const struct plan *p, struct err *e);

#endif
