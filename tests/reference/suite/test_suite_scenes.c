/* Scenes of the suite that have no closed form as a whole, by other routes: closed forms of their
 * direct light, a mirror unfolded into a second room, lamps one by one. H0 of every z-test: both sides
 * have the same mean. Two-sided at alpha = 1e-6 each (|z| < 4.89), one seed for each image, fixed n,
 * no retry; each has a negative control that the same test must reject. The power is
 * that the control is rejected; its comment says by how much it is wrong. */
#include "reference/suite/suite.h"
#include "tests/support/render_check.h"
#include "tests/support/suite_files.h"
#include "renderer/image/image_oiio.h"
#include "tests/support/own.h"
#include "tests/support/test.h"
#include "tests/support/vectors.h"

static const double DEGREE = M_PI / 180;

static struct scene open_shipped(const char *name)
{
    struct scene s;
    struct camera c;
    struct err e = {""};
    MUST(suite_open(suite_shipped_scene(name), &s, &c, &e));
    return s;
}

/* Camera ray of the image's point (x, y) in pixels of size x size, as the scene's .md has it. */
struct view {
    double eye[3], right[3], up[3], forward[3], tan_half;
};

static void view_ray(const struct view *v, double x, double y, int size, double d[3])
{
    double sx = (2 * x / size - 1) * v->tan_half, sy = (1 - 2 * y / size) * v->tan_half;
    for (int k = 0; k < 3; k++)
        d[k] = v->forward[k] + sx * v->right[k] + sy * v->up[k];
}

/* Distance along d to the triangle and the weights of its corners, by Cramer's rule; 0 if missed. */
static double hit(const double o[3], const double d[3], double p[3][3], double w[3])
{
    double u[3], v[3], r[3], dv[3], ru[3];
    for (int k = 0; k < 3; k++) {
        u[k] = p[1][k] - p[0][k];
        v[k] = p[2][k] - p[0][k];
        r[k] = o[k] - p[0][k];
    }
    cross3(d, v, dv);
    cross3(r, u, ru);
    double det = dot3(u, dv);
    if (det == 0)
        return 0;
    w[1] = dot3(r, dv) / det;
    w[2] = dot3(d, ru) / det;
    w[0] = 1 - w[1] - w[2];
    double t = dot3(v, ru) / det;
    return w[0] >= 0 && w[1] >= 0 && w[2] >= 0 && t > 0 ? t : 0;
}

/* z of the difference between the image and what is expected of it, over the pixels of a square, the
 * ones with a negative expectation left out; `slack` is the error allowed to the expectation's mean. */
static double z_square(const struct moments *m, const double *expected, int channel, int x0, int y0,
                       int side, double slack)
{
    double difference = 0, var = 0;
    int n = 0;
    for (int y = y0; y < y0 + side; y++)
        for (int x = x0; x < x0 + side; x++) {
            size_t p = (size_t)(y * m->width + x), i = 3 * p + (size_t)channel;
            if (expected[i] < 0)
                continue;
            difference += m->mean[i] - expected[i];
            var += moments_var_of_mean(m, p, channel);
            n++;
        }
    return n == 0 ? 0 : fmax(0, fabs(difference) - n * slack) / sqrt(var);
}

/* The largest of those z over the squares of an image, all channels. */
static double worst_z(const struct moments *m, const double *expected, int side, double slack)
{
    double worst = 0;
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < m->height; y += side)
            for (int x = 0; x < m->width; x += side)
                worst = fmax(worst, z_square(m, expected, c, x, y, side, slack));
    return worst;
}

/* 36_mesh_lamp: a room of five walls and the lamp, which is convex, so that a triangle which faces a
 * point of a wall is seen from there in full. */
static double lamp_corners[6][3] = {{.42, .95, .05}, {.05, 1.02, -.3}, {-.35, .9, 0},
                                    {0, .85, .38},   {0, 1.15, 0},     {.06, .5, .05}};
