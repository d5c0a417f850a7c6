#include "pixel_filter.h"

#include "pixel_filter_simd.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const pixel_filter_names[] = {"box", "tent", "gauss", NULL};

enum { MOST_RADIUS = 16 };

static double shape(const struct pixel_filter *f, double x)
{
    x = fabs(x);
    if (x > f->radius)
        return 0;
    switch (f->kind) {
    case PIXEL_FILTER_BOX: return 1;
    case PIXEL_FILTER_TENT: return 1 - x / f->radius;
    case PIXEL_FILTER_GAUSS: break;
    }
    double y = x / f->sigma, edge = f->radius / f->sigma;
    return exp(-0.5 * y * y) - exp(-0.5 * edge * edge);
}

/* Integral of shape() from 0 to x in [0, radius]. */
static double half_integral(const struct pixel_filter *f, double x)
{
    switch (f->kind) {
    case PIXEL_FILTER_BOX: return x;
    case PIXEL_FILTER_TENT: return x - 0.5 * x * x / f->radius;
    case PIXEL_FILTER_GAUSS: break;
    }
    double edge = f->radius / f->sigma;
    return sqrt(0.5 * acos(-1)) * f->sigma * erf(x / (sqrt(2) * f->sigma)) -
           x * exp(-0.5 * edge * edge);
}

/* The x in [0, radius] beyond which the share, 0 to 1/2, of f's integral lies; by bisection. */
static double quantile(const struct pixel_filter *f, double share)
{
    double lo = 0, hi = f->radius;
    for (int i = 0; i < 52; i++) {
        double m = 0.5 * (lo + hi);
        if (0.5 - f->top * half_integral(f, m) > share)
            lo = m;
        else
            hi = m;
    }
    return hi;
}

/* Interpolates the quantile by cubics whose values and slopes agree where bins meet. The share beyond an
 * interpolated place is right to 1e-7. */
static void make_table(struct pixel_filter *f)
{
    enum { PARTS = 1 << PIXEL_FILTER_BITS };
    double x0 = quantile(f, PIXEL_FILTER_LEAST);
    for (int i = 0; i < PIXEL_FILTER_BINS; i++) {
        double width = ldexp(1.0 / PARTS, i / PARTS - 25),
               x1 = quantile(f, width * (PARTS + i % PARTS + 1));
        double s0 = -width / pixel_filter_value(f, x0), s1 = -width / pixel_filter_value(f, x1);
        float *c = f->cubic[i];
        c[0] = (float)x0;
        c[1] = (float)s0;
        c[2] = (float)(3 * (x1 - x0) - 2 * s0 - s1);
        c[3] = (float)(s0 + s1 - 2 * (x1 - x0));
        x0 = x1;
    }
}

bool pixel_filter_make(struct pixel_filter *f, enum pixel_filter_kind kind, double radius,
                       double sigma, struct err *e)
{
    *f = (struct pixel_filter){.kind = kind};
    if (!(radius >= 0.5 && radius <= MOST_RADIUS))
        return err_set(e, "a pixel filter's radius is %g, not in 0.5..%d pixels", radius,
                       MOST_RADIUS);
    if (kind == PIXEL_FILTER_GAUSS && !(sigma >= 0.05 && sigma <= 8))
        return err_set(e, "a pixel filter's sigma is %g, not in 0.05..8 pixels", sigma);
    if (kind == PIXEL_FILTER_BOX && radius == 0.5)
        return true;
    f->radius = radius;
    f->sigma = kind == PIXEL_FILTER_GAUSS ? sigma : 0;
    f->top = 0.5 / half_integral(f, radius);
    make_table(f);
    return true;
}

static bool read_number(const char **at, double *out)
{
    char *end;
    if (**at != ':')
        return false;
    *out = strtod(*at + 1, &end);
    bool ok = end != *at + 1 && (*end == ':' || *end == '\0');
    *at = end;
    return ok;
}

bool pixel_filter_parse(const char *text, struct pixel_filter *f, struct err *e)
{
    size_t word = strcspn(text, ":");
    const char *at = text + word;
    double sigma = 0, radius;
    int kind = 0;
    while (pixel_filter_names[kind] != NULL && (strlen(pixel_filter_names[kind]) != word ||
                                                memcmp(text, pixel_filter_names[kind], word) != 0))
        kind++;
    bool ok = pixel_filter_names[kind] != NULL &&
              (kind != PIXEL_FILTER_GAUSS || read_number(&at, &sigma));
    radius = kind == PIXEL_FILTER_BOX    ? 0.5
             : kind == PIXEL_FILTER_TENT ? 1
                                         : fmin(6 * sigma, MOST_RADIUS);
    if (ok && *at != '\0')
        ok = read_number(&at, &radius) && *at == '\0';
    if (!ok)
        return err_set(e, "a pixel filter is box, tent:RADIUS or gauss:SIGMA:RADIUS, not '%s'",
                       text);
    return pixel_filter_make(f, (enum pixel_filter_kind)kind, radius, sigma, e);
}

void pixel_filter_print(const struct pixel_filter *f, char text[PIXEL_FILTER_TEXT])
{
    double radius = f->radius > 0 ? f->radius : 0.5;
    if (f->kind == PIXEL_FILTER_GAUSS)
        snprintf(text, PIXEL_FILTER_TEXT, "gauss:%.9g:%.9g", f->sigma, radius);
    else
        snprintf(text, PIXEL_FILTER_TEXT, "%s:%.9g", pixel_filter_names[f->kind], radius);
}

bool pixel_filter_is_gauss(const struct pixel_filter *f, double sigmas)
{
    return f->kind == PIXEL_FILTER_GAUSS && fabs(f->radius - sigmas * f->sigma) < 1e-6;
}

double pixel_filter_value(const struct pixel_filter *f, double x)
{
    if (f->radius > 0)
        return f->top * shape(f, x);
    return fabs(x) <= 0.5;
}

double pixel_filter_sharing(const struct pixel_filter *f, int order)
{
    enum { POINTS = 4096 };
    if (f->radius == 0)
        return 1;
    double shared = 0, own = 0;
    int reach = (int)ceil(2 * f->radius);
    for (int i = 0; i < POINTS; i++) {
        double x = f->radius * (2 * (i + 0.5) / POINTS - 1), v = pixel_filter_value(f, x), s = 0;
        for (int d = -reach; d <= reach; d++)
            s += pixel_filter_value(f, x - d);
        shared += v * pow(s, order - 1);
        own += pow(v, order);
    }
    return shared / own * (shared / own);
}
