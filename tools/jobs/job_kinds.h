/* What can be planned (plan.h), and what a kind has to say for it. */
#ifndef ASSAY_JOB_KINDS_H
#define ASSAY_JOB_KINDS_H

#include "renderer/base/cli_rewrite.h"
#include "plan.h"

/* A plan in the making. Texts are copied; what is no UTF-8 makes it fail at the end. */

/* What is planned: a kind, with the command argv. */
NODISCARD bool plan_head(struct plan *p, const char *kind, int argc, char **argv, struct err *e);
/* What a kind does first: where the output goes, which fixes plan->dir, what the jobs leave, and their threads. */
NODISCARD bool plan_begin(struct plan *p, const char *output, const char *product, int cpus,
                          struct err *e);
/* Words of all jobs, from the program on, which is an input. user: from the user's command, where "{job}" and "{out}" are
 * refused. */
NODISCARD bool plan_run_words(struct plan *p, const char *const *word, int num, bool user,
                              struct err *e);
/* Those of the user's command that the table does not leave out. */
NODISCARD bool plan_user_words(struct plan *p, const struct option_words *leave_out, int num,
                               char **word, struct err *e);
/* An exit code besides 0. */
void plan_may_end(struct plan *p, int code);
/* A file or directory that all jobs read. */
NODISCARD bool plan_input(struct plan *p, const char *path, struct err *e);
/* What a validation with --live runs: Blender, and the other engines that are in PATH, since not every scene needs them. */
NODISCARD bool job_reference_live_inputs(struct plan *p, const char *share_dir, struct err *e);
/* The next job; input: what it alone reads, NULL at the end. After all of the above. */
NODISCARD bool plan_job(struct plan *p, const char *const *word, int num, const char *const *input,
                        struct err *e);

/* Each plans the command (argv[0] its name), and puts it together; the exit code of the command. */
bool job_render_plan(int argc, char **argv, const struct plan_wishes *w, struct plan *p,
                     struct err *e);
/* Without naming the images on stdout. */
NODISCARD bool job_render_gather_quietly(const struct plan *p, int argc, char **argv,
                                         struct err *e);
int job_render_gather(const struct plan *p, int argc, char **argv, struct err *e);
bool job_grade_plan(int argc, char **argv, const struct plan_wishes *w, struct plan *p,
                    struct err *e);
int job_grade_gather(const struct plan *p, int argc, char **argv, struct err *e);
bool job_validate_plan(int argc, char **argv, const struct plan_wishes *w, struct plan *p,
                       struct err *e);
int job_validate_gather(const struct plan *p, int argc, char **argv, struct err *e);
bool job_reference_plan(int argc, char **argv, const struct plan_wishes *w, struct plan *p,
                        struct err *e);
int job_reference_gather(const struct plan *p, int argc, char **argv, struct err *e);

#endif
