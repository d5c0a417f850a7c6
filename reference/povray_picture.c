#include "povray_picture.h"

#include "../renderer/sampler.h"

#include <assert.h>
#include <gsl/gsl_math.h>
#include <string.h>

/* Uniformly random rotation from three uniform numbers, by way of a unit quaternion [Shoemake92]. */
static void random_rotation(const float u[3], double r[3][3])
{
    double a = sqrt(1 - (double)u[0]), b = sqrt((double)u[0]);
    double x = a * sin(2 * M_PI * (double)u[1]), y = a * cos(2 * M_PI * (double)u[1]);
    double z = b * sin(2 * M_PI * (double)u[2]), w = b * cos(2 * M_PI * (double)u[2]);
    const double m[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                            {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                            {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
    memcpy(r, m, sizeof m);
}

/* Bits of i < 32 in reverse. */
static int reverse5(int i)
{
    return (i & 1) << 4 | (i & 2) << 2 | (i & 4) | (i & 8) >> 2 | (i & 16) >> 4;
}

/* By (u, v) - 1/2 sub-pixels. */
static void set_shift(struct povray_picture *p, int width, int height, double u, double v)
{
    p->variant.shift_x = (u - 0.5) / (p->grid * width);
    p->variant.shift_y = (v - 0.5) / (p->grid * height);
}

static double scale_within_octave(const struct povray_plan *plan, double u)
{
    return POVRAY_TOP_VALUE / plan->radiance * exp2(u);
}

struct povray_picture povray_window(const struct povray_plan *plan, int width, int height, int j)
{
    assert(j >= 0 && j < POVRAY_WINDOWS);
    static_assert(POVRAY_WINDOWS == 32, "reverse5() is for 32");
    struct povray_picture p = {
        .grid = POVRAY_WINDOW_GRID, .block = 32, .variant = povray_variant_plain()};
    snprintf(p.name, sizeof p.name, "fine_%02d", j);
    p.variant.lamp_cells = POVRAY_WINDOW_CELLS;
    p.variant.indirect = plan->constant;
    p.variant.roulette = 0;
    p.variant.scale = scale_within_octave(plan, (j + 0.5) / POVRAY_WINDOWS);
    set_shift(&p, width, height, (j + 0.5) / POVRAY_WINDOWS, (reverse5(j) + 0.5) / POVRAY_WINDOWS);
    return p;
}

struct povray_picture povray_replicate(const struct povray_plan *plan, int width, int height,
                                       int grid, int i, uint32_t seed, bool indirect)
{
    assert(grid > 0 && i >= 0);
    struct sample4 a = sampler_get(seed, 0, 0, 0, PURPOSE_CAMERA);
    struct sample4 b = sampler_get(seed, 0, 1, 0, PURPOSE_CAMERA);
    struct povray_picture p = {.grid = grid,
                               .block = 4 + (int)(17 * (long)i % 61), /* all of 4 .. 64 in turn */
                               .variant = {.lamp_cells = POVRAY_JITTER_CELLS,
                                           .lamp_jitter = true,
                                           .lamp_seed = seed,
                                           .indirect = indirect,
                                           .roulette = POVRAY_ROULETTE,
                                           .scale = scale_within_octave(plan, (double)a.u[3])}};
    snprintf(p.name, sizeof p.name, "%s_%03d", indirect ? "indirect" : "direct", i);
    random_rotation(a.u, p.variant.rotation);
    set_shift(&p, width, height, (double)b.u[0], (double)b.u[1]);
    return p;
}
