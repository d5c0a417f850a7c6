#include "results.h"

#include "reference/base/json_file.h"
#include "reference/suite/suite.h"
#include "stated_error_results.h"
#include "convergence_results.h"
#include "noise_results.h"

#include <assert.h>
#include <string.h>

enum member_type { STRING, NUMBER, COUNT, BOOLEAN, INTERVAL, TRIPLE, COUNTS, OBJECT };

struct member {
    const char *name;
    enum member_type type;
    bool required;
};

static const struct member root_members[] = {
    {"command", STRING, true},  {"version", STRING, true},  {"date", STRING, true},
    {"alpha", NUMBER, true},    {"machine", STRING, false}, {"mode", STRING, false},
    {"located", STRING, false}, {"seconds", NUMBER, false}};

/* A claim that could not be judged has these and no more. */
static const struct member any_claim_members[] = {{"scene", STRING, true},
                                                  {"a", STRING, true},
                                                  {"b", STRING, true},
                                                  {"expected", STRING, true},
                                                  {"passed", BOOLEAN, true},
                                                  {"title", STRING, false},
                                                  {"detects", STRING, false},
                                                  {"blind_to", STRING, false},
                                                  {"error", STRING, false},
                                                  {"quantity", STRING, false},
                                                  {"rerun", STRING, false},
                                                  {"stages", COUNT, false},
                                                  {"alpha_claim", NUMBER, false},
                                                  {"alpha_spent", NUMBER, false},
                                                  {"cost_s", OBJECT, false}};

static const struct member judged_members[] = {
    {"quantity", STRING, true},      {"verdict", STRING, true},
    {"reason", STRING, true},        {"alpha", NUMBER, true},
    {"margin_global", NUMBER, true}, {"margin_tile", NUMBER, true},
    {"tile", COUNT, true},           {"difference", NUMBER, true},
    {"ci", INTERVAL, true},          {"channel_difference", TRIPLE, true},
    {"log10_p", NUMBER, true},       {"mdb_global", NUMBER, true},
    {"mdb_tile", NUMBER, true},      {"num_tests", COUNT, true},
    {"worst_tile", OBJECT, true},    {"worst", OBJECT, true},
    {"rms_bias", NUMBER, true},      {"extra_factor", NUMBER, true},
    {"skew_limited", BOOLEAN, true}, {"tiles_x", COUNT, true},
    {"tiles_y", COUNT, true},        {"files", OBJECT, true},
    {"hint", OBJECT, false},         {"variance_ratio", OBJECT, false},
    {"class", STRING, false},        {"n_a", NUMBER, false},
    {"n_b", NUMBER, false},          {"unit_b", STRING, false},
    {"spp_b", NUMBER, false},        {"seconds_a", NUMBER, false},
    {"seconds_b", NUMBER, false},    {"rays_a", OBJECT, false},
    {"seed_a", COUNT, false},        {"seeds_b", COUNTS, false},
    {"version_b", STRING, false},    {"accept_mdb", INTERVAL, false}};

static const struct member worst_tile_members[] = {
    {"x", COUNT, true},      {"y", COUNT, true},           {"width", COUNT, true},
    {"height", COUNT, true}, {"difference", NUMBER, true}, {"ci", INTERVAL, true},
    {"t", NUMBER, true}};

static const struct member worst_members[] = {
    {"x", COUNT, true},      {"y", COUNT, true},       {"width", COUNT, true},
    {"height", COUNT, true}, {"channel", COUNT, true}, {"difference", NUMBER, true},
    {"ci", INTERVAL, true},  {"t", NUMBER, true}};

static const struct member statistic_members[] = {{"name", STRING, true},
                                                  {"share", NUMBER, true},
                                                  {"num_tests", COUNT, true},
                                                  {"log10_p", NUMBER, true},
                                                  {"what", STRING, true}};

static const struct member hint_members[] = {{"name", STRING, true},
                                             {"removed", NUMBER, true},
                                             {"amount", NUMBER, true},
                                             {"unit", STRING, true}};

static const struct member variance_ratio_members[] = {{"ratio", NUMBER, true},
                                                       {"ci", INTERVAL, true}};

static const struct member rays_members[] = {
    {"rays", NUMBER, true}, {"box_tests", NUMBER, true}, {"primitive_tests", NUMBER, true}};

static const struct member file_members[] = {
    {"a", STRING, true}, {"b", STRING, true}, {"z", STRING, true}, {"relative", STRING, true}};

#define LENGTH(array) (sizeof(array) / sizeof(array)[0])

static bool is_count(const json_t *v)
{
    return json_is_integer(v) && json_integer_value(v) >= 0;
}

static bool is_triple(const json_t *v)
{
    double x, y, z;
    return json_unpack((json_t *)v, "[FFF!]", &x, &y, &z) == 0;
}

