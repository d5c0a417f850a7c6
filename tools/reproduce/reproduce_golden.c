#include "reproduce_golden.h"

#include "reference/store/reference_render.h"
#include "renderer/base/cli.h"
#include "tools/base/data_dirs.h"
#include "reproduce_internal.h"
#include "tools/results/results.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PATH = 4096 };

/* DIR of DIR/SCENE/ENGINE.exr; "." where that is the current one. */
static bool directory_of(const char *path, const char *scene, const char *engine,
                         char dir[MAX_PATH], struct err *e)
{
    char end[512];
    int n = snprintf(end, sizeof end, "%.200s/%.200s.exr", scene, engine);
    size_t length = strlen(path);
    if (length < (size_t)n || length >= MAX_PATH || strcmp(path + length - (size_t)n, end) != 0 ||
        (length > (size_t)n && path[length - (size_t)n - 1] != '/'))
        return err_set(e, "%s: a stored reference is made again where it is stored, as .../%s",
                       path, end);
    snprintf(dir, MAX_PATH, "%.*s", (int)(length - (size_t)n), path);
    if (dir[0] == '\0')
        strcpy(dir, ".");
    return true;
}

static const struct suite_reference *reference_of(const struct suite_scene *s, const char *engine)
{
    for (int i = 0; i < s->num_references; i++)
        if (strcmp(s->reference[i].engine, engine) == 0)
            return &s->reference[i];
    return NULL;
}

static bool set_command(struct reproduced *out, const char *scene, const char *engine,
                        const char *seed, struct err *e)
{
    const char *const word[] = {"assay",    "reference", "--fresh", "--only", scene,
                                "--engine", engine,      "--seed",  seed,     NULL};
    return reproduced_command(out, word, e);
}

/* By which engine it was made then, where it is another one now: that may be why it differs. */
static void compare_engines(const json_t *then, const json_t *now, struct reproduced *out)
{
    const char *a = member_text(then, "version"), *b = member_text(now, "version");
    if (strcmp(a, b) != 0)
        snprintf(out->note, sizeof out->note, "the reference is by %.100s, this is %.100s", a, b);
    else if (strcmp(member_text(then, "binary_sha256"), member_text(now, "binary_sha256")) != 0)
        snprintf(out->note, sizeof out->note, "the reference is by another build of %.100s", a);
}

static bool render(const struct suite_scene *scene, const struct suite_reference *ref,
                   const struct reproduce_options *opt, const char *golden_dir, const char *dir,
                   const char *to, struct reproduced *out, struct err *e)
{
    char share[4096], again[MAX_PATH], seed[24];
    struct moments then, now;
    json_t *was = NULL, *is = NULL;
    if (!golden_read(golden_dir, scene, ref, &then, &was, e))
        return false;
    moments_free(&then);
    const struct reference_options how = {
        .seed = (uint32_t)member_number(was, "seed"),
        .threads = opt->threads == 0 ? cli_processors() : opt->threads,
        .timeout_s = 7200,
        .work_dir = dir,
        .share_dir = data_dir(share, sizeof share, "reference", "../share/assay")};
    snprintf(seed, sizeof seed, "%u", (unsigned)how.seed);
    snprintf(again, sizeof again, "%.3000s/%.200s/%.200s.exr", dir, scene->name, ref->engine);
    bool ok = set_command(out, scene->name, ref->engine, seed, e);
    if (ok && reference_render(scene, ref, &how, &now, &is, e)) {
        compare_engines(was, is, out);
        ok = golden_write(dir, scene->name, ref->engine, &now, is, e) &&
             (rename(again, to) == 0 || err_set(e, "%s: %s", to, strerror(errno)));
        moments_free(&now);
        json_decref(is);
    } else {
        ok = false;
    }
    json_decref(was);
    return ok;
}

bool reproduce_golden(const char *path, const struct image *im, const struct reproduce_options *opt,
                      const char *dir, const char *to, struct reproduced *out, struct err *e)
{
    char suite_dir[4096], golden_dir[MAX_PATH];
    const char *name = image_get_attr(im, "assay:scene"),
               *engine = image_get_attr(im, "assay:engine");
    struct suite suite = {0};
    if (name == NULL || engine == NULL)
        return err_set(e, "%s: does not say of what scene and engine it is", path);
    if (opt->scene != NULL || opt->pathtracer != NULL)
        return err_set(e, "%s: --scene and --pathtracer are for pictures of pathtracer", path);
    const char *from =
        data_dir(suite_dir, sizeof suite_dir, "reference/scenes", "../share/assay/scenes");
    if (!directory_of(path, name, engine, golden_dir, e) || !suite_load(from, &suite, e))
        return false;
    const struct suite_scene *scene = suite_find(&suite, name);
    const struct suite_reference *ref = scene != NULL ? reference_of(scene, engine) : NULL;
    bool ok = ref != NULL || err_set(e, "%s: %s has no scene '%.100s' with a reference by '%.100s'",
                                     path, from, name, engine);
    ok = ok && render(scene, ref, opt, golden_dir, dir, to, out, e);
    suite_free(&suite);
    return ok;
}
