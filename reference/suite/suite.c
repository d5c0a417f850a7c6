#define _GNU_SOURCE
#include "suite.h"

#include "suite_json.h"
#include "suite_own.h"

#include "reference/base/json_file.h"
#include "renderer/collada/collada.h"
#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"

#include <dirent.h>
#include <errno.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The ending ".dae" or ".json" in the name of a scene's file; NULL for other files. */
static const char *ending_of(const char *file)
{
    const char *dot = strrchr(file, '.');
    return file[0] != '.' && dot != NULL && (strcmp(dot, ".dae") == 0 || strcmp(dot, ".json") == 0)
               ? dot
               : NULL;
}

static int is_of_scene(const struct dirent *d)
{
    return ending_of(d->d_name) != NULL;
}

static int by_bytes(const struct dirent **a, const struct dirent **b)
{
    return strcmp((*a)->d_name, (*b)->d_name);
}

/* "NN_name": a family digit, a digit, an underscore, then a-z, 0-9 and underscores. */
static bool is_scene_name(const char *s)
{
    static const char letters[] = "abcdefghijklmnopqrstuvwxyz0123456789_";
    const char *end = ending_of(s);
    return strchr("1234569", s[0]) != NULL && s[1] >= '0' && s[1] <= '9' && s[2] == '_' &&
           s + 3 + strspn(s + 3, letters) == end && end > s + 3 &&
           end - s < (ptrdiff_t)sizeof((struct suite_scene *)NULL)->name;
}

/* Checks that each scene has a .dae and a .json, which are neighbours in the sorted list. */
static bool check_files(const char *dir, struct dirent **file, int num, struct err *e)
{
    if (num == 0)
        return err_set(e, "%s: no scenes (NN_name.dae with NN_name.json)", dir);
    for (int i = 0; i < num; i++)
        if (!is_scene_name(file[i]->d_name))
            return err_set(e,
                           "%s/%s: not named NN_name (families 1x to 6x, 9x; a-z, 0-9, _; "
                           "at most 63 bytes)",
                           dir, file[i]->d_name);
    for (int i = 0; i < num; i += 2) {
        const char *name = file[i]->d_name, *end = ending_of(name);
        const int stem = (int)(end - name);
        bool dae = strcmp(end, ".dae") == 0;
        if (!dae || i + 1 == num || strncmp(name, file[i + 1]->d_name, (size_t)stem + 1) != 0)
            return err_set(e, "%s/%s: no %.*s.%s beside it", dir, name, stem, name,
                           dae ? "json" : "dae");
    }
    return true;
}

/* A hash of the hashes of all files that a scene "uses"; "" if there are none. */
static bool hash_uses(const char *dir, const struct suite_scene *s, char hex[65], struct err *e)
{
    const json_t *uses = json_object_get(s->json, "uses");
    char text[2 * 65];
    hex[0] = '\0';
    for (size_t i = 0; i < json_array_size(uses); i++) {
        const char *name = json_string_value(json_array_get(uses, i));
        char one[65];
        if (!sha256_file(name[0] == '/' ? name : fs_path("%s/%s", dir, name).s, one, e))
            return false;
        snprintf(text, sizeof text, "%s%s", hex, one);
        sha256_text(text, hex);
    }
    return true;
}

static bool hash_scene(const char *dir, struct suite_scene *s, struct err *e)
{
    char dae[65], environment[65] = "none", uses[65], text[320];
    if (!sha256_file(s->dae, dae, e) ||
        (s->environment[0] != '\0' && !sha256_file(s->environment, environment, e)) ||
        !hash_uses(dir, s, uses, e))
        return false;
    if (s->environment[0] == '\0' && s->lens_radius == 0 && uses[0] == '\0') {
        memcpy(s->sha256, dae, sizeof dae);
        return true;
    }
    snprintf(text, sizeof text, "%s environment %s lens %.17g %.17g%s%s", dae, environment,
             s->lens_radius, s->focal_distance, uses[0] != '\0' ? " uses " : "", uses);
    sha256_text(text, s->sha256);
    return true;
}

static bool load_scene(const char *dir, const char *dae, struct suite_scene *s, struct err *e)
{
    char file[sizeof s->dae];
    snprintf(s->name, sizeof s->name, "%.*s", (int)(ending_of(dae) - dae), dae);
    int length = snprintf(file, sizeof file, "%s/%s.json", dir, s->name);
    if (length < 0 || (size_t)length >= sizeof file)
        return err_set(e, "%s: path too long", s->name);
    snprintf(s->dae, sizeof s->dae, "%s/%s.dae", dir, s->name);
    s->json = json_read_or_say(file, e);
    return s->json != NULL && suite_json_read(file, s, e) && hash_scene(dir, s, e);
}

