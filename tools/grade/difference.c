#include "difference.h"

#include "tools/submission/rubric.h"
#include "tools/stats/distributions.h"

#include <math.h>
#include <stdlib.h>

static const double least_kappa = 0.05, overlap = 4, runs_shared = 1.5, channels_alike = 3,
                    floor_fraction = 0.25, missed = 0.25;
/* A tile's kappa with fewer degrees of freedom is not used; so many has the kappa of 1 that is
 * assumed where there are fewer than FEWEST second differences. */
static const double unknown_dof = 30;
static const double least_used = 0.25; /* of a tile, of the image */
enum { FEWEST = 60 };                  /* second differences */

double interval_distance(const struct interval *i)
{
    return fmax(0, fmax(i->lo, -i->hi));
}

double interval_half(const struct interval *i)
{
    return (i->hi - i->lo) / 2;
}

/* A pair of images being compared. */
struct pair {
    const struct submitted_image *a, *b;
    const unsigned char *use;
    const double *share; /* of each value in kappa; NULL: what its own noise and rounding say */
};

/* Weighted least squares of r^2 - c = kappa m with w = 1/(m + c)^2: sums of u = w m (r^2 - c) and v
 * = w m^2, so that kappa is u/v, and of their squares and product: the residuals u - kappa v have
 * the sum of squares uu - 2 kappa uv + kappa^2 vv. */
struct slope {
    double num, u, v, uu, uv, vv;
};

/* A square, clipped to the image. */
static struct rect within(const struct submitted_image *s, int x, int y, int side)
{
    int x0 = x < 0 ? 0 : x, y0 = y < 0 ? 0 : y, x1 = x + side, y1 = y + side;
    x1 = x1 > s->width ? s->width : x1;
    y1 = y1 > s->height ? s->height : y1;
    return (struct rect){x0, y0, x1 - x0, y1 - y0};
}

static bool all_used(const struct pair *p, int x, int y)
{
    int width = p->a->width;
    if (x < 1 || y < 1 || x >= width - 1 || y >= p->a->height - 1)
        return false;
    for (int k = 0; k < 9; k++)
        if (!p->use[(size_t)(y - 1 + k / 3) * (size_t)width + (size_t)(x - 1 + k % 3)])
            return false;
    return true;
}

/* A difference r with E[r^2] = kappa m + known + rounding. */
struct square {
    double r, m, known, rounding;
};

/* w m^2. 0 where rounding is larger than the noise, and r^2 says nothing of it: a flat area is rounded alike
 * everywhere. */
static double share_of(const struct square *q)
{
    const double ratio = q->m / (q->m + q->known + q->rounding);
    return q->m > q->rounding ? ratio * ratio : 0;
}

/* i: of which value. */
static void add_square(const struct pair *p, size_t i, const struct square *q, struct slope *s)
{
    const double share = p->share != NULL ? p->share[i] : share_of(q);
    if (share == 0)
        return;
    double weight = share / q->m, u = weight * (q->r * q->r - q->known - q->rounding), v = share;
    s->num++;
    s->u += u;
    s->v += v;
    s->uu += u * u;
    s->uv += u * v;
    s->vv += v * v;
}

/* Second difference of one channel at a pixel, with the variances that the image's planes give
 * it. */
struct second {
    double value, variance, rounding;
};

static struct second second_difference(const struct submitted_image *of, int x, int y, size_t c)
{
    static const double kernel[9] = {1 / 6.,  -2 / 6., 1 / 6.,  -2 / 6., 4 / 6.,
                                     -2 / 6., 1 / 6.,  -2 / 6., 1 / 6.};
    struct second s = {0};
    const double *w = kernel;
    for (int j = y - 1; j <= y + 1; j++) {
        size_t i = 3 * ((size_t)j * (size_t)of->width + (size_t)(x - 1)) + c;
        for (int k = 0; k < 3; k++, w++, i += 3) {
            s.value += *w * of->mean[i];
            s.variance += *w * *w * of->variance[i];
            s.rounding += *w * *w * of->rounding[i];
        }
    }
    return s;
}

static struct square square_at(const struct pair *p, int x, int y, size_t c)
{
    struct second a = second_difference(p->a, x, y, c), b = second_difference(p->b, x, y, c);
    double known = p->b->known ? b.variance : 0;
    return (struct square){a.value - b.value, a.variance + b.variance - known, known,
                           a.rounding + b.rounding};
}

