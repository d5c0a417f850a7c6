#include "rate_image.h"

#include "renderer/pathtracer/output.h"
#include "tools/images/image_file.h"

#include <math.h>

/* A step of one batch moves one of the colours by 510 batch/most codes. */
enum { MOST_BATCHES = 64 };
static const double codes_of_all = 510, rounding = 2;

static double distance(const float *px, const uint8_t code[3])
{
    double d = 0;
    for (int c = 0; c < 3; c++)
        d = fmax(d, fabs(255 * (double)px[c] - code[c]));
    return d;
}

static bool read_file(const char *path, const struct rubric_image *p, struct image_file *out,
                      struct err *e)
{
    struct image_info info;
    if (!image_inspect(path, &info, e))
        return false;
    if (info.width != p->width || info.height != p->height)
        return err_set(e, "it is %d x %d pixels, not %d x %d", info.width, info.height, p->width,
                       p->height);
    return image_file_read_inspected(path, &info, out, e);
}

bool rate_image_counts(const char *path, const struct rubric_image *p, double *count, struct err *e)
{
    struct image_file pic;
    if (!read_file(path, p, &pic, e))
        return false;
    for (size_t i = 0; i < (size_t)p->width * (size_t)p->height; i++) {
        const float *px = pic.rgb + 3 * i;
        double rate = px[0] > px[2] ? (1 + (double)px[0]) / 2 : (1 - (double)px[2]) / 2;
        count[i] = fmax(1, rate * p->spp);
    }
    image_file_free(&pic);
    return true;
}

bool rate_image_read(const char *path, const struct rubric_image *p, int batch,
                     const struct moments *ours, struct rate_image *out, struct err *e)
{
    const int most = p->spp;
    struct image_file pic;
    double expected = 0, squares = 0;
    *out = (struct rate_image){0};
    if (most / batch > MOST_BATCHES)
        return err_set(e, "%d batches of %d cannot be told apart by 8 bits", most / batch, batch);
    if (!read_file(path, p, &pic, e))
        return false;
    /* One sample is allowed, as the assignment leaves open whether the last one counts; but batches
     * have to be told apart. */
    double allowed =
        fmin(rounding + codes_of_all / most, fmax(rounding, codes_of_all * batch / most / 4));
    for (size_t i = 0; i < (size_t)p->width * (size_t)p->height; i++) {
        int nearest = 0;
        double least = INFINITY;
        for (int n = batch; n <= most + batch - 1; n += batch) {
            uint8_t code[3];
            int count = n < most ? n : most;
            rate_colour((double)count / most, code);
            double d = distance(pic.rgb + 3 * i, code);
            if (d < least) {
                least = d;
                nearest = count;
            }
        }
        out->pixels++;
        out->odd += least > allowed;
        out->early += nearest < most;
        out->mean += nearest;
        expected += ours->n[i];
        squares += pow(nearest - ours->n[i], 2);
    }
    out->more = out->mean / expected - 1;
    double difference = (out->mean - expected) / out->pixels;
    out->sd = sqrt(fmax(0, squares / out->pixels - difference * difference) / out->pixels) *
              out->pixels / expected;
    out->mean /= out->pixels;
    image_file_free(&pic);
    return true;
}
