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

enum { NUM_STAGES = 2, CLAIM_NAME = 256 };
/* Of a scene: each reference against ours, the closed form and the other engine; that engine against ours; variants;
 * stated errors; noise. */
enum { MAX_CLAIMS = 3 * MAX_REFERENCES + MAX_VARIANTS + 3 };

enum side_kind {
    SIDE_OURS,   /* the program under test, or a variant of it */
    SIDE_TRUTH,  /* a closed form: exact, for every look */
    SIDE_GOLDEN, /* stored: the same image, and so the same noise, at every look and stage */
    SIDE_LIVE,   /* an engine's replicates, rendered now */
    SIDE_ENGINE  /* the other engine */
};

/* The image of a side at one look. */
struct side_image {
    bool present, written;
    struct moments m;
    json_t *manifest;            /* of a reference; NULL for ours */
    double seconds;              /* CPU time that it took to make, whenever that was */
    struct pathtracer_rays rays; /* of ours; 0: not known */
};

/* One side of a claim, in two streams of samples (stages) with different seeds. The image at a look contains
 * the samples of all earlier looks of its stream. */
struct side {
    enum side_kind kind;
    const char *name;
    const struct suite_scene *scene;
    const struct suite_variant *variant; /* SIDE_OURS; NULL: pathtracer itself */
    const struct suite_reference *ref;   /* SIDE_TRUTH to SIDE_LIVE */
    int users;                           /* claims that may want another look */
    /* SIDE_ENGINE: NULL, or the reference with whose seed it is rendered; differs: an image was not the same, at which it
     * fails unless it goes on. */
    const char *of;
    uint32_t seed;
    const json_t *same_as;
    bool differs, goes_on;
    struct side_image at[NUM_STAGES][NUM_LOOKS];
    double wall_s, units; /* rendered in this run: wall seconds and observations */
    double cpu_s;
    bool failed;
    struct err e;
};

struct scene_sides {
    struct side ours, variant[MAX_VARIANTS], reference[MAX_REFERENCES], engine;
    /* What an engine with a pixel filter of its own is compared with: the sides above of the scene with that
     * filter; scene is NULL in a reference that is not available with it. */
    struct suite_scene filtered;
    struct side peer_ours, peer[MAX_REFERENCES];
};

/* A claim being judged. */
struct claim_run {
    const struct suite_scene *scene;
    struct side *a, *b; /* NULL: the claim of consistency, or of noise */
    bool of_noise;
    struct side again; /* the engine with the seeds of b; a, if that decides (repeated_seeds.c) */
    enum {
        SEEDS_FRESH,
        SEEDS_SAME_BITS,
        SEEDS_PAIRED
    } seeds;                    /* what decided, or was looked at last */
    bool tried_pairs;           /* half of alpha is for them */
    struct suite_reference ref; /* b's name and class; the claim's margins */
    enum verdict expected;
    const struct alpha_spending *looks;
    int stages;   /* 1 or 2 */
    int next;     /* the next look; NUM_LOOKS: none is left */
    bool stalled; /* the rest of the budget is too short for its next look */
    bool begun;   /* by one of the threads that take scenes */
    bool told;    /* the result is published: all threads may read it */
    /* Of the last look: the images of a and b (NULL before the first), and what follows. */
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
    pthread_mutex_t lock; /* guards done, begun, told and the lines of progress */
    int num_tasks, done;
    json_t *
        left_out; /* {reference: scenes in which it lacks the engine's filter}; NULL: that is the box of one pixel */
    const struct alpha_spending *sequence;
    int stages;
    double start, deadline; /* of progress_seconds(); deadline INFINITY: none */
    double shown;           /* when show() was last called, or the start */
    double alpha;           /* of one claim */
};

/* A line of progress. */
void validate_log(struct validation *v, const char *scene, const char *what);
/* Wall time that is left, INFINITY without a budget. */
double validate_time_left(const struct validation *v);

enum fetch_result { FETCH_OK, FETCH_FAILED /* the side's e says why */, FETCH_NO_TIME };

/* Can the side take more samples? Has it an image at every look? Can it be rendered again with fresh seeds? Adaptive
 * variants, whose samples depend on each other, and the other engine cannot grow. */
