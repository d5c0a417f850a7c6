#include "approve.h"

#include "reference/base/json_node.h"
#include "reference/base/utc_date.h"
#include "tools/compare/region.h"
#include "tools/compare/variance_ratio.h"
#include "tools/stats/pair_noise.h"

#include <string.h>

/* An undecided candidate may replace what is stored if it has this many times its samples: then more than half of the
 * noise left is that of what is stored, which no candidate can do anything about. */
static const double better = 1.25;

static const char *text_of(const json_t *entry, const char *key)
{
    const char *v = json_string_value(json_object_get(entry, key));
    return v != NULL ? v : "?";
}

/* Prints version, seeds (how many, the seed they derive from if it is stored, the first), hashes and date. */
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

/* A candidate and the stored reference that it may replace. */
struct pair {
    const struct approve_options *opt;
    const struct suite_scene *scene;
    const struct suite_reference *ref;
    struct golden candidate, stored;
    FILE *out;
};

static struct pair pair_open(const struct approve_options *opt, const struct suite_scene *scene,
                             const struct suite_reference *ref, FILE *out)
{
    struct pair p = {.opt = opt, .scene = scene, .ref = ref, .out = out};
    golden_inspect(opt->from_dir, scene, ref, &p.candidate);
    golden_inspect(opt->golden_dir, scene, ref, &p.stored);
    return p;
}

static void pair_close(struct pair *p)
{
    golden_free(&p->candidate);
    golden_free(&p->stored);
}

/* Stores the candidate, with `change` appended to the stored one's changes. Takes ownership of `change`. */
static enum approval accept(const struct pair *p, const char *verdict, json_t *change,
                            struct err *e)
{
    static const char *const keys[] = {"version", "seed", "scene_sha256", "exr_sha256", "date"};
    const json_t *stored = p->stored.manifest, *old = json_object_get(stored, "changes");
    json_t *entry = json_copy(p->candidate.manifest),
           *changes = old != NULL ? json_copy((json_t *)old) : json_array();
    json_object_set_new(change, "date", json_string(utc_date_now().s));
    json_object_set_new(change, "verdict", json_string(verdict));
    if (stored != NULL) {
        json_t *was = json_object();
        for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
            json_object_set(was, keys[i], json_object_get(stored, keys[i]));
        json_object_set_new(change, "was", was);
    }
    json_array_append_new(changes, change);
    json_object_set_new(entry, "changes", changes);
    bool ok =
        golden_write(p->opt->golden_dir, p->scene->name, p->ref->engine, &p->candidate.m, entry, e);
    json_decref(entry);
    if (ok)
        fprintf(p->out, "  approved%s\n", stored != NULL ? ", in place of what was stored" : "");
    return ok ? APPROVE_ACCEPTED : APPROVE_IMPOSSIBLE;
}

static enum approval refuse_difference(const struct pair *p)
{
    fprintf(p->out, "  refused: give --accept-difference \"why\"\n");
    return APPROVE_DIFFERENT;
}

/* Are the moments the same bit for bit? Other contents of the files are not compared. */
static bool same_moments(const struct moments *a, const struct moments *b)
{
    size_t pixels = (size_t)a->width * (size_t)a->height;
    return a->width == b->width && a->height == b->height && strcmp(a->unit, b->unit) == 0 &&
           a->spp == b->spp && memcmp(a->n, b->n, pixels * sizeof *a->n) == 0 &&
           memcmp(a->mean, b->mean, 3 * pixels * sizeof *a->mean) == 0 &&
           memcmp(a->m2, b->m2, 3 * pixels * sizeof *a->m2) == 0 &&
           memcmp(a->m3, b->m3, 3 * pixels * sizeof *a->m3) == 0;
}

/* The same bits: nothing to test. The manifest may still name another scene file or key. */
static enum approval approve_identical(const struct pair *p, struct err *e)
{
    fprintf(p->out, "  IDENTICAL: the same bits\n");
    if (p->stored.state == GOLDEN_CURRENT &&
        strcmp(text_of(p->stored.manifest, "key"), text_of(p->candidate.manifest, "key")) == 0)
        return APPROVE_UNCHANGED;
    return accept(p, "IDENTICAL", json_object(), e);
}

