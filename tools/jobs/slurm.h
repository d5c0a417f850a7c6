/* Jobs of a plan on a Slurm cluster whose nodes see the plan's directory under the same path. */
#ifndef ASSAY_SLURM_H
#define ASSAY_SLURM_H

#include "plan.h"

/* Makes every job of the plan: submits those that are neither made nor queued, in rounds, each an array of at most
 * 1000 tasks, and waits for them. Arrays that an earlier, interrupted run submitted are followed, not repeated.
 * DIR/assay-PLAN-R: the jobs of round R, a line for each task; DIR/log/assay-PLAN-R-TASK.txt: the task's output
 * (PLAN: hash of plan.jsonl). Prints a line of progress on stderr when anything changes. Fails with a line if Slurm
 * does not answer for a minute, or if a job has been submitted three times and left no artefact. SIGINT and SIGTERM
 * cancel the arrays. */
NODISCARD bool slurm_make(const struct plan *p, struct err *e);

#endif