bool side_grows(const struct side *s);
bool side_is_at_any_look(const struct side *s);
bool side_can_be_fresh(const struct side *s);
/* Samples or replicates at a look; 0: it has no image there. Goldens and closed forms: always 1. */
int side_count(const struct side *s, int look);
/* Approximate cost of the missing part of a look's image, in paths; 0 if it is present. */
double side_cost(const struct side *s, int look);
/* The image of a stage at a look; renders what is missing of it. *out stays the side's. */
enum fetch_result side_at(struct validation *v, struct side *s, int stage, int look,
                          struct side_image **out);
/* Writes that image for the report, unless it has been; *file: its path, relative to out_dir. */
NODISCARD bool side_write(const struct validation *v, struct side *s, int stage, int look,
                          struct path *file, struct err *e);
/* Appends the words of --suite and, of_goldens, --golden, with full paths, unless a command finds them by itself in any
 * folder. */
void side_add_places(const struct validation *v, bool of_goldens, json_t *words);
/* The commands, for people, that make a stored reference anew: "assay golden render ...", and in the next line "assay
 * golden approve ...", a new reference. *out NULL: nobody knows what makes it, neither an engine of ours nor the one that
 * is judged, which made what is stored (manifest; NULL: nothing), or whose name it has, or that and -VERSION. False if
 * out of memory. */
NODISCARD bool side_renewal(const struct validation *v, const struct side *s,
                            const json_t *manifest, json_t **out);
void side_free(struct side *s);

/* repeated_seeds.c: judges an engine by the images that it makes with the seeds of the stored reference, by their bits or
 * in pairs. True if that decides: out is the comparison, t->a the engine of these seeds and image[] what was compared.
 * opt->alpha: that of the claim, of which pairs take half. */
bool repeated_seeds_judge(struct validation *v, struct claim_run *t,
                          const struct compare_options *opt, struct side_image *image[2],
                          struct comparison *out);

/* Does --only select any claim of a scene? All of them? */
bool scene_is_selected(const struct validate_options *o, const char *name);
bool scene_is_selected_whole(const struct validate_options *o, const char *name);
/* SCENE/CLAIM, as --only takes it: see validate.h. */
void claim_run_name(const struct claim_run *t, char name[CLAIM_NAME]);
/* Sets up sides and tasks of the selected scenes and claims; appends scenes that the other engine cannot express
 * to `cannot`. Fails on an unknown name, and if the engine can express no scene, unless this run is part of a
 * larger one. */
NODISCARD bool select_claims(struct validation *v, json_t *cannot, struct err *e);
/* Advances t->next, if need be, to a look with new observations, or to NUM_LOOKS. */
void claim_next_look(struct claim_run *t);
/* Takes one look; sets t->result if that decides or was the last. */
void claim_run_look(struct validation *v, struct claim_run *t);
/* Ends an undecided claim; why is put before the reason of its last look. A claim without a look gets the error
 * that the budget is spent. */
void claim_run_give_up(struct validation *v, struct claim_run *t, const char *why);
/* Has the claim come out DIFFERENT against expectation? */
bool claim_run_differs(const struct claim_run *t);
void claim_run_free(struct claim_run *t);

/* A row of pathtracer that was not judged, a new reference: with that error, or, if late, because time ran out. */
json_t *validate_bare_row(const char *scene, const char *error, bool late);

/* Renders what the scene's "consistency" asks for, below out_dir, and judges it: a row, a new reference; NULL
 * only if out of memory. deadline: of progress_seconds(), or INFINITY; if it is not done by then, the row is
 * INCONCLUSIVE with an "error" that says so. */
json_t *stated_error_run(const struct validate_options *opt, const struct suite_scene *s,
                         double alpha, double deadline);

/* Number of paths that the claim about a scene's noise takes. Every scene has such a claim if the noise of any is
 * stored (noise_ladder_is_kept()). */
double noise_claims_samples(const struct suite_scene *s);
/* Renders our ladders below out_dir and judges them. Returns the rows of "noise" (noise_results.h), a new
 * reference: ours, then those of other engines as stored. truth: the scene's closed form, if already rendered, or
 * NULL. deadline as above. */
json_t *noise_claims_run(const struct validate_options *opt, const struct suite_scene *s,
                         const struct moments *truth, double alpha, double deadline);

#endif
