/* Traits of a validation's claims, a bit each: a feature of the scene (features.h) or a class of several, number of
 * bounces, shape of the image, transforms in the scene file, the tested side, the reference. */
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
    char name[MAX_TRAITS][128]; /* completes "claims that differ have .." */
    int num;
    struct claim_traits *claim;
    int num_claims, num_differ;
    json_t *json; /* of the claims: owns the texts */
};

/* Collects the claims of results.json that should be EQUIVALENT and came out EQUIVALENT or DIFFERENT, of the
 * one program with most claims that differ. Stated errors ("PROGRAM-consistency" for a) and noise
 * ("PROGRAM-noise") are included if one of their kind differs. If no claim differs, there are none, and the
 * suite is not opened. The caller calls claim_traits_free(). */
NODISCARD bool claim_traits_collect(const json_t *results, const char *suite_dir,
                                    struct traits *out, struct err *e);
void claim_traits_free(struct traits *t);

#endif
