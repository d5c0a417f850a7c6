/* One run of `assay compare`: from paths to a verdict with its notes, and its results.json. */
#ifndef ASSAY_COMPARE_JOB_H
#define ASSAY_COMPARE_JOB_H

#include "tools/input/input.h"
#include "tools/exact/permutation.h"
#include "tools/exact/sign_flip.h"

struct compare_job {
    const char *path[2];  /* A is tested, B the reference */
    const char *title;    /* of the page; NULL: none */
    const char *name[2];  /* what results and the page call the sides; NULL: their paths */
    const char *again[2]; /* fresh renders of both for a second stage, or NULL */
    /* NULL, or a side that is in memory: of path, of again, which then only name it. */
    const struct input_memory *memory[2], *memory_again[2];
    struct input_options input[2];
    struct compare_options opt;
    bool paired;       /* both sides share their noise: it is taken from A - B */
    bool exchangeable; /* judge by permutation of replicates */
    bool same_program; /* judge by flipping signs of pixels (same_program.h) */
    int filter_width;  /* of that */
    enum verdict expected;
    double accept_mdb[2]; /* as of struct claim_context */
    int min_side;         /* of a region to permute; 0: permutation.h chooses */
};

struct compared {
    struct moments m[2];     /* what was compared last: the first pair or, flagged, the second */
    bool is_guessed;         /* their n and unit are not of observations (input.h) */
    bool is_stated[2];       /* the side's moments are what it states, for the whole image */
    bool is_file[2];         /* and in a moments EXR, path[] */
    const char *path[2];     /* of that pair; the job's */
    struct comparison r;     /* its verdict and reason are the claim's, whoever reached it */
    struct permutation perm; /* of an exchangeable job; of the last stage */
    struct sign_flip flip;   /* of a job of the same program */
    bool
        has_means; /* false: of the same program, whose means could not be compared; m and r but for verdict,
                                reason and MDBs are empty */
    enum verdict mean_verdict; /* if they could: what margins say of the means, and why */
    char mean_reason[256];
    struct notes notes;
};

/* Fills in what follows from other options (margin_tile below 0, accept_mdb[1] 0: four times the image's; what is expected) and
 * fails with a line where two do not go together, in the words of the command. */
NODISCARD bool compare_job_check(struct compare_job *job, struct err *e);

/* Reads, compares, and, with a second pair, confirms. The caller frees with compare_job_free(). */
NODISCARD bool compare_job_run(const struct compare_job *job, struct compared *out, struct err *e);
void compare_job_free(struct compared *c);
/* Did what was expected come out (claim_result_passes())? */
bool compare_job_passes(const struct compare_job *job, const struct compared *c);

/* results.json at `path` with one claim, and beside it what the report shows: PATH.z.exr,
 * PATH.relative.exr and, for sides that are no moments EXR, PATH.a.exr and PATH.b.exr. argc, argv:
 * the command line. */
NODISCARD bool compare_job_write_json(const struct compare_job *job, const struct compared *c,
                                      const char *path, int argc, char **argv, struct err *e);
/* The page of that results.json, which goes with a directory of its own. */
NODISCARD bool compare_job_write_report(const struct compare_job *job, const struct compared *c,
                                        const char *path, int argc, char **argv, struct err *e);

#endif
