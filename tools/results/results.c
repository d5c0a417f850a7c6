#include "results.h"

#include "reference/base/json_file.h"
#include "reference/suite/suite.h"
#include "stated_error_results.h"
#include "convergence_results.h"
#include "json_shape.h"
#include "noise_results.h"

#include <string.h>

static const struct shape root_shape = {
    .names = {[IS_TEXT] = "command version date machine? mode? located?",
              [IS_NUMBER] = "alpha seconds?"}};
static const struct shape cost_shape = {.names = {[IS_NUMBER] = "a b"}};
static const struct shape look_shape = {
    .names = {[IS_TEXT] = "verdict", [IS_NUMBER] = "n_a n_b alpha", [IS_COUNT] = "stage"}};

/* A claim that could not be judged has these and no more. */
static const struct shape any_claim_shape = {
    .names = {[IS_TEXT] = "scene a b expected title? detects? blind_to? error? quantity? rerun?",
              [IS_NUMBER] = "alpha_claim? alpha_spent?",
              [IS_COUNT] = "stages?",
              [IS_BOOLEAN] = "passed"},
    .part = {{"cost_s?", &cost_shape, PART_OBJECT}, {"looks?", &look_shape, PART_LIST}}};

static const struct shape worst_tile_shape = {
    .names = {[IS_NUMBER] = "difference t", [IS_COUNT] = "x y width height", [IS_INTERVAL] = "ci"}};
static const struct shape worst_shape = {.names = {[IS_NUMBER] = "difference t",
                                                   [IS_COUNT] = "x y width height channel",
                                                   [IS_INTERVAL] = "ci"}};
static const struct shape statistic_shape = {
    .names = {[IS_TEXT] = "name what", [IS_NUMBER] = "share log10_p", [IS_COUNT] = "num_tests"}};
static const struct shape hint_shape = {
    .names = {[IS_TEXT] = "name unit", [IS_NUMBER] = "removed amount"}};
static const struct shape variance_ratio_shape = {
    .names = {[IS_NUMBER] = "ratio", [IS_INTERVAL] = "ci"}};
static const struct shape rays_shape = {.names = {[IS_NUMBER] = "rays box_tests primitive_tests"}};
static const struct shape files_shape = {.names = {[IS_TEXT] = "a b z relative"}};

static const struct shape judged_shape = {
    .names =
        {[IS_TEXT] = "quantity verdict reason class? unit_b? version_b?",
         [IS_NUMBER] =
             "alpha margin_global margin_tile difference log10_p mdb_global mdb_tile rms_bias extra_factor n_a? n_b? spp_b? seconds_a? seconds_b?",
         [IS_COUNT] = "tile num_tests tiles_x tiles_y seed_a?",
         [IS_BOOLEAN] = "skew_limited",
         [IS_INTERVAL] = "ci accept_mdb?",
         [IS_TRIPLE] = "channel_difference",
         [IS_COUNTS] = "seeds_b?"},
    .part = {{"worst_tile", &worst_tile_shape, PART_OBJECT},
             {"worst", &worst_shape, PART_OBJECT},
             {"statistics", &statistic_shape, PART_LIST_OF_1},
             {"files", &files_shape, PART_OBJECT},
             {"hint?", &hint_shape, PART_OBJECT},
             {"variance_ratio?", &variance_ratio_shape, PART_OBJECT},
             {"rays_a?", &rays_shape, PART_OBJECT}}};

/* One number, or null where a tile has no noise and so no test, for each tile. */
static bool check_tiles(const json_t *claim, const char *name, size_t num, const char *where,
                        struct err *e)
{
    const json_t *v = json_object_get(claim, name);
    if (v == NULL)
        return err_set(e, "%s: '%s' is missing", where, name);
    if (!json_is_array(v) || json_array_size(v) != num)
        return err_set(e, "%s: '%s' is not an array of tiles_x * tiles_y = %zu numbers", where,
                       name, num);
    for (size_t i = 0; i < num; i++) {
        const json_t *x = json_array_get(v, i);
        if (!json_is_number(x) && !json_is_null(x))
            return err_set(e, "%s: '%s' has an element %zu that is not a number", where, name, i);
    }
    return true;
}

