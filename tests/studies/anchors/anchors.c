#include "anchors.h"

#include "reference/base/json_file.h"
#include "reference/base/json_node.h"

#include <gsl/gsl_cdf.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

const struct anchor_settings anchor_settings = {.side = 64,
                                                .spp = 64,
                                                .reference_spp = 4224,
                                                .num_tune = 200,
                                                .num_pairs = 200,
                                                .seed = 20261121,
                                                .tuned = 0.01,
                                                .power = 0.95};

const char *const anchor_scenes[NUM_ANCHOR_SCENES] = {"33_sphere_light", "41_cornell", "46_sky",
                                                      "42_cornell_glass", "45_many_lights"};

const char *const anchor_error_id[NUM_ANCHOR_ERRORS] = {"global", "bounced", "region"};

const struct anchor_rule_row anchor_rules[NUM_ANCHOR_RULES] = {
    [RULE_GATE_STRICT] = {"gate_1e-6", "ours, alpha 1e-6", 6},
    [RULE_GATE] = {"gate_1e-3", "ours, alpha 1e-3", 3},
    [RULE_SAME_STRICT] = {"same_program_1e-6", "ours, same program, 1e-6", 6},
    [RULE_MITSUBA] = {"mitsuba", "Mitsuba 3", 0},
    [RULE_WELCH] = {"welch_1e-2", "Welch per pixel, 0.01", 2},
    [RULE_WELCH_STRICT] = {"welch_1e-6", "Welch per pixel, 1e-6", 6},
    [RULE_TILES] = {"tiles_1e-6", "z of tiles, 1e-6", 6},
    [RULE_IDIFF] = {"idiff", "idiff as Blender", BLENDER_PERCENT},
    [RULE_GATE_TUNED] = {"gate_tuned", "ours", 0},
    [RULE_SAME_TUNED] = {"same_program_tuned", "ours, same program", 0},
    [RULE_MITSUBA_LEVEL_TUNED] = {"mitsuba_level_tuned", "Mitsuba 3, its level", 0},
    [RULE_MITSUBA_SHARE_TUNED] = {"mitsuba_share_tuned", "Mitsuba 3, its share", 0},
    [RULE_WELCH_TUNED] = {"welch_tuned", "Welch per pixel", 0},
    [RULE_TILES_TUNED] = {"tiles_tuned", "z of tiles", 0},
    [RULE_RMSE_TUNED] = {"rmse_tuned", "RMSE", 0},
    [RULE_FLIP_TUNED] = {"flip_tuned", "FLIP, mean", 0},
    [RULE_IDIFF_FAIL_TUNED] = {"idiff_fail_tuned", "idiff, -fail", 0},
    [RULE_IDIFF_PERCENT_TUNED] = {"idiff_percent_tuned", "idiff, -failpercent", 0},
};

static json_t *pack_outcome(const struct anchor_outcome *o)
{
    json_t *bias = json_object();
    for (int k = 0; k < NUM_ANCHOR_ERRORS; k++) {
        const struct anchor_bias *b = &o->bias[k];
        json_object_set_new(bias, anchor_error_id[k],
                            json_pack("{so so so si}", "b", json_finite(b->b), "lo",
                                      json_finite(b->lo), "hi", json_finite(b->hi), "found",
                                      b->found));
    }
    return json_pack("{sf si so}", "threshold", o->threshold, "false_alarms", o->false_alarms,
                     "bias", bias);
}

bool anchors_save(const char *path, const struct anchor_results *r, struct err *e)
{
    const struct anchor_settings *set = &r->settings;
    json_t *scenes = json_array();
    for (int s = 0; s < r->num_scenes; s++) {
        const struct anchor_scene_result *scene = &r->scene[s];
        json_t *rules = json_object();
        for (int k = 0; k < NUM_ANCHOR_RULES; k++)
            json_object_set_new(rules, anchor_rules[k].id, pack_outcome(&scene->rule[k]));
        json_array_append_new(scenes, json_pack("{ss ss sf si so}", "scene", scene->scene, "title",
                                                scene->title, "noise", scene->noise, "places",
                                                scene->num_places, "rules", rules));
    }
    json_t *root =
        json_pack("{s{si si si si si sI sf sf} ss ss so}", "settings", "side", set->side, "spp",
                  set->spp, "reference_spp", set->reference_spp, "num_tune", set->num_tune,
                  "num_pairs", set->num_pairs, "seed", (json_int_t)set->seed, "tuned", set->tuned,
                  "power", set->power, "version", r->version, "date", r->date, "scenes", scenes);
    bool ok = root != NULL ? json_write(path, root, e) : err_set(e, "%s: out of memory", path);
    json_decref(root);
    return ok;
}

