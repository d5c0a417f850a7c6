#include "catalogue.h"

#include "reference/base/json_file.h"
#include "renderer/base/fs.h"
#include "renderer/image/image.h"
#include "renderer/base/sha256.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void catalogue_free(struct catalogue *c)
{
    for (int v = 0; v < c->num_views; v++) {
        for (int b = 0; c->view[v].effect != NULL && b < c->num_bugs; b++)
            free(c->view[v].effect[b]);
        free(c->view[v].effect);
    }
    free(c->view);
    free(c->bug);
    *c = (struct catalogue){0};
}

const struct view *catalogue_view(const struct catalogue *c, const char *name)
{
    for (int v = 0; v < c->num_views; v++)
        if (strcmp(c->view[v].name, name) == 0)
            return &c->view[v];
    return NULL;
}

int catalogue_bug(const struct catalogue *c, const char *name)
{
    for (int b = 0; b < c->num_bugs; b++)
        if (strcmp(c->bug[b].name, name) == 0)
            return b;
    return -1;
}

bool catalogue_view_scene(const struct view *v, const struct suite *suite,
                          const struct suite_scene **scene, const struct suite_variant **variant,
                          struct err *e)
{
    *scene = suite_find(suite, v->scene);
    *variant = NULL;
    if (*scene == NULL)
        return err_set(e, "the suite has no scene '%s' of the catalogue", v->scene);
    if (strcmp((*scene)->sha256, v->scene_sha256) != 0)
        return err_set(e, "%s has changed since the catalogue of bugs was made: make catalogue",
                       v->scene);
    for (int i = 0; i < (*scene)->num_variants; i++)
        if (strcmp((*scene)->variant[i].name, v->variant) == 0)
            *variant = &(*scene)->variant[i];
    if (v->variant[0] != '\0' && *variant == NULL)
        return err_set(e, "%s: the suite has no '%s' of the catalogue", v->scene, v->variant);
    return true;
}

void catalogue_mistake(const struct bug *b, char name[64])
{
    snprintf(name, sizeof b->name, "%.*s", (int)strcspn(b->name, "-"), b->name);
}

bool catalogue_same_mistake(const struct bug *a, const struct bug *b)
{
    size_t n = strcspn(a->name, "-");
    return n == strcspn(b->name, "-") && strncmp(a->name, b->name, n) == 0;
}

static bool get_facts(const json_t *list, double *fact, double *sd)
{
    if (json_array_size(list) != NUM_FACTS)
        return false;
    for (size_t f = 0; f < NUM_FACTS; f++) {
        const json_t *pair = json_array_get(list, f);
        fact[f] = sd[f] = NAN;
        if (json_is_null(pair))
            continue;
        if (json_array_size(pair) != 2)
            return false;
        fact[f] = json_number_value(json_array_get(pair, 0));
        sd[f] = json_number_value(json_array_get(pair, 1));
    }
    return true;
}

static bool copy_text(char *to, size_t size, const json_t *object, const char *name)
{
    const char *text = json_string_value(json_object_get(object, name));
    return text != NULL && snprintf(to, size, "%s", text) < (int)size;
}

static bool get_channels(const struct image *im, const char *stem, double *out, float *outf)
{
    for (int c = 0; c < 3; c++) {
        char name[32];
        snprintf(name, sizeof name, "%s.%c", stem, "RGB"[c]);
        int at = image_channel(im, name);
        if (at < 0)
            return false;
        for (int i = 0; i < im->width * im->height; i++) {
            float value = im->data[i * im->channels + at];
            if (!isfinite(value))
                return false;
            if (out != NULL)
                out[3 * i + c] = (double)value;
            else
                outf[3 * i + c] = value;
        }
    }
    return true;
}

static bool get_effects(struct view *v, const struct catalogue *c, const json_t *bugs,
                        const struct image *im, const char *path, struct err *e)
{
    const char *name;
    json_t *value;
    json_object_foreach((json_t *)bugs, name, value) {
        int b = catalogue_bug(c, name);
        struct effect *effect = calloc(1, sizeof *effect);
        if (b < 0 || effect == NULL) {
            free(effect);
            return b < 0 ? err_set(e, "%s: bug '%s' is not in its list", path, name)
                         : err_set(e, "%s: out of memory", path);
        }
        v->effect[b] = effect;
        effect->pixels = json_is_true(json_object_get(value, "pixels"));
        char mean[16], var[16];
        snprintf(mean, sizeof mean, "%d", b);
        snprintf(var, sizeof var, "%dv", b);
        if (!get_facts(json_object_get(value, "facts"), effect->fact, effect->fact_sd) ||
            (effect->pixels && (!get_channels(im, mean, NULL, effect->mean) ||
                                !get_channels(im, var, NULL, effect->var))))
            return err_set(e, "%s: the effect of '%s' on %s is incomplete", path, name, v->name);
    }
    return true;
}

