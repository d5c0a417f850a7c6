/* assay plan, run-job, gather and slurm: a command cut into jobs (plan.h). */
#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "tools/jobs/plan.h"
#include "tools/results/results.h"
#include "tools/jobs/slurm.h"
#include "commands.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct words {
    const char *dir;
    struct plan_wishes wish;
    int first; /* argv[first]: the command that is planned */
    bool help;
};

static const char *const by[] = {"scene", "claim", NULL};

#define TO(member) CLI_TO(struct words, member)

static const struct cli_option options[] = {
    {0, "plan", "DIR", "directory of the plan and its jobs (OUTPUT.plan)", TO(dir)},
    {0, "parts", "N",
     "approximate number of cells of a render, or number of jobs for\n"
     "references (64)",
     TO(wish.parts), 1, 1000000},
    {0, "ranges", "R",
     "for a render: split each cell into R sample ranges, one job each; at\n"
     "most one per sample. The image then equals a single render up to\n"
     "rounding, and its bits depend only on R, not on cells or job order.\n"
     "Not with --adaptive or --keep-state (1)",
     TO(wish.ranges), 1, 1000000},
    {0, "by", "WHAT",
     "for a validation: scene, one job per scene, whose claims share its\n"
     "renders; or claim, one job per claim, each of which renders what it\n"
     "needs itself (scene)",
     TO(wish.by), PLAN_BY_SCENE, .names = by},
    {'h', "help", "", "print this", TO(help), .stops = true},
    {CLI_TO_REST(struct words, first)}};
static const struct cli_option only_help[] = {
    {'h', "help", "", "print this", TO(help), .stops = true}, {CLI_TO_REST(struct words, first)}};

static void print_help(const char *verb, const char *what)
{
    printf("usage: assay %s [options] pathtracer|grade|validate|reference ARGUMENT...\n\n", verb);
    cli_print_help(what, options);
}

int command_plan(int argc, char **argv, struct err *e)
{
    struct words w = {.first = argc};
    struct plan p;
    if (!cli_read(options, argc, argv, &w, e))
        return EXIT_NOT_JUDGED;
    if (w.help) {
        print_help(
            "plan",
            "Splits the command into jobs, writes DIR/plan.jsonl and prints it: a header line, then one line\n"
            "per job. `assay run-job DIR K...` runs jobs, `assay gather DIR` combines their results into the\n"
            "output of the command.\n");
        return 0;
    }
    if (!plan_make(w.dir, argc - w.first, argv + w.first, &w.wish, &p, e))
        return EXIT_NOT_JUDGED;
    json_dumpf(p.head, stdout, JSON_COMPACT);
    for (int k = 0; k < p.num; k++)
        printf("\n%s", p.line[k]);
    putchar('\n');
    plan_free(&p);
    return 0;
}

/* Reads the plan and changes to its cwd. False: *code is the exit code, after --help or with a line. */
static bool open_plan(int argc, char **argv, const char *help, struct plan *p, int *code,
                      struct err *e)
{
    struct words w = {.first = argc};
    *code = EXIT_NOT_JUDGED;
    if (!cli_read(only_help, argc, argv, &w, e))
        return false;
    if (w.help) {
        puts(help);
        *code = 0;
        return false;
    }
    if (w.first == argc)
        return err_set(e, "%s needs a plan (see --help)", argv[0]);
    if (!plan_read(argv[w.first], p, e))
        return false;
    if (plan_enter(p, e))
        return true;
    plan_free(p);
    return false;
}

int command_run_job(int argc, char **argv, struct err *e)
{
    struct plan p;
    int code, failed = 0;
    if (!open_plan(
            argc, argv,
            "usage: assay run-job PLAN K...\n\n"
            "Runs the jobs K... of a plan, numbered from 0. Jobs with an intact result are not run again.",
            &p, &code, e))
        return code;
    for (int i = 2; i < argc && failed == 0; i++) {
        int k;
        failed = !cli_int("run-job", argv[i], 0, p.num - 1, &k, e);
    }
    if (argc < 3)
        failed = !err_set(e, "run-job needs the number of a job (see --help)");
    /* The jobs after one that fails are still run. */
    for (int i = 2; i < argc && e->msg[0] == '\0'; i++) {
        struct err why = {""};
        bool made;
        int k = (int)strtol(argv[i], NULL, 10);
        printf("job %d: begins\n", k);
        fflush(stdout);
        bool ok = job_run(&p, k, &made, &why);
        printf("job %d: %s\n", k, !ok ? why.msg : made ? "made" : "was there");
        fflush(stdout);
        failed += !ok;
        if (!ok && i == argc - 1)
            *e = why;
    }
    if (failed > 0 && e->msg[0] == '\0')
        err_set(e, "%d of %d jobs failed, see above", failed, argc - 2);
    plan_free(&p);
    return failed > 0 ? EXIT_NOT_JUDGED : 0;
}

int command_gather(int argc, char **argv, struct err *e)
{
    struct plan p;
    int code;
    if (!open_plan(
            argc, argv,
            "usage: assay gather PLAN\n\n"
            "Combines the results of a plan's jobs into the output of its command, and returns that\n"
            "command's exit code.",
            &p, &code, e))
        return code;
    if (argc > 2)
        err_set(e, "gather takes one plan");
    else
        code = plan_gather(&p, e);
    plan_free(&p);
    return code;
}

int command_slurm_run(const char *dir, int argc, char **argv, const struct plan_wishes *w,
                      struct err *e)
{
    static const struct plan_wishes none = {0};
    struct plan p;
    struct err ignored;
    if (!plan_make(dir, argc, argv, w != NULL ? w : &none, &p, e))
        return EXIT_NOT_JUDGED;
    int code = EXIT_NOT_JUDGED;
    bool ok = slurm_make(&p, e);
    if (ok)
        code = plan_gather(&p, e);
    /* Once all is gathered, a plan directory of our own is removed; one that the user named is kept. */
    if (ok && dir == NULL && e->msg[0] == '\0' && !fs_remove_tree(p.dir, &ignored))
        fprintf(stderr, "assay: note: %s\n", ignored.msg);
    plan_free(&p);
    return code;
}

int command_slurm(int argc, char **argv, struct err *e)
{
    struct words w = {.first = argc};
    if (!cli_read(options, argc, argv, &w, e))
        return EXIT_NOT_JUDGED;
    if (w.help) {
        print_help(
            "slurm",
            "Plans the command, runs its jobs as job arrays on a Slurm cluster whose nodes see the same\n"
            "files, resubmits lost jobs, and gathers the results. Set partition and time limit by the\n"
            "environment variables of sbatch (SBATCH_...). After an interruption, run the same command\n"
            "again to continue.\n");
        return 0;
    }
    return command_slurm_run(w.dir, argc - w.first, argv + w.first, &w.wish, e);
}
