#include "suite.h"

#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const verdict_names[] = {
    [VERDICT_EQUIVALENT] = "EQUIVALENT",
    [VERDICT_DIFFERENT] = "DIFFERENT",
    [VERDICT_INCONCLUSIVE] = "INCONCLUSIVE",
};

const char *verdict_name(enum verdict v)
{
    return verdict_names[v];
}

bool verdict_parse(const char *name, enum verdict *out)
{
    for (size_t i = 0; i < sizeof verdict_names / sizeof *verdict_names; i++)
        if (strcmp(name, verdict_names[i]) == 0) {
            *out = (enum verdict)i;
            return true;
        }
    return false;
}

/* An object of a .json file under inspection: `at` is "" or "references.cycles.", so that
 * "<file>: key '<at><key>' ..." names any member. */
struct node {
    const char *file, *at;
    json_t *object;
};

/* Fails on a member that is not in the NULL-terminated list. */
static bool only_keys(const struct node *n, const char *const *allowed, struct err *e)
{
    const char *key;
    json_t *value;
    json_object_foreach(n->object, key, value)
    {
        const char *const *k = allowed;
        while (*k != NULL && strcmp(*k, key) != 0)
            k++;
        if (*k == NULL)
            return err_set(e, "%s: unknown key '%s%s'", n->file, n->at, key);
    }
    return true;
}

static bool get(const struct node *n, const char *key, json_t **out, struct err *e)
{
    *out = json_object_get(n->object, key);
    return *out != NULL || err_set(e, "%s: missing key '%s%s'", n->file, n->at, key);
}

static bool get_object(const struct node *n, const char *key, json_t **out, struct err *e)
{
    if (!get(n, key, out, e))
        return false;
    if (!json_is_object(*out))
        return err_set(e, "%s: '%s%s' is not an object", n->file, n->at, key);
    return true;
}

static bool get_int(const struct node *n, const char *key, int lo, int hi, int *out, struct err *e)
{
    json_t *v;
    if (!get(n, key, &v, e))
        return false;
    if (!json_is_integer(v))
        return err_set(e, "%s: '%s%s' is not a whole number", n->file, n->at, key);
    json_int_t i = json_integer_value(v);
    if (i < lo || i > hi)
        return err_set(e, "%s: '%s%s' is %" JSON_INTEGER_FORMAT ", not in %d..%d", n->file, n->at,
                       key, i, lo, hi);
    *out = (int)i;
    return true;
}

/* Margins: a share between 0 and 1, both excluded. */
static bool get_margin(const struct node *n, const char *key, double *out, struct err *e)
{
    json_t *v;
    if (!get(n, key, &v, e))
        return false;
    if (!json_is_number(v))
        return err_set(e, "%s: '%s%s' is not a number", n->file, n->at, key);
    *out = json_number_value(v);
    if (!(*out > 0 && *out < 1))
        return err_set(e, "%s: '%s%s' is %g, not between 0 and 1", n->file, n->at, key, *out);
    return true;
}

/* One line of text, neither empty nor longer than the buffer. */
static bool get_text(const struct node *n, const char *key, char *out, size_t size, struct err *e)
{
    json_t *v;
    if (!get(n, key, &v, e))
        return false;
    const char *s = json_string_value(v);
    if (s == NULL)
        return err_set(e, "%s: '%s%s' is not a text", n->file, n->at, key);
    if (*s == '\0')
        return err_set(e, "%s: '%s%s' is empty", n->file, n->at, key);
    if (strlen(s) >= size)
        return err_set(e, "%s: '%s%s' is longer than %zu bytes", n->file, n->at, key, size - 1);
    for (const char *c = s; *c != '\0'; c++)
        if ((unsigned char)*c < ' ')
            return err_set(e, "%s: '%s%s' is not one line", n->file, n->at, key);
    memcpy(out, s, strlen(s) + 1);
    return true;
}

/* The keys that every reference has and those of its engine. */
static bool read_reference(const char *file, const char *engine, json_t *object,
                           struct suite_reference *r, struct err *e)
{
    static const char *const cycles_keys[] = {"class",      "margin_global", "margin_tile",
                                              "replicates", "spp",           NULL};
    static const char *const povray_keys[] = {"class",      "margin_global", "margin_tile",
                                              "replicates", "subgrid",       NULL};
    static const char *const truth_keys[] = {"class", "margin_global", "margin_tile",
                                             "kind",  "values",        NULL};
    bool cycles = strcmp(engine, "cycles") == 0, povray = strcmp(engine, "povray") == 0;
    bool truth = strcmp(engine, "truth") == 0;
    if (!cycles && !povray && !truth)
        return err_set(e, "%s: unknown engine 'references.%s'", file, engine);
    if (!json_is_object(object))
        return err_set(e, "%s: 'references.%s' is not an object", file, engine);
    char at[64];
    snprintf(at, sizeof at, "references.%s.", engine);
    struct node n = {file, at, object};
    snprintf(r->engine, sizeof r->engine, "%s", engine);
    if (!only_keys(&n,
                   cycles   ? cycles_keys
                   : povray ? povray_keys
                            : truth_keys,
                   e) ||
        !get_text(&n, "class", r->fidelity, sizeof r->fidelity, e) ||
        !get_margin(&n, "margin_global", &r->margin_global, e) ||
        !get_margin(&n, "margin_tile", &r->margin_tile, e))
        return false;
    if (strcmp(r->fidelity, "exact") != 0 && strcmp(r->fidelity, "limit") != 0 &&
        strcmp(r->fidelity, "approximate") != 0)
        return err_set(e, "%s: '%sclass' is '%s', not 'exact', 'limit' or 'approximate'", file, at,
                       r->fidelity);
    if (truth)
        return get_text(&n, "kind", r->kind, sizeof r->kind, e) &&
               get_object(&n, "values", &r->values, e);
    /* One replicate would have no variance. */
    if (!get_int(&n, "replicates", 2, 4096, &r->replicates, e))
        return false;
    return cycles ? get_int(&n, "spp", 1, 1 << 20, &r->spp, e)
                  : get_int(&n, "subgrid", 1, 64, &r->subgrid, e);
}

