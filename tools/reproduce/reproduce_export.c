#include "reproduce_export.h"

#include "reference/base/export_provenance.h"
#include "renderer/base/fs.h"
#include "renderer/base/shell_quote.h"
#include "tools/golden/export_job.h"
#include "reproduce_internal.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MAX_PATH = 4096 };

bool reproduce_is_export(const char *path, bool *is, struct err *e)
{
    struct export_said said;
    bool ok = export_origin_read(path, &said, e);
    *is = said.is_scene;
    export_said_free(&said);
    return ok;
}

/* then: NULL where the file does not say. */
static bool check_input(const char *path, const char *what, const char *file, const char *then,
                        const char *otherwise, struct err *e)
{
    return then != NULL ? reproduce_input(path, what, file, then, otherwise, e)
                        : err_set(e, "%s: does not say the hash of its %s", path, what);
}

static bool settings_of(const char *path, const struct export_said *said,
                        const struct reproduce_options *opt, int num, char **word,
                        struct export_job *s, struct err *e)
{
    struct err why = {""};
    if (num < 2 || strcmp(word[0], "assay") != 0 || strcmp(word[1], "export") != 0 ||
        !export_job_parse(num - 1, word + 1, s, &why))
        return err_set(e, "%s: its command is no export: %s", path, why.msg);
    if (s->help || s->scene == NULL || s->engine == EXPORT_UNKNOWN)
        return err_set(e, "%s: its command names no scene and engine", path);
    /* It is written below our own directory. */
    if (s->out != NULL && (s->out[0] == '\0' || strchr(s->out, '/') != NULL ||
                           strcmp(s->out, ".") == 0 || strcmp(s->out, "..") == 0))
        return err_set(e, "%s: its command writes '%s', which is no plain name", path, s->out);
    if (opt->scene != NULL)
        s->scene = opt->scene;
    return check_input(path, "scene", s->scene, said->scene, "give --scene, or ", e) &&
           (s->environment == NULL ||
            check_input(path, "environment", s->environment, said->environment, "", e));
}

/* A file beside the scene. */
static bool compare_beside(const char *name, const char *then, const char *now,
                           struct reproduced *out, struct err *e)
{
    bool same = out->num_different == 0;
    if (!reproduce_bytes(then, now, out, e))
        return false;
    char where[sizeof out->first];
    memcpy(where, out->first, sizeof where);
    if (same && out->num_different > 0)
        snprintf(out->first, sizeof out->first, "in '%.150s' %.140s", name, where);
    return true;
}

static bool join(char to[MAX_PATH], const char *dir, const char *name, struct err *e)
{
    return snprintf(to, MAX_PATH, "%s/%s", dir, name) < MAX_PATH ||
           err_set(e, "%.64s...: path too long", dir);
}

/* The scene `path` and the files beside it, with those in `made`, in which `name` is the scene. */
static bool compare_all(const char *path, const char *made, const char *name,
                        struct reproduced *out, struct err *e)
{
    char then[2 * MAX_PATH], now[MAX_PATH];
    if (!join(now, made, name, e) || !reproduce_bytes(path, now, out, e))
        return false;
    DIR *d = opendir(made);
    bool ok = d != NULL || err_set(e, "%s: %s", made, strerror(errno));
    for (const struct dirent *f; ok && (f = readdir(d)) != NULL;)
        if (strcmp(f->d_name, name) != 0 && strcmp(f->d_name, ".") != 0 &&
            strcmp(f->d_name, "..") != 0) {
            fs_beside_file(path, f->d_name, then, sizeof then);
            ok = join(now, made, f->d_name, e) &&
                 (access(then, R_OK) == 0 ||
                  err_set(e, "%s: '%s' is not beside it", path, f->d_name)) &&
                 compare_beside(f->d_name, then, now, out, e);
        }
    if (d != NULL)
        closedir(d);
    return ok;
}

static bool remake(const char *path, const struct export_said *said,
                   const struct reproduce_options *opt, const char *dir, struct export_job *s,
                   struct reproduced *out, struct err *e)
{
    char made[MAX_PATH], to[MAX_PATH];
    const char *name = s->out != NULL ? s->out : "again";
    out->command = export_job_command(s, s->out);
    s->out = to;
    s->version = said->version;
    s->command = said->command;
    bool ok = (out->command != NULL || err_set(e, "out of memory")) &&
              join(made, dir, "again", e) && join(to, made, name, e) &&
              (export_job_run(s, e) || err_prefix(e, "%s: made again", path)) &&
              compare_all(path, made, name, out, e);
    err_hide_controls(out->first);
    s->version = s->command = NULL;
    s->out = opt->keep;
    return ok && (opt->keep == NULL || export_job_run(s, e));
}

bool reproduce_export(const char *path, const struct reproduce_options *opt, const char *dir,
                      struct reproduced *out, struct err *e)
{
    struct export_said said;
    struct export_job s;
    char **word = NULL;
    int num = 0;
    bool ok = export_origin_read(path, &said, e);
    if (ok && said.command == NULL)
        ok = err_set(e, "%s: does not say by what command it was made", path);
    if (ok && opt->pathtracer != NULL)
        ok = err_set(e, "%s: --pathtracer is for pictures", path);
    if (ok && (word = shell_quote_split(said.command, &num, e)) == NULL)
        ok = err_prefix(e, "%s", path);
    if (ok)
        snprintf(out->made_by, sizeof out->made_by, "%s", said.version != NULL ? said.version : "");
    ok = ok && settings_of(path, &said, opt, num, word, &s, e) &&
         remake(path, &said, opt, dir, &s, out, e);
    free(word);
    export_said_free(&said);
    return ok;
}
