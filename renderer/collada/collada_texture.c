/* <texture>: its image from a file beside the document, its sampler, and the coordinates that an instance binds to it. */
#include "collada_internal.h"

#include "renderer/base/fs.h"
#include "renderer/image/image_oiio.h"

#include <stdlib.h>
#include <string.h>

/* The file that a URI means: relative to the document's directory, or after file://. */
static bool find_file(struct loader *ld, const xmlNode *n, char *uri, struct path *out)
{
    char *rest = strstr(uri, "://");
    if (rest != NULL && strncmp(uri, "file://", 7) != 0)
        return fail_at(ld, n, "an image from '%.200s' is not supported", uri);
    text_decode_percents(uri);
    if (rest != NULL)
        *out = fs_path("%s", rest + 3);
    else
        *out = uri[0] == '/' ? fs_path("%s", uri) : fs_beside_file(element_document(n)->path, uri);
    return true;
}

/* The number of an image of the scene, which is read at the first call. */
static bool get_image(struct loader *ld, const xmlNode *image, uint32_t *number)
{
    xmlNode *from, *ref = NULL;
    struct path file;
    struct err why;
    struct scene *s = &ld->scene;
    if (!element_one_child(ld, image, "init_from", &from) ||
        (from != NULL && !element_one_child(ld, from, "ref", &ref)))
        return false;
    if (from == NULL)
        return fail_at(ld, image, "<image> without <init_from>");
    from = ref != NULL ? ref : from;
    char *uri = text_read_word(ld, from);
    bool ok = uri != NULL && find_file(ld, from, uri, &file);
    free(uri);
    if (!ok)
        return false;
    for (*number = 0; *number < s->num_images; ++*number)
        if (strcmp(image_get_attr(&s->images[*number], SCENE_IMAGE_FILE), file.s) == 0)
            return true;
    struct image *grown = build_grow(ld, s->images, sizeof *grown, s->num_images, &ld->cap_images);
    if (grown == NULL)
        return false;
    s->images = grown;
    struct image *im = &grown[s->num_images];
    if (!image_read_colours(file.s, im, &why))
        return fail_at(ld, from, "%s", why.msg);
    s->num_images++;
    return image_set_attr(im, SCENE_IMAGE_FILE, file.s, &why) || fail_memory(ld);
}

/* The place of the text of n's child `name` among words; `missing` if there is no such child. */
static bool read_word_of(struct loader *ld, const xmlNode *n, const char *name,
                         const char *const *words, int missing, int *which)
{
    xmlNode *child = NULL;
    *which = missing;
    if (n == NULL || !element_one_child(ld, n, name, &child) || child == NULL)
        return n == NULL || child == NULL;
    char *word = text_read_word(ld, child);
    for (*which = 0; word != NULL && words[*which] != NULL; ++*which)
        if (strcmp(word, words[*which]) == 0)
            break;
    bool ok = word != NULL && (words[*which] != NULL ||
                               fail_at(ld, child, "<%s> '%.60s' is not supported", name, word));
    free(word);
    return ok;
}

/* Beyond the edges; a border is black unless it says more, and NONE is a border. */
static bool read_sampler(struct loader *ld, const xmlNode *sampler, struct texture *t)
{
    static const char *const WRAPS[] = {"WRAP", "MIRROR", "CLAMP", "BORDER", "NONE", NULL};
    static const char *const FILTERS[] = {"NEAREST",
                                          "LINEAR",
                                          "NONE",
                                          "NEAREST_MIPMAP_NEAREST",
                                          "LINEAR_MIPMAP_NEAREST",
                                          "NEAREST_MIPMAP_LINEAR",
                                          "LINEAR_MIPMAP_LINEAR",
                                          NULL};
    int wrap[2], filter;
    xmlNode *border = NULL;
    rgb colour = grey(0);
    if (!read_word_of(ld, sampler, "wrap_s", WRAPS, TEXTURE_WRAP, &wrap[0]) ||
        !read_word_of(ld, sampler, "wrap_t", WRAPS, TEXTURE_WRAP, &wrap[1]) ||
        !read_word_of(ld, sampler, "magfilter", FILTERS, 1, &filter) ||
        (sampler != NULL && !element_one_child(ld, sampler, "border_color", &border)) ||
        (border != NULL && !text_read_color(ld, border, &colour, NULL)))
        return false;
    for (int k = 0; k < 2; k++)
        t->wrap[k] = (enum texture_wrap)(wrap[k] < TEXTURE_BORDER ? wrap[k] : TEXTURE_BORDER);
    t->nearest = filter == 0 || filter == 3 || filter == 5;
    bool shows = t->wrap[0] == TEXTURE_BORDER || t->wrap[1] == TEXTURE_BORDER;
    return !shows || rgb_is_zero(colour) ||
           fail_at(ld, border, "a <border_color> that is not black is not supported");
}

bool texture_get(struct loader *ld, const xmlNode *texture, uint32_t *map, const char **texcoord)
{
    struct scene *s = &ld->scene;
    struct texture_use use;
    struct texture t = {0};
    uint32_t image;
    if (!parameter_get_texture(ld, texture, &use) || !get_image(ld, use.image, &image) ||
        !read_sampler(ld, use.sampler, &t))
        return false;
    *texcoord = use.texcoord;
    t.width = s->images[image].width;
    t.height = s->images[image].height;
    t.texel = s->images[image].data;
    for (*map = 1; *map <= s->num_textures; ++*map) {
        const struct texture *o = &s->textures[*map - 1];
        if (o->texel == t.texel && o->wrap[0] == t.wrap[0] && o->wrap[1] == t.wrap[1] &&
            o->nearest == t.nearest)
            return true;
    }
    struct texture *grown =
        build_grow(ld, s->textures, sizeof *grown, s->num_textures, &ld->cap_textures);
    if (grown == NULL)
        return false;
    s->textures = grown;
    grown[s->num_textures++] = t;
    return true;
}

/* The set that the name is bound to; a file that binds nothing means its first. */
static bool find_binding(struct loader *ld, const xmlNode *binding, const char *texcoord,
                         bool *is_bound, uint64_t *set)
{
    *is_bound = false;
    *set = 0;
    for (const xmlNode *c = binding != NULL ? element_first_child(binding) : NULL;
         c != NULL && texcoord != NULL; c = element_next_sibling(c)) {
        const char *semantic = element_attribute(c, "semantic");
        if (!element_is(c, "bind_vertex_input") || semantic == NULL ||
            strcmp(semantic, texcoord) != 0)
            continue;
        *is_bound = true;
        return element_attribute_count_or(ld, c, "input_set", 0, set);
    }
    return true;
}

bool texture_find_set(struct loader *ld, const xmlNode *instance, const xmlNode *binding,
                      const char *texcoord, const struct mesh_group *g, size_t *which)
{
    bool is_bound;
    uint64_t set;
    *which = 0;
    if (!find_binding(ld, binding, texcoord, &is_bound, &set))
        return false;
    if (g == NULL || g->num_uv == 0)
        return fail_at(ld, instance, "a texture on a surface without texture coordinates");
    while (is_bound && *which < g->num_uv && g->uv_set[*which] != set)
        ++*which;
    return *which < g->num_uv ||
           fail_at(ld, binding, "no set %llu of texture coordinates", (unsigned long long)set);
}
