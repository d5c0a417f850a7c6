/* The noise of an engine on a scene: the variance of one sample, for the image and for each tile, and the variance
 * of an image at each rung of a ladder of sample counts, between replicates with seeds of their own; relative to
 * the scene's first reference (variance_ladder.h). A run measures it, and golden/<scene>/noise.json stores it for
 * each engine:
 *
 *   {"pathtracer": {"version", "machine", "date", "made" (one for all that one command timed), "scene_sha256", "width",
 *     "height", "depth", "tile", "seed", "cpu_s", "replicates", "rungs": [{"spp", "variance": [V, standard error, degrees
 *     of freedom], "cpu_s" (of a replicate)}], "sample": {"n" (observations a pixel), "tiles_x", "tiles_y", "variance":
 *     [..], "tile": [[..], ..]}, "changes": [..]}, "pathtracer-sobol": .., "cycles": .., "povray": ..} */
#ifndef ASSAY_NOISE_LADDER_H
#define ASSAY_NOISE_LADDER_H

#include "reference/suite/suite.h"
#include "tools/stats/variance_ladder.h"

#include <jansson.h>

enum {
    NOISE_RUNGS = 4,
    NOISE_REPLICATES = 8,         /* of a run; first half as many, at most twice as many */
    NOISE_RECORD_REPLICATES = 24, /* of a record of ours */
    NOISE_TOP = 64                /* samples of the last rung of ours */
};
extern const int noise_ladder_spp[NOISE_RUNGS]; /* 1, 4, 16, 64 */
/* The least margin of a variance against its record. */
extern const double noise_ladder_least_margin; /* 0.1 */

struct noise_rung {
    int spp;
    struct estimate variance; /* between replicates; V, not its logarithm */
    double cpu_s;             /* of one replicate */
};

struct noise_ladder {
    int replicates, num; /* rungs */
    struct noise_rung rung[NOISE_RUNGS];
    struct variance_map
        sample; /* of one sample: within renders where they hold their moments, else of the first rung */
    double n; /* its observations per pixel */
    double cpu_s;
};
void noise_ladder_free(struct noise_ladder *l);

/* The unit of relative values of a scene, for images `shrink` times smaller on both sides: its closed form, if it
 * has one, else its first reference; fails if that is not stored. truth: the closed form, if already rendered, or
 * NULL. */
NODISCARD bool noise_ladder_unit(const char *golden_dir, const struct suite_scene *scene,
                                 const struct moments *truth, int shrink,
                                 struct converge_reference *out, struct err *e);

/* "pathtracer" or "pathtracer-sobol", by running the program. */
struct noise_job {
    const struct suite_scene *scene;
    const struct converge_reference *unit;
    const char *pathtracer, *dir; /* dir: for temporary files, exists */
    bool sobol;
    int replicates, threads; /* replicates: the most that will be rendered */
    uint32_t seed, first;    /* the seeds are replicate_seed(seed, first ...) */
    double timeout_s, deadline;
};
/* The renders of a ladder; noise_ladder_render() adds to them. */
struct noise_renders {
    int done;                   /* replicates */
    float *images[NOISE_RUNGS]; /* room for all of the job's */
    struct moments *last;       /* of the last rung, with independent samples; else NULL */
    double cpu_s[NOISE_RUNGS];
};
void noise_ladder_renders_free(struct noise_renders *r);
/* Renders what *r (all zero at first) lacks of `count` replicates of each rung; *out: the ladder of these. The
 * caller frees both, *r also after a failure. */
NODISCARD bool noise_ladder_render(const struct noise_job *job, int count, struct noise_renders *r,
                                   struct noise_ladder *out, struct err *e);
/* Adds a rung measured on images of any engine; the first rung added is also `sample`. */
NODISCARD bool noise_ladder_add(struct noise_ladder *l, const float *images, int spp, double cpu_s,
                                const struct converge_reference *unit, int width, int tile,
                                struct err *e);

/* No rung has noise. */
bool noise_ladder_is_silent(const struct noise_ladder *l);
/* Slope of ln RMS against ln samples over the rungs with noise; false if fewer than two have any. */
bool noise_ladder_slope(const struct noise_ladder *l, struct estimate *slope);
/* ln(1/(variance x CPU seconds)), in 1/s, of a replicate of the last rung without the engine's start; false if
 * fewer than three rungs have noise, or times are too short to measure. */
bool noise_ladder_efficiency(const struct noise_ladder *l, struct estimate *log_efficiency);

/* An entry of noise.json, a new reference; seed, version and so on are for the caller to add. NULL if out of memory. */
json_t *noise_ladder_json(const struct noise_ladder *l);
/* Reads an entry back. Fails if it is damaged, or of another scene file or other settings ("stale"). */
NODISCARD bool noise_ladder_parse(const json_t *entry, const struct suite_scene *scene,
                                  struct noise_ladder *out, struct err *e);

/* Is the noise of any scene of the suite stored? Then that of all should be. */
bool noise_ladder_is_kept(const char *golden_dir, const struct suite *suite);
/* Reads or writes golden/<scene>/noise.json. Load: a new reference, an empty object if there is no file; NULL with
 * a line if it cannot be read. */
json_t *noise_ladder_load(const char *golden_dir, const char *scene, struct err *e);
NODISCARD bool noise_ladder_store(const char *golden_dir, const char *scene, const json_t *all,
                                  struct err *e);

#endif
