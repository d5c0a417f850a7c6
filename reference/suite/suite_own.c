#include "suite_own.h"

#include "suite_json.h"

#include "reference/base/json_file.h"
#include "reference/base/json_node.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char names[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.";

bool suite_own_is(const char *dir)
{
    char file[4096];
    int length = snprintf(file, sizeof file, "%s/suite.json", dir);
    return length > 0 && (size_t)length < sizeof file && access(file, F_OK) == 0;
}

static bool check_name(const struct json_node *n, const char *what, const char *name, size_t size,
                       struct err *e)
{
    if (name[0] != '\0' && name[0] != '.' && name[strspn(name, names)] == '\0' &&
        strlen(name) < size)
        return true;
    return err_set(e,
                   "%s: '%s%s' is no name of %s: letters, digits, _, - and . may be in it, at most "
                   "%zu, not . at the start",
                   n->file, n->at, name, what, size - 1);
}

/* A path, relative to suite.json unless absolute, of a file that can be read. */
static bool read_path(const struct json_node *n, const char *key, const char *dir, char *out,
                      size_t size, struct err *e)
{
    char name[1024];
    if (!json_get_text(n, key, name, sizeof name, e))
        return false;
    int length =
        name[0] == '/' ? snprintf(out, size, "%s", name) : snprintf(out, size, "%s/%s", dir, name);
    if (length < 0 || (size_t)length >= size)
        return err_set(e, "%s: '%s%s': path too long", n->file, n->at, key);
    return access(out, R_OK) == 0 ||
           err_set(e, "%s: '%s%s' is '%s', which cannot be read", n->file, n->at, key, out);
}

/* As in struct suite_reference. */
struct margins {
    double global, tile, variance;
};

/* "margin" is the image's, and the tile's is four times that (at most 0.99); either can be set by its own key. */
static bool read_margins(const struct json_node *n, struct margins *m, struct err *e)
{
    if (json_has(n, "margin")) {
        if (!json_get_number(n, "margin", 0, 1, &m->global, e))
            return false;
        m->tile = fmin(4 * m->global, 0.99);
    }
    return json_may_number(n, "margin_global", 0, 1, &m->global, e) &&
           json_may_number(n, "margin_tile", 0, 1, &m->tile, e) &&
           json_may_number(n, "margin_variance", 0, 100, &m->variance, e);
}

/* m: the scene's margins. */
static bool read_reference(const struct json_node *n, const char *name, struct margins m,
                           struct suite_scene *s, struct suite_reference *r, struct err *e)
{
    const struct engine_kind *kind = engine_with_goldens(name);
    const bool truth = strcmp(name, "truth") == 0, ours = strcmp(name, "pathtracer") == 0;
    const bool grid = kind != NULL && kind->subgrid;
    const char *const keys[] = {"class",
                                "margin",
                                "margin_global",
                                "margin_tile",
                                "margin_variance",
                                truth  ? "values"
                                : grid ? "subgrid"
                                       : "spp",
                                ours    ? NULL
                                : truth ? "kind"
                                        : "replicates",
                                NULL};
    snprintf(r->engine, sizeof r->engine, "%s", name);
    strcpy(r->fidelity, "exact");
    if (!json_only_keys(n, keys, e) ||
        !json_may_text(n, "class", r->fidelity, sizeof r->fidelity, e) || !read_margins(n, &m, e))
        return false;
    r->margin_global = m.global;
    r->margin_tile = m.tile;
    r->margin_variance = m.variance;
    if (!suite_json_check_class(n, r, e))
        return false;
    if (!(r->margin_global > 0) || !(r->margin_tile > 0))
        return err_set(e, "%s: '%smargin' is given neither there nor for the scene or the suite",
                       n->file, n->at);
    if (ours)
        return json_may_int(n, "spp", 2, 1 << 24, &s->spp, e);
    if (kind == NULL && !truth)
        return json_may_int(n, "replicates", 3, 4096, &r->replicates, e) &&
               json_may_int(n, "spp", 1, 1 << 24, &r->spp, e);
    return suite_json_read_settings(n, kind, r, e);
}

/* The suite's and the scene's references in one object; where both have a member, the scene's counts. null removes
 * one. */
