/* What `assay grade` does with its options: sandbox, caches, one submission or a whole class. */
#include "grade_options.h"

#include "renderer/base/cli.h"
#include "renderer/image/image_oiio.h"
#include "reference/base/process.h"
#include "renderer/base/fs.h"
#include "tools/results/results.h"
#include "tools/base/data_dirs.h"
#include "tools/base/text_table.h"
#include "tools/base/dir_lock.h"
#include "tools/submission/rubric_variant.h"
#include "grade_batch.h"
#include "grade_change.h"
#include "grade_needs.h"
#include "same_noise.h"

#include <dirent.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Copies a compiler cache between --build-cache DIR, which may be private to staff, and the copy
 * that builds see. */
static bool copy_cache(const char *from, const char *to, const char *mode, struct err *e)
{
    const struct process p = {
        .argv = (const char *const[]){
            "sh", "-c",
            "cp -R -- \"$1/.\" \"$2\" && rm -f \"$2/build.log\" && chmod -R \"$3\" \"$2\"", "sh",
            from, to, mode, NULL}};
    return fs_make_dirs(to, e) && process_run(&p, NULL, e);
}

/* Builds the starter code as submissions are built, so that they need only compile what differs. */
static bool fill_cache(const struct grade_settings *s, const struct rubric *r,
                       const struct sandbox *box, struct err *e)
{
    const struct path work = fs_path("%s/work", box->dir.path),
                      cache = fs_path("%s/cache", box->dir.path),
                      log = fs_path("%s/build.log", s->build_cache);
    struct submission skeleton;
    if (!submission_open(r, s->submission[0], work.s, &skeleton, e) ||
        !fs_make_dirs(s->build_cache, e) || !copy_cache(s->build_cache, cache.s, "a+rwX", e) ||
        !submission_build(r, box, cache.s, true, work.s, log.s, &skeleton, e))
        return false;
    if (skeleton.kind != SUBMISSION_SOURCE)
        return err_set(e, "%s: nothing is built of it by %s", s->submission[0], r->path);
    if (skeleton.state != SUBMISSION_GRADED)
        return err_set(e, "%s: %s (%s)", s->submission[0], skeleton.why, log.s);
    if (rmdir(cache.s) == 0)
        return err_set(
            e,
            "%s: the build left nothing in the cache: is ccache installed, and are objects compiled with -c?",
            r->path);
    if (!copy_cache(cache.s, s->build_cache, "u+w,a+rX", e))
        return false;
    if (!s->quiet)
        printf("%s: filled by building %s\n", s->build_cache, s->submission[0]);
    return true;
}

static bool print_mistakes(const struct rubric *r, const struct rubric_mistakes *m, struct err *e)
{
    int kept = (int)(sizeof m->at / sizeof *m->at);
    if (r->old_word_line > 0)
        fprintf(stderr, "%s:%d: 'picture' is called 'image' now; this version still reads it\n",
                r->path, r->old_word_line);
    for (int i = 0; i < m->num && i < kept; i++)
        printf("%s:%d: %s\n", r->path, m->at[i].line, m->at[i].text);
    if (m->num == 1)
        return err_set(e, "%s:%d: %s", r->path, m->at[0].line, m->at[0].text);
    return m->num == 0 || err_set(e, "%s: %d mistakes, the first in line %d: %s", r->path, m->num,
                                  m->at[0].line, m->at[0].text);
}

static void tell(const struct grade_settings *s, int num, const json_t *grade)
{
    const char *trouble = member_text(grade, "trouble"), *wrong = member_text(grade, "wrong");
    char change[1024];
    grade_change_text(grade, change, sizeof change);
    if (s->quiet)
        return;
    const char *id = member_text(grade, "id");
    const int width = (int)text_table_width(id);
    printf("[%d/%d] %s%*s ", num, s->num, id, width < 32 ? 32 - width : 0, "");
    if (trouble != NULL)
        printf("NOT GRADED: %s\n", trouble);
    else
        printf("%6.2f of %g%s%s%s%s\n", member_number(grade, "points"), member_number(grade, "of"),
               wrong != NULL ? "  " : "", wrong != NULL ? wrong : "", change[0] != '\0' ? "  " : "",
               change);
    fflush(stdout);
}

/* How many submissions we failed to grade; *e: the line of the first. */
static size_t in_trouble(const json_t *grades, struct err *e)
{
    size_t num = 0;
    json_each(g, grades) {
        const char *why = json_string_value(json_object_get(g, "trouble"));
        if (why != NULL && num++ == 0)
            err_set(e, "%s: %s", member_or_empty(g, "id"), why);
    }
    return num;
}

/* How many submissions need staff. */
static size_t need_staff(const json_t *grades)
{
    size_t num = 0;
    json_each(g, grades) {
        char text[8];
        num += grade_needs(g, text, sizeof text);
    }
    return num;
}

/* Warns of appeals for unknown submissions: a typo, perhaps, but a class may also be graded in
 * pieces. */
