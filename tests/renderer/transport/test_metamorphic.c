/* What must hold between images, whatever is in them. One scene with all that a change of frame
 * could break: triangles with shading normals, a sphere, a rough metal, glass, an area lamp, a point
 * light and a spot light. Two images are compared by the mean of each channel over each quarter of
 * the image, 12 numbers. H0: the means are equal. Two-sided, alpha = 1e-6 each (|z| < 4.89), one
 * seed each, fixed n, no retry. With 1024 samples of 24 x 18 pixels the standard error of each
 * difference is below 1.5 % (checked), so a quarter that is off by 10 % is found with power
 * 0.96 at least. */
#include "tests/support/render_check.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

enum { WIDTH = 24, HEIGHT = 18, SPP = 1024, NUM_VALUES = 3 * WIDTH * HEIGHT };

enum lamps { AREA = 1, POINT = 2, SPOT = 4, ALL = 7 };

/* channel[c]: which of the scene's own channels is in place c. */
struct variant {
    enum lamps lamps;
    int channel[3];
};

static const struct variant original = {ALL, {0, 1, 2}};

static rgb permuted(const struct variant *v, float r, float g, float b)
{
    const float x[3] = {r, g, b};
    return (rgb){x[v->channel[0]], x[v->channel[1]], x[v->channel[2]]};
}

static struct scene build(const struct variant *v)
{
    struct scene s = build_scene();
    uint32_t grey = build_material(&s, permuted(v, .6f, .55f, .5f), (rgb){0, 0, 0});
    uint32_t red = build_material(&s, permuted(v, .7f, .2f, .1f), (rgb){0, 0, 0});
    uint32_t metal = build_material(&s, permuted(v, .9f, .8f, .6f), (rgb){0, 0, 0});
    s.materials[metal].kind = MATERIAL_MICROFACET;
    s.materials[metal].microfacet = MICROFACET_GGX;
    s.materials[metal].alpha = 0.5f;
    uint32_t glass = build_material(&s, permuted(v, 1, .9f, .8f), (rgb){0, 0, 0});
    s.materials[glass].kind = MATERIAL_GLASS;
    s.materials[glass].transmittance = permuted(v, .8f, .9f, 1);
    s.materials[glass].ior = 1.5f;
    build_quad(&s, v3(-1, 0, 1), v3(2, 0, 0), v3(0, 0, -2), grey);
    s.materials[red].kind = MATERIAL_PLASTIC;
    s.materials[red].specular = permuted(v, .1f, .2f, .3f);
    s.materials[red].mirror = permuted(v, .1f, .05f, .2f);
    s.materials[red].alpha = 0.4f;
    build_quad(&s, v3(-1, 0, -1), v3(2, 0, 0), v3(0, 1.5f, 0), red);
    build_sphere(&s, v3(-.45f, .35f, -.2f), .35f, 1, metal);
    build_sphere(&s, v3(.5f, .3f, .3f), .3f, 1, glass);
    build_triangle(&s, v3(-.2f, 0, .1f), v3(.5f, .1f, -.6f), v3(.1f, .9f, -.5f), grey);
    vec3 *n = s.normal + 3 * (size_t)(s.num_triangles - 1);
    n[0] = normalize(add(n[0], v3(-.3f, .2f, 0)));
    n[1] = normalize(add(n[1], v3(.3f, 0, .1f)));
    n[2] = normalize(add(n[2], v3(0, .4f, -.1f)));
    if (v->lamps & AREA) {
        uint32_t lamp = build_material(&s, (rgb){0, 0, 0}, permuted(v, 6, 5, 4));
        build_quad(&s, v3(-.5f, 1.6f, -.5f), v3(1, 0, 0), v3(0, 0, 1), lamp);
    }
    if (v->lamps & POINT)
        build_point(&s, v3(.8f, 1.2f, .7f), permuted(v, .5f, .7f, .9f));
    if (v->lamps & SPOT)
        build_spot(&s, v3(-.8f, 1.3f, .6f), normalize(v3(.5f, -1, -.4f)), .5f, 3,
                   permuted(v, 2, 1, .5f));
    build_camera(&s, v3(0, .8f, 3), 45);
    return s;
}

