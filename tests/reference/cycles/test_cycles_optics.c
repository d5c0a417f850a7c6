/* Specular materials in the real Cycles against closed forms: mirror, refraction and glass, flat,
 * round, with tilted normals, glowing, and cut off at a depth. Skips without Blender. */
#include "cycles_probe.h"
#include "tests/support/optics.h"
#include "tests/support/test.h"
#include "tests/support/vectors.h"

static const double REFLECTANCE[3] = {.9, .8, .7}, TRANSMITTANCE[3] = {.95, .9, .6};

static uint32_t specular(struct scene *s, enum material_kind kind, double ior, bool schlick)
{
    uint32_t i = build_material(s, (rgb){.9f, .8f, .7f}, grey(0));
    s->materials[i].kind = kind;
    s->materials[i].transmittance = (rgb){.95f, .9f, .6f};
    s->materials[i].ior = (float)ior;
    s->materials[i].schlick = schlick;
    return i;
}

static void unit(const double d[3], double out[3])
{
    double l = sqrt(dot3(d, d));
    for (int k = 0; k < 3; k++)
        out[k] = d[k] / l;
}

/* a + t b */
static void along(const double a[3], double t, const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = a[k] + t * b[k];
}

/* w mirrored about the plane with the unit normal n. */
static void mirrored(const double w[3], const double n[3], double out[3])
{
    along(w, -2 * dot3(w, n), n, out);
}

/* Nearest distance > 0 at which o + t w (unit) meets the sphere of radius r around c; inside: the far
 * one. */
static bool meet_sphere(const double o[3], const double w[3], const double c[3], double r,
                        bool inside, double *t)
{
    double oc[3];
    along(o, -1, c, oc);
    double b = dot3(oc, w), q = b * b - dot3(oc, oc) + r * r;
    if (q < 0)
        return false;
    *t = inside ? -b + sqrt(q) : -b - sqrt(q);
    return *t > 0;
}

static const double BALL[3] = {.25, -.125, -3}, BALL_RADIUS = .875, ORIGIN[3] = {0, 0, 0};

static void mirror_ball_radiance(const double d[3], double out[3], const void *data)
{
    double w[3], p[3], n[3], t;
    unit(d, w);
    bool hit = meet_sphere(ORIGIN, w, BALL, BALL_RADIUS, false, &t);
    if (hit) {
        along(ORIGIN, t, w, p);
        along(p, -1, BALL, n);
        unit(n, n);
        mirrored(w, n, w);
    }
    double l = sky_seen(data, w);
    for (int c = 0; c < 3; c++)
        out[c] = l * (c + 1) * (hit ? REFLECTANCE[c] : 1);
}

PROBE(mirror_ball_in_a_sky)
{
    const struct sky sky = sky_uneven(16, 8);
    probe_size(f, 48, 32);
    build_sphere(&f->s, v3((float)BALL[0], (float)BALL[1], (float)BALL[2]), (float)BALL_RADIUS, 1,
                 specular(&f->s, MATERIAL_MIRROR, 0, false));
    probe_sky(f, &sky);
    build_camera(&f->s, v3(0, 0, 0), 60);
    /* the midpoint rule at the ball's edge */
    probe_check(f, tan(M_PI / 6), 32, mirror_ball_radiance, &sky, 3e-4, false);
}

/* Inside a mirror that glows: at depth 3, emission (1 + a + a^2 + a^3). */
static void glowing_mirror_radiance(const double d[3], double out[3], const void *data)
{
    static const double albedo[3] = {.5, .8, .2};
    int depth = *(const int *)data;
    (void)d;
    for (int c = 0; c < 3; c++)
        out[c] = (c + 1) * (1 - pow(albedo[c], depth + 1)) / (1 - albedo[c]);
}

PROBE(mirrors_count_as_bounces)
{
    struct moments m;
    probe_size(f, 24, 16);
    f->suite.depth = 3;
    uint32_t glow = build_material(&f->s, (rgb){.5f, .8f, .2f}, (rgb){1, 2, 3});
    f->s.materials[glow].kind = MATERIAL_MIRROR;
    build_sphere(&f->s, v3(.1f, .2f, .3f), 1.5f, -1, glow);
    build_camera(&f->s, v3(0, 0, 0), 60);
    probe_render(f, &m);
    double *deeper = probe_expect(f, tan(M_PI / 6), 1, glowing_mirror_radiance, &(int){4});
    assert_false(probe_agrees(&m, deeper, 3e-4));
    free(deeper);
    /* the icosphere's edges */
    probe_judge(f, &m, probe_expect(f, tan(M_PI / 6), 1, glowing_mirror_radiance, &f->suite.depth),
                3e-4, true);
}

struct boundary {
    double ior; /* of the far side, relative to the eye's */
    bool schlick;
    bool glass;
    double glow[3]; /* of the boundary itself */
    const struct sky *sky;
};

static const double IN_FRONT[3] = {3, 2, 1}, BEHIND[3] = {1, 2, 3};