/* Another size: no statistic compares them, only a person can. */
static enum approval approve_incomparable(const struct pair *p, struct err *e)
{
    const struct moments *m = &p->candidate.m, *was = &p->stored.m;
    fprintf(p->out, "  NOT COMPARABLE: %d x %d pixels, stored are %d x %d\n", m->width, m->height,
            was->width, was->height);
    if (p->opt->why == NULL)
        return refuse_difference(p);
    return accept(p, "NOT COMPARABLE", json_pack("{s:s}", "why", p->opt->why), e);
}

/* Compares candidate (A) with stored (B), with the margins of the suite. Single images of unknown noise get that of
 * their difference. */
static bool compare(const struct pair *p, struct comparison *out, struct err *e)
{
    const struct moments *a = &p->candidate.m, *b = &p->stored.m;
    const struct compare_options co = {.alpha = p->opt->alpha,
                                       .margin_global = p->ref->margin_global,
                                       .margin_tile = p->ref->margin_tile,
                                       .tile = p->scene->tile};
    if (!pair_noise_is_unknown(a, b) || a->width != b->width || a->height != b->height)
        return compare_moments(a, b, &co, out, e);
    struct moments estimated[2];
    bool ok = pair_noise_estimate(a, b, estimated, e) &&
              compare_moments(&estimated[0], &estimated[1], &co, out, e);
    moments_free(&estimated[0]);
    moments_free(&estimated[1]);
    return ok;
}

static double samples_of(const struct golden *g)
{
    return member_number(g->manifest, "spp") * member_number(g->manifest, "replicates");
}

/* Undecided: if the candidate has more samples, a person can say why it may replace what is stored. Else says what
 * would help: `factor` times the samples on both sides would decide, of which those stored are what they are. */
static enum approval refuse_undecided(const struct pair *p, double factor)
{
    const double times = samples_of(&p->candidate) / samples_of(&p->stored); /* NAN if unknown */
    const struct moments *a = &p->candidate.m, *b = &p->stored.m;
    if (times >= better) {
        fprintf(p->out,
                "  refused: undecided, though the candidate has %.3g times the samples of what is "
                "stored: to let it replace that, give --accept-difference \"why\"\n",
                times);
        return APPROVE_BETTER;
    }
    const double alone = pair_noise_samples_of_a(pair_noise_share(a, b), factor);
    if (!pair_noise_is_unknown(a, b) && alone < verdict_largest_factor)
        fprintf(p->out,
                "  refused: about %.1f times the replicates of the candidate would decide\n",
                alone);
    else
        fprintf(
            p->out,
            "  refused: too much of the noise is that of what is stored: render a candidate "
            "with at least %g times its samples (it has %g replicates of %g), which may replace "
            "it for a reason that you give\n",
            better, member_number(p->stored.manifest, "replicates"),
            member_number(p->stored.manifest, "spp"));
    return APPROVE_INCONCLUSIVE;
}

static enum approval approve_compared(const struct pair *p, struct err *e)
{
    struct comparison r;
    if (!compare(p, &r, e)) {
        variance_ratio_advise(&p->candidate.m, &p->stored.m,
                              "render the candidate with another --seed", e);
        err_prefix(e, "%s/%s: candidate (A) against stored (B)", p->scene->name, p->ref->engine);
        return APPROVE_IMPOSSIBLE;
    }
    const struct region *g = &r.global[3];
    char image[32], tile[32];
    fprintf(p->out, "  %s: %s\n", verdict_name(r.verdict), r.reason);
    fprintf(p->out,
            "  difference %+.4f %% [%+.4f, %+.4f], smallest detectable: image %s, tile %s; margins "
            "%g %%, %g %%\n",
            100 * g->difference, 100 * g->ci_lo, 100 * g->ci_hi,
            region_mdb_text(r.mdb_global, image), region_mdb_text(r.mdb_tile, tile),
            100 * p->ref->margin_global, 100 * p->ref->margin_tile);
    const bool undecided = !verdict_decides(r.verdict), equal = r.verdict == VERDICT_EQUIVALENT;
    enum approval done;
    if (undecided &&
        (p->opt->why == NULL || !(samples_of(&p->candidate) >= better * samples_of(&p->stored)))) {
        done = refuse_undecided(p, r.extra_factor);
    } else if (!equal && p->opt->why == NULL) {
        done = refuse_difference(p);
    } else {
        json_t *change = effect_json(&r, p->opt->alpha);
        if (!equal)
            json_object_set_new(change, "why", json_string(p->opt->why));
        done = accept(p, verdict_name(r.verdict), change, e);
    }
    comparison_free(&r);
    return done;
}

