#include "flip.h"

#include "flip_colour.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FEATURE_SIZE 0.082f /* degrees between the flanks of the edge detector's lobes */
enum { MAX_TERMS = 2, NUM_CHANNELS = 3 };

/* Contrast sensitivity a exp(-b f^2) at f cycles per degree; its inverse Fourier transform a sqrt(pi/b)
 * exp(-(pi x)^2/b) is the filter's kernel. */
struct gaussian {
    double a, b;
};
static const struct gaussian csf[NUM_CHANNELS][MAX_TERMS] = {
    {{1, 0.0047}, {0, 1}}, {{1, 0.0053}, {0, 1}}, {{34.1, 0.04}, {13.5, 0.025}}};
#define WIDEST_CSF 0.04

static float clamp01(float v)
{
    return v > 0 ? (v < 1 ? v : 1) : 0; /* NaN becomes 0 */
}

/* Kernels have 2 radius + 1 weights. */
struct kernel {
    int radius;
    float *weight;
};

static bool kernel_alloc(struct kernel *k, int radius)
{
    k->radius = radius;
    k->weight = calloc(2 * (size_t)radius + 1, sizeof *k->weight);
    return k->weight != NULL;
}

int flip_csf_radius(double ppd)
{
    return (int)ceil(3 * sqrt(WIDEST_CSF / (2 * M_PI * M_PI)) * ppd);
}

/* One term of a channel along one axis, not normalised, x in pixels. */
static double csf_term(const struct gaussian *g, double ppd, double x)
{
    double degrees = x / ppd;
    return exp(-M_PI * M_PI * degrees * degrees / g->b);
}

static double csf_term_sum(const struct gaussian *g, double ppd)
{
    double sum = 0;
    int r = flip_csf_radius(ppd);
    for (int x = -r; x <= r; x++)
        sum += csf_term(g, ppd, x);
    return sum;
}

/* Share of a term in its channel, over both axes: the weight of its normalised kernel. */
static double csf_share(enum flip_channel channel, int term, double ppd)
{
    double all = 0, one = 0;
    for (int t = 0; t < MAX_TERMS; t++) {
        const struct gaussian *g = &csf[channel][t];
        double line = csf_term_sum(g, ppd), w = g->a * sqrt(M_PI / g->b) * line * line;
        all += w;
        one = t == term ? w : one;
    }
    return one / all;
}

double flip_csf(enum flip_channel channel, double ppd, int x, int y)
{
    double w = 0;
    for (int t = 0; t < MAX_TERMS; t++) {
        const struct gaussian *g = &csf[channel][t];
        double line = csf_term_sum(g, ppd);
        w += csf_share(channel, t, ppd) * csf_term(g, ppd, x) * csf_term(g, ppd, y) / (line * line);
    }
    return w;
}

/* The order-th derivative of a Gaussian, scaled so that weights of each sign sum to +-1 (order 0: all to 1). */
static bool make_feature_kernel(int order, double ppd, struct kernel *k)
{
    double sigma = 0.5 * (double)FEATURE_SIZE * ppd, positive = 0, negative = 0;
    int r = (int)ceil(3 * sigma);
    if (!kernel_alloc(k, r))
        return false;
    for (int pass = 0; pass < 2; pass++)
        for (int x = -r; x <= r; x++) {
            double u = x / sigma, w = exp(-u * u / 2);
            w *= order == 0 ? 1 : order == 1 ? -u : u * u - 1;
            if (pass == 0)
                *(w > 0 ? &positive : &negative) += fabs(w);
            else
                k->weight[x + r] = (float)(w / (w > 0 ? positive : fmax(negative, 1e-300)));
        }
    return true;
}

/* Kernels and buffers for images of one size. */
struct flip {
    int width, height;
    size_t pixels;
    struct flip_colours colours;
    struct kernel csf[NUM_CHANNELS][MAX_TERMS]; /* along one axis; no weights where the term is 0 */
    float share[NUM_CHANNELS][MAX_TERMS];
    struct kernel feature[3]; /* by order */
    float *line;              /* a padded row; the buffers below follow it in the same memory */
    float *rgb[2], *plane;    /* 3 a pixel; rgb: after filtering, Hunt-adjusted Lab */
    float *edge[2], *point[2], *out, *sum;
};

