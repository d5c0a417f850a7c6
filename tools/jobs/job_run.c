/* Runs a job of a plan, and verifies its artefact by the receipt. */
#define _GNU_SOURCE
#include "reference/base/json_file.h"
#include "reference/base/json_node.h"
#include "reference/base/process.h"
#include "renderer/base/fs.h"
#include "plan.h"
#include "tools/base/hash_tree.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define RECEIPT "job.json"
static json_t *job_of(const struct plan *p, int k)
{
    return json_loads(p->line[k], 0, NULL);
}

/* The job's key; "" if its line is not a job. */
static void key_of(const json_t *job, char key[65])
{
    const char *text = json_string_value(json_object_get(job, "key"));
    key[0] = '\0';
    if (text != NULL && strlen(text) == 64 && strspn(text, "0123456789abcdef") == 64)
        strcpy(key, text);
}

struct path job_run_artefact(const struct plan *p, int k, const char *name)
{
    char key[65];
    json_t *job = job_of(p, k);
    key_of(job, key);
    json_decref(job);
    return fs_path("%s/jobs/%s%s%s", p->dir, key, name != NULL ? "/" : "",
                   name != NULL ? name : "");
}

bool job_run_is_made(const struct plan *p, int k)
{
    return access(job_run_artefact(p, k, RECEIPT).s, R_OK) == 0;
}

bool job_run_verify(const struct plan *p, int k, struct err *e)
{
    char hex[65];
    const struct path made = job_run_artefact(p, k, NULL), path = job_run_artefact(p, k, RECEIPT);
    json_t *receipt = json_load_file(path.s, 0, NULL);
    const char *sha256 = json_string_value(json_object_get(receipt, "sha256"));
    bool ok =
        (sha256 != NULL || err_set(e, "job %d: %s is not there", k, path.s)) &&
        hash_tree(made.s, RECEIPT, hex, e) &&
        (strcmp(hex, sha256) == 0 || err_set(e, "job %d: %s is not what the job wrote", k, made.s));
    json_decref(receipt);
    return ok;
}

static bool check_inputs(json_t *inputs, struct err *e)
{
    const char *path;
    json_t *planned;
    char hex[65];
    json_object_foreach(inputs, path, planned) {
        if (!hash_tree(path, NULL, hex, e))
            return err_prefix(e, "an input");
        if (json_string_value(planned) == NULL || strcmp(hex, json_string_value(planned)) != 0)
            return err_set(e,
                           "%s is not what was planned with (SHA-256 %.12s... then, %.12s... now)",
                           path, json_is_string(planned) ? json_string_value(planned) : "?", hex);
    }
    return true;
}

/* The job's command, with "{job}" and "{out}" replaced: one block, to free(). NULL: out of memory, or a path that
 * is not UTF-8. */
static char **command_of(const struct plan *p, const json_t *job, const char *out)
{
    json_t *run = json_object_get(p->head, "run"), *own = json_object_get(job, "words"),
           *all = json_array();
    int num, failed = 0; /* if the path is not UTF-8 */
    json_each(v, run) {
        const char *word = json_string_value(v);
        if (strcmp(word, "{job}") == 0)
            json_array_extend(all, own);
        else if (strncmp(word, "{out}", 5) == 0)
            failed |= json_array_append_new(all, json_string(fs_path("%s%s", out, word + 5).s));
        else
            json_array_append(all, v);
    }
    char **words = failed == 0 ? plan_words(all, &num) : NULL;
    json_decref(all);
    return words;
}

static bool may_end(const struct plan *p, int code)
{
    json_each(v, json_object_get(p->head, "ends"))
        if (json_integer_value(v) == code)
            return true;
    return false;
}

/* Runs the program, whose artefact grows in `out`, and writes the receipt into it. */
static bool make(const struct plan *p, int k, const json_t *job, const char *key, const char *out,
                 struct err *e)
{
    char hex[65], host[256] = "";
    const struct path log = fs_path("%s/log", out),
                      product = fs_path("%s/%s", out, plan_text(p, "product"));
    struct process_usage usage = {.exit_status = -1};
    struct err why = {""};
    char **words = command_of(p, job, out);
    if (words == NULL)
        return err_set(e, "out of memory");
    const struct process process = {.argv = (const char *const *)words, .log = log.s};
    bool ok = process_run(&process, &usage, &why) || may_end(p, usage.exit_status);
    free(words);
    if (!ok || access(product.s, R_OK) != 0)
        return err_set(e, "job %d: %s", k, why.msg[0] != '\0' ? why.msg : "it left no artefact");
    gethostname(host, sizeof host - 1);
    if (!hash_tree(out, RECEIPT, hex, e))
        return false;
    json_t *receipt =
        json_pack("{ss, ss, ss, si, sf, sf}", "key", key, "sha256", hex, "host", host, "exit",
                  usage.exit_status, "cpu_s", usage.cpu_s, "wall_s", usage.wall_s);
    ok = json_write(fs_path("%s/" RECEIPT, out).s, receipt, e);
    json_decref(receipt);
    return ok;
}

/* Renames the artefact into its place. If another process has made the same job meanwhile, ours is removed: it is
 * the same. */
static bool put_in_place(const struct plan *p, int k, const char *from, struct err *e)
{
    const struct path to = job_run_artefact(p, k, NULL);
    if (rename(from, to.s) == 0)
        return true;
    int why = errno;
    if ((why == EEXIST || why == ENOTEMPTY) && job_run_is_made(p, k))
        return fs_remove_tree(from, e);
    return err_set(e, "%s: cannot appear: %s", to.s, strerror(why));
}

bool job_run(const struct plan *p, int k, bool *made, struct err *e)
{
    char key[65], host[256] = "";
    struct err why = {""};
    json_t *job = job_of(p, k);
    key_of(job, key);
    *made = false;
    if (key[0] == '\0' || !plan_are_texts(json_object_get(job, "words"))) {
        json_decref(job);
        return err_set(e, "%s/plan.jsonl: line %d is no job", p->dir, k + 2);
    }
    if (job_run_is_made(p, k) && job_run_verify(p, k, &why)) {
        json_decref(job);
        return true;
    }
    gethostname(host, sizeof host - 1);
    const struct path path = job_run_artefact(p, k, NULL),
                      out = fs_path("%s.tmp-%s-%ld", path.s, host, (long)getpid());
    bool ok = check_inputs(json_object_get(p->head, "inputs"), e) &&
              check_inputs(json_object_get(job, "inputs"), e) && fs_remove_tree(out.s, e) &&
              fs_make_dirs(out.s, e) && make(p, k, job, key, out.s, e) &&
              (why.msg[0] == '\0' || fs_remove_tree(path.s, e)) && /* a damaged artefact */
              put_in_place(p, k, out.s, e);
    if (!ok)
        (void)!fs_remove_tree(out.s, &why);
    json_decref(job);
    *made = ok;
    return ok;
}
