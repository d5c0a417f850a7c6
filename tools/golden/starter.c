#include "starter.h"

#include "renderer/base/fs.h"
#include "renderer/base/shell_quote.h"

#include <errno.h>
#include <limits.h>
#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* File in the folder, its source in share_dir, and its mode. */
static const struct {
    const char *to, *from;
    mode_t mode;
} files[] = {
    {"suite.json", "starter/suite.json", 0644},
    {"mine.json", "starter/mine.json", 0644},
    {"mine.sh", "starter/mine.sh", 0755},
    {"scenes/cornell.dae", "scenes/41_cornell.dae", 0644},
    {"renders.yml", "starter/renders.yml", 0644},
    {"README.md", "starter/README.md", 0644},
    {".gitignore", "starter/gitignore", 0644},
};

static bool put(FILE *out, const char *line, const char *name, const char *bin)
{
    for (const char *at; (at = strchr(line, '@')) != NULL;) {
        const char *value = strncmp(at, "@NAME@", 6) == 0  ? name
                            : strncmp(at, "@BIN@", 5) == 0 ? bin
                                                           : NULL;
        int before = (int)(at - line) + (value == NULL);
        if (fprintf(out, "%.*s%s", before, line, value != NULL ? value : "") < 0)
            return false;
        line = value == NULL ? at + 1 : at + (value == name ? 6 : 5);
    }
    return fputs(line, out) >= 0;
}

static bool copy(const char *from, const char *to, mode_t mode, const char *name, const char *bin,
                 struct err *e)
{
    char line[4096];
    struct out_file out;
    FILE *in = fopen(from, "r");
    if (in == NULL)
        return err_set(e, "%s: %s", from, strerror(errno));
    bool ok = fs_make_parent_dirs(to, e) && out_open(&out, to, e);
    if (ok) {
        bool whole = true;
        while (whole && fgets(line, sizeof line, in) != NULL)
            whole = put(out.f, line, name, bin);
        if (!whole || ferror(in)) {
            out_abandon(&out);
            ok = err_set(e, "cannot copy %s to %s", from, to);
        } else {
            ok = out_commit(&out, e) &&
                 (chmod(to, mode) == 0 || err_set(e, "%s: %s", to, strerror(errno)));
        }
    }
    fclose(in);
    return ok;
}

bool starter_write(const char *dir, const char *share_dir, struct err *e)
{
    char full[PATH_MAX], program[PATH_MAX];
    const size_t num = sizeof files / sizeof *files;
    for (size_t i = 0; i < num; i++) {
        const struct path to = fs_path("%s/%s", dir, files[i].to);
        if (access(to.s, F_OK) == 0)
            return err_set(e, "%s is there already: init writes into a new folder", to.s);
    }
    if (!fs_make_dirs(dir, e))
        return false;
    if (realpath(dir, full) == NULL || realpath(fs_beside_program("pathtracer").s, program) == NULL)
        return err_set(e, "%s or pathtracer beside this program: %s", dir, strerror(errno));
    char *name = shell_quote_join(NULL, (const char *[]){fs_base(full), NULL});
    char *bin = shell_quote_join(NULL, (const char *[]){dirname(program), NULL});
    bool ok = (name != NULL && bin != NULL) || err_set(e, "out of memory");
    for (size_t i = 0; ok && i < num; i++)
        ok = copy(fs_path("%s/%s", share_dir, files[i].from).s,
                  fs_path("%s/%s", dir, files[i].to).s, files[i].mode, name, bin, e);
    free(name);
    free(bin);
    if (!ok)
        starter_remove(dir);
    return ok;
}

void starter_remove(const char *dir)
{
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        unlink(fs_path("%s/%s", dir, files[i].to).s);
    rmdir(fs_path("%s/scenes", dir).s); /* unless something else is in it, or in dir */
    rmdir(dir);
}