static enum approval approve_new(const struct pair *p, struct err *e)
{
    fprintf(p->out, "  NEW: nothing is stored\n");
    if (p->opt->accept_new)
        return accept(p, "NEW", json_object(), e);
    err_set(e, "%s/%s: nothing is stored: approve it with --new", p->scene->name, p->ref->engine);
    return APPROVE_IMPOSSIBLE;
}

enum approval approve(const struct approve_options *opt, const struct suite_scene *scene,
                      const struct suite_reference *ref, FILE *out, struct err *e)
{
    enum approval done = APPROVE_IMPOSSIBLE;
    if (!golden_settle(opt->golden_dir, scene->name, ref->engine, e))
        return done;
    struct pair p = pair_open(opt, scene, ref, out);
    const struct golden *candidate = &p.candidate, *stored = &p.stored;
    fprintf(out, "%s/%s\n", scene->name, ref->engine);
    if (candidate->state == GOLDEN_MISSING) {
        err_set(e, "%s/%s: no candidate in %s: golden render makes it", scene->name, ref->engine,
                opt->from_dir);
    } else if (candidate->state != GOLDEN_CURRENT) {
        *e = candidate->why;
        err_prefix(e, "%s candidate", golden_state_name(candidate->state));
    } else if (stored->state == GOLDEN_DAMAGED) {
        *e = stored->why;
        err_prefix(e, "nothing to compare with: restore it, or remove it and give --new");
    } else {
        if (stored->manifest != NULL)
            print_provenance(out, "stored", stored->manifest);
        print_provenance(out, "candidate", candidate->manifest);
        if (stored->state == GOLDEN_MISSING)
            done = approve_new(&p, e);
        else if (same_moments(&stored->m, &candidate->m))
            done = approve_identical(&p, e);
        else if (stored->m.width != candidate->m.width || stored->m.height != candidate->m.height)
            done = approve_incomparable(&p, e);
        else
            done = approve_compared(&p, e);
    }
    pair_close(&p);
    return done;
}

/* References of any version and scene file can be compared, unless one is missing or damaged. */
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
    struct pair p = pair_open(opt, scene, ref, out);
    struct comparison r = {0};
    bool ok =
        can_compare(&p.candidate, opt->from_dir, e) && can_compare(&p.stored, opt->golden_dir, e);
    bool same = ok && same_moments(&p.candidate.m, &p.stored.m);
    ok = ok && (same || compare(&p, &r, e));
    if (ok) {
        const struct region *g = &r.global[3];
        char effect[64] = "the same bits";
        if (!same)
            snprintf(effect, sizeof effect, "%+.3f [%+.3f, %+.3f]", 100 * g->difference,
                     100 * g->ci_lo, 100 * g->ci_hi);
        *verdict = same ? VERDICT_EQUIVALENT : r.verdict;
        fprintf(out, "%-20s  %-26.26s  %-26.26s  %-26s  %8g  %s\n", scene->name,
                text_of(p.candidate.manifest, "version"), text_of(p.stored.manifest, "version"),
                effect, 100 * ref->margin_global, verdict_name(*verdict));
    }
    comparison_free(&r);
    pair_close(&p);
    return ok || err_prefix(e, "%s/%s", scene->name, ref->engine);
}
