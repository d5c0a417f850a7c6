/* Sides whose noise is correlated, as of one seed in two versions of a program: A is compared with B by the noise
 * of A - B, whatever the sides state (tools/docs/background/inputs.md). Both functions replace two sides by what
 * input_pair() and compare_moments() judge so. */
#ifndef ASSAY_INPUT_PAIRS_H
#define ASSAY_INPUT_PAIRS_H

#include "input.h"

/* Two images: drops their variances, so that input_pair() estimates that of A - B from its neighbouring pixels. If
 * they are the same to the bit, both are exact. */
void input_pairs_of_images(struct input in[2], struct notes *notes);

/* Two directories of renders, each of which is compared with that of its name or, where renders have none, of its
 * place: A becomes the mean of all of B plus the differences, of which each is a replicate, and B its mean, exact;
 * judged with compare_options.is_paired. Fails unless both have as many renders, of the same names and size. The
 * caller frees both. */
NODISCARD bool input_pairs_of_renders(const char *const path[2], const struct replicate_dir r[2],
                                      struct input in[2], struct notes *notes, struct err *e);

#endif
