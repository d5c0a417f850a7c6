#include "suite_json.h"

#include "reference/base/json_node.h"

#include <stdio.h>
#include <string.h>

const char *const verdict_names[] = {
    [VERDICT_EQUIVALENT] = "EQUIVALENT",
    [VERDICT_DIFFERENT] = "DIFFERENT",
    [VERDICT_NOTHING_FOUND] = "NO DIFFERENCE FOUND",
    [VERDICT_INCONCLUSIVE] = "INCONCLUSIVE",
    NULL,
};

bool verdict_decides(enum verdict v)
{
    return v == VERDICT_EQUIVALENT || v == VERDICT_DIFFERENT;
}

const char *verdict_name(enum verdict v)
{
    return verdict_names[v];
}

bool verdict_parse(const char *name, enum verdict *out)
{
    for (size_t i = 0; verdict_names[i] != NULL; i++)
        if (strcmp(name, verdict_names[i]) == 0) {
            *out = (enum verdict)i;
            return true;
        }
    return false;
}

bool suite_noise_is_known(const char *kind)
{
    return strcmp(kind, "rectangle_over_plane") == 0;
}

bool suite_json_check_class(const struct json_node *n, const struct suite_reference *r,
                            struct err *e)
{
    return strcmp(r->fidelity, "exact") == 0 || strcmp(r->fidelity, "limit") == 0 ||
           strcmp(r->fidelity, "approximate") == 0 ||
           err_set(e, "%s: '%sclass' is '%s', not 'exact', 'limit' or 'approximate'", n->file,
                   n->at, r->fidelity);
}

/* At least two replicates: one has no variance. */
bool suite_json_read_settings(const struct json_node *n, const struct engine_kind *kind,
                              struct suite_reference *r, struct err *e)
{
    if (kind == NULL)
        return json_get_text(n, "kind", r->kind, sizeof r->kind, e) &&
               json_get_object(n, "values", &r->values, e);
    return json_get_int(n, "replicates", 2, 4096, &r->replicates, e) &&
           (kind->subgrid ? json_get_int(n, "subgrid", 1, 64, &r->subgrid, e)
                          : json_get_int(n, "spp", 1, 1 << 20, &r->spp, e));
}

/* The keys that every reference has and those of its engine. */
static bool read_reference(const char *file, const char *engine, json_t *object,
                           struct suite_reference *r, struct err *e)
{
    const struct engine_kind *kind = engine_with_goldens(engine);
    bool truth = strcmp(engine, "truth") == 0, subgrid = kind != NULL && kind->subgrid;
    const char *const keys[] = {"class",
                                "margin_global",
                                "margin_tile",
                                truth ? "kind" : "replicates",
                                truth     ? "values"
                                : subgrid ? "subgrid"
                                          : "spp",
                                NULL};
    if (kind == NULL && !truth)
        return err_set(e, "%s: unknown engine 'references.%s'", file, engine);
    if (!json_is_object(object))
        return err_set(e, "%s: 'references.%s' is not an object", file, engine);
    char at[64];
    snprintf(at, sizeof at, "references.%s.", engine);
    struct json_node n = {file, at, object};
    snprintf(r->engine, sizeof r->engine, "%s", engine);
    return json_only_keys(&n, keys, e) &&
           json_get_text(&n, "class", r->fidelity, sizeof r->fidelity, e) &&
           json_get_number(&n, "margin_global", 0, 1, &r->margin_global, e) &&
           json_get_number(&n, "margin_tile", 0, 1, &r->margin_tile, e) &&
           suite_json_check_class(&n, r, e) && suite_json_read_settings(&n, kind, r, e);
}

static bool read_references(const char *file, json_t *object, struct suite_scene *s, struct err *e)
{
    const char *engine;
    json_t *value;
    json_object_foreach(object, engine, value) {
        struct suite_reference r = {0};
        if (!read_reference(file, engine, value, &r, e))
            return false;
        s->reference[s->num_references++] = r;
    }
    return s->num_references > 0 || err_set(e, "%s: 'references' is empty", file);
}

/* A file beside the .json: no directories. */
static bool read_environment(const struct json_node *n, struct suite_scene *s, struct err *e)
{
    char name[256];
    if (!json_has(n, "environment"))
        return true;
    if (!json_get_text(n, "environment", name, sizeof name, e))
        return false;
    if (strchr(name, '/') != NULL)
        return err_set(e, "%s: 'environment' is '%s', not a file beside it", n->file, name);
    const char *slash = strrchr(n->file, '/');
    int dir = slash != NULL ? (int)(slash - n->file) + 1 : 0;
    int length = snprintf(s->environment, sizeof s->environment, "%.*s%s", dir, n->file, name);
    return (length > 0 && (size_t)length < sizeof s->environment) ||
           err_set(e, "%s: path too long", name);
}

