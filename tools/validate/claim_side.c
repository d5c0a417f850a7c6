/* The two sides of a claim: renders ours, loads references and closed forms, runs live engines,
 * and keeps the image of each look. */
#include "validate_internal.h"

#include "reference/base/json_file.h"
#include "reference/base/json_node.h"
#include "reference/store/reference_render.h"
#include "reference/suite/engine_table.h"
#include "reference/truth/truth.h"
#include "renderer/base/fs.h"
#include "renderer/base/progress.h"
#include "tools/base/data_dirs.h"

#include <assert.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Error rates were measured for 16 samples or more; starting an engine costs more than a few replicates. */
enum { LEAST_SAMPLES = 16, LEAST_REPLICATES = 8 };

/* Seeds of the second stage: another seed for our renders, and replicate numbers that the first stage never reaches. */
static const uint64_t fresh_seed = 0xd1b54a32d192ed03u;
enum { FRESH_REPLICATE = 1 << 24 };

static void observed_free(struct side_image *o)
{
    moments_free(&o->m);
    json_decref(o->manifest);
    *o = (struct side_image){0};
}

void side_free(struct side *s)
{
    for (int k = 0; k < NUM_STAGES; k++)
        for (int l = 0; l < NUM_LOOKS; l++)
            observed_free(&s->at[k][l]);
}

/* Is it a variant of our renderer whose samples cannot be rendered in parts? */
static bool is_whole(const struct suite_variant *v)
{
    static const char *const whole[] = {"-a",        "--adaptive", "--adaptive-unbiased",
                                        "--sampler", "--time",     "--error"};
    for (const char *const *o = v != NULL ? v->options : NULL; o != NULL && *o != NULL; o++)
        for (size_t i = 0; i < sizeof whole / sizeof *whole; i++)
            if (strcmp(*o, whole[i]) == 0)
                return true;
    return false;
}

bool side_grows(const struct side *s)
{
    return s->kind == SIDE_LIVE || (s->kind == SIDE_OURS && !is_whole(s->variant));
}

bool side_is_at_any_look(const struct side *s)
{
    return side_grows(s) || s->kind == SIDE_TRUTH || s->kind == SIDE_GOLDEN;
}

bool side_can_be_fresh(const struct side *s)
{
    return s->kind != SIDE_GOLDEN;
}

static int declared(const struct side *s)
{
    if (s->kind == SIDE_LIVE)
        return s->ref->replicates;
    return s->variant != NULL ? s->variant->spp : s->scene->spp;
}

int side_count(const struct side *s, int look)
{
    int all = declared(s);
    switch (s->kind) {
    case SIDE_OURS:
        if (is_whole(s->variant))
            return look == LOOK_DECLARED ? all : 0;
        return alpha_spending_count(look, all, LEAST_SAMPLES);
    case SIDE_LIVE: {
        int least = all < LEAST_REPLICATES ? all : LEAST_REPLICATES,
            n = alpha_spending_count(look, all, 1);
        return n > least ? n : least;
    }
    case SIDE_ENGINE: return look == LOOK_DECLARED;
    case SIDE_TRUTH:
    case SIDE_GOLDEN: break;
    }
    return 1;
}

/* Index of a look's image: looks with equally many observations share one. */
static int slot(const struct side *s, int look)
{
    int n = side_count(s, look), l = look;
    while (l > 0 && side_count(s, l - 1) == n)
        l--;
    return l;
}

/* The largest look with fewer observations whose image is present, or -1. */
static int below(const struct side *s, int stage, int look)
{
    int l = slot(s, look) - 1;
    while (l >= 0 && !s->at[stage][l].present)
        l--;
    return l;
}

double side_cost(const struct side *s, int look)
{
    if (s->at[0][slot(s, look)].present || s->failed || s->kind == SIDE_TRUTH ||
        s->kind == SIDE_GOLDEN)
        return 0;
    int l = below(s, 0, look);
    double n = side_count(s, look) - (l >= 0 ? side_count(s, l) : 0);
    double samples = s->kind == SIDE_OURS ? 1 : 64; /* in a replicate, about */
    return n * samples * s->scene->width * s->scene->height;
}

