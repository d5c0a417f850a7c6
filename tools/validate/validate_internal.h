/* What the parts of validate.c share: the run, the images of both sides (claim_side.c), which claims
 * there are (select_claims.c), and the judging of one (judge_claim.c). */
#ifndef ASSAY_VALIDATE_INTERNAL_H
#define ASSAY_VALIDATE_INTERNAL_H

#include "renderer/base/fs.h"
#include "renderer/image/moments.h"
#include "run_pathtracer.h"
#include "tools/sequential/alpha_spending.h"
#include "validate.h"

#include <pthread.h>

enum { MAX_PATH = 8192, NUM_STAGES = 2, CLAIM_NAME = 256 };
/* Of a scene: each reference with ours, the closed form and the further engine; that with ours; variants; consistency;
 * noise. */
enum { MAX_CLAIMS = 3 * MAX_REFERENCES + MAX_VARIANTS + 3 };

enum side_kind {
    SIDE_OURS,   /* the program under test, or a variant of it */
    SIDE_TRUTH,  /* a closed form: exact, for every look */
    SIDE_GOLDEN, /* stored: the same for every look, and its noise in every stage */
    SIDE_LIVE,   /* an engine's replicates, rendered now */
    SIDE_ENGINE  /* the further engine */
};

/* An image as it was at one look. */
struct side_image {
    bool present, written;
    struct moments m;
    json_t *manifest;            /* of a reference; NULL for ours */
    double seconds;              /* CPU time that it took to make, whenever that was */
    struct pathtracer_rays rays; /* of ours; 0: not known */
};

/* One side of a claim, in two streams of samples of different seeds. Image l of a stream holds that of
 * each smaller look. */
struct side {
    enum side_kind kind;
    const char *name;
    const struct suite_scene *scene;
    const struct suite_variant *variant; /* SIDE_OURS; NULL: pathtracer itself */
    const struct suite_reference *ref;   /* SIDE_TRUTH to SIDE_LIVE */
    int users;                           /* claims that may want another look */
    struct side_image at[NUM_STAGES][NUM_LOOKS];
    double wall_s, units; /* of what was rendered in this run: time and observations */
    double cpu_s;
    bool failed;
    struct err e;
};

struct scene_sides {
    struct side ours, variant[MAX_VARIANTS], reference[MAX_REFERENCES], engine;
    /* What the engine is held against: the sides above, or, where it has a pixel filter of its own, those of the scene
     * with that filter; of a reference that cannot be had with it, scene is NULL. */
    struct suite_scene filtered;
    struct side peer_ours, peer[MAX_REFERENCES];
};

/* One claim on its way. */
struct claim_run {
    const struct suite_scene *scene;
    struct side *a, *b; /* NULL: the claim of consistency, or of noise */
    bool of_noise;
    struct suite_reference ref; /* b's name and class; the claim's margins */
    enum verdict expected;
    const struct alpha_spending *looks;
    int stages;   /* 1 or 2 */
    int next;     /* look; NUM_LOOKS: none is left */
    bool stalled; /* what is left of the budget is too short for it */
    bool begun;   /* by one of the threads that take scenes */
    bool told;    /* the result is published: all threads may read it */
    /* What the last look saw: the images of a and b, NULL before the first. */
    struct side_image *seen[2];
    int look, stage;
    struct comparison c;
    json_t *history; /* "looks" of the results */
    double cpu_a, cpu_b;
    json_t *result; /* the finished claim; of noise: all rows of the scene */
};

struct validation {
    const struct validate_options *opt;
    struct suite suite;
    struct scene_sides *sides; /* per scene */
    struct claim_run *task;
    pthread_mutex_t lock; /* of done, begun, told and the lines of progress */
    int num_tasks, done;
    json_t *
        left_out; /* {reference: in how many scenes it cannot be had with the engine's filter}; NULL: that is the box of one pixel */
    const struct alpha_spending *sequence;
    int stages;
    double start, deadline; /* of progress_seconds(); deadline INFINITY: none */
    double shown;           /* when the last look so far was shown, or the start */
    double alpha;           /* of one claim */
};

/* A line of progress. */
void validate_log(struct validation *v, const char *scene, const char *what);
/* Wall time that is left, INFINITY without a budget. */
double validate_time_left(const struct validation *v);

enum fetch_result { FETCH_OK, FETCH_FAILED /* the side's e says why */, FETCH_NO_TIME };

/* Can it have more samples, and can it be had again with fresh seeds? Adaptive variants cannot grow,
 * as their samples depend on each other, nor can the further engine. */
bool side_grows(const struct side *s);
bool side_is_at_any_look(const struct side *s);
bool side_can_be_fresh(const struct side *s);
/* Observations at a look, 0 if it has none there. Sides that never change always have 1. */
int side_count(const struct side *s, int look);
/* About what the missing part of a look costs, in path samples; 0 where it is there. */
double side_cost(const struct side *s, int look);
/* The image of a stream at a look, rendered as far as it is missing. */
enum fetch_result side_at(struct validation *v, struct side *s, int stage, int look,
                          struct side_image **out);
/* Writes it for the report, once; *file is relative to out_dir. */
NODISCARD bool side_write(const struct validation *v, struct side *s, int stage, int look,
                          struct path *file, struct err *e);
void side_free(struct side *s);

/* Does --only want any, does it want all of a scene's claims? */
bool scene_is_selected(const struct validate_options *o, const char *name);
bool scene_is_selected_whole(const struct validate_options *o, const char *name);
/* SCENE/CLAIM, as --only takes it: see validate.h. */
void claim_run_name(const struct claim_run *t, char name[CLAIM_NAME]);
/* Sides and tasks of all selected scenes and claims; scenes that the further engine cannot express are appended to
 * `cannot`. Fails on an unknown name, and where the engine can express none, unless this run is part of a larger one. */
NODISCARD bool select_claims(struct validation *v, json_t *cannot, struct err *e);
/* Moves t->next on to the first look, itself included, at which anything is new, or to NUM_LOOKS. */
void claim_next_look(struct claim_run *t);
/* Takes one look, of which t->result is set if it decides or was the last. */
void claim_run_look(struct validation *v, struct claim_run *t);
/* Ends it, INCONCLUSIVE; why: what comes before the last look's reason. Without a look the time is over. */
void claim_run_give_up(struct validation *v, struct claim_run *t, const char *why);
/* DIFFERENT where EQUIVALENT should be. */
bool claim_run_differs(const struct claim_run *t);
void claim_run_free(struct claim_run *t);

/* A row of pathtracer's that is not judged: for that error, or, `late`, because its renders were not done in time. */
json_t *validate_bare_row(const char *scene, const char *error, bool late);

/* Renders the scene as its consistency asks, below out_dir, and judges. A new reference; NULL only out
 * of memory. deadline: of progress_seconds(), or INFINITY; what is not done by then is INCONCLUSIVE, with
 * an "error" that says so. */
json_t *stated_error_run(const struct validate_options *opt, const struct suite_scene *s,
                         double alpha, double deadline);

/* Paths that the claim about a scene's noise costs; every scene has one where goldens hold the noise of any
 * (noise_ladder_is_kept()). */
double noise_claims_samples(const struct suite_scene *s);
/* Renders the ladders of ours below out_dir and judges them; rows of "noise" (noise_results.h), those of other engines as
 * they are stored behind ours. truth: the scene's closed form, where it is there already; NULL. A new reference; NULL only out
 * of memory. deadline as above. */
json_t *noise_claims_run(const struct validate_options *opt, const struct suite_scene *s,
                         const struct moments *truth, double alpha, double deadline);

#endif