/* Reflectance (Fresnel's or Schlick's) at the cosine c; n: index behind the boundary over that in front. */
static double reflected(const struct boundary *b, double c, double n)
{
    double r = optics_fresnel(c, n), r0 = (1 - n) / (1 + n) * (1 - n) / (1 + n);
    return b->schlick && r < 1 - 1e-12 ? r0 + (1 - r0) * pow(1 - c, 5) : r;
}

/* A plane slab of glass. Depth 4 holds what is reflected outside (1 event), or inside once (3), and
 * what comes through at once (2) or after two inner reflections (4). */
static void slab_radiance(const double d[3], double out[3], const void *data)
{
    const struct boundary *b = data;
    double w[3];
    unit(d, w);
    double c = -w[2], ci = sqrt(1 - (1 - c * c) / (b->ior * b->ior));
    double ro = reflected(b, c, b->ior), ri = reflected(b, ci, 1 / b->ior);
    for (int k = 0; k < 3; k++) {
        double rho = REFLECTANCE[k],
               through = TRANSMITTANCE[k] * TRANSMITTANCE[k] * (1 - ro) * (1 - ri);
        out[k] = IN_FRONT[k] * (rho * ro + through * rho * ri) +
                 BEHIND[k] * through * (1 + rho * ri * rho * ri);
    }
}

/* Glowing walls of +-40 behind the eye and behind everything. */
static void build_walls(struct probe *f)
{
    build_quad(&f->s, v3(-40, -40, 3), v3(0, 80, 0), v3(80, 0, 0),
               build_material(&f->s, grey(0), (rgb){3, 2, 1}));
    build_quad(&f->s, v3(-40, -40, -6), v3(80, 0, 0), v3(0, 80, 0),
               build_material(&f->s, grey(0), (rgb){1, 2, 3}));
    build_camera(&f->s, v3(0, 0, 0), 120);
}

static void check_slab(struct probe *f, bool schlick)
{
    struct moments m;
    probe_size(f, 48, 32);
    f->suite.depth = 4;
    uint32_t glass = specular(&f->s, MATERIAL_GLASS, 1.5, schlick);
    build_quad(&f->s, v3(-40, -40, -2), v3(80, 0, 0), v3(0, 80, 0), glass);
    build_quad(&f->s, v3(-40, -40, -2.5f), v3(0, 80, 0), v3(80, 0, 0), glass);
    build_walls(f);
    probe_render(f, &m);
    const struct boundary is = {.ior = 1.5, .schlick = schlick, .glass = true},
                          is_not = {.ior = 1.5, .schlick = !schlick, .glass = true};
    double *other = probe_expect(f, tan(M_PI / 3), 8, slab_radiance, &is_not);
    assert_false(probe_agrees(&m, other, 1e-4));
    free(other);
    /* float32 and the midpoint rule */
    probe_judge(f, &m, probe_expect(f, tan(M_PI / 3), 8, slab_radiance, &is), 1e-4, true);
}

PROBE(slab_of_glass)
{
    check_slab(f, false);
}
PROBE(slab_by_schlick)
{
    check_slab(f, true);
}

/* One plane boundary in a sky, which is seen through it and mirrored by it: radiance from behind is
 * divided by the square of the relative index. */
static void boundary_radiance(const double d[3], double out[3], const void *data)
{
    const struct boundary *b = data;
    const double n[3] = {0, 0, 1};
    double w[3], m[3], in[3];
    unit(d, w);
    double c = -w[2], r = reflected(b, c, b->ior), sine2 = (1 - c * c) / (b->ior * b->ior);
    mirrored(w, n, m);
    for (int k = 0; k < 3; k++)
        in[k] = w[k] / b->ior + (c / b->ior - sqrt(fmax(0, 1 - sine2))) * n[k];
    double through = sine2 < 1 ? (b->glass ? 1 - r : 1) / (b->ior * b->ior) : 0;
    double sky_in = sky_seen(b->sky, in), sky_m = b->glass ? r * sky_seen(b->sky, m) : 0;
    for (int k = 0; k < 3; k++)
        out[k] =
            b->glow[k] + (k + 1) * (TRANSMITTANCE[k] * through * sky_in + REFLECTANCE[k] * sky_m);
}

/* front: the eye is where the normal points. The index is of the far side. */
static void check_boundary(struct probe *f, struct boundary b, bool front)
{
    const struct sky sky = sky_uneven(16, 8);
    probe_size(f, 48, 32);
    b.sky = &sky;
    uint32_t glass = specular(&f->s, b.glass ? MATERIAL_GLASS : MATERIAL_REFRACTION,
                              front ? b.ior : 1 / b.ior, b.schlick);
    f->s.materials[glass].radiance = (rgb){(float)b.glow[0], (float)b.glow[1], (float)b.glow[2]};
    vec3 x = v3(80, 0, 0), y = v3(0, 80, 0);
    build_quad(&f->s, v3(-40, -40, -2), front ? x : y, front ? y : x, glass);
    probe_sky(f, &sky);
    build_camera(&f->s, v3(0, 0, 0), 120);
    /* the midpoint rule where total reflection begins */
    probe_check(f, tan(M_PI / 3), 32, boundary_radiance, &b, 4e-4, false);
}

