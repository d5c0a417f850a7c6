/* The material tags of our own extras and of the assignment's: an <effect>'s technique with
 * profile="ASSAY" or profile="CGL". */
#include "collada_internal.h"

#include <string.h>

/* To support one more tag, give it a reader here. */
struct material_tag {
    const char *profile, *name;
    bool (*read)(struct loader *ld, const xmlNode *tag, struct material *m);
};

/* The assignment's emitter shines to both sides and reflects nothing. */
static bool read_cgl_emission(struct loader *ld, const xmlNode *tag, struct material *m)
{
    xmlNode *radiance;
    if (!element_only_children(ld, tag, "radiance") ||
        !element_one_child(ld, tag, "radiance", &radiance))
        return false;
    if (radiance == NULL)
        return fail_at(ld, tag, "<emission> without <radiance>");
    m->reflectance = grey(0);
    m->radiance_both_sides = true;
    return text_read_color(ld, radiance, &m->radiance, NULL);
}

/* Ours adds to the reflection of profile_COMMON, which is in *m already. */
static bool read_assay_emission(struct loader *ld, const xmlNode *tag, struct material *m)
{
    xmlNode *radiance, *sides;
    double n;
    if (!rgb_is_zero(m->radiance))
        return fail_at(ld, tag, "<emission> here and in profile_COMMON: give one");
    if (!element_only_children(ld, tag, "radiance sides") ||
        !element_one_child(ld, tag, "radiance", &radiance) ||
        !element_one_child(ld, tag, "sides", &sides))
        return false;
    if (radiance == NULL || sides == NULL)
        return fail_at(ld, tag, "<emission> needs <radiance> and <sides>");
    if (!text_read_color(ld, radiance, &m->radiance, NULL) || !text_read_exactly(ld, sides, &n, 1))
        return false;
    if (n != 1 && n != 2)
        return fail_at(ld, sides, "<sides> is 1 or 2, not %g", n);
    m->radiance_both_sides = n == 2;
    return true;
}

/* A required child with a colour whose parts are at most `most`. */
static bool read_factor(struct loader *ld, const xmlNode *tag, const char *name, float most,
                        rgb *out)
{
    xmlNode *n;
    if (!element_one_child(ld, tag, name, &n))
        return false;
    if (n == NULL)
        return fail_at(ld, tag, "<%s> without <%s>", (const char *)tag->name, name);
    if (!text_read_color(ld, n, out, NULL))
        return false;
    return rgb_max(*out) <= most || fail_at(ld, n, "<%s> above %g", name, (double)most);
}

/* A required child with one number from lo to hi. */
static bool read_number(struct loader *ld, const xmlNode *tag, const char *name, float lo, float hi,
                        float *out)
{
    xmlNode *n;
    double v;
    if (!element_one_child(ld, tag, name, &n))
        return false;
    if (n == NULL)
        return fail_at(ld, tag, "<%s> without <%s>", (const char *)tag->name, name);
    if (!text_read_exactly(ld, n, &v, 1))
        return false;
    /* Compared as what will be stored: 0.0001 is not the same number in both precisions. */
    *out = fabs(v) <= (double)hi ? (float)v : INFINITY;
    return (*out >= lo && *out <= hi) ||
           fail_at(ld, n, "<%s> is %g, outside %g to %g", name, v, (double)lo, (double)hi);
}

/* The assignment's files carry a <roughness> that nothing uses; another than 0 would mean something. */
static bool no_roughness(struct loader *ld, const xmlNode *tag)
{
    xmlNode *n;
    double v;
    if (!element_one_child(ld, tag, "roughness", &n))
        return false;
    if (n == NULL)
        return true;
    return text_read_exactly(ld, n, &v, 1) &&
           (v == 0 || fail_at(ld, n, "rough %s is not supported", (const char *)tag->name));
}

