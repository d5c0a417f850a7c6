#include "claim_result.h"

#include "json_shape.h"

#include "reference/base/json_node.h"
#include "reference/base/utc_date.h"
#include "renderer/base/shell_quote.h"
#include "renderer/base/version.h"

#include <assert.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static json_t *region_json(const struct region *r)
{
    return json_pack("{s:i, s:i, s:i, s:i, s:i, s:f, s:[f, f], s:f, s:f, s:f}", "x", r->x, "y",
                     r->y, "width", r->width, "height", r->height, "channel", r->channel,
                     "difference", r->difference, "ci", r->ci_lo, r->ci_hi, "t", r->t, "log10_p",
                     r->log10_p, "margin", r->margin);
}

/* A tile without noise has no test: its element is null. */
static json_t *tile_array(const double *value, int n)
{
    json_t *a = json_array();
    for (int i = 0; i < n; i++)
        json_array_append_new(a, isfinite(value[i]) ? json_real(value[i]) : json_null());
    return a;
}

static json_t *statistics_json(const struct comparison *r)
{
    json_t *all = json_array();
    for (int s = 0; s < NUM_STATISTICS; s++) {
        const struct statistic *st = &r->statistic[s];
        const char *what = st->log10_p < 0 ? st->what : "nothing stands out";
        json_array_append_new(all, json_pack("{s:s, s:f, s:i, s:f, s:s}", "name", statistic_name[s],
                                             "share", st->share, "num_tests", st->num_tests,
                                             "log10_p", st->log10_p, "what", what));
    }
    return all;
}

/* Only what is known: a change that removes the difference, a variance ratio with an interval. */
static bool add_findings(json_t *claim, const struct comparison *r)
{
    const struct hint *h = &r->hint;
    const struct variance_ratio *v = &r->variance;
    return (r->significant.width == 0 ||
            json_object_set_new(claim, "significant", region_json(&r->significant)) == 0) &&
           (h->name == NULL ||
            json_object_set_new(claim, "hint",
                                json_pack("{s:s, s:f, s:f, s:s}", "name", h->name, "removed",
                                          h->removed, "amount", h->amount, "unit", h->unit)) ==
                0) &&
           (!v->valid || json_object_set_new(claim, "variance_ratio",
                                             json_pack("{s:f, s:[f, f]}", "ratio", v->ratio, "ci",
                                                       v->lo, v->hi)) == 0);
}

static const char *unless_empty(const char *text)
{
    return text[0] != '\0' ? text : NULL;
}

static json_t *claim_head(const struct claim_context *c)
{
    const struct suite_scene *s = c->scene;
    json_t *accepted = NULL, *variance = NULL;
    if (c->opt.margin_variance > 0)
        variance = json_real(c->opt.margin_variance);
    if (c->accept_mdb[0] > 0)
        accepted = json_pack("[f, f]", c->accept_mdb[0], c->accept_mdb[1]);
    return json_pack("{s:s, s:s, s:s, s:s, s:s, s:f, s:f, s:f, s:i, s:s*, s:s*, s:s*, s:o*, s:s*, "
                     "s:s*, s:o*}",
                     "scene", s ? s->name : "files", "quantity", "mean", "a", c->a, "b", c->b,
                     "expected", verdict_name(c->expected), "alpha", c->opt.alpha, "margin_global",
                     c->opt.margin_global, "margin_tile", c->opt.margin_tile, "tile", c->opt.tile,
                     "title", s ? s->title : NULL, "detects", s ? unless_empty(s->detects) : NULL,
                     "blind_to", s ? unless_empty(s->blind_to) : NULL, "accept_mdb", accepted,
                     "class", c->fidelity, "rerun", c->rerun, "margin_variance", variance);
}

bool claim_result_passes(const struct claim_context *c, const struct comparison *r)
{
    return r->verdict == c->expected &&
           (r->verdict != VERDICT_NOTHING_FOUND ||
            (r->mdb_global <= c->accept_mdb[0] && r->mdb_tile <= c->accept_mdb[1]));
}