static bool read_number(json_t *object, const char *name, double *out)
{
    json_t *v = json_object_get(object, name);
    *out = json_is_null(v) ? INFINITY : json_number_value(v);
    return json_is_number(v) || json_is_null(v);
}

static bool read_outcome(json_t *rule, struct anchor_outcome *o)
{
    if (json_unpack(rule, "{sF si}", "threshold", &o->threshold, "false_alarms",
                    &o->false_alarms) != 0)
        return false;
    for (int k = 0; k < NUM_ANCHOR_ERRORS; k++) {
        json_t *bias = json_object_get(json_object_get(rule, "bias"), anchor_error_id[k]);
        struct anchor_bias *b = &o->bias[k];
        if (!read_number(bias, "b", &b->b) || !read_number(bias, "lo", &b->lo) ||
            !read_number(bias, "hi", &b->hi) || json_unpack(bias, "{si}", "found", &b->found) != 0)
            return false;
    }
    return true;
}

static bool read_scene(json_t *json, struct anchor_scene_result *s, struct err *e)
{
    const char *name, *title;
    if (json_unpack(json, "{ss ss sF si}", "scene", &name, "title", &title, "noise", &s->noise,
                    "places", &s->num_places) != 0)
        return err_set(e, "a scene lacks a member");
    snprintf(s->scene, sizeof s->scene, "%s", name);
    snprintf(s->title, sizeof s->title, "%s", title);
    for (int k = 0; k < NUM_ANCHOR_RULES; k++)
        if (!read_outcome(json_object_get(json_object_get(json, "rules"), anchor_rules[k].id),
                          &s->rule[k]))
            return err_set(e, "%s: %s lacks a member", name, anchor_rules[k].id);
    return true;
}

bool anchors_load(const char *path, struct anchor_results *r, struct err *e)
{
    json_error_t why;
    json_int_t seed;
    const char *version, *date;
    struct anchor_settings *set = &r->settings;
    *r = (struct anchor_results){0};
    json_t *root = json_load_file(path, JSON_REJECT_DUPLICATES, &why), *scenes;
    if (root == NULL)
        return err_set(e, "%s:%d: %s", path, why.line, why.text);
    bool ok =
        json_unpack_ex(root, &why, 0, "{s{si si si si si sI sF sF} ss ss so}", "settings", "side",
                       &set->side, "spp", &set->spp, "reference_spp", &set->reference_spp,
                       "num_tune", &set->num_tune, "num_pairs", &set->num_pairs, "seed", &seed,
                       "tuned", &set->tuned, "power", &set->power, "version", &version, "date",
                       &date, "scenes", &scenes) == 0 ||
        err_set(e, "%s: %s", path, why.text);
    if (ok) {
        set->seed = (uint64_t)seed;
        snprintf(r->version, sizeof r->version, "%s", version);
        snprintf(r->date, sizeof r->date, "%s", date);
        size_t n = json_array_size(scenes);
        ok = (n >= 1 && n <= NUM_ANCHOR_SCENES) || err_set(e, "%s: %zu scenes", path, n);
        for (size_t s = 0; ok && s < n; s++)
            ok =
                read_scene(json_array_get(scenes, s), &r->scene[s], e) || err_prefix(e, "%s", path);
        r->num_scenes = ok ? (int)n : 0;
    }
    json_decref(root);
    return ok;
}

/* With K ~ Binomial(n, p) values at or below the quantile: the i-th value (from 0) is at or below it
 * where K >= i + 1. */
void anchors_quantile_ranks(int n, double p, int *at, int *lo, int *hi)
{
    *at = (int)ceil(p * n - 1e-9) - 1;
    *lo = 0;
    while (*lo + 1 <= *at && gsl_cdf_binomial_P((unsigned)*lo + 1, p, (unsigned)n) <= 0.025)
        ++*lo;
    *hi = *at;
    while (*hi < n && gsl_cdf_binomial_P((unsigned)*hi, p, (unsigned)n) < 0.975)
        ++*hi;
}

bool anchors_useless(const struct anchor_results *r, const struct anchor_outcome *o)
{
    return o->false_alarms * 20 > r->settings.num_pairs;
}
