/* Runs of submissions, kept by all that decides them: what is graded again by other points, margins, hints or references is not
 * run again. A run is a directory of its own, STORE/KEY: the files that it handed out, its log, and last of all run.json. */
#ifndef ASSAY_KEPT_RUN_H
#define ASSAY_KEPT_RUN_H

#include "tools/base/sandbox.h"

#include "renderer/base/fs.h"

/* STORE/KEY of a job. of: what its tree is, and what else tells it from others; inputs: the files in job->scene that it reads (NULL
 * at the end); its limits count, as they decide how it ends. */
NODISCARD bool kept_run_path(const char *store, const char *of, const struct sandbox *s,
                             const struct sandbox_job *job, const char *const *inputs,
                             struct path *dir, struct err *e);

/* As if the job had been run now: its files are in job->out, its log is at job->log. False: it is not there. */
bool kept_run_read(const char *dir, const struct sandbox_job *job, struct sandbox_result *out);

/* Keeps it. */
NODISCARD bool kept_run_write(const char *dir, const struct sandbox_job *job,
                              const struct sandbox_result *result, struct err *e);

#endif
