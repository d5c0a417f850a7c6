/* The noise of every engine on a scene (tools/validate/noise_ladder.h): rendered as candidates, and approved in place of what
 * is stored. Of ours it is a record of a former version, never a truth; of another engine what that measured. */
#ifndef ASSAY_NOISE_RECORD_H
#define ASSAY_NOISE_RECORD_H

#include "approve.h"
#include "reference_options.h"

/* Renders into --out what is neither there nor in --golden and of this scene and these settings, of ours (both samplers) and of
 * each engine that the scene has as a reference. Images of other engines are half as large on both sides, where that
 * divides: they take minutes. made: one word for all that this command renders. */
NODISCARD bool noise_record_render(const struct reference_command *c,
                                   const struct suite_scene *scene, const char *pathtracer,
                                   const char *made, struct err *e);

/* Approves every candidate of the scene. Each is compared with what is stored, with a stale one too: the variance of a sample
 * and of the last rung, by the margins that the stored one declares; of ours only an increase is DIFFERENT. Adds to
 * count[]; why: of the first that is impossible. Nothing where there is no candidate. */
void noise_record_approve(const struct approve_options *opt, const struct suite_scene *scene,
                          FILE *out, int count[APPROVE_IMPOSSIBLE + 1], struct err *why);

/* Prints a line for each engine of the scene: current, stale, missing or damaged; how many are not current. Nothing
 * depends on that of another engine: it may be missing. */
size_t noise_record_status(const char *golden_dir, const struct suite_scene *scene, FILE *out);

#endif