/* Of runs k and k + 1 of A; errors that both have cancel. */
static struct square square_of_runs(const struct pair *p, int k, size_t i)
{
    const struct submitted_image *one = &p->a->run[k], *next = one + 1;
    return (struct square){one->mean[i] - next->mean[i], one->variance[i] + next->variance[i], 0,
                           one->rounding[i] + next->rounding[i]};
}

static size_t value_at(const struct pair *p, int x, int y, size_t c)
{
    return 3 * ((size_t)y * (size_t)p->a->width + (size_t)x) + c;
}

static void add_place(const struct pair *p, int x, int y, size_t c, struct slope *s)
{
    const struct square q = square_at(p, x, y, c);
    add_square(p, value_at(p, x, y, c), &q, s);
}

static void add_runs(const struct pair *p, int x, int y, size_t c, struct slope *s)
{
    const size_t i = value_at(p, x, y, c);
    for (int k = 0; k + 1 < p->a->num_runs; k++)
        if (!p->a->run[k].clipped[i] && !p->a->run[k + 1].clipped[i]) {
            const struct square q = square_of_runs(p, k, i);
            add_square(p, i, &q, s);
        }
}

static void add_slope(struct slope *to, const struct slope *s)
{
    to->num += s->num;
    to->u += s->u;
    to->v += s->v;
    to->uu += s->uu;
    to->uv += s->uv;
    to->vv += s->vv;
}

static bool has_runs(const struct pair *p)
{
    return p->a->num_runs > 1 && p->b->known;
}

static void add_places(const struct pair *p, struct rect r, struct slope *s)
{
    const bool runs = has_runs(p);
    for (int y = r.y; y < r.y + r.height; y++)
        for (int x = r.x; x < r.x + r.width; x++)
            if (runs ? p->use[(size_t)y * (size_t)p->a->width + (size_t)x] : all_used(p, x, y))
                for (size_t c = 0; c < 3; c++)
                    runs ? add_runs(p, x, y, c, s) : add_place(p, x, y, c, s);
}

struct noise {
    double kappa;
    double dof; /* of kappa as a variance */
    bool known;
};

static struct noise noise_by(const struct pair *p, const struct slope *s)
{
    if (s->num < FEWEST)
        return (struct noise){.kappa = 1, .dof = unknown_dof};
    struct noise n = {.kappa = fmax(least_kappa, s->u / s->v), .known = s->u > 0};
    double residual = fmax(0, s->uu - 2 * n.kappa * s->uv + n.kappa * n.kappa * s->vv);
    double variance =
        (has_runs(p) ? runs_shared : overlap) * channels_alike * residual / (s->v * s->v);
    n.dof = fmax(3, stats_dof(n.kappa, variance));
    return n;
}

static struct noise noise_in_image(const struct pair *p)
{
    struct slope s = {0};
    add_places(p, (struct rect){0, 0, p->a->width, p->a->height}, &s);
    return noise_by(p, &s);
}

/* Noise of the image, and of each whole tile pooled with the eight around it, by rows; the caller
 * frees *of_tile. */
static bool noises_of(const struct pair *p, struct noise *image, struct noise **of_tile,
                      struct err *e)
{
    const int columns = p->a->width / RUBRIC_TILE, rows = p->a->height / RUBRIC_TILE;
    /* All tiles, also partial ones at the right and the bottom. */
    const int across = (p->a->width + RUBRIC_TILE - 1) / RUBRIC_TILE,
              down = (p->a->height + RUBRIC_TILE - 1) / RUBRIC_TILE;
    struct slope *slope = calloc((size_t)across * (size_t)down, sizeof *slope);
    *of_tile = calloc((size_t)columns * (size_t)rows, sizeof **of_tile);
    if (slope == NULL || *of_tile == NULL) {
        free(slope);
        free(*of_tile);
        return err_set(e, "out of memory");
    }
    for (int t = 0; t < across * down; t++)
        add_places(p, within(p->a, t % across * RUBRIC_TILE, t / across * RUBRIC_TILE, RUBRIC_TILE),
                   &slope[t]);
    struct slope all = {0};
    for (int t = 0; t < across * down; t++)
        add_slope(&all, &slope[t]);
    *image = noise_by(p, &all);
    for (int t = 0; t < columns * rows; t++) {
        struct slope s = {0};
        for (int y = t / columns - 1; y <= t / columns + 1; y++)
            for (int x = t % columns - 1; x <= t % columns + 1; x++)
                if (x >= 0 && y >= 0 && x < across && y < down)
                    add_slope(&s, &slope[y * across + x]);
        (*of_tile)[t] = noise_by(p, &s);
    }
    free(slope);
    return true;
}

