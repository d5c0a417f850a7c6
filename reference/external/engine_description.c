/* Reading an engine's description; engine_run.c does what it says. */
#include "engine_description.h"

#include "reference/base/json_file.h"
#include "reference/suite/features.h"
#include "reference/suite/suite_own.h"
#include "reference/base/json_node.h"
#include "renderer/base/fs.h"

#include <errno.h>
#include <libgen.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const format_names[] = {ENGINES(ENGINE_WORD) "dae", "file", NULL};
static const char *const output_names[] = {"mean", "exact", "moments", "noisy", NULL};
static const char *const channel_names[] = {"together", "separate", NULL};
static const char *const image_names[] = {"exr", "hdr", "pfm", NULL};

/* The placeholders that each of the arrays may contain. */
static const char *const in_command[] = {"scene",  "out",     "spp",  "seed", "depth", "width",
                                         "height", "threads", "here", "name", NULL};
static const char *const in_version[] = {"here", NULL};
static const char *const in_lens[] = {"lens_radius", "focal_distance", NULL};
static const char *const in_environment[] = {"environment", NULL};

static int find(const char *const *words, const char *text, size_t length)
{
    for (int i = 0; words[i] != NULL; i++)
        if (strlen(words[i]) == length && memcmp(words[i], text, length) == 0)
            return i;
    return -1;
}

static bool get_word(const struct json_node *n, const char *key, const char *const *words, int *out,
                     struct err *e)
{
    char text[32], list[256] = "";
    if (!json_get_text(n, key, text, sizeof text, e))
        return false;
    *out = find(words, text, strlen(text));
    for (int i = 0; words[i] != NULL; i++)
        snprintf(list + strlen(list), sizeof list - strlen(list), "%s%s", i > 0 ? ", " : "",
                 words[i]);
    return *out >= 0 || err_set(e, "%s: '%s' is '%s', none of: %s", n->file, key, text, list);
}

/* Length of the piece of `text` that starts with this brace: 2 for "{{" and "}}", 0 if braces do not
 * match. */
static size_t brace_length(const char *text)
{
    if (text[1] == text[0])
        return 2;
    size_t n = strcspn(text + 1, "{}");
    return text[0] == '{' && text[1 + n] == '}' ? n + 2 : 0;
}

/* Checks that one argument is a single line with known placeholders only; `used` collects these as bits. */
static bool check_argument(const struct json_node *n, const char *key, size_t index,
                           const char *text, const char *const *names, unsigned *used,
                           struct err *e)
{
    for (const char *c = text; *c != '\0'; c++) {
        if ((unsigned char)*c < ' ')
            return err_set(e, "%s: '%s' [%zu] is not one line", n->file, key, index);
        if (*c != '{' && *c != '}')
            continue;
        size_t length = brace_length(c);
        if (length == 0)
            return err_set(e, "%s: '%s' [%zu]: a brace without its partner in '%s' ({{ is a brace)",
                           n->file, key, index, text);
        if (length > 2 || c[1] != c[0]) {
            int at = find(names, c + 1, length - 2);
            if (at < 0)
                return err_set(e, "%s: '%s' [%zu]: unknown placeholder '%.*s'", n->file, key, index,
                               (int)length, c);
            *used |= 1u << at;
        }
        c += length - 1;
    }
    return true;
}

static bool check_arguments(const struct json_node *n, const char *key, const char *const *names,
                            unsigned *used, struct err *e)
{
    json_t *array, *value;
    size_t index;
    *used = 0;
    if (!json_get(n, key, &array, e))
        return false;
    if (!json_is_array(array) || json_array_size(array) == 0 || json_array_size(array) > 256)
        return err_set(e, "%s: '%s' is not a list of 1 to 256 texts", n->file, key);
    json_array_foreach(array, index, value) {
        const char *text = json_string_value(value);
        if (text == NULL || (index == 0 && text[0] == '\0'))
            return err_set(e, "%s: '%s' [%zu] is not a text", n->file, key, index);
        if (!check_argument(n, key, index, text, names, used, e))
            return false;
    }
    return true;
}

