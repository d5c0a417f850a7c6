#include "reproduce_results.h"

#include "reference/base/json_file.h"
#include "reference/base/process.h"
#include "renderer/base/cli_rewrite.h"
#include "renderer/base/fs.h"
#include "renderer/base/shell_quote.h"
#include "reproduce_internal.h"
#include "tools/results/results.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MAX_PATH = RESULTS_PATH, MORE_WORDS = 8 };

/* Words that are not repeated: where outputs go, and how it was run. */
static const struct option_words how[] = {
    {"-o", 1}, {"--out", 1},   {"--json", 1},    {"-r", 1},      {"--report", 1},     {"-q", 0},
    {"-t", 1}, {"--quiet", 0}, {"--threads", 1}, {"--slurm", 0}, {"--page-every", 1}, {0}};

/* What another run of the same has otherwise. */
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

/* Adds what two of them have in values to out, the first that differs by its place: "claims[3].difference". */
static void walk(const char *at, const json_t *then, const json_t *now, struct reproduced *out)
{
    char path[120];
    const char *key;
    json_t *v;
    if (json_is_object(then) && json_is_object(now)) {
        json_object_foreach((json_t *)then, key, v)
        {
            snprintf(path, sizeof path, "%s%s%s", at, at[0] != '\0' ? "." : "", key);
            if (!is_of_the_run(key))
                walk(path, v, json_object_get(now, key), out);
        }
        json_object_foreach((json_t *)now, key, v)
        {
            snprintf(path, sizeof path, "%s%s%s", at, at[0] != '\0' ? "." : "", key);
            if (!is_of_the_run(key) && json_object_get(then, key) == NULL)
                walk(path, NULL, v, out);
        }
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

/* Where the command is told to put what is compared, and as what: option and file of the words; product: the file. */
static bool choose_output(const char *path, const json_t *then, char **word, const char *dir,
                          const char **option, char file[MAX_PATH], char product[MAX_PATH],
                          struct err *e)
{
    const char *verb = word[1];
    *option = "--out";
    snprintf(file, MAX_PATH, "%s", dir);
    snprintf(product, MAX_PATH, "%.4000s/results.json", dir);
    if (strcmp(verb, "grade") == 0) {
        const char *id = member_text(then, "id");
        if (id != NULL)
            snprintf(product, MAX_PATH, "%.3000s/%.900s/grade.json", dir, id);
        else
            snprintf(product, MAX_PATH, "%.4000s/grades.json", dir);
    } else if (strcmp(verb, "compare") == 0) {
        *option = "--json";
        snprintf(file, MAX_PATH, "%.3000s/%.900s", dir, fs_base(path));
        snprintf(product, MAX_PATH, "%.3000s/%.900s", dir, fs_base(path));
    } else if (strcmp(verb, "validate") != 0 && strcmp(verb, "converge") != 0) {
        return err_set(e, "%s: made by 'assay %s', which is not made again", path, verb);
    }
    return true;
}

/* Words that say what the results had by chance: a fresh seed, references that are there. */
static int more_words(const char *path, const char *verb, const json_t *then, char text[MAX_PATH],
                      const char **argv)
{
    const json_t *seed = json_object_get(then, "reference_seed");
    if (json_is_integer(seed) && strcmp(verb, "validate") == 0) {
        snprintf(text, MAX_PATH, "%lld", (long long)json_integer_value(seed));
        argv[0] = "--reference-seed";
        argv[1] = text;
        return 2;
    }
    /* OUT/ID/grade.json, OUT/grades.json */
    fs_beside_file(path, json_object_get(then, "id") != NULL ? "../.references" : ".references",
                   text, MAX_PATH);
    if (strcmp(verb, "grade") == 0 && access(text, R_OK) == 0) {
        argv[0] = "--references";
        argv[1] = text;
        return 2;
    }
    return 0;
}

/* The same of options written together, "-qt2": of the verbs' letters only -q, which is given anyway, stands before others. */
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

bool results_run_again(const char *path, const json_t *then, int num, char **word, const char *dir,
                       char product[MAX_PATH], struct reproduced *out, struct err *e)
{
    static const struct option_words none[] = {{0}}, seed[] = {{"--reference-seed", 1}, {0}};
    char assay[4096], log[MAX_PATH], file[MAX_PATH], text[MAX_PATH];
    const char *option, *verb = num > 1 ? word[1] : "";
    struct process_usage usage = {.exit_status = -1};
    if (num < 2 || strcmp(fs_base(word[0]), "assay") != 0)
        return err_set(e, "%s: made by no command of assay", path);
    if (!choose_output(path, then, word, dir, &option, file, product, e))
        return false;
    const char **argv = calloc((size_t)num + MORE_WORDS, sizeof *argv);
    if (argv == NULL)
        return err_set(e, "out of memory");
    fs_beside_program(assay, sizeof assay, "assay");
    snprintf(log, sizeof log, "%.4000s/log", dir);
    /* Those of a grade are without them. */
    int n = together_kept(num - 2, word + 2);
    n = cli_rewrite_kept(strcmp(verb, "grade") == 0 ? none : how, n, word + 2, word + 2);
    if (json_object_get(then, "reference_seed") != NULL)
        n = cli_rewrite_kept(seed, n, word + 2, word + 2);
    argv[0] = assay;
    argv[1] = verb;
    argv[2] = "-q";
    argv[3] = option;
    argv[4] = file;
    int more = 5 + more_words(path, verb, then, text, argv + 5);
    memcpy(argv + more, word + 2, (size_t)n * sizeof *argv);
    struct err why = {""};
    const struct process p = {.argv = argv, .log = log};
    bool ok = reproduced_command(out, argv, e);
    if (ok && !process_run(&p, &usage, &why) &&
        (usage.exit_status < EXIT_DIFFERENT || usage.exit_status > EXIT_INCONCLUSIVE))
        ok = err_set(e, "%s: made again: %s", path, why.msg);
    free(argv);
    return ok;
}

/* {"command": } that grades all of a class: that of the first, with what is graded by each. */
static json_t *command_of_class(const char *path, const json_t *grades, struct err *e)
{
    const char **word = NULL;
    char ***one = calloc(json_array_size(grades) + 1, sizeof *one);
    json_t *g, *command = NULL;
    size_t i;
    int num = 0, first = 0;
    bool ok = one != NULL || err_set(e, "out of memory");
    json_array_foreach(grades, i, g)
    {
        const char *text = member_text(g, "command");
        if (ok && text == NULL)
            ok = err_set(e, "%s: does not say by what command it was made", path);
        if (ok && (one[i] = shell_quote_split(text, &num, e)) == NULL)
            ok = err_prefix(e, "%s", path);
        if (ok && i == 0) {
            first = num;
            word = calloc((size_t)num + json_array_size(grades) + 1, sizeof *word);
            ok = word != NULL || err_set(e, "out of memory");
            for (int k = 0; ok && k < num; k++)
                word[k] = one[0][k];
        }
        for (int k = 0; ok && k + 1 < first; k++)
            if (num != first || strcmp(one[i][k], one[0][k]) != 0)
                ok = err_set(e, "%s: graded by more than one command", path);
        if (ok && num > 0)
            word[first - 1 + (int)i] = one[i][num - 1];
    }
    if (ok && first > 0) {
        char *text = shell_quote_join(NULL, word);
        ok = text != NULL || err_set(e, "out of memory");
        command = ok ? json_pack("{ss}", "command", text) : NULL;
        free(text);
    } else if (ok) {
        err_set(e, "%s: no grades", path);
    }
    for (i = 0; one != NULL && i < json_array_size(grades); i++)
        free(one[i]);
    free(one);
    free(word);
    return command;
}

bool reproduce_results(const char *path, const struct reproduce_options *opt, const char *dir,
                       struct reproduced *out, struct err *e)
{
    char product[MAX_PATH];
    json_error_t je;
    int num = 0;
    json_t *now = NULL, *then = json_load_file(path, JSON_REJECT_DUPLICATES, &je);
    if (then == NULL)
        return err_set(e, "%s:%d: %s", path, je.line, je.text);
    json_t *class = json_is_array(then) ? command_of_class(path, then, e) : NULL;
    const json_t *origin = json_is_array(then) ? class : then;
    const char *command = member_text(origin, "command"),
               *version =
                   member_text(json_is_array(then) ? json_array_get(then, 0) : then, "version");
    char **word = NULL;
    bool ok = origin != NULL;
    if (ok && command == NULL)
        ok = err_set(e, "%s: does not say by what command it was made", path);
    if (ok && results_lack_time(then))
        ok = err_set(
            e, "%s: its --budget was over before all was decided: that depends on the machine",
            path);
    if (ok && (word = shell_quote_split(command, &num, e)) == NULL)
        ok = err_prefix(e, "%s", path);
    ok = ok && results_run_again(path, origin, num, word, dir, product, out, e);
    if (ok && (now = json_load_file(product, 0, &je)) == NULL)
        ok = err_set(e, "%s: made again: %s:%d: %s", path, product, je.line, je.text);
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
    json_decref(class);
    json_decref(then);
    return ok;
}
