/* Builds a plan: its head, its inputs by hash, a line for each job. */
#include "plan.h"

#include "reference/base/json_node.h"
#include "renderer/image/image_oiio.h"
#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"
#include "renderer/base/version.h"
#include "job_kinds.h"
#include "tools/base/hash_tree.h"

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const char *plan_text(const struct plan *p, const char *name)
{
    return json_string_value(json_object_get(p->head, name));
}

char **plan_words(const json_t *array, int *num)
{
    size_t n = json_array_size(array), room = (n + 1) * sizeof(char *);
    for (size_t i = 0; i < n; i++)
        room += json_string_length(json_array_get(array, i)) + 1;
    char **words = malloc(room);
    if (words == NULL)
        return NULL;
    char *at = (char *)(words + n + 1);
    for (size_t i = 0; i < n; i++) {
        words[i] = at;
        strcpy(at, json_string_value(json_array_get(array, i)));
        at += strlen(at) + 1;
    }
    words[n] = NULL;
    *num = (int)n;
    return words;
}

/* Fails on a text that jansson rejects. It cannot be for lack of memory, which ends the program (json_memory()). */
static bool refuse(const char *text, struct err *e)
{
    return err_set(e, "'%s' is no UTF-8 and cannot be planned", text);
}

static bool add_words(json_t *array, const char *const *word, int num, struct err *e)
{
    for (int i = 0; i < num; i++)
        if (json_array_append_new(array, json_string(word[i])) != 0)
            return refuse(word[i], e);
    return true;
}

bool plan_head(struct plan *p, const char *kind, int argc, char **argv, struct err *e)
{
    char cwd[PATH_MAX];
    if (getcwd(cwd, sizeof cwd) == NULL)
        return err_set(e, "no current directory: %s", strerror(errno));
    p->head =
        json_pack("{si, ss, ss, ss?, s[], s[i], s[], s{}}", "assay_plan", 1, "kind", kind,
                  "version", assay_version, "cwd", cwd, "command", "ends", 0, "run", "inputs");
    return (p->head != NULL || refuse(cwd, e)) &&
           add_words(json_object_get(p->head, "command"), (const char *const *)argv, argc, e);
}

static bool add_input(json_t *inputs, const char *path, struct err *e)
{
    char hex[65];
    if (!hash_tree(path, NULL, hex, e))
        return false;
    return json_object_set_new(inputs, path, json_string(hex)) == 0 || refuse(path, e);
}

bool plan_begin(struct plan *p, const char *output, const char *product, int cpus, struct err *e)
{
    const struct path dir =
        fs_path(p->dir[0] != '\0' ? "%s" : "%s.plan", p->dir[0] != '\0' ? p->dir : output);
    char full[PATH_MAX];
    if (!fs_make_dirs(dir.s, e))
        return false;
    if (realpath(dir.s, full) == NULL || strlen(full) >= sizeof p->dir)
        return err_set(e, "%s: %s", dir.s, strerror(errno));
    strcpy(p->dir, full);
    return (json_object_set_new(p->head, "output", json_string(output)) == 0 &&
            json_object_set_new(p->head, "product", json_string(product)) == 0 &&
            json_object_set_new(p->head, "cpus", json_integer(cpus)) == 0) ||
           refuse(output, e);
}

/* Adds a program as an input; of assay, also the module that it loads at run time. */
static bool add_program(struct plan *p, const char *program, struct err *e)
{
    struct path module;
    if (!plan_input(p, program, e))
        return false;
    return strcmp(fs_base(program), "assay") != 0 ||
           (image_oiio_file(&module, e) && plan_input(p, module.s, e));
}

bool plan_run_words(struct plan *p, const char *const *word, int num, bool user, struct err *e)
{
    json_t *run = json_object_get(p->head, "run");
    for (int i = 0; user && i < num; i++)
        if (strcmp(word[i], "{job}") == 0 || strncmp(word[i], "{out}", 5) == 0)
            return err_set(e, "'%s' means something else in a plan", word[i]);
    if (json_array_size(run) == 0 && !add_program(p, word[0], e))
        return false;
    return add_words(run, word, num, e);
}

bool plan_user_words(struct plan *p, const struct option_words *leave_out, int num, char **word,
                     struct err *e)
{
    char **kept = calloc((size_t)num + 1, sizeof *kept);
    if (kept == NULL)
        return err_set(e, "out of memory");
    int n = cli_rewrite_kept(leave_out, num, word, kept);
    bool ok = plan_run_words(p, (const char *const *)kept, n, true, e);
    free(kept);
    return ok;
}

void plan_may_end(struct plan *p, int code)
{
    /* Without "ends" plan_make() fails. */
    if (json_array_append_new(json_object_get(p->head, "ends"), json_integer(code)) != 0)
        json_object_del(p->head, "ends");
}

bool plan_input(struct plan *p, const char *path, struct err *e)
{
    return add_input(json_object_get(p->head, "inputs"), path, e);
}

/* Hashes what all jobs have in common and what their bits depend on. */
static bool hash_common(const struct plan *p, char hex[65])
{
    json_t *common = json_pack(
        "{ss, sO, sO, sO}", "version", assay_version, "run", json_object_get(p->head, "run"),
        "inputs", json_object_get(p->head, "inputs"), "cwd", json_object_get(p->head, "cwd"));
    char *text = json_dumps(common, JSON_COMPACT | JSON_SORT_KEYS);
    if (text != NULL)
        sha256_text(text, hex);
    free(text);
    json_decref(common);
    return text != NULL;
}

/* The line of a job, to free(); NULL out of memory. */
static char *job_line(const struct plan *p, json_t *words, json_t *inputs)
{
    char common[65], key[65];
    if (!hash_common(p, common))
        return NULL;
    json_t *job = json_pack("{ss, sO, sO}", "common", common, "words", words, "inputs", inputs);
    char *text = json_dumps(job, JSON_COMPACT | JSON_SORT_KEYS);
    json_decref(job);
    if (text == NULL)
        return NULL;
    sha256_text(text, key);
    free(text);
    job =
        json_pack("{si, ss, sO, sO}", "job", p->num, "key", key, "words", words, "inputs", inputs);
    text = json_dumps(job, JSON_COMPACT);
    json_decref(job);
    return text;
}

bool plan_job(struct plan *p, const char *const *word, int num, const char *const *input,
              struct err *e)
{
    json_t *words = json_array(), *inputs = json_object();
    char **line = realloc(p->line, ((size_t)p->num + 1) * sizeof *line);
    bool ok = line != NULL || err_set(e, "out of memory");
    if (line != NULL)
        p->line = line;
    ok = ok && add_words(words, word, num, e);
    for (; ok && *input != NULL; input++)
        ok = add_input(inputs, *input, e);
    if (ok) {
        p->line[p->num] = job_line(p, words, inputs);
        ok = p->line[p->num] != NULL || err_set(e, "out of memory for the plan");
        p->num += ok;
    }
    json_decref(words);
    json_decref(inputs);
    return ok;
}

bool plan_are_texts(const json_t *array)
{
    json_each(v, array)
        if (!json_is_string(v))
            return false;
    return json_is_array(array);
}