/* Sums over a region, one channel. */
struct sums {
    double d, b, v, k3, tolerance, used;
    double v2; /* where v is measured: sum of v^2 */
};

static double weighted(const double *x, int channel)
{
    return channel < CHANNEL_LUMINANCE ? x[channel] : luminance(x);
}

/* One channel, or for luminance (sum of w x^(1/power))^power: a bound for any correlation of the
 * channels (pyramid.h). */
static double weighted_root(const double *x, int channel, double power)
{
    double sum = 0;
    if (channel < CHANNEL_LUMINANCE)
        return x[channel];
    for (int c = 0; c < 3; c++)
        sum += luminance_weight[c] * copysign(pow(fabs(x[c]), 1 / power), x[c]);
    return copysign(pow(fabs(sum), power), sum);
}

/* Are variances measured from run to run: in both, or in A against a reference? */
static bool is_measured(const struct pair *p)
{
    return p->a->runs_dof > 0 && (p->b->known || p->b->runs_dof > 0);
}

static void add_pixel(const struct pair *p, size_t i, int channel, double kappa, struct sums *s)
{
    bool measured = is_measured(p);
    double v[3], k3[3], tolerance[3], of_b = p->b->known ? 1 : kappa;
    kappa = measured ? 1 : kappa;
    for (size_t c = 0; c < 3; c++) {
        size_t k = 3 * i + c;
        v[c] = kappa * p->a->variance[k] + of_b * p->b->variance[k] + p->a->rounding[k] +
               p->b->rounding[k];
        k3[c] = kappa * sqrt(kappa) * p->a->k3[k] - of_b * sqrt(of_b) * p->b->k3[k];
        tolerance[c] = p->a->tolerance[k] + p->b->tolerance[k];
    }
    s->used++;
    s->b += weighted(p->b->mean + 3 * i, channel);
    s->d += weighted(p->a->mean + 3 * i, channel) - weighted(p->b->mean + 3 * i, channel);
    if (measured) {
        double own = p->a->measured[4 * i + (size_t)channel],
               other = p->b->known ? weighted_root(p->b->variance + 3 * i, channel, 2)
                                   : p->b->measured[4 * i + (size_t)channel];
        s->v += own + other;
        s->v2 += own * own + (p->b->known ? 0 : other * other);
    } else {
        s->v += weighted_root(v, channel, 2);
    }
    s->k3 += weighted_root(k3, channel, 3);
    s->tolerance += weighted(tolerance, channel);
}

static struct sums sum_pixels(const struct pair *p, struct rect r, int channel, double kappa)
{
    struct sums s = {0};
    for (int y = r.y; y < r.y + r.height; y++)
        for (int x = r.x; x < r.x + r.width; x++) {
            size_t i = (size_t)y * (size_t)p->a->width + (size_t)x;
            if (p->use[i])
                add_pixel(p, i, channel, kappa, &s);
        }
    return s;
}

/* Student's t interval of s->d, relative to `unit`. alpha, two-sided, is divided by what skewness g
 * may do to the tail of a sum whose variance is known from elsewhere, exp(g x^3/6) (Cramer), at
 * most e. False: more than e; the interval is then Bernstein's for tails at most exponential, sd
 * (sqrt(2 t) + g/2 t) with t = ln(2/alpha). */
static bool interval_from(const struct sums *s, double unit, double dof, double alpha,
                          struct interval *out)
{
    double factor = 0, x = 0, sd = sqrt(s->v);
    for (int i = 0; i < 4 && sd > 0; i++) {
        x = stats_t_quantile(alpha / 2 * exp(-factor), dof);
        factor = fmin(1, fabs(s->k3) / (s->v * sd) * x * x * x / 6);
    }
    double g = sd > 0 ? fabs(s->k3) / (s->v * sd) : 0, t = log(2 / alpha);
    if (!(factor < 1))
        x = fmax(x, sqrt(2 * t)) + g / 2 * t;
    double half = x * sd + s->tolerance;
    *out = (struct interval){s->d / unit, (s->d - half) / unit, (s->d + half) / unit, sd / unit};
    return factor < 1;
}

/* Degrees of freedom of the sum v of measured variances (Satterthwaite): one with d of them has
 * E[v^2] = sigma^4 (1 + 2/d). */
static double measured_dof(const struct pair *p, const struct sums *s)
{
    double d = fmin(p->a->runs_dof, p->b->known ? INFINITY : p->b->runs_dof);
    return s->v2 > 0 ? fmax(3, (d + 2) * s->v * s->v / s->v2) : 1e6;
}

