#include "tone.h"

#include <math.h>

static double srgb(double x)
{
    return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
}

uint8_t tone_map(enum tone_curve curve, double radiance)
{
    if (!(radiance > 0))
        return 0;
    double v = curve == TONE_CGL ? pow(radiance * sqrt(2), 1 / 2.2) : srgb(radiance);
    if (v >= 1)
        return 255;
    return (uint8_t)(curve == TONE_CGL ? v * 255 : v * 255 + 0.5);
}
