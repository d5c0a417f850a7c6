/* <texture>: its image from a file beside the document, its sampler, and the coordinates that an instance binds to it. */
#include "collada_internal.h"

#include "renderer/base/fs.h"
#include "renderer/image/image_oiio.h"

#include <libxml/uri.h>
#include <string.h>

/* Path of the file that a URI names: relative to the document's directory, absolute, or after file://. */
static struct path find_file(struct loader *ld, const xmlNode *n)
{
    const char *word = text_read_word(ld, n), *rest = strstr(word, "://");
    struct path uri = fs_path("%s", rest != NULL ? rest + 3 : word);
    if (rest != NULL && strncmp(word, "file://", 7) != 0)
        fail_at(ld, n, "an image from '%.200s' is not supported", word);
    xmlURIUnescapeString(uri.s, 0, uri.s);
    return rest != NULL || uri.s[0] == '/' ? uri : fs_beside_file(element_document(n)->path, uri.s);
}

/* An image of the scene, which is read at the first call; NULL: failed. */
static const struct image *get_image(struct loader *ld, const xmlNode *image)
{
    struct err why;
    struct scene *s = &ld->scene;
    if (!element_check(ld, image, "init_from *"))
        return NULL;
    const xmlNode *from = element_child(image, "init_from"), *ref = element_child(from, "ref");
    from = ref != NULL ? ref : from;
    struct path file = find_file(ld, from);
    for (uint32_t i = 0; i < s->num_images; i++)
        if (strcmp(image_get_attr(&s->images[i], SCENE_IMAGE_FILE), file.s) == 0)
            return &s->images[i];
    s->images = build_grow(ld, s->images, sizeof *s->images, s->num_images);
    if (ld->failed)
        return NULL;
    struct image *im = &s->images[s->num_images];
    if (!image_read_colours(file.s, im, &why)) {
        fail_at(ld, from, "%s", why.msg);
        return NULL;
    }
    s->num_images++;
    if (!image_set_attr(im, SCENE_IMAGE_FILE, file.s, &why))
        element_fail_memory(ld);
    return im;
}

/* Reads wrap modes and filter. NONE counts as BORDER; only a black border is supported. */
static void read_sampler(struct loader *ld, const xmlNode *sampler, struct texture *t)
{
    static const char WRAPS[] = "WRAP MIRROR CLAMP BORDER NONE";
    const xmlNode *border = element_child(sampler, "border_color");
    rgb colour = border != NULL ? text_read_color(ld, border, NULL) : grey(0);
    int wrap[2] = {field_choice(ld, sampler, "wrap_s", WRAPS, TEXTURE_WRAP),
                   field_choice(ld, sampler, "wrap_t", WRAPS, TEXTURE_WRAP)},
        filter = field_choice(ld, sampler, "magfilter",
                              "NEAREST NEAREST_MIPMAP_NEAREST NEAREST_MIPMAP_LINEAR LINEAR "
                              "LINEAR_MIPMAP_NEAREST LINEAR_MIPMAP_LINEAR NONE",
                              3);
    for (int k = 0; k < 2; k++)
        t->wrap[k] = (enum texture_wrap)(wrap[k] < TEXTURE_BORDER ? wrap[k] : TEXTURE_BORDER);
    t->nearest = filter < 3;
    if ((t->wrap[0] == TEXTURE_BORDER || t->wrap[1] == TEXTURE_BORDER) && !rgb_is_zero(colour))
        fail_at(ld, border, "a <border_color> that is not black is not supported");
}

uint32_t texture_get(struct loader *ld, const xmlNode *texture, const char **texcoord)
{
    struct scene *s = &ld->scene;
    struct texture_use use = parameter_get_texture(ld, texture);
    struct texture t = {0};
    const struct image *image = get_image(ld, use.image);
    *texcoord = use.texcoord;
    read_sampler(ld, use.sampler, &t);
    if (image == NULL)
        return 0;
    t.width = image->width;
    t.height = image->height;
    t.texel = image->data;
    for (uint32_t map = 1; map <= s->num_textures; map++) {
        const struct texture *o = &s->textures[map - 1];
        if (o->texel == t.texel && o->wrap[0] == t.wrap[0] && o->wrap[1] == t.wrap[1] &&
            o->nearest == t.nearest)
            return map;
    }
    s->textures = build_grow(ld, s->textures, sizeof *s->textures, s->num_textures);
    if (!ld->failed)
        s->textures[s->num_textures++] = t;
    return s->num_textures;
}

/* Without a binding the first set is meant. */
size_t texture_find_set(struct loader *ld, const xmlNode *instance, const xmlNode *binding,
                        const char *texcoord, const struct mesh_group *g)
{
    const xmlNode *bound = element_child_with(binding, "bind_vertex_input", "semantic", texcoord);
    uint64_t set = element_count_or(ld, bound, "input_set", 0);
    const size_t count = g != NULL ? g->num_uv : 0;
    if (count == 0)
        fail_at(ld, instance, "a texture on a surface without texture coordinates");
    for (size_t k = 0; k < count; k++)
        if (bound == NULL || g->uv_set[k] == set)
            return k;
    fail_at(ld, binding, "no set %llu of texture coordinates", (unsigned long long)set);
    return 0;
}
