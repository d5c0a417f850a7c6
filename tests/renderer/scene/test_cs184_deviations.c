/* The defects of the assignment's starter code that --starter reproduces, against their expected effect. */
#include "renderer/shading/light_simd.h"
#include "renderer/scene/cs184_deviations.h"
#include "tests/support/build_scene.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

/* A lamp of unit radiance that faces down, about (0, height, 0). */
static struct scene lamp(float width, float depth, float height, unsigned bits)
{
    struct scene s = build_scene();
    struct err e = {""};
    uint32_t m = build_material(&s, grey(0), grey(1));
    build_quad(&s, v3(-width / 2, height, -depth / 2), v3(width, 0, 0), v3(0, 0, depth), m);
    MUST(scene_finish(&s, "test", &e));
    assert_int_equal(s.num_lights, 1);
    MUST(cs184_deviations_apply(&s, bits, &e));
    return s;
}

/* Irradiance at p, normal +Y, by light sampling on a grid of 128 x 128 numbers for each of the two triangles. *most: the largest |x| and |z| sampled. */
static double sampled_irradiance(const struct scene *s, vec3 p, vec3 *most)
{
    enum { SIDE = 128 };
    struct err e = {""};
    struct light_table *t = light_table_build(s, &e);
    assert_non_null(t);
    double sum = 0;
    *most = v3(0, 0, 0);
    for (int i = 0; i < 2 * SIDE * SIDE; i++) {
        const float u[4] = {((float)(i / 2 % SIDE) + 0.5f) / SIDE,
                            ((float)(i / 2 / SIDE) + 0.5f) / SIDE, i % 2 ? 0.25f : 0.75f, 0.5f};
        struct light_samplev l;
        sample_light_from(t, 0, p, v3(0, 1, 0), u, 1, &l);
        if (l.pdf_w > 0)
            sum += (double)(l.radiance.g * l.wi.y / l.pdf_w);
        vec3 q = mad(p, l.distance, l.wi);
        *most = vmax(*most, v3(fabsf(q.x), fabsf(q.y), fabsf(q.z)));
    }
    light_table_free(t);
    return sum / (2 * SIDE * SIDE);
}

/* The same by the rectangle's area, in double: cos cos / d^2 at 400 x 400 places. `times_distance`: what a density
 * that lacks a factor of the distance makes of it. */
static double irradiance(float width, float depth, float height, vec3 p, bool times_distance)
{
    enum { SIDE = 400 };
    double sum = 0, area = (double)width * (double)depth;
    for (int i = 0; i < SIDE * SIDE; i++) {
        double x = (double)width * ((i % SIDE + 0.5) / SIDE - 0.5) - (double)p.x;
        double z = (double)depth * ((i / SIDE + 0.5) / SIDE - 0.5) - (double)p.z;
        double y = (double)(height - p.y), d2 = x * x + y * y + z * z;
        sum += y * y / (d2 * d2) * (times_distance ? sqrt(d2) : 1);
    }
    return sum * area / (SIDE * SIDE);
}

static void expect(double got, double want)
{
    if (!(fabs(got - want) < 2e-3 * want))
        fail_msg("%.6g instead of %.6g", got, want);
}

/* Without the defect the irradiance is the rectangle's. At three heights, so that 1/r is distinguished from 1/r^2. */
TEST(a_density_without_a_distance)
{
    const vec3 p = v3(0.3f, 0, -0.2f);
    for (float height = 0.5f; height < 3; height *= 2)
        for (int defect = 0; defect < 2; defect++) {
            vec3 most;
            OWN(scene) s = lamp(1, 0.5f, height, defect ? 1u << CS184_LIGHT_PDF : 0);
            expect(sampled_irradiance(&s, p, &most), irradiance(1, 0.5f, height, p, defect != 0));
        }
}

/* Rays see the turned rectangle; light sampling uses that of the file, with its own pdf. */
TEST(a_lamp_that_is_turned)
{
    const vec3 p = v3(1.2f, 0, 0.1f);
    vec3 most;
    OWN(scene) s = lamp(2, 0.5f, 1, 1u << CS184_TURNED_LAMP);
    vec3 seen = v3(0, 0, 0);
    for (int i = 0; i < 6; i++) {
        assert_true(fabsf(s.position[i].y - 1) < 1e-6f);
        seen = vmax(seen, v3(fabsf(s.position[i].x), 0, fabsf(s.position[i].z)));
    }
    assert_true(fabsf(seen.x - 0.25f) < 1e-6f && fabsf(seen.z - 1) < 1e-6f);
    assert_true(s.bounds_max.z >= 1 && s.bounds_min.z <= -1);
    double got = sampled_irradiance(&s, p, &most);
    assert_true(most.x < 1.0001f && most.x > 0.98f && most.z < 0.2501f && most.z > 0.24f);
    expect(got, irradiance(2, 0.5f, 1, p, false));
    /* Told from what is seen. */
    assert_true(fabs(irradiance(0.5f, 2, 1, p, false) / got - 1) > 0.1);
}

/* A tetrahedron about the origin, whose normals are those of its corners by symmetry, and a triangle alone, whose normals point to
 * its back: those of the file, all (0, 1, 0), are not used. */
TEST(normals_of_the_half_edge_mesh)
{
    static const vec3 corner[4] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    static const int face[4][3] = {{1, 3, 2}, {0, 2, 3}, {0, 3, 1}, {0, 1, 2}};
    struct err e = {""};
    OWN(scene) s = build_scene();
    uint32_t m = build_material(&s, grey(0.5f), grey(0));
    for (int f = 0; f < 4; f++)
        build_triangle(&s, corner[face[f][0]], corner[face[f][1]], corner[face[f][2]], m);
    build_triangle(&s, v3(5, 0, 0), v3(5, 0, 1), v3(6, 0, 0), m);
    for (uint32_t t = 0; t < s.num_triangles; t++)
        s.tri_object[t] = t / 4;
    for (uint32_t i = 0; i < 3 * s.num_triangles; i++)
        s.normal[i] = v3(0, 1, 0);
    MUST(cs184_deviations_apply(&s, 1u << CS184_NORMALS, &e));
    for (int i = 0; i < 15; i++) {
        vec3 want = i < 12 ? normalize(corner[face[i / 3][i % 3]]) : v3(0, -1, 0),
             off = sub(s.normal[i], want);
        if (dot(off, off) > 1e-12f)
            fail_msg("corner %d: %g %g %g", i, (double)s.normal[i].x, (double)s.normal[i].y,
                     (double)s.normal[i].z);
    }
}

/* Only lamps of two triangles are rectangles. */
TEST(other_lamps_stay)
{
    struct err e = {""};
    OWN(scene) s = build_scene();
    build_triangle(&s, v3(0, 1, 0), v3(1, 1, 0), v3(0, 1, 1), build_material(&s, grey(0), grey(1)));
    MUST(scene_finish(&s, "test", &e));
    MUST(cs184_deviations_apply(&s, 1u << CS184_TURNED_LAMP, &e));
    assert_true(s.position[1].x == 1 && s.position[1].z == 0 && s.position[2].z == 1);
}
