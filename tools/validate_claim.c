#include "validate_parts.h"

#include "claim.h"

#include <stdio.h>
#include <string.h>

int count_claims(const struct validation *v, const struct suite_scene *s)
{
    bool has_truth = suite_reference_of(s, "truth") != NULL;
    return s->num_references + (has_truth ? s->num_references - 1 : 0) +
           (v->engine_can[s - v->suite.scene] ? s->num_references + 1 : 0) + s->num_variants +
           (s->consistency.renders > 0);
}

static bool write_maps(const struct validation *v, const char *scene, const char *a, const char *b,
                       const struct comparison *r, json_t *files, struct err *e)
{
    static const char *const kind[2] = {"z", "rel"};
    const struct image *map[2] = {&r->z, &r->relative};
    for (int k = 0; k < 2; k++) {
        char path[MAX_PATH], file[128], relative[256];
        snprintf(file, sizeof file, "%s_%s_%s.exr", kind[k], a, b);
        data_path(v, path, scene, file);
        if (!image_write_exr(path, map[k], e))
            return false;
        snprintf(relative, sizeof relative, "data/%s/%s", scene, file);
        json_object_set_new(files, k == 0 ? "z" : "relative", json_string(relative));
    }
    return true;
}

static json_t *files_of(const char *scene_a, const char *a, const char *scene_b, const char *b)
{
    char path_a[256], path_b[256];
    snprintf(path_a, sizeof path_a, "data/%s/%s.exr", scene_a, a);
    snprintf(path_b, sizeof path_b, "data/%s/%s.exr", scene_b, b);
    return json_pack("{s:s, s:s}", "a", path_a, "b", path_b);
}

static void add_provenance(json_t *claim, const struct validation *v, const struct side *a,
                           const struct side *b)
{
    claim_add_observations(claim, "a", &a->m);
    claim_add_observations(claim, "b", &b->m);
    json_object_set_new(claim, "seconds_a", json_real(a->seconds));
    json_object_set_new(claim, "seconds_b", json_real(b->seconds));
    if (a->manifest == NULL)
        json_object_set_new(claim, "seed_a", json_integer((json_int_t)v->opt->seed));
    json_t *version = json_object_get(b->manifest, "version");
    json_t *seeds = json_object_get(b->manifest, "seeds");
    if (version != NULL)
        json_object_set(claim, "version_b", version);
    if (seeds != NULL)
        json_object_set(claim, "seeds_b", seeds);
}

void judge(struct validation *v, const struct suite_scene *s, const struct suite_scene *from,
           const char *a_name, const struct side *a, const struct suite_reference *ref,
           const struct side *b)
{
    /* Of this scene alone, and yet with the same alpha for each of its claims. */
    char rerun[8192], live[64] = "", engine[4200] = "";
    if (v->opt->live)
        snprintf(live, sizeof live, " --live --reference-seed %u", v->opt->reference_seed);
    if (v->opt->engine != NULL && !v->opt->live)
        snprintf(live, sizeof live, " --reference-seed %u", v->opt->reference_seed);
    if (v->opt->engine != NULL)
        snprintf(engine, sizeof engine, " --engine %s --engine-spp %d --engine-replicates %d",
                 v->opt->engine->file, v->opt->engine_spp, v->opt->engine_replicates);
    snprintf(rerun, sizeof rerun, "assay validate --only %s --alpha %.6g --seed %llu%s%s", s->name,
             v->alpha * count_claims(v, s), (unsigned long long)v->opt->seed, live, engine);
    struct claim_context c = {.scene = s,
                              .a = a_name,
                              .b = ref->engine,
                              .fidelity = ref->fidelity,
                              .expected = strcmp(ref->engine, "pathtracer") == 0
                                              ? VERDICT_EQUIVALENT /* of the same scene, also 9x */
                                              : s->expect,
                              .rerun = rerun,
                              .opt = {.alpha = v->alpha,
                                      .margin_global = ref->margin_global,
                                      .margin_tile = ref->margin_tile,
                                      .tile = s->tile}};
    struct comparison r;
    struct err e = {0};
    json_t *claim = NULL;
    v->done++;
    if (!a->present || !b->present) {
        e = a->present ? b->e : a->e;
    } else if (compare_moments(&a->m, &b->m, &c.opt, &r, &e)) {
        json_t *files = files_of(s->name, a_name, from->name, ref->engine);
        if (files != NULL && write_maps(v, s->name, a_name, ref->engine, &r, files, &e))
            claim = claim_judged(&c, &r);
        if (claim != NULL) {
            json_object_set(claim, "files", files);
            add_provenance(claim, v, a, b);
        }
        json_decref(files);
        comparison_free(&r);
    }
    if (claim == NULL)
        claim = claim_not_judged(&c, e.msg[0] ? e.msg : "out of memory");
    say(v, s->name,
        json_string_value(json_object_get(claim, "verdict"))
            ? json_string_value(json_object_get(claim, "verdict"))
            : e.msg);
    json_array_append_new(v->claims, claim);
}