static bool inherits(const struct suite *suite, const struct suite_scene *s)
{
    return suite->is_own ? strcmp(s->references_of, s->name) != 0 : s->name[0] == '9';
}

/* A 9x scene is compared with another scene's references, at the same size. */
static bool inherit(const struct suite *suite, const char *dir, struct suite_scene *s,
                    struct err *e)
{
    if (!inherits(suite, s))
        return true;
    const struct path file = suite->is_own ? fs_path("%s/suite.json: scenes.%s", dir, s->name)
                                           : fs_path("%s/%s.json", dir, s->name);
    const struct suite_scene *base = suite_find(suite, s->references_of);
    if (base == NULL)
        return err_set(e, "%s: 'references_of' names no scene: '%s'", file.s, s->references_of);
    if (inherits(suite, base))
        return err_set(e, "%s: 'references_of' names '%s', which has none of its own", file.s,
                       s->references_of);
    if (base->width != s->width || base->height != s->height)
        return err_set(e, "%s: %d x %d pixels, but '%s' has %d x %d", file.s, s->width, s->height,
                       base->name, base->width, base->height);
    memcpy(s->reference, base->reference, sizeof s->reference);
    s->num_references = base->num_references;
    s->not_expressible = base->not_expressible;
    return true;
}

static bool load_own(const char *dir, struct suite *out, struct err *e)
{
    struct suite suite = {0};
    bool ok = suite_own_read(dir, &suite, e);
    for (int i = 0; ok && i < suite.num_scenes; i++)
        ok = hash_scene(dir, &suite.scene[i], e);
    for (int i = 0; ok && i < suite.num_scenes; i++)
        ok = inherit(&suite, dir, &suite.scene[i], e);
    if (ok)
        *out = suite;
    else
        suite_free(&suite);
    return ok;
}

bool suite_load(const char *dir, struct suite *out, struct err *e)
{
    struct suite suite = {0};
    struct dirent **file;
    if (suite_own_is(dir))
        return load_own(dir, out, e);
    int num = scandir(dir, &file, is_of_scene, by_bytes);
    if (num < 0)
        return err_set(e, "%s: %s", dir, strerror(errno));
    bool ok = check_files(dir, file, num, e);
    suite.scene = ok ? calloc((size_t)num / 2, sizeof *suite.scene) : NULL;
    ok = ok && (suite.scene != NULL || err_set(e, "%s: out of memory", dir));
    suite.num_scenes = ok ? num / 2 : 0;
    for (int i = 0; ok && i < suite.num_scenes; i++)
        ok = load_scene(dir, file[(size_t)i * 2]->d_name, &suite.scene[i], e);
    for (int i = 0; ok && i < suite.num_scenes; i++)
        ok = inherit(&suite, dir, &suite.scene[i], e);
    for (int i = 0; i < num; i++)
        free(file[i]);
    free(file);
    if (ok)
        *out = suite;
    else
        suite_free(&suite);
    return ok;
}

bool suite_open(const struct suite_scene *s, struct scene *scene, struct camera *camera,
                struct err *e)
{
    *scene = (struct scene){0};
    if (s->is_opaque)
        return err_set(
            e, "%s: not COLLADA: only an engine with \"format\": \"file\" reads such a scene",
            s->dae);
    if (!collada_load(s->dae, DIALECT_AUTO, scene, e))
        return false;
    bool ok = (s->environment[0] == '\0' || scene_read_environment(scene, s->environment, e)) &&
              (camera_init(camera, scene, s->width, s->height, e) || err_prefix(e, "%s", s->dae));
    if (!ok) {
        scene_free(scene);
        return false;
    }
    camera->lens_radius = (float)s->lens_radius;
    camera->focal_distance = (float)s->focal_distance;
    camera->filter = s->filter;
    return true;
}

void suite_free(struct suite *s)
{
    for (int i = 0; i < s->num_scenes; i++)
        json_decref(s->scene[i].json);
    free(s->scene);
    *s = (struct suite){0};
}

const struct suite_scene *suite_find(const struct suite *s, const char *name)
{
    for (int i = 0; i < s->num_scenes; i++)
        if (strcmp(s->scene[i].name, name) == 0)
            return &s->scene[i];
    return NULL;
}

const struct suite_reference *suite_reference_of(const struct suite_scene *s, const char *engine)
{
    for (int i = 0; i < s->num_references; i++)
        if (strcmp(s->reference[i].engine, engine) == 0)
            return &s->reference[i];
    return NULL;
}
