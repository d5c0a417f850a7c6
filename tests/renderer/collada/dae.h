/* Small COLLADA documents for the loader's tests, put together from pieces. */
#ifndef ASSAY_TEST_DAE_H
#define ASSAY_TEST_DAE_H

#include "renderer/collada/collada.h"

/* Pieces of a document that has a grey material "grey" and a triangle "tri" (0,0,0) (1,0,0) (0,1,0), whose front is +Z,
 * bound by the symbol "m". NULL for none. In all of them "$ID" is an instance of geometry ID that wears grey, "$ID:x" one
 * that wears x, "$vertex" and "$normal" are the inputs of a mesh at offsets 0 and 1. */
struct dae {
    const char *asset;
    const char *effect; /* the body of the effect of the material "x" */
    const char *
        mesh; /* what stands behind the sources of geometry "g": 8 points, the corners of an L of area 3 in the
                              plane z = 0, then (0,0,1) and (5,5,5); normals +Z, (1,1,0), 0, -2Z */
    const char *libraries; /* whole <library_...> elements */
    const char *nodes;
};

/* The document; the caller frees. Aborts without memory. */
char *dae_text(const struct dae *d);
/* collada_parse() of dae_text(), as if it were the file test.dae. */
bool dae_load(const struct dae *d, enum dialect dialect, struct scene *s, struct err *e);
/* dae_load() must fail, and its message hold the keyword and begin with "test.dae:". */
void dae_must_fail(struct dae d, enum dialect dialect, const char *keyword);

#endif
