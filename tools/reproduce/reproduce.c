#include "reproduce.h"

#include "reproduce_internal.h"
#include "renderer/base/fs.h"
#include "tools/base/temp_dir.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <stdlib.h>

void reproduced_free(struct reproduced *r)
{
    free(r->command);
    *r = (struct reproduced){0};
}

/* Is the file JSON, to judge by its first byte, rather than an EXR? */
static bool is_results(const char *path, bool *is, struct err *e)
{
    FILE *f = fs_open(path);
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    int first = getc(f);
    fclose(f);
    *is = first == '{' || first == '[';
    return true;
}

static bool make_again(const char *path, const struct reproduce_options *opt, const char *dir,
                       struct reproduced *out, struct err *e)
{
    bool is = false;
    if (!is_results(path, &is, e))
        return false;
    if (!is)
        return rerender(path, opt, dir, out, e);
    if (opt->scene != NULL || opt->pathtracer != NULL)
        return err_set(e, "%s: --scene and --pathtracer are for renders", path);
    return reproduce_results(path, opt, dir, out, e);
}

bool reproduce(const char *path, const struct reproduce_options *opt, struct reproduced *out,
               struct err *e)
{
    struct err ignored;
    struct temp_dir dir;
    *out = (struct reproduced){0};
    if (!temp_dir_open(&dir, "reproduce", e))
        return false;
    bool ok = make_again(path, opt, dir.path, out, e);
    if (!ok)
        reproduced_free(out);
    bool removed = temp_dir_close(&dir, &ignored);
    (void)removed; /* if not, the next run removes it */
    return ok;
}
