#include "third_moment.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { REACH = 8, FEWEST = 16 };
/* Variance of a sum of products of second differences over the sum of their squares, 3.78, rounded up: the sum of the
 * squared correlations with neighbours, which are 1, -2/3 and 1/6 per direction. */
static const double overlap = 4;
static const double num_errors = 1; /* standard errors that are added */

/* One channel: A - B, the variances of the two means, and second differences. */
struct field {
    int width, height;
    double *d, *v[2], *product; /* product: of second differences, of d and of v[0] + v[1] */
};

/* What a window holds. */
struct sums {
    double num;               /* of pixels that vary */
    double pair, square;      /* of (vA - vB)^2, (vA + vB)^2 */
    double product, product2; /* and of its square */
    double cube;              /* of (vA + vB)^1.5 where there are second differences */
};

static bool field_alloc(struct field *f, int width, int height, struct err *e)
{
    size_t pixels = (size_t)width * (size_t)height;
    *f = (struct field){.width = width, .height = height, .d = malloc(4 * pixels * sizeof(double))};
    f->v[0] = f->d + pixels;
    f->v[1] = f->v[0] + pixels;
    f->product = f->v[1] + pixels;
    return f->d != NULL ||
           err_set(e, "out of memory for the variances of %d x %d pixels", width, height);
}

static size_t index_of(const struct field *f, int x, int y)
{
    return (size_t)y * (size_t)f->width + (size_t)x;
}

static bool is_inner(const struct field *f, int x, int y)
{
    return x > 0 && y > 0 && x < f->width - 1 && y < f->height - 1;
}

/* Kernel (1 -2 1) x (1 -2 1)/6, whose squares sum to 1, on A - B and on vA + vB: the product's mean is k3A - k3B. */
static double product_at(const struct field *f, int x, int y)
{
    static const double weight[3] = {1, -2, 1};
    double d = 0, v = 0;
    for (int j = 0; j < 3; j++)
        for (int i = 0; i < 3; i++) {
            size_t p = index_of(f, x + i - 1, y + j - 1);
            d += weight[i] * weight[j] * f->d[p];
            v += weight[i] * weight[j] * (f->v[0][p] + f->v[1][p]);
        }
    return d * v / 36;
}

static void fill_variance(const struct moments *m, int c, double *v)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    for (size_t p = 0; p < pixels; p++)
        v[p] = moments_var_of_mean(m, p, c);
}

static void field_fill(struct field *f, const struct moments *a, const struct moments *b, int c)
{
    size_t pixels = (size_t)f->width * (size_t)f->height;
    for (size_t p = 0; p < pixels; p++)
        f->d[p] = a->mean[3 * p + (size_t)c] - b->mean[3 * p + (size_t)c];
    fill_variance(a, c, f->v[0]);
    fill_variance(b, c, f->v[1]);
    for (int y = 0; y < f->height; y++)
        for (int x = 0; x < f->width; x++)
            f->product[index_of(f, x, y)] = is_inner(f, x, y) ? product_at(f, x, y) : 0;
}

static void sums_add(struct sums *to, const struct sums *s)
{
    to->num += s->num;
    to->pair += s->pair;
    to->square += s->square;
    to->product += s->product;
    to->product2 += s->product2;
    to->cube += s->cube;
}

static struct sums pixel_sums(const struct field *f, int x, int y)
{
    size_t p = index_of(f, x, y);
    double a = f->v[0][p], b = f->v[1][p];
    return (struct sums){
        .num = a + b > 0,
        .pair = (a - b) * (a - b),
        .square = (a + b) * (a + b),
        .product = f->product[p],
        .product2 = f->product[p] * f->product[p],
        .cube = is_inner(f, x, y) ? (a + b) * sqrt(a + b) : 0,
    };
}

static int larger(int a, int b)
{
    return a > b ? a : b;
}