static bool read_command(const struct json_node *n, const struct engine *en, struct err *e)
{
    unsigned used;
    if (!check_arguments(n, "command", in_command, &used, e))
        return false;
    const bool scene = used & 1, out = used & 2, seed = used & 8;
    if (!scene || !out)
        return err_set(e, "%s: 'command' has no {%s}", n->file, scene ? "out" : "scene");
    if (en->output == OUTPUT_MEAN && !seed)
        return err_set(e,
                       "%s: 'command' has no {seed}, so no two images would be independent; an "
                       "image without noise has \"output\": \"exact\", one noisy image \"noisy\"",
                       n->file);
    if ((en->output == OUTPUT_EXACT || en->output == OUTPUT_NOISY) && seed)
        return err_set(e, "%s: 'command' has a {seed}, but 'output' is '%s'", n->file,
                       output_names[en->output]);
    return true;
}

static bool read_features(const struct json_node *n, struct engine *en, struct err *e)
{
    json_t *array, *value;
    size_t index;
    if (en->takes_files && !json_has(n, "expresses"))
        return true;
    if (en->takes_files)
        return err_set(
            e, "%s: 'expresses' is for scenes that are looked into, not for \"format\": \"file\"",
            n->file);
    if (!json_get(n, "expresses", &array, e))
        return false;
    if (!json_is_array(array))
        return err_set(e, "%s: 'expresses' is not a list", n->file);
    json_array_foreach(array, index, value) {
        const char *text = json_string_value(value);
        int at = text != NULL ? find(feature_names, text, strlen(text)) : -1;
        if (at < 0)
            return err_set(
                e, "%s: 'expresses' [%zu]: '%s' is no feature (see tools/docs/formats/engine.md)",
                n->file, index, text != NULL ? text : "not a text");
        en->feature |= 1u << at;
    }
    return true;
}

/* Exported files contain lens and environment; with "dae" they are passed on the command line. */
static bool read_extra(const struct json_node *n, const struct engine *en, const char *key,
                       const char *const *names, enum feature feature, struct err *e)
{
    unsigned used;
    bool has = json_has(n, key);
    bool wants = en->format == NULL && !en->takes_files && (en->feature & 1u << feature);
    if (has && (en->format != NULL || en->takes_files))
        return err_set(e, "%s: '%s' is for \"format\": \"dae\" only", n->file, key);
    if (has != wants)
        return err_set(e, "%s: '%s' and the feature '%s' come together with \"format\": \"dae\"",
                       n->file, key, feature_names[feature]);
    if (has && !check_arguments(n, key, names, &used, e))
        return false;
    for (int i = 0; has && names[i] != NULL; i++)
        if (!(used & 1u << i))
            return err_set(e, "%s: '%s' has no {%s}", n->file, key, names[i]);
    return true;
}

static bool read_margin(const struct json_node *n, struct engine *en, struct err *e)
{
    static const char *const keys[] = {"global", "tile", "reason", NULL};
    struct json_node m = {n->file, "margin.", NULL};
    if (!json_has(n, "margin"))
        return true;
    return json_get_object(n, "margin", &m.object, e) && json_only_keys(&m, keys, e) &&
           json_get_number(&m, "global", 0, 1, &en->margin_global, e) &&
           json_get_number(&m, "tile", 0, 1, &en->margin_tile, e) &&
           json_get_text(&m, "reason", en->margin_reason, sizeof en->margin_reason, e);
}

/* Only scenes that we export can be made grey, and moments cannot be assembled from one file per channel. */
static bool read_channels(const struct json_node *n, struct engine *en, struct err *e)
{
    int word = 0;
    if (json_has(n, "channels") && !get_word(n, "channels", channel_names, &word, e))
        return false;
    en->separate = word == 1;
    if (en->separate && en->format == NULL)
        return err_set(
            e, "%s: 'channels' are separate in scenes that are exported, not with this 'format'",
            n->file);
    return !en->separate || en->output != OUTPUT_MOMENTS ||
           err_set(e, "%s: 'channels' are separate in images, not with \"output\": \"moments\"",
                   n->file);
}

