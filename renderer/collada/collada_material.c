/* Materials: from the symbol of a primitive over <instance_material> and <material> to <effect>. */
#include "collada_internal.h"

#include <string.h>

/* What a channel of a shader says, itself (by the element `own`) or by a parameter of one of those
 * kinds; a line for a texture. *value NULL: nothing. */
static bool find_value(struct loader *ld, const xmlNode *shader, const char *name, const char *own,
                       const char *kinds, const xmlNode **value)
{
    xmlNode *channel;
    struct texture_use texture;
    *value = NULL;
    if (!element_one_child(ld, shader, name, &channel) || channel == NULL)
        return channel == NULL;
    *value = element_first_child(channel);
    if (*value == NULL)
        return fail_at(ld, channel, "<%s> without <%s>", name, own);
    if (element_next_sibling(*value) != NULL)
        return element_fail_unexpected(ld, element_next_sibling(*value));
    if (element_is(*value, "param"))
        return parameter_get(ld, *value, element_attribute(*value, "ref"), kinds, value);
    if (element_is(*value, "texture") && strcmp(own, "color") == 0)
        return parameter_get_texture(ld, *value, &texture) &&
               fail_at(ld, *value, "<%s> by <texture> is not supported%s", name,
                       ld->dialect == DIALECT_COLLADA ? " (--dialect cgl ignores it)" : "");
    return element_is(*value, own) || element_fail_unexpected(ld, *value);
}

/* One channel of a shader: a missing element leaves *value and *alpha as they are. */
static bool read_channel(struct loader *ld, const xmlNode *shader, const char *name, rgb *value,
                         double *alpha)
{
    const xmlNode *color;
    return find_value(ld, shader, name, "color", "float3 float4", &color) &&
           (color == NULL || text_read_color(ld, color, value, alpha));
}

/* The same, or a <texture>: *value is then white. */
static bool read_mapped_channel(struct loader *ld, const xmlNode *shader, const char *name,
                                rgb *value, uint32_t *map)
{
    xmlNode *channel;
    const char *texcoord, *other = ld->texcoord;
    if (!element_one_child(ld, shader, name, &channel))
        return false;
    const xmlNode *texture = channel != NULL ? element_first_child(channel) : NULL;
    if (texture == NULL || !element_is(texture, "texture"))
        return read_channel(ld, shader, name, value, NULL);
    if (element_next_sibling(texture) != NULL)
        return element_fail_unexpected(ld, element_next_sibling(texture));
    if (!texture_get(ld, texture, map, &texcoord))
        return false;
    *value = grey(1);
    ld->texcoord = texcoord;
    return other == NULL || (texcoord != NULL && strcmp(texcoord, other) == 0) ||
           fail_at(ld, texture, "a second set of texture coordinates in one material");
}

static bool read_factor(struct loader *ld, const xmlNode *shader, const char *name, double *value)
{
    const xmlNode *number;
    return find_value(ld, shader, name, "float", "float", &number) &&
           (number == NULL || text_read_exactly(ld, number, value, 1));
}

/* COLLADA 1.5 "Determining Transparency (Opacity)": all of the light passes, or none. */
static bool read_opacity(struct loader *ld, const xmlNode *shader)
{
    xmlNode *transparent;
    rgb color = grey(1);
    double alpha = 1, factor = 1;
    if (!element_one_child(ld, shader, "transparent", &transparent) ||
        !read_channel(ld, shader, "transparent", &color, &alpha) ||
        !read_factor(ld, shader, "transparency", &factor))
        return false;
    const char *mode = transparent != NULL ? element_attribute(transparent, "opaque") : NULL;
    mode = mode != NULL ? mode : "A_ONE";
    bool by_alpha = mode[0] == 'A';
    if (!element_word_is_one_of(mode, "A_ONE A_ZERO RGB_ONE RGB_ZERO"))
        return fail_at(ld, transparent, "unknown opaque=\"%.60s\"", mode);
    double most = (by_alpha ? alpha : (double)rgb_max(color)) * factor,
           least = (by_alpha ? alpha : (double)fminf(fminf(color.r, color.g), color.b)) * factor,
           opaque = strstr(mode, "_ONE") != NULL;
    ld->is_transparent = most == 1 - opaque && least == most;
    if (ld->is_transparent || (most == opaque && least == most))
        return true;
    return fail_at(ld,
                   transparent != NULL ? transparent : element_child_named(shader, "transparency"),
                   "transparency is not supported (--dialect cgl ignores it)");
}

