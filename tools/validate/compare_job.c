#include "compare_job.h"
#include "tools/exact/same_program.h"

#include "tools/base/temp_dir.h"
#include "tools/compare/hint.h"
#include "tools/compare/variance_ratio.h"
#include "tools/compare/verdict.h"
#include "tools/input/input_pairs.h"
#include "tools/report/report.h"
#include "tools/results/claim_result.h"
#include "tools/sequential/two_stage.h"
#include "tools/results/results.h"

#include "renderer/base/fs.h"
#include "renderer/base/parallel.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

bool compare_job_check(struct compare_job *job, struct err *e)
{
    struct compare_options *opt = &job->opt;
    double *accept = job->accept_mdb;
    if (opt->margin_tile < 0)
        opt->margin_tile = fmin(4 * opt->margin_global, 0.99);
    if (job->paired && job->exchangeable)
        return err_set(e, "--paired and --exchangeable: sides with one seed cannot be exchanged");
    if (accept[0] > 0 && opt->margin_tile > 0 && !job->same_program)
        return err_set(e, "--accept-mdb is for a search without --margin");
    if (!(accept[0] > 0) && accept[1] > 0)
        return err_set(e, "--accept-mdb-tile goes with --accept-mdb");
    if (!(accept[1] > 0))
        accept[1] = 4 * accept[0];
    if (accept[1] < accept[0])
        return err_set(e, "--accept-mdb-tile must be at least --accept-mdb");
    job->expected = accept[0] > 0 ? VERDICT_NOTHING_FOUND : VERDICT_EQUIVALENT;
    if (job->exchangeable && (opt->margin_tile > 0 || opt->margin_variance > 0))
        return err_set(e, "--exchangeable asks if anything differs at all: it takes no margin");
    if (job->exchangeable &&
        (job->input[0].curve != NULL || job->input[0].spp > 0 || job->input[1].spp > 0))
        return err_set(e, "--exchangeable takes directories of replicates, to which --curve and "
                          "--spp-a do not apply");
    if (job->same_program && (job->exchangeable || job->paired || job->again[0] != NULL))
        return err_set(e, "--same-program is exact from one pair of renders with seeds of their "
                          "own: it takes neither --exchangeable nor --again nor --paired");
    if (job->exchangeable && job->filter_width > 0)
        return err_set(e, "--exchangeable takes whole images: --filter-width is for others");
    if (!job->same_program && job->filter_width > 1)
        return err_set(e, "--filter-width %d is for --same-program; other images can only have 1",
                       job->filter_width);
    if (!job->exchangeable && job->min_side > 0)
        return err_set(e, "--min-side is for --exchangeable");
    return true;
}

/* Two sides as compare_moments() wants them. */
struct pair {
    struct input in[2];
    bool is_of_renders; /* each with the other side's of its seed */
};

static void pair_free(struct pair *p)
{
    input_free(&p->in[0]);
    input_free(&p->in[1]);
}

/* Reads a directory of replicates, or borrows those in memory. */
static bool renders_read(const char *path, const struct input_memory *memory,
                         struct replicate_dir *out, struct err *e)
{
    if (memory == NULL)
        return replicate_dir_read(path, out, e);
    if (memory->moments != NULL || memory->renders.num < 3 || memory->type != IMAGE_FLOAT)
        return err_set(e, "%s: replicates are needed, at least 3 images of floats", path);
    *out = memory->renders;
    return true;
}

static void renders_free(const struct input_memory *memory, struct replicate_dir *r)
{
    if (memory == NULL)
        replicate_dir_free(r);
}

static bool is_of_renders(const char *path, const struct input_memory *memory)
{
    struct stat st;
    return memory != NULL ? memory->moments == NULL && memory->renders.num > 1
                          : stat(path, &st) == 0 && S_ISDIR(st.st_mode);
}

/* Of one seed each in A and B. */
static bool read_pairs_of_renders(const struct compare_job *job, const char *const path[2],
                                  const struct input_memory *const memory[2], struct pair *p,
                                  struct notes *notes, struct err *e)
{
    struct replicate_dir r[2] = {{0}};
    if (job->input[0].curve != NULL || job->input[0].spp > 0 || job->input[1].spp > 0)
        return err_set(e, "--paired of directories of renders: --curve and --spp-a do not apply");
    const bool ok = renders_read(path[0], memory[0], &r[0], e) &&
                    renders_read(path[1], memory[1], &r[1], e) &&
                    input_pairs_of_renders(path, r, p->in, notes, e);
    renders_free(memory[0], &r[0]);
    renders_free(memory[1], &r[1]);
    p->is_of_renders = ok;
    return ok;
}