/* The path without ending, in out_dir: data/SCENE/NAME[_filter][_as_REFERENCE][_fresh][_OBSERVATIONS]. */
static struct path stem_of(const struct validation *v, const struct side *s, int stage, int look)
{
    char n[16] = "";
    if (v->sequence != &alpha_spending_single && side_grows(s))
        snprintf(n, sizeof n, "_%d", side_count(s, look));
    bool filtered = s->scene->filter.radius > 0 && s->kind != SIDE_ENGINE;
    return fs_path("data/%s/%s%s%s%s%s%s", s->scene->name, s->name, filtered ? "_filter" : "",
                   s->of != NULL ? "_as_" : "", s->of != NULL ? s->of : "",
                   stage > 0 && s->kind != SIDE_TRUTH ? "_fresh" : "", n);
}

static struct path full_path(const struct validation *v, const char *file)
{
    return fs_path("%s/%s", v->opt->out_dir, file);
}

static double program_time(const struct validation *v)
{
    return fmin(v->opt->timeout_s, validate_time_left(v));
}

/* Renders the samples from `first` up to those of the look. If a run has a single look, the renderer's own file
 * stays. */
static bool render_ours(const struct validation *v, const struct side *s, int stage, int look,
                        int first, struct side_image *out, struct err *e)
{
    bool keep = first == 0 && v->sequence == &alpha_spending_single;
    const struct path files =
        full_path(v, fs_path("%s%s", stem_of(v, s, stage, look).s, keep ? "" : ".part").s);
    const struct pathtracer_job job = {.program = v->opt->pathtracer,
                                       .scene = s->scene,
                                       .first = first,
                                       .spp = side_count(s, look),
                                       .seed = stage > 0 ? v->opt->seed ^ fresh_seed : v->opt->seed,
                                       .options = s->variant != NULL ? s->variant->options : NULL,
                                       .threads = v->opt->threads,
                                       .timeout_s = program_time(v),
                                       .files = files.s,
                                       .keep = keep};
    if (!fs_make_parent_dirs(files.s, e) ||
        !run_pathtracer(&job, &out->m, &out->seconds, &out->rays, e))
        return false;
    out->written = keep;
    return true;
}

static bool render_live(const struct validation *v, const struct side *s, int stage, int look,
                        int first, struct side_image *out, struct err *e)
{
    const struct validate_options *o = v->opt;
    struct suite_reference ref = *s->ref;
    ref.replicates = side_count(s, look) - first;
    const struct reference_options ro = {.seed = o->reference_seed,
                                         .first_replicate = first + stage * FRESH_REPLICATE,
                                         .threads = o->threads,
                                         .timeout_s = program_time(v),
                                         .work_dir = o->out_dir,
                                         .share_dir = o->share_dir};
    return reference_render(s->scene, &ref, &ro, &out->m, &out->manifest, e);
}

static bool render_engine(const struct validation *v, struct side *s, int stage,
                          struct side_image *out, struct err *e)
{
    const struct validate_options *o = v->opt;
    const uint32_t seed = s->of != NULL ? s->seed : o->reference_seed;
    const struct engine_options eo = {.spp = o->engine_spp,
                                      .replicates = o->engine_replicates,
                                      .seed = stage > 0 ? ~seed : seed,
                                      .threads = o->threads,
                                      .timeout_s = program_time(v),
                                      .work_dir = o->out_dir,
                                      .same_as = s->same_as,
                                      .goes_on = s->goes_on,
                                      .differs = &s->differs};
    const struct path path =
        full_path(v, fs_path("%s.json", stem_of(v, s, stage, LOOK_DECLARED).s).s);
    if (!engine_render(o->engine, s->scene, &eo, &out->m, &out->manifest, e))
        return false;
    json_t *told = json_copy(out->manifest);
    json_object_del(told, "blocks"); /* as long as an image */
    const bool ok = fs_make_parent_dirs(path.s, e) && json_write(path.s, told, e);
    json_decref(told);
    return ok;
}

/* Adds `before` to `more`, or copies it if `more` has no image. The manifest becomes that of `before`, with the
 * seeds of both. */
