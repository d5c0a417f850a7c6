#include "catalogue_write.h"

#include "reference/base/json_file.h"
#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"
#include "renderer/image/image.h"

#include <assert.h>
#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PATH = 4600, MAX_PATCH = 8192 };

static bool header_line(const char *line, const char *key, char *out, size_t size)
{
    size_t n = strlen(key);
    if (strncmp(line, key, n) != 0)
        return false;
    line += n;
    line += strspn(line, " ");
    size_t length = strcspn(line, "\n");
    snprintf(out, size, "%.*s", (int)length, line);
    return length > 0 && length < size;
}

/* Does the line of a patch belong to the bug? Context lines, line numbers and file names do not. */
static bool is_of_the_bug(const char *line, bool in_code)
{
    return !in_code || !(line[0] == ' ' || line[0] == '\n' || strncmp(line, "@@", 2) == 0 ||
                         strncmp(line, "--- ", 4) == 0 || strncmp(line, "+++ ", 4) == 0);
}

bool catalogue_bug_of_patch(const char *path, struct bug *out, struct err *e)
{
    char line[1024], text[MAX_PATCH] = "";
    const char *slash = strrchr(path, '/'), *name = slash != NULL ? slash + 1 : path;
    *out = (struct bug){0};
    size_t length = strcspn(name, ".");
    if (length >= sizeof out->name)
        return err_set(e, "%s: the name is too long", path);
    snprintf(out->name, sizeof out->name, "%.*s", (int)length, name);
    FILE *f = fopen(path, "r");
    if (f == NULL)
        return err_set(e, "%s: %s", path, strerror(errno));
    bool what = false, where = false, in_code = false;
    size_t used = 0;
    while (fgets(line, sizeof line, f) != NULL) {
        in_code = in_code || strncmp(line, "---", 3) == 0;
        what = what || (!in_code && header_line(line, "Bug:", out->what, sizeof out->what));
        where = where || (!in_code && header_line(line, "Where:", out->where, sizeof out->where));
        if (!is_of_the_bug(line, in_code))
            continue;
        used += strlen(line);
        if (used < sizeof text)
            strcat(text, line);
    }
    fclose(f);
    if (!what || !where)
        return err_set(e, "%s: no line '%s'", path, what ? "Where:" : "Bug:");
    if (used >= sizeof text)
        return err_set(e, "%s: more than %d characters", path, MAX_PATCH - 1);
    sha256_text(text, out->patch_sha256);
    return true;
}

/* How many patches a directory has, all of which are in the catalogue. */
static bool has_patches(const struct catalogue *c, const char *patch_dir, int *patches,
                        struct err *e)
{
    static const char end[] = ".patch";
    DIR *d = opendir(patch_dir);
    if (d == NULL)
        return err_set(e, "%s: %s", patch_dir, strerror(errno));
    bool ok = true;
    for (struct dirent *entry; ok && (entry = readdir(d)) != NULL;) {
        size_t n = strlen(entry->d_name);
        struct bug bug;
        if (n < sizeof end || strcmp(entry->d_name + n - (sizeof end - 1), end) != 0)
            continue;
        const struct path path = fs_path("%s/%s", patch_dir, entry->d_name);
        ok = catalogue_bug_of_patch(path.s, &bug, e);
        int b = ok ? catalogue_bug(c, bug.name) : 0;
        if (ok && b < 0)
            ok = err_set(e, "%s: not in the catalogue of bugs: make catalogue", path.s);
        else if (ok && strcmp(bug.patch_sha256, c->bug[b].patch_sha256) != 0)
            ok = err_set(e, "%s: has changed since the catalogue of bugs was made: make catalogue",
                         path.s);
        ++*patches;
    }
    closedir(d);
    return ok;
}

bool catalogue_current(const struct catalogue *c, const char *patch_dir, const char *other_dir,
                       struct err *e)
{
    int patches = 0;
    return has_patches(c, patch_dir, &patches, e) &&
           (other_dir == NULL || has_patches(c, other_dir, &patches, e)) &&
           (patches == c->num_bugs ||
            err_set(e, "the catalogue has %d bugs, %s has %d: make catalogue", c->num_bugs,
                    patch_dir, patches));
}

/* Rounds to `bits` of mantissa, so that files are small; 0 stays 0. */
static float rounded(double x, int bits)
{
    int exponent;
    double m = frexp(x, &exponent);
    return (float)ldexp(round(ldexp(m, bits)), exponent - bits);
}

static json_t *facts_json(const double *fact, const double *sd)
{
    json_t *list = json_array();
    for (int f = 0; f < NUM_FACTS; f++)
        json_array_append_new(list,
                              isnan(fact[f]) ? json_null() : json_pack("[ff]", fact[f], sd[f]));
    return list;
}