static void flip_free(struct flip *f)
{
    for (int c = 0; c < NUM_CHANNELS; c++)
        for (int t = 0; t < MAX_TERMS; t++)
            free(f->csf[c][t].weight);
    for (int i = 0; i < 3; i++)
        free(f->feature[i].weight);
    free(f->line);
}

static bool make_csf_kernels(struct flip *f, double ppd)
{
    for (int c = 0; c < NUM_CHANNELS; c++)
        for (int t = 0; t < MAX_TERMS; t++) {
            const struct gaussian *g = &csf[c][t];
            struct kernel *k = &f->csf[c][t];
            if (!(g->a > 0))
                continue;
            f->share[c][t] = (float)csf_share((enum flip_channel)c, t, ppd);
            double sum = csf_term_sum(g, ppd);
            if (!kernel_alloc(k, flip_csf_radius(ppd)))
                return false;
            for (int x = -k->radius; x <= k->radius; x++)
                k->weight[x + k->radius] = (float)(csf_term(g, ppd, x) / sum);
        }
    return true;
}

static bool flip_start(struct flip *f, int width, int height, double ppd, struct err *e)
{
    size_t pixels = (size_t)width * (size_t)height;
    *f = (struct flip){
        .width = width, .height = height, .pixels = pixels, .colours = flip_colours()};
    assert(width > 0 && height > 0 && ppd > 0);
    bool ok = make_csf_kernels(f, ppd);
    int widest = flip_csf_radius(ppd);
    for (int i = 0; ok && i < 3; i++) {
        ok = make_feature_kernel(i, ppd, &f->feature[i]);
        widest = f->feature[i].radius > widest ? f->feature[i].radius : widest;
    }
    const size_t length = (size_t)width + 2 * (size_t)widest;
    f->line = ok ? malloc((length + 15 * pixels) * sizeof *f->line) : NULL;
    if (f->line == NULL) {
        flip_free(f);
        return err_set(e, "out of memory for FLIP");
    }
    f->plane = f->line + length;
    f->out = f->plane + 3 * pixels;
    f->sum = f->out + pixels;
    for (int i = 0; i < 2; i++) {
        f->rgb[i] = f->sum + pixels + (size_t)i * 5 * pixels;
        f->edge[i] = f->rgb[i] + 3 * pixels;
        f->point[i] = f->edge[i] + pixels;
    }
    return true;
}

static void filter_rows(struct flip *f, const struct kernel *k, const float *in, float *out)
{
    int r = k->radius, w = f->width;
    for (int y = 0; y < f->height; y++, in += w, out += w) {
        for (int x = -r; x < w + r; x++)
            f->line[x + r] = in[x < 0 ? 0 : x < w ? x : w - 1];
        memset(out, 0, (size_t)w * sizeof *out);
        for (int i = 0; i <= 2 * r; i++) {
            float weight = k->weight[i];
            const float *from = f->line + i;
            for (int x = 0; x < w; x++)
                out[x] += weight * from[x];
        }
    }
}

static void filter_columns(const struct flip *f, const struct kernel *k, const float *in,
                           float *out)
{
    int r = k->radius, w = f->width, h = f->height;
    for (int y = 0; y < h; y++) {
        float *row = out + (size_t)y * (size_t)w;
        memset(row, 0, (size_t)w * sizeof *row);
        for (int i = -r; i <= r; i++) {
            int from_y = y + i < 0 ? 0 : y + i < h ? y + i : h - 1;
            const float *from = in + (size_t)from_y * (size_t)w;
            float weight = k->weight[i + r];
            for (int x = 0; x < w; x++)
                row[x] += weight * from[x];
        }
    }
}

/* Filters an opponent-colour channel by its contrast sensitivity, in place. */
static void see_channel(struct flip *f, int channel, float *plane)
{
    memset(f->sum, 0, f->pixels * sizeof *f->sum);
    float *rows = f->edge[0]; /* not in use yet */
    for (int t = 0; t < MAX_TERMS; t++) {
        const struct kernel *k = &f->csf[channel][t];
        if (k->weight == NULL)
            continue;
        filter_rows(f, k, plane, rows);
        filter_columns(f, k, rows, f->out);
        for (size_t i = 0; i < f->pixels; i++)
            f->sum[i] += f->share[channel][t] * f->out[i];
    }
    memcpy(plane, f->sum, f->pixels * sizeof *plane);
}

