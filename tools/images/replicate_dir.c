#include "replicate_dir.h"
#include "renderer/base/fs.h"

#include "image_file.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

static int by_name(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

static bool list_names(const char *dir, struct replicate_dir *r, struct err *e)
{
    DIR *d = opendir(dir);
    if (d == NULL)
        return err_set(e, "%s: cannot read: %s", dir, strerror(errno));
    bool ok = true;
    for (struct dirent *f; ok && (f = readdir(d)) != NULL;) {
        if (f->d_name[0] == '.')
            continue;
        char **name = realloc(r->name, ((size_t)r->num + 1) * sizeof *name);
        if (name != NULL) {
            r->name = name;
            r->name[r->num] = strdup(f->d_name);
        }
        ok = name != NULL && r->name[r->num] != NULL;
        r->num += ok;
    }
    closedir(d);
    if (!ok)
        return err_set(e, "%s: out of memory for its file names", dir);
    if (r->num < 3)
        return err_set(e, "%s: has %d images, at least 3 replicates are needed", dir, r->num);
    qsort(r->name, (size_t)r->num, sizeof *r->name, by_name);
    return true;
}

static bool read_one(const char *dir, struct replicate_dir *r, int k, struct err *e)
{
    struct image_file p;
    const struct path path = fs_path("%s/%s", dir, r->name[k]);
    if (!image_file_read(path.s, &p, e))
        return false;
    bool ok = true;
    if (p.info.type != IMAGE_FLOAT || strcmp(p.info.format, "hdr") == 0)
        ok = err_set(e, "%s: replicates need 32-bit floats, this file has fewer bits", path.s);
    else if (k > 0 && (p.width != r->width || p.height != r->height))
        ok = err_set(e, "%s: is %d x %d pixels, %s is %d x %d", path.s, p.width, p.height,
                     r->name[0], r->width, r->height);
    if (!ok) {
        image_file_free(&p);
        return false;
    }
    r->width = p.width;
    r->height = p.height;
    r->rgb[k] = p.rgb;
    r->spp = p.spp > 0 && (k == 0 || r->spp > 0) ? r->spp + p.spp / r->num : 0;
    size_t bytes = 3 * (size_t)r->width * (size_t)r->height * sizeof **r->rgb;
    for (int i = 0; i < k; i++)
        if (memcmp(r->rgb[i], r->rgb[k], bytes) == 0)
            return err_set(e, "%s: %s and %s are the same image: the seed was ignored", dir,
                           r->name[i], r->name[k]);
    return true;
}

bool replicate_dir_read(const char *dir, struct replicate_dir *out, struct err *e)
{
    *out = (struct replicate_dir){0};
    bool ok = list_names(dir, out, e);
    if (ok) {
        out->rgb = calloc((size_t)out->num, sizeof *out->rgb);
        ok = out->rgb != NULL || err_set(e, "%s: out of memory", dir);
    }
    for (int k = 0; ok && k < out->num; k++)
        ok = read_one(dir, out, k, e);
    if (!ok)
        replicate_dir_free(out);
    return ok;
}

void replicate_dir_free(struct replicate_dir *r)
{
    for (int k = 0; k < r->num; k++) {
        if (r->name != NULL)
            free(r->name[k]);
        if (r->rgb != NULL)
            free(r->rgb[k]);
    }
    free(r->name);
    free(r->rgb);
    *r = (struct replicate_dir){0};
}

bool replicate_dir_share(const struct replicate_dir *a, const struct replicate_dir *b, int *i,
                         int *j)
{
    size_t bytes = 3 * (size_t)a->width * (size_t)a->height * sizeof **a->rgb;
    for (*i = 0; *i < a->num; ++*i)
        for (*j = 0; *j < b->num; ++*j)
            if (memcmp(a->rgb[*i], b->rgb[*j], bytes) == 0)
                return true;
    return false;
}

bool replicate_dir_moments(const struct replicate_dir *r, struct moments *out, struct err *e)
{
    if (!moments_alloc(out, r->width, r->height, e))
        return false;
    strcpy(out->unit, "replicate");
    out->spp = r->spp;
    for (int k = 0; k < r->num; k++)
        moments_add_image(out, r->rgb[k]);
    return true;
}
