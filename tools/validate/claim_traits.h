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

/* Of results.json the claims that should be EQUIVALENT, are that or DIFFERENT, and are about the program that most that
 * differ are about; those of consistency among them (a: "PROGRAM-consistency") if one of these differs. If none differs,
 * no claims, and the suite is not opened. claim_traits_free() afterwards. */
NODISCARD bool claim_traits_collect(const json_t *results, const char *suite_dir,
                                    struct traits *out, struct err *e);
void claim_traits_free(struct traits *t);

#endif
