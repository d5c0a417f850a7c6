#include "adaptive_stop.h"

#include <math.h>

static const double rounding = 1e-3;

struct adaptive_stop adaptive_stop_check(const struct moments *m, int batch, double tolerance,
                                         int most)
{
    struct adaptive_stop r = {0, 0};
    size_t pixels = (size_t)m->width * (size_t)m->height;
    for (size_t p = 0; p < pixels; p++) {
        double n = m->n[p], mean = 0, m2 = 0;
        for (size_t c = 0; c < 3; c++)
            if (m->mean[3 * p + c] > mean) {
                mean = m->mean[3 * p + c];
                m2 = m->m2[3 * p + c];
            }
        double interval = n > 1 ? 1.96 * sqrt(m2 / (n * (n - 1))) : INFINITY;
        double bound = tolerance * mean;
        r.too_early += n < most && (fmod(n, batch) != 0 || !(interval <= bound * (1 + rounding)));
        double a = n - batch;
        if (a < 2)
            continue;
        double largest = 1.96 * sqrt(m2 / (a * (a - 1)));
        double smallest = mean - sqrt(m2 * batch / (n * a));
        r.too_late += n > most || largest < tolerance * smallest * (1 - rounding);
    }
    return r;
}
