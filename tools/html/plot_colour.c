#include "plot_colour.h"

#include "renderer/image/tone.h"

#include <assert.h>
#include <math.h>

#include <gsl/gsl_sort.h>

/* Sorts n > 0 values and returns the smallest that at least `fraction` of them, in (0, 1], do not
 * exceed. */
static double percentile(double *value, size_t n, double fraction)
{
    assert(n > 0 && fraction > 0 && fraction <= 1);
    gsl_sort(value, 1, n);
    return value[(size_t)ceil(fraction * (double)n) - 1];
}

double plot_display_white(double *luminances, size_t n, bool *capped)
{
    *capped = false;
    if (n == 0)
        return 1;
    double p99 = percentile(luminances, n, 0.99);
    size_t dark = 0;
    while (dark < n && luminances[dark] <= 0)
        dark++;
    if (dark == n)
        return 1;
    double limit = 6 * luminances[dark + (n - dark) / 2];
    *capped = p99 > limit;
    if (p99 <= 0 || *capped)
        p99 = limit;
    return p99 / 0.8;
}

static double distance(const double a[3], const double b[3])
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

/* CIE L*a*b* (D65) -> sRGB bytes. */
static void rgb8_of_lab(const double lab[3], uint8_t rgb[3])
{
    static const double d65[3] = {0.95047, 1, 1.08883};
    double fy = (lab[0] + 16) / 116;
    double f[3] = {fy + lab[1] / 500, fy, fy - lab[2] / 200}, xyz[3];
    for (size_t i = 0; i < 3; i++)
        xyz[i] = d65[i] * (f[i] > 6.0 / 29 ? f[i] * f[i] * f[i] : (f[i] - 4.0 / 29) * 108 / 841);
    static const double to_rgb[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                        {-0.9692660, 1.8760108, 0.0415560},
                                        {0.0556434, -0.2040259, 1.0572252}};
    for (size_t i = 0; i < 3; i++)
        rgb[i] = tone_map(TONE_SRGB,
                          to_rgb[i][0] * xyz[0] + to_rgb[i][1] * xyz[1] + to_rgb[i][2] * xyz[2]);
}

/* The colour at the share u in [0, 1] of the way along a polyline through n points. */
static void along(const double (*point)[3], size_t n, double u, uint8_t rgb[3])
{
    double length = 0, lab[3];
    for (size_t i = 1; i < n; i++)
        length += distance(point[i - 1], point[i]);
    double left = u * length;
    size_t leg = 0;
    while (leg + 2 < n && left > distance(point[leg], point[leg + 1])) {
        left -= distance(point[leg], point[leg + 1]);
        leg++;
    }
    double share = fmin(left / distance(point[leg], point[leg + 1]), 1);
    for (size_t i = 0; i < 3; i++)
        lab[i] = (1 - share) * point[leg][i] + share * point[leg + 1][i];
    rgb8_of_lab(lab, rgb);
}

void plot_diverging_rgb8(double t, uint8_t rgb[3])
{
    /* L*, a*, b* at |t| = 0, 1/2, 1; each leg is 46.0 units long and stays inside sRGB. */
    static const double anchor[2][3][3] = {{{97, 0, 0}, {64, -8, -31}, {31, 17, -51}},
                                           {{97, 0, 0}, {64, 20, 25}, {31, 51, 33}}};
    if (isnan(t))
        rgb[0] = rgb[1] = rgb[2] = 128;
    else
        along(anchor[t > 0], 3, fmin(fabs(t), 1), rgb);
}

void plot_sequential_rgb8(double t, uint8_t rgb[3])
{
    /* Every eighth of matplotlib's viridis (CC0) in L*a*b*. */
    static const double anchor[9][3] = {
        {14.9, 40.6, -32.3},  {25.7, 30.9, -40.4}, {35.7, 9.2, -34.4},
        {45.0, -12.4, -21.7}, {54.5, -30.9, -6.1}, {63.6, -46.1, 13.8},
        {72.9, -51.7, 42.0},  {82.0, -37.5, 72.7}, {90.9, -10.3, 85.3}};
    if (isnan(t))
        rgb[0] = rgb[1] = rgb[2] = 128;
    else
        along(anchor, 9, fmin(fmax(t, 0), 1), rgb);
}
