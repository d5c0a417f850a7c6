/* Resolves what the values of a shader refer to: parameters of effects, and images of textures. */
#include "collada_internal.h"

#include <string.h>

/* The value of parameter `sid` for the element `user`; NULL if there is none. */
static const xmlNode *find(const struct loader *ld, const xmlNode *user, const char *sid)
{
    const xmlNode *n = element_child_with(ld->instance_effect, "setparam", "ref", sid);
    for (; n == NULL && !element_is(user, "library_effects") && user->parent != NULL &&
           user->parent->type == XML_ELEMENT_NODE;
         user = user->parent)
        n = element_child_with(user, "newparam", "sid", sid);
    const xmlNode *value = element_first(n);
    while (element_is_one_of(value, "annotate semantic modifier"))
        value = element_next(value);
    return value;
}

const xmlNode *parameter_get(struct loader *ld, const xmlNode *user, const char *sid,
                             const char *kinds)
{
    const xmlNode *value = sid != NULL ? find(ld, user, sid) : NULL;
    if (value == NULL)
        fail_at(ld, user, "<%.60s>: no parameter '%.200s' in this effect", (const char *)user->name,
                sid != NULL ? sid : "");
    else if (!element_is_one_of(value, kinds))
        fail_at(ld, user, "parameter '%.200s' is a <%.60s>, which does not fit here", sid,
                (const char *)value->name);
    return ld->failed ? NULL : value;
}

/* COLLADA 1.4: <sampler2D> names a <surface>, which names an <image> (<init_from>, or <all> of
 * <init_planar>). */
static const xmlNode *follow_surface(struct loader *ld, const xmlNode *sampler)
{
    const xmlNode *source = element_child(sampler, "source");
    const xmlNode *surface =
        parameter_get(ld, sampler, source != NULL ? text_read_word(ld, source) : NULL, "surface");
    if (!element_check(ld, surface, "init_from? init_planar? *"))
        return NULL;
    const xmlNode *from = element_child(surface, "init_from"),
                  *all = element_child(element_child(surface, "init_planar"), "all");
    const char *id = from != NULL ? text_read_word(ld, from) : element_attribute(all, "ref");
    if (id != NULL)
        return reference_find(ld, surface, id, "image");
    fail_at(ld, surface, "<surface> without <init_from>");
    return NULL;
}

struct texture_use parameter_get_texture(struct loader *ld, const xmlNode *texture)
{
    struct texture_use use = {.texcoord = element_attribute(texture, "texcoord")};
    const char *name = element_needed_attribute(ld, texture, "texture");
    if (ld->failed)
        return use;
    /* Some programs name the image directly, as in COLLADA 1.3. */
    if (find(ld, texture, name) == NULL) {
        use.image = reference_find(ld, texture, name, "image");
        return use;
    }
    use.sampler = parameter_get(ld, texture, name, "sampler2D");
    element_check(ld, use.sampler,
                  "source? instance_image? wrap_s? wrap_t? magfilter? border_color? *");
    const xmlNode *instance = element_child(use.sampler, "instance_image");
    if (ld->failed)
        return use;
    use.image = instance != NULL ? reference_follow(ld, instance, "url", "image")
                                 : follow_surface(ld, use.sampler);
    return use;
}
