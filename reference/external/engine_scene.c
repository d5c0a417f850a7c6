/* Whether an engine can express a scene, and the scene in its format. */
#define _GNU_SOURCE
#include "engine_internal.h"

#include "reference/cycles/export_cycles.h"
#include "reference/mitsuba/export_mitsuba.h"
#include "reference/pbrt/export_pbrt.h"
#include "reference/povray/export_povray.h"
#include "reference/suite/features.h"

#include "renderer/base/fs.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *ending_of(enum engine_format format)
{
    switch (format) {
    case FORMAT_MITSUBA: return "xml";
    case FORMAT_PBRT: return "pbrt";
    case FORMAT_POVRAY: return "pov";
    case FORMAT_CYCLES: return "json";
    case FORMAT_DAE: break;
    }
    return "dae";
}

static bool write_text(const struct engine *en, const struct scene *s, const struct camera *c,
                       int depth, const char *path, struct err *e)
{
    struct out_file out;
    struct povray_variant plain = povray_variant_plain();
    if (!out_open(&out, path, e))
        return false;
    if (en->format == FORMAT_PBRT ? !export_pbrt(s, c, depth, out.f, e)
                                  : !export_povray(s, c, depth, &plain, out.f, e)) {
        out_abandon(&out);
        return false;
    }
    return out_commit(&out, e);
}

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
    if (!suite_open(suite, &s, &c, e))
        return false;
    /* Mitsuba's count of bounces is ours plus one whoever reads the file, and so on: that is the
     * exporter's business. depth_offset is only for {depth}. */
    bool ok = check_features(en, features_of_scene(&s, &c), e);
    if (ok && snprintf(path, PATH_SIZE, "%s/scene.%s", dir, ending_of(en->format)) >= PATH_SIZE)
        ok = err_set(e, "%.64s...: path too long", dir);
    switch (en->format) {
    case FORMAT_MITSUBA: ok = ok && export_mitsuba(&s, &c, suite->depth, path, e); break;
    case FORMAT_CYCLES: ok = ok && export_cycles(&s, &c, suite->depth, path, e); break;
    case FORMAT_PBRT:
    case FORMAT_POVRAY: ok = ok && write_text(en, &s, &c, suite->depth, path, e); break;
    case FORMAT_DAE:
        if (ok && realpath(suite->dae, path) == NULL)
            ok = err_set(e, "%s: %s", suite->dae, strerror(errno));
        break;
    }
    scene_free(&s);
    return ok;
}

bool engine_expresses(const struct engine *en, const struct suite_scene *scene, const char *dir,
                      struct err *why)
{
    char sub[PATH_SIZE], path[PATH_SIZE];
    struct err ignored;
    snprintf(sub, sizeof sub, "%s/%s-try-XXXXXX", dir, en->name);
    if (mkdtemp(sub) == NULL)
        return err_set(why, "%s: cannot make a directory in it: %s", dir, strerror(errno));
    bool ok = engine_write_scene(en, scene, sub, path, why);
    return fs_remove_tree(sub, ok ? why : &ignored) && ok;
}