static json_t *merge_references(const json_t *of_suite, const json_t *of_scene)
{
    json_t *all = of_suite != NULL ? json_deep_copy(of_suite) : json_object(), *value;
    const char *name;
    json_object_foreach((json_t *)of_scene, name, value) {
        json_t *mine = json_deep_copy(value);
        if (json_is_object(mine) && json_is_object(json_object_get(all, name)))
            json_object_update_missing(mine, json_object_get(all, name));
        json_object_set_new(all, name, mine);
    }
    return all;
}

static bool read_references(const struct json_node *scene, struct suite_scene *s, struct margins m,
                            struct err *e)
{
    const char *name;
    json_t *value;
    json_object_foreach(json_object_get(scene->object, "references"), name, value) {
        char at[256];
        struct suite_reference r = {0};
        snprintf(at, sizeof at, "%sreferences.", scene->at);
        const struct json_node list = {scene->file, at, NULL};
        if (json_is_null(value))
            continue;
        if (!check_name(&list, "a reference", name, sizeof r.engine, e))
            return false;
        snprintf(at, sizeof at, "%sreferences.%s.", scene->at, name);
        const struct json_node n = {scene->file, at, value};
        if (!json_is_object(value))
            return err_set(e, "%s: '%sreferences.%s' is not an object", scene->file, scene->at,
                           name);
        if (s->num_references == MAX_REFERENCES)
            return err_set(e, "%s: '%sreferences' has more than %d", scene->file, scene->at,
                           MAX_REFERENCES);
        if (!read_reference(&n, name, m, s, &r, e))
            return false;
        s->reference[s->num_references++] = r;
    }
    return s->num_references > 0 ||
           err_set(e, "%s: '%sreferences' is empty, and the suite has none for all scenes",
                   scene->file, scene->at);
}

static bool read_uses(const struct json_node *n, struct err *e)
{
    const json_t *list = json_object_get(n->object, "uses");
    if (list != NULL && !json_is_array(list))
        return err_set(e, "%s: '%suses' is not a list of files", n->file, n->at);
    for (size_t i = 0; i < json_array_size(list); i++)
        if (!json_is_string(json_array_get(list, i)))
            return err_set(e, "%s: '%suses' [%zu] is not a text", n->file, n->at, i);
    return true;
}

static bool read_expected(const struct json_node *n, struct suite_scene *s, struct err *e)
{
    char expect[32] = "EQUIVALENT";
    strcpy(s->references_of, s->name);
    if (!json_may_text(n, "references_of", s->references_of, sizeof s->references_of, e) ||
        !json_may_text(n, "expect", expect, sizeof expect, e))
        return false;
    return (verdict_parse(expect, &s->expect) && verdict_decides(s->expect)) ||
           err_set(e, "%s: '%sexpect' is '%s', not 'EQUIVALENT' or 'DIFFERENT'", n->file, n->at,
                   expect);
}

/* s->name and s->json are set; m: the suite's margins. */
static bool read_scene(const struct json_node *n, const char *dir, struct margins m,
                       struct suite_scene *s, struct err *e)
{
    static const char *const keys[] = {
        "file",        "uses",          "width",         "height",
        "depth",       "tile",          "margin",        "references",
        "margin_tile", "margin_global", "title",         "detects",
        "expect",      "blind_to",      "environment",   "focal_distance",
        "convention",  "lens_radius",   "references_of", "margin_variance",
        NULL};
    s->tile = 16;
    s->depth = 5;
    s->spp = 256;
    snprintf(s->title, sizeof s->title, "%s", s->name);
    if (!json_only_keys(n, keys, e) || !read_path(n, "file", dir, s->dae, sizeof s->dae, e) ||
        !read_uses(n, e) || !json_get_int(n, "width", 1, 16384, &s->width, e) ||
        !json_get_int(n, "height", 1, 16384, &s->height, e) ||
        !json_may_int(n, "depth", 0, 100, &s->depth, e) ||
        !json_may_int(n, "tile", 1, 16384, &s->tile, e) ||
        !json_may_text(n, "title", s->title, sizeof s->title, e) ||
        !json_may_text(n, "detects", s->detects, sizeof s->detects, e) ||
        !json_may_text(n, "blind_to", s->blind_to, sizeof s->blind_to, e) ||
        !json_may_text(n, "convention", s->convention, sizeof s->convention, e) ||
        !read_expected(n, s, e) || !read_margins(n, &m, e))
        return false;
    const char *dot = strrchr(s->dae, '.');
    s->is_opaque = dot == NULL || strcmp(dot, ".dae") != 0;
    for (size_t i = 0; s->is_opaque && i < 3; i++) {
        static const char *const of_dae[] = {"environment", "lens_radius", "focal_distance"};
        if (json_has(n, of_dae[i]))
            return err_set(e, "%s: '%s%s' is for scenes in COLLADA (.dae)", n->file, n->at,
                           of_dae[i]);
    }
    if (json_has(n, "environment") &&
        !read_path(n, "environment", dir, s->environment, sizeof s->environment, e))
        return false;
    return suite_json_read_lens(n, s, e) &&
           (strcmp(s->references_of, s->name) != 0 || read_references(n, s, m, e));
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct suite_scene *)a)->name, ((const struct suite_scene *)b)->name);
}