/* What the threads that read the two sides share. */
struct reading {
    const struct compare_job *job;
    const char *const *path;
    const struct input_memory *const *memory;
    struct pair *pair;
    struct notes notes[2];
    struct err err[2];
    bool ok[2];
};

static void read_sides(void *ctx, size_t first, size_t last)
{
    struct reading *r = ctx;
    for (size_t i = first; i < last; i++) {
        struct input_options opt = r->job->input[i];
        opt.packed = !r->job->paired;
        const char name = "ab"[i];
        struct input *in = &r->pair->in[i];
        if (r->memory[i] != NULL)
            r->ok[i] =
                input_take(r->memory[i], r->path[i], name, &opt, in, &r->notes[i], &r->err[i]);
        else
            r->ok[i] = input_read(r->path[i], name, &opt, in, &r->notes[i], &r->err[i]);
    }
}

static bool read_two_sides(const struct compare_job *job, const char *const path[2],
                           const struct input_memory *const memory[2], struct pair *p,
                           struct notes *notes, struct err *e)
{
    struct reading r = {.job = job, .path = path, .memory = memory, .pair = p};
    parallel_for(job->opt.threads, 2, read_sides, &r);
    bool ok = true;
    for (int i = 0; ok && i < 2; i++) {
        for (int k = 0; k < r.notes[i].num; k++)
            input_notes_add(notes, "%s", r.notes[i].line[k]);
        ok = r.ok[i] || err_set(e, "%s", r.err[i].msg);
    }
    for (int i = 0; ok && i < 2; i++) /* a curve that decodes nothing is a mistake */
        ok = job->input[i].curve == NULL || p->in[0].censored != NULL ||
             p->in[1].censored != NULL ||
             err_set(e, "--curve is for images of integers, neither %s nor %s is one", path[0],
                     path[1]);
    if (ok && job->paired)
        input_pairs_of_images(p->in, notes);
    return ok;
}

static bool pair_read(const struct compare_job *job, const char *const path[2],
                      const struct input_memory *const memory[2], struct pair *p,
                      struct notes *notes, struct err *e)
{
    *p = (struct pair){0};
    bool ok = job->paired && is_of_renders(path[0], memory[0]) && is_of_renders(path[1], memory[1])
                  ? read_pairs_of_renders(job, path, memory, p, notes, e)
                  : read_two_sides(job, path, memory, p, notes, e);
    const bool independent = job->filter_width == 1;
    ok = ok && input_pair(&p->in[0], &p->in[1], independent, notes, e) &&
         (!independent || job->same_program || p->in[0].is_guessed ||
          err_set(e,
                  "--filter-width is for --same-program and for images whose noise is not known"));
    if (!ok)
        pair_free(p);
    return ok;
}

/* Moves the pair's moments into the result and frees the rest of the pair. */
static void keep_pair(const char *const path[2], const struct input_memory *const memory[2],
                      struct pair *p, struct compared *out)
{
    for (int i = 0; i < 2; i++) {
        moments_free(&out->m[i]);
        out->m[i] = p->in[i].m;
        p->in[i].m = (struct moments){0};
        out->is_stated[i] = p->in[i].kind == INPUT_MOMENTS && !p->in[i].is_guessed &&
                            p->in[i].censored == NULL && !p->in[i].is_xyz;
        out->is_file[i] = out->is_stated[i] && memory[i] == NULL;
        out->path[i] = path[i];
    }
    out->is_guessed = p->in[0].is_guessed;
    pair_free(p);
}

static bool check_fresh(const char *const path[2], const struct moments first[2],
                        const struct pair *again, struct err *e)
{
    for (int i = 0; i < 2; i++)
        if (!two_stage_check_fresh(&first[i], &again->in[i].m, e))
            return err_prefix(e, "%s", path[i]);
    return true;
}

static bool second_stage(const struct compare_job *job, const struct compare_options *opt,
                         struct compared *out, struct err *e)
{
    struct pair again;
    struct comparison first = out->r, second = {0};
    if (!pair_read(job, job->again, job->memory_again, &again, &out->notes, e))
        return false;
    bool ok = check_fresh(job->again, out->m, &again, e) &&
              two_stage_confirm(&first, &again.in[0].m, &again.in[1].m, opt, &second, e);
    if (ok) {
        input_limit(&again.in[0], opt->tile, &second);
        comparison_free(&first);
        out->r = second;
        keep_pair(job->again, job->memory_again, &again, out);
    } else {
        pair_free(&again);
    }
    return ok;
}

