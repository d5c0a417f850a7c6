/* The integrator's stages give every sample the same bits at every vector width: one lane (ISA_SCALAR) against eight
 * (SSE4.2, AVX2) and sixteen (AVX-512), for each instruction set that this machine has. */
#include "renderer/scene/cs184_deviations.h"
#include "renderer/math/trig.h"
#include "tests/support/render_check.h"
#include "tests/support/sky.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

/* Not a multiple of a tile, nor of eight. */
enum { WIDTH = 37, HEIGHT = 21, MAX_ISAS = 4 };

static void add_room(struct scene *s, uint32_t wall)
{
    uint32_t red = build_material(s, (rgb){0.6f, 0.2f, 0.1f}, grey(0));
    uint32_t black = build_material(s, grey(0), grey(0));
    build_quad(s, v3(-1, 0, 1), v3(2, 0, 0), v3(0, 0, -2), wall);
    build_quad(s, v3(-1, 1.5f, -1), v3(2, 0, 0), v3(0, 0, 2), wall);
    build_quad(s, v3(-1, 0, -1), v3(2, 0, 0), v3(0, 1.5f, 0), red);
    build_quad(s, v3(-1, 0, 1), v3(0, 0, -2), v3(0, 1.5f, 0), black);
}

/* Every material and every kind of light, each light above another part of the room. */
static struct scene all_kinds(void)
{
    struct scene s = build_scene();
    const struct material kinds[] = {
        {.kind = MATERIAL_MIRROR, .reflectance = {0.9f, 0.8f, 0.7f}},
        {.kind = MATERIAL_GLASS,
         .reflectance = {0.9f, 1, 1},
         .transmittance = {0.8f, 0.9f, 1},
         .ior = 1.5f},
        {.kind = MATERIAL_GLASS,
         .reflectance = {1, 1, 1},
         .transmittance = {1, 1, 1},
         .ior = 1.3f,
         .schlick = true},
        {.kind = MATERIAL_REFRACTION, .transmittance = {0.8f, 0.9f, 1}, .ior = 0.8f},
        {.kind = MATERIAL_MICROFACET, .reflectance = {0.9f, 0.8f, 0.7f}, .alpha = 0.3f},
        {.kind = MATERIAL_MICROFACET,
         .conductor = true,
         .separable = true,
         .eta = {0.2f, 0.9f, 1.1f},
         .k = {3.9f, 2.5f, 2.4f},
         .alpha = 0.05f},
        {.kind = MATERIAL_MICROFACET,
         .conductor = true,
         .microfacet = MICROFACET_BECKMANN,
         .eta = {1.2f, 0.9f, 0},
         .k = {3.9f, 0.1f, 0},
         .alpha = 0.2f},
        {.kind = MATERIAL_PLASTIC,
         .reflectance = {0.3f, 0.2f, 0.1f},
         .specular = {0.2f, 0.4f, 0.3f},
         .mirror = {0.1f, 0.2f, 0.1f},
         .microfacet = MICROFACET_BECKMANN,
         .separable = true,
         .alpha = 0.2f},
    };
    add_room(&s, build_material(&s, grey(0.7f), grey(0)));
    for (int i = 0; i < 8; i++) {
        uint32_t m = build_like(&s, kinds[i]);
        float x = -0.75f + 0.2f * (float)i, z = 0.3f - 0.3f * (float)(i % 3);
        if (i % 2 == 0)
            build_sphere(&s, v3(x, 0.25f + 0.1f * (float)(i % 4), z), 0.15f, 1, m);
        else
            build_quad(&s, v3(x, 0.1f, z), v3(0.3f, 0, 0.1f), v3(0, 0.5f, -0.1f), m);
    }
    uint32_t lamp = build_material(&s, grey(0), (rgb){8, 9, 10});
    build_quad(&s, v3(-0.3f, 1.49f, -0.4f), v3(0.3f, 0, 0), v3(0, 0, 0.3f), lamp);
    s.materials[build_material(&s, grey(0.3f), (rgb){3, 2, 1})].radiance_both_sides = true;
    build_quad(&s, v3(0.5f, 0.9f, -0.4f), v3(0.2f, 0, 0.1f), v3(0, 0.3f, 0), s.num_materials - 1);
    build_sphere(&s, v3(-0.6f, 1.2f, 0.2f), 0.1f, 1, lamp);
    build_light(&s, (struct light){.kind = LIGHT_POINT,
                                   .position = {0.7f, 1.2f, 0.5f},
                                   .value = {0.5f, 0.4f, 0.3f},
                                   .attenuation = {0.1f, 0.2f, 1}});
    build_spot(&s, v3(0, 1.3f, 0.8f), v3(0, -0.8f, -0.6f), 0.7f, 2.5f, (rgb){2, 1, 1});
    build_sun(&s, v3(0.6f, 0.64f, 0.48f), (rgb){0.2f, 0.2f, 0.3f});
    return s;
}