/* No channel of the three together is to be above 1. */
static void darken(struct loader *ld, struct material *m)
{
    rgb *const part[] = {&m->reflectance, &m->specular, &m->mirror};
    const rgb texel = m->reflectance_map != 0
                          ? texture_max(&ld->scene.textures[m->reflectance_map - 1])
                          : grey(1);
    const float most =
        rgb_max(rgb_add(rgb_mul(m->reflectance, texel), rgb_add(m->specular, m->mirror)));
    if (!(most > 1))
        return;
    for (int i = 0; i < 3; i++)
        *part[i] = (rgb){part[i]->r / most, part[i]->g / most, part[i]->b / most};
    ld->num_left_out[LEFT_OUT_BRIGHT]++;
}

/* The highlight of Blinn's (n.h)^shininess is as wide as Beckmann's of alpha^2 = 2/(shininess + 2) [Walter07, after
 * eq. 31], that of Phong's (r.v)^shininess as Blinn's of four times the exponent: r turns twice as fast as h. */
static bool read_highlight(struct loader *ld, const xmlNode *shader, struct material *m)
{
    rgb reflective = grey(0);
    double reflectivity = 1, shininess = 0;
    if (!read_channel(ld, shader, "specular", &m->specular, NULL) ||
        !read_factor(ld, shader, "shininess", &shininess) ||
        !read_channel(ld, shader, "reflective", &reflective, NULL) ||
        !read_factor(ld, shader, "reflectivity", &reflectivity))
        return false;
    m->mirror = rgb_scale(reflective, (float)fmax(0, reflectivity));
    const bool shines = !rgb_is_zero(m->specular), mirrors = !rgb_is_zero(m->mirror);
    if (shines && element_is(shader, "lambert"))
        return fail_at(ld, element_child_named(shader, "specular"),
                       "a <lambert> that is <specular>");
    if (!shines && !mirrors)
        return true;
    const double n = fmax(0, shininess) * (element_is(shader, "phong") ? 4 : 1);
    m->alpha = fmaxf(MICROFACET_MIN_ALPHA, (float)sqrt(2 / (n + 2)));
    m->microfacet = MICROFACET_BECKMANN;
    m->separable = true;
    m->kind = MATERIAL_PLASTIC;
    darken(ld, m);
    if (!rgb_is_zero(m->reflectance) || (shines && mirrors))
        return true;
    m->kind = shines ? MATERIAL_MICROFACET : MATERIAL_MIRROR;
    m->reflectance = shines ? m->specular : m->mirror;
    m->specular = m->mirror = grey(0);
    return true;
}

/* What the assignment does not look at may be anything; only for the note. */
static bool has_highlight(const struct loader *ld, const xmlNode *shader)
{
    struct err ignored;
    struct loader quiet = *ld;
    rgb specular = grey(0);
    quiet.err = &ignored;
    return !read_channel(&quiet, shader, "specular", &specular, NULL) || !rgb_is_zero(specular);
}

