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
    /* A side in memory, which path or again then only names; NULL: it is a file. */
    const struct input_memory *memory[2], *memory_again[2];
    struct input_options input[2];
    struct compare_options opt;
    bool paired;       /* both sides share their noise: it is taken from A - B */
    bool exchangeable; /* judge by permutation of replicates */
    bool same_program; /* judge by flipping signs of pixels (same_program.h) */
    int filter_width;  /* of same_program (sign_flip.h) */
    enum verdict expected;
    double accept_mdb[2]; /* as in struct claim_context */
    int min_side;         /* of regions of `exchangeable`, pixels; 0: permutation.h chooses */
};

struct compared {
    struct moments m[2];     /* compared last: the first pair or, if that was flagged, the second */
    bool is_guessed;         /* their n and unit do not count observations (input.h) */
    bool is_stated[2];       /* the side states its moments itself, for the whole image */
    bool is_file[2];         /* it does so in a file, the moments EXR path[] */
    const char *path[2];     /* of that pair; borrowed from the job */
    struct comparison r;     /* its verdict and reason are the claim's, by whichever test */
    struct permutation perm; /* of an exchangeable job; of the last stage */
    struct sign_flip flip;   /* of a job of the same program */
    bool
        has_means; /* of a job of the same program; false: the means could not be compared, m is empty, and of r only
                                verdict, reason and MDBs are set */
    enum verdict mean_verdict; /* has_means: the verdict of the means alone, and its reason */
    char mean_reason[256];
    struct notes notes;
};

/* Fills in what follows from other options (margin_tile below 0 and accept_mdb[1] 0 become four times the image's,
 * at most 0.99; the expected verdict). Fails with a line, which names options of the command, if two exclude each
 * other. */
NODISCARD bool compare_job_check(struct compare_job *job, struct err *e);

/* Reads and compares; with a second pair, confirms what the first shows. The caller frees with compare_job_free(). */
NODISCARD bool compare_job_run(const struct compare_job *job, struct compared *out, struct err *e);
void compare_job_free(struct compared *c);
/* Did what was expected come out (claim_result_passes())? */
bool compare_job_passes(const struct compare_job *job, const struct compared *c);

/* Writes a results.json with one claim to path, and beside it what the report shows: PATH.z.exr,
 * PATH.relative.exr and, for sides that are no moments EXR, PATH.a.exr and PATH.b.exr. argc, argv:
 * the command line. */
NODISCARD bool compare_job_write_json(const struct compare_job *job, const struct compared *c,
                                      const char *path, int argc, char **argv, struct err *e);
/* Writes the page alone, from a results.json in a temporary directory. */
NODISCARD bool compare_job_write_report(const struct compare_job *job, const struct compared *c,
                                        const char *path, int argc, char **argv, struct err *e);

#endif