static const int lamp_triangles[8][3] = {{0, 1, 4}, {1, 0, 5}, {1, 2, 4}, {2, 1, 5},
                                         {2, 3, 4}, {3, 2, 5}, {3, 0, 4}, {0, 3, 5}};

/* What a ray of that room's camera sees of direct light, or -1 if it meets the lamp. `skip`: a triangle
 * of the lamp that is left out, -1 for none. */
static bool mesh_lamp_ray(const struct view *view, const double d[3], int skip, double l[3])
{
    static const double radiance[3] = {4, 3.5, 3};
    static const struct {
        double normal[3], offset; /* normal . p = offset on the wall */
        double albedo[3];
    } walls[5] = {{{0, 1, 0}, 0, {.6, .6, .6}},
                  {{0, -1, 0}, -1.5, {.6, .6, .6}},
                  {{0, 0, 1}, -1, {.6, .6, .6}},
                  {{1, 0, 0}, -1, {.6, .2, .2}},
                  {{-1, 0, 0}, -1, {.2, .2, .6}}};
    double at[3], w[3], corners[8][3][3], t = INFINITY;
    for (int i = 0; i < 8; i++) {
        for (int k = 0; k < 3; k++)
            memcpy(corners[i][k], lamp_corners[lamp_triangles[i][k]], sizeof corners[i][k]);
        if (hit(view->eye, d, corners[i], w) > 0)
            return false;
    }
    int wall = 0;
    for (int i = 0; i < 5; i++) {
        double towards = dot3(walls[i].normal, d);
        double ti = (walls[i].offset - dot3(walls[i].normal, view->eye)) / towards;
        if (towards < 0 && ti < t) {
            t = ti;
            wall = i;
        }
    }
    for (int k = 0; k < 3; k++)
        at[k] = view->eye[k] + t * d[k];
    double e = 0;
    for (int i = 0; i < 8; i++)
        if (i != skip) /* below zero: the point is behind the triangle */
            e += fmax(0, lambert_irradiance(corners[i], 3, at, walls[wall].normal));
    for (int c = 0; c < 3; c++)
        l[c] = walls[wall].albedo[c] / M_PI * radiance[c] * e;
    return true;
}

/* Means over pixels by n x n midpoints; -1 where the lamp is in sight, half a pixel around included. */
static void mesh_lamp_image(int size, int n, int skip, double *out)
{
    const struct view view = {{0, 0.75, 3}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}, tan(19.8 * DEGREE)};
    for (int p = 0; p < size * size; p++) {
        double sum[3] = {0};
        bool pure = true;
        for (int i = -n / 2; i < n + n / 2; i++)
            for (int j = -n / 2; j < n + n / 2; j++) {
                bool inside = i >= 0 && i < n && j >= 0 && j < n;
                double d[3], l[3];
                view_ray(&view, p % size + (i + 0.5) / n, p / size + (j + 0.5) / n, size, d);
                pure = pure && mesh_lamp_ray(&view, d, skip, l);
                for (int c = 0; pure && inside && c < 3; c++)
                    sum[c] += l[c] / (n * n);
            }
        for (int c = 0; c < 3; c++)
            out[3 * p + c] = pure ? sum[c] : -1;
    }
}

/* The rule's error is that of the edges between walls, which a pixel's rows of points meet to a
 * sixteenth of its side: far below the noise of a square. Control: without the largest of the eight
 * triangles, a quarter of the surface. */
TEST(mesh_lamp_direct_light_is_the_closed_form)
{
    enum { SIZE = 32, TILE = 8 };
    static double expected[2][3 * SIZE * SIZE];
    mesh_lamp_image(SIZE, 8, -1, expected[0]);
    mesh_lamp_image(SIZE, 8, 7, expected[1]);
    OWN(scene) s = open_shipped("36_mesh_lamp");
    struct integrator_options io = check_options(DIRECT_MIS, 1, 20261136);
    io.first_bounce = 1;
    OWN(moments) m = check_render(&s, io, SIZE, SIZE, 256);
    for (int side = SIZE; side >= TILE; side /= 4) {
        double z = worst_z(&m, expected[0], side, 0);
        if (z > CHECK_Z_LIMIT)
            fail_msg("a square of %d pixels: z %.2f", side, z);
        assert_true(worst_z(&m, expected[1], side, 0) > CHECK_Z_LIMIT);
    }
}