static bool get_image(const char *dir, struct view *v, const struct catalogue *c,
                      const json_t *json, struct err *e)
{
    char image[140], stored[65], sha256[65];
    struct image im;
    if (!copy_text(image, sizeof image, json, "picture") ||
        !copy_text(stored, sizeof stored, json, "picture_sha256") || strchr(image, '/') != NULL)
        return err_set(e, "%s/manifest.json: no image of '%s'", dir, v->name);
    const struct path path = fs_path("%s/%s", dir, image);
    if (!sha256_file(path.s, sha256, e))
        return false;
    if (strcmp(sha256, stored) != 0)
        return err_set(e, "%s: is not the file that the manifest describes", path.s);
    if (!image_read_exr(path.s, &im, NULL, e))
        return false;
    int cs = image_channel(&im, "cs");
    struct signature *s = &v->correct;
    s->columns = im.width;
    s->rows = im.height;
    bool ok = im.width <= SIGNATURE_SIDE && im.height <= SIGNATURE_SIDE && cs >= 0 &&
              im.width * v->height == im.height * v->width &&
              get_channels(&im, "c", s->mean, NULL) && get_channels(&im, "cv", s->var, NULL) &&
              get_channels(&im, "ck", s->k3, NULL);
    if (!ok)
        err_set(e, "%s: channels are missing, or its size is wrong", path.s);
    for (int i = 0; ok && i < im.width * im.height; i++)
        s->spread[i] = (double)im.data[i * im.channels + cs];
    s->cell = v->width / im.width;
    ok = ok && get_effects(v, c, json_object_get(json, "bugs"), &im, path.s, e);
    image_free(&im);
    return ok;
}

static bool get_options(struct view *v, const json_t *list)
{
    enum { MOST = sizeof v->option / sizeof v->option[0] - 1 };
    if (!json_is_array(list) || json_array_size(list) > MOST)
        return false;
    for (size_t i = 0; i < json_array_size(list); i++) {
        const char *text = json_string_value(json_array_get(list, i));
        if (text == NULL ||
            snprintf(v->option[i], sizeof v->option[i], "%s", text) >= (int)sizeof v->option[i])
            return false;
        v->options[i] = v->option[i];
    }
    return true;
}

static bool get_view(const char *dir, struct view *v, const struct catalogue *c, const json_t *json,
                     struct err *e)
{
    json_int_t seed;
    int fixed;
    bool ok = copy_text(v->name, sizeof v->name, json, "name") &&
              copy_text(v->scene, sizeof v->scene, json, "scene") &&
              copy_text(v->variant, sizeof v->variant, json, "variant") &&
              copy_text(v->scene_sha256, sizeof v->scene_sha256, json, "scene_sha256") &&
              get_options(v, json_object_get(json, "options")) &&
              json_unpack((json_t *)json, "{si,si,si,si,sb,sI,sF}", "width", &v->width, "height",
                          &v->height, "spp", &v->spp, "renders", &v->renders, "fixed_spp", &fixed,
                          "seed", &seed, "n", &v->correct.n) == 0 &&
              v->width > 0 && v->height > 0 && v->spp > 2 && v->renders > 0 && v->correct.n >= 3 &&
              get_facts(json_object_get(json, "correct"), v->correct.fact, v->correct.fact_sd);
    if (!ok)
        return err_set(e, "%s/manifest.json: a view is incomplete", dir);
    v->fixed_spp = fixed != 0;
    v->seed = (uint64_t)seed;
    return get_image(dir, v, c, json, e);
}

static bool fill(const char *dir, struct catalogue *c, const json_t *root, struct err *e)
{
    const json_t *bugs = json_object_get(root, "bugs"), *views = json_object_get(root, "views");
    size_t num_bugs = json_object_size(bugs), num_views = json_array_size(views);
    if (json_integer_value(json_object_get(root, "side")) != SIGNATURE_SIDE || num_bugs == 0 ||
        num_views == 0)
        return err_set(e, "%s/manifest.json: no catalogue of bugs with %d cells across", dir,
                       SIGNATURE_SIDE);
    c->bug = calloc(num_bugs, sizeof *c->bug);
    c->view = calloc(num_views, sizeof *c->view);
    if (c->bug == NULL || c->view == NULL)
        return err_set(e, "out of memory");
    const char *name;
    json_t *value;
    json_object_foreach((json_t *)bugs, name, value) {
        struct bug *b = &c->bug[c->num_bugs++];
        if (snprintf(b->name, sizeof b->name, "%s", name) >= (int)sizeof b->name ||
            !copy_text(b->what, sizeof b->what, value, "bug") ||
            !copy_text(b->where, sizeof b->where, value, "where") ||
            !copy_text(b->patch_sha256, sizeof b->patch_sha256, value, "patch_sha256"))
            return err_set(e, "%s/manifest.json: bug '%s' is incomplete", dir, name);
    }
    for (size_t i = 0; i < num_views; i++) {
        struct view *v = &c->view[c->num_views++];
        v->effect = calloc(num_bugs, sizeof(struct effect *));
        if (v->effect == NULL)
            return err_set(e, "out of memory");
        if (!get_view(dir, v, c, json_array_get(views, i), e))
            return false;
    }
    return true;
}

bool catalogue_read(const char *dir, struct catalogue *out, struct err *e)
{
    *out = (struct catalogue){0};
    json_t *root = json_read_or_say(fs_path("%s/manifest.json", dir).s, e);
    if (root == NULL)
        return false;
    bool ok = fill(dir, out, root, e);
    json_decref(root);
    if (!ok)
        catalogue_free(out);
    return ok;
}
