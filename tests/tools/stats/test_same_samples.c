/* The same samples summed whole and in two shares, rounded to the floats of a file; and faulty sums, which must be
 * found. */
#include "renderer/math/sampler.h"
#include "tools/stats/same_samples.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

enum { WIDTH = 5, HEIGHT = 3, N = 40, CUT = 13 };

/* Green, a mean of 1000 with noise of 1e-3 of it, is the worst case for sums of squares; blue has no noise. */
static void add_samples(struct moments *m, uint32_t first, uint32_t last)
{
    for (size_t p = 0; p < WIDTH * HEIGHT; p++)
        for (uint32_t i = first; i < last; i++) {
            double u = (double)sampler_get(3, (uint32_t)p, i, 0, 0).u[0];
            moments_add(m, p, (double[]){-log(1 - u), 1000 + u, 0.7});
        }
}

static double stored(double x)
{
    return (double)(float)x;
}

static struct moments share(uint32_t first, uint32_t last)
{
    struct moments m;
    struct err e;
    MUST(moments_alloc(&m, WIDTH, HEIGHT, &e));
    add_samples(&m, first, last);
    for (size_t i = 0; i < 3 * WIDTH * HEIGHT; i++) {
        m.mean[i] = stored(m.mean[i]);
        m.m2[i] = stored(m.m2[i]);
        m.m3[i] = stored(m.m3[i]);
    }
    return m;
}

/* What went wrong in the sum of the two shares. */
enum fault {
    NONE,
    NO_CROSS_TERM,
    LATER_M2_ONLY,
    ONE_COUNT_LESS,
    NO_M3,
    LAST_PIXEL_TWICE,
    NUM_FAULTS
};

static int differing(enum fault fault, char reason[128])
{
    OWN(moments) whole = share(0, N), first = share(0, CUT), rest = share(CUT, N);
    struct err e;
    const size_t last = WIDTH * HEIGHT - 1;
    double m2[3 * WIDTH * HEIGHT], late[3 * WIDTH * HEIGHT];
    for (size_t i = 0; i < 3 * WIDTH * HEIGHT; i++) {
        m2[i] = first.m2[i] + rest.m2[i];
        late[i] = rest.m2[i];
    }
    MUST(moments_merge(&first, &rest, &e));
    if (fault == LAST_PIXEL_TWICE) {
        struct moments again = moments_run(&first, last, 1), more = moments_run(&rest, last, 1);
        MUST(moments_merge(&again, &more, &e));
    }
    for (size_t i = 0; i < 3 * WIDTH * HEIGHT; i++) {
        first.m2[i] = fault == NO_CROSS_TERM   ? m2[i]
                      : fault == LATER_M2_ONLY ? late[i]
                                               : first.m2[i];
        first.m3[i] = fault == NO_M3 ? 0 : first.m3[i];
    }
    for (size_t p = 0; p <= last; p++)
        first.n[p] -= fault == ONE_COUNT_LESS;
    int found = same_samples_differing(&whole, &first, 0, reason);
    return found;
}

TEST(sums_of_shares)
{
    static const char *const says[NUM_FAULTS] = {[NO_CROSS_TERM] = "M2 of red of pixel (0, 0) is",
                                                 [LATER_M2_ONLY] = "M2 of red of pixel (0, 0) is",
                                                 [ONE_COUNT_LESS] =
                                                     "n of pixel (0, 0) is 39, not 40",
                                                 [NO_M3] = "M3 of red of pixel (0, 0) is 0, not"};
    char reason[128] = "";
    assert_int_equal(differing(NONE, reason), 0);
    assert_string_equal(reason, "");
    for (int fault = NO_CROSS_TERM; fault <= NO_M3; fault++) {
        assert_int_equal(differing((enum fault)fault, reason), WIDTH * HEIGHT);
        if (strncmp(reason, says[fault], strlen(says[fault])) != 0)
            fail_msg("fault %d: '%s'", fault, reason);
    }
    assert_int_equal(differing(LAST_PIXEL_TWICE, reason), 1);
    assert_string_equal(reason, "n of pixel (4, 2) is 67, not 40");
}

/* Where sample counts differ between pixels, only the pixels with the given count are compared. */
TEST(pixels_of_one_count)
{
    struct moments whole = share(0, CUT), some = share(0, N), less = share(0, CUT);
    char reason[128] = "";
    for (size_t p = 0; p < WIDTH * HEIGHT; p += 2) {
        struct moments to = moments_run(&some, p, 1), from = moments_run(&less, p, 1);
        to.n[0] = from.n[0];
        for (size_t c = 0; c < 3; c++) {
            to.mean[c] = from.mean[c];
            to.m2[c] = from.m2[c];
            to.m3[c] = from.m3[c];
        }
    }
    assert_int_equal(same_samples_differing(&whole, &some, CUT, reason), 0);
    assert_int_equal(same_samples_differing(&whole, &some, 0, reason), WIDTH * HEIGHT / 2);
    some.n[1] = CUT; /* claims that count, but holds the sums of N samples */
    assert_int_equal(same_samples_differing(&whole, &some, CUT, reason), 1);
    struct moments narrow = moments_run(&less, 0, 3);
    assert_true(same_samples_differing(&whole, &narrow, 0, reason) > 0);
    moments_free(&whole);
    moments_free(&some);
    moments_free(&less);
}
