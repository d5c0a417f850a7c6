/* Materials: resolves the material symbol of a primitive through <instance_material> and <material> to an <effect>, and
 * reads its profile_COMMON. The material tags of our own extras are read in collada_extra.c. */
#include "collada_internal.h"

#include <string.h>

/* The value of a shader's channel, given directly or by a parameter; fails on a texture. NULL: no value. */
static const xmlNode *find_value(struct loader *ld, const xmlNode *shader, const char *name,
                                 bool is_color)
{
    const xmlNode *channel = element_child(shader, name), *value = element_first(channel);
    if (channel == NULL ||
        !element_check(ld, channel, is_color ? "color|param|texture" : "float|param"))
        return NULL;
    if (element_is(value, "param"))
        return parameter_get(ld, value, element_attribute(value, "ref"),
                             is_color ? "float3 float4" : "float");
    if (element_is(value, "texture")) {
        parameter_get_texture(ld, value);
        fail_at(ld, value, "<%s> by <texture> is not supported%s", name,
                ld->dialect == DIALECT_COLLADA ? " (--dialect cgl ignores it)" : "");
    }
    return value;
}

/* Colour of a shader's channel, `missing` if it is not there, which leaves *alpha as it is. */
static rgb read_channel(struct loader *ld, const xmlNode *shader, const char *name, rgb missing,
                        double *alpha)
{
    const xmlNode *color = find_value(ld, shader, name, true);
    return color != NULL ? text_read_color(ld, color, alpha) : missing;
}

/* The same, but accepts a <texture>: the colour is then white, and *map is set. */
static rgb read_mapped_channel(struct loader *ld, const xmlNode *shader, const char *name,
                               rgb missing, uint32_t *map)
{
    const xmlNode *channel = element_child(shader, name),
                  *texture = element_child(channel, "texture");
    const char *other = ld->texcoord;
    if (texture == NULL)
        return read_channel(ld, shader, name, missing, NULL);
    element_check(ld, channel, "texture");
    *map = texture_get(ld, texture, &ld->texcoord);
    if (other != NULL && (ld->texcoord == NULL || strcmp(ld->texcoord, other) != 0))
        fail_at(ld, texture, "a second set of texture coordinates in one material");
    return grey(1);
}

static double read_factor(struct loader *ld, const xmlNode *shader, const char *name,
                          double missing)
{
    const xmlNode *number = find_value(ld, shader, name, false);
    if (number != NULL)
        text_read_numbers(ld, number, &missing, 1, 1);
    return missing;
}

/* COLLADA 1.5 "Determining Transparency (Opacity)": true if all light passes; fails unless all or none does. */
static bool is_transparent(struct loader *ld, const xmlNode *shader)
{
    const xmlNode *transparent = element_child(shader, "transparent"),
                  *factor = element_child(shader, "transparency");
    const char *mode = element_attribute(transparent, "opaque");
    double alpha = 1;
    rgb color = read_channel(ld, shader, "transparent", grey(1), &alpha);
    mode = mode != NULL ? mode : "A_ONE";
    if (element_place_among(mode, "A_ONE A_ZERO RGB_ONE RGB_ZERO") < 0)
        fail_at(ld, transparent, "unknown opaque=\"%.60s\"", mode);
    bool by_alpha = mode[0] == 'A';
    double scale = read_factor(ld, shader, "transparency", 1),
           most = scale * (by_alpha ? alpha : (double)rgb_max(color)),
           least = scale * (by_alpha ? alpha : (double)fminf(fminf(color.r, color.g), color.b)),
           opaque = strstr(mode, "_ONE") != NULL;
    if (least != most || (most != 0 && most != 1))
        fail_at(ld, transparent != NULL ? transparent : factor,
                "transparency is not supported (--dialect cgl ignores it)");
    return most == 1 - opaque;
}

/* Scales diffuse, specular and mirror so that no channel of their sum exceeds 1. */
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

/* Reads highlight and mirror image. Blinn's (n.h)^shininess is as wide as Beckmann's of alpha^2 = 2/(shininess + 2)
 * [Walter07 5.2], Phong's (r.v)^shininess as Blinn's with four times the exponent, since r turns twice as fast as h. */
