/* `assay converge`: the ladders of all engines on some scenes, judged, as a results object. */
#ifndef ASSAY_CONVERGE_RUN_H
#define ASSAY_CONVERGE_RUN_H

#include "converge_engine.h"

enum { CONVERGE_MAX_SCENES = 64 };

/* The reference for the squared error. AUTO: the closed form if the scene has one, else the golden of the first
 * engine of engine_table.h that has one, else a long run of our own. That one cannot show an error of our renderer
 * that does not depend on the number of samples. */
enum converge_against {
    AGAINST_AUTO,
    AGAINST_TRUTH,
    AGAINST_GOLDENS, /* of the first engine, and so on */
    AGAINST_OWN = AGAINST_GOLDENS + NUM_ENGINES_WITH_GOLDENS
};
extern const char *const converge_against_names[]; /* end with NULL */

struct converge_options {
    const char *suite_dir, *golden_dir, *share_dir, *out_dir, *pathtracer;
    const char *scene[CONVERGE_MAX_SCENES];
    int num_scenes;
    bool engine[CONVERGE_NUM_ENGINES];
    int ladder[CONVERGE_MAX_RUNGS]; /* ascending */
    int num_rungs;                  /* at least 3 */
    int replicates;                 /* at least 4 */
    int depth_spp; /* samples per pixel of the depth ladder (depth_ladder.h); 0: none */
    int shrink;    /* width and height of images are divided by this */
    enum converge_against against;
    uint32_t seed;
    double alpha;        /* of all judgements of the run together */
    double margin;       /* largest RMS bias that counts as none, relative */
    double slope_margin; /* INCONCLUSIVE: -1/2 is in the interval, but that is wider than +- this */
    int threads;
    double timeout_s;
    bool quiet;
    bool engine_chosen, help; /* of the command line */
};

/* Fills *results (results.h; a new reference): no claims, but "convergence" (convergence_results.h). Writes no
 * file that stays. An engine that cannot be judged is in the results with its error; false only if
 * nothing could be judged at all. */
NODISCARD bool converge_run(const struct converge_options *opt, int argc, char **argv,
                            json_t **results, struct err *e);

#endif