/* noise: of the tile pooled with its neighbours. */
static void measure_tile(const struct pair *p, struct rect r, struct noise noise,
                         const struct noise *whole, double floor, double alpha, double *furthest,
                         double *relative, struct difference *out)
{
    if (!noise.known || noise.dof < unknown_dof || noise.kappa <= whole->kappa)
        noise = *whole;
    struct sums s = sum_pixels(p, r, CHANNEL_LUMINANCE, noise.kappa);
    if (is_measured(p)) { /* rare samples may be missing in one tile */
        struct sums wide =
            sum_pixels(p, within(p->a, r.x - RUBRIC_TILE, r.y - RUBRIC_TILE, 3 * RUBRIC_TILE),
                       CHANNEL_LUMINANCE, noise.kappa);
        noise.dof = measured_dof(p, &s);
        s.v = fmax(s.v, missed * wide.v * s.b / fmax(wide.b, 1e-30));
    }
    struct interval interval;
    *relative = NAN;
    if (s.used < least_used * r.width * r.height)
        return;
    bool sure = interval_from(&s, fmax(s.b, floor * s.used), noise.dof, alpha, &interval);
    if (!sure && interval_distance(&interval) == 0)
        return;
    *relative = interval.value;
    out->tiles++;
    /* Among tiles that agree, the one whose interval reaches furthest. */
    double distance =
        interval_distance(&interval) + 1e-9 * fmax(fabs(interval.lo), fabs(interval.hi));
    if (distance <= *furthest)
        return;
    *furthest = distance;
    out->tile = interval;
    out->blur[NUM_CHANNELS] = s.tolerance / fmax(s.b, floor * s.used);
    out->tile_x = r.x;
    out->tile_y = r.y;
}

bool difference_measure(const struct submitted_image *a, const struct submitted_image *b,
                        const unsigned char *use, double alpha, struct difference *out,
                        struct err *e)
{
    const struct pair p = {a, b, use, NULL};
    const struct rect whole = {0, 0, a->width, a->height};
    int columns = a->width / RUBRIC_TILE, rows = a->height / RUBRIC_TILE;
    double pixels = (double)a->width * a->height, furthest = -1;
    *out = (struct difference){0};
    struct noise noise, *local;
    struct sums luminance = sum_pixels(&p, whole, CHANNEL_LUMINANCE, 1);
    out->compared = luminance.used / pixels;
    if (out->compared < least_used)
        return err_set(e, "only %.0f %% of the pixels can be compared, the others are saturated",
                       100 * out->compared);
    if (!(luminance.b > 0))
        return err_set(e, "there is no light to compare with");
    if (!noises_of(&p, &noise, &local, e))
        return false;
    out->kappa = noise.kappa;
    double floor = floor_fraction * luminance.b / luminance.used;
    alpha /= NUM_CHANNELS + columns * rows;
    for (int c = 0; c < NUM_CHANNELS; c++) {
        struct sums s = sum_pixels(&p, whole, c, noise.kappa);
        if (!interval_from(&s, fmax(s.b, floor * s.used),
                           is_measured(&p) ? measured_dof(&p, &s) : noise.dof, alpha,
                           &out->image[c]))
            out->skewed = true;
        out->blur[c] = s.tolerance / fmax(s.b, floor * s.used);
    }
    out->relative = calloc((size_t)columns * (size_t)rows, sizeof *out->relative);
    if (out->relative == NULL) {
        free(local);
        return err_set(e, "out of memory");
    }
    for (int i = 0; i < columns * rows; i++) {
        struct rect r = {i % columns * RUBRIC_TILE, i / columns * RUBRIC_TILE, RUBRIC_TILE,
                         RUBRIC_TILE};
        measure_tile(&p, r, local[i], &noise, floor, alpha, &furthest, &out->relative[i], out);
    }
    free(local);
    return true;
}

void difference_free(struct difference *a)
{
    free(a->relative);
    *a = (struct difference){0};
}

double difference_kappa(const struct submitted_image *a, const struct submitted_image *reference,
                        const unsigned char *use)
{
    const struct pair p = {a, reference, use, NULL};
    return noise_in_image(&p).kappa;
}

