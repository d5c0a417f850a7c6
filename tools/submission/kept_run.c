#include "kept_run.h"

#include "reference/base/json_file.h"
#include "reference/base/json_node.h"
#include "renderer/base/sha256.h"
#include "tools/base/text.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { TEXT = 16384 };

bool kept_run_path(const char *store, const char *of, const struct sandbox *s,
                   const struct sandbox_job *job, const char *const *inputs, struct path *dir,
                   struct err *e)
{
    char text[TEXT], key[65];
    const struct sandbox_limits *l = &job->limit;
    snprintf(text, sizeof text, "%s %d %g %g %zu %zu %zu %d", of, s->unsafe, l->wall_s, l->cpu_s,
             l->memory, l->disk, l->file, l->processes);
    for (; *inputs != NULL; inputs++) {
        if (!sha256_file(fs_path("%s/%s", job->scene, *inputs).s, key, e))
            return false;
        text_append(text, sizeof text, " %s", key);
    }
    for (const char *const *word = job->argv; *word != NULL; word++)
        text_append(text, sizeof text, "\n%s", *word);
    if (strlen(text) == sizeof text - 1)
        return err_set(e, "the command of '%s' is too long", job->argv[0]);
    sha256_text(text, key);
    *dir = fs_path("%s/%s", store, key);
    return true;
}

/* Calls one() with each file that a job hands out, as long as it returns true. */
static bool each_file(const struct sandbox_job *job, bool (*one)(void *ctx, const char *name),
                      void *ctx)
{
    bool ok = !job->keep_tree || one(ctx, "tree.tar");
    for (const char *const *name = job->keep; ok && name != NULL && *name != NULL; name++)
        ok = one(ctx, *name);
    return ok;
}

struct copying {
    const char *dir;
    const struct sandbox_job *job;
    json_t *files; /* name: SHA-256, or null for what was not there */
    struct err *e;
};

static bool keep_file(struct copying *c, const char *name, const char *from)
{
    const struct path to = fs_path("%s/%s", c->dir, name);
    char sha256[65];
    if (access(from, R_OK) != 0) {
        json_object_set_new(c->files, name, json_null());
        return true;
    }
    if (!fs_copy(from, to.s, c->e) || !sha256_file(to.s, sha256, c->e))
        return false;
    json_object_set_new(c->files, name, json_string(sha256));
    return true;
}

static bool keep_one(void *ctx, const char *name)
{
    struct copying *c = ctx;
    return keep_file(c, name, fs_path("%s/%s", c->job->out, name).s);
}

/* False also for a file that is not what was kept: after a power failure it may be empty. */
static bool restore_file(const struct copying *c, const char *name, const char *to)
{
    const struct path from = fs_path("%s/%s", c->dir, name);
    const json_t *kept = json_object_get(c->files, name);
    char sha256[65];
    return json_is_null(kept) ||
           (json_is_string(kept) && sha256_file(from.s, sha256, c->e) &&
            strcmp(json_string_value(kept), sha256) == 0 && fs_copy(from.s, to, c->e));
}

static bool restore_one(void *ctx, const char *name)
{
    const struct copying *c = ctx;
    return restore_file(c, name, fs_path("%s/%s", c->job->out, name).s);
}

bool kept_run_read(const char *dir, const struct sandbox_job *job, struct sandbox_result *out)
{
    struct err ignored; /* what cannot be read is run */
    json_t *run = json_load_file(fs_path("%s/run.json", dir).s, 0, NULL);
    struct copying c = {dir, job, json_object_get(run, "files"), &ignored};
    bool ok = run != NULL && fs_make_dirs(job->out, &ignored) && each_file(job, restore_one, &c) &&
              restore_file(&c, "log", job->log);
    *out = (struct sandbox_result){.end = (enum sandbox_end)member_number(run, "end"),
                                   .status = (int)member_number(run, "status"),
                                   .wall_s = member_number(run, "wall_s"),
                                   .cpu_s = member_number(run, "cpu_s")};
    snprintf(out->why, sizeof out->why, "%s", member_or_empty(run, "why"));
    json_decref(run);
    return ok;
}

bool kept_run_write(const char *dir, const struct sandbox_job *job,
                    const struct sandbox_result *result, struct err *e)
{
    struct copying c = {dir, job, json_object(), e};
    json_t *run = json_pack("{si, si, sf, sf, ss, so}", "end", (int)result->end, "status",
                            result->status, "wall_s", result->wall_s, "cpu_s", result->cpu_s, "why",
                            result->why, "files", c.files);
    bool ok = fs_remove_tree(dir, e) && fs_make_dirs(dir, e) && each_file(job, keep_one, &c) &&
              keep_file(&c, "log", job->log) && json_write(fs_path("%s/run.json", dir).s, run, e);
    json_decref(run);
    return ok;
}
