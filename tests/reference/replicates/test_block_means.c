/* Means of blocks: sums that are known, what is stored, what is refused, and what becomes of a pair. How pairs are
 * judged: test_paired_rates.c. */
#include "reference/replicates/block_means.h"
#include "tests/support/simulate.h"
#include "tests/support/test.h"

static struct block_means means_of(int width, int height, int tile, int capacity)
{
    struct block_means b;
    struct err e;
    MUST(block_means_alloc(&b, width, height, tile, capacity, &e));
    return b;
}

/* side^2 >= the number of images, so that 3 K / side^2 numbers a pixel are at most 3; no larger than what divides a
 * tile. */
TEST(a_block_is_as_large_as_there_are_images)
{
    static const int rows[][3] = {/* images, tile, side */
                                  {1, 16, 1},  {4, 16, 2},   {5, 16, 4},     {16, 16, 4},
                                  {64, 16, 8}, {65, 16, 16}, {1024, 16, 16}, {64, 12, 4}};
    for (size_t i = 0; i < COUNT(rows); i++) {
        struct block_means b = means_of(64, 64, rows[i][1], rows[i][0]);
        assert_int_equal(b.side, rows[i][2]);
        block_means_free(&b);
    }
}

/* Of a white image a block is its area / 16: of 21 x 11 pixels with side 4 the last column is 5 wide (one pixel is less
 * than half a block), the last row 3 high. Of an image whose red is x, the first block has the mean of 0 to 3. */
TEST(each_pixel_is_in_one_block)
{
    float white[21 * 11 * 3], ramp[21 * 11 * 3] = {0};
    for (size_t i = 0; i < COUNT(white); i++)
        white[i] = 1;
    for (size_t p = 0; p < 21 * 11; p++)
        ramp[3 * p] = (float)(p % 21);
    struct block_means b = means_of(21, 11, 16, 16);
    struct err e;
    MUST(block_means_add(&b, white, &e));
    MUST(block_means_add(&b, ramp, &e));
    assert_true(b.side == 4 && b.nx == 5 && b.ny == 3 && b.num == 2);
    for (size_t y = 0; y < 3; y++)
        for (size_t x = 0; x < 5; x++)
            for (size_t c = 0; c < 3; c++)
                assert_near(b.value[3 * (5 * y + x) + c],
                            (x == 4 ? 5 : 4) * (y == 2 ? 3 : 4) / 16.0, 1e-6);
    const float *second = b.value + 3 * 5 * 3;
    assert_near(second[0], (0 + 1 + 2 + 3) / 4.0, 1e-6);
    assert_near(second[3 * 4], (16 + 17 + 18 + 19 + 20) * 4 / 16.0, 1e-5);
    assert_true(second[1] == 0);
    block_means_free(&b);
}

TEST(what_is_stored_has_the_same_bits)
{
    float px[9 * 7 * 3];
    uint64_t seed = 1;
    struct block_means b = means_of(9, 7, 16, 4), back;
    struct err e;
    for (int k = 0; k < 3; k++) {
        for (size_t i = 0; i < COUNT(px); i++)
            px[i] = (float)(draw(LAW_FIREFLY, &seed) - 0.6);
        MUST(block_means_add(&b, px, &e));
    }
    json_t *json = block_means_to_json(&b);
    MUST(block_means_from_json(json, 9, 7, &back, &e));
    assert_true(back.side == 2 && back.nx == b.nx && back.ny == b.ny && back.num == 3);
    assert_memory_equal(back.value, b.value, 3 * 3 * (size_t)(b.nx * b.ny) * sizeof *b.value);
    block_means_free(&back);
    REFUSES(block_means_from_json(json, 90, 7, &back, &e), "none of images of 90 x 7 pixels");
    REFUSES(block_means_from_json(NULL, 9, 7, &back, &e), "none of images");
    json_object_set_new(json, "values", json_string("AAAA!"));
    REFUSES(block_means_from_json(json, 9, 7, &back, &e), "none of images");
    json_object_set_new(json, "values", json_string(""));
    REFUSES(block_means_from_json(json, 9, 7, &back, &e), "none of images");
    json_object_set_new(json, "side", json_integer(0));
    REFUSES(block_means_from_json(json, 9, 7, &back, &e), "none of images");
    json_decref(json);
    block_means_free(&b);
}

/* b: 1, 3, 5 in its only block, a: 2, 3, 7. Of all three the differences are 1, 0, 2: the observations are 3 + these,
 * of mean 4 and M2 = 2. With b alone there is no noise, and none of two images that both differ by 1. */
TEST(a_pair_is_the_mean_and_a_difference)
{
    struct block_means a = means_of(1, 1, 16, 3), b = means_of(1, 1, 16, 3),
                       other = means_of(3, 1, 16, 1);
    struct moments pairs, mean;
    struct err e;
    for (int k = 0; k < 3; k++) {
        const float of_a = (const float[]){2, 3, 7}[k], of_b = (float)(1 + 2 * k);
        MUST(block_means_add(&a, (const float[]){of_a, of_b + 1, of_b}, &e));
        MUST(block_means_add(&b, (const float[]){of_b, of_b, of_b}, &e));
    }
    const double area = a.side * a.side;
    MUST(block_means_pair(&a, &b, &pairs, &mean, &e));
    assert_string_equal(pairs.unit, "replicate");
    assert_string_equal(mean.unit, "exact");
    assert_near(mean.mean[0], 3 / area, 1e-6);
    assert_near(pairs.mean[0], 4 / area, 1e-6);
    assert_near(pairs.m2[0], 2 / area / area, 1e-6);
    assert_near(pairs.mean[1], 4 / area, 1e-6);
    assert_true(pairs.m2[1] == 0 && pairs.m2[2] == 0 && pairs.n[0] == 3);
    moments_free(&pairs);
    moments_free(&mean);
    MUST(block_means_pair(&b, &b, &pairs, &mean, &e));
    assert_string_equal(pairs.unit, "exact");
    assert_true(pairs.n[0] == 1);
    moments_free(&pairs);
    moments_free(&mean);
    REFUSES(block_means_pair(&other, &b, &pairs, &mean, &e), "these make no pairs");
    block_means_free(&a);
    block_means_free(&b);
    block_means_free(&other);
}
