/* Largest relative error of f against `truth` in double precision, at 10^6 + 1 points from `from`
 * to `to`. */
#include "renderer/math/exp.h"
#include "tests/support/test.h"

#include <math.h>

static double worst(vf (*f)(vf), double (*truth)(double), float from, float to)
{
    double most = 0;
    for (int i = 0; i <= 1000000; i++) {
        float x = from + (to - from) * (float)i * 1e-6f;
        most = fmax(most, fabs((double)f(x) / truth((double)x) - 1));
    }
    return most;
}

static vf ours(vf x)
{
    return exp_negative(x);
}

static vf erfcx_ours(vf x)
{
    return exp_erfcx(x);
}

static double erfcx(double x)
{
    return exp(x * x) * erfc(x);
}

TEST(as_near_as_the_header_says)
{
    assert_true(worst(ours, exp, -87, 0) < 3e-7);
    assert_true(worst(ours, exp, -1, 0) < 3e-7);
    assert_true(worst(erfcx_ours, erfcx, 0, 1) < 6e-7);
    assert_true(worst(erfcx_ours, erfcx, 0, 25) < 6e-7);
    /* Negative control. */
    assert_true(worst(erfcx_ours, exp, 0, 1) > 0.1);
}

TEST(ends_of_the_range)
{
    assert_true(exp_negative(0) == 1 && exp_negative(-88) == 0 && exp_negative(-INFINITY) == 0);
    assert_true(exp_erfcx(0) > 1 - 6e-7f && exp_erfcx(0) < 1 + 6e-7f && exp_erfcx(INFINITY) == 0);
    assert_true(fabs((double)exp_erfcx(1e6f) * 1e6 * sqrt(M_PI) - 1) < 1e-6); /* 1/(x sqrt(pi)) */
}