json_t *claim_result_judged(const struct claim_context *c, const struct comparison *r)
{
    json_t *j = claim_head(c);
    const struct region *g = r->global;
    int tiles = r->tiles_x * r->tiles_y;
    const bool ok =
        json_object_update_new(
            j,
            json_pack(
                "{s:s, s:b, s:s, s:f, s:[f, f], s:[f, f, f], s:f, s:f, s:f, s:i, s:f, s:f, s:b, s:i, s:i, "
                "s:i, s:o, s:o, s:o, s:o, s:o}",
                "verdict", verdict_name(r->verdict), "passed", claim_result_passes(c, r), "reason",
                r->reason, "difference", g[3].difference, "ci", g[3].ci_lo, g[3].ci_hi,
                "channel_difference", g[0].difference, g[1].difference, g[2].difference, "log10_p",
                g[3].log10_p, "mdb_global", r->mdb_global, "mdb_tile", r->mdb_tile, "num_tests",
                r->num_tests, "rms_bias", r->rms_bias, "extra_factor", r->extra_factor,
                "skew_limited", r->skew_limited, "finest_side", r->finest_side, "tiles_x",
                r->tiles_x, "tiles_y", r->tiles_y, "worst", region_json(&r->worst), "worst_tile",
                region_json(&r->worst_tile), "tile_log10_p", tile_array(r->tile_log10_p, tiles),
                "tile_t", tile_array(r->tile_t, tiles), "statistics", statistics_json(r))) == 0 &&
        add_findings(j, r);
    if (!ok) {
        json_decref(j);
        j = NULL;
    }
    return j;
}

json_t *claim_result_not_judged(const struct claim_context *c, const char *error)
{
    json_t *j = claim_head(c);
    json_object_set_new(j, "passed", json_false());
    json_object_set_new(j, "error", json_string(error));
    return j;
}

bool claim_result_add_observations(json_t *claim, const char *side, const struct moments *m)
{
    double n = moments_n(m, 0);
    for (size_t p = 1; p < (size_t)m->width * (size_t)m->height; p++)
        n = fmin(n, moments_n(m, p));
    return json_object_update_new(claim, json_pack("{s+:f, s+:s, s+:f}", "n_", side, n, "unit_",
                                                   side, m->unit, "spp_", side, m->spp)) == 0;
}

static const struct shape cost_shape = {.names = {[IS_NUMBER] = "a b"}};
static const struct shape look_shape = {
    .names = {[IS_TEXT] = "verdict", [IS_NUMBER] = "n_a n_b alpha", [IS_COUNT] = "stage"}};

/* Checked of every claim; of one that could not be judged nothing else is checked. */
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
static const struct shape significant_shape = {.names = {[IS_NUMBER] = "difference t margin",
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
        {[IS_TEXT] = "quantity verdict reason class? unit_b? version_a? version_b? renew?",
         [IS_NUMBER] =
             "alpha margin_global margin_tile margin_variance? difference log10_p mdb_global mdb_tile rms_bias extra_factor noise_share_a? n_a? n_b? spp_b? seconds_a? seconds_b?",
         [IS_COUNT] = "tile num_tests tiles_x tiles_y seed_a?",
         [IS_BOOLEAN] = "skew_limited same_bits? paired?",
         [IS_INTERVAL] = "ci accept_mdb?",
         [IS_TRIPLE] = "channel_difference",
         [IS_COUNTS] = "seeds_b?"},
    .part = {{"worst_tile", &worst_tile_shape, PART_OBJECT},
             {"worst", &worst_shape, PART_OBJECT},
             {"significant?", &significant_shape, PART_OBJECT},
             {"statistics", &statistic_shape, PART_LIST_OF_1},
             {"files", &files_shape, PART_OBJECT},
             {"hint?", &hint_shape, PART_OBJECT},
             {"variance_ratio?", &variance_ratio_shape, PART_OBJECT},
             {"rays_a?", &rays_shape, PART_OBJECT}}};

/* An array with one element for each tile: a number, or null where the tile has no noise and so no test. */
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

static bool check_judged(const json_t *claim, enum verdict expected, const char *where,
                         struct err *e)
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
    for (int i = 0; i < 2; i++) {
        const char *name = i == 0 ? "worst" : "significant";
        if (json_integer_value(json_object_get(json_object_get(claim, name), "channel")) > 3)
            return err_set(e, "%s: '%s.channel' is not from 0 to 3", where, name);
    }

    enum verdict verdict;
    const char *name = member_text(claim, "verdict");
    if (!verdict_parse(name, &verdict))
        return err_set(e, "%s: 'verdict' is unknown: '%s'", where, name);
    bool enough = member_number(claim, "mdb_global") <= member_end(claim, "accept_mdb", 0) &&
                  member_number(claim, "mdb_tile") <= member_end(claim, "accept_mdb", 1);
    bool passes = verdict == expected && (verdict != VERDICT_NOTHING_FOUND || enough);
    if (json_is_true(json_object_get(claim, "passed")) != passes)
        return err_set(e, "%s: 'passed' contradicts 'verdict' and 'expected'", where);
    return true;
}

