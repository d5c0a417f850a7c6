/* Per pixel and channel: n, mean, M2 = sum (x-mean)^2 and M3 = sum (x-mean)^3 over independent observations, in double;
 * two sets can be merged [Pebay08]. All comparisons work on these. An observation is a sample (of our renderer) or a
 * replicate (a whole image of an engine, with a seed of its own). */
#ifndef ASSAY_MOMENTS_H
#define ASSAY_MOMENTS_H

#include "image.h"
#include "renderer/math/vec.h"

struct moments {
    int width, height;
    double *n;    /* width*height; row 0 at the top */
    double *mean; /* 3 per pixel, RGB, linear radiance */
    double *m2;   /* 3 per pixel */
    double *m3;   /* 3 per pixel */
    /* What one observation is: "sample", "replicate", "exact" (a closed form: n = 1, M2 = M3 = 0, no
     * uncertainty), or "stratified" (a sample that is not independent of the pixel's others, so that
     * M2 tells nothing about the error of the mean). In comparisons also "picture": a mean of
     * unknown samples, with M2 estimated from neighbours (tools/stats/noise_estimate.h) and n without meaning. */
    char unit[16];
    double spp; /* paths per pixel in one observation; 0 where that has no meaning */
    /* Largest rounding error of the mean, on top of its noise, where the file's values were rounded: 3
     * per pixel, absolute, at worst in the same direction in all pixels. NULL: none. Never stored in a
     * file; moments_merge() refuses it. */
    double *tolerance;
    /* Of replicates whose pixels share noise: by how much M2 is larger than that of a pixel, so that it is right for sums
     * of many (reference/replicates/shared_noise.h). 0: they share none. */
    double sharing;
    /* The same as float32, in half the memory; n to m3 are then NULL. Only for comparisons, which read by
     * moments_n() to moments_m3(), moments_run() or moments_unpack(). */
    struct {
        float *n, *mean, *m2, *m3;
    } packed;
};

/* n of a pixel; mean, M2 and M3 at index i = 3 pixel + channel. For doubles and packed floats. */
static inline double moments_n(const struct moments *m, size_t pixel)
{
    return m->n != NULL ? m->n[pixel] : (double)m->packed.n[pixel];
}
static inline double moments_mean(const struct moments *m, size_t i)
{
    return m->n != NULL ? m->mean[i] : (double)m->packed.mean[i];
}
static inline double moments_m2(const struct moments *m, size_t i)
{
    return m->n != NULL ? m->m2[i] : (double)m->packed.m2[i];
}
static inline double moments_m3(const struct moments *m, size_t i)
{
    return m->n != NULL ? m->m3[i] : (double)m->packed.m3[i];
}

/* Allocates moments that are all zero, unit "sample", spp 1. Free with moments_free(). */
NODISCARD bool moments_alloc(struct moments *m, int width, int height, struct err *e);
void moments_free(struct moments *m);
/* Allocates a copy, without a tolerance. `from` must not be packed. */
NODISCARD bool moments_copy(const struct moments *from, struct moments *to, struct err *e);

/* Adds one observation of one pixel. */
void moments_add(struct moments *m, size_t pixel, const double x[3]);
/* Adds one observation of every pixel: a whole replicate (RGB, 3 floats a pixel). */
void moments_add_image(struct moments *m, const float *pixels_rgb);
/* dst += src, as if all observations had been added to dst [Pebay08 eq. 2.1]. Fails on different sizes,
 * units, spp or sharing, and on a tolerance. */
NODISCARD bool moments_merge(struct moments *dst, const struct moments *src, struct err *e);
/* A view of pixels first .. first+num-1, in the order of rows, as an image one pixel high for
 * moments_merge(). Owns nothing. */
struct moments moments_run(const struct moments *m, size_t first, int num);
/* A view of rows y .. y+num-1. Owns nothing. */
struct moments moments_rows(const struct moments *m, int y, int num);
/* Forgets the noise: the mean is what it is, of unit "exact". Not of packed moments. */
void moments_make_exact(struct moments *m);
/* Is the unit "exact", or "picture": a mean without noise, or with noise that nothing is known of? */
bool moments_is_exact(const struct moments *m);
bool moments_noise_is_unknown(const struct moments *m);
/* Variance of the pixel's mean, M2/(n(n-1)); NAN if n < 2 or stratified, 0 if exact. channel 0..2. */
double moments_var_of_mean(const struct moments *m, size_t pixel, int channel);

/* A moments EXR: channels R G B (the mean), M2.R M2.G M2.B, M3.R M3.G M3.B, n; text attributes
 * "assay:unit", "assay:spp", "assay:sharing" where there is any, and those given (tools/docs/formats/moments-exr.md). float32. */
NODISCARD bool moments_write(const char *path, const struct moments *m,
                             const struct image_attr *attrs, int num_attrs, struct err *e);
/* The same with the channels of `layers` (same size; NULL: none) after those. */
NODISCARD bool moments_write_layers(const char *path, const struct moments *m,
                                    const struct image *layers, const struct image_attr *attrs,
                                    int num_attrs, struct err *e);
/* The same for an image that is never in memory as a whole: moments of whole rows are written from
 * the top, a multiple of IMAGE_BAND at a time except for the last. */
struct moments_writer;
/* first: gives width, unit and spp; layers: gives names of more channels (NULL: none). NULL with a line on failure. */
NODISCARD struct moments_writer *moments_writer_open(const char *path, const struct moments *first,
                                                     int height, const struct image *layers,
                                                     const struct image_attr *attrs, int num_attrs,
                                                     struct err *e);
NODISCARD bool moments_writer_rows(struct moments_writer *w, const struct moments *m,
                                   const struct image *layers, struct err *e);
/* Both free the writer; the file appears with close. */
NODISCARD bool moments_writer_close(struct moments_writer *w, struct err *e);
void moments_writer_abandon(struct moments_writer *w);
/* Reads a moments EXR; the caller frees. If `image` is not NULL it receives the whole image, too, with
 * all channels and attributes. Fails with a line on a file that is not a moments EXR, on half floats,
 * NaN or infinity, negative M2 or n, or n not a whole number. */
NODISCARD bool moments_read(const char *path, struct moments *out, struct image *image,
                            struct err *e);
/* The same, packed. */
NODISCARD bool moments_read_packed(const char *path, struct moments *out, struct err *e);
/* Unpacks to doubles, in place. Fails only out of memory. */
NODISCARD bool moments_unpack(struct moments *m, struct err *e);

#endif
