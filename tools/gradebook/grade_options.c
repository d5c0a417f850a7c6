#include "grade_options.h"

#include "renderer/base/cli.h"
#include "renderer/base/cli_rewrite.h"
#include "renderer/base/fs.h"
#include "tools/submission/submission.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The first word is the rubric, the others are submissions. */
static bool read_word(void *settings, const char *const v[4], struct err *e)
{
    struct grade_settings *s = settings;
    (void)e;
    if (s->rubric == NULL)
        s->rubric = v[0];
    else
        s->submission[s->num++] = v[0];
    return true;
}

#define TO(member) CLI_TO(struct grade_settings, member)

static const struct cli_option options[] = {
    {0, "check-rubric", "", "only check the rubric, and print each mistake with its line number",
     TO(only_check)},
    {0, "prepare", "", "only render the references, into DIR", TO(prepare)},
    {0, "fill-build-cache", "", "only build STARTER_CODE, to fill --build-cache", TO(fill)},
    {0, "build-cache", "DIR", "compiler cache (ccache) that the rubric's `build` reads",
     TO(build_cache)},
    {'o', "out", "DIR",
     "output directory for grades and pages; submissions already graded\n"
     "there are skipped (grades)",
     TO(out)},
    {'j', "jobs", "N", "submissions graded in parallel; 0: one per processor (1)", TO(jobs), 0, 64},
    {'t', "threads", "N", "number of threads of a program, {threads} in the rubric (1)",
     TO(threads), 1, 1024},
    {0, "seed", "N", "base seed from which each image's {seed} is derived (1)", TO(seed)},
    {0, "variant", "N",
     "which of the rubric's variants the class gets (drawn at random when\n"
     "the references are first made, then kept)",
     TO(variant), 1, 99},
    {0, "alpha", "A",
     "false-positive rate of a check: probability that a correct program\n"
     "loses points (1e-5)",
     TO(alpha), 1e-12, 0.1},
    {0, "again", "", "also regrade submissions already graded, and rerun their programs",
     TO(again)},
    {0, "before", "DIR",
     "grades of an earlier run (those in OUT): changes are listed, and\n"
     "programs are rerun only for images that the rubric now specifies\n"
     "differently",
     TO(before)},
    {0, "appeals", "FILE", "points set by staff, in lines of ID CHECK POINTS REASON", TO(appeals)},
    {0, "unsafe-no-sandbox", "",
     "run programs without a sandbox, able to read and write all that you\n"
     "can (as root: each under a separate user; what remains guaranteed:\n"
     "tools/docs/guide-course.md)",
     TO(unsafe)},
    {0, "pathtracer", "PROGRAM", "our renderer, for references (pathtracer beside this program)",
     TO(pathtracer)},
    {0, "golden", "DIR", "directory of stored references (golden)", TO(golden)},
    {0, "suite", "DIR", "directory of scenes (reference/scenes)", TO(suite)},
    {0, "references", "DIR",
     "where the rubric's references are kept (.references in OUT, or in\n"
     "--before DIR)",
     TO(references)},
    {0, "slurm", "", "run one job per submission on a Slurm cluster", TO(slurm)},
    {'q', "quiet", "", "print no line per submission", TO(quiet)},
    {'h', "help", "", "print this", TO(help), .stops = true},
    {.read = read_word}};

/* May OUT/ID be removed, to be made anew? Not if the submission is in it, nor if it is of somebody else. */
static bool check_place(const struct grade_settings *s, const char *submission, struct err *e)
{
    char id[128], place[PATH_MAX], from[PATH_MAX];
    submission_id(submission, id);
    const struct path out = fs_path("%s/%s", s->out, id);
    if (realpath(out.s, place) == NULL || realpath(submission, from) == NULL)
        return true;
    const size_t n = strlen(place);
    if (strncmp(from, place, n) == 0 && (from[n] == '\0' || from[n] == '/'))
        return err_set(e, "-o %s: the grade of %s would take its place: give another folder",
                       s->out, submission);
    return access(fs_path("%s/grade.json", out.s).s, F_OK) == 0 ||
           access(fs_path("%s/grades.json", s->out).s, F_OK) == 0 ||
           access(fs_path("%s/.references", s->out).s, F_OK) == 0 ||
           err_set(e, "%s is there already, and no grade: give -o another folder", out.s);
}

bool grade_options_parse(int argc, char **argv, struct grade_settings *s, struct err *e)
{
    if (!cli_read(options, argc, argv, s, e) || s->help)
        return s->help;
    if (s->before != NULL && access(s->before, R_OK | X_OK) != 0)
        return err_set(e, "--before %s: %s", s->before, strerror(errno));
    s->before = s->before != NULL ? s->before : s->out;
    s->jobs = s->jobs > 0 ? s->jobs : cli_processors();
    if (s->rubric == NULL)
        return err_set(e, "no rubric given (see --help)");
    if ((s->only_check || s->prepare) && s->num > 0)
        return err_set(e, "--%s takes no submissions", s->only_check ? "check-rubric" : "prepare");
    if (s->fill && (s->build_cache == NULL || s->num != 1))
        return err_set(e, "--fill-build-cache needs --build-cache DIR and the starter code");
    if (s->build_cache != NULL && !s->fill && access(s->build_cache, R_OK | X_OK) != 0)
        return err_set(e, "--build-cache %s: %s; --fill-build-cache makes it from the starter code",
                       s->build_cache, strerror(errno));
    for (int i = 0; i < s->num && !s->fill && !s->again; i++)
        if (!check_place(s, s->submission[i], e))
            return false;
    return s->only_check || s->prepare || s->num > 0 ||
           err_set(e, "no submission given (see --help)");
}

char **grade_options_words(int argc, char **argv, const struct grade_settings *s, int *num)
{
    static const struct option_words how[] = {
        {"-o", 1},           {"--out", 1},     {"-j", 1},       {"--jobs", 1},
        {"--references", 1}, {"--variant", 1}, {"--before", 1}, {"--slurm", 0},
        {"-q", 0},           {"--quiet", 0},   {"--again", 0},  {0}};
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

struct path grade_options_references(const struct grade_settings *s)
{
    return s->references != NULL ? fs_path("%s", s->references)
                                 : fs_path("%s/.references", s->before);
}

void grade_options_help(void)
{
    cli_print_help(
        "usage: assay grade [options] RUBRIC SUBMISSION...\n"
        "       assay grade --check-rubric RUBRIC\n"
        "       assay grade --prepare [-o DIR] RUBRIC\n"
        "       assay grade --fill-build-cache --build-cache DIR RUBRIC STARTER_CODE\n\n"
        "A submission is a directory of images, a program, or source code, which is built as the rubric\n"
        "says; also in an archive (.zip, .tar.gz).\n"
        "Programs run in a sandbox; where there is none, nothing is graded.\n",
        options);
    puts(
        "\nExit code: 0 all graded, 2 some need a look by staff, 3 could not grade (one line on stderr).");
}

struct grade_settings grade_options_default(int argc, struct data_dirs *at)
{
    *at = data_dirs_find();
    return (struct grade_settings){.out = "grades",
                                   .pathtracer = at->pathtracer.s,
                                   .jobs = 1,
                                   .threads = 1,
                                   .seed = 1,
                                   .alpha = 1e-5,
                                   .suite = at->suite.s,
                                   .golden = at->golden.s,
                                   .submission = calloc((size_t)argc + 1, sizeof(const char *))};
}