/* NULL if v is of that type, else what it should be, in words. */
static const char *type_error(const json_t *v, enum member_type type)
{
    switch (type) {
    case STRING: return json_is_string(v) ? NULL : "a string";
    case NUMBER: return json_is_number(v) ? NULL : "a number";
    case COUNT: return is_count(v) ? NULL : "a whole number of 0 or more";
    case BOOLEAN: return json_is_boolean(v) ? NULL : "true or false";
    case INTERVAL: return json_is_interval(v) ? NULL : "an array of two numbers, the lower first";
    case TRIPLE: return is_triple(v) ? NULL : "an array of three numbers";
    case COUNTS:
        if (!json_is_array(v))
            return "an array of whole numbers";
        for (size_t i = 0; i < json_array_size(v); i++)
            if (!is_count(json_array_get(v, i)))
                return "an array of whole numbers";
        return NULL;
    case OBJECT: return json_is_object(v) ? NULL : "an object";
    }
    assert(!"unknown member type");
    return "known";
}

/* The line begins with where (the file and claim) and within (the object's name and a dot, or "").
 */
static bool check_members(const json_t *object, const struct member *member, size_t num,
                          const char *where, const char *within, struct err *e)
{
    for (size_t i = 0; i < num; i++) {
        const json_t *v = json_object_get(object, member[i].name);
        if (v == NULL && !member[i].required)
            continue;
        if (v == NULL)
            return err_set(e, "%s: '%s%s' is missing", where, within, member[i].name);
        const char *wanted = type_error(v, member[i].type);
        if (wanted != NULL)
            return err_set(e, "%s: '%s%s' is not %s", where, within, member[i].name, wanted);
    }
    return true;
}

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

static bool check_statistics(const json_t *claim, const char *where, struct err *e)
{
    const json_t *all = json_object_get(claim, "statistics");
    if (all == NULL)
        return err_set(e, "%s: 'statistics' is missing", where);
    if (!json_is_array(all) || json_array_size(all) == 0)
        return err_set(e, "%s: 'statistics' is not an array with at least one statistic", where);
    for (size_t i = 0; i < json_array_size(all); i++) {
        const json_t *s = json_array_get(all, i);
        if (!json_is_object(s))
            return err_set(e, "%s: 'statistics' has an element %zu that is not an object", where,
                           i);
        if (!check_members(s, statistic_members, LENGTH(statistic_members), where, "statistics.",
                           e))
            return false;
    }
    return true;
}

/* Members that may be absent. */
static bool check_findings(const json_t *claim, const char *where, struct err *e)
{
    const json_t *hint = json_object_get(claim, "hint");
    const json_t *ratio = json_object_get(claim, "variance_ratio");
    const json_t *rays = json_object_get(claim, "rays_a");
    return (rays == NULL ||
            check_members(rays, rays_members, LENGTH(rays_members), where, "rays_a.", e)) &&
           (hint == NULL ||
            check_members(hint, hint_members, LENGTH(hint_members), where, "hint.", e)) &&
           (ratio == NULL ||
            check_members(ratio, variance_ratio_members, LENGTH(variance_ratio_members), where,
                          "variance_ratio.", e));
}

static bool check_judged(const json_t *claim, const char *where, struct err *e)
{
    if (!check_members(claim, judged_members, LENGTH(judged_members), where, "", e) ||
        !check_members(json_object_get(claim, "worst_tile"), worst_tile_members,
                       LENGTH(worst_tile_members), where, "worst_tile.", e) ||
        !check_members(json_object_get(claim, "worst"), worst_members, LENGTH(worst_members), where,
                       "worst.", e) ||
        !check_members(json_object_get(claim, "files"), file_members, LENGTH(file_members), where,
                       "files.", e) ||
        !check_statistics(claim, where, e) || !check_findings(claim, where, e))
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

static const struct member look_members[] = {{"n_a", NUMBER, true},
                                             {"n_b", NUMBER, true},
                                             {"alpha", NUMBER, true},
                                             {"stage", COUNT, true},
                                             {"verdict", STRING, true}};
static const struct member cost_members[] = {{"a", NUMBER, true}, {"b", NUMBER, true}};

static bool check_looks(const json_t *claim, const char *where, struct err *e)
{
    const json_t *looks = json_object_get(claim, "looks"), *cost = json_object_get(claim, "cost_s");
    if (looks != NULL && !json_is_array(looks))
        return err_set(e, "%s: 'looks' is not an array", where);
    for (size_t i = 0; i < json_array_size(looks); i++)
        if (!check_members(json_array_get(looks, i), look_members, LENGTH(look_members), where,
                           "looks.", e))
            return false;
    return cost == NULL ||
           check_members(cost, cost_members, LENGTH(cost_members), where, "cost_s.", e);
}

static bool check_claim(const json_t *claim, const char *where, struct err *e)
{
    if (!json_is_object(claim))
        return err_set(e, "%s: not an object", where);
    if (!check_members(claim, any_claim_members, LENGTH(any_claim_members), where, "", e) ||
        !check_looks(claim, where, e))
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
    if (!check_members(root, root_members, LENGTH(root_members), path, "", e))
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
