/* What the scenes of a validation's claims have, a bit each: a feature of features.h, a class of several, the number of
 * bounces, the shape of the image, the transforms in the file, a side, a reference. */
#ifndef ASSAY_CLAIM_TRAITS_H
#define ASSAY_CLAIM_TRAITS_H

#include "renderer/base/err.h"

#include <jansson.h>
#include <stdint.h>

enum { MAX_TRAITS = 64 };

struct claim_traits {
    uint64_t bits; /* 1 << number of a trait */
    bool differs;
    double weight; /* claims of one image weigh 1 together */
    const char *scene, *a;
};

struct traits {
    char name[MAX_TRAITS][128]; /* as in "claims that differ have NAME" */
    int num;
    struct claim_traits *claim;
    int num_claims, num_differ;
    json_t *json; /* of the claims: owns the texts */
};

/* Collects claims of results.json that should be EQUIVALENT, came out EQUIVALENT or DIFFERENT, and are
 * about one program: that of most claims that differ. Claims of consistency (a: "PROGRAM-consistency")
 * are among them if one of those differs. If no claim differs, there are none, and the suite is not
 * opened. The caller calls claim_traits_free(). */
NODISCARD bool claim_traits_collect(const json_t *results, const char *suite_dir,
                                    struct traits *out, struct err *e);
void claim_traits_free(struct traits *t);

#endif
