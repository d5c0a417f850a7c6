#include "same_samples.h"

#include <math.h>
#include <stdio.h>

static bool is_near(double x, double y, double tolerance)
{
    return fabs(x - y) <= tolerance;
}

/* The name of the first number of pixel p that differs, with both values; NULL: none. */
static const char *differs(const struct moments *a, const struct moments *b, size_t p,
                           double value[2])
{
    static const char *const names[4][3] = {{"n", "n", "n"},
                                            {"mean of red", "mean of green", "mean of blue"},
                                            {"M2 of red", "M2 of green", "M2 of blue"},
                                            {"M3 of red", "M3 of green", "M3 of blue"}};
    const double n = a->n[p], rounding = 4e-7;
    for (size_t c = 0; c < 3; c++) {
        const size_t i = 3 * p + c;
        const double mean = rounding * fabs(a->mean[i]), m2 = fmax(a->m2[i], b->m2[i]);
        const double allowed = rounding * m2 + mean * sqrt(n * m2) + n * mean * mean;
        const double pair[4][2] = {
            {n, b->n[p]}, {a->mean[i], b->mean[i]}, {a->m2[i], b->m2[i]}, {a->m3[i], b->m3[i]}};
        const double tolerance[4] = {0, mean, allowed, 1e-5 * pow(m2 + allowed, 1.5)};
        for (size_t k = 0; k < 4; k++) {
            value[0] = pair[k][0];
            value[1] = pair[k][1];
            if (!is_near(value[0], value[1], tolerance[k]))
                return names[k][c];
        }
    }
    return NULL;
}

int same_samples_differing(const struct moments *a, const struct moments *b, double n,
                           char reason[128])
{
    const size_t pixels = (size_t)a->width * (size_t)a->height;
    int found = 0;
    if (a->width != b->width || a->height != b->height) {
        snprintf(reason, 128, "other sizes");
        return (int)pixels;
    }
    for (size_t p = 0; p < pixels; p++) {
        double value[2];
        const char *what = n == 0 || b->n[p] == n ? differs(a, b, p, value) : NULL;
        if (what != NULL && found++ == 0)
            snprintf(reason, 128, "%s of pixel (%d, %d) is %.6g, not %.6g", what, (int)p % a->width,
                     (int)p / a->width, value[1], value[0]);
    }
    return found;
}
