/* Mirror, glass, refraction and microfacet in both profiles: every number arrives where it belongs, what
 * may be left out has its default, and the limits are inside. Faults are in test_collada_bad.c. */

#include "dae.h"
#include "tests/support/test.h"

/* The material of a triangle whose effect reflects (.2, .3, .4) diffusely and has that tag. */
static struct material load(const char *profile, const char *tag)
{
    char libraries[2048];
    int n = snprintf(
        libraries, sizeof libraries,
        "<library_effects><effect id=\"x-fx\">" COMMON(
            "<lambert><diffuse><color>.2 .3 .4</color></diffuse></lambert>") "<extra><technique profile=\"%s\">%s</technique></extra></effect>"
                                                                             "</library_effects><library_materials>" MATERIAL(
                                                                                 "x") "</library_materials>",
        profile, tag);
    assert_true(n > 0 && (size_t)n < sizeof libraries);
    struct dae d = {.libraries = libraries,
                    .nodes = "<node name=\"n\"><instance_geometry url=\"#tri\">" BIND(
                        "x") "</instance_geometry></node>"};
    struct scene s = dae_must_load(d, DIALECT_AUTO);
    assert_int_equal(s.dialect, strcmp(profile, "CGL") == 0 ? DIALECT_CGL : DIALECT_COLLADA);
    assert_int_equal(s.num_lights, 0);
    struct material m = s.materials[s.objects[0].material];
    scene_free(&s);
    return m;
}

static void assert_rgb(rgb c, float r, float g, float b)
{
    if (c.r != r || c.g != g || c.b != b)
        fail_msg("(%g %g %g), expected (%g %g %g)", (double)c.r, (double)c.g, (double)c.b,
                 (double)r, (double)g, (double)b);
}

static const char *const PROFILES[] = {"ASSAY", "CGL"};

TEST(mirror)
{
    for (int i = 0; i < 2; i++) {
        struct material m = load(PROFILES[i], "<mirror><reflectance>0 .5 1</reflectance></mirror>");
        assert_int_equal(m.kind, MATERIAL_MIRROR);
        assert_rgb(m.reflectance, 0, 0.5f, 1);
    }
}

TEST(glass)
{
    for (int i = 0; i < 2; i++) {
        struct material m = load(
            PROFILES[i], "<glass><ior>1.45</ior><transmittance>.1 .2 .3</transmittance>"
                         "<roughness>0</roughness><reflectance>.4 .5 .6</reflectance></glass>");
        assert_int_equal(m.kind, MATERIAL_GLASS);
        assert_rgb(m.transmittance, 0.1f, 0.2f, 0.3f);
        assert_rgb(m.reflectance, 0.4f, 0.5f, 0.6f);
        assert_true(m.ior == 1.45f && !m.schlick);
    }
}

TEST(refraction)
{
    static const char *const IOR[] = {"0.01", "0.75", "100"};
    static const float VALUE[] = {0.01f, 0.75f, 100};
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 3; k++) {
            char tag[256];
            snprintf(tag, sizeof tag,
                     "<refraction><transmittance>.1 0 1</transmittance><ior>%s</ior></refraction>",
                     IOR[k]);
            struct material m = load(PROFILES[i], tag);
            assert_int_equal(m.kind, MATERIAL_REFRACTION);
            assert_rgb(m.transmittance, 0.1f, 0, 1);
            assert_rgb(m.reflectance, 0, 0, 0);
            assert_true(m.ior == VALUE[k]);
        }
}

/* The assignment's is Beckmann with heights correlated. */
TEST(microfacet_of_the_assignment)
{
    struct material m = load("CGL", "<microfacet><alpha>.25</alpha><eta>.1 .2 .3</eta>"
                                    "<k>4 5 1000</k></microfacet>");
    assert_int_equal(m.kind, MATERIAL_MICROFACET);
    assert_int_equal(m.microfacet, MICROFACET_BECKMANN);
    assert_true(m.conductor && !m.separable && m.alpha == 0.25f);
    assert_rgb(m.eta, 0.1f, 0.2f, 0.3f);
    assert_rgb(m.k, 4, 5, 1000);
}

TEST(microfacet_of_ours)
{
    static const char *const DISTRIBUTION[] = {"", "<distribution>ggx</distribution>",
                                               "<distribution> beckmann </distribution>"};
    static const char *const SHADOWING[] = {"", "<shadowing>correlated</shadowing>",
                                            "<shadowing>separable</shadowing>"};
    for (int i = 0; i < 18; i++) {
        int d = i % 3, s = i / 3 % 3;
        bool conductor = i >= 9;
        char tag[512];
        snprintf(tag, sizeof tag, "<microfacet>%s%s<alpha>%s</alpha>%s</microfacet>",
                 DISTRIBUTION[d], SHADOWING[s], conductor ? "0.0001" : "10",
                 conductor ? "<eta>0 1 2</eta><k>3 4 5</k>"
                           : "<reflectance>.7 .8 .9</reflectance>");
        struct material m = load("ASSAY", tag);
        assert_int_equal(m.kind, MATERIAL_MICROFACET);
        assert_int_equal(m.microfacet, d == 2 ? MICROFACET_BECKMANN : MICROFACET_GGX);
        assert_int_equal(m.separable, s == 2);
        assert_int_equal(m.conductor, conductor);
        assert_true(m.alpha == (conductor ? 1e-4f : 10));
        if (conductor) {
            assert_rgb(m.eta, 0, 1, 2);
            assert_rgb(m.k, 3, 4, 5);
        } else {
            assert_rgb(m.reflectance, 0.7f, 0.8f, 0.9f);
        }
    }
}

/* The tags of one profile that the other has not: our choices in the assignment's tag. */
TEST(profiles_keep_to_themselves)
{
    struct dae d = {
        .libraries = "<library_effects>" EFFECT(
            "x",
            COMMON("<constant/>") EXTRA(
                "CGL",
                "<microfacet><alpha>.1</alpha>"
                "<reflectance>1 1 1</reflectance></microfacet>")) "</library_effects><library_materials>" MATERIAL("x") "</library_materials>",
        .nodes = "<node><instance_geometry url=\"#tri\">" BIND("x") "</instance_geometry></node>"};
    dae_must_fail(d, DIALECT_AUTO, "unexpected <reflectance>");
}