/* Files beside the .json, which suite.c includes in the scene's hash. */
static bool check_uses(const struct json_node *n, struct err *e)
{
    const json_t *list = json_object_get(n->object, "uses");
    if (list != NULL && !json_is_array(list))
        return err_set(e, "%s: 'uses' is not a list of files", n->file);
    for (size_t i = 0; i < json_array_size(list); i++) {
        const char *name = json_string_value(json_array_get(list, i));
        if (name == NULL || name[0] == '\0' || strchr(name, '/') != NULL)
            return err_set(e, "%s: 'uses' [%zu] is not a file beside it", n->file, i);
    }
    return true;
}

bool suite_json_read_lens(const struct json_node *n, struct suite_scene *s, struct err *e)
{
    return (!json_has(n, "lens_radius") && !json_has(n, "focal_distance")) ||
           (json_get_number(n, "lens_radius", 0, 1e6, &s->lens_radius, e) &&
            json_get_number(n, "focal_distance", 0, 1e9, &s->focal_distance, e));
}

static bool read_variant(const char *file, int i, json_t *object, struct suite_variant *v,
                         struct err *e)
{
    static const char *const keys[] = {"name",          "options",     "spp",
                                       "margin_global", "margin_tile", NULL};
    const size_t most = sizeof v->options / sizeof *v->options - 1;
    char at[32], name[32];
    snprintf(at, sizeof at, "variants[%d].", i);
    struct json_node n = {file, at, object};
    json_t *options, *option;
    size_t k;
    if (!json_is_object(object))
        return err_set(e, "%s: 'variants[%d]' is not an object", file, i);
    if (!json_only_keys(&n, keys, e) || !json_get_text(&n, "name", name, sizeof name, e) ||
        !json_get_int(&n, "spp", 2, 1 << 24, &v->spp, e) ||
        !json_get_number(&n, "margin_global", 0, 1, &v->margin_global, e) ||
        !json_get_number(&n, "margin_tile", 0, 1, &v->margin_tile, e) ||
        !json_get(&n, "options", &options, e))
        return false;
    if (name[strspn(name, "abcdefghijklmnopqrstuvwxyz0123456789_")] != '\0')
        return err_set(e, "%s: '%sname' is '%s': only a-z, 0-9 and _", file, at, name);
    snprintf(v->name, sizeof v->name, "pathtracer-%s", name);
    if (json_array_size(options) == 0 || json_array_size(options) > most)
        return err_set(e, "%s: '%soptions' is not an array of 1 to %zu texts", file, at, most);
    json_array_foreach(options, k, option) {
        v->options[k] = json_string_value(option);
        if (v->options[k] == NULL)
            return err_set(e, "%s: '%soptions' holds what is not a text", file, at);
    }
    return true;
}

static bool read_variants(const struct json_node *n, struct suite_scene *s, struct err *e)
{
    json_t *array = json_object_get(n->object, "variants"), *value;
    size_t i;
    if (array == NULL)
        return true;
    if (json_array_size(array) == 0 || json_array_size(array) > MAX_VARIANTS)
        return err_set(e, "%s: 'variants' is not an array of 1 to %d", n->file, MAX_VARIANTS);
    json_array_foreach(array, i, value) {
        if (!read_variant(n->file, (int)i, value, &s->variant[i], e))
            return false;
        s->num_variants++;
    }
    return true;
}

static bool read_consistency(const struct json_node *n, struct suite_scene *s, struct err *e)
{
    static const char *const keys[] = {"renders",  "spp",   "margin", "noise_margin",
                                       "adaptive", "parts", NULL};
    static const char *const adaptive_keys[] = {"batch", "tolerance", "spp", NULL};
    struct json_node c = {n->file, "consistency.", NULL};
    struct json_node a = {n->file, "consistency.adaptive.", NULL};
    if (!json_has(n, "consistency"))
        return true;
    if (!json_get_object(n, "consistency", &c.object, e) || !json_only_keys(&c, keys, e) ||
        !json_get_int(&c, "renders", 4, 256, &s->consistency.renders, e) ||
        !json_get_int(&c, "spp", 2, 1 << 16, &s->consistency.spp, e) ||
        !json_get_number(&c, "margin", 0, 10, &s->consistency.margin, e) ||
        !json_may_number(&c, "noise_margin", 0, 10, &s->consistency.noise_margin, e) ||
        !json_may_int(&c, "parts", 1, s->consistency.spp - 1, &s->consistency.parts, e))
        return false;
    return !json_has(&c, "adaptive") ||
           (json_get_object(&c, "adaptive", &a.object, e) && json_only_keys(&a, adaptive_keys, e) &&
            json_get_int(&a, "batch", 2, 1 << 16, &s->consistency.batch, e) &&
            json_get_int(&a, "spp", 2, 1 << 24, &s->consistency.most, e) &&
            json_get_number(&a, "tolerance", 0, 1, &s->consistency.tolerance, e));
}