bool difference_kappas(const struct submitted_image *a, const struct submitted_image *reference,
                       const unsigned char *use, double *kappa, double *sd, struct err *e)
{
    const struct pair p = {a, reference, use, NULL};
    int tiles = a->width / RUBRIC_TILE * (a->height / RUBRIC_TILE);
    struct noise whole, *local;
    if (!noises_of(&p, &whole, &local, e))
        return false;
    *sd = sqrt(2 / whole.dof);
    for (int t = 0; t < tiles; t++)
        kappa[t] = local[t].known && local[t].dof >= unknown_dof ? local[t].kappa : whole.kappa;
    free(local);
    return true;
}

bool difference_correlated(const struct submitted_image *a, const struct submitted_image *b,
                           const struct submitted_image *reference, const unsigned char *use)
{
    static const double certain = 6; /* standard deviations */
    const struct pair p = {a, reference, use, NULL};
    double num = 0, ab = 0, aa = 0, bb = 0;
    for (int y = 0; y < a->height; y++)
        for (int x = 0; x < a->width; x++)
            for (size_t c = 0; c < 3 && all_used(&p, x, y); c++) {
                struct second u = second_difference(a, x, y, c), v = second_difference(b, x, y, c),
                              r = second_difference(reference, x, y, c);
                if (u.variance <= u.rounding || v.variance <= v.rounding)
                    continue;
                u.value -= r.value;
                v.value -= r.value;
                num++;
                ab += (u.value * v.value - r.variance) / sqrt(u.variance * v.variance);
                aa += u.value * u.value / u.variance;
                bb += v.value * v.value / v.variance;
            }
    return num >= FEWEST && ab > certain * sqrt(overlap * channels_alike / num * aa * bb);
}

bool difference_related(const struct submitted_image *s, const struct submitted_image *right,
                        const unsigned char *use)
{
    double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
    for (size_t i = 1; i < 3 * (size_t)s->width * (size_t)s->height; i += 3)
        if (use[i / 3]) {
            n++;
            a += s->mean[i];
            b += right->mean[i];
            aa += s->mean[i] * s->mean[i];
            bb += right->mean[i] * right->mean[i];
            ab += s->mean[i] * right->mean[i];
        }
    return n > 0 && ab - a * b / n > 5 * sqrt((aa - a * a / n) * (bb - b * b / n) / n);
}

/* Multiplies share[] by the shares that the values of a pair would have by themselves. */
static void take_shares(const struct pair *p, double *share)
{
    for (int y = 0; y < p->a->height; y++)
        for (int x = 0; x < p->a->width; x++)
            for (size_t c = 0; c < 3; c++) {
                const size_t i = value_at(p, x, y, c);
                struct square q = {0};
                if (has_runs(p) && p->use[i / 3])
                    q = square_of_runs(p, 0, i);
                else if (!has_runs(p) && all_used(p, x, y))
                    q = square_at(p, x, y, c);
                share[i] *= q.m > 0 ? share_of(&q) : 0;
            }
}

/* How many times as bright as the reference; 0 if either is black. */
static double brightness(const struct pair *p)
{
    const struct rect whole = {0, 0, p->a->width, p->a->height};
    const struct sums s = sum_pixels(p, whole, CHANNEL_LUMINANCE, 1);
    return s.b > 0 ? fmax(0, 1 + s.d / s.b) : 0;
}

bool difference_noise(const struct submitted_image *p, const struct submitted_image *reference_p,
                      const struct submitted_image *q, const struct submitted_image *reference_q,
                      const unsigned char *use, double alpha, struct interval *out, struct err *e)
{
    const size_t values = 3 * (size_t)p->width * (size_t)p->height;
    double *share = malloc(values * sizeof *share);
    if (share == NULL)
        return err_set(e, "out of memory");
    for (size_t i = 0; i < values; i++)
        share[i] = 1;
    /* The same for both: another method's noise is not ours times one factor, and of the image with fewer samples more
     * pixels have noise above rounding. */
    struct pair a = {p, reference_p, use, NULL}, b = {q, reference_q, use, NULL};
    take_shares(&a, share);
    take_shares(&b, share);
    a.share = b.share = share;
    struct noise na = noise_in_image(&a), nb = noise_in_image(&b);
    free(share);
    const double times = brightness(&a) / brightness(&b);
    if (!na.known || !nb.known || !isnormal(times))
        return err_set(e, "there is no noise in one of the images");
    /* Var ln v = 2/dof. */
    double sd = sqrt(2 / na.dof + 2 / nb.dof), value = log(na.kappa / nb.kappa / (times * times));
    double half = stats_normal_quantile(alpha / 2) * sd;
    *out = (struct interval){value, value - half, value + half, sd};
    return true;
}
