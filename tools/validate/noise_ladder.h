/* The noise of an engine on a scene: the variance of one sample over the image and each tile, and how the variance of an
 * image falls over a ladder of sample counts, from replicates with seeds of their own; in units of the scene's first
 * reference (variance_ladder.h). What a run has measured, and what golden/<scene>/noise.json holds of each engine:
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
    NOISE_REPLICATES = 8,         /* of a run: half as many first, twice as many at most */
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
    double n; /* observations a pixel behind it */
    double cpu_s;
};
void noise_ladder_free(struct noise_ladder *l);

/* The unit of a scene at images `shrink` times smaller: its first reference, a closed form before all others; fails where
 * that is not stored. truth: the closed form, where it is there already; NULL. */
NODISCARD bool noise_ladder_unit(const char *golden_dir, const struct suite_scene *scene,
                                 const struct moments *truth, int shrink,
                                 struct converge_reference *out, struct err *e);

/* "pathtracer" or "pathtracer-sobol", by running the program. */
struct noise_job {
    const struct suite_scene *scene;
    const struct converge_reference *unit;
    const char *pathtracer, *dir; /* dir: of temporary files, exists */
    bool sobol;
    int replicates, threads; /* replicates: all that there may be */
    uint32_t seed, first;    /* the seeds are replicate_seed(seed, first ...) */
    double timeout_s, deadline;
};
/* The renders of a ladder; may grow. */
struct noise_renders {
    int done;                   /* replicates */
    float *images[NOISE_RUNGS]; /* room for all of the job's */
    struct moments *last;       /* those of the last rung of independent samples */
    double cpu_s[NOISE_RUNGS];
};
void noise_ladder_renders_free(struct noise_renders *r);
/* Renders up to `count` replicates of each rung, those of *r among them (all zero at first); *out: the ladder of them. */
NODISCARD bool noise_ladder_render(const struct noise_job *job, int count, struct noise_renders *r,
                                   struct noise_ladder *out, struct err *e);
/* One more rung from images of any engine; the first one is also its `sample`. */
NODISCARD bool noise_ladder_add(struct noise_ladder *l, const float *images, int spp, double cpu_s,
                                const struct converge_reference *unit, int width, int tile,
                                struct err *e);

/* No rung has noise. */
bool noise_ladder_is_silent(const struct noise_ladder *l);
/* Slope of ln RMS on ln samples, of the rungs that have noise; false of fewer than two. */
bool noise_ladder_slope(const struct noise_ladder *l, struct estimate *slope);
/* ln(1/(variance x CPU seconds)) of a replicate of the last rung without the engine's start [1/s]; false where it is
 * too short to be timed, or without noise. */
bool noise_ladder_efficiency(const struct noise_ladder *l, struct estimate *log_efficiency);

/* As an entry of noise.json; seed, version and so on are the caller's. NULL out of memory. */
json_t *noise_ladder_json(const struct noise_ladder *l);
/* Reads it back; fails on anything that is not that, and on an entry of another scene file or other settings ("stale"). */
NODISCARD bool noise_ladder_parse(const json_t *entry, const struct suite_scene *scene,
                                  struct noise_ladder *out, struct err *e);

/* Does the directory hold the noise of any scene of the suite? Then it should hold that of all. */
bool noise_ladder_is_kept(const char *golden_dir, const struct suite *suite);
/* golden/<scene>/noise.json: the whole of it, an empty object if there is none. NULL with a line if it cannot be read. */
json_t *noise_ladder_load(const char *golden_dir, const char *scene, struct err *e);
NODISCARD bool noise_ladder_store(const char *golden_dir, const char *scene, const json_t *all,
                                  struct err *e);

#endif
