#include "sign_flip_score.h"

#include "tools/stats/line_noise.h"

#include <gsl/gsl_cdf.h>
#include <math.h>
#include <stdlib.h>

enum { RADIUS = 4, BLOCK = 8 }; /* pixels: RADIUS of local means; BLOCK of sheet_shares_noise() */
enum { FEWEST_LINES = 16 };
static const double lines_alpha = 1e-6; /* of "lines share noise" where they do not */
/* Standard deviation of a normal law over the geometric mean of |x|: e^((ln 2 + gamma)/2). */
static const double of_geometric_mean = 1.8874;
const double sheet_lost_digits = 1e-10;

bool sheet_alloc(struct sheet *s, struct err *e)
{
    size_t sums = (size_t)(s->width + 1) * (size_t)(s->height + 1);
    s->pixels = (size_t)s->width * (size_t)s->height;
    s->values = s->pixels * (size_t)s->num;
    double *next = calloc(4 * s->values + 5 * s->pixels + 2 * sums, sizeof *next);
    if (next == NULL)
        return err_set(e, "out of memory for the scores of %d x %d pixels", s->width, s->height);
    double **of_values[] = {&s->a, &s->b, &s->score, &s->square};
    double **of_pixels[] = {&s->mean, &s->scale, &s->own, &s->work[0], &s->work[1]};
    for (int i = 0; i < 4; i++, next += s->values)
        *of_values[i] = next;
    for (int i = 0; i < 5; i++, next += s->pixels)
        *of_pixels[i] = next;
    for (int i = 0; i < 2; i++, next += sums)
        s->sum[i] = next;
    return true;
}

void sheet_free(struct sheet *s)
{
    free(s->a);
    *s = (struct sheet){0};
}

static double value(const float *pixel, int channel)
{
    if (channel < CHANNEL_LUMINANCE)
        return pixel[channel];
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += luminance_weight[c] * pixel[c];
    return sum;
}

/* Sums over the RADIUS pixels to both sides, `stride` apart. */
static void sum_line(const double *in, double *out, int num, size_t stride)
{
    for (int i = 0; i < num; i++) {
        double sum = 0;
        for (int j = i > RADIUS ? i - RADIUS : 0; j <= i + RADIUS && j < num; j++)
            sum += in[(size_t)j * stride];
        out[(size_t)i * stride] = sum;
    }
}

/* In place: sums over 9 x 9 pixels, cut at the border. */
static void sum_around(struct sheet *s, double *v)
{
    size_t w = (size_t)s->width;
    for (size_t y = 0; y < (size_t)s->height; y++)
        sum_line(v + y * w, s->work[0] + y * w, s->width, 1);
    for (size_t x = 0; x < w; x++)
        sum_line(s->work[0] + x, v + x, s->height, w);
}

/* work[1]: the number of values around a pixel. */
void sheet_load(struct sheet *s, const struct sign_flip_images *in, int filter, int channel)
{
    for (size_t i = 0; i < s->pixels; i++) {
        size_t x = i % (size_t)s->width * (size_t)filter + (size_t)(filter - 1) / 2;
        size_t y = i / (size_t)s->width * (size_t)filter + (size_t)(filter - 1) / 2;
        size_t from = 3 * (y * (size_t)in->width + x);
        s->mean[i] = 0;
        s->work[1][i] = 2 * s->num;
        for (int k = 0; k < s->num; k++) {
            size_t to = (size_t)k * s->pixels + i;
            s->a[to] = value(in->a[k] + from, channel);
            s->b[to] = value(in->b[k] + from, channel);
            s->mean[i] += s->a[to] + s->b[to];
        }
        if (in->error != NULL)
            s->own[i] = value(in->error + from, channel);
    }
    sum_around(s, s->mean);
    sum_around(s, s->work[1]);
    for (size_t i = 0; i < s->pixels; i++)
        s->mean[i] /= s->work[1][i];
}

