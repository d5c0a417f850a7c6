#include "../renderer/cli.h"
#include "../renderer/fs.h"
#include "grade.h"
#include "grade_alike.h"
#include "places.h"
#include "results.h"
#include "verbs.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum option {
    OPT_CHECK_RUBRIC,
    OPT_PREPARE,
    OPT_OUT,
    OPT_JOBS,
    OPT_THREADS,
    OPT_SEED,
    OPT_ALPHA,
    OPT_AGAIN,
    OPT_UNSAFE,
    OPT_PATHTRACER,
    OPT_GOLDEN,
    OPT_SUITE,
    OPT_CATALOGUE,
    OPT_QUIET,
    OPT_HELP
};

static const struct cli_option options[] = {
    [OPT_CHECK_RUBRIC] = {0, "check-rubric", 0, "",
                          "name every mistake of the rubric with its line, and that is all"},
    [OPT_PREPARE] = {0, "prepare", 0, "", "make the references in DIR, and that is all"},
    [OPT_OUT] = {'o', "out", 1, "DIR",
                 "where grades and pages go (grades); what is there already is not done again"},
    [OPT_JOBS] = {'j', "jobs", 1, "N", "submissions at a time; 0: as many as processors (1)"},
    [OPT_THREADS] = {'t', "threads", 1, "N", "{threads} of a program (1)"},
    [OPT_SEED] = {0, "seed", 1, "N", "from which {seed} of each picture is made (1)"},
    [OPT_ALPHA] = {0, "alpha", 1, "A",
                   "chance of a check that a right program loses points (1e-5)"},
    [OPT_AGAIN] = {0, "again", 0, "", "grade also what has been graded"},
    [OPT_UNSAFE] = {0, "unsafe-no-sandbox", 0, "",
                    "run programs without a sandbox: they can read and write all that you can\n"
                    "(as root: that nobody can)"},
    [OPT_PATHTRACER] = {0, "pathtracer", 1, "PROGRAM",
                        "our renderer, for references (the one beside this program)"},
    [OPT_GOLDEN] = {0, "golden", 1, "DIR", "stored references (golden)"},
    [OPT_SUITE] = {0, "suite", 1, "DIR", "scenes (reference/scenes)"},
    [OPT_CATALOGUE] = {0, "catalogue", 1, "DIR", "the stored effects of bugs (golden/diagnose)"},
    [OPT_QUIET] = {'q', "quiet", 0, "", "no lines on submissions"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

struct settings {
    const char *rubric, *out, *pathtracer, *golden, *suite, *catalogue;
    const char **submission;
    int num, jobs, threads;
    uint64_t seed;
    double alpha;
    bool only_check, prepare, again, unsafe, quiet, help;
};

static bool parse(int argc, char **argv, struct settings *s, struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    bool ok = true;
    for (int i; ok && (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return false;
        const char *v = c.value[0];
        if (i == CLI_POSITIONAL) {
            if (s->rubric == NULL)
                s->rubric = v;
            else
                s->submission[s->num++] = v;
            continue;
        }
        switch ((enum option)i) {
        case OPT_CHECK_RUBRIC: s->only_check = true; break;
        case OPT_PREPARE: s->prepare = true; break;
        case OPT_OUT: s->out = v; break;
        case OPT_JOBS: ok = cli_int("--jobs", v, 0, 64, &s->jobs, e); break;
        case OPT_THREADS: ok = cli_int("--threads", v, 1, 1024, &s->threads, e); break;
        case OPT_SEED: ok = cli_uint64("--seed", v, &s->seed, e); break;
        case OPT_ALPHA: ok = cli_double("--alpha", v, 1e-12, 0.1, &s->alpha, e); break;
        case OPT_AGAIN: s->again = true; break;
        case OPT_UNSAFE: s->unsafe = true; break;
        case OPT_PATHTRACER: s->pathtracer = v; break;
        case OPT_GOLDEN: s->golden = v; break;
        case OPT_SUITE: s->suite = v; break;
        case OPT_CATALOGUE: s->catalogue = v; break;
        case OPT_QUIET: s->quiet = true; break;
        case OPT_HELP: s->help = true; break;
        }
    }
    if (!ok || s->help)
        return ok;
    if (s->rubric == NULL)
        return err_set(e, "no rubric given (see --help)");
    if ((s->only_check || s->prepare) && s->num > 0)
        return err_set(e, "--%s takes no submissions", s->only_check ? "check-rubric" : "prepare");
    return s->only_check || s->prepare || s->num > 0 ||
           err_set(e, "no submission given (see --help)");
}

static void print_help(void)
{
    puts(
        "usage: assay grade [options] RUBRIC SUBMISSION...\n"
        "       assay grade --check-rubric RUBRIC\n"
        "       assay grade --prepare [-o DIR] RUBRIC\n\n"
        "A submission is a directory of pictures, a program, or a source tree that the rubric says how to build.\n"
        "Programs run in a sandbox, without which nothing is graded.\n");
    cli_print_options(stdout, options);
    puts(
        "\nExit code: 0 all graded, 2 staff have to look at some, 3 could not grade (one line on stderr).");
}

static bool print_mistakes(const struct rubric *r, const struct rubric_mistakes *m, struct err *e)
{
    int kept = (int)(sizeof m->at / sizeof *m->at);
    for (int i = 0; i < m->num && i < kept; i++)
        printf("%s:%d: %s\n", r->path, m->at[i].line, m->at[i].text);
    if (m->num == 1)
        return err_set(e, "%s:%d: %s", r->path, m->at[0].line, m->at[0].text);
    return m->num == 0 || err_set(e, "%s: %d mistakes, the first in line %d: %s", r->path, m->num,
                                  m->at[0].line, m->at[0].text);
}

struct progress {
    int num;
    bool quiet;
};

static void tell(void *ctx, int num, const char *path, const json_t *grade)
{
    const struct progress *p = ctx;
    const char *trouble = json_string_value(json_object_get(grade, "trouble")),
               *wrong = json_string_value(json_object_get(grade, "wrong"));
    (void)path;
    if (p->quiet)
        return;
    printf("[%d/%d] %-32s ", num, p->num, json_string_value(json_object_get(grade, "id")));
    if (trouble != NULL)
        printf("NOT GRADED: %s\n", trouble);
    else
        printf("%6.2f of %g%s%s\n", member_number(grade, "points"), member_number(grade, "of"),
               wrong != NULL ? "  " : "", wrong != NULL ? wrong : "");
    fflush(stdout);
}

static bool needs_staff(const json_t *grades)
{
    size_t i, k;
    json_t *g, *c;
    json_array_foreach(grades, i, g)
    {
        if (json_is_string(json_object_get(g, "trouble")))
            return true;
        json_array_foreach(json_object_get(g, "checks"), k, c)
        {
            if (!json_is_true(json_object_get(c, "judged")))
                return true;
        }
    }
    return false;
}

static int run_batch(const struct settings *s, const struct rubric *r, const struct suite *suite,
                     const struct answers *answers, const struct sandbox *box, struct err *e)
{
    char stage[512], views[512];
    struct progress p = {s->num, s->quiet};
    struct grade_diagnosis diagnosis = {0};
    struct rubric_bugs *bugs = calloc(1, sizeof *bugs);
    struct grade_job job = {.rubric = r,
                            .answers = answers,
                            .sandbox = box,
                            .stage = stage,
                            .out = s->out,
                            .path = s->submission,
                            .num = s->num,
                            .jobs = s->jobs == 0 ? cli_processors() : s->jobs,
                            .threads = s->threads,
                            .alpha = s->alpha,
                            .seed = s->seed,
                            .again = s->again,
                            .done = tell,
                            .ctx = &p};
    json_t *grades = NULL;
    int code = EXIT_NOT_JUDGED;
    snprintf(stage, sizeof stage, "%.400s/stage", box->dir);
    snprintf(views, sizeof views, "%.400s/views", box->dir);
    bool ok = (bugs != NULL || err_set(e, "out of memory")) && submission_stage(r, stage, e);
    if (ok && r->bugs[0] != '\0') {
        ok = rubric_bugs_open(r, answers, bugs, e);
        job.bugs = bugs;
    }
    if (ok && r->diagnose[0] != '\0') {
        ok = diagnosis_open(r, s->catalogue, suite, views, &diagnosis, e);
        job.diagnosis = &diagnosis;
    }
    ok = ok && grade_all(&job, &grades, e) && grade_alike(s->out, r, answers, grades, e);
    if (ok && grade_write(s->out, grades, e) && grade_pages(s->out, grades, e))
        code = needs_staff(grades) ? EXIT_INCONCLUSIVE : EXIT_EQUIVALENT;
    json_decref(grades);
    diagnosis_close(&diagnosis);
    if (bugs != NULL)
        rubric_bugs_close(bugs);
    free(bugs);
    return code;
}

static int grade(const struct settings *s, const struct rubric *r, const struct suite *suite,
                 struct err *e)
{
    char cache[4400], pathtracer[PATH_MAX];
    struct answers *answers = calloc(1, sizeof *answers);
    struct sandbox box;
    int code = EXIT_NOT_JUDGED;
    if (answers == NULL) {
        err_set(e, "out of memory");
        return code;
    }
    if (realpath(s->pathtracer, pathtracer) == NULL)
        snprintf(pathtracer, sizeof pathtracer, "%s", s->pathtracer);
    snprintf(cache, sizeof cache, "%.4000s/.references", s->out);
    const struct answer_options opt = {.golden_dir = s->golden,
                                       .pathtracer = pathtracer,
                                       .cache = cache,
                                       .threads = cli_processors(),
                                       .timeout_s = 3600};
    if (s->prepare) {
        code = make_dirs(cache, e) && answers_make(r, &opt, answers, e) ? 0 : EXIT_NOT_JUDGED;
        if (code == 0)
            printf("references of %s: %s\n", r->path, cache);
    } else if (sandbox_open(s->unsafe, (const char *const[]){s->golden, s->suite, r->dir, NULL},
                            &box, e)) {
        if (make_dirs(cache, e) && answers_make(r, &opt, answers, e))
            code = run_batch(s, r, suite, answers, &box, e);
        sandbox_close(&box);
    } else if (!s->unsafe) {
        err_prefix(e, "programs are not run (--unsafe-no-sandbox)");
    }
    answers_free(answers);
    free(answers);
    return code;
}

int verb_grade(int argc, char **argv, struct err *e)
{
    char pathtracer[4096], suite_dir[4096], golden[4096], catalogue[4096];
    beside_program(pathtracer, sizeof pathtracer, "pathtracer");
    struct settings s = {
        .out = "grades",
        .pathtracer = pathtracer,
        .jobs = 1,
        .threads = 1,
        .seed = 1,
        .alpha = 1e-5,
        .suite = find_dir(suite_dir, sizeof suite_dir, "reference/scenes", "../share/assay/scenes"),
        .golden = find_dir(golden, sizeof golden, "golden", "../share/assay/golden"),
        .catalogue = find_dir(catalogue, sizeof catalogue, "golden/diagnose",
                              "../share/assay/golden/diagnose"),
        .submission = calloc((size_t)argc + 1, sizeof *s.submission)};
    struct suite suite = {0};
    struct rubric *r = calloc(1, sizeof *r);
    struct rubric_mistakes m;
    int code = EXIT_NOT_JUDGED;
    if (r == NULL || s.submission == NULL) {
        err_set(e, "out of memory");
    } else if (parse(argc, argv, &s, e)) {
        if (s.help) {
            print_help();
            code = 0;
        } else if (suite_load(s.suite, &suite, e) && rubric_read(s.rubric, &suite, r, &m, e) &&
                   print_mistakes(r, &m, e)) {
            if (s.only_check)
                printf("%s: %d checks in %d parts, %g points\n", r->path, r->num_checks,
                       r->num_parts, rubric_points(r));
            code = s.only_check ? 0 : grade(&s, r, &suite, e);
        }
    }
    suite_free(&suite);
    free(r);
    free(s.submission);
    return code;
}
