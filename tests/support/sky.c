#include "sky.h"
#include "build_scene.h"
#include "own.h"
#include "test.h"

#include <gsl/gsl_integration.h>

struct sky sky_uneven(int width, int height)
{
    struct sky s = {.width = width, .height = height};
    assert_true(width * height <= (int)(sizeof s.value / sizeof s.value[0]));
    uint32_t state = 12345;
    for (int i = 0; i < width * height; i++) {
        state = 1664525 * state + 1013904223;
        bool dark = i % width < width / 4 && i / width < height / 4;
        s.value[i] = dark ? 0 : 0.25f + (float)(state >> 24) / 128;
    }
    s.value[(height / 4) * width + width / 2] = 60;
    return s;
}

struct image sky_image(const struct sky *s)
{
    struct image im = build_image(s->width, s->height);
    for (int i = 0; i < s->width * s->height; i++)
        for (int c = 0; c < 3; c++)
            im.data[3 * i + c] = s->value[i] * (float)(c + 1);
    return im;
}

struct environment *sky_environment(const struct sky *s)
{
    struct err e = {""};
    OWN(image) im = sky_image(s);
    struct environment *env = environment_from_image(&im, "sky", &e);
    MUST(env != NULL);
    return env;
}

static double tent(double d)
{
    return fmax(0, 1 - fabs(d));
}

double sky_on_map(const struct sky *s, double x, double y)
{
    double sum = 0, inner = fmin(fmax(y, 0.5), s->height - 0.5);
    for (int j = 0; j < s->height; j++) {
        double row = tent(inner - j - 0.5);
        for (int i = 0; row > 0 && i < s->width; i++) {
            double d = x - i - 0.5;
            d -= s->width * rint(d / s->width);
            sum += (double)s->value[j * s->width + i] * tent(d) * row;
        }
    }
    return sum;
}

double sky_seen(const struct sky *s, const double w[3])
{
    double phi = atan2(-w[2], w[0]) + M_PI, theta = atan2(hypot(w[0], w[2]), w[1]);
    return sky_on_map(s, phi / (2 * M_PI) * s->width, theta / M_PI * s->height);
}

void sky_direction(const struct sky *s, double x, double y, double w[3])
{
    double theta = M_PI * y / s->height, phi = 2 * M_PI * x / s->width - M_PI;
    w[0] = sin(theta) * cos(phi);
    w[1] = cos(theta);
    w[2] = -sin(theta) * sin(phi);
}

double sky_irradiance(const struct sky *s, const double n[3])
{
    enum { POINTS = 6 };
    gsl_integration_glfixed_table *table = gsl_integration_glfixed_table_alloc(POINTS);
    assert_non_null(table);
    double sum = 0;
    for (int j = 0; j < 2 * s->height; j++)
        for (int i = 0; i < 2 * s->width; i++)
            for (size_t a = 0; a < POINTS; a++)
                for (size_t b = 0; b < POINTS; b++) {
                    double x, y, wx, wy, w[3];
                    gsl_integration_glfixed_point(0.5 * i, 0.5 * i + 0.5, a, &x, &wx, table);
                    gsl_integration_glfixed_point(0.5 * j, 0.5 * j + 0.5, b, &y, &wy, table);
                    sky_direction(s, x, y, w);
                    double cosine = fmax(0, n[0] * w[0] + n[1] * w[1] + n[2] * w[2]);
                    if (cosine > 0)
                        sum += wx * wy * cosine * sin(M_PI * y / s->height) * sky_on_map(s, x, y);
                }
    gsl_integration_glfixed_table_free(table);
    return sum * (2 * M_PI / s->width) * (M_PI / s->height);
}
