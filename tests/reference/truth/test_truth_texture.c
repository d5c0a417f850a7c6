/* The closed form of 29_textures by another route: the mean over many points of a pixel of the texture as it is
 * defined, repeated without end. */
#include "reference/truth/truth.h"
#include "tests/support/quadrature.h"
#include "tests/support/suite_files.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

/* By the trapezoid rule on the kernel itself. */
TEST(shares_are_integrals_of_the_kernel)
{
    enum { STEPS = 40000 };
    for (int nearest = 0; nearest < 2; nearest++) {
        double sum = 0;
        for (int i = 0; i <= STEPS; i++) {
            double t = -2 + 4.0 * i / STEPS, d = fabs(t);
            sum += (nearest ? d < 0.5 : fmax(0, 1 - d)) * 4 / STEPS;
            if (i % 4000 == 0)
                assert_near(truth_texel_share(t, nearest), sum, 2e-4);
        }
    }
    /* A box is no hat. */
    assert_true(fabs(truth_texel_share(0.5, true) - truth_texel_share(0.5, false)) > 0.1);
}

static double linear(int byte)
{
    double c = byte / 255.;
    return c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}

/* Texel number i of a row of n, by walking: a step beyond an edge jumps back, turns round, stays or falls off. */
static int walk(int i, int n, char wrap)
{
    for (; i < 0 || i >= n;) {
        if (wrap == 'W')
            i += i < 0 ? n : -n;
        else if (wrap == 'M')
            i = i < 0 ? -1 - i : 2 * n - 1 - i;
        else if (wrap == 'C')
            i = i < 0 ? 0 : n - 1;
        else
            return -1;
    }
    return i;
}

enum { W = 5, H = 4 };
static int picture[H][3 * W];

static void read_picture(const struct suite_scene *s)
{
    for (int r = 0; r < s->num_references; r++) {
        const json_t *rows = json_object_get(s->reference[r].values, "rows");
        for (size_t j = 0; j < json_array_size(rows); j++)
            for (size_t k = 0; k < (size_t)3 * W; k++)
                picture[j][k] = (int)json_integer_value(json_array_get(json_array_get(rows, j), k));
    }
}

static double texel(int i, int up, const char wrap[2], int channel)
{
    int col = walk(i, W, wrap[0]), row = walk(up, H, wrap[1]);
    return col < 0 || row < 0 ? 0 : linear(picture[H - 1 - row][3 * col + channel]);
}

static double at_place(double u, double v, const char wrap[2], bool nearest, int channel)
{
    double x = u * W, y = v * H;
    if (nearest)
        return texel((int)floor(x), (int)floor(y), wrap, channel);
    int i = (int)floor(x - 0.5), j = (int)floor(y - 0.5);
    double a = x - 0.5 - i, b = y - 0.5 - j;
    return (1 - b) * ((1 - a) * texel(i, j, wrap, channel) + a * texel(i + 1, j, wrap, channel)) +
           b * ((1 - a) * texel(i, j + 1, wrap, channel) + a * texel(i + 1, j + 1, wrap, channel));
}

/* All pixels of each board, by 40 x 40 places: edges between texels lie on quarters of pixels, so the nearest are exact, too. By
 * the scene's page: places, coordinates, wraps and filters of board (r, c). */
TEST(pixels_are_means_of_the_texture)
{
    enum { CELLS = 40 };
    static const char wraps[4] = {'W', 'M', 'C', 'B'};
    OWN(moments) m;
    double off = 0;
    read_picture(suite_shipped_scene("29_textures"));
    render_truth("29_textures", 64, 64, &m);
    for (int p = 0; p < 64 * 64; p++) {
        int x = p % 64, y = p / 64, r = y / 16, c = x / 16;
        double sum[3] = {0}, other = 0;
        const char wrap[2] = {wraps[r], wraps[(r + c) % 4]}, turned[2] = {wrap[1], wrap[0]};
        bool covered = x % 16 != 0 && x % 16 != 15 && y % 16 != 0 && y % 16 != 15;
        for (int k = 0; covered && k < CELLS * CELLS; k++) {
            double s = (x % 16 - 1 + (k % CELLS + 0.5) / CELLS) / 14;
            double t = (y % 16 - 1 + (k / CELLS + 0.5) / CELLS) / 14;
            double u = (r + c) % 3 != 0 ? -0.6 + 2.24 * s : 1.64 - 2.24 * s, v = 1.25 - 2 * t;
            for (int ch = 0; ch < 3; ch++)
                sum[ch] += at_place(u, v, wrap, c % 2 == 0, ch) / (CELLS * CELLS);
            other += at_place(u, v, turned, c % 2 == 0, 0) / (CELLS * CELLS);
        }
        for (int ch = 0; ch < 3; ch++)
            assert_near(mean_at(&m, x, y, ch), sum[ch] * (c < 2 ? 1 : 0.5), 1e-3);
        off = fmax(off, fabs(other - sum[0]));
    }
    assert_true(off > 0.2); /* u's wrap for v's is seen */
}

/* What the .json may not say. */
TEST(bad_values_are_refused)
{
#define BOARD(place, uv, wrap, factor)                                                             \
    "{'width': 1, 'rows': [[1, 2, 3]], 'boards': [{'place': " place ", 'uv': " uv                  \
    ", 'wrap': " wrap ", 'nearest': true, 'factor': " factor "}]}"
    static const char *const good = BOARD("[0,0,1,1]", "[0,0,1,1]", "['WRAP','CLAMP']", "[1,1,1]");
    static const struct {
        const char *values, *says;
    } cases[] = {
        {BOARD("[0,0,1,2]", "[0,0,1,1]", "['WRAP','CLAMP']", "[1,1,1]"),
         "place or uv out of range"},
        {BOARD("[0,0,0,1]", "[0,0,1,1]", "['WRAP','CLAMP']", "[1,1,1]"), "without an extent"},
        {BOARD("[0,0,1,1]", "[0,1,1,1]", "['WRAP','CLAMP']", "[1,1,1]"), "without an extent"},
        {BOARD("[0,0,1,1]", "[0,0,9,1]", "['WRAP','CLAMP']", "[1,1,1]"),
         "place or uv out of range"},
        {BOARD("[0,0,1,1]", "[0,0,1,1]", "['WRAP','REPEAT']", "[1,1,1]"), "unknown wrap 'REPEAT'"},
        {BOARD("[0,0,1,1]", "[0,0,1,1]", "['WRAP','CLAMP']", "[1,-1,1]"), "factor[1]"},
        {"{'width': 2, 'rows': [[1, 2, 3]], 'boards': []}", "rows[0] has 3 numbers, not 6"},
        {"{'width': 1, 'rows': [[1, 2, 256]], 'boards': []}", "rows[0][2] is 256"},
        {"{'width': 1, 'rows': [], 'boards': []}", "1 x 0 texels"},
    };
#undef BOARD
    expect_refusal("pictures", good, 1, NULL);
    expect_refusal("pictures", good, 0, "depth is 0");
    for (size_t i = 0; i < COUNT(cases); i++)
        expect_refusal("pictures", cases[i].values, 1, cases[i].says);
}
