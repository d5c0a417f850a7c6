/* assay golden render | status | compare | approve: from rendering a reference to storing it. */
#include "reference/suite/suite_own.h"
#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "renderer/base/shell_quote.h"
#include "tools/base/data_dirs.h"
#include "tools/golden/approve.h"
#include "tools/golden/noise_record.h"
#include "tools/validate/noise_ladder.h"
#include "tools/results/results.h"
#include "commands.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_NAMES = 256 };

struct settings {
    const char *suite_dir, *names[MAX_NAMES];
    int num_names;
    struct approve_options opt; /* alpha: of the run */
    bool all, help;
};

#define TO(member) CLI_TO(struct settings, member)

static const struct cli_option options[] = {
    {0, "all", "",
     "approve all references of the suite (or of the names given), except\n"
     "those that are up to date and have no candidate",
     TO(all)},
    {0, "from", "DIR", "directory of candidates (build/golden-candidate)", TO(opt.from_dir)},
    {0, "golden", "DIR",
     "directory of stored references (golden; with a suite.json, golden\n"
     "beside it)",
     TO(opt.golden_dir)},
    {0, "suite", "DIR",
     "directory of scenes (current directory if it has a suite.json, else\n"
     "reference/scenes)",
     TO(suite_dir)},
    {0, "new", "",
     "also approve candidates for which no reference is stored; without\n"
     "--all and names, only those: what is stored stays",
     TO(opt.accept_new)},
    {0, "accept-difference", "WHY",
     "also approve candidates that are DIFFERENT, or INCONCLUSIVE with at least\n"
     "1.25 times the samples of what is stored; the manifest records WHY",
     TO(opt.why)},
    {0, "alpha", "A", "probability of any wrong verdict in this run (1e-3)", TO(opt.alpha), 1e-12,
     0.4},
    {'h', "help", "", "print this", TO(help),
     .usage =
         "usage: assay golden render [options]          renders candidates (see assay golden render --help)\n"
         "       assay golden status [options]          lists stored references and their problems\n"
         "       assay golden compare [options] [SCENE | SCENE/ENGINE] ...  candidates with stored references\n"
         "       assay golden approve [options] --new           stores what is new\n"
         "       assay golden approve [options] [--all] [SCENE | SCENE/ENGINE | SCENE/noise] ...\n"
         "                            compares candidates with what is stored, and stores them in its place\n"},
    {.noun = "names", CLI_TO_LIST(struct settings, names, num_names)}};

/* Reference i of those of the suite that an engine renders, over all scenes, and its scene; NULL past the last. */
static const struct suite_reference *rendered_reference(const struct suite *suite, int i,
                                                        const struct suite_scene **scene)
{
    for (int s = 0; s < suite->num_scenes; s++) {
        *scene = &suite->scene[s];
        for (int k = 0; k < (*scene)->num_references; k++)
            if (strcmp((*scene)->references_of, (*scene)->name) == 0 &&
                reference_is_rendered(&(*scene)->reference[k]) && i-- == 0)
                return &(*scene)->reference[k];
    }
    return NULL;
}

/* Is the name "SCENE" or "SCENE/WHAT", WHAT being an engine or "noise"? */
static bool is_named(const char *name, const struct suite_scene *scene, const char *what)
{
    size_t n = strlen(scene->name);
    return strncmp(name, scene->name, n) == 0 &&
           (name[n] == '\0' || (name[n] == '/' && strcmp(name + n + 1, what) == 0));
}

static bool is_selected(const struct settings *s, const struct suite_scene *scene, const char *what)
{
    for (int i = 0; i < s->num_names; i++)
        if (is_named(s->names[i], scene, what))
            return true;
    return s->num_names == 0;
}

/* Checks that every name is that of a reference or of a scene's noise. */
static bool check_names(const struct settings *s, const struct suite *suite, struct err *e)
{
    if (!s->all && s->num_names == 0 && !s->opt.accept_new)
        return err_set(e, "approve takes --all, --new or names of references (see --help)");
    for (int n = 0; n < s->num_names; n++) {
        const struct suite_scene *scene;
        const struct suite_reference *ref;
        bool found = false;
        for (int i = 0; !found && (ref = rendered_reference(suite, i, &scene)) != NULL; i++)
            found = is_named(s->names[n], scene, ref->engine);
        for (int i = 0; !found && i < suite->num_scenes; i++)
            found = is_named(s->names[n], &suite->scene[i], "noise");
        if (!found)
            return err_set(e, "%s: the suite in %s has no such reference", s->names[n],
                           s->suite_dir);
    }
    return true;
}

static bool is_current(const struct settings *s, const struct suite_scene *scene,
                       const struct suite_reference *ref)
{
    struct golden g;
    golden_inspect(s->opt.golden_dir, scene, ref, &g);
    bool current = g.state == GOLDEN_CURRENT;
    golden_free(&g);
    return current;
}

/* --new by itself: nothing that is stored is replaced. */
static bool only_new(const struct settings *s)
{
    return s->opt.accept_new && !s->all && s->num_names == 0;
}

