/* The matrix on top of a page of several scenes: scene by reference, with a thumbnail of each scene. */
#ifndef ASSAY_REPORT_MATRIX_H
#define ASSAY_REPORT_MATRIX_H

#include "report_internal.h"

/* A row for each scene, in the order of the claims, which are those of the tested program: the one that is neither ours nor a
 * reference, else ours. A cell has a mark, the difference and a link to its claim, so that colour is not needed. The last column
 * counts the scene's other claims. Nothing for fewer than two scenes. An image that cannot be read has no thumbnail here; the
 * scene's own section says so. */
void report_matrix(struct page *p, const struct claim_ref *claim, size_t num);

#endif
