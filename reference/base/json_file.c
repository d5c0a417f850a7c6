#include "json_file.h"

#include "renderer/base/fs.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

json_t *json_read(const char *path, size_t flags, json_error_t *why)
{
    struct stat st;
    FILE *f = fs_open(path);
    if (f == NULL || fstat(fileno(f), &st) != 0 || S_ISDIR(st.st_mode)) {
        *why = (json_error_t){.line = -1, .column = -1};
        snprintf(why->text, sizeof why->text, "cannot read: %s",
                 strerror(f != NULL ? EISDIR : errno));
        if (f != NULL)
            fclose(f);
        return NULL;
    }
    char mark[3];
    const bool is_marked = fread(mark, 1, 3, f) == 3 && memcmp(mark, "\xef\xbb\xbf", 3) == 0;
    if (!is_marked)
        fseek(f, 0, SEEK_SET);
    json_t *root = json_loadf(f, flags, why);
    fclose(f);
    return root;
}

json_t *json_read_or_say(const char *path, struct err *e)
{
    json_error_t why;
    json_t *root = json_read(path, JSON_REJECT_DUPLICATES, &why);
    if (root == NULL && why.line > 0)
        err_set(e, "%s:%d: %s", path, why.line, why.text);
    else if (root == NULL)
        err_set(e, "%s: %s", path, why.text);
    return root;
}

json_t *json_read_object(const char *path, struct err *e)
{
    if (access(path, F_OK) != 0)
        return json_object();
    json_t *all = json_read_or_say(path, e);
    if (all == NULL || json_is_object(all))
        return all;
    err_set(e, "%s: not a JSON object", path);
    json_decref(all);
    return NULL;
}

bool json_write_as(const char *path, const json_t *root, size_t flags, struct err *e)
{
    struct out_file out;
    /* Serialise before the file is opened: if jansson runs out of memory, the program may end
     * (tools/commands/assay.c). */
    char *text = json_dumps(root, flags);
    if (text == NULL)
        return err_set(e, "%s: cannot write JSON", path);
    bool ok = out_open(&out, path, e);
    if (ok)
        fprintf(out.f, "%s\n", text); /* out_commit() looks at the error flag */
    free(text);
    return ok && out_commit(&out, e);
}

bool json_write(const char *path, const json_t *root, struct err *e)
{
    /* 12 digits: more than the precision of any estimate here, and still readable. */
    return fs_make_parent_dirs(path, e) &&
           json_write_as(path, root, JSON_INDENT(1) | JSON_REAL_PRECISION(12), e);
}