static bool run_moments(const struct compare_job *job, struct compared *out, struct err *e)
{
    struct pair p;
    struct compare_options opt = job->opt;
    if (!pair_read(job, job->path, job->memory, &p, &out->notes, e))
        return false;
    opt.is_paired = p.is_of_renders;
    bool two = job->again[0] != NULL;
    /* Noise that was taken from A - B says nothing of itself, and what pixels share is in the variances. */
    double seen = variance_ratio_of_difference(&p.in[0].m, &p.in[1].m) *
                  fmax(1, fmax(p.in[0].sharing, p.in[1].sharing));
    if (seen < 1 && !p.in[0].is_guessed && !p.is_of_renders)
        input_notes_add(&out->notes,
                        "the sides are not independent, or state too much noise: A - B is %.2g of "
                        "what they state (root mean square). Same seeds? --paired judges them as "
                        "pairs",
                        sqrt(seen));
    bool ok = two ? two_stage_first(&p.in[0].m, &p.in[1].m, &opt, &out->r, e)
                  : compare_moments(&p.in[0].m, &p.in[1].m, &opt, &out->r, e);
    if (ok)
        input_limit(&p.in[0], opt.tile, &out->r);
    else
        variance_ratio_advise(&p.in[0].m, &p.in[1].m, "--paired judges them as pairs", e);
    keep_pair(job->path, job->memory, &p, out);
    if (ok && two && out->r.verdict != VERDICT_DIFFERENT)
        input_notes_add(&out->notes, "nothing was flagged: %s and %s were not needed",
                        job->again[0], job->again[1]);
    return ok && (!two || out->r.verdict != VERDICT_DIFFERENT || second_stage(job, &opt, out, e));
}

static bool same_image(const struct replicate_dir *r, const struct replicate_dir *s,
                       const char *dir, struct err *e)
{
    if (r->width != s->width || r->height != s->height)
        return err_set(e, "%s: is %d x %d pixels, the first render %d x %d", dir, s->width,
                       s->height, r->width, r->height);
    int i, j;
    return !replicate_dir_share(r, s, &i, &j) ||
           err_set(e, "%s: %s is also in the first render: a second stage needs fresh seeds", dir,
                   s->name != NULL ? s->name[j] : "one of it");
}

static bool permute_again(const struct compare_job *job, const struct replicate_dir first[2],
                          const struct permutation_options *stage, struct compared *out,
                          struct err *e)
{
    struct replicate_dir again[2] = {{0}};
    struct permutation found = out->perm;
    bool ok = true;
    for (int i = 0; ok && i < 2; i++)
        ok = renders_read(job->again[i], job->memory_again[i], &again[i], e) &&
             same_image(&first[i], &again[i], job->again[i], e);
    ok = ok && permutation_confirm(&found, &again[0], &again[1], stage, &out->perm, e);
    renders_free(job->memory_again[0], &again[0]);
    renders_free(job->memory_again[1], &again[1]);
    return ok;
}

/* The moments give the maps and intervals, the permutation decides. */
static bool run_exchangeable(const struct compare_job *job, struct compared *out, struct err *e)
{
    struct replicate_dir r[2] = {{0}};
    struct compare_options opt = job->opt;
    bool two = job->again[0] != NULL;
    struct permutation_options stage = {two ? two_stage_alpha(opt.alpha) : opt.alpha, job->min_side,
                                        opt.tile};
    bool ok = renders_read(job->path[0], job->memory[0], &r[0], e) &&
              renders_read(job->path[1], job->memory[1], &r[1], e);
    for (int i = 0; ok && i < 2; i++) {
        ok = replicate_dir_moments(&r[i], &out->m[i], e);
        out->path[i] = job->path[i];
    }
    ok = ok && permutation_test(&r[0], &r[1], &stage, &out->perm, e);
    ok = ok && compare_moments(&out->m[0], &out->m[1], &opt, &out->r, e);
    double mdb = out->perm.mdb, mdb_tile = out->perm.mdb_tile;
    if (ok && two && out->perm.verdict == VERDICT_DIFFERENT)
        ok = permute_again(job, r, &stage, out, e);
    if (ok) {
        out->r.verdict = out->perm.verdict;
        out->r.extra_factor = 1;
        out->r.mdb_global = mdb;
        out->r.mdb_tile = mdb_tile;
        snprintf(out->r.reason, sizeof out->r.reason, "%s", out->perm.reason);
        input_notes_add(
            &out->notes,
            "judged by permutation of %d and %d replicates, smallest p possible %.2g: exact "
            "if equal renderers make them from independent seeds; intervals are "
            "those of the moments",
            r[0].num, r[1].num, out->perm.smallest_p);
    }
    renders_free(job->memory[0], &r[0]);
    renders_free(job->memory[1], &r[1]);
    return ok;
}

