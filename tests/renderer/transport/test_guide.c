/* Path guiding: the tables against closed forms, and guided images against closed forms and unguided ones. */
#include "renderer/transport/guide_simd.h"
#include "tests/support/render_check.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

enum { TABLE = GUIDE_ROWS * GUIDE_SIDE };

/* A million directions in each bin, with L = 3 in the columns 0 to 3 of the square and L = 1 in the others. */
static void half_bright(float table[TABLE])
{
    double sum[GUIDE_BINS], count[GUIDE_BINS];
    for (int i = 0; i < GUIDE_BINS; i++) {
        count[i] = 1e6;
        sum[i] = count[i] * (i / GUIDE_SIDE < GUIDE_SIDE / 2 ? 9 : 1);
    }
    guide_tabulate(sum, count, table);
}

static double density_of_bin(const float table[TABLE], int column, int bin)
{
    const float *row = table + (1 + column) * GUIDE_SIDE;
    double a = (double)table[column] - (column > 0 ? (double)table[column - 1] : 0);
    double b = (double)row[bin] - (bin > 0 ? (double)row[bin - 1] : 0);
    return a * b * GUIDE_BINS;
}

/* 0.2 of the density is uniform, the rest in proportion to L where all neighbours of a bin have its L. Each bin learns
 * by 1/5 from each of its (up to) four neighbours, so between the halves L^2 = (9 m + 1/5)/(m + 1/5) and (m + 9/5)/(m +
 * 1/5), where the bin itself and its other neighbours count m = 1 + 3/5, at the upper and lower edge 1 + 2/5. Without
 * lessons all is uniform. */
TEST(densities_follow_the_light)
{
    float table[TABLE];
    double weight[GUIDE_BINS], total = 0;
    half_bright(table);
    for (int x = 0; x < GUIDE_SIDE; x++)
        for (int y = 0; y < GUIDE_SIDE; y++) {
            double m = y == 0 || y == GUIDE_SIDE - 1 ? 1.4 : 1.6, l = x < 4 ? 3 : 1;
            if (x == 3)
                l = sqrt((9 * m + 0.2) / (m + 0.2));
            if (x == 4)
                l = sqrt((m + 1.8) / (m + 0.2));
            total += weight[x * GUIDE_SIDE + y] = l;
        }
    for (int i = 0; i < GUIDE_BINS; i++) {
        double expected = 0.2 + 0.8 * GUIDE_BINS * weight[i] / total;
        double d = density_of_bin(table, i / GUIDE_SIDE, i % GUIDE_SIDE);
        assert_true(fabs(d - expected) < 1e-5);
    }
    const double none[GUIDE_BINS] = {0};
    guide_tabulate(none, none, table);
    for (int i = 0; i < GUIDE_BINS; i++)
        assert_true(density_of_bin(table, i / GUIDE_SIDE, i % GUIDE_SIDE) == 1);
}

/* Of N x N numbers, one in each square of a grid, as many come into a bin as its density says, but for the squares that
 * its four sides cut: of each of the two numbers one at either end, so 4/N of the numbers at most. What comes into a bin
 * is spread evenly: so is its mean, to the same 4/N of the numbers. */
TEST(numbers_have_the_density_that_is_returned)
{
    enum { N = 1024 };
    float table[TABLE];
    static double hits[GUIDE_BINS], sum[GUIDE_BINS][2], density[GUIDE_BINS];
    half_bright(table);
    const struct guide g = {.table = table};
    for (int i = 0; i < N * N; i++) {
        vf u[2] = {((float)(i / N) + 0.5f) / N, ((float)(i % N) + 0.5f) / N};
        vi bin;
        vf d = guide_direction(&g, vi_set(0), u, &bin);
        assert_true(u[0] >= 0 && u[0] < 1 && u[1] >= 0 && u[1] < 1);
        assert_int_equal(bin, (int)(u[0] * GUIDE_SIDE) * GUIDE_SIDE + (int)(u[1] * GUIDE_SIDE));
        hits[bin]++;
        sum[bin][0] += (double)u[0];
        sum[bin][1] += (double)u[1];
        density[bin] = (double)d;
    }
    bool uneven = false;
    for (int i = 0; i < GUIDE_BINS; i++) {
        double share = hits[i] / ((double)N * N), most = 4.0 / N;
        assert_true(fabs(share - density[i] / GUIDE_BINS) < most);
        assert_true(fabs(density[i] - density_of_bin(table, i / GUIDE_SIDE, i % GUIDE_SIDE)) <
                    1e-5);
        double x = (i / GUIDE_SIDE + 0.5) / GUIDE_SIDE, y = (i % GUIDE_SIDE + 0.5) / GUIDE_SIDE;
        assert_true(fabs(sum[i][0] / hits[i] - x) < most / share);
        assert_true(fabs(sum[i][1] / hits[i] - y) < most / share);
        uneven |= fabs(share - 1.0 / GUIDE_BINS) > most;
    }
    assert_true(uneven); /* negative control: numbers as they come would fail */
}

