/* Texture lookup by another route: the image is repeated as a lattice beyond its edges, and the value is the sum over
 * all its texels of a box or hat function around each centre. */
#include "renderer/scene/texture.h"
#include "tests/support/test.h"

enum { W = 4, H = 3, AROUND = 4 };

static float colours[3 * W * H];

static struct texture make_texture(bool nearest, enum texture_wrap s, enum texture_wrap t)
{
    for (int i = 0; i < 3 * W * H; i++)
        colours[i] = (float)((7 * i + 3) % 16) / 16;
    return (struct texture){
        .width = W, .height = H, .nearest = nearest, .wrap = {s, t}, .texel = colours};
}

/* Number of the texel that stands at place i of the endless row; -1: none does. Mirrored: period 2n, its second half backwards. */
static int on_lattice(int i, int n, enum texture_wrap wrap)
{
    int m = ((i % (2 * n)) + 2 * n) % (2 * n);
    switch (wrap) {
    case TEXTURE_WRAP: return m % n;
    case TEXTURE_MIRROR: return m < n ? m : 2 * n - 1 - m;
    case TEXTURE_CLAMP: return i < 0 ? 0 : i >= n ? n - 1 : i;
    case TEXTURE_BORDER: return i >= 0 && i < n ? i : -1;
    }
    return -1;
}

static double kernel(double distance, bool nearest)
{
    double d = fabs(distance);
    return nearest ? d < 0.5 : fmax(0, 1 - d);
}

/* v upwards from the bottom row. */
static double by_lattice(const struct texture *t, double u, double v, int channel)
{
    double sum = 0;
    for (int i = -AROUND * W; i < AROUND * W; i++)
        for (int j = -AROUND * H; j < AROUND * H; j++) {
            int col = on_lattice(i, W, t->wrap[0]), up = on_lattice(j, H, t->wrap[1]);
            if (col >= 0 && up >= 0)
                sum += kernel(u * W - (i + 0.5), t->nearest) *
                       kernel(v * H - (j + 0.5), t->nearest) *
                       (double)t->texel[3 * ((H - 1 - up) * W + col) + channel];
        }
    return sum;
}

/* Every pair of wraps, for u and v from -2 to 2; no place lies on an edge between texels. */
TEST(lookup_is_a_sum_over_the_lattice)
{
    double most_off = 0;
    for (int k = 0; k < 32; k++) {
        const struct texture t =
            make_texture(k % 2 == 0, (enum texture_wrap)(k / 2 % 4), (enum texture_wrap)(k / 8));
        struct texture other = t;
        other.wrap[0] = (enum texture_wrap)((t.wrap[0] + 1) % 4);
        for (int i = 0; i < 61; i++)
            for (int j = 0; j < 47; j++) {
                float u = -2 + 4 * ((float)i + 0.37f) / 61, v = -2 + 4 * ((float)j + 0.41f) / 47;
                rgb c = texture_lookup(&t, (struct uv){u, v});
                const float got[3] = {c.r, c.g, c.b};
                for (int ch = 0; ch < 3; ch++) {
                    double expected = by_lattice(&t, (double)u, (double)v, ch);
                    if (!(fabs((double)got[ch] - expected) < 3e-6))
                        fail_msg("texture %d at %g %g: %g, expected %g", k, (double)u, (double)v,
                                 (double)got[ch], expected);
                    most_off = fmax(most_off,
                                    fabs(expected - by_lattice(&other, (double)u, (double)v, ch)));
                }
            }
    }
    assert_true(most_off > 0.3); /* another wrap is seen */
}

/* At corners, and at coordinates too large for float32 to resolve texels, some colour of the image comes back. */
TEST(edges_and_far_places_are_within)
{
    const float places[] = {0,     1,    -1,    2,      1e-9f, -1e-9f, 1 - 6e-8f,
                            3e38f, 1e6f, -1e6f, -3e38f, 0.5f,  0.25f,  1.0f / 3};
    for (int k = 0; k < 8; k++) {
        const struct texture t =
            make_texture(k % 2 == 0, (enum texture_wrap)(k / 2), (enum texture_wrap)(k / 2));
        for (size_t i = 0; i < sizeof places / sizeof *places; i++)
            for (size_t j = 0; j < sizeof places / sizeof *places; j++) {
                rgb c = texture_lookup(&t, (struct uv){places[i], places[j]});
                assert_true(c.r >= 0 && c.r < 1 && c.g >= 0 && c.g < 1 && c.b >= 0 && c.b < 1);
            }
    }
}

/* A ramp along u, texel i of n being (i + 1/2)/n: bilinear it is u itself between the first and the last centre, so
 * its mean over a triangle is u at the centroid. Nearest: the means over the image's two triangles are 2/3 and 1/3. */
TEST(mean_of_a_ramp)
{
    float ramp[3 * 32];
    for (int i = 0; i < 32; i++)
        for (int c = 0; c < 3; c++)
            ramp[3 * i + c] = ((float)i + 0.5f) / 32;
    struct texture t = {
        .width = 32, .height = 1, .wrap = {TEXTURE_CLAMP, TEXTURE_CLAMP}, .texel = ramp};
    const struct uv small[3] = {{0.1f, 0}, {0.7f, 0.2f}, {0.4f, 1}};
    assert_near(texture_mean_luminance(&t, small, grey(2)), 2 * 0.4, 1e-5);
    const struct uv lower[3] = {{0, 0}, {1, 0}, {1, 1}}, upper[3] = {{0, 0}, {1, 1}, {0, 1}};
    t.nearest = true;
    double below = texture_mean_luminance(&t, lower, grey(1)),
           above = texture_mean_luminance(&t, upper, grey(1));
    assert_near(below + above, 1, 1e-3);
    assert_near(below, 2.0 / 3, 1e-2);
    rgb high = texture_max(&t), low = texture_min(&t);
    assert_near(high.g, 63.0 / 64, 1e-7);
    assert_near(low.b, 1.0 / 64, 1e-7);
}
