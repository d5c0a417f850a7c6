/* A grading batch as jobs: one for each submission. */
#define _GNU_SOURCE
#include "reference/base/process.h"
#include "renderer/base/fs.h"
#include "tools/gradebook/grade_options.h"
#include "job_kinds.h"
#include "tools/results/results.h"
#include "tools/submission/rubric_variant.h"
#include "tools/submission/submission.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Renders the references while planning, as all jobs need the same. */
static bool prepare(const struct grade_settings *s, const char *references, int argc, char **argv,
                    struct err *e)
{
    struct grade_settings only = *s;
    only.prepare = only.quiet = true;
    only.references = references;
    return grade_command(&only, argc, argv, e) == 0;
}

static bool beside_rubric(struct plan *p, const struct rubric *r, const char *name, struct err *e)
{
    const struct path path = fs_path("%s/%s", r->dir, name);
    return name[0] == '\0' || plan_input(p, path.s, e);
}

/* Adds the rubric and the files that it names as inputs. */
static bool rubric_inputs(struct plan *p, const struct grade_settings *s, const char *references,
                          struct err *e)
{
    struct suite suite = {0};
    struct rubric *r = calloc(1, sizeof *r);
    struct rubric_mistakes m;
    bool ok = (r != NULL || err_set(e, "out of memory")) && suite_load(s->suite, &suite, e) &&
              rubric_read(s->rubric, &suite, 0, r, &m, e) &&
              rubric_variant_read(references, &suite, s->variant, r, &m, e);
    if (ok && m.num > 0)
        ok = err_set(e, "%s:%d: %s", s->rubric, m.at[0].line, m.at[0].text);
    for (int i = 0; ok && i < r->num_images; i++) {
        const struct rubric_image *image = &r->image[i];
        ok = plan_input(p, rubric_scene(r, image).s, e) &&
             (image->suite == NULL ? beside_rubric(p, r, image->environment, e)
                                   : image->suite->environment[0] == '\0' ||
                                         plan_input(p, image->suite->environment, e));
    }
    ok = ok && (s->build_cache == NULL || plan_input(p, s->build_cache, e)) &&
         beside_rubric(p, r, r->bugs, e) && plan_input(p, s->rubric, e);
    suite_free(&suite);
    free(r);
    return ok;
}

static bool plan_jobs(const struct grade_settings *s, int argc, char **argv, struct plan *p,
                      struct err *e)
{
    int num = 0;
    char **words = grade_options_words(argc, argv, s, &num);
    bool ok = words != NULL || err_set(e, "out of memory");
    const struct path assay = fs_beside_program("assay");
    ok = ok && plan_begin(p, s->out, "grades.json", s->threads, e);
    const struct path references = fs_path("%s/references", p->dir);
    const char *const first[] = {assay.s, "grade",        "-q",        "-o",
                                 "{out}", "--references", references.s};
    ok = ok && prepare(s, references.s, argc, argv, e) &&
         plan_run_words(p, first, sizeof first / sizeof *first, false, e) &&
         plan_run_words(p, (const char *const *)words + 1, num - 1, true, e) &&
         plan_run_words(p, &(const char *){"{job}"}, 1, false, e) &&
         plan_input(p, references.s, e) && plan_input(p, s->pathtracer, e) &&
         rubric_inputs(p, s, references.s, e);
    plan_may_end(p, EXIT_INCONCLUSIVE); /* staff have to look */
    plan_may_end(p, EXIT_NOT_JUDGED);   /* what fails on a node, gather grades again */
    for (int k = 0; ok && k < s->num; k++)
        ok = plan_job(p, &s->submission[k], 1, (const char *const[]){s->submission[k], NULL}, e);
    free(words);
    return ok;
}

bool job_grade_plan(int argc, char **argv, const struct plan_wishes *w, struct plan *p,
                    struct err *e)
{
    struct data_dirs at;
    struct grade_settings s = grade_options_default(argc, &at);
    (void)w; /* a job for each submission */
    bool ok = s.submission != NULL || err_set(e, "out of memory");
    ok = ok && grade_options_parse(argc, argv, &s, e);
    if (ok && (s.help || s.only_check || s.prepare || s.fill || s.again))
        ok = err_set(
            e,
            "--help, --check-rubric, --prepare, --fill-build-cache and --again cannot be planned");
    ok = ok && plan_jobs(&s, argc, argv, p, e);
    free(s.submission);
    return ok;
}

/* Copies what a job left to OUT/ID, which appears by rename. A job that could not grade has left nothing; gather
 * grades that submission again. */
static bool place(const struct plan *p, int k, const char *out, const char *submission,
                  struct err *e)
{
    char id[128];
    submission_id(submission, id);
    const struct path from = job_run_artefact(p, k, id);
    const struct path to = fs_path("%s/%s", out, id);
    const struct path temp = fs_path("%s/.%s.tmp%ld", out, id, (long)getpid());
    if (!job_run_verify(p, k, e))
        return false;
    if (access(from.s, F_OK) != 0)
        return true;
    const char *const copy[] = {"cp", "-a", "--", from.s, temp.s, NULL};
    const struct process process = {.argv = copy};
    return fs_remove_tree(temp.s, e) && process_run(&process, NULL, e) && fs_remove_tree(to.s, e) &&
           (rename(temp.s, to.s) == 0 ||
            err_set(e, "%s: cannot appear: %s", to.s, strerror(errno)));
}

/* Puts each result where a batch here would have left it; grade_command() then finds all of them done. */
int job_grade_gather(const struct plan *p, int argc, char **argv, struct err *e)
{
    struct data_dirs at;
    struct grade_settings s = grade_options_default(argc, &at);
    bool ok = s.submission != NULL || err_set(e, "out of memory");
    ok = ok && grade_options_parse(argc, argv, &s, e) && fs_make_dirs(s.out, e);
    for (int k = 0; ok && k < p->num; k++)
        ok = place(p, k, s.out, s.submission[k], e);
    const struct path references = fs_path("%s/references", p->dir);
    if (s.references == NULL)
        s.references = references.s;
    int code = ok ? grade_command(&s, argc, argv, e) : EXIT_NOT_JUDGED;
    free(s.submission);
    return code;
}
