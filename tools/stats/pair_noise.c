#include "pair_noise.h"

#include "noise_estimate.h"

#include <assert.h>
#include <math.h>
#include <string.h>

bool pair_noise_is_unknown(const struct moments *a, const struct moments *b)
{
    return moments_noise_is_unknown(a) || moments_noise_is_unknown(b);
}

bool pair_noise_estimate(const struct moments *a, const struct moments *b, struct moments out[2],
                         struct err *e)
{
    struct noise_estimate found;
    const struct moments *of[2] = {a, b};
    const size_t values = 3 * (size_t)a->width * (size_t)a->height;
    assert(a->width == b->width && a->height == b->height);
    memset(out, 0, 2 * sizeof *out);
    for (int k = 0; k < 2; k++) {
        if (!moments_alloc(&out[k], a->width, a->height, e))
            return false;
        memcpy(out[k].mean, of[k]->mean, values * sizeof *out[k].mean);
    }
    if (memcmp(a->mean, b->mean, values * sizeof *a->mean) != 0)
        return noise_estimate_variance(&out[0], &out[1], NULL, NULL, NULL, false, &found, e);
    moments_make_exact(&out[0]);
    moments_make_exact(&out[1]);
    return true;
}

static double total_variance(const struct moments *m)
{
    double sum = 0;
    for (size_t p = 0; p < (size_t)m->width * (size_t)m->height; p++)
        for (int c = 0; c < 3; c++)
            sum += moments_var_of_mean(m, p, c);
    return sum;
}

double pair_noise_share(const struct moments *a, const struct moments *b)
{
    const double of_a = total_variance(a), all = of_a + total_variance(b);
    return all > 0 ? of_a / all : 1;
}

double pair_noise_samples_of_a(double share_a, double times)
{
    const double left = 1 / times - (1 - share_a);
    return left > 0 ? share_a / left : INFINITY;
}