/* A lamp above a plate, found by the plate's directions alone: rho/pi L E with E by Lambert's formula. n = 262144
 * samples. The lamp takes a share of about 0.1 of the cosine-weighted hemisphere, so that a path without guiding has a
 * relative variance of about 9; with four in five directions towards the bins that the lamp touches, perhaps twice its
 * own area, 1/(0.1 x 0.8/0.2) - 1 = 1.5. Half is asked for. */
TEST(a_lamp_found_by_directions)
{
    OWN(scene) s = check_plate(v3(0, 1, 0), 0.6f);
    const double corner[4][3] = {{0.2, 1, -0.7}, {1.1, 1, -0.7}, {1.1, 1, -0.2}, {0.2, 1, -0.2}};
    build_quad(&s, v3(0.2f, 1, -0.7f), v3(0.9f, 0, 0), v3(0, 0, 0.5f),
               build_material(&s, grey(0), grey(5)));
    check_finish(&s);
    const double expected = 0.6 / M_PI * 5 * check_irradiance(corner, 4);
    struct integrator_options io = check_options(DIRECT_BSDF, 1, 20261124);
    struct check_result plain = check_look(&s, io, 64, 64);
    io.guiding = true;
    struct check_result guided = check_look(&s, io, 64, 64);
    check_mean(&guided, 1, expected, "guided");
    print_message("standard error %.2g, guided %.2g\n", plain.std_error[1], guided.std_error[1]);
    assert_true(pow(guided.std_error[1] / plain.std_error[1], 2) < 0.5);
    /* Negative control: a mean 3 % off is seen; without the division by the density it would be several times too large. */
    assert_false(check_agrees(&guided, 1, 1.03 * expected));
}

/* H0: guided and unguided images of a room have the same mean, through every estimator, at three bounces. 65536 paths
 * each. By sampling lights an image's standard error is 0.7 % of its mean, so that a difference of 7 % is found with
 * power 0.98; that of light that bounced twice or three times is the negative control. */
TEST(guided_images_have_the_same_mean)
{
    OWN(scene) s = build_room(10);
    check_finish(&s);
    for (int direct = 0; direct_kind_names[direct] != NULL; direct++) {
        struct integrator_options io = check_options(direct, 3, 7);
        OWN(moments) plain = check_render(&s, io, 32, 32, 64);
        io.guiding = true;
        io.sampler.seed = 8;
        OWN(moments) guided = check_render(&s, io, 32, 32, 64);
        io.max_bounces = 1;
        OWN(moments) darker = check_render(&s, io, 32, 32, 64);
        struct check_result r = check_pool(&guided);
        print_message("%s: %.4g, standard error %.2g, z %.1f; of one bounce %.1f\n",
                      direct_kind_names[direct], r.mean[1], r.std_error[1],
                      check_z(&plain, &guided, 1), check_z(&plain, &darker, 1));
        for (int c = 0; c < 3; c++)
            assert_true(fabs(check_z(&plain, &guided, c)) < CHECK_Z_LIMIT);
        if (direct == DIRECT_LIGHT || direct == DIRECT_MIS)
            assert_true(fabs(check_z(&plain, &darker, 1)) > CHECK_Z_LIMIT);
    }
}
