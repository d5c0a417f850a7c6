/* Checks whether an engine can express a scene, and writes the scene in its format. */
#define _GNU_SOURCE
#include "engine_internal.h"

#include "engine_bindings.h"
#include "reference/suite/features.h"

#include "renderer/base/fs.h"
#include "renderer/scene/environment.h"

#include <assert.h>
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

static rgb in_channel(rgb colour, int channel)
{
    const float v[3] = {colour.r, colour.g, colour.b};
    return (rgb){v[channel], v[channel], v[channel]};
}

static struct environment *grey_texels(const struct environment_parts *parts, int channel,
                                       struct err *e)
{
    struct image im = {0};
    if (!image_alloc(&im, (int)parts->width, (int)parts->height, 3,
                     (const char *const[]){"R", "G", "B"}, e))
        return NULL;
    for (size_t i = 0; i < (size_t)parts->width * parts->height; i++) {
        const rgb v = in_channel(parts->texel[i], channel);
        memcpy(im.data + 3 * i, (const float[3]){v.r, v.g, v.b}, 3 * sizeof(float));
    }
    struct environment *env = environment_from_image(&im, "the sky in grey", e);
    image_free(&im);
    return env;
}

static bool grey_environment(struct scene *s, int channel, struct err *e)
{
    const struct environment_parts parts = environment_parts(s->environment);
    struct environment *env = parts.kind == ENVIRONMENT_CONSTANT
                                  ? environment_constant(in_channel(parts.radiance, channel), e)
                              : parts.kind == ENVIRONMENT_UPPER_HALF
                                  ? environment_upper_half(in_channel(parts.radiance, channel), e)
                                  : grey_texels(&parts, channel, e);
    if (env == NULL)
        return false;
    environment_free(s->environment);
    s->environment = env;
    return true;
}

/* Replaces every colour by the grey of its value in one channel. */
static bool make_grey(struct scene *s, int channel, struct err *e)
{
    for (uint32_t i = 0; i < s->num_materials; i++) {
        struct material *m = &s->materials[i];
        rgb *const colours[] = {&m->reflectance, &m->transmittance, &m->specular,
                                &m->mirror,      &m->eta,           &m->k,
                                &m->radiance};
        for (int k = 0; k < 7; k++)
            *colours[k] = in_channel(*colours[k], channel);
    }
    for (uint32_t i = 0; i < s->num_lights; i++)
        s->lights[i].value = in_channel(s->lights[i].value, channel);
    return s->environment == NULL || grey_environment(s, channel, e);
}

static bool write_channel(const struct engine *en, const struct suite_scene *suite, const char *dir,
                          int channel, char path[PATH_SIZE], struct err *e)
{
    struct scene s = {0};
    struct camera c;
    assert(en->format != NULL); /* ensured by read_channels() */
    if (!suite_open(suite, &s, &c, e))
        return false;
    c.filter = en->filter;
    bool ok = features_check_textures("separate channels", &s, e) && make_grey(&s, channel, e);
    if (ok && snprintf(path, PATH_SIZE, "%s/scene_%c%s", dir, "rgb"[channel],
                       en -> format -> ending) >= PATH_SIZE)
        ok = err_set(e, "%.64s...: path too long", dir);
    ok = ok && engine_export(en->format, &s, &c, suite->depth, path, e);
    scene_free(&s);
    return ok;
}

bool engine_write_scene(const struct engine *en, const struct suite_scene *suite, const char *dir,
                        char paths[3][PATH_SIZE], struct err *e)
{
    struct scene s = {0};
    struct camera c;
    char *path = paths[0];
    if (en->takes_files)
        return realpath(suite->dae, path) != NULL ||
               err_set(e, "%s: %s", suite->dae, strerror(errno));
    if (!suite_open(suite, &s, &c, e))
        return false;
    c.filter = en->filter;
    /* Exporters handle formats that count bounces differently (Mitsuba's depth is ours plus one);
     * depth_offset only affects {depth}. */
    bool ok = check_features(en, features_of_scene(&s, &c), e);
    if (ok && en->format == NULL)
        ok =
            realpath(suite->dae, path) != NULL || err_set(e, "%s: %s", suite->dae, strerror(errno));
    else if (ok && snprintf(path, PATH_SIZE, "%s/scene%s", dir, en->format->ending) >= PATH_SIZE)
        ok = err_set(e, "%.64s...: path too long", dir);
    else if (!en->separate)
        ok = ok && engine_export(en->format, &s, &c, suite->depth, path, e);
    scene_free(&s);
    for (int k = 0; ok && en->separate && k < 3; k++)
        ok = write_channel(en, suite, dir, k, paths[k], e);
    return ok;
}

bool engine_expresses(const struct engine *en, const struct suite_scene *scene, const char *dir,
                      struct err *why)
{
    char path[3][PATH_SIZE];
    struct err ignored;
    struct path sub = fs_path("%s/%s-try-XXXXXX", dir, en->name);
    if (mkdtemp(sub.s) == NULL)
        return err_set(why, "%s: cannot make a directory in it: %s", dir, strerror(errno));
    bool ok = engine_write_scene(en, scene, sub.s, path, why);
    return fs_remove_tree(sub.s, ok ? why : &ignored) && ok;
}