static bool read_shader(struct loader *ld, const xmlNode *shader, struct material *m)
{
    bool is_constant = element_is(shader, "constant");
    if (!element_only_children(
            ld, shader,
            is_constant ? "emission reflective reflectivity transparent transparency "
                          "index_of_refraction"
                        : "emission ambient diffuse specular shininess reflective reflectivity "
                          "transparent transparency index_of_refraction"))
        return false;
    m->reflectance = grey(ld->dialect == DIALECT_CGL && !is_constant ? 0.5f : 0);
    m->radiance_both_sides = true;
    if (!read_mapped_channel(ld, shader, "diffuse", &m->reflectance, &m->reflectance_map) ||
        !read_mapped_channel(ld, shader, "emission", &m->radiance, &m->radiance_map))
        return false;
    if (rgb_max(m->reflectance) > 1)
        return fail_at(ld, element_child_named(shader, "diffuse"), "diffuse reflectance above 1");
    if (ld->dialect == DIALECT_COLLADA)
        return read_opacity(ld, shader) && (ld->is_transparent || read_highlight(ld, shader, m));
    if (!rgb_is_zero(m->radiance))
        return fail_at(ld, element_child_named(shader, "emission"),
                       "the assignment has no emission in profile_COMMON: use a technique of "
                       "profile CGL");
    ld->num_specular += has_highlight(ld, shader);
    return true;
}

static bool read_common(struct loader *ld, const xmlNode *common, struct material *m)
{
    xmlNode *technique;
    if (!element_only_children(ld, common, "asset image newparam technique extra") ||
        !element_one_child(ld, common, "technique", &technique))
        return false;
    if (technique == NULL)
        return fail_at(ld, common, "<profile_COMMON> without <technique>");
    const xmlNode *shader = NULL;
    for (const xmlNode *c = element_first_child(technique); c != NULL;
         c = element_next_sibling(c)) {
        if (element_is_one_of(c, "asset annotate image newparam extra"))
            continue;
        if (!element_is_one_of(c, "constant lambert phong blinn") || shader != NULL)
            return element_fail_unexpected(ld, c);
        shader = c;
    }
    if (shader == NULL)
        return fail_at(ld, technique,
                       "<technique> without <lambert>, <phong>, <blinn> or <constant>");
    return read_shader(ld, shader, m);
}

static bool read_effect(struct loader *ld, const xmlNode *effect, struct material *m)
{
    xmlNode *technique, *common;
    for (const xmlNode *c = element_first_child(effect); c != NULL; c = element_next_sibling(c))
        if (!element_is_one_of(c, "asset annotate image newparam extra") &&
            strncmp((const char *)c->name, "profile_", 8) != 0)
            return element_fail_unexpected(ld, c);
    if (!element_own_technique(ld, effect, &technique) ||
        !element_one_child(ld, effect, "profile_COMMON", &common))
        return false;
    bool is_cgl = technique != NULL && strcmp(element_attribute(technique, "profile"), "CGL") == 0;
    if (is_cgl)
        return extra_read_material(ld, technique, m);
    if (common == NULL && technique == NULL) /* of shaders alone: as no material */
        ld->num_left_out[LEFT_OUT_MATERIAL] += ld->dialect == DIALECT_COLLADA;
    if (common != NULL && !read_common(ld, common, m))
        return false;
    if (technique != NULL && ld->is_transparent)
        return fail_at(ld, technique, "a technique of ours for a surface that is transparent");
    if (technique == NULL)
        return true;
    return extra_read_material(ld, technique, m);
}

static bool read_material(struct loader *ld, const xmlNode *material, struct material *m)
{
    xmlNode *instance;
    const xmlNode *effect;
    if (!element_only_children(ld, material, "asset instance_effect extra") ||
        !element_one_child(ld, material, "instance_effect", &instance))
        return false;
    if (instance == NULL)
        return fail_at(ld, material, "<material> without <instance_effect>");
    if (!element_only_children(ld, instance, "technique_hint setparam extra") ||
        !reference_follow(ld, instance, "url", "effect", &effect))
        return false;
    const char *name = element_attribute(material, "name"), *id = element_attribute(material, "id");
    ld->instance_effect = instance;
    ld->is_transparent = false;
    build_copy_name(m->name, sizeof m->name, name != NULL ? name : id != NULL ? id : "material");
    return read_effect(ld, effect, m);
}

