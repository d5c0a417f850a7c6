#include "reproduce_class.h"

#include "renderer/base/fs.h"
#include "tools/gradebook/grade_batch.h"
#include "reproduce_internal.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { MAX_PATH = 4096 + 64 };

static bool is_one(const char *path, const char *const *names, const char *grades,
                   char source[MAX_PATH])
{
    fs_beside_file(path, grades, source, MAX_PATH);
    for (int i = 0; names[i] != NULL; i++)
        if (strcmp(fs_base(path), names[i]) == 0)
            return access(source, F_OK) == 0;
    return false;
}

static bool source_of(const char *path, char source[MAX_PATH])
{
    return strlen(path) < 4000 && (is_one(path, grade_write_class, "grades.json", source) ||
                                   is_one(path, grade_write_files, "grade.json", source));
}

bool reproduce_is_of_class(const char *path)
{
    char source[MAX_PATH];
    return source_of(path, source);
}

bool reproduce_class(const char *path, const struct reproduce_options *opt, const char *dir,
                     struct reproduced *out, struct err *e)
{
    char source[MAX_PATH], of[MAX_PATH], to[MAX_PATH];
    json_error_t je;
    if (!source_of(path, source))
        return err_set(e, "%s: no grades beside it", path);
    json_t *grades = json_load_file(source, JSON_REJECT_DUPLICATES, &je);
    if (grades == NULL)
        return err_set(e, "%s:%d: %s", source, je.line, je.text);
    /* OUT of OUT/grades.json and of OUT/ID/grade.json. */
    fs_beside_file(source, json_is_array(grades) ? "." : "..", of, sizeof of);
    snprintf(to, sizeof to, "%.4000s/%s", dir, fs_base(path));
    const char *const word[] = {"assay", "grade,", "of", source, NULL};
    bool ok = reproduced_command(out, word, e) &&
              grade_write_file(of, grades, fs_base(path), to, e) &&
              reproduce_bytes(path, to, out, e) && reproduce_keep(to, opt, e);
    json_decref(grades);
    return ok;
}
