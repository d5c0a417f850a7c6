/* Records of the noise of engines on a scene (tools/validate/noise_ladder.h): rendered as candidates, and approved
 * in place of those stored. That of our renderer is a record of an earlier version, not a truth; those of others
 * are measurements. */
#ifndef ASSAY_NOISE_RECORD_H
#define ASSAY_NOISE_RECORD_H

#include "approve.h"
#include "reference_options.h"

/* Renders the noise of ours (both samplers) and of each engine that is a reference of the scene into --out, unless
 * a current record is there or in --golden. Width and height of other engines' images are halved if even, as they
 * take minutes. made: a mark shared by all that this command renders. */
NODISCARD bool noise_record_render(const struct reference_command *c,
                                   const struct suite_scene *scene, const char *pathtracer,
                                   const char *made, struct err *e);

/* How many candidates of the scene noise_record_approve() will judge, each at an alpha of its own. */
int noise_record_count(const char *from_dir, const struct suite_scene *scene);

/* Decides on every candidate of the scene. Each is compared with the stored record, even a stale one: the variances
 * of a sample and of the last rung, with the margins that the stored one allows; for ours only an increase is
 * DIFFERENT. count[] is increased for each outcome; why: the line of the first that is impossible. No candidates:
 * does nothing. */
void noise_record_approve(const struct approve_options *opt, const struct suite_scene *scene,
                          FILE *out, int count[APPROVE_IMPOSSIBLE + 1], struct err *why);

/* Prints a line for each engine of the scene: current, stale, missing or damaged. Returns how many are not current, and
 * adds to *total how many there are; one of another engine that is missing is not counted, as nothing depends on it. */
size_t noise_record_status(const char *golden_dir, const struct suite_scene *scene, int *total,
                           FILE *out);

#endif
