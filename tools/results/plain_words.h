/* What came out, in sentences for people who know none of our words. */
#ifndef ASSAY_PLAIN_WORDS_H
#define ASSAY_PLAIN_WORDS_H

#include "results.h"

#include <stdio.h>

struct plain_words {
    char s[640];
};

/* Of a judged claim: whose image is how much brighter or darker than whose, and where: "mine is 1.0 % too bright on
 * 12_point_plane (against truth)". The place is the image where its interval lies outside the margin, else the worst tile where
 * that does, else the region of the smallest p. Of one that is not decided, or could not be judged: that. */
struct plain_words plain_words_claim(const json_t *claim);

/* Three lines at the end of a run: what was judged, what came out, where to look; `page` is the last. */
void plain_words_print(FILE *f, const json_t *results, const char *page);

#endif
