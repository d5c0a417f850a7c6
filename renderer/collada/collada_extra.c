/* The material tags of our own extras and of the assignment's: an <effect>'s technique with
 * profile="ASSAY" or profile="CGL". */
#include "collada_internal.h"

#include <string.h>

/* To support one more tag, give it a reader here. */
struct material_tag {
    const char *profile, *name;
    bool (*read)(struct loader *ld, const xmlNode *tag, struct material *m);
};

#define IOR   "ior", FIELD_FLOAT, &m->ior, true, .lo = (double)(1 / MAX_IOR), .hi = MAX_IOR
#define ALPHA "alpha", FIELD_FLOAT, &m->alpha, true, .lo = (double)MICROFACET_MIN_ALPHA, .hi = 10

/* The assignment's emitter shines to both sides and reflects nothing. */
static bool read_cgl_emission(struct loader *ld, const xmlNode *tag, struct material *m)
{
    m->radiance_both_sides = true;
    return field_read_all(ld, tag, FIELDS({FIELD_OF_COLOR("radiance", &m->radiance, 0)}));
}

/* Ours adds to the reflection of profile_COMMON, which is in *m already. */
static bool read_assay_emission(struct loader *ld, const xmlNode *tag, struct material *m)
{
    if (!rgb_is_zero(m->radiance))
        return fail_at(ld, tag, "<emission> here and in profile_COMMON: give one");
    return field_read_all(
        ld, tag,
        FIELDS({FIELD_OF_COLOR("radiance", &m->radiance, 0)},
               {"sides", FIELD_CHOICE, &m->radiance_both_sides, true, .words = {"1", "2"}}));
}

static bool read_mirror(struct loader *ld, const xmlNode *tag, struct material *m)
{
    m->kind = MATERIAL_MIRROR;
    return field_read_all(ld, tag, FIELDS({FIELD_OF_COLOR("reflectance", &m->reflectance, 1)}));
}

/* Smooth only. The assignment's files carry a <roughness> that nothing uses; another than 0 would
 * mean something. */
static bool read_refraction(struct loader *ld, const xmlNode *tag, struct material *m)
{
    double roughness;
    m->kind = MATERIAL_REFRACTION;
    return field_read_all(ld, tag,
                          FIELDS({FIELD_OF_COLOR("transmittance", &m->transmittance, 1)}, {IOR},
                                 {"roughness", FIELD_NUMBER, &roughness, .lo = 0, .hi = 0}));
}

static bool read_glass(struct loader *ld, const xmlNode *tag, struct material *m)
{
    double roughness;
    m->kind = MATERIAL_GLASS;
    return field_read_all(ld, tag,
                          FIELDS({FIELD_OF_COLOR("transmittance", &m->transmittance, 1)},
                                 {FIELD_OF_COLOR("reflectance", &m->reflectance, 1)}, {IOR},
                                 {"roughness", FIELD_NUMBER, &roughness, .lo = 0, .hi = 0}));
}

/* The assignment's conductor: Beckmann, heights correlated, Fresnel by eta and k. */
static bool read_cgl_microfacet(struct loader *ld, const xmlNode *tag, struct material *m)
{
    m->kind = MATERIAL_MICROFACET;
    m->microfacet = MICROFACET_BECKMANN;
    m->conductor = true;
    return field_read_all(ld, tag,
                          FIELDS({ALPHA}, {FIELD_OF_COLOR("eta", &m->eta, 1000)},
                                 {FIELD_OF_COLOR("k", &m->k, 1000)}));
}

static bool read_assay_microfacet(struct loader *ld, const xmlNode *tag, struct material *m)
{
    bool beckmann = false;
    const struct field distribution = {"distribution", FIELD_CHOICE, &beckmann,
                                       .words = {"ggx", "beckmann"}},
                       shadowing = {"shadowing", FIELD_CHOICE, &m->separable,
                                    .words = {"correlated", "separable"}};
    m->kind = MATERIAL_MICROFACET;
    m->conductor = element_child_named(tag, "reflectance") == NULL;
    bool ok = m->conductor
                  ? field_read_all(ld, tag,
                                   FIELDS(distribution, shadowing, {ALPHA},
                                          {FIELD_OF_COLOR("eta", &m->eta, 1000)},
                                          {FIELD_OF_COLOR("k", &m->k, 1000)}))
                  : field_read_all(ld, tag,
                                   FIELDS(distribution, shadowing, {ALPHA},
                                          {FIELD_OF_COLOR("reflectance", &m->reflectance, 1)}));
    m->microfacet = beckmann ? MICROFACET_BECKMANN : MICROFACET_GGX;
    return ok;
}

/* All but the first take the place of what profile_COMMON reflects. */
static const struct material_tag TAGS[] = {
    {"ASSAY", "emission", read_assay_emission},
    {"ASSAY", "mirror", read_mirror},
    {"ASSAY", "glass", read_glass},
    {"ASSAY", "refraction", read_refraction},
    {"ASSAY", "microfacet", read_assay_microfacet},
    {"CGL", "emission", read_cgl_emission},
    {"CGL", "mirror", read_mirror},
    {"CGL", "glass", read_glass},
    {"CGL", "refraction", read_refraction},
    {"CGL", "microfacet", read_cgl_microfacet},
};

bool extra_read_material(struct loader *ld, const xmlNode *technique, struct material *m)
{
    const char *profile = element_attribute(technique, "profile");
    xmlNode *tag;
    if (!element_technique_content(ld, technique, &tag))
        return false;
    for (size_t i = 0; i < sizeof TAGS / sizeof *TAGS; i++)
        if (strcmp(TAGS[i].profile, profile) == 0 && element_is(tag, TAGS[i].name)) {
            if (i > 0) {
                m->kind = MATERIAL_DIFFUSE;
                m->reflectance = m->specular = m->mirror = grey(0);
                m->reflectance_map = 0;
                m->separable = false;
            }
            return TAGS[i].read(ld, tag, m);
        }
    return fail_at(ld, tag, "unknown material tag '%.60s'", (const char *)tag->name);
}