static void warn_of_strangers(const char *file, const struct appeals *a, const json_t *grades)
{
    for (int i = 0; i < a->num; i++) {
        bool known = false;
        json_each(g, grades)
            known = known || strcmp(member_or_empty(g, "id"), a->of[i].id) == 0;
        if (!known)
            fprintf(stderr, "%s:%d: there is no submission '%s' here\n", file, a->of[i].line,
                    a->of[i].id);
    }
}

/* Points that staff gave before are gone if a file of appeals is not named again. */
static void warn_of_withdrawn(const json_t *grades)
{
    const json_t *of = NULL, *first = NULL;
    int num = 0;
    json_each(g, grades) {
        json_each(c, json_object_get(json_object_get(g, "before"), "checks")) {
            if (member_text(c, "appeal") == NULL)
                continue;
            if (num++ == 0) {
                of = g;
                first = c;
            }
        }
    }
    if (num > 0)
        fprintf(
            stderr,
            "%d decision%s of staff no longer appl%s, '%s' %s first, %.2f points: name the file with --appeals each time\n",
            num, num > 1 ? "s" : "", num > 1 ? "y" : "ies", member_or_empty(of, "id"),
            member_or_empty(first, "name"), member_number(first, "was"));
}

/* Says which submissions have been graded into that directory before and are not in its list now: a class of which one
 * was graded again would look as if it had one member. */
static void warn_of_others(const char *out, const json_t *grades)
{
    char first[256] = "";
    int num = 0;
    DIR *d = opendir(out);
    for (const struct dirent *in; d != NULL && (in = readdir(d)) != NULL;) {
        bool listed = in->d_name[0] == '.' ||
                      access(fs_path("%s/%s/grade.json", out, in->d_name).s, R_OK) != 0;
        json_each(g, grades)
            listed = listed || strcmp(member_or_empty(g, "id"), in->d_name) == 0;
        if (!listed && (num++ == 0 || strcmp(in->d_name, first) < 0))
            snprintf(first, sizeof first, "%s", in->d_name);
    }
    if (d != NULL)
        closedir(d);
    if (num > 0)
        fprintf(
            stderr,
            "%s: its pages and grades.csv now list %zu; %d graded before, '%s' first, are not among them: name "
            "them too, they are not run again, or give another -o\n",
            out, json_array_size(grades), num, first);
}

static int run_batch(const struct grade_settings *s, const struct rubric *r,
                     const struct answer_key *answers, const char *const *word,
                     const struct sandbox *box, struct err *e)
{
    char stage[sizeof box->dir.path + 16];
    const struct path cache = fs_path("%s/cache", box->dir.path);
    struct rubric_bugs *bugs = calloc(1, sizeof *bugs);
    struct appeals appeals = {0};
    struct grade_job job = {.rubric = r,
                            .answers = answers,
                            .sandbox = box,
                            .stage = stage,
                            .build_cache = s->build_cache != NULL ? cache.s : NULL,
                            .word = word,
                            .s = s,
                            .appeals = &appeals,
                            .done = tell};
    json_t *grades = NULL;
    int code = EXIT_NOT_JUDGED;
    snprintf(stage, sizeof stage, "%s/stage", box->dir.path);
    bool ok = (bugs != NULL || err_set(e, "out of memory")) &&
              (s->appeals == NULL || appeals_read(s->appeals, r, &appeals, e)) &&
              submission_stage(r, stage, e) &&
              (s->build_cache == NULL || copy_cache(s->build_cache, cache.s, "u+w,a+rX", e));
    if (ok && r->bugs[0] != '\0') {
        ok = rubric_bugs_open(r, answers, bugs, e);
        job.bugs = bugs;
    }
    ok = ok && grade_batch_run(&job, &grades, e) && same_noise(s->out, r, answers, grades, e);
    if (ok)
        warn_of_strangers(s->appeals, &appeals, grades);
    if (ok && s->appeals == NULL)
        warn_of_withdrawn(grades);
    if (ok && grade_write(s->out, r, answers, grades, e)) {
        warn_of_others(s->out, grades);
        size_t need = need_staff(grades), lost = in_trouble(grades, e);
        code = need > 0 ? EXIT_INCONCLUSIVE : EXIT_EQUIVALENT;
        if (lost > 0) {
            code = EXIT_NOT_JUDGED;
            err_prefix(e, "%zu of %d could not be graded, no points are lost; the first", lost,
                       s->num);
        }
        if (need > 0 && !s->quiet)
            printf("%zu of %d need you: %s/index.html\n", need, s->num, s->out);
    }
    json_decref(grades);
    appeals_free(&appeals);
    if (bugs != NULL)
        rubric_bugs_close(bugs);
    free(bugs);
    return code;
}