/* More lamps than are sampled one by one, some of them turned away, and smooth normals. */
static struct scene many_lamps(void)
{
    struct scene s = build_scene();
    add_room(&s, build_material(&s, (rgb){0.5f, 0.7f, 0.6f}, grey(0)));
    uint32_t lamp = build_material(&s, grey(0.2f), (rgb){8, 9, 10});
    for (int i = 0; i < 20; i++)
        build_quad(&s, v3(-0.9f + 0.09f * (float)i, 1.45f, -0.4f), v3(0.05f, 0, 0),
                   v3(0, i % 3 == 0 ? 0.05f : 0, 0.2f), lamp);
    build_sphere(&s, v3(0, 0.4f, 0), 0.3f, 1, 0);
    for (uint32_t i = 0; i < 6; i++) /* of the floor and the ceiling */
        s.normal[i] = normalize(add(s.normal[i], v3(0.2f, 0.1f * (float)i, 0)));
    return s;
}

/* One lamp of more triangles than vectors look through, in a closed ball. */
static struct scene mesh_lamp(void)
{
    struct scene s = build_scene();
    uint32_t lamp = build_material(&s, grey(0), (rgb){4, 4, 5});
    for (int i = 0; i < 6; i++)
        build_quad(&s, v3(0.1f * (float)i, 0.2f * (float)i, 0), v3(0.2f, 0.1f, 0),
                   v3(0, 0.2f, 0.1f), lamp);
    build_join(&s, 0);
    build_sphere(&s, v3(0, 0, 0), 4, -1, build_material(&s, grey(0.5f), grey(0)));
    return s;
}

/* Textures of both kinds, on a floor and on lamps of two triangles and of many, all wraps, some texels black. */
static struct scene textured(void)
{
    struct scene s = build_scene();
    rgb colours[15];
    for (int i = 0; i < 15; i++)
        colours[i] = i % 4 == 1 ? grey(0) : (rgb){(float)i / 16, 0.5f, 1 - (float)i / 16};
    for (int i = 0; i < 8; i++)
        build_texture(&s, 5, 3, colours, i % 2 == 0, (enum texture_wrap)(i / 2));
    add_room(&s, build_material(&s, (rgb){0.8f, 0.7f, 0.6f}, grey(0)));
    s.materials[0].reflectance_map = 2;
    s.materials[1].reflectance_map = 3;
    s.materials[1].kind = MATERIAL_PLASTIC;
    s.materials[1].specular = (rgb){0.1f, 0.2f, 0};
    s.materials[1].alpha = 0.3f;
    build_uv(&s, 0, 3, (struct uv){-1.3f, -1.1f});
    for (int i = 0; i < 6; i++) {
        uint32_t lamp = build_material(&s, grey(0.4f), (rgb){4, 5, 6});
        s.materials[lamp].radiance_map = 3 + (uint32_t)i;
        s.materials[lamp].radiance_both_sides = i == 1;
        uint32_t first = s.num_triangles, object = s.num_objects;
        for (int k = 0; k <= i; k++)
            build_quad(&s, v3(-0.8f + 0.25f * (float)i, 0.4f + 0.1f * (float)k, -0.5f),
                       v3(0.2f, 0, 0), v3(0, 0.1f, 0.05f), lamp);
        build_uv(&s, first, 1 + (float)i, (struct uv){0.2f, -0.1f});
        build_join(&s, object);
    }
    return s;
}

