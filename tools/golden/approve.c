#include "approve.h"

#include "reference/base/utc_date.h"
#include "tools/compare/region.h"

#include <string.h>

static const char *text_of(const json_t *entry, const char *key)
{
    const char *v = json_string_value(json_object_get(entry, key));
    return v != NULL ? v : "?";
}

/* Which seeds: the number they were made from, where it was kept, and how many. */
static void print_provenance(FILE *out, const char *what, const json_t *entry)
{
    const json_t *seeds = json_object_get(entry, "seeds"), *seed = json_object_get(entry, "seed");
    fprintf(out, "  %-9s %s, %zu seeds", what, text_of(entry, "version"), json_array_size(seeds));
    if (json_is_integer(seed))
        fprintf(out, " of seed %lld", (long long)json_integer_value(seed));
    if (json_array_size(seeds) > 0)
        fprintf(out, " (%lld, ..)", (long long)json_integer_value(json_array_get(seeds, 0)));
    fprintf(out, ", scene %.12s, image %.12s, %s\n", text_of(entry, "scene_sha256"),
            text_of(entry, "exr_sha256"), text_of(entry, "date"));
}

static json_t *effect_json(const struct comparison *r, double alpha)
{
    const struct region *g = &r->global[3];
    return json_pack("{s:f, s:[f,f], s:f, s:f, s:f}", "difference", g->difference, "ci", g->ci_lo,
                     g->ci_hi, "mdb_global", r->mdb_global, "mdb_tile", r->mdb_tile, "alpha",
                     alpha);
}

/* Stores the candidate with one change more than the stored one had. Takes over `change`. */
static bool store(const struct approve_options *opt, const struct suite_scene *scene,
                  const struct suite_reference *ref, const struct golden *candidate,
                  const struct golden *stored, const char *verdict, json_t *change, struct err *e)
{
    json_t *entry = json_copy(candidate->manifest);
    json_t *old = json_object_get(stored->manifest, "changes");
    json_t *changes = old != NULL ? json_copy(old) : json_array();
    bool ok = entry != NULL && changes != NULL && change != NULL &&
              json_object_set_new(change, "date", json_string(utc_date_now().s)) == 0 &&
              json_object_set_new(change, "verdict", json_string(verdict)) == 0;
    if (ok && stored->manifest != NULL) {
        json_t *was = json_object();
        static const char *const keys[] = {"version", "seed", "scene_sha256", "exr_sha256", "date"};
        for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
            json_t *v = json_object_get(stored->manifest, keys[i]);
            if (v != NULL)
                json_object_set(was, keys[i], v);
        }
        ok = json_object_set_new(change, "was", was) == 0;
    }
    ok = ok && json_array_append(changes, change) == 0 &&
         json_object_set(entry, "changes", changes) == 0;
    ok = ok ? golden_write(opt->golden_dir, scene->name, ref->engine, &candidate->m, entry, e)
            : err_set(e, "%s/%s: out of memory", scene->name, ref->engine);
    json_decref(changes);
    json_decref(change);
    json_decref(entry);
    return ok;
}

/* Bit for bit, whatever else the two files hold. */
static bool same_moments(const struct moments *a, const struct moments *b)
{
    size_t pixels = (size_t)a->width * (size_t)a->height;
    return a->width == b->width && a->height == b->height && strcmp(a->unit, b->unit) == 0 &&
           a->spp == b->spp && memcmp(a->n, b->n, pixels * sizeof *a->n) == 0 &&
           memcmp(a->mean, b->mean, 3 * pixels * sizeof *a->mean) == 0 &&
           memcmp(a->m2, b->m2, 3 * pixels * sizeof *a->m2) == 0 &&
           memcmp(a->m3, b->m3, 3 * pixels * sizeof *a->m3) == 0;
}

static enum approval stored_or_not(bool ok, FILE *out)
{
    if (ok)
        fprintf(out, "  approved\n");
    return ok ? APPROVE_ACCEPTED : APPROVE_IMPOSSIBLE;
}

