/* libassay: options, comparison, result and maps (assay.h). */
#include "assay.h"

#include "library_internal.h"
#include "renderer/base/version.h"
#include "tools/validate/compare_job.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct assay_comparison {
    struct compare_job job;
    struct compared c;
    struct assay_result result;
    const char *note[sizeof((struct notes *)NULL)->line / sizeof *((struct notes *)NULL)->line];
    char *name[2], *curve; /* what the job points to */
};

int assay_abi(void)
{
    return ASSAY_ABI;
}

const char *assay_build(void)
{
    return assay_version;
}

static const enum verdict verdicts[] = {[ASSAY_EQUIVALENT] = VERDICT_EQUIVALENT,
                                        [ASSAY_DIFFERENT] = VERDICT_DIFFERENT,
                                        [ASSAY_INCONCLUSIVE] = VERDICT_INCONCLUSIVE,
                                        [ASSAY_NOTHING_FOUND] = VERDICT_NOTHING_FOUND};
enum { NUM_VERDICTS = sizeof verdicts / sizeof *verdicts };

static enum assay_verdict public_verdict(enum verdict v)
{
    int i = 0;
    while (verdicts[i] != v)
        i++;
    return (enum assay_verdict)i;
}

const char *assay_verdict_name(enum assay_verdict verdict)
{
    return (size_t)verdict < NUM_VERDICTS ? verdict_name(verdicts[verdict]) : "?";
}

void assay_options_init(struct assay_options *options, size_t size)
{
    const struct assay_options all = {.size = size, .alpha = 1e-3, .tile = 16};
    memset(options, 0, size);
    memcpy(options, &all, size < sizeof all ? size : sizeof all);
}

/* The same ranges as those of the command's options. */
static bool check_ranges(const struct assay_options *o, struct err *e)
{
    const struct {
        const char *name;
        double value, lo, hi;
    } range[] = {{"alpha", o->alpha, 1e-12, 0.4},
                 {"margin", o->margin, 0, 0.99},
                 {"margin_tile", o->margin_tile, 0, 0.99},
                 {"margin_variance", o->margin_variance, 0, 100},
                 {"accept_mdb", o->accept_mdb, 0, 1000},
                 {"accept_mdb_tile", o->accept_mdb_tile, 0, 1000},
                 {"tile", o->tile, 1, 65536},
                 {"filter_width", o->filter_width, 0, 1000},
                 {"min_side", o->min_side, 0, 65536},
                 {"spp[0]", o->spp[0], 0, 1e12},
                 {"spp[1]", o->spp[1], 0, 1e12}};
    for (size_t i = 0; i < sizeof range / sizeof *range; i++)
        if (!(range[i].value >= range[i].lo && range[i].value <= range[i].hi))
            return err_set(e, "%s: %g is not within %g to %g", range[i].name, range[i].value,
                           range[i].lo, range[i].hi);
    return true;
}

static bool job_of(const struct assay_options *o, struct assay_comparison *c, struct err *e)
{
    struct assay_options all;
    assay_options_init(&all, sizeof all);
    if (o != NULL && o->size > sizeof all)
        return err_set(e, "the options are of a newer library than this one");
    if (o != NULL)
        memcpy(&all, o, o->size);
    if (!check_ranges(&all, e))
        return false;
    if (all.curve != NULL && (c->curve = strdup(all.curve)) == NULL)
        return err_set(e, "out of memory");
    c->job.opt = (struct compare_options){
        .alpha = all.alpha,
        .margin_global = all.margin,
        .margin_tile = all.margin_tile > 0 ? all.margin_tile : -1, /* compare_job_check() */
        .tile = all.tile,
        .margin_variance = all.margin_variance};
    for (int i = 0; i < 2; i++)
        c->job.input[i] = (struct input_options){.curve = c->curve, .spp = all.spp[i]};
    c->job.accept_mdb[0] = all.accept_mdb;
    c->job.accept_mdb[1] = all.accept_mdb_tile;
    c->job.paired = all.paired;
    c->job.exchangeable = all.exchangeable;
    c->job.same_program = all.same_program;
    c->job.filter_width = all.filter_width;
    c->job.min_side = all.min_side;
    return compare_job_check(&c->job, e);
}

static struct assay_region public_region(const struct region *r)
{
    return (struct assay_region){.x = r->x,
                                 .y = r->y,
                                 .width = r->width,
                                 .height = r->height,
                                 .channel = r->channel,
                                 .mean_a = r->mean_a,
                                 .mean_b = r->mean_b,
                                 .difference = r->difference,
                                 .ci_lo = r->ci_lo,
                                 .ci_hi = r->ci_hi,
                                 .t = r->t,
                                 .dof = r->dof,
                                 .log10_p = r->log10_p,
                                 .mdb = r->mdb};
}

