#include "results.h"

#include "reference/base/json_file.h"
#include "claim_result.h"
#include "convergence_results.h"
#include "json_shape.h"
#include "noise_results.h"
#include "stated_error_results.h"

#include <string.h>

static const struct shape root_shape = {
    .names = {[IS_TEXT] = "command version date machine? mode? located?",
              [IS_NUMBER] = "alpha seconds?"}};

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
        if (!claim_result_check(claim, where, e))
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

enum outcome results_row_outcome(const json_t *row)
{
    enum verdict verdict;
    const char *name = member_text(row, "verdict");
    if (json_is_true(json_object_get(row, "passed")))
        return OUTCOME_AS_EXPECTED;
    if (name == NULL || !verdict_parse(name, &verdict))
        return OUTCOME_NOT_JUDGED;
    return verdict == VERDICT_DIFFERENT ? OUTCOME_OPPOSITE : OUTCOME_UNDECIDED;
}

double results_interval_alpha(const json_t *claim)
{
    return member_number(claim, "alpha") / fmax(1, member_number(claim, "stages"));
}

bool results_is_variant_of(const char *text, const char *name)
{
    const size_t n = strlen(name);
    return strncmp(text, name, n) == 0 && (text[n] == '\0' || text[n] == '-');
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
    static const char *const lists[NUM_JUDGED] = {[JUDGED_CLAIM] = "claims",
                                                  [JUDGED_STATED_ERROR] = "consistency",
                                                  [JUDGED_NOISE] = "noise",
                                                  [JUDGED_CONVERGENCE] = "convergence"};
    while (w->kind < NUM_JUDGED) {
        const json_t *row = json_array_get(json_object_get(w->results, lists[w->kind]), w->row);
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
            w->outcome = w->kind == JUDGED_CLAIM ? results_claim_outcome(w->json)
                                                 : results_row_outcome(w->json);
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
