/* Splits a command into jobs that can run on any machine, in any order, and more than once. A job is a program with its
 * arguments; it knows its inputs by hash and leaves one artefact, the directory DIR/jobs/KEY, which appears by rename.
 * Files: tools/docs/formats/plan.md. Use: tools/docs/guide-cluster.md. */
#ifndef ASSAY_PLAN_H
#define ASSAY_PLAN_H

#include "renderer/base/fs.h"

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
NODISCARD bool plan_make(const char *dir, int argc, char **argv, const struct plan_wishes *w,
                         struct plan *out, struct err *e);
NODISCARD bool plan_read(const char *dir, struct plan *out, struct err *e);
void plan_free(struct plan *p);

/* Is the artefact of job k there? Whether it is what was written, job_run_verify() says. */
bool job_run_is_made(const struct plan *p, int k);
NODISCARD bool job_run_verify(const struct plan *p, int k, struct err *e);

/* Runs job k, unless its artefact is there with the right hash; *made: it ran. Fails if an input has
 * changed or the program fails; then there is no artefact. Current directory: the plan's cwd. */
NODISCARD bool job_run(const struct plan *p, int k, bool *made, struct err *e);

/* Puts the artefacts together to what the command would have left, and returns its exit code. Fails
 * with EXIT_NOT_JUDGED on a job that is not made. Current directory: the plan's cwd. */
int plan_gather(const struct plan *p, struct err *e);

/* Goes to the plan's cwd. */
NODISCARD bool plan_enter(const struct plan *p, struct err *e);

/* DIR/jobs/KEY of job k[/name]. */
struct path job_run_artefact(const struct plan *p, int k, const char *name);
/* A text of the head. */
const char *plan_text(const struct plan *p, const char *name);
bool plan_are_texts(const json_t *array);
/* The words of such an array, NULL-terminated; one block, to free(). NULL out of memory. */
char **plan_words(const json_t *array, int *num);

#endif
