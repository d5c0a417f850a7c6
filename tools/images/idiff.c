#include "idiff.h"

#include "renderer/image/tone.h"

#include <stdlib.h>
#include <string.h>

void idiff_quantise(const struct moments *m, double white, uint8_t *rgb8)
{
    size_t values = 3 * (size_t)m->width * (size_t)m->height;
    for (size_t i = 0; i < values; i++)
        rgb8[i] = tone_map(TONE_SRGB, m->mean[i] / white);
}

void idiff_histogram(const uint8_t *a, const uint8_t *b, size_t pixels, size_t count[256])
{
    memset(count, 0, 256 * sizeof *count);
    for (size_t p = 0; p < pixels; p++) {
        int largest = 0;
        for (size_t i = 3 * p; i < 3 * p + 3; i++) {
            int d = abs(a[i] - b[i]);
            largest = d > largest ? d : largest;
        }
        count[largest]++;
    }
}

static size_t failing(const size_t count[256], double fail)
{
    size_t n = 0;
    for (int d = 0; d < 256; d++)
        n += d / 255.0 > fail ? count[d] : 0;
    return n;
}

bool idiff_differs(const size_t count[256], size_t pixels, double fail, double percent)
{
    return (double)failing(count, fail) > percent / 100 * (double)pixels;
}

double idiff_percent_score(const size_t count[256], size_t pixels, double fail)
{
    return 100 * (double)failing(count, fail) / (double)pixels;
}