/* Adds three channels at *next, of x or of xf. */
static void put(struct image *im, int *next, const char *stem, const double *x, const float *xf,
                int bits)
{
    assert(x != NULL || xf != NULL);
    for (int c = 0; c < 3; c++, (*next)++) {
        snprintf(im->names[*next], sizeof *im->names, "%s.%c", stem, "RGB"[c]);
        for (int i = 0; i < im->width * im->height; i++) {
            double value = x != NULL ? x[3 * i + c] : (double)xf[3 * i + c];
            im->data[i * im->channels + *next] = rounded(value, bits);
        }
    }
}

static bool write_image(const char *path, const struct view *v, int num_bugs, struct err *e)
{
    int channels = 10, next = 0;
    for (int b = 0; b < num_bugs; b++)
        channels += v->effect[b] != NULL && v->effect[b]->pixels ? 6 : 0;
    const char **names = calloc((size_t)channels, sizeof *names);
    for (int i = 0; names != NULL && i < channels; i++)
        names[i] = "";
    struct image im;
    bool ok = names != NULL || err_set(e, "out of memory");
    ok = ok && image_alloc(&im, v->correct.columns, v->correct.rows, channels, names, e);
    free(names);
    if (!ok)
        return false;
    put(&im, &next, "c", v->correct.mean, NULL, 24);
    put(&im, &next, "cv", v->correct.var, NULL, 12);
    put(&im, &next, "ck", v->correct.k3, NULL, 12);
    snprintf(im.names[next], 32, "cs");
    for (int i = 0; i < im.width * im.height; i++)
        im.data[i * channels + next] = rounded(v->correct.spread[i], 12);
    next++;
    for (int b = 0; b < num_bugs; b++)
        if (v->effect[b] != NULL && v->effect[b]->pixels) {
            char stem[16];
            snprintf(stem, sizeof stem, "%d", b);
            put(&im, &next, stem, NULL, v->effect[b]->mean, 11);
            snprintf(stem, sizeof stem, "%dv", b);
            put(&im, &next, stem, NULL, v->effect[b]->var, 5);
        }
    ok = image_write_exr(path, &im, e);
    image_free(&im);
    return ok;
}

static json_t *options_json(const struct view *v)
{
    json_t *list = json_array();
    for (int i = 0; v->option[i][0] != '\0'; i++)
        json_array_append_new(list, json_string(v->option[i]));
    return list;
}

static json_t *view_json(const struct view *v, const struct catalogue *c, const char *image,
                         const char *sha256)
{
    json_t *bugs = json_object();
    for (int b = 0; b < c->num_bugs; b++)
        if (v->effect[b] != NULL)
            json_object_set_new(bugs, c->bug[b].name,
                                json_pack("{sb,so}", "pixels", v->effect[b]->pixels, "facts",
                                          facts_json(v->effect[b]->fact, v->effect[b]->fact_sd)));
    return json_pack("{ss,ss,ss,so,ss,si,si,si,si,sb,sI,ss,ss,sf,so,so}", "name", v->name, "scene",
                     v->scene, "variant", v->variant, "options", options_json(v), "scene_sha256",
                     v->scene_sha256, "width", v->width, "height", v->height, "spp", v->spp,
                     "renders", v->renders, "fixed_spp", v->fixed_spp, "seed", (json_int_t)v->seed,
                     "picture", image, "picture_sha256", sha256, "n", v->correct.n, "correct",
                     facts_json(v->correct.fact, v->correct.fact_sd), "bugs", bugs);
}

bool catalogue_write(const char *dir, const struct catalogue *c, struct err *e)
{
    char path[MAX_PATH], image[140], sha256[65];
    json_t *bugs = json_object(), *views = json_array();
    bool ok = true;
    for (int b = 0; b < c->num_bugs; b++)
        json_object_set_new(bugs, c->bug[b].name,
                            json_pack("{ss,ss,ss}", "bug", c->bug[b].what, "where", c->bug[b].where,
                                      "patch_sha256", c->bug[b].patch_sha256));
    for (int v = 0; ok && v < c->num_views; v++) {
        snprintf(image, sizeof image, "%s.exr", c->view[v].name);
        snprintf(path, sizeof path, "%s/%s", dir, image);
        ok = write_image(path, &c->view[v], c->num_bugs, e) && sha256_file(path, sha256, e);
        if (ok)
            json_array_append_new(views, view_json(&c->view[v], c, image, sha256));
    }
    json_t *root = json_pack("{si,so,so}", "side", SIGNATURE_SIDE, "bugs", bugs, "views", views);
    snprintf(path, sizeof path, "%s/manifest.json", dir);
    ok = ok && (root != NULL || err_set(e, "out of memory")) && json_write(path, root, e);
    json_decref(root);
    return ok;
}
