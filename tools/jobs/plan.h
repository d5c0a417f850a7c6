/* Work cut into jobs that can run anywhere, in any order, again: each is a program with its words, knows its inputs by
 * hash and leaves one artefact, a directory that appears by rename. tools/docs/guide-cluster.md is the manual.
 *
 * DIR/plan.jsonl: a line of JSON for the whole, then one for each job.
 *   { "assay_plan": 1, "kind": "pathtracer" | "grade" | "validate" | "reference", "version": , "cwd": , "jobs": 64,
 *     "command": ["pathtracer", ...]        that would do all of it here,
 *     "output": "OUT.exr", "product": name  of the file that every job leaves,
 *     "ends": [0], "cpus": 1,               exit codes that are as they should be; threads of a job
 *     "run": [words]                        "{job}" stands for the words of the job, "{out}" begins a path in its artefact,
 *     "inputs": {path: SHA-256} }           of all jobs; relative to cwd
 *   { "job": 0, "key": SHA-256 of words, inputs and version, "words": [...], "inputs": {...} }
 * DIR/jobs/KEY: the artefact, with job.json in it: { "key": , "sha256": of all the rest, "host": , "exit": , "cpu_s": ,
 *     "wall_s": }. Whoever has the same job, of this plan or a later one in DIR, finds it there. */
#ifndef ASSAY_PLAN_H
#define ASSAY_PLAN_H

#include "renderer/base/err.h"

#include <jansson.h>

enum { PLAN_PATH = 4096 };

struct plan {
    char dir[PLAN_PATH]; /* absolute */
    json_t *head;
    char **line; /* of the jobs */
    int num;
};

enum { PLAN_PARTS = 64 };
/* How a command is to be cut; zero: nothing was said. What is not of its kind is refused. */
struct plan_wishes {
    int parts; /* of a render: into about how many cells, of references: how many jobs (PLAN_PARTS) */
    int ranges; /* of a render: into how many sample ranges each of them (1) */
    enum {
        PLAN_BY_DEFAULT,
        PLAN_BY_SCENE,
        PLAN_BY_CLAIM
    } by;                   /* of a validation: what a job is of (a scene) */
    const char *pathtracer; /* of a render: the program (the one beside this) */
};

/* Plans the command argv[0 .. argc-1], whose first word is one of the kinds, and
 * writes DIR/plan.jsonl by rename. dir NULL: OUTPUT.plan beside the output of the command. */
bool plan_make(const char *dir, int argc, char **argv, const struct plan_wishes *w,
               struct plan *out, struct err *e) __attribute__((warn_unused_result));
bool plan_read(const char *dir, struct plan *out, struct err *e)
    __attribute__((warn_unused_result));
void plan_free(struct plan *p);

/* Is the artefact of job k there? Whether it is what was written, job_run_verify() says. */
bool job_run_is_made(const struct plan *p, int k);
bool job_run_verify(const struct plan *p, int k, struct err *e) __attribute__((warn_unused_result));

/* Makes it, if it is not there with the right hash: *made. Fails if an input is not the one that was planned with or the
 * program fails; then there is no artefact. Current directory: the plan's cwd. */
bool job_run(const struct plan *p, int k, bool *made, struct err *e)
    __attribute__((warn_unused_result));

/* Puts the artefacts together to what the command would have left, and returns its exit code. Fails with EXIT_NOT_JUDGED on
 * a job that is not made. Current directory: the plan's cwd. */
int plan_gather(const struct plan *p, struct err *e);

/* Goes to the plan's cwd. */
bool plan_enter(const struct plan *p, struct err *e) __attribute__((warn_unused_result));

/* DIR/jobs/KEY of job k[/name]. */
void job_run_artefact(const struct plan *p, int k, const char *name, char path[PLAN_PATH + 256]);
/* A text of the head. */
const char *plan_text(const struct plan *p, const char *name);
bool plan_are_texts(const json_t *array);
/* The words of such an array, NULL-terminated; one block, to free(). NULL out of memory. */
char **plan_words(const json_t *array, int *num);

#endif