bool claim_result_check(const json_t *claim, const char *where, struct err *e)
{
    if (!json_is_object(claim))
        return err_set(e, "%s: not an object", where);
    if (!json_shape_check(claim, &any_claim_shape, where, e))
        return false;
    enum verdict expected;
    const char *name = member_text(claim, "expected"), *verdict = member_text(claim, "verdict");
    if (!verdict_parse(name, &expected))
        return err_set(e, "%s: 'expected' is unknown: '%s'", where, name);
    if (json_object_get(claim, "error") == NULL)
        return check_judged(claim, expected, where, e);
    if (json_is_true(json_object_get(claim, "passed")))
        return err_set(e, "%s: has an 'error' and yet 'passed'", where);
    if (json_object_get(claim, "verdict") != NULL &&
        (verdict == NULL || strcmp(verdict, verdict_name(VERDICT_INCONCLUSIVE)) != 0))
        return err_set(e, "%s: has an 'error' and yet a 'verdict' that is not INCONCLUSIVE", where);
    return true;
}

/* "2 x AMD EPYC ...", or only the number where /proc does not say. */
static void describe_machine(char *text, size_t size)
{
    char model[128] = "", head[4096] = "";
    const int fd = open("/proc/cpuinfo", O_RDONLY);
    if (fd >= 0 && read(fd, head, sizeof head - 1) > 0) {
        const char *line = strstr(head, "\nmodel name");
        if (line != NULL && strchr(line, ':') != NULL)
            sscanf(strchr(line, ':') + 1, " %127[^\n]", model);
    }
    if (fd >= 0)
        close(fd);
    snprintf(text, size, "%ld x %s", sysconf(_SC_NPROCESSORS_ONLN),
             model[0] ? model : "unknown processor");
}

json_t *claim_result_new_results(int argc, char **argv, double alpha, struct err *e)
{
    char machine[192];
    assert(argv[argc] == NULL);
    for (int i = 0; i < argc; i++) {
        json_t *text = json_string(argv[i]);
        if (text == NULL) {
            err_set(e, "argument '%s' is no UTF-8, and results hold nothing else", argv[i]);
            return NULL;
        }
        json_decref(text);
    }
    char *command = shell_quote_join("assay", (const char *const *)argv);
    if (command == NULL) {
        err_set(e, "out of memory");
        return NULL;
    }
    describe_machine(machine, sizeof machine);
    json_t *root = json_pack("{s:i, s:s, s:s, s:s, s:s, s:f, s:[]}", "assay", 1, "command", command,
                             "version", assay_version, "date", utc_date_now().s, "machine", machine,
                             "alpha", alpha, "claims");
    free(command);
    if (root == NULL)
        err_set(e, "out of memory");
    return root;
}
