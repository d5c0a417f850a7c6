/* Makes a results.json again and compares all but times. */
#include "reference/base/json_file.h"
#include "reference/base/process.h"
#include "renderer/base/cli_rewrite.h"
#include "renderer/base/fs.h"
#include "renderer/base/shell_quote.h"
#include "tools/base/data_dirs.h"
#include "reproduce_internal.h"
#include "tools/results/results.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { MAX_PATH = 4096 + 64, MORE_WORDS = 8 };

/* Options that are left out: where outputs go, and how the command was run. */
static const struct option_words how[] = {
    {"-o", 1}, {"--out", 1},   {"--json", 1},    {"-r", 1},      {"--report", 1},     {"-q", 0},
    {"-t", 1}, {"--quiet", 0}, {"--threads", 1}, {"--slurm", 0}, {"--page-every", 1}, {0}};

/* Does the member belong to the run itself, so that it differs between runs of the same command? */
static bool is_of_the_run(const char *key)
{
    static const char *const whole[] = {"command", "date", "machine", "version"};
    static const char *const part[] = {"seconds", "efficiency", "cpu_s", "wall_s", "_s_per_"};
    size_t n = strlen(key);
    for (size_t i = 0; i < sizeof whole / sizeof *whole; i++)
        if (strcmp(key, whole[i]) == 0)
            return true;
    for (size_t i = 0; i < sizeof part / sizeof *part; i++)
        if (strstr(key, part[i]) != NULL)
            return true;
    return n > 2 && strcmp(key + n - 2, "_s") == 0;
}

static void tell(const char *at, const json_t *then, const json_t *now, struct reproduced *out)
{
    if (out->num_different++ > 0)
        return;
    char *a = json_dumps(then, JSON_ENCODE_ANY), *b = json_dumps(now, JSON_ENCODE_ANY);
    snprintf(out->first, sizeof out->first, "%s: %.60s there, %.60s now", at,
             a != NULL ? a : "nothing", b != NULL ? b : "nothing");
    free(a);
    free(b);
}

/* Compares two documents and adds their values to the counts in out; out->first names the first that differs by its
 * place, "claims[3].difference". */
static void walk(const char *at, const json_t *then, const json_t *now, struct reproduced *out)
{
    char path[120];
    const char *key;
    json_t *v;
    if (json_is_object(then) && json_is_object(now)) {
        json_t *either = json_copy((json_t *)then);
        json_object_update_missing(either, (json_t *)now);
        json_object_foreach(either, key, v) {
            snprintf(path, sizeof path, "%s%s%s", at, at[0] != '\0' ? "." : "", key);
            if (!is_of_the_run(key))
                walk(path, json_object_get(then, key), json_object_get(now, key), out);
        }
        json_decref(either);
        return;
    }
    if (json_is_array(then) && json_array_size(then) == json_array_size(now)) {
        for (size_t i = 0; i < json_array_size(then); i++) {
            snprintf(path, sizeof path, "%s[%zu]", at, i);
            walk(path, json_array_get(then, i), json_array_get(now, i), out);
        }
        return;
    }
    out->num_values++;
    if (then == NULL || !json_equal(then, now))
        tell(at, then, now, out);
}

/* The option and file that tell the command where to write, and the path of the results file there (product). */
static bool choose_output(const char *path, const char *verb, const char *dir, const char **option,
                          char file[MAX_PATH], char product[MAX_PATH], struct err *e)
{
    *option = "--out";
    snprintf(file, MAX_PATH, "%s", dir);
    snprintf(product, MAX_PATH, "%.4000s/results.json", dir);
    if (strcmp(verb, "compare") == 0) {
        *option = "--json";
        snprintf(product, MAX_PATH, "%.3000s/%.900s", dir, fs_base(path));
        memcpy(file, product, MAX_PATH);
    }
    return strcmp(verb, "compare") == 0 || strcmp(verb, "validate") == 0 ||
           strcmp(verb, "converge") == 0 ||
           err_set(e, "%s: made by 'assay %s', which is not made again", path, verb);
}

/* If *word is the long option `name`, its value, from that word or the next; else NULL. */
static const char *value_of(const char *const *word, const char *name)
{
    size_t n = strlen(name);
    if (strncmp(word[0], name, n) != 0)
        return NULL;
    return word[0][n] == '=' ? word[0] + n + 1 : word[0][n] == '\0' ? word[1] : NULL;
}

static bool same_file(const char *a, const char *b)
{
    struct stat x, y;
    return stat(a, &x) == 0 && stat(b, &y) == 0 && x.st_dev == y.st_dev && x.st_ino == y.st_ino;
}

/* Fails if the command names a program other than those that validate and converge use by default: another
 * renderer, the path of a description of an engine, or another directory of cycles.py, which Blender runs. A
 * description named without a path is one of ours. */
