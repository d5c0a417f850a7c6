/* Splits a command into jobs that can run on any machine, in any order, and more than once. A job is a program with its
 * arguments and the hashes of its inputs; it leaves one artefact, the directory DIR/jobs/KEY, which appears by rename.
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
/* How a command is to be cut; zero: the default, in parentheses. A wish that does not fit its kind is refused. */
struct plan_wishes {
    int parts; /* a render: the number of cells, about; references: the number of jobs (PLAN_PARTS) */
    int ranges; /* a render: number of sample ranges of each cell (1) */
    enum {
        PLAN_BY_DEFAULT,
        PLAN_BY_SCENE,
        PLAN_BY_CLAIM
    } by;                   /* a validation: a job for each what (scene) */
    const char *pathtracer; /* a render: the program (the one beside this) */
};

/* Plans the command argv[0 .. argc-1], whose first word is one of the kinds, and writes DIR/plan.jsonl by rename.
 * dir NULL: OUTPUT.plan beside the output of the command. plan_read() reads it back; it fails on a plan of another
 * version. The caller calls plan_free(). */
NODISCARD bool plan_make(const char *dir, int argc, char **argv, const struct plan_wishes *w,
                         struct plan *out, struct err *e);
NODISCARD bool plan_read(const char *dir, struct plan *out, struct err *e);
void plan_free(struct plan *p);

/* Has job k an artefact? job_run_verify() checks also that it is what the job wrote. */
bool job_run_is_made(const struct plan *p, int k);
NODISCARD bool job_run_verify(const struct plan *p, int k, struct err *e);

/* Runs job k, unless it has an artefact with the right hash; *made: did it run? Fails if an input has changed
 * or the program fails, and then leaves no new artefact. To be called in the plan's cwd. */
NODISCARD bool job_run(const struct plan *p, int k, bool *made, struct err *e);

/* Assembles from the artefacts what the command would have left, and returns its exit code; EXIT_NOT_JUDGED,
 * with a line, if a job is not made. To be called in the plan's cwd. */
int plan_gather(const struct plan *p, struct err *e);

/* Changes to the plan's cwd. */
NODISCARD bool plan_enter(const struct plan *p, struct err *e);

/* DIR/jobs/KEY[/name] of job k. */
struct path job_run_artefact(const struct plan *p, int k, const char *name);
/* A text of the head, borrowed; NULL: there is none. plan_are_texts(): is it an array of texts? */
const char *plan_text(const struct plan *p, const char *name);
bool plan_are_texts(const json_t *array);
/* The words of such an array, NULL-terminated; one block, to free(). NULL out of memory. */
char **plan_words(const json_t *array, int *num);

#endif
