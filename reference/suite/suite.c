#include "suite.h"

#include "suite_json.h"
#include "suite_own.h"

#include "reference/base/json_file.h"
#include "renderer/collada/collada.h"
#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"

#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* "NN_name": a family digit, a digit, an underscore, then a-z, 0-9 and underscores. */
static bool is_scene_name(const char *s)
{
    if (strchr("1234569", s[0]) == NULL || s[0] == '\0' || s[1] < '0' || s[1] > '9' ||
        s[2] != '_' || s[3] == '\0')
        return false;
    return s[3 + strspn(s + 3, "abcdefghijklmnopqrstuvwxyz0123456789_")] == '\0';
}

/* Name without the extension, and which of the two files were seen. */
struct stem {
    char name[64];
    bool dae, json;
};

struct stems {
    struct stem *stem;
    size_t num;
};

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct stem *)a)->name, ((const struct stem *)b)->name);
}

static bool note_file(struct stems *s, const char *dir, const char *file, struct err *e)
{
    const char *dot = strrchr(file, '.');
    bool dae = dot != NULL && strcmp(dot, ".dae") == 0;
    bool json = dot != NULL && strcmp(dot, ".json") == 0;
    if (file[0] == '.' || (!dae && !json))
        return true;
    struct stem new = {.dae = dae, .json = json};
    size_t length = (size_t)(dot - file);
    if (length < sizeof new.name)
        memcpy(new.name, file, length);
    if (!is_scene_name(new.name))
        return err_set(e,
                       "%s/%s: not named NN_name (families 1x to 6x, 9x; a-z, 0-9, _; "
                       "at most 63 bytes)",
                       dir, file);
    for (size_t i = 0; i < s->num; i++)
        if (strcmp(s->stem[i].name, new.name) == 0) {
            s->stem[i].dae |= dae;
            s->stem[i].json |= json;
            return true;
        }
    struct stem *grown = realloc(s->stem, (s->num + 1) * sizeof *grown);
    if (grown == NULL)
        return err_set(e, "%s: out of memory", dir);
    s->stem = grown;
    s->stem[s->num++] = new;
    return true;
}

/* Scene names of a directory, sorted, each with both files. The caller frees out->stem, also on
 * failure. */
static bool list_scenes(const char *dir, struct stems *out, struct err *e)
{
    DIR *d = opendir(dir);
    if (d == NULL)
        return err_set(e, "%s: %s", dir, strerror(errno));
    bool ok = true;
    struct dirent *entry;
    while (ok && (errno = 0, entry = readdir(d)) != NULL)
        ok = note_file(out, dir, entry->d_name, e);
    if (ok && errno != 0)
        ok = err_set(e, "%s: %s", dir, strerror(errno));
    closedir(d);
    if (!ok)
        return false;
    if (out->num == 0)
        return err_set(e, "%s: no scenes (NN_name.dae with NN_name.json)", dir);
    if (out->num > INT_MAX)
        return err_set(e, "%s: too many scenes", dir);
    qsort(out->stem, out->num, sizeof *out->stem, by_name);
    for (size_t i = 0; i < out->num; i++)
        if (!out->stem[i].dae || !out->stem[i].json)
            return err_set(e, "%s/%s.%s: no %s.%s beside it", dir, out->stem[i].name,
                           out->stem[i].dae ? "dae" : "json", out->stem[i].name,
                           out->stem[i].dae ? "json" : "dae");
    return true;
}

/* Of the hashes of all files that a scene of one's own uses besides; "" if there are none. */
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

static bool load_scene(const char *dir, const char *name, struct suite_scene *s, struct err *e)
{
    char file[sizeof s->dae];
    memcpy(s->name, name, strlen(name) + 1);
    int length = snprintf(file, sizeof file, "%s/%s.json", dir, name);
    if (length < 0 || (size_t)length >= sizeof file)
        return err_set(e, "%s: path too long", name);
    snprintf(s->dae, sizeof s->dae, "%s/%s.dae", dir, name);
    s->json = json_read_or_say(file, e);
    return s->json != NULL && suite_json_read(file, s, e) && hash_scene(dir, s, e);
}

static bool inherits(const struct suite *suite, const struct suite_scene *s)
{
    return suite->is_own ? strcmp(s->references_of, s->name) != 0 : s->name[0] == '9';
}

/* A 9x scene is held against another scene's references, at the same size. */
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
    struct stems stems = {0};
    if (suite_own_is(dir))
        return load_own(dir, out, e);
    if (!list_scenes(dir, &stems, e))
        goto fail;
    suite.scene = calloc(stems.num, sizeof *suite.scene);
    if (suite.scene == NULL) {
        err_set(e, "%s: out of memory", dir);
        goto fail;
    }
    suite.num_scenes = (int)stems.num;
    for (size_t i = 0; i < stems.num; i++)
        if (!load_scene(dir, stems.stem[i].name, &suite.scene[i], e))
            goto fail;
    for (size_t i = 0; i < stems.num; i++)
        if (!inherit(&suite, dir, &suite.scene[i], e))
            goto fail;
    free(stems.stem);
    *out = suite;
    return true;
fail:
    free(stems.stem);
    suite_free(&suite);
    return false;
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