struct how {
    struct integrator_options opt;
    float lens;
    const char *filter; /* NULL: box */
    int spp, threads;
    int width, height; /* 0: WIDTH, HEIGHT */
};

static struct moments image_of(const struct scene *s, const struct how *how)
{
    struct err e = {0};
    struct camera c;
    int width = how->width > 0 ? how->width : WIDTH,
        height = how->height > 0 ? how->height : HEIGHT;
    assert_true(camera_init(&c, s, width, height, &e));
    c.lens_radius = how->lens;
    c.focal_distance = 3;
    assert_true(how->filter == NULL || pixel_filter_parse(how->filter, &c.filter, &e));
    struct render_options o = {.integrator = how->opt,
                               .width = width,
                               .height = height,
                               .num_samples = (uint32_t)how->spp,
                               .threads = how->threads};
    return check_render_all(s, &c, &o, BVH_WIDE, NULL);
}

/* 0 and -0 may differ. */
static bool same(const struct moments *a, const struct moments *b)
{
    size_t n = (size_t)a->width * (size_t)a->height;
    for (size_t i = 0; i < 3 * n; i++)
        if (a->mean[i] != b->mean[i] || a->m2[i] != b->m2[i] || a->m3[i] != b->m3[i])
            return false;
    return memcmp(a->n, b->n, n * sizeof *a->n) == 0;
}

static double brightness(const struct moments *m)
{
    double sum = 0;
    for (size_t i = 0; i < 3 * (size_t)m->width * (size_t)m->height; i++)
        sum += m->mean[i];
    return sum;
}

static int machine_isas(enum isa isa[MAX_ISAS])
{
    int n = 0;
    for (int i = ISA_SSE42; i <= ISA_AVX512; i++) {
        struct err e = {0};
        enum isa choice = (enum isa)i;
        if (isa_choose(&choice, &e))
            isa[n++] = choice;
    }
    assert_true(n > 0);
    return n;
}

/* The image of every instruction set has the bits of one lane's; negative control: the next seed's has not. */
static void compare(const struct scene *s, struct how how)
{
    enum isa isa[MAX_ISAS];
    int n = machine_isas(isa);
    how.opt.isa = ISA_SCALAR;
    OWN(moments) scalar = image_of(s, &how);
    assert_true(brightness(&scalar) > 0);
    for (int i = 0; i < n; i++) {
        how.opt.isa = isa[i];
        OWN(moments) m = image_of(s, &how);
        if (!same(&scalar, &m))
            fail_msg("%s differs: direct %s, %d light samples, %s", isa_names[isa[i]],
                     direct_kind_names[how.opt.direct], how.opt.light_samples,
                     sampler_kind_names[how.opt.sampler.kind]);
    }
    how.opt.sampler.seed++;
    OWN(moments) other = image_of(s, &how);
    assert_false(same(&scalar, &other));
}

static void complete(struct scene *s, bool image)
{
    struct err e = {0};
    const struct sky sky = sky_uneven(8, 4);
    build_camera(s, v3(0, 0.75f, 3), 49);
    MUST(scene_finish(s, "test", &e));
    struct environment *env =
        image ? sky_environment(&sky) : environment_upper_half((rgb){1, 2, 3}, &e);
    assert_true(scene_add_environment(s, env, &e));
}

TEST(bits_are_those_of_one_lane)
{
    struct scene (*const make[])(void) = {all_kinds, many_lamps, mesh_lamp, textured};
    for (int which = 0; which < 8; which++) {
        OWN(scene) s = make[which / 2]();
        complete(&s, which % 2);
        for (int direct = DIRECT_HEMISPHERE; direct <= DIRECT_MIS; direct++)
            for (int sampler = SAMPLER_INDEPENDENT; sampler <= SAMPLER_SOBOL; sampler++) {
                int lights = direct == DIRECT_LIGHT ? 3 : 1;
                struct how how = {
                    .opt = {.direct = (enum direct_kind)direct,
                            .max_bounces = 5,
                            .first_bounce = sampler,
                            .light_samples = lights,
                            .many_lights = direct == DIRECT_BSDF ? LIGHTS_ONE : LIGHTS_AUTO,
                            .roulette = (enum roulette_kind)((direct + sampler) % 3),
                            .survival = 0.6f,
                            .sampler = {(enum sampler_kind)sampler, 77},
                            .guiding = sampler == SAMPLER_SOBOL && direct >= DIRECT_BSDF},
                    .lens = sampler == SAMPLER_SOBOL ? 0.1f : 0,
                    .filter = direct == DIRECT_LIGHT ? "gauss:0.5:2" : NULL,
                    .spp = 2,
                    .threads = 1};
                compare(&s, how);
            }
    }
}

