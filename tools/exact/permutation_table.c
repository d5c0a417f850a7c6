#include "permutation_table.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_REGIONS = 1024 };

void permutation_table_free(struct permutation_table *t)
{
    free(t->z);
    free(t->rect);
    free(t->channel);
    *t = (struct permutation_table){0};
}

static int default_side(int width, int height)
{
    int side = 1;
    while (((width - 1) / side + 1) * ((height - 1) / side + 1) > MOST_REGIONS)
        side *= 2;
    return side;
}

/* Rectangles of one channel, finest first; *num counts them. rect NULL: only counts. */
static void list_rects(int width, int height, int side, struct rect *rect, size_t *num)
{
    *num = 0;
    for (bool last = false; !last; side *= 2) {
        last = side >= width && side >= height;
        for (int y = 0; y < height; y += side)
            for (int x = 0; x < width; x += side, (*num)++)
                if (rect != NULL)
                    rect[*num] = (struct rect){x, y, side < width - x ? side : width - x,
                                               side < height - y ? side : height - y};
    }
}

static double mean_in(const float *px, int width, struct rect r, int channel)
{
    double sum = 0;
    for (int y = r.y; y < r.y + r.height; y++)
        for (int x = r.x; x < r.x + r.width; x++) {
            const float *v = px + 3 * ((size_t)y * (size_t)width + (size_t)x);
            if (channel < CHANNEL_LUMINANCE)
                sum += v[channel];
            else
                for (int c = 0; c < 3; c++)
                    sum += luminance_weight[c] * v[c];
        }
    return sum / ((double)r.width * r.height);
}

static bool table_alloc(struct permutation_table *t, size_t num, struct err *e)
{
    size_t rows = (size_t)t->num_a + (size_t)t->num_b;
    t->num = num;
    /* NOLINTNEXTLINE(clang-analyzer-optin.portability.UnixAPI): there are rows and regions. */
    t->z = calloc((rows + 3) * num, sizeof *t->z);
    t->rect = malloc(num * sizeof *t->rect);
    t->channel = malloc(num * sizeof *t->channel);
    if (t->z == NULL || t->rect == NULL || t->channel == NULL)
        return err_set(e, "out of memory for %zu regions of %zu images", num, rows);
    t->mean[0] = t->z + rows * num;
    t->mean[1] = t->mean[0] + num;
    t->spread = t->mean[1] + num;
    return true;
}

static void standardise(struct permutation_table *t, size_t r)
{
    int rows = t->num_a + t->num_b;
    double centre = 0, squares = 0, largest = 0;
    for (int k = 0; k < rows; k++) {
        double v = t->z[(size_t)k * t->num + r];
        centre += v / rows;
        largest = fmax(largest, fabs(v));
        t->mean[k >= t->num_a][r] += v / (k < t->num_a ? t->num_a : t->num_b);
    }
    for (int k = 0; k < rows; k++)
        squares += pow(t->z[(size_t)k * t->num + r] - centre, 2);
    double spread = sqrt(squares);
    /* Sums of floats differ in the last place even where all images are alike. */
    t->spread[r] = spread > 1e-12 * largest * rows ? spread : 0;
    for (int k = 0; k < rows; k++) {
        double *z = &t->z[(size_t)k * t->num + r];
        *z = t->spread[r] > 0 ? (*z - centre) / spread : 0;
    }
}

static void table_fill(const struct replicate_dir *a, const struct replicate_dir *b,
                       struct permutation_table *t)
{
    for (int k = 0; k < a->num + b->num; k++) {
        const float *px = k < a->num ? a->rgb[k] : b->rgb[k - a->num];
        for (size_t r = 0; r < t->num; r++)
            t->z[(size_t)k * t->num + r] = mean_in(px, a->width, t->rect[r], t->channel[r]);
    }
    for (size_t r = 0; r < t->num; r++)
        standardise(t, r);
}

bool permutation_table_make(const struct replicate_dir *a, const struct replicate_dir *b,
                            int min_side, struct permutation_table *t, struct err *e)
{
    if (min_side == 0)
        min_side = default_side(a->width, a->height);
    *t = (struct permutation_table){.num_a = a->num, .num_b = b->num};
    size_t num;
    list_rects(a->width, a->height, min_side, NULL, &num);
    if (!table_alloc(t, NUM_CHANNELS * num, e))
        return false;
    for (int c = 0; c < NUM_CHANNELS; c++) {
        size_t first = (size_t)c * num;
        list_rects(a->width, a->height, min_side, t->rect + first, &num);
        for (size_t r = first; r < first + num; r++)
            t->channel[r] = c;
    }
    table_fill(a, b, t);
    return true;
}

bool permutation_table_make_one(const struct replicate_dir *a, const struct replicate_dir *b,
                                struct rect rect, int channel, struct permutation_table *t,
                                struct err *e)
{
    *t = (struct permutation_table){.num_a = a->num, .num_b = b->num};
    if (!table_alloc(t, 1, e))
        return false;
    t->rect[0] = rect;
    t->channel[0] = channel;
    table_fill(a, b, t);
    return true;
}