static struct moments look(struct scene *s, uint64_t seed)
{
    check_finish(s);
    struct moments m =
        check_render(s, check_options(DIRECT_MIS, 4, 20260301 + seed), WIDTH, HEIGHT, SPP);
    scene_free(s);
    return m;
}

/* Rotation by 40 degrees about (1,2,3)/sqrt(14) (Rodrigues' formula), or a reflection in x = 0. */
static vec3 turned(vec3 v, bool mirrored)
{
    const vec3 k = normalize(v3(1, 2, 3));
    const float c = cosf(0.69813170f), s = sinf(0.69813170f);
    if (mirrored)
        v.x = -v.x;
    return add(add(scale(v, c), scale(cross(k, v), s)), scale(k, dot(k, v) * (1 - c)));
}

/* The same for points, scaled by `size` and then translated. */
static vec3 moved(vec3 p, float size, bool mirrored)
{
    return add(scale(turned(p, mirrored), size), v3(3, -2, 5));
}

/* Everything, camera and lights too. Radiance stays: a point light's intensity grows by size^2. */
static void move(struct scene *s, float size, bool mirrored)
{
    for (uint32_t i = 0; i < 3 * s->num_triangles; i++) {
        s->position[i] = moved(s->position[i], size, mirrored);
        s->normal[i] = turned(s->normal[i], mirrored);
    }
    for (uint32_t i = 0; mirrored && i < s->num_triangles; i++) {
        /* The front side follows the winding. */
        vec3 *p = s->position + 3 * (size_t)i, *n = s->normal + 3 * (size_t)i, t = p[1], u = n[1];
        p[1] = p[2];
        p[2] = t;
        n[1] = n[2];
        n[2] = u;
    }
    for (uint32_t i = 0; i < s->num_spheres; i++) {
        s->spheres[i].centre = moved(s->spheres[i].centre, size, mirrored);
        s->spheres[i].radius *= size;
    }
    for (uint32_t i = 0; i < s->num_lights; i++) {
        struct light *l = &s->lights[i];
        l->position = moved(l->position, size, mirrored);
        l->axis = turned(l->axis, mirrored);
        l->value = rgb_scale(l->value, size * size);
    }
    struct scene_camera *c = &s->camera;
    c->eye = moved(c->eye, size, mirrored);
    c->right = turned(c->right, mirrored);
    c->up = turned(c->up, mirrored);
    c->backward = turned(c->backward, mirrored);
}

/* Column x of the one image is column WIDTH-1-x of the other. */
static void flip(struct moments *m)
{
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH / 2; x++)
            for (int c = 0; c < 3; c++) {
                double *a = &m->mean[3 * (y * WIDTH + x) + c];
                double *b = &m->mean[3 * (y * WIDTH + WIDTH - 1 - x) + c], t = *a;
                *a = *b;
                *b = t;
                double *va = &m->m2[3 * (y * WIDTH + x) + c];
                double *vb = &m->m2[3 * (y * WIDTH + WIDTH - 1 - x) + c], u = *va;
                *va = *vb;
                *vb = u;
            }
}

/* Largest |z| over channels and four quarters of the image: 12 tests. */
static double worst_z(const struct moments *a, const struct moments *b)
{
    double worst = 0;
    for (int quarter = 0; quarter < 4; quarter++)
        for (int c = 0; c < 3; c++) {
            double difference = 0, variance = 0, sum = 0;
            for (int y = 0; y < HEIGHT / 2; y++)
                for (int x = 0; x < WIDTH / 2; x++) {
                    size_t p = (size_t)((y + (quarter / 2) * HEIGHT / 2) * WIDTH + x +
                                        (quarter % 2) * WIDTH / 2);
                    difference += a->mean[3 * p + (size_t)c] - b->mean[3 * p + (size_t)c];
                    sum += a->mean[3 * p + (size_t)c];
                    variance += moments_var_of_mean(a, p, c) + moments_var_of_mean(b, p, c);
                }
            assert_true(sqrt(variance) < 0.015 * sum);
            worst = fmax(worst, fabs(difference) / sqrt(variance));
        }
    return worst;
}

