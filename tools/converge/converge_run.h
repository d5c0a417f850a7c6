/* `assay converge`: the ladders of all engines on some scenes, judged, as a results object. */
#ifndef ASSAY_CONVERGE_RUN_H
#define ASSAY_CONVERGE_RUN_H

#include "converge_engine.h"

enum { CONVERGE_MAX_SCENES = 64, CONVERGE_MAX_ENGINES = CONVERGE_OWN + CONVERGE_MAX_DESCRIBED };

struct converge_options {
    const char *suite_dir, *golden_dir, *share_dir, *out_dir, *pathtracer;
    const char *scene[CONVERGE_MAX_SCENES];
    int num_scenes;
    enum converge_engine engine[CONVERGE_MAX_ENGINES]; /* different ones */
    int num_engines;
    const struct engine
        *described; /* of the engines from CONVERGE_DESCRIBED on; all have the same pixel filter */
    int ladder[CONVERGE_MAX_RUNGS]; /* ascending */
    int num_rungs;                  /* at least 3 */
    int replicates;                 /* at least 4 */
    int depth_spp; /* samples per pixel of the depth ladder (depth_ladder.h); 0: none */
    int shrink;    /* width and height of images are divided by this */
    /* The reference for the squared error: the name of one of the scene's, "own" for a long run of ours, or "auto": the
     * closed form if the scene has one, else the first that is stored, else "own". That one cannot show an error of our
     * renderer that does not depend on the number of samples. */
    const char *against;
    uint32_t seed;
    double alpha;        /* of all judgements of the run together */
    double margin;       /* largest RMS bias that counts as none, relative */
    double margin_variance; /* of the first engine over each other; 0: measured, not judged */
    double slope_margin; /* INCONCLUSIVE: -1/2 is in the interval, but that is wider than +- this */
    int threads;
    double timeout_s;
    bool quiet;
};

/* Fills *results (results.h; a new reference): no claims, but "convergence" (convergence_results.h). Writes no
 * file that stays. An engine that cannot be judged is in the results with its error; false only if
 * nothing could be judged at all. */
NODISCARD bool converge_run(const struct converge_options *opt, int argc, char **argv,
                            json_t **results, struct err *e);

#endif
