/* Whether an engine can express a scene, and the scene in its format. */
#define _GNU_SOURCE
#include "engine_internal.h"

#include "engine_bindings.h"
#include "reference/suite/features.h"

#include "renderer/base/fs.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool check_features(const struct engine *en, unsigned needed, struct err *e)
{
    char missing[256] = "";
    for (int i = 0; i < NUM_FEATURES; i++)
        if (needed & ~en->feature & 1u << i)
            snprintf(missing + strlen(missing), sizeof missing - strlen(missing), "%s%s",
                     missing[0] != '\0' ? ", " : "", feature_names[i]);
    return missing[0] == '\0' || err_set(e, "the description does not list: %s", missing);
}

bool engine_write_scene(const struct engine *en, const struct suite_scene *suite, const char *dir,
                        char path[PATH_SIZE], struct err *e)
{
    struct scene s = {0};
    struct camera c;
    if (en->takes_files)
        return realpath(suite->dae, path) != NULL ||
               err_set(e, "%s: %s", suite->dae, strerror(errno));
    if (!suite_open(suite, &s, &c, e))
        return false;
    /* Mitsuba's count of bounces is ours plus one whoever reads the file, and so on: that is the
     * exporter's business. depth_offset is only for {depth}. */
    bool ok = check_features(en, features_of_scene(&s, &c), e);
    if (ok && en->format == NULL)
        ok =
            realpath(suite->dae, path) != NULL || err_set(e, "%s: %s", suite->dae, strerror(errno));
    else if (ok && snprintf(path, PATH_SIZE, "%s/scene%s", dir, en->format->ending) >= PATH_SIZE)
        ok = err_set(e, "%.64s...: path too long", dir);
    else
        ok = ok && engine_export(en->format, &s, &c, suite->depth, path, e);
    scene_free(&s);
    return ok;
}

bool engine_expresses(const struct engine *en, const struct suite_scene *scene, const char *dir,
                      struct err *why)
{
    char path[PATH_SIZE];
    struct err ignored;
    struct path sub = fs_path("%s/%s-try-XXXXXX", dir, en->name);
    if (mkdtemp(sub.s) == NULL)
        return err_set(why, "%s: cannot make a directory in it: %s", dir, strerror(errno));
    bool ok = engine_write_scene(en, scene, sub.s, path, why);
    return fs_remove_tree(sub.s, ok ? why : &ignored) && ok;
}