/* 27_smooth_normals at depth 1: albedo / pi x irradiance x cosine of the interpolated normal. The sun
 * stands higher than any facet of the dome is steep, so nothing casts a shadow, and all normals face
 * it. flat: with the geometric normal, the control. */
static void smooth_ray(const struct scene *s, const struct view *view, const double d[3], bool flat,
                       double l[3])
{
    static const double sun[3] = {3, 2.8, 2.4};
    const double a = 58 * DEGREE, b = 60 * DEGREE;
    const double to_sun[3] = {-sin(b) * cos(a), sin(a), cos(b) * cos(a)};
    double nearest = INFINITY;
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        double p[3][3], w[3], n[3] = {0}, u[3], v[3];
        for (int k = 0; k < 3; k++) {
            vec3 q = s->position[3 * i + (uint32_t)k];
            p[k][0] = q.x;
            p[k][1] = q.y;
            p[k][2] = q.z;
        }
        double t = hit(view->eye, d, p, w);
        if (t == 0 || t >= nearest)
            continue;
        nearest = t;
        for (int k = 0; k < 3; k++) {
            vec3 q = s->normal[3 * i + (uint32_t)k];
            n[0] += w[k] * q.x;
            n[1] += w[k] * q.y;
            n[2] += w[k] * q.z;
            u[k] = p[1][k] - p[0][k];
            v[k] = p[2][k] - p[0][k];
        }
        if (flat)
            cross3(u, v, n);
        unit3(n);
        rgb albedo = s->materials[s->tri_material[i]].reflectance;
        const double rho[3] = {albedo.r, albedo.g, albedo.b};
        for (int c = 0; c < 3; c++)
            l[c] = rho[c] / M_PI * sun[c] * fmax(0, dot3(n, to_sun));
    }
    assert_true(nearest < INFINITY);
}

/* Means over pixels by a Fibonacci lattice of n points, `step` being the Fibonacci number before n: even
 * for edges along the rows of pixels, which the rim of the dome has. */
static void smooth_image(const struct scene *s, int size, int n, int step, bool flat, double *out)
{
    const struct view view = {.eye = {0, 2.8, 0},
                              .right = {1, 0, 0},
                              .up = {0, 0, -1},
                              .forward = {0, -1, 0},
                              .tan_half = tan(20 * DEGREE)};
    for (int p = 0; p < size * size; p++) {
        double sum[3] = {0};
        for (int i = 0; i < n; i++) {
            double x = (i + 0.5) / n, y = (step * i % n + 0.5) / n, d[3], l[3];
            view_ray(&view, p % size + x, p / size + y, size, d);
            smooth_ray(s, &view, d, flat, l);
            for (int c = 0; c < 3; c++)
                sum[c] += l[c] / n;
        }
        for (int c = 0; c < 3; c++)
            out[3 * p + c] = sum[c];
    }
}

/* The only noise is where in a pixel the rays go, so the rule's error counts: between 144 and 377
 * points a square's mean must not differ by more than half the slack, which is 1e-3 of the radiance.
 * Control: geometric normals. */
