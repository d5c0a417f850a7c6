/* From images to points: runs the checks of a rubric on one submission, and writes what was
 * expected and seen, the text of the student's page (tools/gradebook/student_page.c). */
#ifndef ASSAY_GRADE_CHECKS_H
#define ASSAY_GRADE_CHECKS_H

#include "score.h"
#include "tools/submission/submission.h"

/* What the images of a rubric should be; made once for all submissions. */
struct answer {
    struct moments m; /* of the reference; width 0: none */
    struct moments
        twin; /* where m is a render of ours for a check of kind equal: another with a seed of its own,
               * to recognise copies of m (same_noise.h); else width 0 */
    struct moments
        noise; /* of a render by ours: how its samples vary; m itself where that is ours */
    struct moments
        as_asked; /* by ours with the student's options too, for checks of rates; else width 0 */
};
/* Indexed by set of accepted deviations (rubric.h). An empty entry of a later set equals that of
 * set 0. */
struct answer_key {
    struct answer of[RUBRIC_SETS][RUBRIC_IMAGES];
};

struct answer_options {
    const char *golden_dir, *pathtracer;
    const char *cache; /* directory for our own renders, kept while their key is the same */
    int threads;
    double timeout_s;
};
/* Reads or renders what every image of the rubric should be. Fails with a line, and nothing to free;
 * else the caller frees *out with answer_key_free(). */
NODISCARD bool answer_key_make(const struct rubric *r, const struct answer_options *opt,
                               struct answer_key *out, struct err *e);
void answer_key_free(struct answer_key *a);

/* The set of that name; 0 where the rubric has none. */
int answer_key_set(const struct rubric *r, const char *name);
/* With the deviations of `set`, where these change the image: the image as it should be (NULL: the rubric
 * gives none), and how many samples each of its pixels takes. */
const struct moments *answer_key_image(const struct answer_key *a, int set, int image);
const struct moments *answer_key_counts(const struct answer_key *a, int set, int image);

/* Renders one image by opt->pathtracer with spp samples a pixel and the further options `words`,
 * besides the options of its reference; as_asked: also with the student's. Scenes have to be staged
 * in opt->cache/scene (submission_stage()). The caller frees *out with moments_free(). */
NODISCARD bool answer_key_render(const struct rubric *r, int image, bool as_asked,
                                 const char *words, int spp, const struct answer_options *opt,
                                 struct moments *out, struct err *e);

struct result {
    double share;  /* of the points, 0 to 1 */
    double chance; /* score_chance() of what decided */
    bool
        judged; /* false: we could not judge, through no fault of the student's: `seen` says why; share
                 * is 0 and staff have to look */
    double
        more; /* > 0: undecided, it takes about so many times the samples; share is the most it may get */
    double noise
        [CHECK_IMAGES]; /* variance that each image of the check adds, in arbitrary units; or skewness,
                         * where that keeps it undecided */
    char expected[256], seen[400];
    char
        accepted[500]; /* what students read of the deviations by which it has more points, or "" */
    bool no_hint;      /* what is wrong is not what the check's hint is about */
    char carried[512];  /* what was paid before and is taken for granted here (carried.h), or "" */
    char flag[256];     /* for staff only */
    int image;          /* that shows it best: index in the rubric */
    /* Of equal, agree and sum; tiles 0: none. Of exact: relative[] only, the share of each tile's pixels that
     * are wrong, and where most are. */
    struct difference agreement;
};

/* What the student reads of a difference. */
void grade_checks_tell(const struct difference *a, char *text, size_t size);

/* One student's images, read. */
struct submitted_images {
    struct made made[RUBRIC_IMAGES];
    struct submitted_image image[RUBRIC_IMAGES]; /* mean NULL: not there, or not readable */
    char why[RUBRIC_IMAGES][400];                /* why not */
    bool can_buy;              /* further runs are possible: what is too noisy stays undecided */
    bool fixed[RUBRIC_IMAGES]; /* but not of this image, whose noise does not fall with samples */
    /* Why no further run of it is made; "": the budget is used up. */
    char no_more[RUBRIC_IMAGES][160];
    int runs[RUBRIC_IMAGES];   /* number of runs of it, whether they count or not */
    double bought_s;           /* CPU time of further runs */
};

/* What a submission is judged by, and its images. */
struct grading {
    const struct rubric *r;
    const struct answer_key *a;
    struct submitted_images *h;
    double alpha; /* of one check: the chance that a program which is right loses points in it */
    const struct rubric_bugs *bugs; /* NULL: no catalogue of bugs for these images */
};

/* Judges one check against the answers with the deviations of `set`. Fails only for reasons of our own,
 * such as memory. The caller frees with result_free(). */
NODISCARD bool grade_checks_run(const struct grading *g, const struct rubric_check *check, int set,
                                struct result *out, struct err *e);

/* Judges a check of growth by times alone, whatever its images show: the CPU time of P less that of Q
 * over that of R less that of S, two scenes with many and few samples each, so that reading the scene
 * and building the hierarchy cancel. The end of the interval that is best for the program counts. */
void grade_checks_growth(const struct grading *g, const struct rubric_check *c, struct result *out);

/* Judges `rates` by the number of samples that the stopping rule takes with the light and the noise of
 * the program's own image; *out stays as it is where that is not known. Fails only out of memory. */
NODISCARD bool grade_checks_rates(const struct grading *g, int set, const struct rubric_check *c,
                                  struct result *out, struct err *e);

/* Does any pixel of any image of a check of kind rates stop early? True, too, where no such image is free
 * of noise: a program whose images are noisier than ours may rightly take all samples. One that never
 * stops has no adaptive sampling, and no points for what that leaves as it was. Fails only out of memory. */
NODISCARD bool grade_checks_stops(const struct grading *g, bool *stops, struct err *e);

/* All checks, out[0 .. num_checks-1], graded with the set of accepted deviations that leaves the
 * most points. The empty set wins unless another brings more than 1 % of all points and some check of
 * an image that loses points without it loses none with it, and not because it is noisy: a bug that
 * merely resembles a deviation is not excused. Other mistakes still cost points. The caller frees
 * each result with result_free(); on failure there is nothing to free. */
NODISCARD bool grade_all_checks(const struct grading *g, struct result *out, int *set,
                                struct err *e);
/* Says by which deviations of the set the check has more points: those that change an image of it. */
void grade_checks_accept(const struct grading *g, const struct rubric_check *c, int set,
                         struct result *out);
void result_free(struct result *r);

#endif