static void read_highlight(struct loader *ld, const xmlNode *shader, struct material *m)
{
    const double shininess = read_factor(ld, shader, "shininess", 0),
                 reflectivity = read_factor(ld, shader, "reflectivity", 1);
    m->specular = read_channel(ld, shader, "specular", grey(0), NULL);
    m->mirror = rgb_scale(read_channel(ld, shader, "reflective", grey(0), NULL),
                          (float)fmax(0, reflectivity));
    const bool shines = !rgb_is_zero(m->specular), mirrors = !rgb_is_zero(m->mirror);
    if (shines && element_is(shader, "lambert"))
        fail_at(ld, element_child(shader, "specular"), "a <lambert> that is <specular>");
    if (ld->failed || (!shines && !mirrors))
        return;
    const double n = fmax(0, shininess) * (element_is(shader, "phong") ? 4 : 1);
    m->alpha = fmaxf(MICROFACET_MIN_ALPHA, (float)sqrt(2 / (n + 2)));
    m->microfacet = MICROFACET_BECKMANN;
    m->separable = true;
    m->kind = MATERIAL_PLASTIC;
    darken(ld, m);
    if (!rgb_is_zero(m->reflectance) || (shines && mirrors))
        return;
    m->kind = shines ? MATERIAL_MICROFACET : MATERIAL_MIRROR;
    m->reflectance = shines ? m->specular : m->mirror;
    m->specular = m->mirror = grey(0);
}

/* Only for the note: the assignment ignores <specular>, so an invalid one is no error. */
static bool has_highlight(const struct loader *ld, const xmlNode *shader)
{
    struct loader quiet = *ld;
    const xmlNode *channel = element_child(shader, "specular"),
                  *color = element_child(channel, "color");
    quiet.err = NULL;
    return color != NULL ? !rgb_is_zero(text_read_color(&quiet, color, NULL)) : channel != NULL;
}

static void read_shader(struct loader *ld, const xmlNode *shader, struct material *m)
{
    bool is_constant = element_is(shader, "constant"), is_cgl = ld->dialect == DIALECT_CGL;
    element_check(ld, shader,
                  is_constant ? "emission? reflective? reflectivity? transparent? transparency? "
                                "index_of_refraction?"
                              : "emission? ambient? diffuse? specular? shininess? reflective? "
                                "reflectivity? transparent? transparency? index_of_refraction?");
    m->reflectance = read_mapped_channel(
        ld, shader, "diffuse", grey(is_cgl && !is_constant ? 0.5f : 0), &m->reflectance_map);
    m->radiance = read_mapped_channel(ld, shader, "emission", grey(0), &m->radiance_map);
    m->radiance_both_sides = true;
    if (rgb_max(m->reflectance) > 1)
        fail_at(ld, element_child(shader, "diffuse"), "diffuse reflectance above 1");
    if (is_cgl && !rgb_is_zero(m->radiance))
        fail_at(ld, element_child(shader, "emission"),
                "the assignment has no emission in profile_COMMON: use a technique of profile CGL");
    ld->num_specular += is_cgl && has_highlight(ld, shader);
    ld->is_transparent = !is_cgl && is_transparent(ld, shader);
    if (!is_cgl && !ld->is_transparent)
        read_highlight(ld, shader, m);
}

static void read_common(struct loader *ld, const xmlNode *common, struct material *m)
{
    element_check(ld, common, "asset? image* newparam* technique extra*");
    const xmlNode *technique = element_child(common, "technique"),
                  *shader = element_first(technique);
    element_check(ld, technique,
                  "asset? annotate* image* newparam* extra* lambert|phong|blinn|constant");
    while (shader != NULL && !element_is_one_of(shader, "lambert phong blinn constant"))
        shader = element_next(shader);
    if (!ld->failed)
        read_shader(ld, shader, m);
}

static void read_effect(struct loader *ld, const xmlNode *effect, struct material *m)
{
    element_check(ld, effect,
                  "asset? annotate* image* newparam* extra* profile_COMMON? profile_BRIDGE* "
                  "profile_CG* profile_GLES* profile_GLES2* profile_GLSL*");
    const xmlNode *technique = element_own_technique(ld, effect),
                  *common = element_child(effect, "profile_COMMON");
    bool is_cgl = technique != NULL && strcmp(element_attribute(technique, "profile"), "CGL") == 0;
    if (common == NULL && technique == NULL) /* only shader code: as without material */
        ld->num_left_out[LEFT_OUT_MATERIAL] += ld->dialect == DIALECT_COLLADA;
    if (!is_cgl && common != NULL)
        read_common(ld, common, m);
    if (technique == NULL || ld->failed)
        return;
    if (ld->is_transparent)
        fail_at(ld, technique, "a technique of ours for a surface that is transparent");
    extra_read_material(ld, technique, m);
}