TEST(smooth_normals_in_sunlight_are_the_closed_form)
{
    enum { SIZE = 16, TILE = 8 };
    const double slack = 5e-4;
    static double coarse[3 * SIZE * SIZE], fine[3 * SIZE * SIZE], flat[3 * SIZE * SIZE];
    OWN(scene) s = open_shipped("27_smooth_normals");
    smooth_image(&s, SIZE, 144, 89, false, coarse);
    smooth_image(&s, SIZE, 377, 233, false, fine);
    smooth_image(&s, SIZE, 34, 21, true, flat);
    for (int y = 0; y < SIZE; y += TILE)
        for (int x = 0; x < SIZE; x += TILE)
            for (int c = 0; c < 3; c++) {
                double sum = 0;
                for (int i = 0; i < TILE * TILE; i++) {
                    int p = (y + i / TILE) * SIZE + x + i % TILE;
                    sum += coarse[3 * p + c] - fine[3 * p + c];
                }
                assert_true(fabs(sum) / (TILE * TILE) < slack / 2);
            }
    OWN(moments) m = check_render(&s, check_options(DIRECT_MIS, 1, 20261127), SIZE, SIZE, 1024);
    double z = worst_z(&m, fine, TILE, slack);
    if (z > CHECK_Z_LIMIT)
        fail_msg("z %.2f", z);
    assert_true(worst_z(&m, flat, TILE, slack) > CHECK_Z_LIMIT);
}

static vec3 reflected(vec3 p)
{
    return v3(-2 - p.x, p.y, p.z);
}

/* 21_mirror without its mirror wall x = -1, and behind the gap everything once more, reflected. */
static struct scene unfolded(const struct scene *s)
{
    struct scene out = build_scene();
    memcpy(out.materials, s->materials, s->num_materials * sizeof *s->materials);
    out.num_materials = s->num_materials;
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        const vec3 *p = s->position + 3 * (size_t)i;
        uint32_t m = s->tri_material[i];
        if (strcmp(s->objects[s->tri_object[i]].name, "left") == 0)
            continue;
        build_triangle(&out, p[0], p[1], p[2], m);
        build_triangle(&out, reflected(p[0]), reflected(p[2]), reflected(p[1]), m);
    }
    for (uint32_t i = 0; i < s->num_spheres; i++) {
        const struct sphere *b = &s->spheres[i];
        build_sphere(&out, b->centre, b->radius, b->normal_out, s->sphere_material[i]);
        build_sphere(&out, reflected(b->centre), b->radius, b->normal_out, s->sphere_material[i]);
    }
    out.camera = s->camera;
    check_finish(&out);
    return out;
}

static void set_wall(struct scene *s, float reflectance)
{
    for (uint32_t i = 0; i < s->num_triangles; i++)
        if (strcmp(s->objects[s->tri_object[i]].name, "left") == 0)
            s->materials[s->tri_material[i]].reflectance = grey(reflectance);
}

/* Difference of two images in each square, in standard errors; the largest. */
static double worst_difference(const struct moments *a, const struct moments *b, int side)
{
    double worst = 0;
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < a->height; y += side)
            for (int x = 0; x < a->width; x += side) {
                double difference = 0, var = 0;
                for (int i = 0; i < side * side; i++) {
                    size_t p = (size_t)((y + i / side) * a->width + x + i % side);
                    difference += a->mean[3 * p + (size_t)c] - b->mean[3 * p + (size_t)c];
                    var += moments_var_of_mean(a, p, c) + moments_var_of_mean(b, p, c);
                }
                worst = fmax(worst, fabs(difference) / sqrt(var));
            }
    return worst;
}

/* A perfect mirror is a window into a reflected room: there, light sampling finds directly what here
 * only reflected rays can find. The room is convex and the camera sees nothing but its opening, so
 * no path gets around the wall. The mirror's reflections count as bounces; at depth 30 at least 15
 * others are left, and with albedos of at most 0.9 (the ball) and 0.7 what is missing then is below
 * 1e-4 of the noise. Control: a wall that reflects 0.95. */
