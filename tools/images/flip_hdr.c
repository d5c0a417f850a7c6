/* FLIP for HDR images: the exposures, the tone curve, and the largest error over all exposures
 * [Andersson21]. */
#include "flip.h"

#include "luminance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <gsl/gsl_sort.h>

/* (x^2 c[0] + x c[1] + c[2]) / (x^2 c[3] + x c[4] + c[5]) */
static const double aces[6] = {0.6 * 0.6 * 2.51, 0.6 * 0.03, 0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14};

double flip_tone(double x)
{
    x = fmin(fmax(x, 0), 1e6); /* it is 1 from 8 on */
    double y = ((aces[0] * x + aces[1]) * x + aces[2]) / ((aces[3] * x + aces[4]) * x + aces[5]);
    return fmin(y, 1);
}

/* The radiance that the tone curve maps to t. */
static double tone_inverse(double t)
{
    double a = aces[0] - t * aces[3], b = aces[1] - t * aces[4], c = aces[2] - t * aces[5];
    return (-b + sqrt(b * b - 4 * a * c)) / (2 * a);
}

bool flip_exposures(const double *reference, size_t pixels, struct flip_exposures *out,
                    struct err *e)
{
    double *y = malloc(pixels * sizeof *y);
    if (y == NULL)
        return err_set(e, "out of memory for FLIP");
    for (size_t i = 0; i < pixels; i++)
        y[i] = fmax(0, luminance(reference + 3 * i));
    gsl_sort(y, 1, pixels);
    double brightest = y[pixels - 1], median = (y[(pixels - 1) / 2] + y[pixels / 2]) / 2;
    if (brightest > 0 && !(y[(pixels - 1) / 2] > 0)) {
        size_t first = 0;
        while (!(y[first] > 0))
            first++;
        size_t last = pixels - 1;
        median = (y[(first + last) / 2] + y[(first + last + 1) / 2]) / 2;
    }
    free(y);
    if (!(brightest > 0))
        return err_set(e, "a black reference has no exposure");
    double white = tone_inverse(0.85);
    out->start = log2(white / brightest);
    out->stop = log2(white / median);
    out->num = (int)fmax(2, ceil(out->stop - out->start));
    return true;
}

bool flip_hdr(const double *reference, const double *test, int width, int height, double ppd,
              const struct flip_exposures *exposures, float *map, struct err *e)
{
    size_t pixels = (size_t)width * (size_t)height;
    double *shown[2] = {malloc(3 * pixels * sizeof(double)), malloc(3 * pixels * sizeof(double))};
    float *one = malloc(pixels * sizeof *one);
    bool ok = (shown[0] != NULL && shown[1] != NULL && one != NULL) ||
              err_set(e, "out of memory for FLIP");
    memset(map, 0, pixels * sizeof *map);
    double range = exposures->stop - exposures->start;
    for (int k = 0; ok && k < exposures->num; k++) {
        double gain = exp2(exposures->start + range * k / fmax(1, exposures->num - 1));
        for (size_t i = 0; i < 3 * pixels; i++) {
            shown[0][i] = flip_tone(gain * reference[i]);
            shown[1][i] = flip_tone(gain * test[i]);
        }
        ok = flip_ldr(shown[0], shown[1], width, height, ppd, one, e);
        for (size_t i = 0; ok && i < pixels; i++)
            map[i] = fmaxf(map[i], one[i]);
    }
    free(shown[0]);
    free(shown[1]);
    free(one);
    return ok;
}