static void read_material(struct loader *ld, const xmlNode *material, struct material *m)
{
    const char *name = element_attribute(material, "name"), *id = element_attribute(material, "id");
    element_check(ld, material, "asset? instance_effect extra*");
    const xmlNode *instance = element_child(material, "instance_effect");
    element_check(ld, instance, "technique_hint* setparam* extra*");
    const xmlNode *effect = reference_follow(ld, instance, "url", "effect");
    ld->instance_effect = instance;
    ld->is_transparent = false;
    build_copy_name(m->name, sizeof m->name, name != NULL ? name : id != NULL ? id : "material");
    if (effect != NULL)
        read_effect(ld, effect, m);
}

/* The slot of a material, which is read at the first call. NULL: the grey that the assignment, or else Blender, gives a
 * surface without material. */
static struct material_slot slot_get(struct loader *ld, const xmlNode *material)
{
    for (size_t i = 0; i < ld->num_slots; i++)
        if (ld->slots[i].node == material)
            return ld->slots[i];
    struct material_slot slot = {.node = material, .index = NO_SURFACE};
    struct material m = {.name = "default",
                         .kind = MATERIAL_DIFFUSE,
                         .reflectance = grey(ld->dialect == DIALECT_CGL ? 0.5f : 0.8f)};
    ld->texcoord = NULL;
    if (material != NULL)
        read_material(ld, material, &m);
    if (material == NULL || !ld->is_transparent)
        slot.index = build_add_material(ld, &m);
    slot.texcoord = ld->texcoord;
    ld->slots = build_grow(ld, ld->slots, sizeof *ld->slots, ld->num_slots);
    if (!ld->failed)
        ld->slots[ld->num_slots++] = slot;
    return slot;
}

/* The <instance_material>s of an instance, NULL if nothing is bound. */
static const xmlNode *find_bindings(struct loader *ld, const xmlNode *instance)
{
    const xmlNode *bind = element_child(instance, "bind_material"),
                  *common = element_child(bind, "technique_common");
    element_check(ld, instance, "bind_material? extra*");
    element_check(ld, bind, "param* technique_common? technique* extra*");
    element_check(ld, common, "instance_material*");
    return element_first(common);
}

uint32_t material_get(struct loader *ld, const xmlNode *instance, const xmlNode *user,
                      const char *symbol, const struct mesh_group *group, size_t *uv_set)
{
    bool is_cgl = ld->dialect == DIALECT_CGL;
    const xmlNode *first = find_bindings(ld, instance), *match = NULL;
    for (const xmlNode *c = first; c != NULL && !ld->failed; c = element_next(c)) {
        const char *s = element_needed_attribute(ld, c, "symbol");
        element_check(ld, c, "bind* bind_vertex_input* extra*");
        if (symbol != NULL && strcmp(s, symbol) != 0)
            continue;
        if (match != NULL && !is_cgl && symbol == NULL && group != NULL) {
            match = NULL; /* ambiguous */
            break;
        }
        if (match != NULL && !is_cgl && symbol != NULL)
            fail_at(ld, c, "a second binding of symbol '%.60s'", s);
        else if (match != NULL && !is_cgl)
            fail_at(ld, c, "two materials for one surface");
        match = match != NULL ? match : c;
    }
    if (match == NULL && is_cgl)
        match = first;
    if (match == NULL && !is_cgl && symbol != NULL && first != NULL)
        fail_at(ld, instance, "no material bound to symbol '%.60s' of line %ld", symbol,
                element_line(user));
    ld->num_left_out[LEFT_OUT_MATERIAL] += match == NULL && !is_cgl;
    const xmlNode *material =
        match != NULL ? reference_follow(ld, match, "target", "material") : NULL;
    if (ld->failed)
        return NO_SURFACE;
    const struct material_slot slot = slot_get(ld, material);
    *uv_set = 0;
    ld->num_left_out[LEFT_OUT_TRANSPARENT] += slot.index == NO_SURFACE;
    if (!ld->failed && slot.index != NO_SURFACE &&
        material_has_map(&ld->scene.materials[slot.index]))
        *uv_set = texture_find_set(ld, instance, match, slot.texcoord, group);
    return slot.index;
}
