/* The catalogue of known bugs: how each changes the images of a few scenes. golden/diagnose/ holds
 *
 *   manifest.json
 *     { "side": 16,                                   cells across (signature.h)
 *       "bugs": { "NAME": {"bug": "one line", "where": "part, function", "patch_sha256": hex} },
 *       "views": [ { "name": "13_square_patch-hemisphere", "scene": , "variant": , "scene_sha256": ,
 *                    "options": ["-a", "32", "0.05"],
 *                    "width": , "height": , "spp": , "renders": , "fixed_spp": , "seed": ,
 *                    "picture": "NAME.exr", "picture_sha256": , "n": ,
 *                    "correct": [[value, sd] or null for each fact],
 *                    "bugs": { "NAME": {"pixels": true, "facts": [...]} } } ] }
 *   NAME.exr   per cell: "c.R ..." mean of the correct renderer, "cv.R ..." its variance, "ck.R ..." its third
 *              cumulant, "cs" its spread; "K.R ..." of bug number K (in the order of "bugs") the effect,
 *              bug minus correct, and "Kv.R ..." the variance of that. Effects are rounded to 11 bits, their
 *              variances to 5.
 *
 * A bug that is not in a view's "bugs" changes nothing there; one without "pixels" no cell's mean. Written by
 * tests/tools/diagnose/catalogue_write.c for tests/mutants/make_catalogue.c, which also says how; read by everybody else. */
#ifndef ASSAY_CATALOGUE_H
#define ASSAY_CATALOGUE_H

#include "reference/suite/suite.h"
#include "signature.h"

struct bug {
    char name[64];         /* of NAME.patch; NAME-VARIANT: catalogue_same_mistake() */
    char what[256];        /* its line "Bug:" */
    char where[160];       /* its line "Where:", the place in the assignment */
    char patch_sha256[65]; /* of its text and of the lines that it removes and adds, without context lines */
};

struct effect {
    bool pixels; /* false: mean and var are all 0 */
    float mean[SIGNATURE_VALUES], var[SIGNATURE_VALUES];
    double fact[NUM_FACTS], fact_sd[NUM_FACTS];
};

/* One way to look at a renderer: a scene of the suite, as it is or by a variant. */
struct view {
    char name[128];              /* "13_square_patch-hemisphere" */
    char scene[64], variant[64]; /* variant: "" or "pathtracer-hemisphere" */
    char option[5][16];          /* additional options; none: as the suite renders it */
    const char *options[6];      /* the same, NULL at the end */
    char scene_sha256[65];
    int width, height; /* of the renders that it was made from; every image has their aspect ratio */
    int spp;           /* of one render of a diagnosis */
    int renders;       /* with different seeds; with 4 or more, stated errors are tested, too (stated_error.h) */
    bool fixed_spp;    /* the mean depends on the number of samples asked for (adaptive) */
    uint64_t seed;
    struct signature correct;
    struct effect **effect; /* per bug; NULL: no difference at all */
};

struct catalogue {
    struct bug *bug; /* sorted by name */
    int num_bugs;
    struct view *view;
    int num_views;
};

/* Fails, with a line, on a missing or damaged file. */
NODISCARD bool catalogue_read(const char *dir, struct catalogue *out, struct err *e);
void catalogue_free(struct catalogue *c);

/* The scene and the variant (NULL: none) of a view. Fails if the suite has no such, or if the scene is not
 * the one that the catalogue was made with. */
NODISCARD bool catalogue_view_scene(const struct view *v, const struct suite *suite,
                                    const struct suite_scene **scene,
                                    const struct suite_variant **variant, struct err *e);
const struct view *catalogue_view(const struct catalogue *c, const char *name);
/* Its number, -1 if there is none. */
int catalogue_bug(const struct catalogue *c, const char *name);

/* Are both the same mistake? A mistake can be made in several ways: NAME-VARIANT is another way to make NAME. */
bool catalogue_same_mistake(const struct bug *a, const struct bug *b);
/* Its name without the variant. */
void catalogue_mistake(const struct bug *b, char name[64]);

#endif