PROBE(eye_before_glowing_glass)
{
    check_boundary(f, (struct boundary){.ior = 1.5, .glass = true, .glow = {.5, .25, 1}}, true);
}
PROBE(eye_in_glass)
{
    check_boundary(f, (struct boundary){.ior = 1 / 1.5, .glass = true}, false);
}
PROBE(eye_in_glass_by_schlick)
{
    check_boundary(f, (struct boundary){.ior = 1 / 1.5, .glass = true, .schlick = true}, false);
}
PROBE(refraction_alone)
{
    check_boundary(f, (struct boundary){.ior = 1.5}, true);
}
PROBE(refraction_alone_from_behind)
{
    check_boundary(f, (struct boundary){.ior = 1 / 1.5}, false);
}

enum { BALL_DEPTH = 5 };

/* A ball of glass: reflected at once, or in, up to BALL_DEPTH - 2 inner reflections, out. The
 * directions follow from Snell's law in vectors. */
static void glass_ball_radiance(const double d[3], double out[3], const void *data)
{
    static const double ior = 1.5;
    double w[3], p[3], n[3], t;
    unit(d, w);
    if (!meet_sphere(ORIGIN, w, BALL, BALL_RADIUS, false, &t)) {
        for (int k = 0; k < 3; k++)
            out[k] = sky_seen(data, w) * (k + 1);
        return;
    }
    along(ORIGIN, t, w, p);
    along(p, -1, BALL, n);
    unit(n, n);
    double c = -dot3(w, n), ci = sqrt(1 - (1 - c * c) / (ior * ior)), r = optics_fresnel(c, ior);
    double m[3], in[3];
    mirrored(w, n, m);
    double sky = sky_seen(data, m), factor[3];
    for (int k = 0; k < 3; k++) {
        out[k] = REFLECTANCE[k] * r * sky * (k + 1);
        factor[k] = TRANSMITTANCE[k] * TRANSMITTANCE[k] * (1 - r) * (1 - r);
        in[k] = w[k] / ior + (c / ior - ci) * n[k];
    }
    for (int j = 0; j + 2 <= BALL_DEPTH; j++) {
        double leaving[3];
        meet_sphere(p, in, BALL, BALL_RADIUS, true, &t);
        along(p, t, in, p);
        along(p, -1, BALL, n);
        unit(n, n);
        for (int k = 0; k < 3; k++)
            leaving[k] = in[k] * ior + (c - ior * ci) * n[k];
        sky = sky_seen(data, leaving);
        for (int k = 0; k < 3; k++) {
            out[k] += factor[k] * sky * (k + 1);
            factor[k] *= REFLECTANCE[k] * r;
        }
        mirrored(in, n, in);
    }
}

PROBE(glass_ball_in_a_sky)
{
    const struct sky sky = sky_uneven(16, 8);
    probe_size(f, 48, 32);
    f->suite.depth = BALL_DEPTH;
    build_sphere(&f->s, v3((float)BALL[0], (float)BALL[1], (float)BALL[2]), (float)BALL_RADIUS, 1,
                 specular(&f->s, MATERIAL_GLASS, 1.5, false));
    probe_sky(f, &sky);
    build_camera(&f->s, v3(0, 0, 0), 60);
    /* the facets of the ball */
    probe_check(f, tan(M_PI / 6), 32, glass_ball_radiance, &sky, 1e-3, false);
}

/* A mirror whose shading normals are all (1, 2, 2)/3 or, where they look away from the eye, give way
 * to the true one, (0, 0, 1). Black where the mirrored ray goes through the surface. */
static void tilted_mirror_radiance(const double d[3], double out[3], const void *data)
{
    const double true_normal[3] = {0, 0, 1}, tilted[3] = {1 / 3., 2 / 3., 2 / 3.};
    double w[3];
    unit(d, w);
    mirrored(w, dot3(w, tilted) < 0 ? tilted : true_normal, w);
    double l = w[2] > 0 ? sky_seen(data, w) : 0;
    for (int k = 0; k < 3; k++)
        out[k] = REFLECTANCE[k] * l * (k + 1);
}

PROBE(mirror_with_tilted_normals)
{
    const struct sky sky = sky_uneven(16, 8);
    probe_size(f, 48, 32);
    build_quad(&f->s, v3(-40, -40, -2), v3(80, 0, 0), v3(0, 80, 0),
               specular(&f->s, MATERIAL_MIRROR, 0, false));
    for (int i = 0; i < 6; i++)
        f->s.normal[i] = normalize(v3(1, 2, 2));
    probe_sky(f, &sky);
    build_camera(&f->s, v3(0, 0, 0), 120);
    /* Cycles moves reflections nearer than 0.01 to the true surface up to there: the line along which
     * they graze it crosses the whole image. */
    probe_check(f, tan(M_PI / 3), 32, tilted_mirror_radiance, &sky, 3e-3, false);
}