TEST(mirror_wall_is_a_second_room)
{
    enum { SIZE = 32, TILE = 8, SPP = 1024, DEPTH = 30 };
    OWN(scene) s = open_shipped("21_mirror");
    set_wall(&s, 1);
    OWN(scene) two = unfolded(&s);
    struct moments expected =
        check_render(&two, check_options(DIRECT_MIS, DEPTH, 20261121), SIZE, SIZE, SPP);
    struct moments m =
        check_render(&s, check_options(DIRECT_MIS, DEPTH, 20261122), SIZE, SIZE, SPP);
    for (int side = SIZE; side >= TILE; side /= 4) {
        double z = worst_difference(&m, &expected, side);
        if (z > CHECK_Z_LIMIT)
            fail_msg("a square of %d pixels: z %.2f", side, z);
    }
    moments_free(&m);
    set_wall(&s, 0.95f);
    m = check_render(&s, check_options(DIRECT_MIS, DEPTH, 20261123), SIZE, SIZE, SPP);
    assert_true(worst_difference(&m, &expected, SIZE) > CHECK_Z_LIMIT);
    moments_free(&m);
    moments_free(&expected);
}

/* Only the k-th of the scene's lamps shines; the others are there and black. */
static void only_lamp(struct scene *s, uint32_t k)
{
    uint32_t lamp = 0, n = s->num_materials;
    s->materials = realloc(s->materials, (n + 1) * sizeof *s->materials);
    assert_non_null(s->materials);
    s->materials[n] = (struct material){.name = "out", .kind = MATERIAL_DIFFUSE};
    for (uint32_t i = 0; i < s->num_objects; i++) {
        struct object *o = &s->objects[i];
        if (rgb_is_zero(s->materials[o->material].radiance) || lamp++ == k)
            continue;
        o->material = n;
        for (uint32_t t = o->first_triangle; t < o->first_triangle + o->num_triangles; t++)
            s->tri_material[t] = n;
    }
    s->num_materials++;
    free(s->tri_light);
    free(s->sphere_light);
    free(s->lights);
    s->tri_light = s->sphere_light = NULL;
    s->lights = NULL;
    s->num_lights = 0;
    check_finish(s);
}

/* 45_many_lights: with all lamps one is chosen by place at each vertex, alone a lamp is always sampled.
 * What is seen of the lamps themselves is left out. Control: without one of the weakest lamps, which
 * are 48 in all. */
TEST(many_lamps_are_the_sum_of_single_ones)
{
    enum { SIZE = 16, SPP = 8192, EACH = 256 };
    OWN(scene) all = open_shipped("45_many_lights");
    assert_int_equal(all.num_lights, 48);
    struct integrator_options io = check_options(DIRECT_MIS, 3, 20261145);
    io.first_bounce = 1;
    OWN(moments) whole = check_render(&all, io, SIZE, SIZE, SPP);
    double sum[3] = {0}, var[3] = {0}, weakest[3] = {INFINITY, INFINITY, INFINITY};
    double mean[3] = {0}, mean_var[3] = {0};
    for (size_t p = 0; p < SIZE * SIZE; p++)
        for (int c = 0; c < 3; c++) {
            mean[c] += whole.mean[3 * p + (size_t)c] / (SIZE * SIZE);
            mean_var[c] += moments_var_of_mean(&whole, p, c) / pow(SIZE * SIZE, 2);
        }
    for (uint32_t k = 0; k < all.num_lights; k++) {
        OWN(scene) s = open_shipped("45_many_lights");
        only_lamp(&s, k);
        assert_int_equal(s.num_lights, 1);
        io.sampler.seed = 20261200 + k;
        OWN(moments) m = check_render(&s, io, SIZE, SIZE, EACH);
        double one[3] = {0};
        for (size_t p = 0; p < SIZE * SIZE; p++)
            for (int c = 0; c < 3; c++) {
                one[c] += m.mean[3 * p + (size_t)c] / (SIZE * SIZE);
                var[c] += moments_var_of_mean(&m, p, c) / pow(SIZE * SIZE, 2);
            }
        for (int c = 0; c < 3; c++) {
            sum[c] += one[c];
            weakest[c] = fmin(weakest[c], one[c]);
        }
    }
    for (int c = 0; c < 3; c++) {
        double se = sqrt(var[c] + mean_var[c]);
        if (!(fabs(mean[c] - sum[c]) < CHECK_Z_LIMIT * se))
            fail_msg("channel %d: %.6g, the sum is %.6g, standard error %.2g", c, mean[c], sum[c],
                     se);
        assert_true(fabs(mean[c] - (sum[c] - weakest[c])) > CHECK_Z_LIMIT * se);
    }
}

