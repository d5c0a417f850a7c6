/* results.json: the record of one `assay validate`, `assay compare` or `assay converge`, from which junit.xml and
 * report.html are made and nothing else.
 *
 *   { "assay": 1,                       schema version
 *     "command": "assay validate ...", "version": "0.1 (commit)", "date": "2026-..Z",
 *     "machine": "2 x AMD ...", "alpha": 1e-3, "mode": "golden" | "live",
 *     "seconds": 98.1,
 *     "consistency": [ ... ],             stated_error_results.h; absent where `assay validate` has not run
 *     "convergence": [ ... ],             convergence_results.h; absent where `assay converge` has not run
 *     "unfinished": 87,               only in what `assay validate --page-every` shows while it runs: how many
 *                                     claims and scenes of "consistency" are still to be judged
 *     "page_every_s": 30,             only there: when the next such page comes
 *     "loader": [...],                only where "live": what import_check() says (import_check.h)
 *     "claims": [ {
 *         "scene": "41_cornell", "title": "...", "detects": "...", "blind_to": "...",
 *         "quantity": "mean", "a": "pathtracer", "b": "cycles", "class": "exact",
 *         "alpha": 6.7e-5, "margin_global": .005, "margin_tile": .02, "tile": 16,
 *         "expected": "EQUIVALENT", "verdict": "EQUIVALENT", "passed": true, "reason": "...",
 *         "difference": .0003, "ci": [-.001, .002], "channel_difference": [r, g, b],
 *         "log10_p": -0.3, "mdb_global": .004, "mdb_tile": .03, "num_tests": 123,
 *         "statistics": [{"name": "image", "share": .28 (of alpha), "num_tests": 4, "log10_p": -0.1 (of
 *             its smallest p, times num_tests), "what": "the image (red)"}, ...],  five, compare.h
 *         "direction": {"name": "shift by x", "explained": .97, "amount": .48, "ci": [.46, .50],
 *             "unit": "px"},                 absent where none could be tested
 *         "variance_ratio": {"ratio": 1.9, "ci": [1.8, 2.0]},    absent where it is not known
 *         "worst_tile": {"x":, "y":, "difference":, "ci":, "t":}, "worst": {...same, "width":,
 * "height":, "channel":}, "rms_bias": .., "extra_factor": 1, "skew_limited": false, "tile_log10_p":
 * [...], "tile_t": [...], "tiles_x": 8, "tiles_y": 8, "n_a": 2048, "n_b": 16, "unit_b":
 * "replicate", "spp_b": 256, "seconds_a": 12.3, "seconds_b": 120.0 (of the reference, from its
 * manifest), "rays_a": {"rays":, "box_tests":, "primitive_tests":} (of all its samples, run_pathtracer.h), "seed_a": 1, "seeds_b": [...], "version_b": "Blender 3.4.1", "files": {"a":
 * "data/41_cornell/pathtracer.exr", "b": "data/41_cornell/cycles.exr", "z":
 * "data/41_cornell/z_cycles.exr", "relative": "data/41_cornell/rel_cycles.exr"}, "rerun": "assay
 * validate --only 41_cornell ..." } | { "scene":, "a":, "b":, "title":, "expected":, "passed":
 * false, "error": "one line" } ] }
 *
 * Of `assay validate` each claim, judged or not, also has
 *         "looks": [{"n_a": 64, "n_b": 1, "alpha": 1e-6, "stage": 1, "verdict": "INCONCLUSIVE"}, ...],
 *         "alpha_claim": 6.7e-5 (of all its looks), "alpha_spent": 1e-6 (of those taken),
 *         "stages": 1 (or 2, see two_stage.h; "stage" of a look is the last that it needed),
 *         "cost_s": {"a": 1.2, "b": 0} (CPU seconds rendered for it in this run; what an earlier
 *         claim had rendered already costs nothing)
 * and its "alpha" is that of its last look; intervals of a claim of two stages have half of it. The
 * root has "stages" and, with --budget, "budget_s".
 *
 * With --engine the root also has "not_expressible": [{"scene":, "engine":, "reason": "one line"}].
 *
 * Paths in "files" are absolute, or relative to the directory of results.json. A claim with "error" could not be
 * judged: it never counts as passed and makes the exit code 3, unless it also has the "verdict" INCONCLUSIVE:
 * then only time was missing, and it counts as that. "passed" is true exactly where
 * "verdict" equals "expected". An element of tile_log10_p and tile_t is null where a tile has no
 * noise at all and so no test.
 *
 * A reader may rely on: assay, command, version, date, alpha, claims (at least one, or none where there
 * is convergence or consistency); of each claim
 * scene, a, b, expected, passed; of each judged claim everything above except title, detects,
 * blind_to, class, direction, variance_ratio, n_a, n_b, unit_b, spp_b, seconds_a, seconds_b, rays_a, seed_a, seeds_b, version_b and
 * rerun, which are provenance and absent where the claim has none (two files compared). */
#ifndef ASSAY_RESULTS_H
#define ASSAY_RESULTS_H

#include "reference/base/json_file.h"
#include "reference/base/json_node.h"

#include <jansson.h>

/* Exit codes of every verb. */
enum { EXIT_EQUIVALENT = 0, EXIT_DIFFERENT = 1, EXIT_INCONCLUSIVE = 2, EXIT_NOT_JUDGED = 3 };

/* Reads results.json and checks all that report and junit rely on (see above), each failure a line
 * with file, claim and member. New reference in *out. */
bool results_read(const char *path, json_t **out, struct err *e)
    __attribute__((warn_unused_result));

/* How a claim came out, worst first. OPPOSITE: DIFFERENT for EQUIVALENT or the reverse. UNDECIDED: any
 * other verdict that was not expected. */
enum outcome { OUTCOME_NOT_JUDGED, OUTCOME_OPPOSITE, OUTCOME_UNDECIDED, OUTCOME_AS_EXPECTED };
enum outcome results_claim_outcome(const json_t *claim);
/* Of a claim that is OUTCOME_NOT_JUDGED: the budget ended before its first look. It has no numbers,
 * like any that was not judged, but counts as INCONCLUSIVE. */
bool results_claim_lacks_time(const json_t *claim);

/* How the reason begins of what was not decided when the time of --budget was over; and whether there is such a claim or one that
 * lacks time. */
#define BUDGET_SPENT "budget spent"
bool results_lack_time(const json_t *results);

/* 0 if every claim and every engine of the convergence passed; else 3 if any could not be judged, else 1 if any verdict was the
 * opposite of the expected (DIFFERENT for EQUIVALENT or the reverse), else 2. */
int results_exit_code(const json_t *results);

/* JUnit XML: one testsuite, one testcase per claim; failure for a wrong verdict, error for one that
 * could not be judged. Appears by rename. */
bool junit_write(const char *path, const json_t *results, struct err *e)
    __attribute__((warn_unused_result));

#endif