/* Is the reference to be approved? Under --all one that is up to date needs no candidate. */
static bool is_wanted(const struct settings *s, const struct suite_scene *scene,
                      const struct suite_reference *ref)
{
    if (only_new(s) && golden_is_there(s->opt.golden_dir, scene, ref))
        return false;
    return is_selected(s, scene, ref->engine) &&
           !(s->all && !golden_is_there(s->opt.from_dir, scene, ref) && is_current(s, scene, ref));
}

/* Prints the stored references that the suite does not have; *num: how many, *first: one of them. */
static bool print_orphans(const char *dir, const struct suite *suite, size_t *num,
                          struct path *first, struct err *e)
{
    json_t *names, *value;
    const char *name;
    *num = 0;
    if (!golden_orphans(dir, suite, &names, e))
        return false;
    json_object_foreach(names, name, value) {
        if ((*num)++ == 0)
            *first = fs_path("%s", name);
        printf("%-8s %s/%s: not in the suite\n", "orphan", dir, name);
    }
    json_decref(names);
    return true;
}

static int status(const struct settings *s, const struct suite *suite, struct err *e)
{
    const struct suite_scene *scene;
    const struct suite_reference *ref;
    size_t bad = 0, orphans;
    int total = 0;
    for (; (ref = rendered_reference(suite, total, &scene)) != NULL; total++) {
        struct golden g;
        golden_inspect(s->opt.golden_dir, scene, ref, &g);
        bool current = g.state == GOLDEN_CURRENT;
        printf("%-8s %s/%s%s%s\n", golden_state_name(g.state), scene->name, ref->engine,
               current ? "" : ": ", current ? "" : g.why.msg);
        bad += !current;
        golden_free(&g);
    }
    bool noise = noise_ladder_is_kept(s->opt.golden_dir, suite);
    for (int i = 0; noise && i < suite->num_scenes; i++)
        if (strcmp(suite->scene[i].references_of, suite->scene[i].name) == 0)
            bad += noise_record_status(s->opt.golden_dir, &suite->scene[i], &total, stdout);
    struct path first;
    if (!print_orphans(s->opt.golden_dir, suite, &orphans, &first, e))
        return EXIT_NOT_JUDGED;
    if (bad + orphans == 0)
        return EXIT_EQUIVALENT;
    err_set(e, "%zu of %d stored references are not current, %zu have no place in the suite", bad,
            total, orphans);
    return EXIT_NOT_JUDGED;
}

/* The command that would accept what was refused for want of a reason. */
static void print_command(const struct settings *s, const struct suite_scene *scene,
                          const struct suite_reference *ref)
{
    char *command = shell_quote_join(
        "assay",
        (const char *[]){"golden", "approve", "--suite", s->suite_dir, "--from", s->opt.from_dir,
                         "--golden", s->opt.golden_dir, "--accept-difference", "why it may",
                         fs_path("%s/%s", scene->name, ref->engine).s, NULL});
    printf("  %s\n", command != NULL ? command : "the same command, with --accept-difference");
    free(command);
}

/* Decides on all selected references, even if some are refused; the line for exit code 3 is that of the first
 * that could not be judged. */
static int approve_all(const struct settings *s, const struct suite *suite, struct err *e)
{
    const struct suite_scene *scene;
    const struct suite_reference *ref;
    int count[APPROVE_IMPOSSIBLE + 1] = {0}, selected = 0;
    struct approve_options opt = s->opt;
    if (!check_names(s, suite, e))
        return EXIT_NOT_JUDGED;
    for (int i = 0; (ref = rendered_reference(suite, i, &scene)) != NULL; i++)
        selected += is_selected(s, scene, ref->engine);
    for (int i = 0; i < suite->num_scenes; i++)
        if (is_selected(s, &suite->scene[i], "noise"))
            selected += noise_record_count(s->opt.from_dir, &suite->scene[i]);
    opt.alpha = s->opt.alpha / (selected > 0 ? selected : 1);
    for (int i = 0; (ref = rendered_reference(suite, i, &scene)) != NULL; i++) {
        if (!is_wanted(s, scene, ref))
            continue;
        struct err why = {0};
        enum approval done = approve(&opt, scene, ref, stdout, &why);
        if (done == APPROVE_IMPOSSIBLE)
            printf("  refused: %s\n", why.msg);
        if (done == APPROVE_DIFFERENT || done == APPROVE_BETTER)
            print_command(s, scene, ref);
        if (done == APPROVE_IMPOSSIBLE && count[done] == 0)
            *e = why;
        count[done == APPROVE_BETTER ? APPROVE_INCONCLUSIVE : done]++;
    }
    for (int i = 0; i < suite->num_scenes && !only_new(s); i++)
        if (is_selected(s, &suite->scene[i], "noise"))
            noise_record_approve(&opt, &suite->scene[i], stdout, count, e);
    struct path first;
    size_t orphans = 0;
    struct err why = {0};
    if (s->num_names == 0 && !print_orphans(s->opt.from_dir, suite, &orphans, &first, &why) &&
        count[APPROVE_IMPOSSIBLE]++ == 0)
        *e = why;
    printf(
        "%d approved, %d unchanged, %d refused as DIFFERENT, %d as INCONCLUSIVE, %d impossible\n",
        count[APPROVE_ACCEPTED], count[APPROVE_UNCHANGED], count[APPROVE_DIFFERENT],
        count[APPROVE_INCONCLUSIVE],
        count[APPROVE_IMPOSSIBLE] + (suite->is_own ? 0 : (int)orphans));
    if (orphans > 0 && !suite->is_own && count[APPROVE_IMPOSSIBLE]++ == 0)
        err_set(e, "%s/%s: not in the suite", s->opt.from_dir, first.s);
    return count[APPROVE_IMPOSSIBLE] > 0     ? EXIT_NOT_JUDGED
           : count[APPROVE_DIFFERENT] > 0    ? EXIT_DIFFERENT
           : count[APPROVE_INCONCLUSIVE] > 0 ? EXIT_INCONCLUSIVE
                                             : EXIT_EQUIVALENT;
}

