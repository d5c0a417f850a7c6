/* The material tags of our own extras and of the assignment's: the children of an <effect>'s technique with
 * profile="ASSAY" or profile="CGL". A tag that extra_read_material() does not list is an error ("unexpected <x> in
 * <technique>", from element_check()). */
#include "collada_internal.h"

#include <string.h>

/* The assignment's emitter emits to both sides and reflects nothing; ours keeps the reflection of profile_COMMON, which
 * is already in *m. */
static void read_emission(struct loader *ld, const xmlNode *tag, bool is_cgl, struct material *m)
{
    if (!is_cgl && !rgb_is_zero(m->radiance))
        fail_at(ld, tag, "<emission> here and in profile_COMMON: give one");
    element_check(ld, tag, is_cgl ? "radiance" : "radiance sides");
    m->radiance = field_color(ld, tag, "radiance", FLT_MAX);
    m->radiance_both_sides = is_cgl || field_choice(ld, tag, "sides", "1 2", 0) == 1;
}

static void read_mirror(struct loader *ld, const xmlNode *tag, struct material *m)
{
    element_check(ld, tag, "reflectance");
    m->kind = MATERIAL_MIRROR;
    m->reflectance = field_color(ld, tag, "reflectance", 1);
}

/* <glass> or <refraction>, smooth only. The assignment's files carry a <roughness> that nothing uses; other values than
 * 0 are refused. */
static void read_dielectric(struct loader *ld, const xmlNode *tag, struct material *m)
{
    bool is_glass = element_is(tag, "glass");
    element_check(ld, tag,
                  is_glass ? "transmittance reflectance ior roughness?"
                           : "transmittance ior roughness?");
    m->kind = is_glass ? MATERIAL_GLASS : MATERIAL_REFRACTION;
    m->reflectance = field_color(ld, tag, "reflectance", 1);
    m->transmittance = field_color(ld, tag, "transmittance", 1);
    m->ior = (float)field_number(ld, tag, "ior", 1, (double)(1 / MAX_IOR), MAX_IOR);
    field_number(ld, tag, "roughness", 0, 0, 0);
}

/* Rough metal. The assignment's: Beckmann, height-correlated shadowing, Fresnel by eta and k. */
static void read_microfacet(struct loader *ld, const xmlNode *tag, bool is_cgl, struct material *m)
{
    m->conductor = is_cgl || element_child(tag, "reflectance") == NULL;
    element_check(ld, tag,
                  is_cgl         ? "alpha eta k"
                  : m->conductor ? "alpha eta k distribution? shadowing?"
                                 : "alpha reflectance distribution? shadowing?");
    m->kind = MATERIAL_MICROFACET;
    m->microfacet = is_cgl || field_choice(ld, tag, "distribution", "ggx beckmann", 0) == 1
                        ? MICROFACET_BECKMANN
                        : MICROFACET_GGX;
    m->separable = field_choice(ld, tag, "shadowing", "correlated separable", 0) == 1;
    m->alpha = (float)field_number(ld, tag, "alpha", 1, (double)MICROFACET_MIN_ALPHA, 10);
    m->eta = field_color(ld, tag, "eta", 1000);
    m->k = field_color(ld, tag, "k", 1000);
    m->reflectance = field_color(ld, tag, "reflectance", 1);
}

void extra_read_material(struct loader *ld, const xmlNode *technique, struct material *m)
{
    bool is_cgl = strcmp(element_attribute(technique, "profile"), "CGL") == 0;
    const xmlNode *tag = element_first(technique);
    if (!element_check(ld, technique, "emission|mirror|glass|refraction|microfacet"))
        return;
    if (is_cgl || !element_is(tag, "emission")) { /* replaces what reflects */
        m->kind = MATERIAL_DIFFUSE;
        m->reflectance = m->specular = m->mirror = grey(0);
        m->reflectance_map = 0;
        m->separable = false;
    }
    if (element_is(tag, "emission"))
        read_emission(ld, tag, is_cgl, m);
    else if (element_is(tag, "mirror"))
        read_mirror(ld, tag, m);
    else if (element_is(tag, "microfacet"))
        read_microfacet(ld, tag, is_cgl, m);
    else
        read_dielectric(ld, tag, m);
}