static bool check_noise(const char *file, const struct suite_scene *s, struct err *e)
{
    for (int i = 0; i < s->num_references; i++)
        if (suite_noise_is_known(s->reference[i].kind))
            return true;
    return s->consistency.noise_margin == 0 ||
           err_set(e, "%s: 'consistency.noise_margin' needs a truth whose noise is known", file);
}

/* An engine has a reference or a reason why it has none, not both. */
static bool read_not_expressible(const struct json_node *n, struct suite_scene *s, struct err *e)
{
    if (!json_has(n, "not_expressible"))
        return true;
    if (!json_get_object(n, "not_expressible", &s->not_expressible, e))
        return false;
    struct json_node reasons = {n->file, "not_expressible.", s->not_expressible};
    if (!json_only_keys(&reasons, engine_names, e))
        return false;
    const char *engine;
    json_t *value;
    json_object_foreach(s->not_expressible, engine, value) {
        char reason[256];
        if (!json_get_text(&reasons, engine, reason, sizeof reason, e))
            return false;
        for (int i = 0; i < s->num_references; i++)
            if (strcmp(s->reference[i].engine, engine) == 0)
                return err_set(e, "%s: '%s' is both a reference and not expressible", n->file,
                               engine);
    }
    return true;
}

bool suite_json_read(const char *file, struct suite_scene *s, struct err *e)
{
    static const char *const keys[] = {"title",       "detects",
                                       "blind_to",    "width",
                                       "height",      "depth",
                                       "spp",         "tile",
                                       "expect",      "environment",
                                       "lens_radius", "focal_distance",
                                       "references",  "not_expressible",
                                       "variants",    "consistency",
                                       "convention",  "uses",
                                       NULL};
    static const char *const keys_9x[] = {
        "title", "detects", "blind_to",    "width",       "height",         "depth",         "spp",
        "tile",  "expect",  "environment", "lens_radius", "focal_distance", "references_of", NULL};
    if (!json_is_object(s->json))
        return err_set(e, "%s: not an object", file);
    bool must_differ = s->name[0] == '9';
    struct json_node n = {file, "", s->json};
    char expect[32];
    if (!json_only_keys(&n, must_differ ? keys_9x : keys, e) ||
        !json_get_text(&n, "title", s->title, sizeof s->title, e) ||
        !json_get_text(&n, "detects", s->detects, sizeof s->detects, e) ||
        !json_get_text(&n, "blind_to", s->blind_to, sizeof s->blind_to, e) ||
        !json_may_text(&n, "convention", s->convention, sizeof s->convention, e) ||
        !json_get_int(&n, "width", 1, 16384, &s->width, e) ||
        !json_get_int(&n, "height", 1, 16384, &s->height, e) ||
        !json_get_int(&n, "depth", 0, 100, &s->depth, e) ||
        !json_get_int(&n, "spp", 2, 1 << 24, &s->spp, e) ||
        !json_get_int(&n, "tile", 1, 16384, &s->tile, e) ||
        !json_get_text(&n, "expect", expect, sizeof expect, e))
        return false;
    enum verdict wanted = must_differ ? VERDICT_DIFFERENT : VERDICT_EQUIVALENT;
    if (!verdict_parse(expect, &s->expect) || s->expect != wanted)
        return err_set(e, "%s: 'expect' is '%s', but scenes of family %c must be %s", file, expect,
                       s->name[0], verdict_name(wanted));
    if (!check_uses(&n, e) || !read_environment(&n, s, e) || !suite_json_read_lens(&n, s, e) ||
        !read_variants(&n, s, e) || !read_consistency(&n, s, e))
        return false;
    if (must_differ)
        return json_get_text(&n, "references_of", s->references_of, sizeof s->references_of, e);
    memcpy(s->references_of, s->name, sizeof s->name);
    json_t *references;
    return json_get_object(&n, "references", &references, e) &&
           read_references(file, references, s, e) && read_not_expressible(&n, s, e) &&
           check_noise(file, s, e);
}