static bool check_judged(const json_t *claim, const char *where, struct err *e)
{
    if (!json_shape_check(claim, &judged_shape, where, e))
        return false;
    json_int_t tiles_x = json_integer_value(json_object_get(claim, "tiles_x"));
    json_int_t tiles_y = json_integer_value(json_object_get(claim, "tiles_y"));
    if (tiles_x < 1 || tiles_y < 1 || tiles_x > 65536 || tiles_y > 65536)
        return err_set(e, "%s: 'tiles_x' or 'tiles_y' is not from 1 to 65536", where);
    if (json_integer_value(json_object_get(claim, "tile")) < 1)
        return err_set(e, "%s: 'tile' is not 1 or more", where);
    if (json_number_value(json_object_get(claim, "margin_global")) < 0 ||
        json_number_value(json_object_get(claim, "margin_tile")) < 0)
        return err_set(e, "%s: a margin is below 0", where);
    size_t num_tiles = (size_t)tiles_x * (size_t)tiles_y;
    if (!check_tiles(claim, "tile_log10_p", num_tiles, where, e) ||
        !check_tiles(claim, "tile_t", num_tiles, where, e))
        return false;
    if (json_integer_value(json_object_get(json_object_get(claim, "worst"), "channel")) > 3)
        return err_set(e, "%s: 'worst.channel' is not from 0 to 3", where);

    enum verdict verdict, expected;
    const char *name = member_text(claim, "verdict");
    if (!verdict_parse(name, &verdict))
        return err_set(e, "%s: 'verdict' is unknown: '%s'", where, name);
    if (!verdict_parse(member_text(claim, "expected"), &expected))
        return err_set(e, "%s: 'expected' is unknown", where);
    bool enough = member_number(claim, "mdb_global") <= member_end(claim, "accept_mdb", 0) &&
                  member_number(claim, "mdb_tile") <= member_end(claim, "accept_mdb", 1);
    bool passes = verdict == expected && (verdict != VERDICT_NOTHING_FOUND || enough);
    if (json_is_true(json_object_get(claim, "passed")) != passes)
        return err_set(e, "%s: 'passed' contradicts 'verdict' and 'expected'", where);
    return true;
}

static bool check_claim(const json_t *claim, const char *where, struct err *e)
{
    if (!json_is_object(claim))
        return err_set(e, "%s: not an object", where);
    if (!json_shape_check(claim, &any_claim_shape, where, e))
        return false;
    enum verdict expected;
    const char *name = member_text(claim, "expected");
    if (!verdict_parse(name, &expected))
        return err_set(e, "%s: 'expected' is unknown: '%s'", where, name);
    if (json_object_get(claim, "error") == NULL)
        return check_judged(claim, where, e);
    if (json_is_true(json_object_get(claim, "passed")))
        return err_set(e, "%s: has an 'error' and yet 'passed'", where);
    if (json_object_get(claim, "verdict") != NULL && !results_claim_lacks_time(claim))
        return err_set(e, "%s: has an 'error' and yet a 'verdict' that is not INCONCLUSIVE", where);
    return true;
}

static bool check_results(const json_t *root, const char *path, struct err *e)
{
    if (!json_is_object(root))
        return err_set(e, "%s: not an object", path);
    const json_t *schema = json_object_get(root, "assay");
    if (!json_is_integer(schema) || json_integer_value(schema) != 1)
        return err_set(e, "%s: 'assay' is not 1: not results of this version's schema", path);
    if (!json_shape_check(root, &root_shape, path, e))
        return false;
    const json_t *claims = json_object_get(root, "claims");
    const json_t *convergence = json_object_get(root, "convergence");
    if (convergence != NULL && !convergence_results_check(convergence, path, e))
        return false;
    const json_t *consistency = json_object_get(root, "consistency");
    if (consistency != NULL && !stated_error_check(consistency, path, e))
        return false;
    const json_t *noise = json_object_get(root, "noise");
    if (noise != NULL && !noise_results_check(noise, path, e))
        return false;
    if (!json_is_array(claims) || (json_array_size(claims) == 0 && convergence == NULL &&
                                   json_array_size(consistency) + json_array_size(noise) == 0))
        return err_set(e, "%s: 'claims' is not an array with at least one claim", path);
    for (size_t i = 0; i < json_array_size(claims); i++) {
        const json_t *claim = json_array_get(claims, i);
        const char *scene = member_text(claim, "scene");
        const char *b = member_text(claim, "b");
        char where[512];
        snprintf(where, sizeof where, "%.300s: claim %zu (%.60s against %.60s)", path, i + 1,
                 scene != NULL ? scene : "?", b != NULL ? b : "?");
        if (!check_claim(claim, where, e))
            return false;
    }
    return true;
}

bool results_read(const char *path, json_t **out, struct err *e)
{
    json_t *root = json_read_or_say(path, e);
    if (root == NULL || !check_results(root, path, e)) {
        json_decref(root);
        return false;
    }
    *out = root;
    return true;
}