/* Renderers that splat, as most do, share samples between pixels; those that importance-sample the filter do not, and
 * say so. A moments file states each pixel's noise but not what its pixels share, so with moments nothing may be
 * shared. */
static bool read_filter(const struct json_node *n, struct engine *en, struct err *e)
{
    char text[PIXEL_FILTER_TEXT];
    json_t *shared = json_object_get(n->object, "shared_samples");
    if (!json_has(n, "filter"))
        return shared == NULL ||
               err_set(e, "%s: 'shared_samples' is about a 'filter', which is not there", n->file);
    if (shared != NULL && !json_is_boolean(shared))
        return err_set(e, "%s: 'shared_samples' is neither true nor false", n->file);
    if (!json_get_text(n, "filter", text, sizeof text, e))
        return false;
    if (!pixel_filter_parse(text, &en->filter, e))
        return err_prefix(e, "%s: 'filter'", n->file);
    en->shares_samples = shared != NULL ? json_is_true(shared) : en->filter.radius > 0;
    return !en->shares_samples || en->output != OUTPUT_MOMENTS ||
           err_set(e, "%s: \"output\": \"moments\" with a 'filter' needs \"shared_samples\": false",
                   n->file);
}

static bool read_name(const struct json_node *n, struct engine *en, struct err *e)
{
    static const char *const taken[] = {"truth", "pathtracer",
                                        ENGINES_WITH_GOLDENS(ENGINE_WORD) NULL};
    if (!json_get_text(n, "name", en->name, sizeof en->name, e))
        return false;
    if (en->name[strspn(en->name, "abcdefghijklmnopqrstuvwxyz0123456789_-.")] != '\0' ||
        en->name[0] == '.')
        return err_set(e, "%s: 'name' is '%s'; a-z, 0-9, _, - and . may be in it", n->file,
                       en->name);
    if (find(taken, en->name, strlen(en->name)) >= 0)
        return err_set(e, "%s: 'name' is '%s', which this program uses itself", n->file, en->name);
    return true;
}

static bool read_engine(const char *path, struct engine *en, struct err *e)
{
    static const char *const keys[] = {
        "name",       "comment",   "format",           "command", "output",
        "image",      "expresses", "depth_offset",     "spp",     "version",
        "replicates", "lens_args", "environment_args", "margin",  "channels",
        "scale",      "filter",    "shared_samples",   NULL};
    struct json_node n = {path, "", en->json};
    int word, image = 0;
    unsigned used;
    if (!json_is_object(en->json))
        return err_set(e, "%s: not an object", path);
    if (!json_only_keys(&n, keys, e) || !read_name(&n, en, e) ||
        !get_word(&n, "format", format_names, &word, e))
        return false;
    en->format = engine_kind_of(format_names[word]);
    en->takes_files = strcmp(format_names[word], "file") == 0;
    if (!get_word(&n, "output", output_names, &word, e))
        return false;
    en->output = (enum engine_output)word;
    if (json_has(&n, "image") && !get_word(&n, "image", image_names, &image, e))
        return false;
    strcpy(en->image, image_names[image]);
    if (en->output == OUTPUT_MOMENTS && image != 0)
        return err_set(e, "%s: moments are in an exr, not in a %s", path, en->image);
    if (json_has(&n, "version") && !check_arguments(&n, "version", in_version, &used, e))
        return false;
    return read_features(&n, en, e) && read_command(&n, en, e) &&
           json_may_int(&n, "depth_offset", -1, 1, &en->depth_offset, e) &&
           read_margin(&n, en, e) && read_channels(&n, en, e) && read_filter(&n, en, e) &&
           json_may_number(&n, "scale", 0, 1e30, &en->scale, e) &&
           json_may_int(&n, "spp", 1, 1 << 24, &en->spp, e) &&
           json_may_int(&n, "replicates", 3, 4096, &en->replicates, e) &&
           read_extra(&n, en, "lens_args", in_lens, FEATURE_LENS, e) &&
           read_extra(&n, en, "environment_args", in_environment, FEATURE_ENVIRONMENT, e);
}