/* Filters rgb[side] as the eye does and converts it to Hunt-adjusted Lab. The planes are Y, X - Y and Y - Z relative to
 * white: the opponent space YCxCz without its scale factors, which do not matter to linear filters. */
static void see(struct flip *f, int side)
{
    float *y = f->plane, *cx = y + f->pixels, *cz = cx + f->pixels;
    for (size_t i = 0; i < f->pixels; i++) {
        float xyz[3];
        flip_multiply(f->colours.to, &f->rgb[side][3 * i], xyz);
        y[i] = xyz[1];
        cx[i] = xyz[0] - xyz[1];
        cz[i] = xyz[1] - xyz[2];
    }
    see_channel(f, FLIP_ACHROMATIC, y);
    see_channel(f, FLIP_RED_GREEN, cx);
    see_channel(f, FLIP_BLUE_YELLOW, cz);
    for (size_t i = 0; i < f->pixels; i++) {
        float xyz[3] = {y[i] + cx[i], y[i], y[i] - cz[i]}, rgb[3];
        flip_multiply(f->colours.from, xyz, rgb);
        for (int c = 0; c < 3; c++)
            rgb[c] = clamp01(rgb[c]);
        flip_lab(&f->colours, rgb, &f->rgb[side][3 * i]);
    }
}

/* Magnitude of the order-th derivative of Y: 1 detects edges, 2 points. */
static void detect(struct flip *f, int order, const float *y, float *out)
{
    float *rows = f->out, *dy = f->sum;
    filter_rows(f, &f->feature[order], y, rows);
    filter_columns(f, &f->feature[0], rows, out);
    filter_rows(f, &f->feature[0], y, rows);
    filter_columns(f, &f->feature[order], rows, dy);
    for (size_t i = 0; i < f->pixels; i++)
        out[i] = sqrtf(out[i] * out[i] + dy[i] * dy[i]);
}

/* Both rgb[] are filled, in [0, 1]. */
static void compare(struct flip *f, float *map)
{
    /* see() overwrites edge[0] and rgb, so Y is saved first and the features are detected last. */
    float *y[2] = {f->point[0], f->point[1]};
    for (int s = 0; s < 2; s++)
        for (size_t i = 0; i < f->pixels; i++) {
            float xyz[3];
            flip_multiply(f->colours.to, &f->rgb[s][3 * i], xyz);
            y[s][i] = xyz[1];
        }
    see(f, 0);
    see(f, 1);
    for (int s = 0; s < 2; s++) {
        detect(f, 1, y[s], f->edge[s]);
        detect(f, 2, y[s], f->plane);
        memcpy(f->point[s], f->plane, f->pixels * sizeof *f->plane);
    }
    for (size_t i = 0; i < f->pixels; i++) {
        float colour = flip_colour_error(&f->colours, &f->rgb[0][3 * i], &f->rgb[1][3 * i]);
        float edge = fabsf(f->edge[0][i] - f->edge[1][i]);
        float point = fabsf(f->point[0][i] - f->point[1][i]);
        float feature = sqrtf(fminf(fmaxf(edge, point) * (float)M_SQRT1_2, 1));
        map[i] = powf(colour, 1 - feature);
    }
}

bool flip_ldr(const double *reference, const double *test, int width, int height, double ppd,
              float *map, struct err *e)
{
    struct flip f;
    if (!flip_start(&f, width, height, ppd, e))
        return false;
    for (size_t i = 0; i < 3 * f.pixels; i++) {
        f.rgb[0][i] = clamp01((float)reference[i]);
        f.rgb[1][i] = clamp01((float)test[i]);
    }
    compare(&f, map);
    flip_free(&f);
    return true;
}

double flip_mean(const float *map, size_t pixels)
{
    double sum = 0;
    for (size_t i = 0; i < pixels; i++)
        sum += (double)map[i];
    return sum / (double)pixels;
}