/* Same bits: there is no statistics to do. The manifest may still tell of another scene file or key. */
static enum approval approve_identical(const struct approve_options *opt,
                                       const struct suite_scene *scene,
                                       const struct suite_reference *ref,
                                       const struct golden *candidate, const struct golden *stored,
                                       FILE *out, struct err *e)
{
    fprintf(out, "  IDENTICAL: the same bits\n");
    if (stored->state == GOLDEN_CURRENT &&
        strcmp(text_of(stored->manifest, "key"), text_of(candidate->manifest, "key")) == 0)
        return APPROVE_UNCHANGED;
    return stored_or_not(store(opt, scene, ref, candidate, stored, "IDENTICAL", json_object(), e),
                         out);
}

/* Another size: no statistic compares them, only a person can. */
static enum approval approve_incomparable(const struct approve_options *opt,
                                          const struct suite_scene *scene,
                                          const struct suite_reference *ref,
                                          const struct golden *candidate,
                                          const struct golden *stored, FILE *out, struct err *e)
{
    fprintf(out, "  NOT COMPARABLE: %d x %d pixels, stored are %d x %d\n", candidate->m.width,
            candidate->m.height, stored->m.width, stored->m.height);
    if (opt->why == NULL) {
        fprintf(out, "  refused: give --accept-difference \"why\"\n");
        return APPROVE_DIFFERENT;
    }
    return stored_or_not(store(opt, scene, ref, candidate, stored, "NOT COMPARABLE",
                               json_pack("{s:s}", "why", opt->why), e),
                         out);
}

/* With the margins of the suite. */
static bool compare(const struct approve_options *opt, const struct suite_scene *scene,
                    const struct suite_reference *ref, const struct moments *candidate,
                    const struct moments *stored, struct comparison *out, struct err *e)
{
    const struct compare_options co = {.alpha = opt->alpha,
                                       .margin_global = ref->margin_global,
                                       .margin_tile = ref->margin_tile,
                                       .tile = scene->tile};
    return compare_moments(candidate, stored, &co, out, e);
}

static enum approval approve_compared(const struct approve_options *opt,
                                      const struct suite_scene *scene,
                                      const struct suite_reference *ref,
                                      const struct golden *candidate, const struct golden *stored,
                                      FILE *out, struct err *e)
{
    struct comparison r;
    if (!compare(opt, scene, ref, &candidate->m, &stored->m, &r, e)) {
        err_prefix(e, "%s/%s: candidate (A) against stored (B)", scene->name, ref->engine);
        return APPROVE_IMPOSSIBLE;
    }
    const struct region *g = &r.global[3];
    char image[32], tile[32], more[128];
    fprintf(out, "  %s: %s\n", verdict_name(r.verdict), r.reason);
    fprintf(out,
            "  difference %+.4f %% [%+.4f, %+.4f], smallest detectable: image %s, tile %s; margins "
            "%g %%, %g %%\n",
            100 * g->difference, 100 * g->ci_lo, 100 * g->ci_hi,
            region_mdb_text(r.mdb_global, image), region_mdb_text(r.mdb_tile, tile),
            100 * ref->margin_global, 100 * ref->margin_tile);
    enum approval done;
    if (!verdict_decides(r.verdict)) {
        verdict_more_samples(r.extra_factor, "replicates", more);
        fprintf(out, "  refused: %s\n", more);
        done = APPROVE_INCONCLUSIVE;
    } else if (r.verdict == VERDICT_DIFFERENT && opt->why == NULL) {
        fprintf(out, "  refused: give --accept-difference \"why\"\n");
        done = APPROVE_DIFFERENT;
    } else {
        json_t *change = effect_json(&r, opt->alpha);
        if (r.verdict == VERDICT_DIFFERENT && change != NULL)
            json_object_set_new(change, "why", json_string(opt->why));
        done = stored_or_not(
            store(opt, scene, ref, candidate, stored, verdict_name(r.verdict), change, e), out);
    }
    comparison_free(&r);
    return done;
}

static enum approval approve_new(const struct approve_options *opt, const struct suite_scene *scene,
                                 const struct suite_reference *ref, const struct golden *candidate,
                                 FILE *out, struct err *e)
{
    fprintf(out, "  NEW: nothing is stored\n");
    if (!opt->accept_new) {
        err_set(e, "%s/%s: nothing is stored: approve it with --new", scene->name, ref->engine);
        return APPROVE_IMPOSSIBLE;
    }
    const struct golden none = {.state = GOLDEN_MISSING};
    return stored_or_not(store(opt, scene, ref, candidate, &none, "NEW", json_object(), e), out);
}

