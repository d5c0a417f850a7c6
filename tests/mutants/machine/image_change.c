/* image_change A.exr B.exr [A.exr B.exr ...]: how two renders of the same seed differ, a line for each pair:
 *     same                     n, mean, M2 and M3 have the same bits
 *     MEAN T VAR T CHANGED     else: the largest relative change of the mean and of the variance of a sample of any tile of 16 x 16
 *                              pixels, in any channel, with its size in standard errors, and 1 if one of the two is a change:
 *                              of a mean by more than 1 %, of a variance by more than 10 %, and by more than 5 standard errors
 *     unreadable
 * The standard error is the smaller of two: that of the pixels' own differences, as they scatter over the tile (same seed: most noise
 * is in both), and, of the mean, that which both images state. Exit status 3 on wrong use. */
#include "renderer/image/moments.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SIDE = 16 };

struct change {
    double relative, t;
    bool significant;
};

static bool same_bits(const struct moments *a, const struct moments *b)
{
    size_t pixels = (size_t)a->width * (size_t)a->height, size = 3 * pixels * sizeof(double);
    return memcmp(a->n, b->n, pixels * sizeof(double)) == 0 &&
           memcmp(a->mean, b->mean, size) == 0 && memcmp(a->m2, b->m2, size) == 0 &&
           memcmp(a->m3, b->m3, size) == 0;
}

static double variance(const struct moments *m, size_t p, int c)
{
    return m->n[p] > 1 ? m->m2[3 * p + (size_t)c] / (m->n[p] - 1) : 0;
}

static double stated(const struct moments *m, size_t p, int c)
{
    return m->n[p] > 0 ? variance(m, p, c) / m->n[p] : 0;
}

/* Change of a tile in one channel: of the mean, or else of the variance of a sample. */
static struct change tile_change(const struct moments *a, const struct moments *b, int x0, int y0,
                                 int c, bool of_mean)
{
    double sum = 0, d = 0, d2 = 0, both = 0;
    int n = 0;
    for (int y = y0; y < y0 + SIDE && y < a->height; y++)
        for (int x = x0; x < x0 + SIDE && x < a->width; x++, n++) {
            size_t p = (size_t)y * (size_t)a->width + (size_t)x, i = 3 * p + (size_t)c;
            double va = of_mean ? a->mean[i] : variance(a, p, c),
                   vb = of_mean ? b->mean[i] : variance(b, p, c);
            sum += va;
            d += vb - va;
            d2 += (vb - va) * (vb - va);
            both += of_mean ? stated(a, p, c) + stated(b, p, c) : HUGE_VAL;
        }
    double scatter = n > 1 ? fmax(0, d2 - d * d / n) * n / (n - 1)
                           : HUGE_VAL; /* variance of the sum of differences */
    double se = sqrt(fmin(scatter, both)), relative = d == 0 ? 0 : fabs(d) / fmax(fabs(sum), 1e-30);
    double t = d == 0 ? 0 : fabs(d) / fmax(se, 1e-30);
    return (struct change){relative, t, t > 5 && relative > (of_mean ? 0.01 : 0.1)};
}

static void tell(const struct moments *a, const struct moments *b)
{
    if (a->width != b->width || a->height != b->height) {
        printf("1 1000 1 1000 1\n");
        return;
    }
    if (same_bits(a, b)) {
        printf("same\n");
        return;
    }
    struct change most[2] = {{0}};
    bool changed = false;
    for (int y = 0; y < a->height; y += SIDE)
        for (int x = 0; x < a->width; x += SIDE)
            for (int c = 0; c < 3; c++)
                for (int i = 0; i < 2; i++) {
                    struct change now = tile_change(a, b, x, y, c, i == 0);
                    changed |= now.significant;
                    if (now.t > most[i].t)
                        most[i] = now;
                }
    printf("%.4g %.4g %.4g %.4g %d\n", most[0].relative, most[0].t, most[1].relative, most[1].t,
           changed);
}

int main(int argc, char **argv)
{
    if (argc < 3 || argc % 2 == 0) {
        fprintf(stderr, "usage: image_change A.exr B.exr [A.exr B.exr ...]\n");
        return 3;
    }
    for (int i = 1; i < argc; i += 2) {
        struct moments a, b;
        struct err e;
        if (!moments_read(argv[i], &a, NULL, &e)) {
            printf("unreadable\n");
            continue;
        }
        if (moments_read(argv[i + 1], &b, NULL, &e)) {
            tell(&a, &b);
            moments_free(&b);
        } else
            printf("unreadable\n");
        moments_free(&a);
    }
    return 0;
}