void compare_job_free(struct compared *c)
{
    comparison_free(&c->r);
    moments_free(&c->m[0]);
    moments_free(&c->m[1]);
}

/* The sign flips decide; the verdict of the means is kept beside theirs, if the means can be compared. */
static bool run_same_program(const struct compare_job *job, struct compared *out, struct err *e)
{
    struct sign_flip_options opt = {job->opt.alpha, job->filter_width, job->opt.tile};
    struct err why;
    out->has_means = run_moments(job, out, &why);
    if (!out->has_means && err_is_of_memory(&why))
        return err_set(e, "%s", why.msg);
    if (!out->has_means) {
        compare_job_free(out);
        out->notes = (struct notes){0};
    }
    const struct moments *m =
        out->has_means && out->is_stated[0] && out->is_stated[1] ? out->m : NULL;
    if (!same_program_judge(job->path, job->memory, m, &opt, &out->flip, e))
        return false;
    out->mean_verdict = out->r.verdict;
    snprintf(out->mean_reason, sizeof out->mean_reason, "%s", out->r.reason);
    same_program_decide(&out->flip, job->opt.alpha, &out->r);
    if (out->has_means)
        input_notes_add(&out->notes, "the mean by itself: %s: %s", verdict_name(out->mean_verdict),
                        out->mean_reason);
    else
        input_notes_add(&out->notes, "the mean by itself was not judged: %s", why.msg);
    input_notes_add(&out->notes,
                    "judged by flips of %zu pixels: exact if A and B have seeds of their own, and "
                    "none of these pixels shares noise with another: filters wider than %d need "
                    "--filter-width, denoisers --exchangeable",
                    out->flip.num_pixels, job->filter_width > 1 ? job->filter_width : 1);
    return true;
}

/* NO DIFFERENCE FOUND, but with MDBs above those accepted: says so, and sets the factor of samples that would do. */
static void tell_accepted(const struct compare_job *job, struct comparison *r)
{
    const double *accept = job->accept_mdb;
    double over = fmax(r->mdb_global / accept[0], r->mdb_tile / accept[1]);
    size_t used = strlen(r->reason);
    snprintf(r->reason + used, sizeof r->reason - used,
             "; accepted is no more than %.3g %% and %.3g %%", 100 * accept[0], 100 * accept[1]);
    r->extra_factor = fmin(verdict_largest_factor, over * over);
}

bool compare_job_run(const struct compare_job *job, struct compared *out, struct err *e)
{
    *out = (struct compared){0};
    bool (*run)(const struct compare_job *, struct compared *, struct err *) =
        job->exchangeable   ? run_exchangeable
        : job->same_program ? run_same_program
                            : run_moments;
    bool ok = run(job, out, e);
    if (ok && (!job->same_program || out->has_means))
        ok = hint_add(&out->m[0], &out->m[1], job->opt.threads, &out->r, e);
    if (!ok)
        compare_job_free(out);
    else if (job->accept_mdb[0] > 0 && out->r.verdict == VERDICT_NOTHING_FOUND &&
             !compare_job_passes(job, out))
        tell_accepted(job, &out->r);
    return ok;
}

static json_t *notes_json(const struct notes *notes)
{
    json_t *lines = json_array();
    for (int i = 0; i < notes->num; i++)
        json_array_append_new(lines, json_string(notes->line[i]));
    return lines;
}

static json_t *permutation_json(const struct permutation *p)
{
    return json_pack("{s:f, s:f, s:i, s:b, s:i, s:f, s:f}", "p", p->p, "smallest_p", p->smallest_p,
                     "labellings", p->num_labellings, "exhaustive", p->is_exhaustive, "regions",
                     p->num_regions, "t", p->t, "mdb", p->mdb);
}