static bool check_programs(const char *path, const char *const *word, struct err *e)
{
    const struct data_dirs at = data_dirs_find();
    const char *value;
    for (; *word != NULL; word++)
        if (((value = value_of(word, "--pathtracer")) != NULL &&
             !same_file(value, at.pathtracer.s)) ||
            ((value = value_of(word, "--share")) != NULL && !same_file(value, at.share.s)) ||
            ((value = value_of(word, "--engine")) != NULL && strpbrk(value, "./") != NULL))
            return err_set(e,
                           "%s: its command runs a program of '%s', which is not ours: look at "
                           "it, then give --run-foreign",
                           path, value);
    return true;
}

/* Removes options of `how` that are written together with others or with their value, "-qt2". Only -q, which is given
 * anyway, can stand before other letters. Returns how many words are left. */
static int together_kept(int num, char **word)
{
    int n = 0;
    for (int i = 0; i < num; i++) {
        char *w = word[i];
        while (w[0] == '-' && w[1] == 'q' && w[2] != '\0')
            *++w = '-';
        bool dropped = false;
        for (const struct option_words *o = how; o->name != NULL; o++)
            dropped = dropped || (o->args == 1 && o->name[1] != '-' &&
                                  strncmp(w, o->name, 2) == 0 && w[2] != '\0');
        if (!dropped)
            word[n++] = w;
    }
    return n;
}

/* Runs the command with its outputs in `dir`. product: receives the path of the results there. */
static bool run_again(const char *path, const struct reproduce_options *opt, const json_t *then,
                      int num, char **word, const char *dir, char product[MAX_PATH],
                      struct reproduced *out, struct err *e)
{
    static const struct option_words seed[] = {{"--reference-seed", 1}, {0}};
    char file[MAX_PATH], number[24];
    const char *option, *verb = num > 1 ? word[1] : "";
    const json_t *drawn = json_object_get(then, "reference_seed");
    struct process_usage usage = {.exit_status = -1};
    if (num < 2 || strcmp(fs_base(word[0]), "assay") != 0)
        return err_set(e, "%s: made by no command of assay", path);
    if (!choose_output(path, verb, dir, &option, file, product, e))
        return false;
    const char **argv = calloc((size_t)num + MORE_WORDS, sizeof *argv);
    if (argv == NULL)
        return err_set(e, "out of memory");
    const struct path assay = fs_beside_program("assay");
    const struct path log = fs_path("%s/log", dir);
    const char *ours[] = {assay.s, verb, "-q", option, file};
    memcpy(argv, ours, sizeof ours);
    int more = (int)(sizeof ours / sizeof *ours), n = together_kept(num - 2, word + 2);
    n = cli_rewrite_kept(how, n, word + 2, word + 2);
    if (json_is_integer(drawn)) { /* drawn at random where the command does not say it */
        n = cli_rewrite_kept(seed, n, word + 2, word + 2);
        snprintf(number, sizeof number, "%lld", (long long)json_integer_value(drawn));
        argv[more++] = "--reference-seed";
        argv[more++] = number;
    }
    memcpy(argv + more, word + 2, (size_t)n * sizeof *argv);
    struct err why = {""};
    const struct process p = {.argv = argv, .log = log.s};
    bool ok =
        reproduced_command(out, argv, e) && (opt->run_foreign || check_programs(path, argv, e));
    if (ok && !process_run(&p, &usage, &why) &&
        (usage.exit_status < EXIT_DIFFERENT || usage.exit_status > EXIT_INCONCLUSIVE))
        ok = err_set(e, "%s: made again: %s", path, why.msg);
    free(argv);
    return ok;
}

bool reproduce_results(const char *path, const struct reproduce_options *opt, const char *dir,
                       struct reproduced *out, struct err *e)
{
    char product[MAX_PATH];
    int num = 0;
    json_t *now = NULL, *then = json_read_or_say(path, e);
    if (then == NULL)
        return false;
    const char *command = member_text(then, "command"), *version = member_text(then, "version");
    char **word = NULL;
    bool ok = command != NULL || err_set(e, "%s: does not say by what command it was made", path);
    if (ok && results_lack_time(then))
        ok = err_set(
            e, "%s: its --budget was over before all was decided: that depends on the machine",
            path);
    if (ok && (word = shell_quote_split(command, &num, e)) == NULL)
        ok = err_prefix(e, "%s", path);
    ok = ok && run_again(path, opt, then, num, word, dir, product, out, e);
    if (ok && (now = json_read_or_say(product, e)) == NULL)
        ok = err_prefix(e, "%s: made again", path);
    if (ok && results_lack_time(now))
        ok = err_set(e, "%s: made again: its --budget was over before all was decided", path);
    if (ok) {
        snprintf(out->made_by, sizeof out->made_by, "%s", version != NULL ? version : "");
        walk("", then, now, out);
        if (opt->keep != NULL)
            ok = json_write(opt->keep, now, e);
    }
    free(word);
    json_decref(now);
    json_decref(then);
    return ok;
}
