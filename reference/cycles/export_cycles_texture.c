/* Export to Cycles: textures, written as EXR files beside the scene. */
#include "export_cycles_internal.h"

#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"

#include <string.h>
#include <unistd.h>

static struct path image_file(const char *dump, uint32_t texture)
{
    return fs_path("%s.texture%u.exr", dump, texture);
}

/* Texels of padding: TEXTURE_BORDER is expressed as one black texel around the image and
 * clamping. */
static int pad_of(const struct texture *t, int axis)
{
    return t->wrap[axis] == TEXTURE_BORDER;
}

static bool write_image(const struct texture *t, const char *path, struct err *e)
{
    static const char *const NAMES[3] = {"R", "G", "B"};
    const int left = pad_of(t, 0), top = pad_of(t, 1);
    struct image im;
    if (!image_alloc(&im, t->width + 2 * left, t->height + 2 * top, 3, NAMES, e))
        return false;
    for (int y = 0; y < t->height; y++)
        memcpy(im.data + 3 * ((size_t)(y + top) * (size_t)im.width + (size_t)left),
               t->texel + 3 * (size_t)y * (size_t)t->width, 3 * (size_t)t->width * sizeof *im.data);
    bool ok = image_write_exr(path, &im, e);
    image_free(&im);
    return ok;
}

bool cycles_write_textures(const struct scene *s, const char *dump, uint32_t *written,
                           struct err *e)
{
    for (*written = 0; *written < s->num_textures; ++*written)
        if (!write_image(&s->textures[*written], image_file(dump, *written).s, e))
            return false;
    return true;
}

void cycles_remove_textures(const char *dump, uint32_t written)
{
    for (uint32_t i = 0; i < written; i++)
        unlink(image_file(dump, i).s);
}

json_t *cycles_map(const struct scene *s, uint32_t map, const char *dump, struct err *e)
{
    static const char *const WRAPS[] = {[TEXTURE_WRAP] = "repeat",
                                        [TEXTURE_MIRROR] = "mirror",
                                        [TEXTURE_CLAMP] = "clamp",
                                        [TEXTURE_BORDER] = "clamp"};
    const struct texture *t = &s->textures[map - 1];
    const struct path file = image_file(dump, map - 1);
    char sha256[65];
    if (!sha256_file(file.s, sha256, e))
        return NULL;
    return json_pack("{ss,ss,s[ss],s[ii],s[ii],sb}", "file", fs_base(file.s), "sha256", sha256,
                     "wrap", WRAPS[t->wrap[0]], WRAPS[t->wrap[1]], "size", t->width, t->height,
                     "pad", pad_of(t, 0), pad_of(t, 1), "nearest", t->nearest);
}
