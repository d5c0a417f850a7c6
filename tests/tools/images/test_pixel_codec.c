/* Numbers packed for the page come back as exactly as tools/images/pixel_codec.h says, read by a reader that was
 * written from its description. */
#include "tools/images/pixel_codec.h"

#include "layer_reader.h"
#include "tests/support/own.h"
#include "tests/support/simulate.h"
#include "tests/support/test.h"

#include <zlib.h>

static struct moments blank(int width, int height, const char *unit)
{
    struct moments m = new_moments(width, height, unit);
    for (int i = 0; i < width * height; i++)
        m.n[i] = strcmp(unit, "exact") == 0 ? 1 : 64;
    return m;
}

/* Gives a value that standard error, with the n of its pixel. */
static void set(struct moments *m, size_t pixel, size_t channel, double value, double error)
{
    double n = m->n[pixel];
    m->mean[3 * pixel + channel] = value;
    m->m2[3 * pixel + channel] = error * error * n * (n - 1);
}

static size_t assert_round_trip(const struct moments *m)
{
    struct err e = {""};
    uint8_t *bytes;
    size_t size;
    bool uniform;
    MUST(pixel_codec_encode(m, 0, &bytes, &size, &uniform, &e));
    OWN(layer_numbers) l = layer_read(bytes, size, m->width, m->height);
    size_t pixels = (size_t)m->width * (size_t)m->height;
    assert_int_equal(uniform, l.n == NULL);
    for (size_t i = 0; i < pixels; i++) {
        if (l.n != NULL)
            assert_float_equal(l.n[i], m->n[i], 0);
        for (size_t c = 0; c < 3; c++) {
            double variance = moments_var_of_mean(m, i, (int)c);
            double error = variance > 0 ? sqrt(variance) : 0, v = m->mean[3 * i + c];
            double back = l.value[3 * i + c];
            /* The noise is stored to 2^(1/24), so the step may be that much over 1/8 of it. */
            double bound = fmax(error / 16 * 1.03, fabs(v) / (1 << 20));
            if (fabs(back - v) > bound)
                fail_msg("pixel %zu, channel %zu: %.9g is %.9g, noise %.3g", i, c, v, back, error);
            if (error == 0)
                assert_float_equal(l.error[3 * i + c], 0, 0);
            else
                assert_float_equal(l.error[3 * i + c] / error, 1, 0.03);
        }
    }
    free(bytes);
    return size;
}

/* An even grey with noise of 1 % that the channels share, as light on a grey wall has. The page's limit
 * needs what this format is for: half floats are 6 bytes a pixel, without any error. Here a value has
 * log2(11 x 4.13) = 5.5 bits of entropy (steps of 1/8 to 1/16 of the noise: 11 on the average; sqrt(2 pi e)
 * = 4.13) and a prediction from four neighbours costs 0.16 bits, so 6 bits in the first channel and next
 * to nothing in the others, 1 byte a pixel with deflate's loss; noise of the error is 0.09 of itself for n
 * of 64, 1.5 steps, so 2.7 bits. 1.5 bytes a pixel are allowed. */
TEST(noisy_grey_is_small)
{
    OWN(moments) m = blank(64, 64, "sample");
    uint64_t seed = 5;
    for (size_t i = 0; i < 64 * 64; i++) {
        double v = 0.25 * (1 + 0.01 * draw_normal(uniform(&seed), &seed)),
               error = 0.0025 * (1 + 0.09 * draw_normal(uniform(&seed), &seed));
        for (size_t c = 0; c < 3; c++)
            set(&m, i, c, v, error);
    }
    size_t size = assert_round_trip(&m);
    print_message("%.2f bytes a pixel\n", (double)size / 4096);
    assert_true(size < 4096 * 3 / 2);
}

TEST(hard_images_are_exact)
{
    uint64_t seed = 7;
    for (int kind = 0; kind < 6; kind++) {
        OWN(moments) m = blank(33, 17, kind == 1 ? "exact" : "sample");
        for (size_t i = 0; i < 33 * 17; i++) {
            if (kind == 5)
                m.n[i] = floor(4 + 1e6 * uniform(&seed));
            for (size_t c = 0; c < 3; c++) {
                double v = uniform(&seed);
                switch (kind) {
                case 0:
                    set(&m, i, c, v, 0.3 * uniform(&seed));
                    break;                              /* colours without relation */
                case 1: set(&m, i, c, v * v, 0); break; /* no noise */
                case 2: /* a lamp beside black, and what is far below and above one */
                    set(&m, i, c, pow(10, 16 * v - 8),
                        v < 0.3 ? 0 : pow(10, 16 * uniform(&seed) - 10));
                    break;
                case 3: set(&m, i, c, v - 0.5, i % 3 == 0 ? 0 : 0.01); break; /* negative values */
                case 4: set(&m, i, c, i % 2 == 0 ? 0 : v, v < 0.5 ? 0 : 1e-12); break;
                case 5: set(&m, i, c, v, 0.01); break; /* a count of its own in every pixel */
                default: break;
                }
            }
        }
        assert_round_trip(&m);
    }
}

TEST(small_images)
{
    static const int size[][2] = {{1, 1}, {1, 5}, {5, 1}, {2, 2}};
    uint64_t seed = 9;
    for (size_t k = 0; k < 4; k++) {
        OWN(moments) m = blank(size[k][0], size[k][1], "replicate");
        for (size_t i = 0; i < (size_t)(m.width * m.height); i++)
            for (size_t c = 0; c < 3; c++)
                set(&m, i, c, uniform(&seed), 0.1);
        assert_round_trip(&m);
    }
}

/* An unknown variance (one observation) is stored as no noise. */
TEST(one_observation)
{
    OWN(moments) m = blank(4, 4, "sample");
    for (size_t i = 0; i < 16; i++) {
        m.n[i] = 1;
        m.mean[3 * i] = 0.5;
    }
    assert_round_trip(&m);
}

/* Each square root comes back to within half a step of 1/128; values out of range are clamped to its ends, NaN
 * becomes 0. */
TEST(map_round_trip)
{
    enum { WIDTH = 37, HEIGHT = 11, PIXELS = WIDTH * HEIGHT };
    static float map[PIXELS];
    static uint8_t raw[PIXELS];
    struct err e = {""};
    uint64_t seed = 3;
    for (size_t i = 0; i < PIXELS; i++)
        map[i] = (float)(1.2 * uniform(&seed) - 0.1);
    map[40] = NAN;
    uint8_t *bytes;
    size_t size;
    assert_true(pixel_codec_encode_map(map, WIDTH, HEIGHT, &bytes, &size, &e));
    uLongf length = PIXELS;
    assert_int_equal(uncompress(raw, &length, bytes, size), Z_OK);
    assert_int_equal(length, PIXELS);
    for (size_t y = 0; y < HEIGHT; y++) {
        unsigned sum = 0;
        for (size_t x = 0; x < WIDTH; x++) {
            double v = (double)map[y * WIDTH + x];
            sum = (sum + raw[y * WIDTH + x]) & 255;
            assert_float_equal(sum / 128.0, v > 0 ? sqrt(fmin(v, 1)) : 0, 0.5 / 128 + 1e-6);
        }
    }
    free(bytes);
}