static void fill_result(struct assay_comparison *c)
{
    const struct comparison *r = &c->c.r;
    struct assay_result *out = &c->result;
    *out = (struct assay_result){.verdict = public_verdict(r->verdict),
                                 .passes = compare_job_passes(&c->job, &c->c),
                                 .image = public_region(&r->global[3]),
                                 .worst = public_region(&r->worst),
                                 .worst_tile = public_region(&r->worst_tile),
                                 .mdb = r->mdb_global,
                                 .mdb_tile = r->mdb_tile,
                                 .extra_factor = r->extra_factor,
                                 .variance_ratio = NAN,
                                 .variance_lo = NAN,
                                 .variance_hi = NAN,
                                 .exact_p = NAN,
                                 .num_tests = r->num_tests,
                                 .num_notes = c->c.notes.num,
                                 .notes = c->note};
    snprintf(out->reason, sizeof out->reason, "%s", r->reason);
    if (r->variance.valid) {
        out->variance_ratio = r->variance.ratio;
        out->variance_lo = r->variance.lo;
        out->variance_hi = r->variance.hi;
    }
    if (c->job.exchangeable)
        out->exact_p = c->c.perm.p;
    if (c->job.same_program)
        out->exact_p = pow(10, c->c.flip.log10_p);
    for (int i = 0; i < c->c.notes.num; i++)
        c->note[i] = c->c.notes.line[i];
}

static bool run(struct assay_comparison *c, const struct assay_side *const side[4], struct err *e)
{
    static const char *const name[4] = {"A", "B", "A2", "B2"};
    struct library_side in[4] = {{.name = NULL}};
    bool ok = true;
    for (int i = 0; ok && i < 4 && side[i] != NULL; i++) {
        ok = library_side_open(&in[i], side[i], name[i], e);
        const struct input_memory *memory = side[i]->path == NULL ? &in[i].memory : NULL;
        (i < 2 ? c->job.path : c->job.again)[i % 2] = in[i].name;
        (i < 2 ? c->job.memory : c->job.memory_again)[i % 2] = memory;
    }
    ok = ok && compare_job_run(&c->job, &c->c, e);
    for (int i = 0; i < 2; i++) { /* what is kept must not point to the caller's data */
        c->job.memory[i] = c->job.memory_again[i] = NULL;
        c->job.again[i] = NULL;
        c->name[i] = ok ? strdup(c->c.path[i]) : NULL;
        ok = ok && (c->name[i] != NULL || err_set(e, "out of memory"));
        c->job.path[i] = c->c.path[i] = c->name[i];
    }
    for (int i = 0; i < 4; i++)
        library_side_close(&in[i]);
    return ok;
}

bool assay_compare_again(const struct assay_side *a, const struct assay_side *b,
                         const struct assay_side *a2, const struct assay_side *b2,
                         const struct assay_options *options, struct assay_comparison **out,
                         char error[ASSAY_ERROR_SIZE])
{
    const struct assay_side *const side[4] = {a, b, a2, b2};
    struct assay_comparison *c = calloc(1, sizeof *c);
    struct err e = {""};
    bool ok = c != NULL || err_set(&e, "out of memory");
    ok = ok && ((a2 == NULL) == (b2 == NULL) ||
                err_set(&e, "the second stage needs fresh images of both sides, or of none"));
    if (ok && a2 != NULL) /* for the rules between options */
        c->job.again[0] = c->job.again[1] = "";
    ok = ok && job_of(options, c, &e) && run(c, side, &e);
    if (ok)
        fill_result(c);
    if (!ok)
        assay_free(c);
    *out = ok ? c : NULL;
    return library_told(ok, &e, error);
}

bool assay_compare(const struct assay_side *a, const struct assay_side *b,
                   const struct assay_options *options, struct assay_comparison **out,
                   char error[ASSAY_ERROR_SIZE])
{
    return assay_compare_again(a, b, NULL, NULL, options, out, error);
}

const struct assay_result *assay_result_of(const struct assay_comparison *comparison)
{
    return &comparison->result;
}

static const float *map_of(const struct image *map, int *width, int *height)
{
    *width = map->width;
    *height = map->height;
    return map->data;
}

const float *assay_z_map(const struct assay_comparison *comparison, int *width, int *height)
{
    return map_of(&comparison->c.r.z, width, height);
}

const float *assay_relative_map(const struct assay_comparison *comparison, int *width, int *height)
{
    return map_of(&comparison->c.r.relative, width, height);
}

bool assay_write_json(const struct assay_comparison *comparison, const char *path,
                      char error[ASSAY_ERROR_SIZE])
{
    char *argv[] = {"compare", comparison->name[0], comparison->name[1], NULL};
    struct err e = {""};
    return library_told(compare_job_write_json(&comparison->job, &comparison->c, path, 3, argv, &e),
                        &e, error);
}

bool assay_write_report(const struct assay_comparison *comparison, const char *path,
                        char error[ASSAY_ERROR_SIZE])
{
    char *argv[] = {"compare", comparison->name[0], comparison->name[1], NULL};
    struct err e = {""};
    return library_told(
        compare_job_write_report(&comparison->job, &comparison->c, path, 3, argv, &e), &e, error);
}

void assay_free(struct assay_comparison *comparison)
{
    if (comparison == NULL)
        return;
    compare_job_free(&comparison->c);
    free(comparison->name[0]);
    free(comparison->name[1]);
    free(comparison->curve);
    free(comparison);
}