/* Sums of each column over the rows around y. */
static void fill_columns(const struct field *f, int y, int reach, struct sums *column)
{
    memset(column, 0, (size_t)f->width * sizeof *column);
    for (int j = larger(0, y - reach); j <= y + reach && j < f->height; j++)
        for (int x = 0; x < f->width; x++) {
            struct sums s = pixel_sums(f, x, j);
            sums_add(&column[x], &s);
        }
}

static struct sums window_at(const struct field *f, int x, int reach, const struct sums *column)
{
    struct sums sum = {0};
    for (int i = larger(0, x - reach); i <= x + reach && i < f->width; i++)
        sums_add(&sum, &column[i]);
    return sum;
}

/* *part: the bound of |k3A - k3B| over (vA + vB)^1.5; *root: the standard deviation of vA + vB over vA + vB. No bound
 * is lower than the standard error of third moments of n observations per pixel for a normal distribution. */
static void bound(const struct sums *window, const struct sums *own, double n, double *part,
                  double *root)
{
    *part = *root = 1;
    if (window->num < FEWEST || !(own->square > 0))
        return;
    *root = sqrt(fmax(window->pair / window->square, own->pair / own->square));
    double most = fabs(window->product) + num_errors * sqrt(overlap * window->product2);
    *part =
        fmax(sqrt(6 / window->num) / n, fmin(*root, window->cube > 0 ? most / window->cube : 1));
}

static void set_third(struct moments *m, size_t p, int c, double k3)
{
    double n = m->n[p];
    m->m3[3 * p + (size_t)c] = k3 * n * (n - 1) * (n - 2);
}

static double third(const struct moments *m, size_t p, int c)
{
    double n = m->n[p];
    return moments_is_exact(m) ? 0 : m->m3[3 * p + (size_t)c] / (n * (n - 1) * (n - 2));
}

/* pyramid_estimate_from() takes k3^2/v for the variance of v: what is added to both k3 cancels in k3A - k3B and
 * supplies the rest of that. */
static void set_pixel(const struct field *f, struct moments *a, struct moments *b, bool lacks_a,
                      bool lacks_b, size_t p, int c, double part, double root)
{
    double va = f->v[0][p], vb = f->v[1][p], v = va + vb, k = part * v * sqrt(v);
    double common = sqrt(fmax(0, root * root - part * part) * v * va * vb);
    if (lacks_a && lacks_b) {
        set_third(a, p, c, v > 0 ? common + k * va / v : 0);
        set_third(b, p, c, v > 0 ? common - k * vb / v : 0);
    } else if (lacks_a) {
        set_third(a, p, c, va > 0 ? third(b, p, c) + k : 0);
    } else {
        set_third(b, p, c, vb > 0 ? third(a, p, c) - k : 0);
    }
}

static void bound_row(const struct field *f, struct moments *a, struct moments *b, bool lacks_a,
                      bool lacks_b, int c, int y, const struct sums *image, struct sums *column)
{
    fill_columns(f, y, REACH, column);
    for (int x = 0; x < f->width; x++) {
        struct sums own = pixel_sums(f, x, y), window = window_at(f, x, REACH, column);
        if (window.num < FEWEST)
            window = *image;
        double part, root;
        size_t p = index_of(f, x, y);
        bound(&window, &own, lacks_a ? a->n[p] : b->n[p], &part, &root);
        set_pixel(f, a, b, lacks_a, lacks_b, p, c, part, root);
    }
}

bool third_moment_bound(struct moments *a, struct moments *b, bool lacks_a, bool lacks_b,
                        struct err *e)
{
    struct field f;
    struct sums *column = malloc((size_t)a->width * sizeof *column);
    bool ok = field_alloc(&f, a->width, a->height, e);
    if (ok && column == NULL)
        ok = err_set(e, "out of memory for the variances of %d pixels", a->width);
    for (int c = 0; ok && c < 3; c++) {
        field_fill(&f, a, b, c);
        fill_columns(&f, 0, f.height, column);
        struct sums image = window_at(&f, 0, f.width, column);
        for (int y = 0; y < f.height; y++)
            bound_row(&f, a, b, lacks_a, lacks_b, c, y, &image, column);
    }
    free(f.d);
    free(column);
    return ok;
}
