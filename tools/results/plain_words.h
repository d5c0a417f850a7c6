/* Results in plain sentences, for readers who do not know this program's terms. */
#ifndef ASSAY_PLAIN_WORDS_H
#define ASSAY_PLAIN_WORDS_H

#include "results.h"

#include <stdio.h>

struct plain_words {
    char s[768];
};

/* A claim in one sentence. If DIFFERENT, which image is how much too bright or too dark, and where: "mine is 1.0 %
 * too bright on 12_point_plane (against truth)". The place is the whole image if its interval lies outside the
 * margin, else the worst tile if that one's does, else the region of the smallest p. Else that it is the same,
 * undecided or not judged. */
struct plain_words plain_words_claim(const json_t *claim);

/* "more noisy, 1.9 times the variance"; empty if the variance is within its margin or has none. */
struct plain_words plain_words_noise(const json_t *claim);

/* What would decide an undecided claim, "about 2.5 times the samples would decide: 40 replicates"; says so if the
 * reference needs more, too. Empty where nobody knows. */
struct plain_words plain_words_more_samples(const json_t *claim);

/* The three lines at the end of a run: what was judged, the result, and where to look (page: path of the report). */
void plain_words_print(FILE *f, const json_t *results, const char *page);

#endif
