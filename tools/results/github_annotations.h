/* results.json as workflow commands of GitHub Actions: an annotation for each claim that did not come out
 * as expected, and one line for the whole run. */
#ifndef ASSAY_GITHUB_ANNOTATIONS_H
#define ASSAY_GITHUB_ANNOTATIONS_H

#include <jansson.h>
#include <stdio.h>

/* "::error title=..::.." for a claim with the opposite verdict or one that could not be judged, "::warning .." for an
 * undecided one, and "::notice .." with the headline. Texts of the file are escaped: they can neither end a command nor
 * begin one. Format: "Workflow commands for GitHub Actions". */
void github_annotations_print(FILE *f, const json_t *results);

/* The headline in words: "All 5 claims came out as expected." Stated errors, noise and convergence count
 * as claims. */
void github_annotations_headline(FILE *f, const json_t *results);

#endif
