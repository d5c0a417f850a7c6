/* A store of runs of submissions, with a key of all that decides a run: grading again with other points,
 * margins, hints or references runs nothing again. A run is a directory STORE/KEY: the files that it
 * handed out, its log, and run.json, which is written last and has their hashes. */
#ifndef ASSAY_KEPT_RUN_H
#define ASSAY_KEPT_RUN_H

#include "tools/base/sandbox.h"

#include "renderer/base/fs.h"

/* STORE/KEY of a job. of: a text that identifies its tree and whatever else distinguishes it; inputs: the
 * files in job->scene that it reads (NULL at the end). Its limits are part of the key, as they decide how
 * it ends. */
NODISCARD bool kept_run_path(const char *store, const char *of, const struct sandbox *s,
                             const struct sandbox_job *job, const char *const *inputs,
                             struct path *dir, struct err *e);

/* Restores a run as if the job had been run now: its files are in job->out, its log is at job->log.
 * False: it is not in the store, is damaged, or was kept for a job that handed out other files. */
bool kept_run_read(const char *dir, const struct sandbox_job *job, struct sandbox_result *out);

/* Adds a run to the store, in place of what is there. */
NODISCARD bool kept_run_write(const char *dir, const struct sandbox_job *job,
                              const struct sandbox_result *result, struct err *e);

#endif