/* Prints a table of all selected candidates against what is stored: what a new version of an engine changed. */
static int compare_all(const struct settings *s, const struct suite *suite, struct err *e)
{
    const struct suite_scene *scene;
    const struct suite_reference *ref;
    struct approve_options opt = s->opt;
    int selected = 0, code = EXIT_EQUIVALENT;
    enum verdict verdict = VERDICT_EQUIVALENT;
    if (s->num_names > 0 && !check_names(s, suite, e))
        return EXIT_NOT_JUDGED;
    for (int i = 0; (ref = rendered_reference(suite, i, &scene)) != NULL; i++)
        selected +=
            is_selected(s, scene, ref->engine) && golden_is_there(s->opt.from_dir, scene, ref);
    if (selected == 0) {
        err_set(e, "no candidates in %s: golden render makes them", s->opt.from_dir);
        return EXIT_NOT_JUDGED;
    }
    opt.alpha = s->opt.alpha / selected;
    approve_compare_heading(stdout);
    for (int i = 0; (ref = rendered_reference(suite, i, &scene)) != NULL; i++) {
        struct err why = {0};
        if (!is_selected(s, scene, ref->engine) || !golden_is_there(s->opt.from_dir, scene, ref))
            continue;
        if (!approve_compare(&opt, scene, ref, stdout, &verdict, &why)) {
            printf("%-20s  not compared: %s\n", scene->name, why.msg);
            if (code != EXIT_NOT_JUDGED)
                *e = why;
            code = EXIT_NOT_JUDGED;
        } else if (verdict == VERDICT_DIFFERENT && code != EXIT_NOT_JUDGED)
            code = EXIT_DIFFERENT;
        else if (!verdict_decides(verdict) && code == EXIT_EQUIVALENT)
            code = EXIT_INCONCLUSIVE;
    }
    return code;
}

int command_golden(int argc, char **argv, struct err *e)
{
    struct settings s = {.opt = {.from_dir = "build/golden-candidate", .alpha = 1e-3}};
    const char *what = argc > 1 ? argv[1] : "";
    if (strcmp(what, "render") == 0)
        return command_reference(argc - 1, argv + 1, e);
    bool is_status = strcmp(what, "status") == 0, compares = strcmp(what, "compare") == 0,
         is_verb = strcmp(what, "--help") != 0;
    if (!is_status && !compares && is_verb && strcmp(what, "approve") != 0) {
        err_set(e, "golden: '%s' is none of render, status, compare, approve (see --help)", what);
        return EXIT_NOT_JUDGED;
    }
    if (!cli_read(options, argc - is_verb, argv + is_verb, &s, e))
        return EXIT_NOT_JUDGED;
    if (s.help)
        return 0;
    if (s.opt.why != NULL && s.opt.why[strspn(s.opt.why, " \t\n")] == '\0') {
        err_set(e, "--accept-difference needs a reason");
        return EXIT_NOT_JUDGED;
    }
    struct suite suite;
    if (is_status && (s.num_names > 0 || s.all)) {
        err_set(e, "golden status takes no names");
        return EXIT_NOT_JUDGED;
    }
    const struct data_dirs at = data_dirs_of_suite(s.suite_dir);
    if (s.suite_dir == NULL)
        s.suite_dir = suite_own_is(".") ? "." : "reference/scenes";
    if (s.opt.golden_dir == NULL)
        s.opt.golden_dir = suite_own_is(s.suite_dir) ? at.golden.s : "golden";
    if (!suite_load(s.suite_dir, &suite, e))
        return EXIT_NOT_JUDGED;
    int code = is_status  ? status(&s, &suite, e)
               : compares ? compare_all(&s, &suite, e)
                          : approve_all(&s, &suite, e);
    suite_free(&suite);
    return code;
}
