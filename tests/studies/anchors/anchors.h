/* The benchmark of `make anchors`: what is measured with which settings (make_anchors.c), its record
 * (results.json), and the page and plots made from the record alone (anchors_page.c, anchors_plot.c). */
#ifndef ASSAY_TESTS_ANCHORS_H
#define ASSAY_TESTS_ANCHORS_H

#include "renderer/base/err.h"
#include "anchor_images.h"

#include <jansson.h>

/* Every choice was made before the first full run. Mitsuba renders 2e6 samples for an image and 32000
 * a pixel for its reference; at 64 x 64 pixels that is 488 and 32000, and 64 and 4224 have that ratio. */
struct anchor_settings {
    int side, spp, reference_spp;
    int num_tune;  /* renders that only set thresholds */
    int num_pairs; /* independent pairs (A, B) that everything is measured on */
    uint64_t seed; /* scene number s uses seeds from seed + 100000 s */
    double tuned;  /* the false-alarm rate that thresholds are set to */
    double power;  /* of the bias that is reported */
};
extern const struct anchor_settings anchor_settings;

enum { NUM_ANCHOR_SCENES = 5 };
extern const char *const anchor_scenes[NUM_ANCHOR_SCENES];
extern const char *const anchor_error_id[NUM_ANCHOR_ERRORS]; /* "global", ... */

/* A rule with its threshold: as published, or set to the false-alarm rate `tuned`. */
enum anchor_rule {
    RULE_GATE_STRICT, /* compare_moments(), margins 0, alpha 1e-6 */
    RULE_GATE,        /* alpha 1e-3 */
    RULE_SAME_STRICT, /* sign_flip_test(), what --same-program does, alpha 1e-6 */
    RULE_MITSUBA,
    RULE_WELCH,        /* family level 0.01 */
    RULE_WELCH_STRICT, /* 1e-6 */
    RULE_TILES,        /* z of tiles, 1e-6 */
    RULE_IDIFF,
    RULE_GATE_TUNED,          /* the alpha */
    RULE_SAME_TUNED,          /* the alpha */
    RULE_MITSUBA_LEVEL_TUNED, /* the z at which a channel fails; 99.75 % must pass */
    RULE_MITSUBA_SHARE_TUNED, /* the share that may fail, at the published z */
    RULE_WELCH_TUNED,         /* the level */
    RULE_TILES_TUNED,         /* the level */
    RULE_RMSE_TUNED,          /* RMSE over the mean */
    RULE_FLIP_TUNED,          /* mean LDR-FLIP of both clamped to [0, 1] */
    RULE_IDIFF_FAIL_TUNED,    /* -fail, with -failpercent 1 */
    RULE_IDIFF_PERCENT_TUNED, /* -failpercent, with -fail 0.016 */
    NUM_ANCHOR_RULES
};
struct anchor_rule_row {
    const char *id, *name; /* in results.json, on the page */
    double published;      /* threshold; 0: has none, or (RULE_MITSUBA) one by the image's size */
};
extern const struct anchor_rule_row anchor_rules[NUM_ANCHOR_RULES];

/* The bias found with probability anchor_settings.power: that order statistic of each pair's smallest bias
 * found, with its 95 % interval (binomial ranks, distribution-free). INFINITY: larger than was tried.
 * Raised above the order statistic where the rule, asked again, finds it in fewer pairs than that. */
struct anchor_bias {
    double b, lo, hi;
    int found; /* pairs in which the rule, asked again, finds b */
};

struct anchor_outcome {
    double threshold; /* the image fails if its score is above */
    int false_alarms; /* of num_pairs */
    struct anchor_bias bias[NUM_ANCHOR_ERRORS];
};

struct anchor_scene_result {
    char scene[64], title[128];
    double noise; /* anchor_noise() */
    int num_places;
    struct anchor_outcome rule[NUM_ANCHOR_RULES];
};

struct anchor_results {
    struct anchor_settings settings;
    char version[64], date[32]; /* assay_version, day */

    int num_scenes;
    struct anchor_scene_result scene[NUM_ANCHOR_SCENES];
};

NODISCARD bool anchors_save(const char *path, const struct anchor_results *r, struct err *e);
/* Fails with a line on a missing file or member. */
NODISCARD bool anchors_load(const char *path, struct anchor_results *r, struct err *e);

/* The ranks (from 0) of the order statistics of a sample of n that estimate the p-quantile and bound it with 95 %:
 * *at = ceil(p n) - 1; P(X(*lo) <= quantile) and P(X(*hi) >= quantile) are each at least 97.5 %. *hi is
 * n if no element is that far up. */
void anchors_quantile_ranks(int n, double p, int *at, int *lo, int *hi);

/* README.md and its two plots into a directory. */
NODISCARD bool anchors_write_page(const char *dir, const struct anchor_results *r, struct err *e);
/* One dot and interval for each scene and rule on a logarithmic axis; rules that call most equal pairs
 * different are shown as such. */
NODISCARD bool anchors_write_plot(const char *path, const struct anchor_results *r,
                                  enum anchor_error kind, const char *title, struct err *e);

/* A rule whose false alarms are more than 1 in 20 has no bias to speak of. */
bool anchors_useless(const struct anchor_results *r, const struct anchor_outcome *o);

#endif