static bool add_before(const struct side_image *before, struct side_image *more, struct err *e)
{
    struct moments sum;
    if (!moments_copy(&before->m, &sum, e))
        return false;
    if (more->m.n != NULL && !moments_merge(&sum, &more->m, e)) {
        moments_free(&sum);
        return false;
    }
    moments_free(&more->m);
    more->m = sum;
    more->seconds += before->seconds;
    more->rays.rays += before->rays.rays;
    more->rays.box_tests += before->rays.box_tests;
    more->rays.primitive_tests += before->rays.primitive_tests;
    if (before->manifest == NULL)
        return true;
    json_t *manifest = json_deep_copy(before->manifest);
    json_array_extend(json_object_get(manifest, "seeds"), json_object_get(more->manifest, "seeds"));
    json_decref(more->manifest);
    more->manifest = manifest;
    return true;
}

static void add_words(json_t *words, const char *const *word)
{
    for (; *word != NULL; word++)
        json_array_append_new(words, json_string(*word));
}

void side_add_places(const struct validation *v, bool of_goldens, json_t *words)
{
    const struct validate_options *o = v->opt;
    char full[PATH_MAX], found[PATH_MAX];
    const bool own = v->suite.is_own;
    const struct data_dirs at = own ? data_dirs_of_suite(o->suite_dir) : data_dirs_find();
    if ((own || strcmp(o->suite_dir, at.suite.s) != 0) && realpath(o->suite_dir, full) != NULL)
        add_words(words, (const char *[]){"--suite", full, NULL});
    if (of_goldens && realpath(o->golden_dir, full) != NULL &&
        (realpath(at.golden.s, found) == NULL || strcmp(full, found) != 0))
        add_words(words, (const char *[]){"--golden", full, NULL});
}

/* Did the engine make what is stored? Else: is the reference called as it, or as it and -VERSION? So does `golden render`
 * choose the reference that an engine makes. */
static bool is_made_by(const struct engine *en, const char *name, const json_t *manifest)
{
    const size_t n = en != NULL ? strlen(en->name) : 0;
    const json_t *settings = json_object_get(manifest, "settings");
    const char *maker = member_text(json_object_get(settings, "description"), "name");
    if (n > 0 && maker != NULL)
        return strcmp(maker, en->name) == 0;
    return n > 0 && strncmp(name, en->name, n) == 0 && (name[n] == '\0' || name[n] == '-');
}

bool side_renewal(const struct validation *v, const struct side *s, const json_t *manifest,
                  json_t **out)
{
    *out = NULL;
    const char *scene = s->scene->references_of;
    const bool ours = engine_with_goldens(s->name) != NULL;
    if (!ours && !is_made_by(v->opt->engine, s->name, manifest))
        return true;
    json_t *render = json_pack("[s,s]", "golden", "render"),
           *approve = json_pack("[s,s]", "golden", "approve");
    side_add_places(v, false, render);
    add_words(render, (const char *[]){"--fresh", "--only", scene, "--engine",
                                       ours ? s->name : v->opt->engine->file, ours ? NULL : "--as",
                                       s->name, NULL});
    side_add_places(v, true, approve);
    add_words(approve, (const char *[]){"--new", fs_path("%s/%s", scene, s->name).s, NULL});
    char *first = json_command_line("assay", render), *then = json_command_line("assay", approve);
    if (first != NULL && then != NULL)
        *out = json_sprintf("%s\n%s", first, then);
    free(first);
    free(then);
    json_decref(render);
    json_decref(approve);
    return *out != NULL;
}

/* Adds to a line that says that a reference of a suite of one's own is missing or stale how it is made. */
static void say_renewal(const struct validation *v, const struct side *s, const json_t *manifest,
                        struct err *e)
{
    const struct err why = *e;
    json_t *commands;
    const bool ok = side_renewal(v, s, manifest, &commands);
    const char *render = json_string_value(commands);
    if (!ok)
        err_set(e, "%.500s: out of memory for the commands that make it", why.msg);
    else if (render != NULL)
        err_set(e, "%.500s: %.*s && %s", why.msg, (int)strcspn(render, "\n"), render,
                strchr(render, '\n') + 1);
    else
        err_set(e,
                "%.500s: render it with the file that describes what makes it (golden render "
                "--engine FILE --as %s), then approve it",
                why.msg, s->name);
    json_decref(commands);
}

