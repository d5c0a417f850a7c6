#include "reproduce_class.h"

#include "../reference/json_file.h"
#include "grade.h"
#include "reproduce_bytes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MAX_PATH = 4096 + 64 };

static bool is_one(const char *path, const char *const *names, const char *grades,
                   char source[MAX_PATH])
{
    beside_file(path, grades, source, MAX_PATH);
    for (int i = 0; names[i] != NULL; i++)
        if (strcmp(base_of(path), names[i]) == 0)
            return access(source, F_OK) == 0;
    return false;
}

static bool source_of(const char *path, char source[MAX_PATH])
{
    return strlen(path) < 4000 && (is_one(path, grade_class_files, "grades.json", source) ||
                                   is_one(path, grade_files, "grade.json", source));
}

bool reproduce_is_of_class(const char *path)
{
    char source[MAX_PATH];
    return source_of(path, source);
}

/* OUT of OUT/grades.json and of OUT/ID/grade.json. */
static void directory_of(const char *source, const json_t *grades, char out[MAX_PATH])
{
    beside_file(source, json_is_array(grades) ? "." : "..", out, MAX_PATH);
}

bool reproduce_class(const char *path, const struct reproduce_options *opt, const char *dir,
                     struct reproduced *out, struct err *e)
{
    char source[MAX_PATH], of[MAX_PATH], to[MAX_PATH];
    json_error_t je;
    bool found = source_of(path, source);
    if (!found)
        return err_set(e, "%s: no grades beside it", path);
    if (opt->scene != NULL || opt->pathtracer != NULL)
        return err_set(e, "%s: --scene and --pathtracer are for pictures", path);
    json_t *grades = json_load_file(source, JSON_REJECT_DUPLICATES, &je);
    if (grades == NULL)
        return err_set(e, "%s:%d: %s", source, je.line, je.text);
    directory_of(source, grades, of);
    snprintf(to, sizeof to, "%.4000s/%s", dir, base_of(path));
    size_t room = strlen(source) + 32;
    out->command = malloc(room);
    bool ok = out->command != NULL || err_set(e, "out of memory");
    if (ok)
        snprintf(out->command, room, "assay grade, of %s", source);
    ok = ok && grade_write_file(of, grades, base_of(path), to, e) &&
         reproduce_bytes(path, to, out, e) && reproduce_keep(to, opt, e);
    json_decref(grades);
    return ok;
}