/* Standard deviation of d around each pixel if it were normal, from the geometric mean of what is not 0. */
static void fill_scale(struct sheet *s, const double *d)
{
    for (size_t i = 0; i < s->pixels; i++) {
        s->scale[i] = s->work[1][i] = 0;
        for (size_t v = i; v < s->values; v += s->pixels)
            if (d[v] != 0) {
                s->scale[i] += log(fabs(d[v]));
                s->work[1][i]++;
            }
    }
    sum_around(s, s->scale);
    sum_around(s, s->work[1]);
    for (size_t i = 0; i < s->pixels; i++)
        s->scale[i] = of_geometric_mean * exp(s->scale[i] / fmax(1, s->work[1][i]));
}

/* For the level's score at a pixel: the scale that d is divided by, and the radiance. */
struct unit {
    double scale, mean;
};

static struct unit level_unit(const struct sheet *s, size_t v)
{
    size_t i = v % s->pixels;
    if (!(s->own[i] > 0))
        return (struct unit){s->scale[i], fabs(s->mean[i])};
    return (struct unit){sqrt(s->own[i] * sqrt(s->own[i] * s->scale[i])),
                         fabs(s->a[v] + s->b[v]) / 2};
}

/* f(x) of sign_flip.h: the score of Student's distribution with 8 degrees of freedom. */
static double student_score(double x)
{
    return x / (1 + x * x / 8);
}

static double level_score(struct unit u, double d)
{
    return sqrt(u.mean / u.scale) * student_score(d / u.scale);
}

/* Makes the summed-area tables, over all pairs of each pixel. */
static void sum_up(struct sheet *s)
{
    size_t row = (size_t)s->width + 1;
    for (size_t i = 0; i < s->pixels; i++) {
        double here[2] = {0};
        for (size_t v = i; v < s->values; v += s->pixels) {
            here[0] += s->score[v];
            here[1] += s->square[v];
        }
        size_t at = (i / (size_t)s->width + 1) * row + i % (size_t)s->width + 1;
        for (int k = 0; k < 2; k++)
            s->sum[k][at] =
                here[k] + s->sum[k][at - 1] + s->sum[k][at - row] - s->sum[k][at - row - 1];
    }
}

void sheet_score(struct sheet *s, enum sign_flip_score score)
{
    double *d = s->square; /* until it is scored */
    for (size_t v = 0; v < s->values; v++) {
        double m = s->mean[v % s->pixels];
        d[v] =
            score == SIGN_FLIP_SPREAD ? fabs(s->a[v] - m) - fabs(s->b[v] - m) : s->a[v] - s->b[v];
    }
    if (score != SIGN_FLIP_MEAN)
        fill_scale(s, d);
    for (size_t v = 0; v < s->values; v++) {
        s->score[v] = d[v];
        if (score == SIGN_FLIP_LEVEL)
            s->score[v] = level_score(level_unit(s, v), d[v]);
        else if (score == SIGN_FLIP_SPREAD)
            s->score[v] = student_score(d[v] / s->scale[v % s->pixels]);
        s->square[v] = s->score[v] * s->score[v];
    }
    sum_up(s);
}

void sheet_expect(struct sheet *s, double change)
{
    for (size_t v = 0; v < s->values; v++) {
        struct unit u = level_unit(s, v);
        double d = s->a[v] - s->b[v], shift = change * u.mean;
        double up = level_score(u, shift + d), down = level_score(u, shift - d);
        s->score[v] = (up + down) / 2;
        s->square[v] = (up * up + down * down) / 2;
    }
    sum_up(s);
}