/* Reads the reference. If a suite of one's own lacks it, or has an old one, the line says how to make it. */
static bool read_golden(const struct validation *v, struct side *s, struct side_image *out,
                        struct err *e)
{
    const char *dir = v->opt->golden_dir;
    if (golden_read(dir, s->scene, s->ref, &out->m, &out->manifest, e))
        return golden_has_filter(out->manifest, s->scene, s->name, e);
    struct golden g;
    golden_inspect(dir, s->scene, s->ref, &g);
    if (v->suite.is_own && (g.state == GOLDEN_MISSING || g.state == GOLDEN_STALE))
        say_renewal(v, s, g.manifest, e);
    golden_free(&g);
    return false;
}

static bool make(struct validation *v, struct side *s, int stage, int look, struct side_image *out)
{
    int l = below(s, stage, look);
    int first = l >= 0 ? side_count(s, l) : 0;
    const struct side_image *before = l >= 0 ? &s->at[stage][l] : NULL;
    /* More replicates of an engine without noise would be the same image. */
    if (before != NULL && (first == side_count(s, look) || moments_is_exact(&before->m)))
        return add_before(before, out, &s->e);
    bool ok = false;
    switch (s->kind) {
    case SIDE_OURS: ok = render_ours(v, s, stage, look, first, out, &s->e); break;
    case SIDE_TRUTH: ok = truth_render(s->scene, s->ref, &out->m, &s->e); break;
    case SIDE_GOLDEN: ok = read_golden(v, s, out, &s->e); break;
    case SIDE_LIVE: ok = render_live(v, s, stage, look, first, out, &s->e); break;
    case SIDE_ENGINE: ok = render_engine(v, s, stage, out, &s->e); break;
    }
    if (!ok)
        return false;
    if (out->manifest != NULL)
        out->seconds = json_number_value(json_object_get(out->manifest, "cpu_s"));
    if (s->kind != SIDE_GOLDEN)
        s->cpu_s += out->seconds;
    return before == NULL || add_before(before, out, &s->e);
}

enum fetch_result side_at(struct validation *v, struct side *s, int stage, int look,
                          struct side_image **out)
{
    struct side_image *o = s->kind == SIDE_TRUTH ? &s->at[0][0] : &s->at[stage][slot(s, look)];
    assert(stage == 0 || side_can_be_fresh(s));
    *out = o;
    if (o->present)
        return FETCH_OK;
    if (s->failed)
        return FETCH_FAILED;
    int l = below(s, stage, look);
    double more = side_count(s, look) - (l >= 0 ? side_count(s, l) : 0);
    double predicted = s->units > 0 ? s->wall_s / s->units * more : 0;
    if (validate_time_left(v) <= predicted)
        return FETCH_NO_TIME;
    if (s->kind != SIDE_TRUTH && s->kind != SIDE_GOLDEN) {
        char note[160];
        snprintf(note, sizeof note, "rendering with %s%s%s", s->name,
                 stage > 0       ? ", fresh seeds"
                 : s->of != NULL ? ", seeds of "
                                 : "",
                 stage == 0 && s->of != NULL ? s->of : "");
        validate_log(v, s->scene->name, note);
    }
    double begun = progress_seconds();
    if (!make(v, s, stage, look, o)) {
        observed_free(o);
        /* A program that was stopped because the budget is spent has not failed. */
        if (validate_time_left(v) <= 0)
            return FETCH_NO_TIME;
        s->failed = true;
        return FETCH_FAILED;
    }
    s->wall_s += progress_seconds() - begun;
    s->units += more;
    o->present = true;
    return FETCH_OK;
}

bool side_write(const struct validation *v, struct side *s, int stage, int look, struct path *file,
                struct err *e)
{
    struct side_image *o = s->kind == SIDE_TRUTH ? &s->at[0][0] : &s->at[stage][slot(s, look)];
    assert(o->present);
    *file = fs_path("%s.exr", stem_of(v, s, stage, look).s);
    const struct path path = full_path(v, file->s);
    if (!o->written &&
        !(fs_make_parent_dirs(path.s, e) && moments_write(path.s, &o->m, NULL, 0, e)))
        return false;
    o->written = true;
    return true;
}