static bool read_scenes(const struct json_node *n, const char *dir, json_t *scenes,
                        struct suite *out, struct err *e)
{
    struct margins m = {0};
    const json_t *references = json_object_get(n->object, "references");
    json_t *value;
    const char *name;
    if (!read_margins(n, &m, e))
        return false;
    json_object_foreach(scenes, name, value) {
        char at[256];
        struct suite_scene *s = &out->scene[out->num_scenes++];
        const struct json_node list = {n->file, "scenes.", NULL};
        if (!check_name(&list, "a scene", name, sizeof s->name, e))
            return false;
        strcpy(s->name, name);
        snprintf(at, sizeof at, "scenes.%s.", name);
        s->json = json_copy(value);
        const struct json_node scene = {n->file, at, s->json};
        if (!json_is_object(value))
            return err_set(e, "%s: 'scenes.%s' is not an object", n->file, name);
        if (json_has(&scene, "references") && !json_is_object(json_object_get(value, "references")))
            return err_set(e, "%s: 'scenes.%s.references' is not an object", n->file, name);
        if (json_has(&scene, "references") || !json_has(&scene, "references_of"))
            json_object_set_new(s->json, "references",
                                merge_references(references, json_object_get(value, "references")));
        if (!read_scene(&scene, dir, m, s, e))
            return false;
    }
    return true;
}

bool suite_own_read(const char *dir, struct suite *out, struct err *e)
{
    static const char *const keys[] = {
        "version",         "engine",     "margin", "margin_global", "margin_tile",
        "margin_variance", "references", "scenes", "comment",       NULL};
    char file[4096], comment[4096];
    int version = 1;
    int length = snprintf(file, sizeof file, "%s/suite.json", dir);
    if (length < 0 || (size_t)length >= sizeof file)
        return err_set(e, "%.64s...: path too long", dir);
    json_t *root = json_read_or_say(file, e), *scenes;
    if (root == NULL)
        return false;
    const struct json_node n = {file, "", root};
    bool ok = json_is_object(root) || err_set(e, "%s: not an object", file);
    ok = ok && json_only_keys(&n, keys, e) && json_may_int(&n, "version", 1, 1, &version, e) &&
         json_may_text(&n, "comment", comment, sizeof comment, e) &&
         (!json_has(&n, "references") || json_is_object(json_object_get(root, "references")) ||
          err_set(e, "%s: 'references' is not an object", file)) &&
         (!json_has(&n, "engine") ||
          read_path(&n, "engine", dir, out->engine, sizeof out->engine, e)) &&
         json_get_object(&n, "scenes", &scenes, e) &&
         (json_object_size(scenes) > 0 || err_set(e, "%s: 'scenes' is empty", file));
    if (ok) {
        out->is_own = true;
        out->scene = calloc(json_object_size(scenes), sizeof *out->scene);
        ok = (out->scene != NULL || err_set(e, "%s: out of memory", file)) &&
             read_scenes(&n, dir, scenes, out, e);
    }
    if (ok)
        qsort(out->scene, (size_t)out->num_scenes, sizeof *out->scene, by_name);
    json_decref(root);
    return ok;
}
