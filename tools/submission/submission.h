/* What a student handed in, and the images it makes. */
#ifndef ASSAY_SUBMISSION_H
#define ASSAY_SUBMISSION_H

#include "rubric.h"

#include <stdint.h>

enum submission_kind {
    SUBMISSION_IMAGES, /* a directory with NAME.png, .exr, .pfm or .hdr of some image of the rubric, and no
                        * program or sources beside it, unless the rubric allows images */
    SUBMISSION_PROGRAM, /* a file, or a directory that needs no building */
    SUBMISSION_SOURCE   /* a directory or an archive, and the rubric has a `build` command */
};
extern const char *const submission_kind_name[]; /* "images", "program", "source" */

/* Why none of its images could be made. */
enum submission_state {
    SUBMISSION_GRADED,      /* nothing prevented it */
    SUBMISSION_NOT_BUILT,   /* it cannot be unpacked or built */
    SUBMISSION_NOT_STARTED, /* no program, a library is missing, or no run of it makes an image */
    SUBMISSION_USAGE        /* every run prints the program's usage text */
};
extern const char *const submission_state_name[]; /* "graded", "not_built", .. */
extern const char submission_not_made[]; /* for an image: the reason is in submission.why */

struct submission {
    enum submission_kind kind;
    char id[128]; /* the last part of its path */
    char path[4096];
    char tree[512];    /* of programs: a tar, of the built tree where there is something to build */
    char program[160]; /* as {program} is replaced */
    char sha256[65];   /* of the tar of what was handed in */
    bool packed;       /* an archive, or its program has to be looked for or made executable */
    char library[1024]; /* LD_LIBRARY_PATH that it needs; "": none */
    enum submission_state state;
    char why[600];    /* what is wrong with the whole, a sentence; or "" */
    const char *runs; /* where runs are kept (kept_run.h), borrowed; NULL: nowhere */
    bool runs_again;  /* run again even if kept */
};

/* One image as it came out. */
struct made {
    char path[4400], rates[4400]; /* "": there is none; rates of adaptive sampling: NAME_rate.png */
    char why[600];                /* why there is none */
    char after[300];              /* how the run failed that had written it; "": it did not fail */
    enum sandbox_end end;
    bool usage; /* there is none, and the program printed its usage text */
    /* There is none, as it did not end; but of the processor time that it could have had until then it had 10 % to 90 %.
     * One that loops takes all of it and one that waits none, on any machine: this one may be slow or the machine busy. */
    bool starved;
    double cpu_s, wall_s;
};

/* Makes the directory of what all runs need, once: scenes and environments of the rubric's images, by their
 * base names, which have to differ. */
NODISCARD bool submission_stage(const struct rubric *r, const char *dir, struct err *e);

/* Finds out what kind of submission it is and packs it. work: a directory of its own below the sandbox's.
 * What is wrong with the submission is in out->why; false only if we cannot go on. */
NODISCARD bool submission_open(const struct rubric *r, const char *path, const char *work,
                               struct submission *out, struct err *e);

/* The last part of a path, of "." that of its full path, without the ending of an archive; "" if that is no name. */
void submission_id(const char *path, char id[128]);

/* Runs it, or restores the same run if that was kept (kept_run.h). inputs: the files in job->scene that it
 * reads. */
NODISCARD bool submission_run(const struct rubric *r, const struct sandbox *box,
                              const struct submission *s, const struct sandbox_job *job,
                              const char *const *inputs, struct sandbox_result *out, struct err *e);

/* Unpacks it, builds it in the sandbox if it has to be built, and checks that the program would start. The
 * build's output goes to `log`. cache: of ccache (sandbox.h), or NULL; fill: staff fill it. */
NODISCARD bool submission_build(const struct rubric *r, const struct sandbox *box,
                                const char *cache, bool fill, const char *work, const char *log,
                                struct submission *s, struct err *e);

/* Gets one image of the rubric, or one like it with another name and other samples: copies it from
 * those handed in, or makes it in the sandbox; it goes to out_dir, as does the program's log. A
 * missing image is no error: made->why says why. */
NODISCARD bool submission_image(const struct rubric *r, const struct sandbox *s,
                                const struct submission *sub, const struct rubric_image *p,
                                const char *stage, const char *work, const char *out_dir,
                                uint64_t seed, int threads, struct made *made, struct err *e);

/* Would the program probably not end on that image? Yes if it did not end on the same scene with at most 8
 * times the work, or on three scenes while it made no image at all. made: of the images before it; *out
 * says why. */
bool submission_will_hang(const struct rubric *r, const struct made *made, int image,
                          struct made *out);

/* Did a program that made no image print its usage text? why: gets its complaint, or the first line of that
 * text. */
bool submission_printed_usage(const char *log, char *why, size_t size);

/* After all images: if none could be read, says so once, in s->why, and in s->state if none was made. why: of each
 * image; if all have the same reason, those that were not made then refer to s->why.
 * build_log: of what was built, or no file; a warning in it that explains a crash is told. */
void submission_conclude(const struct rubric *r, const struct made *made, char (*why)[400],
                         const char *build_log, struct submission *s);

/* The command of an image as NULL-terminated words, which lie in `text` (size bytes), at most most
 * - 1 of them; threads and seed as given, the output by its name in the rubric. False if it is too
 * long. */
bool submission_command(const struct rubric *r, const struct rubric_image *p, const char *program,
                        uint64_t seed, int threads, char *text, size_t size, const char **argv,
                        int most);

#endif