static bool read_mirror(struct loader *ld, const xmlNode *tag, struct material *m)
{
    m->kind = MATERIAL_MIRROR;
    return element_only_children(ld, tag, "reflectance") &&
           read_factor(ld, tag, "reflectance", 1, &m->reflectance);
}

static bool read_refraction(struct loader *ld, const xmlNode *tag, struct material *m)
{
    m->kind = MATERIAL_REFRACTION;
    m->reflectance = grey(0);
    return element_only_children(ld, tag, "transmittance roughness ior") && no_roughness(ld, tag) &&
           read_factor(ld, tag, "transmittance", 1, &m->transmittance) &&
           read_number(ld, tag, "ior", 1 / MAX_IOR, MAX_IOR, &m->ior);
}

static bool read_glass(struct loader *ld, const xmlNode *tag, struct material *m)
{
    m->kind = MATERIAL_GLASS;
    return element_only_children(ld, tag, "transmittance reflectance roughness ior") &&
           no_roughness(ld, tag) && read_factor(ld, tag, "transmittance", 1, &m->transmittance) &&
           read_factor(ld, tag, "reflectance", 1, &m->reflectance) &&
           read_number(ld, tag, "ior", 1 / MAX_IOR, MAX_IOR, &m->ior);
}

/* The assignment's conductor: Beckmann, heights correlated, Fresnel by eta and k. */
static bool read_cgl_microfacet(struct loader *ld, const xmlNode *tag, struct material *m)
{
    m->kind = MATERIAL_MICROFACET;
    m->microfacet = MICROFACET_BECKMANN;
    m->conductor = true;
    m->reflectance = grey(0);
    return element_only_children(ld, tag, "alpha eta k") &&
           read_number(ld, tag, "alpha", MICROFACET_MIN_ALPHA, 10, &m->alpha) &&
           read_factor(ld, tag, "eta", 1000, &m->eta) && read_factor(ld, tag, "k", 1000, &m->k);
}

/* One of two words in a child; the first where the child is missing. */
static bool read_choice(struct loader *ld, const xmlNode *tag, const char *name, const char *first,
                        const char *second, bool *is_second)
{
    xmlNode *n;
    if (!element_one_child(ld, tag, name, &n))
        return false;
    *is_second = false;
    if (n == NULL)
        return true;
    char *word = text_read_word(ld, n);
    if (word == NULL)
        return false;
    *is_second = strcmp(word, second) == 0;
    bool ok = *is_second || strcmp(word, first) == 0 ||
              fail_at(ld, n, "<%s> is '%.60s', neither '%s' nor '%s'", name, word, first, second);
    free(word);
    return ok;
}

static bool read_assay_microfacet(struct loader *ld, const xmlNode *tag, struct material *m)
{
    bool beckmann;
    m->kind = MATERIAL_MICROFACET;
    m->reflectance = grey(0);
    m->conductor = element_child_named(tag, "reflectance") == NULL;
    if (!element_only_children(ld, tag,
                               m->conductor ? "distribution shadowing alpha eta k"
                                            : "distribution shadowing alpha reflectance") ||
        !read_choice(ld, tag, "distribution", "ggx", "beckmann", &beckmann) ||
        !read_choice(ld, tag, "shadowing", "correlated", "separable", &m->separable) ||
        !read_number(ld, tag, "alpha", MICROFACET_MIN_ALPHA, 10, &m->alpha))
        return false;
    m->microfacet = beckmann ? MICROFACET_BECKMANN : MICROFACET_GGX;
    if (!m->conductor)
        return read_factor(ld, tag, "reflectance", 1, &m->reflectance);
    return read_factor(ld, tag, "eta", 1000, &m->eta) && read_factor(ld, tag, "k", 1000, &m->k);
}

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
        if (strcmp(TAGS[i].profile, profile) == 0 && element_is(tag, TAGS[i].name))
            return TAGS[i].read(ld, tag, m);
    return fail_at(ld, tag, "unknown material tag '%.60s'", (const char *)tag->name);
}
