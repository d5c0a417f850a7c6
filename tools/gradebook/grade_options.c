#include "grade_options.h"

#include "renderer/base/cli.h"
#include "renderer/base/cli_rewrite.h"
#include "renderer/base/fs.h"
#include "tools/base/data_dirs.h"

#include <stdio.h>
#include <stdlib.h>

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
    OPT_REFERENCES,
    OPT_SLURM,
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
    [OPT_REFERENCES] = {0, "references", 1, "DIR",
                        "where the references are kept (OUT/.references)"},
    [OPT_SLURM] = {0, "slurm", 0, "", "a job for each submission on a Slurm cluster"},
    [OPT_QUIET] = {'q', "quiet", 0, "", "no lines on submissions"},
    [OPT_HELP] = {'h', "help", 0, "", "print this"},
    {0}};

bool grade_options_parse(int argc, char **argv, struct grade_settings *s, struct err *e)
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
        case OPT_REFERENCES: s->references = v; break;
        case OPT_SLURM: s->slurm = true; break;
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

char **grade_options_words(int argc, char **argv, const struct grade_settings *s, int *num)
{
    static const struct option_words how[] = {
        {"-o", 1},      {"--out", 1}, {"-j", 1},      {"--jobs", 1},  {"--references", 1},
        {"--slurm", 0}, {"-q", 0},    {"--quiet", 0}, {"--again", 0}, {0}};
    char **word = cli_apart(options, argc, argv);
    if (word == NULL)
        return NULL;
    int all = 0;
    while (word[all] != NULL)
        all++;
    all = cli_rewrite_kept(how, all, word, word);
    *num = 0;
    for (int i = 0; i < all; i++) {
        bool is_submission = false;
        for (int k = 0; k < s->num; k++)
            is_submission = is_submission || s->submission[k] == word[i];
        if (!is_submission)
            word[(*num)++] = word[i];
    }
    word[*num] = NULL;
    return word;
}

void grade_options_help(void)
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

struct grade_settings grade_options_default(int argc, struct grade_paths *at)
{
    fs_beside_program(at->pathtracer, sizeof at->pathtracer, "pathtracer");
    return (struct grade_settings){
        .out = "grades",
        .pathtracer = at->pathtracer,
        .jobs = 1,
        .threads = 1,
        .seed = 1,
        .alpha = 1e-5,
        .suite = data_dir(at->suite, sizeof at->suite, "reference/scenes", "../share/assay/scenes"),
        .golden = data_dir(at->golden, sizeof at->golden, "golden", "../share/assay/golden"),
        .catalogue = data_dir(at->catalogue, sizeof at->catalogue, "golden/diagnose",
                              "../share/assay/golden/diagnose"),
        .submission = calloc((size_t)argc + 1, sizeof(const char *))};
}