static bool read_references(const char *file, json_t *object, struct suite_scene *s, struct err *e)
{
    const char *engine;
    json_t *value;
    json_object_foreach(object, engine, value)
    {
        struct suite_reference r = {0};
        if (!read_reference(file, engine, value, &r, e))
            return false;
        s->reference[s->num_references++] = r;
    }
    return s->num_references > 0 || err_set(e, "%s: 'references' is empty", file);
}

/* Everything but what a 9x scene inherits. s->name and s->dae are set, s->json is loaded. */
static bool read_scene(const char *file, struct suite_scene *s, struct err *e)
{
    static const char *const with_own[] = {"title",  "detects",    "blind_to", "width",
                                           "height", "depth",      "spp",      "tile",
                                           "expect", "references", NULL};
    static const char *const with_others[] = {"title",  "detects",       "blind_to", "width",
                                              "height", "depth",         "spp",      "tile",
                                              "expect", "references_of", NULL};
    if (!json_is_object(s->json))
        return err_set(e, "%s: not an object", file);
    bool must_differ = s->name[0] == '9';
    struct node n = {file, "", s->json};
    char expect[32];
    if (!only_keys(&n, must_differ ? with_others : with_own, e) ||
        !get_text(&n, "title", s->title, sizeof s->title, e) ||
        !get_text(&n, "detects", s->detects, sizeof s->detects, e) ||
        !get_text(&n, "blind_to", s->blind_to, sizeof s->blind_to, e) ||
        !get_int(&n, "width", 1, 16384, &s->width, e) ||
        !get_int(&n, "height", 1, 16384, &s->height, e) ||
        !get_int(&n, "depth", 0, 100, &s->depth, e) ||
        !get_int(&n, "spp", 2, 1 << 24, &s->spp, e) ||
        !get_int(&n, "tile", 1, 16384, &s->tile, e) ||
        !get_text(&n, "expect", expect, sizeof expect, e))
        return false;
    if (s->width % s->tile != 0 || s->height % s->tile != 0)
        return err_set(e, "%s: tile %d does not divide %d x %d pixels", file, s->tile, s->width,
                       s->height);
    enum verdict wanted = must_differ ? VERDICT_DIFFERENT : VERDICT_EQUIVALENT;
    if (!verdict_parse(expect, &s->expect) || s->expect != wanted)
        return err_set(e, "%s: 'expect' is '%s', but scenes of family %c must be %s", file, expect,
                       s->name[0], verdict_name(wanted));
    if (must_differ)
        return get_text(&n, "references_of", s->references_of, sizeof s->references_of, e);
    memcpy(s->references_of, s->name, sizeof s->name);
    json_t *references;
    return get_object(&n, "references", &references, e) && read_references(file, references, s, e);
}

/* "NN_name": a family digit, a digit, an underscore, then a-z, 0-9 and underscores. */
static bool is_scene_name(const char *s)
{
    if (strchr("12349", s[0]) == NULL || s[0] == '\0' || s[1] < '0' || s[1] > '9' || s[2] != '_' ||
        s[3] == '\0')
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
                       "%s/%s: not named NN_name (families 1x, 2x, 3x, 4x, 9x; a-z, 0-9, _; "
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

static bool load_scene(const char *dir, const char *name, struct suite_scene *s, struct err *e)
{
    char file[sizeof s->dae];
    memcpy(s->name, name, strlen(name) + 1);
    int length = snprintf(file, sizeof file, "%s/%s.json", dir, name);
    if (length < 0 || (size_t)length >= sizeof file)
        return err_set(e, "%s: path too long", name);
    snprintf(s->dae, sizeof s->dae, "%s/%s.dae", dir, name);
    json_error_t why;
    s->json = json_load_file(file, JSON_REJECT_DUPLICATES, &why);
    if (s->json == NULL && why.line < 1)
        return err_set(e, "%s: %s", file, why.text);
    if (s->json == NULL)
        return err_set(e, "%s:%d: %s", file, why.line, why.text);
    return read_scene(file, s, e) && sha256_file(s->dae, s->sha256, e);
}

/* A 9x scene is held against another scene's references, at the same size. */
static bool inherit(const struct suite *suite, const char *dir, struct suite_scene *s,
                    struct err *e)
{
    if (s->name[0] != '9')
        return true;
    const struct suite_scene *base = suite_find(suite, s->references_of);
    if (base == NULL)
        return err_set(e, "%s/%s.json: 'references_of' names no scene: '%s'", dir, s->name,
                       s->references_of);
    if (base->name[0] == '9')
        return err_set(e, "%s/%s.json: 'references_of' names '%s', which has none of its own", dir,
                       s->name, s->references_of);
    if (base->width != s->width || base->height != s->height)
        return err_set(e, "%s/%s.json: %d x %d pixels, but '%s' has %d x %d", dir, s->name,
                       s->width, s->height, base->name, base->width, base->height);
    memcpy(s->reference, base->reference, sizeof s->reference);
    s->num_references = base->num_references;
    return true;
}

bool suite_load(const char *dir, struct suite *out, struct err *e)
{
    struct suite suite = {0};
    struct stems stems = {0};
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