bool engine_load(const char *path, struct engine *out, struct err *e)
{
    struct engine en = {.spp = 64, .replicates = 16, .scale = 1};
    char full[PATH_MAX];
    if (realpath(path, full) == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    if (strlen(full) >= sizeof en.file)
        return err_set(e, "%.64s...: path too long", path);
    strcpy(en.file, full);
    strcpy(en.here, dirname(full));
    en.json = json_read_or_say(path, e);
    if (en.json == NULL || !read_engine(path, &en, e)) {
        engine_free(&en);
        return false;
    }
    *out = en;
    return true;
}

bool engine_load_named(const char *name, const char *share_dir, struct engine *out, struct err *e)
{
    const bool is_file = strpbrk(name, "./") != NULL;
    return engine_load(is_file ? name : fs_path("%s/engines/%s.json", share_dir, name).s, out, e);
}

bool engine_fits_suite(const struct engine *en, const char *suite_dir, struct err *e)
{
    return !en->takes_files || suite_own_is(suite_dir) ||
           err_set(e,
                   "%s is for a suite of its own (\"format\": \"file\"), and %s has no "
                   "suite.json: give --suite DIR",
                   en->file, suite_dir);
}

void engine_free(struct engine *en)
{
    json_decref(en->json);
    *en = (struct engine){0};
}

/* Writes the argument with its placeholders replaced, as far as it fits in `room`; returns the bytes needed, NUL
 * included. */
static size_t fill_in(const char *text, const struct engine_value *values, char *out, size_t room,
                      const char **missing)
{
    size_t n = 0;
    for (const char *c = text; *c != '\0';) {
        const char *piece = c;
        size_t length = 1, step = 1;
        if (*c == '{' || *c == '}') {
            step = brace_length(c);
            if (step > 2) {
                const struct engine_value *v = values;
                while (v->name != NULL &&
                       (strlen(v->name) != step - 2 || memcmp(v->name, c + 1, step - 2) != 0))
                    v++;
                if (v->name == NULL)
                    *missing = c;
                piece = v->name != NULL ? v->value : "";
                length = strlen(piece);
            }
        }
        for (size_t i = 0; i < length; i++, n++)
            if (n < room)
                out[n] = piece[i];
        c += step;
    }
    if (n < room)
        out[n] = '\0';
    return n + 1;
}

bool engine_argv(const struct engine *en, const char *const *keys,
                 const struct engine_value *values, char ***argv, struct err *e)
{
    size_t num = 0, bytes = 0;
    const char *missing = NULL;
    for (const char *const *key = keys; *key != NULL; key++) {
        json_each(arg, json_object_get(en->json, *key))
            bytes += fill_in(json_string_value(arg), values, NULL, 0, &missing);
        num += json_array_size(json_object_get(en->json, *key));
        if (missing != NULL)
            return err_set(e, "%s: '%s': no value for '%.*s'", en->file, *key,
                           (int)strcspn(missing, "}") + 1, missing);
    }
    *argv = malloc((num + 1) * sizeof **argv + bytes);
    if (*argv == NULL)
        return err_set(e, "%s: out of memory", en->file);
    char *at = (char *)(*argv + num + 1), **next = *argv;
    for (; *keys != NULL; keys++)
        json_each(arg, json_object_get(en->json, *keys)) {
            size_t n = fill_in(json_string_value(arg), values, at, bytes, &missing);
            *next++ = at;
            at += n;
            bytes -= n;
        }
    *next = NULL;
    return true;
}