/* Sums of one pair's products in the block at x, y. False if less than a fifth has the other sign, or most are 0. */
static bool block_products(const struct sheet *s, const double *score, int x, int y, double *sum,
                           double *squares)
{
    double mean = 0;
    int up = 0, down = 0, w = s->width;
    for (int i = 0; i < BLOCK * BLOCK; i++) {
        double v = score[(y + i / BLOCK) * w + x + i % BLOCK];
        mean += v / (BLOCK * BLOCK);
        up += v > 0;
        down += v < 0;
    }
    if (5 * (up < down ? up : down) < up + down || up + down < BLOCK)
        return false;
    *sum = *squares = 0;
    for (int i = 0; i < BLOCK * BLOCK; i++) {
        const double *v = score + (y + i / BLOCK) * w + x + i % BLOCK;
        double right = i % BLOCK + 1 < BLOCK ? (v[0] - mean) * (v[1] - mean) : 0;
        double below = i / BLOCK + 1 < BLOCK ? (v[0] - mean) * (v[w] - mean) : 0;
        *sum += right + below;
        *squares += right * right + below * below;
    }
    return true;
}

static bool neighbours_share_noise(const struct sheet *s)
{
    double all = 0, variance = 0, sum, squares;
    int blocks = 0, positive = 0;
    for (int k = 0; k < s->num; k++)
        for (int y = 0; y + BLOCK <= s->height; y += BLOCK)
            for (int x = 0; x + BLOCK <= s->width; x += BLOCK) {
                const double *score = s->score + (size_t)k * s->pixels;
                if (!block_products(s, score, x, y, &sum, &squares))
                    continue;
                blocks++;
                positive += sum > 0;
                all += sum;
                variance += squares;
            }
    return positive > 0.8 * blocks && all > 5 * sqrt(variance);
}

/* Of the rows or columns of all pairs; `lines` has room for three numbers a line. */
static bool lines_share_noise(const struct sheet *s, bool columns, double *lines)
{
    const int num = columns ? s->width : s->height, length = columns ? s->height : s->width;
    const size_t step = columns ? (size_t)s->width : 1, next = columns ? 1 : (size_t)s->width;
    double *square = lines + 2 * num;
    size_t squares = 0;
    for (int k = 0; k < s->num; k++) {
        double *sum = lines, *variance = lines + num;
        for (int i = 0; i < num; i++) {
            const double *score = s->score + (size_t)k * s->pixels + (size_t)i * next;
            sum[i] = variance[i] = 0;
            for (int j = 0; j < length; j++, score += step) {
                sum[i] += *score;
                variance[i] += *score * *score;
            }
        }
        squares += line_noise_squares(sum, variance, (size_t)num, square + squares);
    }
    if (squares < FEWEST_LINES)
        return false;
    double dof, ratio = line_noise_ratio(square, squares, &dof);
    return gsl_cdf_chisq_Q(dof * ratio, dof) < lines_alpha;
}

bool sheet_shares_noise(const struct sheet *s, bool *shares, struct err *e)
{
    const int longest = s->width > s->height ? s->width : s->height;
    double *lines = malloc(((size_t)s->num + 2) * (size_t)longest * sizeof *lines);
    if (lines == NULL)
        return err_set(e, "out of memory for %d lines", longest);
    *shares = neighbours_share_noise(s) || lines_share_noise(s, false, lines) ||
              lines_share_noise(s, true, lines) ||
              line_noise_begins_alike(s->score, s->num, s->width, s->height);
    free(lines);
    return true;
}

double sheet_sum(const struct sheet *s, int which, struct rect r)
{
    size_t row = (size_t)s->width + 1, top = (size_t)r.y * row + (size_t)r.x;
    size_t bottom = top + (size_t)r.height * row;
    const double *sum = s->sum[which];
    return sum[bottom + (size_t)r.width] - sum[bottom] - sum[top + (size_t)r.width] + sum[top];
}

size_t windows_num(const struct windows *w)
{
    return (size_t)w->nx * (size_t)w->ny;
}

struct rect windows_rect(const struct windows *w, const struct sheet *s, size_t i)
{
    int x = (int)(i % (size_t)w->nx) * w->step, y = (int)(i / (size_t)w->nx) * w->step;
    return (struct rect){x + w->width < s->width ? x : s->width - w->width,
                         y + w->height < s->height ? y : s->height - w->height, w->width,
                         w->height};
}
