/* Spot lights, fall-offs, environments and the thin lens in the real Cycles against closed forms. Skips
 * without Blender. */
#include "cycles_probe.h"
#include "tests/support/test.h"

/* A wall of albedo (.5, .25, .8) at z = -2, seen from the origin, 60 degrees wide. */
static const double ALBEDO[3] = {.5, .25, .8};

static void build_wall(struct probe *f, float half)
{
    build_quad(&f->s, v3(-half, -half, -2), v3(2 * half, 0, 0), v3(0, 2 * half, 0),
               build_material(&f->s, (rgb){.5f, .25f, .8f}, grey(0)));
    build_camera(&f->s, v3(0, 0, 0), 60);
}

/* At (.7, .4, -.9), value (7, 5, 3), falling off as 1/(.3 + .2 d + .5 d^2); a spot shines along
 * (-2, -1, -2)/3 with cos^2.5 as far as cos > .8. */
static void lamp_radiance(const double d[3], double out[3], const void *data)
{
    static const double value[3] = {7, 5, 3};
    bool spot = *(const bool *)data;
    double w[3] = {2 * d[0] - .7, 2 * d[1] - .4, -2 + .9};
    double r = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    double c = (-2 * w[0] - w[1] - 2 * w[2]) / (3 * r), cone = c > .8 ? pow(c, 2.5) : 0;
    double arriving = -w[2] / r / (.3 + .2 * r + .5 * r * r) * (spot ? cone : 1);
    for (int k = 0; k < 3; k++)
        out[k] = ALBEDO[k] / M_PI * value[k] * arriving;
}

static void check_lamp(struct probe *f, bool spot)
{
    probe_size(f, 24, 16);
    build_wall(f, 5);
    build_light(&f->s, (struct light){.kind = spot ? LIGHT_SPOT : LIGHT_POINT,
                                      .value = {7, 5, 3},
                                      .position = {.7f, .4f, -.9f},
                                      .axis = normalize(v3(-2, -1, -2)),
                                      .cos_cutoff = .8f,
                                      .exponent = 2.5f,
                                      .attenuation = {.3f, .2f, .5f}});
    /* the midpoint rule at the cone's edge */
    probe_check(f, tan(M_PI / 6), 64, lamp_radiance, &spot, 3e-4, false);
}

PROBE(falloff_with_all_three_terms)
{
    check_lamp(f, false);
}
PROBE(spot_with_a_hard_edge)
{
    check_lamp(f, true);
}

/* Looks straight up, with +X to the right and +Z up in the image: the pole in its middle. */
static void zenith_radiance(const double d[3], double out[3], const void *data)
{
    const double w[3] = {d[0], -d[2], d[1]};
    for (int k = 0; k < 3; k++)
        out[k] = (k + 1) * sky_seen(data, w);
}

PROBE(sky_around_the_pole)
{
    struct sky sky = sky_uneven(16, 8);
    probe_size(f, 24, 16);
    for (int i = 0; i < 16; i++) /* beside the pole nothing is constant, nor equal across it */
        sky.value[i] = (float)(1 + i * i % 7);
    build_quad(&f->s, v3(-1, -3, -1), v3(2, 0, 0), v3(0, 0, 2),
               build_material(&f->s, grey(0), grey(0)));
    build_camera(&f->s, v3(0, 0, 0), 60);
    f->s.camera.up = v3(0, 0, 1);
    f->s.camera.backward = v3(0, -1, 0);
    probe_sky(f, &sky);
    /* the midpoint rule at the pole, where radiance is not continuous */
    probe_check(f, tan(M_PI / 6), 32, zenith_radiance, &sky, 3e-4, false);
}

/* The wall in a sky with a hot texel: radiance = albedo / pi x irradiance, by quadrature. */
PROBE(irradiance_of_a_sky)
{
    const struct sky sky = sky_uneven(16, 8);
    probe_size(f, 24, 16);
    build_wall(f, 5);
    probe_sky(f, &sky);
    double want[3], e = sky_irradiance(&sky, (const double[3]){0, 0, 1});
    for (int k = 0; k < 3; k++)
        want[k] = ALBEDO[k] / M_PI * (k + 1) * e;
    probe_check(f, 1, 1, probe_uniform, want, 1e-4, true);
}

/* Ambient light of (1, 2, 4) from above lights the wall with pi/2 of that. Right of x = .5 there is a
 * mirror, which shows none of it, and above y = .4 nothing. */
static void ambient_radiance(const double d[3], double out[3], const void *data)
{
    static const double ambient[3] = {1, 2, 4};
    (void)data;
    for (int k = 0; k < 3; k++)
        out[k] = 2 * d[0] < .5 && 2 * d[1] < .4 ? ALBEDO[k] * ambient[k] / 2 : 0;
}

PROBE(ambient_light_on_rough_surfaces_alone)
{
    struct err e;
    probe_size(f, 24, 16);
    f->suite.depth = 3;
    build_quad(&f->s, v3(-4, -4, -2), v3(4.5f, 0, 0), v3(0, 4.4f, 0),
               build_material(&f->s, (rgb){.5f, .25f, .8f}, grey(0)));
    uint32_t mirror = build_material(&f->s, grey(1), grey(0));
    f->s.materials[mirror].kind = MATERIAL_MIRROR;
    build_quad(&f->s, v3(.5f, -4, -2), v3(4, 0, 0), v3(0, 4.4f, 0), mirror);
    build_camera(&f->s, v3(0, 0, 0), 60);
    f->s.environment = environment_upper_half((rgb){1, 2, 4}, &e);
    build_light(&f->s, (struct light){.kind = LIGHT_ENVIRONMENT});
    /* Enough of them for the controls with any version of Blender. 3e-3: the midpoint rule at the edges, which cut
     * pixels */
    struct moments m;
    probe_finish(f);
    probe_run(f, 512, &m);
    probe_judge(f, &m, probe_expect(f, tan(M_PI / 6), 64, ambient_radiance, NULL), 3e-3, false);
}

/* A lens of radius .3 in focus at 1.5, a wall at 3 that glows with (1, 2, 3) right of x = .2. A ray
 * through (lx, ly) on the lens meets the wall at lx (1 - 3/1.5) + 3 dx, so it is lit if
 * lx < 3 dx - .2: the part of the disk left of that chord. */
static void lens_radiance(const double d[3], double out[3], const void *data)
{
    double h = fmax(-1, fmin(1, (3 * d[0] - .2) / .3));
    (void)data;
    for (int k = 0; k < 3; k++)
        out[k] = (k + 1) * (.5 + (asin(h) + h * sqrt(1 - h * h)) / M_PI);
}

PROBE(lens_on_an_edge)
{
    struct moments m;
    probe_size(f, 24, 16);
    build_quad(&f->s, v3(.2f, -9, -3), v3(9, 0, 0), v3(0, 18, 0),
               build_material(&f->s, grey(0), (rgb){1, 2, 3}));
    build_camera(&f->s, v3(0, 0, 0), 30);
    probe_finish(f);
    f->c.lens_radius = .3f;
    f->c.focal_distance = 1.5f;
    probe_run(f, 1024, &m);
    /* float32 and the midpoint rule */
    probe_judge(f, &m, probe_expect(f, tan(M_PI / 12), 16, lens_radiance, NULL), 1e-4, false);
}