/* Opens the sandbox, with all hidden that no program may see. */
static bool open_box(const struct grade_settings *s, const struct rubric *r, const char *cache,
                     const char *pathtracer, struct sandbox *box, struct err *e)
{
    const struct data_dirs at = data_dirs_find();
    const char *const ours[] = {at.share.s, s->golden, s->suite,  r->dir,
                                cache,      s->out,    s->before, pathtracer};
    enum { NUM = sizeof ours / sizeof *ours };
    const char **hidden = calloc((size_t)(NUM + s->num) + 1, sizeof *hidden);
    if (hidden == NULL)
        return err_set(e, "out of memory");
    memcpy(hidden, ours, sizeof ours);
    memcpy(hidden + NUM, s->submission, (size_t)s->num * sizeof *hidden);
    bool ok = (s->fill || (fs_make_dirs(s->out, e) && fs_make_dirs(cache, e))) &&
              sandbox_open(s->unsafe, hidden, box, e);
    free(hidden);
    return ok;
}

static int grade(const struct grade_settings *s, const struct rubric *r, int argc, char **argv,
                 struct err *e)
{
    char pathtracer[PATH_MAX];
    const struct path cache = grade_options_references(s);
    /* Without OpenImageIO every image would be reported as unreadable. */
    if (image_oiio_version(e) == NULL)
        return EXIT_NOT_JUDGED;
    struct answer_key *answers = calloc(1, sizeof *answers);
    struct sandbox box;
    int code = EXIT_NOT_JUDGED;
    if (answers == NULL) {
        err_set(e, "out of memory");
        return code;
    }
    if (realpath(s->pathtracer, pathtracer) == NULL)
        snprintf(pathtracer, sizeof pathtracer, "%s", s->pathtracer);
    const struct answer_options opt = {.golden_dir = s->golden,
                                       .pathtracer = pathtracer,
                                       .cache = cache.s,
                                       .threads = cli_processors(),
                                       .timeout_s = 3600};
    if (s->prepare) {
        code =
            fs_make_dirs(cache.s, e) && answer_key_make(r, &opt, answers, e) ? 0 : EXIT_NOT_JUDGED;
        if (code == 0 && !s->quiet)
            printf("references of %s: %s\n", r->path, cache.s);
    } else if (open_box(s, r, cache.s, pathtracer, &box, e)) {
        int num;
        char **word = grade_options_words(argc, argv, s, &num);
        bool ok = word != NULL || err_set(e, "out of memory");
        if (ok && s->fill)
            code = fill_cache(s, r, &box, e) ? 0 : EXIT_NOT_JUDGED;
        else if (ok && fs_make_dirs(cache.s, e) && answer_key_make(r, &opt, answers, e))
            code = run_batch(s, r, answers, (const char *const *)word, &box, e);
        free(word);
        sandbox_close(&box);
    } else if (!s->unsafe) {
        err_prefix(e, "programs are not run (--unsafe-no-sandbox)");
    }
    answer_key_free(answers);
    free(answers);
    return code;
}

/* What is allowed and may still be a mistake: 'after' an image of another scene, whose mistakes are then not charged
 * again. */
static void print_notes(const struct rubric *r)
{
    for (int i = 0; i < r->num_checks; i++) {
        const struct rubric_check *c = &r->check[i];
        if (c->after >= 0 && strcmp(r->image[c->after].scene, r->image[c->images[0]].scene) != 0)
            fprintf(
                stderr,
                "%s:%d: note: 'after %s' is an image of another scene than check '%s'; right only if "
                "it shows the same mistakes\n",
                r->path, rubric_line_of(c->lines, "after", c->line), r->image[c->after].name,
                c->name);
    }
}

/* Checks the rubric's other variants, too, and says what it holds. */
static int check_rubric(const struct grade_settings *s, const struct suite *suite, struct rubric *r,
                        struct err *e)
{
    struct rubric_mistakes m;
    for (int variant = 2; variant <= r->variants; variant++)
        if (!rubric_read(s->rubric, suite, variant, r, &m, e) || !print_mistakes(r, &m, e))
            return err_prefix(e, "variant %d", variant), EXIT_NOT_JUDGED;
    print_notes(r);
    char variants[32] = "";
    if (r->variants > 0)
        snprintf(variants, sizeof variants, ", %d variants", r->variants);
    printf("%s: %d checks in %d parts, %g points%s\n", r->path, r->num_checks, r->num_parts,
           rubric_points(r), variants);
    return 0;
}

int grade_command(const struct grade_settings *s, int argc, char **argv, struct err *e)
{
    struct suite suite = {0};
    struct rubric *r = calloc(1, sizeof *r);
    struct rubric_mistakes m;
    struct dir_lock lock = {0};
    int code = EXIT_NOT_JUDGED;
    if (r == NULL) {
        err_set(e, "out of memory");
    } else if (suite_load(s->suite, &suite, e) && rubric_read(s->rubric, &suite, 0, r, &m, e) &&
               print_mistakes(r, &m, e)) {
        if (s->only_check)
            code = check_rubric(s, &suite, r, e);
        else if (s->fill || /* which writes elsewhere, and needs no images */
                 (dir_lock_take(&lock, s->out, e) &&
                  rubric_variant_read(grade_options_references(s).s, &suite, s->variant, r, &m,
                                      e) &&
                  print_mistakes(r, &m, e)))
            code = grade(s, r, argc, argv, e);
        dir_lock_release(&lock);
    }
    suite_free(&suite);
    free(r);
    return code;
}