enum outcome results_claim_outcome(const json_t *claim)
{
    if (json_object_get(claim, "error") != NULL)
        return OUTCOME_NOT_JUDGED;
    if (json_is_true(json_object_get(claim, "passed")))
        return OUTCOME_AS_EXPECTED;
    enum verdict verdict, expected;
    if (!verdict_parse(member_text(claim, "verdict"), &verdict) ||
        !verdict_parse(member_text(claim, "expected"), &expected))
        return OUTCOME_NOT_JUDGED;
    return verdict_decides(verdict) && expected != VERDICT_INCONCLUSIVE ? OUTCOME_OPPOSITE
                                                                        : OUTCOME_UNDECIDED;
}

size_t results_num_with_error(const json_t *claims, size_t i)
{
    const json_t *error = json_object_get(json_array_get(claims, i), "error");
    size_t num = 0;
    for (size_t k = 0; k < json_array_size(claims); k++)
        if (json_equal(json_object_get(json_array_get(claims, k), "error"), error)) {
            if (k < i)
                return 0;
            num++;
        }
    return num;
}

bool results_is_first_of_scene(const json_t *claims, size_t i)
{
    const json_t *scene = json_object_get(json_array_get(claims, i), "scene");
    size_t k = 0;
    while (k < i && !json_equal(json_object_get(json_array_get(claims, k), "scene"), scene))
        k++;
    return k == i;
}

bool results_claim_lacks_time(const json_t *claim)
{
    const char *verdict = member_text(claim, "verdict");
    return json_object_get(claim, "error") != NULL && verdict != NULL &&
           strcmp(verdict, verdict_name(VERDICT_INCONCLUSIVE)) == 0;
}

bool results_next(struct results_walk *w)
{
    static const struct {
        const char *key;
        enum outcome (*outcome)(const json_t *judged);
    } lists[NUM_JUDGED] = {[JUDGED_CLAIM] = {"claims", results_claim_outcome},
                           [JUDGED_STATED_ERROR] = {"consistency", stated_error_outcome},
                           [JUDGED_NOISE] = {"noise", noise_results_outcome},
                           [JUDGED_CONVERGENCE] = {"convergence", convergence_results_outcome}};
    while (w->kind < NUM_JUDGED) {
        const json_t *row = json_array_get(json_object_get(w->results, lists[w->kind].key), w->row);
        const json_t *engines = json_object_get(row, "engines");
        if (row == NULL) {
            w->kind++;
            w->row = 0;
        } else if (engines != NULL && w->engine == json_array_size(engines)) {
            w->row++;
            w->engine = 0;
        } else {
            w->json = engines != NULL ? json_array_get(engines, w->engine++) : row;
            w->scene = member_text(row, "scene");
            w->outcome = lists[w->kind].outcome(w->json);
            w->lacks_time = w->kind == JUDGED_CLAIM && results_claim_lacks_time(w->json);
            w->index = w->row;
            w->row += engines == NULL;
            return true;
        }
    }
    return false;
}

size_t results_count(const json_t *results, enum judged kind, size_t count[OUTCOME_AS_EXPECTED + 1])
{
    struct results_walk w = {.results = results, .kind = kind};
    size_t num = 0;
    memset(count, 0, (OUTCOME_AS_EXPECTED + 1) * sizeof *count);
    for (; results_next(&w) && w.kind == kind; num++)
        count[w.outcome]++;
    return num;
}

bool results_lack_time(const json_t *results)
{
    for (struct results_walk w = {.results = results}; results_next(&w);)
        if (results_claim_lacks_time(w.json) ||
            strncmp(member_or_empty(w.json, "reason"), BUDGET_SPENT, strlen(BUDGET_SPENT)) == 0)
            return true;
    return false;
}

int results_exit_code(const json_t *results)
{
    size_t count[OUTCOME_AS_EXPECTED + 1] = {0}, num = 0;
    for (struct results_walk w = {.results = results}; results_next(&w); num++)
        count[w.lacks_time ? OUTCOME_UNDECIDED : w.outcome]++;
    if (num == 0 || count[OUTCOME_NOT_JUDGED] > 0)
        return EXIT_NOT_JUDGED;
    if (count[OUTCOME_OPPOSITE] > 0)
        return EXIT_DIFFERENT;
    return count[OUTCOME_UNDECIDED] > 0 ? EXIT_INCONCLUSIVE : EXIT_EQUIVALENT;
}
