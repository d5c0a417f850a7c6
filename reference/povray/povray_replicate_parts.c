#include "povray_replicate_parts.h"

#include "renderer/math/sampler.h"

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

/* Shifts the window by (u, v) - 1/2 sub-pixels. */
static void set_shift(struct povray_image *p, int width, int height, double u, double v)
{
    p->variant.shift_x = (u - 0.5) / (p->grid * width);
    p->variant.shift_y = (v - 0.5) / (p->grid * height);
}

static double scale_within_octave(const struct povray_passes *plan, double u)
{
    return POVRAY_TOP_VALUE / plan->radiance * exp2(u);
}

/* The first choice of cells per side with which all lamps together have at most `most` spotlights. */
static int cells(const struct povray_passes *plan, const int *choice, int most)
{
    while (choice[1] != 0 && plan->num_lamps * *choice * *choice > most)
        choice++;
    return *choice;
}

struct povray_image povray_window(const struct povray_passes *plan, int width, int height, int j,
                                  int pass)
{
    assert(j >= 0 && j < POVRAY_WINDOWS);
    static_assert(POVRAY_WINDOWS == 32, "reverse5() is for 32");
    struct povray_image p = {
        .grid = POVRAY_WINDOW_GRID, .block = 32, .variant = povray_variant_plain()};
    snprintf(p.name, sizeof p.name, "fine_%02d_%d", j, pass);
    p.variant.pass = pass;
    p.variant.lamp_cells = cells(plan, (const int[]){POVRAY_WINDOW_CELLS, 8, 4, 2, 0}, 320);
    p.variant.rule = p.variant.lamp_cells == POVRAY_WINDOW_CELLS ? POVRAY_GAUSS : POVRAY_SHIFT;
    /* Three permutations of the same 32 positions: multiplying by an odd number permutes residues mod 32. */
    p.variant.lamp_shift[0] = (13 * j % 32 + 0.5) / POVRAY_WINDOWS;
    p.variant.lamp_shift[1] = (reverse5(13 * j % 32) + 0.5) / POVRAY_WINDOWS;
    p.variant.lamp_shift[2] = (11 * j % 32 + 0.5) / POVRAY_WINDOWS;
    p.variant.indirect = plan->constant;
    p.variant.roulette = 0;
    p.variant.scale = scale_within_octave(plan, (j + 0.5) / POVRAY_WINDOWS);
    set_shift(&p, width, height, (j + 0.5) / POVRAY_WINDOWS, (reverse5(j) + 0.5) / POVRAY_WINDOWS);
    return p;
}

struct povray_image povray_replicate(const struct povray_passes *plan, int width, int height,
                                     int grid, int i, uint32_t seed, int pass, bool indirect)
{
    assert(grid > 0 && i >= 0);
    struct sample4 a = sampler_get(seed, 0, 0, 0, PURPOSE_CAMERA);
    struct sample4 b = sampler_get(seed, 0, 1, 0, PURPOSE_CAMERA);
    struct povray_image p = {
        .grid = grid,
        .block = 4 + (int)(17 * (long)i % 61), /* all of 4 .. 64 in turn */
        .variant = {.pass = pass,
                    .lamp_cells = cells(plan, (const int[]){POVRAY_JITTER_CELLS, 2, 1, 0}, 40),
                    .rule = POVRAY_JITTER,
                    .lamp_seed = seed,
                    .indirect = indirect,
                    .indirect_levels = true,
                    .roulette = POVRAY_ROULETTE,
                    .scale = scale_within_octave(plan, (double)a.u[3])}};
    snprintf(p.name, sizeof p.name, "%s_%03d_%d", indirect ? "indirect" : "direct", i, pass);
    random_rotation(a.u, p.variant.rotation);
    set_shift(&p, width, height, (double)b.u[0], (double)b.u[1]);
    return p;
}