static json_t *same_program_json(const struct compared *c, int filter_width)
{
    const struct sign_flip *f = &c->flip;
    return json_pack("{s:f, s:s, s:f, s:f, s:I, s:I, s:i, s:{s:s, s:s}}", "log10_p", f->log10_p,
                     "score", sign_flip_score_name[f->score], "t", f->t, "larger", f->larger,
                     "num_tests", (json_int_t)f->num_tests, "pixels", (json_int_t)f->num_pixels,
                     "filter_width", filter_width, "mean", "verdict", verdict_name(c->mean_verdict),
                     "reason", c->mean_reason);
}

/* The file of a side for the report, which reads moments: of a side that is not a moments EXR they are written
 * beside the results. */
static bool side_file(const struct compared *c, int side, const char *json, struct path *out,
                      struct err *e)
{
    if (c->is_file[side])
        return realpath(c->path[side], out->s) != NULL ||
               err_set(e, "%s: its full path is not known", c->path[side]);
    *out = fs_path("%s.%c.exr", fs_base(json), "ab"[side]);
    return moments_write(fs_path("%s.%c.exr", json, "ab"[side]).s, &c->m[side], NULL, 0, e);
}

static struct claim_context context_of(const struct compare_job *job)
{
    return (struct claim_context){.a = job->name[0] != NULL ? job->name[0] : job->path[0],
                                  .b = job->name[1] != NULL ? job->name[1] : job->path[1],
                                  .expected = job->expected,
                                  .opt = job->opt,
                                  .accept_mdb = {job->accept_mdb[0], job->accept_mdb[1]}};
}

bool compare_job_passes(const struct compare_job *job, const struct compared *c)
{
    struct claim_context context = context_of(job);
    return claim_result_passes(&context, &c->r);
}

bool compare_job_write_json(const struct compare_job *job, const struct compared *c,
                            const char *path, int argc, char **argv, struct err *e)
{
    struct claim_context context = context_of(job);
    if (job->same_program && !c->has_means)
        return err_set(e, "%s: needs means that can be compared (see the note)", path);
    struct path side[2];
    const char *base = fs_base(path);
    json_t *root = claim_result_new_results(argc, argv, job->opt.alpha, e);
    if (root == NULL)
        return false;
    if (!fs_make_parent_dirs(path, e) ||
        !image_write_exr(fs_path("%s.z.exr", path).s, &c->r.z, e) ||
        !image_write_exr(fs_path("%s.relative.exr", path).s, &c->r.relative, e) ||
        !side_file(c, 0, path, &side[0], e) || !side_file(c, 1, path, &side[1], e)) {
        json_decref(root);
        return false;
    }
    json_t *claim = claim_result_judged(&context, &c->r);
    bool ok = claim != NULL;
    if (ok && !c->is_guessed)
        ok = claim_result_add_observations(claim, "a", &c->m[0]) &&
             claim_result_add_observations(claim, "b", &c->m[1]);
    if (ok && job->title != NULL)
        ok = json_object_set_new(claim, "title", json_string(job->title)) == 0;
    if (ok && c->notes.num > 0)
        ok = json_object_set_new(claim, "notes", notes_json(&c->notes)) == 0;
    if (ok && job->exchangeable)
        ok = json_object_set_new(claim, "permutation", permutation_json(&c->perm)) == 0;
    if (ok && job->same_program)
        ok = json_object_set_new(claim, "same_program", same_program_json(c, job->filter_width)) ==
             0;
    ok = ok && json_object_set_new(claim, "files",
                                   json_pack("{s:s, s:s, s:s+, s:s+}", "a", side[0].s, "b",
                                             side[1].s, "z", base, ".z.exr", "relative", base,
                                             ".relative.exr")) == 0;
    ok = ok && json_array_append(json_object_get(root, "claims"), claim) == 0;
    if (!ok)
        err_set(e, "%s: out of memory", path);
    ok = ok && json_write(path, root, e);
    json_decref(claim);
    json_decref(root);
    return ok;
}

bool compare_job_write_report(const struct compare_job *job, const struct compared *c,
                              const char *path, int argc, char **argv, struct err *e)
{
    struct err ignored = {0};
    struct temp_dir dir;
    if (!temp_dir_open(&dir, "compare", e))
        return false;
    const struct path results = fs_path("%s/results.json", dir.path);
    bool ok = compare_job_write_json(job, c, results.s, argc, argv, e) &&
              report_write(results.s, path, e);
    return temp_dir_close(&dir, ok ? e : &ignored) && ok;
}
