/* What the values of a shader lead to: parameters of effects, and images behind textures. */
#include "collada_internal.h"

#include <stdlib.h>
#include <string.h>

/* The child of n of that element whose attribute says `value`. */
static const xmlNode *find_child(const xmlNode *n, const char *element, const char *attribute,
                                 const char *value)
{
    for (const xmlNode *c = element_first_child(n); c != NULL; c = element_next_sibling(c)) {
        const char *own = element_attribute(c, attribute);
        if (element_is(c, element) && own != NULL && strcmp(own, value) == 0)
            return c;
    }
    return NULL;
}

/* NULL: there is none of that name. */
static const xmlNode *find(const struct loader *ld, const xmlNode *user, const char *sid)
{
    const xmlNode *n = find_child(ld->instance_effect, "setparam", "ref", sid);
    for (; n == NULL && !element_is(user, "library_effects") && user->parent != NULL &&
           user->parent->type == XML_ELEMENT_NODE;
         user = user->parent)
        n = find_child(user, "newparam", "sid", sid);
    const xmlNode *value = n != NULL ? element_first_child(n) : NULL;
    while (value != NULL && element_is_one_of(value, "annotate semantic modifier"))
        value = element_next_sibling(value);
    return value;
}

bool parameter_get(struct loader *ld, const xmlNode *user, const char *sid, const char *kinds,
                   const xmlNode **value)
{
    *value = sid != NULL ? find(ld, user, sid) : NULL;
    if (*value == NULL)
        return fail_at(ld, user, "<%.60s>: no parameter '%.200s' in this effect",
                       (const char *)user->name, sid != NULL ? sid : "");
    return element_is_one_of(*value, kinds) ||
           fail_at(ld, user, "parameter '%.200s' is a <%.60s>, which does not fit here", sid,
                   (const char *)(*value)->name);
}

/* The text of the only child `name` of n. *word NULL: there is no such child; else the caller frees. */
static bool read_child_word(struct loader *ld, const xmlNode *n, const char *name, char **word)
{
    xmlNode *child;
    *word = NULL;
    if (!element_one_child(ld, n, name, &child) || child == NULL)
        return child == NULL;
    *word = text_read_word(ld, child);
    return *word != NULL;
}

/* COLLADA 1.4: <sampler2D> names a <surface>, which names an <image> (<init_from>, or <all> of
 * <init_planar>). */
static bool follow_surface(struct loader *ld, const xmlNode *sampler, const xmlNode **image)
{
    char *surface_name = NULL, *image_name = NULL;
    const xmlNode *surface, *planar, *all = NULL;
    const char *ref = NULL;
    bool ok = read_child_word(ld, sampler, "source", &surface_name) &&
              parameter_get(ld, sampler, surface_name, "surface", &surface) &&
              read_child_word(ld, surface, "init_from", &image_name);
    if (ok && (planar = element_child_named(surface, "init_planar")) != NULL)
        all = element_child_named(planar, "all");
    if (ok)
        ref = image_name != NULL ? image_name : all != NULL ? element_attribute(all, "ref") : NULL;
    ok = ok && (ref != NULL || fail_at(ld, surface, "<surface> without <init_from>")) &&
         reference_find(ld, surface, ref, "image", image);
    free(surface_name);
    free(image_name);
    return ok;
}

bool parameter_get_texture(struct loader *ld, const xmlNode *texture, struct texture_use *out)
{
    const char *name = element_attribute(texture, "texture");
    xmlNode *instance;
    if (name == NULL)
        return fail_at(ld, texture, "<texture> without attribute 'texture'");
    *out = (struct texture_use){.texcoord = element_attribute(texture, "texcoord")};
    /* Some programs name the image itself, as COLLADA 1.3 did. */
    if (find(ld, texture, name) == NULL)
        return reference_find(ld, texture, name, "image", &out->image);
    if (!parameter_get(ld, texture, name, "sampler2D", &out->sampler) ||
        !element_one_child(ld, out->sampler, "instance_image", &instance))
        return false;
    if (instance == NULL)
        return follow_surface(ld, out->sampler, &out->image);
    return reference_follow(ld, instance, "url", "image", &out->image);
}
