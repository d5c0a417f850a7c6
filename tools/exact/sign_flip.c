#include "sign_flip_score.h"

#include "tools/compare/region.h"
#include "tools/stats/distributions.h"

#include <assert.h>
#include <gsl/gsl_sf_erf.h>
#include <math.h>

enum { MAX_SIDES = 64 };
const char *const sign_flip_score_name[NUM_SIGN_FLIP_SCORES] = {"level", "mean", "spread"};
static const double share_of_score[NUM_SIGN_FLIP_SCORES] = {0.6, 0.25, 0.15};
static const double share_of_luminance = 0.6;
static const double bound_factor = 3.1787; /* 1/(4 Q(sqrt 2)), rounded up */
static const double berry_esseen = 0.56;   /* [Shevtsova10] */

struct scan {
    const struct sign_flip_options *opt;
    int filter;
    struct windows size[MAX_SIDES];
    int num_sizes;
    int tile_size; /* index into size[], for mdb_tile; -1: none */
    struct sign_flip *out;
};

/* log10 of the two-sided bound 2 c Q(t). */
static double log10_normal_bound(double t)
{
    return fmin(0, stats_t_log10_p(t, INFINITY) + log10(bound_factor));
}

/* ln of the smallest tilted bound over the l that Newton's search for the tilted mean t visits; t, and s / unit, are in
 * units of the root of the sum of squares. Every l gives a valid bound, so the search need not be exact. */
static double log_tilted_bound(const double *s, size_t num, double unit, double t)
{
    double best = 0, l = t;
    for (int i = 0; i < 30; i++) {
        double markov = -l * t, mean = 0, variance = 0, third = 0;
        for (size_t k = 0; k < num; k++) {
            double x = fabs(s[k]) / unit, y = l * x, h = tanh(y), v = x * x * (1 - h * h);
            markov += y + log1p(exp(-2 * y)) - M_LN2;
            mean += x * h;
            variance += v;
            third += x * v * (1 + h * h);
        }
        double sd = sqrt(variance), off = (mean - t) / sd, part = 1;
        if (variance > 0)
            part = exp(l * sd * (l * sd / 2 - off) + gsl_sf_log_erfc((l * sd - off) / M_SQRT2) -
                       M_LN2) +
                   2 * berry_esseen * third / (variance * sd);
        best = fmin(best, markov + log(fmin(1, part)));
        double next = variance > 0 ? l + (t - mean) / variance : INFINITY;
        next = fmax(l / 4, fmin(4 * l, next));
        if (fabs(next - l) <= 1e-6 * l)
            break;
        l = next;
    }
    return best;
}

double sign_flip_log10_p(const double *s, size_t num)
{
    double sum = 0, squares = 0;
    for (size_t k = 0; k < num; k++) {
        sum += s[k];
        squares += s[k] * s[k];
    }
    double unit = sqrt(squares), t = fabs(sum) / unit;
    double tilted = (M_LN2 + log_tilted_bound(s, num, unit, t)) / M_LN10;
    return fmin(0, fmin(log10_normal_bound(t), tilted));
}

static void list_sizes(const struct sheet *s, const struct sign_flip_options *opt,
                       struct scan *scan)
{
    int longest = s->width > s->height ? s->width : s->height, num = 0;
    double tile = fmax(1, (double)opt->tile / scan->filter);
    scan->tile_size = -1;
    for (int k = 4;
         num == 0 || scan->size[num - 1].width < s->width || scan->size[num - 1].height < s->height;
         k++) {
        int side = (int)lround(pow(2, k / 2.0));
        struct windows w = {side < s->width ? side : s->width, side < s->height ? side : s->height,
                            side < 8 ? 1 : side / 8, 0, 0};
        w.nx = (s->width - w.width + w.step - 1) / w.step + 1;
        w.ny = (s->height - w.height + w.step - 1) / w.step + 1;
        /* The smallest p is that of all n signs alike, 2^(1 - n). */
        double coins = (double)s->num * w.width * w.height;
        if ((coins - 1) * log10(2) < log10((double)w.nx * w.ny / opt->alpha) && side < longest)
            continue;
        assert(num < MAX_SIDES);
        scan->size[num++] = w;
        if (scan->tile_size < 0 && side >= tile)
            scan->tile_size = num - 1;
    }
    scan->num_sizes = num;
    if (scan->tile_size < 0)
        scan->tile_size = num - 1;
}

static double share_of(const struct scan *scan, const struct windows *w, enum sign_flip_score score,
                       int channel)
{
    double of_channel =
        channel < CHANNEL_LUMINANCE ? (1 - share_of_luminance) / 3 : share_of_luminance;
    if (score == SIGN_FLIP_SPREAD)
        of_channel = 1;
    return share_of_score[score] * of_channel / scan->num_sizes / (double)windows_num(w);
}

static void describe(const struct sheet *s, struct rect r, const struct scan *scan)
{
    double a = 0, b = 0, larger = 0, differ = 0;
    for (size_t v = 0; v < s->values; v++) {
        int x = (int)(v % s->pixels % (size_t)s->width),
            y = (int)(v % s->pixels / (size_t)s->width);
        if (x < r.x || x >= r.x + r.width || y < r.y || y >= r.y + r.height)
            continue;
        a += s->a[v];
        b += s->b[v];
        larger += s->a[v] > s->b[v];
        differ += s->a[v] != s->b[v];
    }
    int filter = scan->filter, x = r.x * filter, y = r.y * filter;
    int right = r.x + r.width < s->width ? x + r.width * filter : scan->out->width;
    int bottom = r.y + r.height < s->height ? y + r.height * filter : scan->out->height;
    scan->out->rect = (struct rect){x, y, right - x, bottom - y};
    scan->out->difference = b != 0 ? fmax(-1e6, fmin(1e6, (a - b) / fabs(b))) : copysign(1e6, a);
    scan->out->larger = larger / fmax(1, differ);
}