/* material NULL: what the assignment, or else Blender, takes for a surface without material. */
static bool slot_get(struct loader *ld, const xmlNode *material, uint32_t *index,
                     const char **texcoord)
{
    for (size_t i = 0; i < ld->num_slots; i++) {
        if (ld->slots[i].node == material) {
            *index = ld->slots[i].index;
            *texcoord = ld->slots[i].texcoord;
            return true;
        }
    }
    ld->texcoord = NULL;
    struct material m = {
        .name = "default",
        .kind = MATERIAL_DIFFUSE,
        .reflectance = grey(ld->dialect == DIALECT_CGL ? 0.5f : 0.8f),
    };
    if (material != NULL && !read_material(ld, material, &m))
        return false;
    struct material_slot *grown =
        build_grow(ld, ld->slots, sizeof *grown, ld->num_slots, &ld->cap_slots);
    if (grown == NULL)
        return false;
    ld->slots = grown;
    if (material != NULL && ld->is_transparent)
        *index = NO_SURFACE;
    else if (!build_add_material(ld, &m, index))
        return false;
    *texcoord = ld->texcoord;
    ld->slots[ld->num_slots++] = (struct material_slot){material, *index, *texcoord};
    return true;
}

/* The <technique_common> of the <bind_material>, NULL if nothing is bound. */
static bool find_bindings(struct loader *ld, const xmlNode *instance, xmlNode **common)
{
    xmlNode *bind;
    *common = NULL;
    if (!element_only_children(ld, instance, "bind_material extra") ||
        !element_one_child(ld, instance, "bind_material", &bind))
        return false;
    if (bind == NULL)
        return true;
    return element_only_children(ld, bind, "param technique_common technique extra") &&
           element_one_child(ld, bind, "technique_common", common) &&
           (*common == NULL || element_only_children(ld, *common, "instance_material"));
}

bool material_get(struct loader *ld, const xmlNode *instance, const xmlNode *user,
                  const char *symbol, const struct mesh_group *group, uint32_t *index,
                  size_t *uv_set)
{
    const char *texcoord;
    xmlNode *common;
    const xmlNode *material = NULL;
    if (!find_bindings(ld, instance, &common))
        return false;
    const xmlNode *first = common != NULL ? element_first_child(common) : NULL, *match = NULL;
    for (const xmlNode *c = first; c != NULL; c = element_next_sibling(c)) {
        const char *s = element_attribute(c, "symbol");
        if (s == NULL)
            return fail_at(ld, c, "<instance_material> without attribute 'symbol'");
        if (!element_only_children(ld, c, "bind bind_vertex_input extra"))
            return false;
        if (symbol != NULL && strcmp(s, symbol) != 0)
            continue;
        if (match != NULL && ld->dialect == DIALECT_COLLADA && symbol == NULL && group != NULL) {
            match = NULL; /* which of them nobody says */
            break;
        }
        if (match != NULL && ld->dialect == DIALECT_COLLADA)
            return symbol != NULL ? fail_at(ld, c, "a second binding of symbol '%.60s'", s)
                                  : fail_at(ld, c, "two materials for one surface");
        match = match != NULL ? match : c;
    }
    if (match == NULL && ld->dialect == DIALECT_CGL)
        match = first;
    if (match == NULL && ld->dialect == DIALECT_COLLADA && symbol != NULL && first != NULL)
        return fail_at(ld, instance, "no material bound to symbol '%.60s' of line %ld", symbol,
                       element_line(user));
    if (match == NULL)
        ld->num_left_out[LEFT_OUT_MATERIAL] += ld->dialect == DIALECT_COLLADA;
    else if (!reference_follow(ld, match, "target", "material", &material))
        return false;
    if (!slot_get(ld, material, index, &texcoord))
        return false;
    ld->num_left_out[LEFT_OUT_TRANSPARENT] += *index == NO_SURFACE;
    return *index == NO_SURFACE || !material_has_map(&ld->scene.materials[*index]) ||
           texture_find_set(ld, instance, match, texcoord, group, uv_set);
}
