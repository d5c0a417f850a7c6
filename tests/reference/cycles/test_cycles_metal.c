/* Microfacets in the real Cycles, by its own closure and by random facets, against integrals of the
 * textbook formulas. Skips without Blender. */
#include "cycles_probe.h"
#include "tests/support/optics.h"
#include "tests/support/test.h"

#include <complex.h>

/* Index and absorption of something like gold, red to blue. */
static const double ETA[3] = {.2, .4, 1.4}, K[3] = {3.3, 2.4, 1.8}, REFLECTANCE[3] = {.9, .6, .3};

struct metal {
    bool ggx, separable, conductor;
    double alpha;
    double diffuse,
        mirror; /* both 0: metal; else plastic, and the rest of REFLECTANCE is the highlight's */
};

static bool is_plastic(const struct metal *a)
{
    return a->diffuse + a->mirror > 0;
}

static struct optics_metal channel_of(const struct metal *a, int k)
{
    struct optics_metal o = {.ggx = a->ggx, .separable = a->separable, .alpha = a->alpha};
    if (a->conductor)
        o.n = ETA[k] + K[k] * _Complex_I;
    return o;
}

static uint32_t build_metal(struct scene *s, const struct metal *a)
{
    uint32_t i = build_material(s, (rgb){.9f, .6f, .3f}, grey(0));
    struct material *m = &s->materials[i];
    m->kind = MATERIAL_MICROFACET;
    m->microfacet = a->ggx ? MICROFACET_GGX : MICROFACET_BECKMANN;
    m->separable = a->separable;
    m->conductor = a->conductor;
    m->alpha = (float)a->alpha;
    m->eta = (rgb){.2f, .4f, 1.4f};
    m->k = (rgb){3.3f, 2.4f, 1.8f};
    if (is_plastic(a)) {
        m->kind = MATERIAL_PLASTIC;
        m->specular = rgb_scale(m->reflectance, (float)(1 - a->diffuse - a->mirror));
        m->mirror = rgb_scale(m->reflectance, (float)a->mirror);
        m->reflectance = rgb_scale(m->reflectance, (float)a->diffuse);
    }
    return i;
}

/* A ball in white surroundings shows its directional albedo at the angle it is seen under, here tabulated
 * over the cosine. */
enum { TABLE = 96 };
#define BALL_Z      (-3)
#define BALL_RADIUS 1.25
struct albedo {
    double at[3][TABLE + 1]; /* of cos = (i / TABLE)^2 */
};

static struct albedo tabulate(const struct metal *a)
{
    struct albedo t = {0};
    for (int k = 0; k < 3; k++) {
        struct optics_metal o = channel_of(a, k);
        for (int i = 0; i <= TABLE; i++) {
            double c = fmax((double)i / TABLE, .25 / TABLE);
            t.at[k][i] = k > 0 && !a->conductor
                             ? t.at[0][i] / REFLECTANCE[0] * REFLECTANCE[k]
                             : optics_metal_albedo(&o, c * c) * (a->conductor ? 1 : REFLECTANCE[k]);
        }
    }
    /* What is not the highlight's is reflected evenly, or as an image of white. */
    const double other = a->diffuse + a->mirror;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i <= TABLE && is_plastic(a); i++)
            t.at[k][i] = (1 - other) * t.at[k][i] + other * REFLECTANCE[k];
    return t;
}

static void ball_radiance(const double d[3], double out[3], const void *data)
{
    const struct albedo *t = data;
    double l = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), b = BALL_Z * d[2] / l;
    double q = b * b - BALL_Z * BALL_Z + BALL_RADIUS * BALL_RADIUS;
    double x = q > 0 ? sqrt(sqrt(q) / BALL_RADIUS) * TABLE : 0;
    int i = x < TABLE ? (int)x : TABLE - 1;
    for (int k = 0; k < 3; k++)
        out[k] = q > 0 ? t->at[k][i] + (x - i) * (t->at[k][i + 1] - t->at[k][i]) : 1;
}