TEST(rigid_motion_and_scale)
{
    struct scene s = build(&original);
    OWN(moments) still = look(&s, 0);
    static const float sizes[] = {1, 37.5f, 0.004f};
    for (size_t i = 0; i < 3; i++)
        for (int mirrored = 0; mirrored < 2; mirrored++) {
            /* The reflected camera must stay right-handed, so its image is reflected instead. */
            s = build(&original);
            move(&s, sizes[i], mirrored);
            if (mirrored)
                s.camera.right = neg(s.camera.right);
            OWN(moments) m = look(&s, 1 + 2 * i + (uint64_t)mirrored);
            if (mirrored)
                flip(&m);
            double z = worst_z(&still, &m);
            if (z > CHECK_Z_LIMIT)
                fail_msg("size %g, mirrored %d: z = %.2f", (double)sizes[i], mirrored, z);
        }
    /* Negative controls: intensities that do not grow with the size; a light left behind. */
    s = build(&original);
    move(&s, 1.2f, false);
    for (uint32_t i = 0; i < s.num_lights; i++)
        s.lights[i].value = rgb_scale(s.lights[i].value, 1 / 1.44f);
    struct moments m = look(&s, 11);
    assert_true(worst_z(&still, &m) > CHECK_Z_LIMIT);
    moments_free(&m);
    s = build(&original);
    s.lights[0].position.x -= 0.3f;
    m = look(&s, 12);
    assert_true(worst_z(&still, &m) > CHECK_Z_LIMIT);
    moments_free(&m);
}

/* Channels interact only in the survival probability of a path, which is symmetric in them, and in
 * the choice of one of many lights, for which there are too few here: so permuted channels have the
 * same bits. */
TEST(channels_permute)
{
    static const int permutations[][3] = {{1, 2, 0}, {2, 1, 0}, {0, 2, 1}};
    struct scene s = build(&original);
    OWN(moments) plain = look(&s, 0);
    for (size_t k = 0; k < 3; k++) {
        const int *to = permutations[k];
        const struct variant v = {ALL, {to[0], to[1], to[2]}};
        s = build(&v);
        OWN(moments) m = look(&s, 0);
        bool all_equal = true;
        for (size_t p = 0; p < WIDTH * HEIGHT; p++)
            for (int c = 0; c < 3; c++) {
                assert_true(m.mean[3 * p + (size_t)c] == plain.mean[3 * p + (size_t)to[c]]);
                assert_true(m.m2[3 * p + (size_t)c] == plain.m2[3 * p + (size_t)to[c]]);
                all_equal &= m.mean[3 * p + (size_t)c] == plain.mean[3 * p + (size_t)c];
            }
        assert_false(all_equal);
    }
}

/* The image by all lights is the sum of the images by each. */
TEST(lights_add)
{
    static const enum lamps single[] = {AREA, POINT, SPOT};
    struct scene s = build(&original);
    struct moments all = look(&s, 20), sum = {0};
    for (size_t k = 0; k < 3; k++) {
        struct variant v = original;
        v.lamps = single[k];
        s = build(&v);
        struct moments m = look(&s, 21 + k);
        if (k == 0) {
            sum = m;
            continue;
        }
        for (size_t i = 0; i < NUM_VALUES; i++) {
            sum.mean[i] += m.mean[i];
            sum.m2[i] += m.m2[i];
        }
        if (k == 2)
            assert_true(worst_z(&all, &sum) <= CHECK_Z_LIMIT);
        else /* negative control: the spot light is missing */
            assert_true(worst_z(&all, &sum) > CHECK_Z_LIMIT);
        moments_free(&m);
    }
    moments_free(&sum);
    moments_free(&all);
}
