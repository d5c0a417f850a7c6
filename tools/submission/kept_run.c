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

/* Copies a file if it is there. */
static bool copy_one(const char *name, const char *from, const char *to, struct err *e)
{
    const struct path a = fs_path("%s/%s", from, name);
    return access(a.s, R_OK) != 0 || fs_copy(a.s, fs_path("%s/%s", to, name).s, e);
}

static bool copy_all(const struct sandbox_job *job, const char *from, const char *to, struct err *e)
{
    bool ok = !job->keep_tree || copy_one("tree.tar", from, to, e);
    for (const char *const *name = job->keep; ok && name != NULL && *name != NULL; name++)
        ok = copy_one(*name, from, to, e);
    return ok;
}

bool kept_run_read(const char *dir, const struct sandbox_job *job, struct sandbox_result *out)
{
    struct err ignored; /* what cannot be read is run */
    json_t *run = json_load_file(fs_path("%s/run.json", dir).s, 0, NULL);
    bool ok = run != NULL && fs_make_dirs(job->out, &ignored) &&
              copy_all(job, dir, job->out, &ignored) &&
              fs_copy(fs_path("%s/log", dir).s, job->log, &ignored);
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
    json_t *run =
        json_pack("{si, si, sf, sf, ss}", "end", (int)result->end, "status", result->status,
                  "wall_s", result->wall_s, "cpu_s", result->cpu_s, "why", result->why);
    bool ok = fs_remove_tree(dir, e) && fs_make_dirs(dir, e) && copy_all(job, job->out, dir, e) &&
              fs_copy(job->log, fs_path("%s/log", dir).s, e) &&
              json_write(fs_path("%s/run.json", dir).s, run, e);
    json_decref(run);
    return ok;
}