/* The window of this size with the largest |T| is found by summed-area tables and judged by sums of its own. */
static void scan_size(struct sheet *s, struct scan *scan, const struct windows *w,
                      enum sign_flip_score score, int channel)
{
    double largest = 0, all = s->sum[1][(size_t)(s->width + 1) * (size_t)(s->height + 1) - 1];
    struct rect best = {0};
    for (size_t i = 0; i < windows_num(w); i++) {
        struct rect r = windows_rect(w, s, i);
        double sum = sheet_sum(s, 0, r), squares = sheet_sum(s, 1, r);
        if (squares > sheet_lost_digits * all && sum * sum > largest * squares) {
            largest = sum * sum / squares;
            best = r;
        }
    }
    scan->out->num_tests += windows_num(w);
    size_t num = 0;
    double sum = 0, squares = 0;
    for (size_t v = 0; largest > 0 && v < s->values; v += s->pixels)
        for (int y = best.y; y < best.y + best.height; y++)
            for (int x = best.x; x < best.x + best.width; x++) {
                double one = s->score[v + (size_t)y * (size_t)s->width + (size_t)x];
                s->square[num++] = one;
                sum += one;
                squares += one * one;
            }
    if (!(squares > 0))
        return;
    double log10_p = sign_flip_log10_p(s->square, num) - log10(share_of(scan, w, score, channel));
    if (log10_p >= scan->out->log10_p)
        return;
    scan->out->log10_p = log10_p;
    scan->out->score = score;
    scan->out->channel = channel;
    scan->out->t = sum / sqrt(squares);
    describe(s, best, scan);
}

/* The smallest expected T of the windows if the level changes by `change`. */
static double expected_t(struct sheet *s, const struct windows *w, double change)
{
    sheet_expect(s, change);
    double smallest = INFINITY;
    for (size_t i = 0; i < windows_num(w); i++) {
        struct rect r = windows_rect(w, s, i);
        double squares = sheet_sum(s, 1, r);
        if (squares > 0)
            smallest = fmin(smallest, sheet_sum(s, 0, r) / sqrt(squares));
    }
    return smallest;
}

static double find_mdb(struct sheet *s, const struct scan *scan, const struct windows *w)
{
    double share = share_of(scan, w, SIGN_FLIP_LEVEL, CHANNEL_LUMINANCE);
    double t = stats_normal_quantile(scan->opt->alpha * share / (2 * bound_factor)) +
               stats_normal_quantile(0.05);
    double lo = log(1e-6), hi = log(1);
    if (!(expected_t(s, w, 1) >= t))
        return region_mdb_none;
    for (int i = 0; i < 14; i++) {
        double middle = (lo + hi) / 2;
        if (expected_t(s, w, exp(middle)) >= t)
            hi = middle;
        else
            lo = middle;
    }
    return exp(hi);
}

static void fill_mdb(struct sheet *s, const struct scan *scan, struct sign_flip *out)
{
    const struct windows *image = &scan->size[scan->num_sizes - 1],
                         *w = &scan->size[scan->tile_size];
    double tile = fmax(1, (double)scan->opt->tile / scan->filter);
    /* Of a window larger than the tile only a part changes. */
    double diluted = fmax(1, w->width / tile) * fmax(1, w->height / tile);
    out->mdb_global = find_mdb(s, scan, image);
    out->mdb_tile = fmin(region_mdb_none, diluted * find_mdb(s, scan, w));
}

bool sign_flip_test(const struct sign_flip_images *in, const struct sign_flip_options *opt,
                    struct sign_flip *out, struct err *e)
{
    int filter = opt->filter_width > 1 ? opt->filter_width : 1;
    assert(in->num > 0 && opt->filter_width >= 0);
    struct sheet s = {.width = (in->width + filter / 2) / filter,
                      .height = (in->height + filter / 2) / filter,
                      .num = in->num};
    struct scan scan = {.opt = opt, .filter = filter, .out = out};
    *out = (struct sign_flip){.log10_p = INFINITY, .width = in->width, .height = in->height};
    if (s.width < 1 || s.height < 1)
        return err_set(e, "an image of %d x %d pixels is smaller than the filter's %d", in->width,
                       in->height, filter);
    if (!sheet_alloc(&s, e))
        return false;
    out->num_pixels = s.pixels;
    list_sizes(&s, opt, &scan);
    for (int channel = 0; channel < NUM_CHANNELS; channel++) {
        sheet_load(&s, in, filter, channel);
        for (int score = 0; score < NUM_SIGN_FLIP_SCORES; score++) {
            if (score == SIGN_FLIP_SPREAD && channel < CHANNEL_LUMINANCE)
                continue;
            sheet_score(&s, score);
            for (int i = 0; i < scan.num_sizes; i++)
                scan_size(&s, &scan, &scan.size[i], score, channel);
            if (score == SIGN_FLIP_LEVEL && channel == CHANNEL_LUMINANCE) {
                if (opt->filter_width == 0 && !sheet_shares_noise(&s, &out->shares_noise, e)) {
                    sheet_free(&s);
                    return false;
                }
                fill_mdb(&s, &scan, out);
            }
        }
    }
    sheet_free(&s);
    if (isinf(out->log10_p))
        return err_set(e, "no pixel differs: were both made with one seed?");
    out->log10_p = fmin(0, out->log10_p);
    return true;
}
