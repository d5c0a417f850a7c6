/* The kinds of commands that can be planned (plan.h), and the functions with which they build a plan. */
#ifndef ASSAY_JOB_KINDS_H
#define ASSAY_JOB_KINDS_H

#include "renderer/base/cli_rewrite.h"
#include "plan.h"

/* Building a plan. Texts are copied; one that is not UTF-8 fails with a line. */

/* Begins the head of a plan of that kind, for the command argv. */
NODISCARD bool plan_head(struct plan *p, const char *kind, int argc, char **argv, struct err *e);
/* To be called first by a kind: the command's output, which fixes p->dir (made here); the file that each job
 * leaves; the threads of a job. */
NODISCARD bool plan_begin(struct plan *p, const char *output, const char *product, int cpus,
                          struct err *e);
/* Appends words of the jobs' common command; the first is the program, which becomes an input. user: they are from the
 * user's command, and "{job}" and "{out}" are refused. */
NODISCARD bool plan_run_words(struct plan *p, const char *const *word, int num, bool user,
                              struct err *e);
/* Appends the words of the user's command, without those that the table leaves out. */
NODISCARD bool plan_user_words(struct plan *p, const struct option_words *leave_out, int num,
                               char **word, struct err *e);
/* Accepts another exit code of jobs besides 0. */
void plan_may_end(struct plan *p, int code);
/* Adds a file or directory that all jobs read, by its hash. */
NODISCARD bool plan_input(struct plan *p, const char *path, struct err *e);
/* Adds the programs that a validation with --live runs: Blender, and the other engines if they are in PATH, as not
 * every scene needs them. */
NODISCARD bool job_reference_live_inputs(struct plan *p, const char *share_dir, struct err *e);
/* Adds a job with its words; input: the files that only it reads, NULL at the end. To be called after all of the
 * above. */
NODISCARD bool plan_job(struct plan *p, const char *const *word, int num, const char *const *input,
                        struct err *e);

/* Each pair plans the command (argv[0]: its name), and assembles its output from the jobs, returning the command's exit
 * code. */
bool job_render_plan(int argc, char **argv, const struct plan_wishes *w, struct plan *p,
                     struct err *e);
/* As job_render_gather(), but does not print the names of the images. */
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
