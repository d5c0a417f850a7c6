#include "tone_curve.h"

#include "renderer/base/cli.h"

#include <math.h>
#include <string.h>

bool tone_curve_parse(const char *text, struct curve *out, struct err *e)
{
    *out = (struct curve){.kind = CURVE_LINEAR, .gamma = 1, .exposure = 1};
    if (strcmp(text, "linear") == 0)
        return true;
    if (strcmp(text, "srgb") == 0)
        out->kind = CURVE_SRGB;
    else if (strcmp(text, "cgl") == 0)
        out->kind = CURVE_CGL;
    else if (strncmp(text, "gamma=", 6) == 0)
        out->kind = CURVE_GAMMA;
    else if (strncmp(text, "exposure=", 9) == 0)
        out->kind = CURVE_EXPOSURE;
    else
        return err_set(e, "--curve: '%s' is none of: " TONE_CURVES, text);
    return (out->kind != CURVE_GAMMA ||
            cli_double("--curve gamma", text + 6, 0.2, 5, &out->gamma, e)) &&
           (out->kind != CURVE_EXPOSURE ||
            cli_double("--curve exposure", text + 9, 1e-3, 1e3, &out->exposure, e));
}

static double decode_srgb(double code)
{
    return code <= 0.04045 ? code / 12.92 : pow((code + 0.055) / 1.055, 2.4);
}

double tone_curve_decode(const struct curve *c, double code)
{
    switch (c->kind) {
    case CURVE_LINEAR: return code;
    case CURVE_SRGB: return decode_srgb(code);
    case CURVE_GAMMA: return pow(code, c->gamma);
    case CURVE_EXPOSURE: return code < 1 ? -log1p(-decode_srgb(code)) / c->exposure : INFINITY;
    case CURVE_CGL: return pow(code, 2.2) / sqrt(2);
    }
    return NAN;
}

void tone_curve_bin(const struct curve *c, int k, int steps, double *lo, double *hi)
{
    double below = c->kind == CURVE_CGL ? 0 : 0.5, above = 1 - below;
    *lo = tone_curve_decode(c, fmax(0, (k - below) / steps));
    *hi = tone_curve_decode(c, fmin(1, (k + above) / steps));
}
