/* results.json as workflow commands of GitHub Actions: an annotation for each claim that did not come out
 * as expected, and one line for the whole run. */
#ifndef ASSAY_GITHUB_ANNOTATIONS_H
#define ASSAY_GITHUB_ANNOTATIONS_H

#include <jansson.h>
#include <stdio.h>

/* "::error title=..::.." where a claim came out the opposite or could not be judged, "::warning .." where it
 * stayed undecided, and "::notice .." with the headline. Text from the file cannot end a command or start
 * another one. Format: "Workflow commands for GitHub Actions". */
void github_annotations_print(FILE *f, const json_t *results);

/* The headline in words: "All 5 claims came out as expected." The convergence and the stated errors are
 * counted as claims. */
void github_annotations_headline(FILE *f, const json_t *results);

#endif
