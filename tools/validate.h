/* The main job: render the suite with our program, hold every scene against its references, judge. */
#ifndef ASSAY_VALIDATE_H
#define ASSAY_VALIDATE_H

#include "../reference/engine.h"
#include "../renderer/err.h"

#include <jansson.h>
#include <stdint.h>

enum { MAX_ONLY = 64 };

struct validate_options {
    const char *suite_dir, *golden_dir, *out_dir, *share_dir;
    const char *pathtracer;     /* the program under test */
    const char *only[MAX_ONLY]; /* scene names; none: all */
    int num_only;
    bool live;                   /* render the references now instead of reading the goldens */
    double alpha;                /* of the whole family of claims */
    uint64_t seed;               /* of our render */
    uint32_t reference_seed;     /* live: of the references */
    const struct engine *engine; /* a further one, judged against references and ours; NULL: none */
    int engine_spp, engine_replicates; /* 0: its own */
    int threads;
    double timeout_s; /* of one program */
    bool quiet;
    /* Cheapest scenes first, and stop after the scene that holds the first claim that came out
     * DIFFERENT against expectation: to find out fast that a renderer is wrong. alpha is still
     * divided by all claims. */
    bool until_different;
};

/* Fills *results (results.h; a new reference) and writes below out_dir: data/<scene>/<engine>.exr,
 * z_<engine>.exr and rel_<engine>.exr, for a further engine also its manifest <engine>.json. Scenes
 * that it cannot express are the results' "not_expressible": [{"scene":, "engine":, "reason":}].
 * With `live`, "loader" in the results is what import_check() says of the same scenes. A claim that
 * cannot be judged is in the results with its error; false only if nothing could be judged at all
 * (no suite, no output directory, a further engine that can express none of the scenes). */
bool validate(const struct validate_options *opt, int argc, char **argv, json_t **results,
              struct err *e) __attribute__((warn_unused_result));

#endif