enum approval approve(const struct approve_options *opt, const struct suite_scene *scene,
                      const struct suite_reference *ref, FILE *out, struct err *e)
{
    struct golden candidate, stored;
    enum approval done = APPROVE_IMPOSSIBLE;
    if (!golden_settle(opt->golden_dir, scene->name, ref->engine, e))
        return done;
    golden_inspect(opt->from_dir, scene, ref, &candidate);
    golden_inspect(opt->golden_dir, scene, ref, &stored);
    fprintf(out, "%s/%s\n", scene->name, ref->engine);
    if (candidate.state == GOLDEN_MISSING) {
        err_set(e, "%s/%s: no candidate in %s: `assay golden render` makes it", scene->name,
                ref->engine, opt->from_dir);
    } else if (candidate.state != GOLDEN_CURRENT) {
        *e = candidate.why;
        err_prefix(e, "%s candidate", golden_state_name(candidate.state));
    } else if (stored.state == GOLDEN_DAMAGED) {
        *e = stored.why;
        err_prefix(e, "nothing to compare with: restore it, or remove it and give --new");
    } else {
        if (stored.manifest != NULL)
            print_provenance(out, "stored", stored.manifest);
        print_provenance(out, "candidate", candidate.manifest);
        if (stored.state == GOLDEN_MISSING)
            done = approve_new(opt, scene, ref, &candidate, out, e);
        else if (same_moments(&stored.m, &candidate.m))
            done = approve_identical(opt, scene, ref, &candidate, &stored, out, e);
        else if (stored.m.width != candidate.m.width || stored.m.height != candidate.m.height)
            done = approve_incomparable(opt, scene, ref, &candidate, &stored, out, e);
        else
            done = approve_compared(opt, scene, ref, &candidate, &stored, out, e);
    }
    golden_free(&candidate);
    golden_free(&stored);
    return done;
}

/* Whatever versions and scene files they were made with, they are to be compared: only a damaged one cannot be. */
static bool can_compare(const struct golden *g, const char *dir, struct err *e)
{
    if (g->state != GOLDEN_MISSING && g->state != GOLDEN_DAMAGED)
        return true;
    *e = g->why;
    return err_prefix(e, "%s in %s", golden_state_name(g->state), dir);
}

void approve_compare_heading(FILE *out)
{
    fprintf(out, "%-20s  %-26s  %-26s  %-26s  %8s  %s\n", "scene", "candidate", "stored",
            "difference % [interval]", "margin %", "verdict");
}

bool approve_compare(const struct approve_options *opt, const struct suite_scene *scene,
                     const struct suite_reference *ref, FILE *out, enum verdict *verdict,
                     struct err *e)
{
    struct golden candidate, stored;
    struct comparison r = {0};
    golden_inspect(opt->from_dir, scene, ref, &candidate);
    golden_inspect(opt->golden_dir, scene, ref, &stored);
    bool ok = can_compare(&candidate, opt->from_dir, e) && can_compare(&stored, opt->golden_dir, e);
    bool same = ok && same_moments(&candidate.m, &stored.m);
    ok = ok && (same || compare(opt, scene, ref, &candidate.m, &stored.m, &r, e));
    if (ok) {
        const struct region *g = &r.global[3];
        char effect[64] = "the same bits";
        if (!same)
            snprintf(effect, sizeof effect, "%+.3f [%+.3f, %+.3f]", 100 * g->difference,
                     100 * g->ci_lo, 100 * g->ci_hi);
        *verdict = same ? VERDICT_EQUIVALENT : r.verdict;
        fprintf(out, "%-20s  %-26.26s  %-26.26s  %-26s  %8g  %s\n", scene->name,
                text_of(candidate.manifest, "version"), text_of(stored.manifest, "version"), effect,
                100 * ref->margin_global, verdict_name(*verdict));
        if (!same)
            comparison_free(&r);
    }
    golden_free(&candidate);
    golden_free(&stored);
    return ok || err_prefix(e, "%s/%s", scene->name, ref->engine);
}