/* The ball in a white sky has the albedo of `is`; negative control: `is_not`, which differs in one property. */
static void check_ball(struct probe *f, struct metal is, struct metal is_not, double allowed)
{
    struct moments m;
    struct err e;
    probe_size(f, 24, 16);
    build_sphere(&f->s, v3(0, 0, BALL_Z), (float)BALL_RADIUS, 1, build_metal(&f->s, &is));
    f->s.environment = environment_constant(grey(1), &e);
    build_light(&f->s, (struct light){.kind = LIGHT_ENVIRONMENT});
    build_camera(&f->s, v3(0, 0, 0), 60);
    probe_finish(f);
    probe_run(f, 1024, &m);
    struct albedo a = tabulate(&is), b = tabulate(&is_not);
    double *other = probe_expect(f, tan(M_PI / 6), 32, ball_radiance, &b);
    assert_false(probe_agrees(&m, other, allowed));
    free(other);
    probe_judge(f, &m, probe_expect(f, tan(M_PI / 6), 32, ball_radiance, &a), allowed, true);
}

PROBE(closure_in_white)
{
    check_ball(f, (struct metal){true, true, false, .5, 0, 0},
               (struct metal){true, false, false, .5, 0, 0}, 3e-4);
}
PROBE(ggx_facets_in_white)
{
    check_ball(f, (struct metal){true, false, true, .5, 0, 0},
               (struct metal){true, true, true, .5, 0, 0}, 3e-4);
}
PROBE(beckmann_facets_in_white)
{
    check_ball(f, (struct metal){false, false, true, .4, 0, 0},
               (struct metal){true, false, true, .4, 0, 0}, 3e-4);
}
PROBE(plastic_in_white)
{
    check_ball(f, (struct metal){false, true, false, .6, .4, .1},
               (struct metal){false, false, false, .6, .3, .1}, 3e-4);
}
PROBE(rough_beckmann_facets_in_white)
{
    check_ball(f, (struct metal){false, true, false, 1.1, 0, 0},
               (struct metal){false, true, false, 1.2, 0, 0}, 3e-4);
}

/* A plane under the eye's direction at 50 degrees, in a sky: the whole lobe, weighted. Its local frame
 * in the world: x, y, normal. */
static const double AXIS[3][3] = {
    {.642787609686539, 0, -.766044443118978}, {0, 1, 0}, {.766044443118978, 0, .642787609686539}};

struct lobe {
    struct optics_metal metal;
    const double *wo;
    const struct sky *sky;
};

static double reflected_sky(const double wi[3], void *data)
{
    const struct lobe *l = data;
    double w[3];
    for (int k = 0; k < 3; k++)
        w[k] = wi[0] * AXIS[0][k] + wi[1] * AXIS[1][k] + wi[2] * AXIS[2][k];
    return optics_metal_f_cos(&l->metal, l->wo, wi) * sky_seen(l->sky, w);
}

static void check_lobe(struct probe *f, struct metal is)
{
    struct moments m;
    struct sky sky = sky_uneven(8, 4);
    double want[3];
    probe_size(f, 24, 16);
    sky.value[1 * 8 + 4] = 2; /* no single bright texel */
    vec3 x = v3((float)AXIS[0][0], 0, (float)AXIS[0][2]), y = v3(0, 1, 0);
    build_quad(&f->s, sub(v3(0, 0, -3), add(x, y)), scale(x, 2), scale(y, 2),
               build_metal(&f->s, &is));
    probe_sky(f, &sky);
    build_camera(&f->s, v3(0, 0, 0), .5f);
    probe_finish(f);
    probe_run(f, 1024, &m);
    /* wo = +Z of the world */
    struct optics_view v = optics_view(AXIS[2][2], M_PI, is.alpha);
    for (int k = 0; k < 3; k++) {
        struct lobe l = {channel_of(&is, k), v.wo, &sky};
        want[k] = (k + 1) * (is.conductor ? 1 : REFLECTANCE[k]) *
                  optics_integrate_directions(&v, &(struct optics_patch){0, 1, 0, 2 * M_PI},
                                              reflected_sky, &l);
    }
    /* the quadrature, where the sky has kinks, and a quarter of a degree to each side */
    probe_judge(f, &m, probe_expect(f, 1, 1, probe_uniform, want), 5e-4, true);
}

PROBE(closure_in_a_sky)
{
    check_lobe(f, (struct metal){true, true, false, .3, 0, 0});
}
PROBE(ggx_facets_in_a_sky)
{
    check_lobe(f, (struct metal){true, false, true, .3, 0, 0});
}
PROBE(beckmann_facets_in_a_sky)
{
    check_lobe(f, (struct metal){false, true, true, .3, 0, 0});
}
