#include "json_file.h"

#include "renderer/base/fs.h"

bool json_write(const char *path, const json_t *root, struct err *e)
{
    struct out_file out;
    if (!fs_make_parent_dirs(path, e) || !out_open(&out, path, e))
        return false;
    /* 12 digits: more than any estimate here holds, and a file that a person can read. */
    if (json_dumpf(root, out.f, JSON_INDENT(1) | JSON_REAL_PRECISION(12)) != 0 ||
        fputc('\n', out.f) == EOF) {
        out_abandon(&out);
        return err_set(e, "%s: cannot write JSON", path);
    }
    return out_commit(&out, e);
}