/* The mesh is what its formula says, and large enough. */
TEST(mesh_is_the_generated_one)
{
    size_t size;
    char *text;
    FILE *f = open_memstream(&text, &size);
    assert_non_null(f);
    suite_write_mesh(f);
    assert_int_equal(fclose(f), 0);
    OWN_TEXT shipped = test_read("reference/scenes/44_mesh.dae");
    assert_string_equal(text, shipped);
    free(text);
    OWN(scene) s = open_shipped("44_mesh");
    assert_true(s.num_triangles >= 28000);
    assert_int_equal(s.num_degenerate, 0);
}

/* The knot's normal, by its definition at right angles to two chords of the skin, points away from the
 * tube's middle: the mean of points around it. */
TEST(knot_normals_point_outside)
{
    for (int i = 0; i < 40; i++) {
        double middle[3] = {0}, p[3], n[3];
        for (int k = 0; k < 36; k++) {
            suite_knot(i / 40.0, k / 36.0, p, n);
            for (int c = 0; c < 3; c++)
                middle[c] += p[c] / 36;
        }
        for (int k = 0; k < 36; k++) {
            double chord[3], q[3], unused[3], out[3];
            suite_knot(i / 40.0, k / 36.0, p, n);
            suite_knot(i / 40.0 + 1e-4, k / 36.0 + 1e-4, q, unused);
            for (int c = 0; c < 3; c++) {
                chord[c] = q[c] - p[c];
                out[c] = p[c] - middle[c];
            }
            assert_true(fabs(dot3(n, n) - 1) < 1e-12);
            assert_true(fabs(dot3(n, chord)) < 0.02 * sqrt(dot3(chord, chord)));
            assert_true(dot3(n, out) > 0.8 * sqrt(dot3(out, out)));
        }
    }
}

static struct image read_sky(const char *path)
{
    struct image im;
    struct err e = {""};
    bool half;
    MUST(image_read(path, &im, &half, &e));
    assert_int_equal(im.width, SKY_WIDTH);
    assert_int_equal(im.height, SKY_HEIGHT);
    assert_int_equal(im.channels, 3);
    assert_false(half);
    return im;
}

/* Both skies are the generated ones; the second is the first moved by SKY_TURN columns; the poles are
 * the same all around and the same above and below, so that it does not matter what an engine does
 * beyond the outermost rows; no texel is bright enough to be one that sampling misses. */
TEST(skies_are_the_generated_ones)
{
    OWN(image) sky = read_sky("reference/scenes/46_sky.exr");
    OWN(image) turned = read_sky("reference/scenes/96_sky_turned.exr");
    OWN(image) made;
    struct err e = {""};
    assert_true(suite_sky(0, &made, &e));
    size_t floats = (size_t)3 * SKY_WIDTH * SKY_HEIGHT;
    assert_memory_equal(sky.data, made.data, floats * sizeof *made.data);
    double total = 0, most = 0;
    for (int y = 0; y < SKY_HEIGHT; y++)
        for (int x = 0; x < SKY_WIDTH; x++)
            for (int c = 0; c < 3; c++) {
                float here = sky.data[3 * (y * SKY_WIDTH + x) + c];
                int moved = (x + SKY_TURN) % SKY_WIDTH;
                assert_true(here == turned.data[3 * (y * SKY_WIDTH + moved) + c]);
                if (y == 0 || y == SKY_HEIGHT - 1)
                    assert_true(fabsf(here - made.data[c]) <= 1.0f / 256);
                double share = here * sin(M_PI * (y + 0.5) / SKY_HEIGHT);
                total += share;
                most = fmax(most, share);
            }
    assert_true(most < 1e-3 * total);
}