/* Depths at which paths end in every way, and rows of fewer than eight. */
TEST(depths_and_threads_do_not_matter)
{
    OWN(scene) s = all_kinds();
    complete(&s, true);
    for (int bounces = 0; bounces < 9; bounces += 1 + bounces / 2) {
        struct how how = {.opt = {.direct = bounces % 2 ? DIRECT_LIGHT : DIRECT_MIS,
                                  .max_bounces = bounces,
                                  .light_samples = 1,
                                  .roulette = ROULETTE_THROUGHPUT,
                                  .sampler = {SAMPLER_INDEPENDENT, 5}},
                          .spp = 3,
                          .threads = 1 + bounces % 3};
        compare(&s, how);
    }
}

/* More shadow rays than paths, in a thread's first batch, which is only partly filled because the image is small. */
TEST(small_images_with_several_light_samples)
{
    OWN(scene) s = all_kinds();
    complete(&s, false);
    for (int lights = 2; lights <= 9; lights++)
        compare(&s, (struct how){.opt = {.direct = DIRECT_MIS,
                                         .max_bounces = 3,
                                         .light_samples = lights,
                                         .sampler = {SAMPLER_INDEPENDENT, 21}},
                                 .spp = 3,
                                 .threads = 1,
                                 .width = 2 * lights - 1,
                                 .height = 8});
}

/* What the starter code does wrong, to rectangles, to a lamp of many triangles and to rough metals. */
TEST(defects_of_the_starter_code)
{
    struct scene (*const make[])(void) = {all_kinds, mesh_lamp};
    for (int which = 0; which < 2; which++) {
        OWN(scene) s = make[which]();
        struct err e;
        complete(&s, false);
        MUST(cs184_deviations_apply(&s, (1u << NUM_CS184_DEVIATIONS) - 1, &e));
        compare(&s, (struct how){.opt = {.direct = DIRECT_LIGHT,
                                         .max_bounces = 3,
                                         .light_samples = 1,
                                         .sampler = {SAMPLER_INDEPENDENT, 3}},
                                 .spp = 2,
                                 .threads = 1});
    }
}

/* Triangles and spheres, smooth and flat, seen and missed. */
TEST(normals_too)
{
    struct scene (*const make[])(void) = {all_kinds, many_lamps, mesh_lamp};
    for (int which = 0; which < 3; which++) {
        OWN(scene) s = make[which]();
        complete(&s, false);
        compare(&s, (struct how){
                        .opt = {.kind = INTEGRATE_NORMALS, .sampler = {SAMPLER_INDEPENDENT, 9}},
                        .lens = 0.1f,
                        .spp = 2,
                        .threads = 2});
    }
}

/* Against the library's functions in double: 1.5e-7 at every 2^-16 of a turn, angles up to pi to 4e-7. */
TEST(sine_and_cosine_are_near)
{
    const double two_pi = 6.28318530717958647693;
    for (int i = 0; i < 65536; i++) {
        float s, c, v = (float)i / 65536;
        trig_turn(v, &s, &c);
        assert_true(fabs((double)s - sin(two_pi * v)) < 1.5e-7);
        assert_true(fabs((double)c - cos(two_pi * v)) < 1.5e-7);
        float x = 1.57079632679f * (v - 0.5f);
        trig_small(x, &s, &c);
        assert_true(fabs((double)s - sin((double)x)) < 1.5e-7);
        assert_true(fabs((double)c - cos((double)x)) < 1.5e-7);
        float y = sinf(x * (float)(i % 9 - 4)), across = cosf(x * (float)(i % 9 - 4));
        assert_true(fabs((double)trig_atan2(y, across) - atan2((double)y, (double)across)) < 4e-7);
    }
}
