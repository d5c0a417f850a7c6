/* The images that an engine's reference is folded from: files of float32 R, G and B. For Cycles they are the
 * replicates; for POV-Ray the windows and then, unless the scene has no noise, what each replicate adds to them
 * (povray_replicate_parts.h). An image depends only on its number and the common seed, not on which others are made. */
#ifndef ASSAY_REPLICATE_IMAGES_H
#define ASSAY_REPLICATE_IMAGES_H

#include "renderer/base/err.h"

#include <stddef.h>
#include <stdint.h>

enum { REPLICATE_IMAGE_PATH = 4096 + 64 };

/* Tells the file of image k. */
struct replicate_images {
    void (*path_of)(const void *ctx, int k, char path[REPLICATE_IMAGE_PATH]);
    const void *ctx;
};

/* "DIR/PREFIX_0007.exr" */
void replicate_images_path(const char *dir, const char *prefix, int number,
                           char path[REPLICATE_IMAGE_PATH]);
/* Packed RGB of width x height; the caller frees. NULL with a line on another size, on half floats, and on values that are
 * not finite or, without `below_zero`, negative. */
NODISCARD float *replicate_images_read(const char *path, int width, int height, bool below_zero,
                                       struct err *e);
/* The same for any format that image_read() takes, with values multiplied by scale; sets *half if the file has fewer
 * than 32 bits, never clears it. Values may be negative (spectral renderers have colours outside the gamut); only
 * the mean has to make sense. */
NODISCARD float *replicate_images_read_any(const char *path, int width, int height, double scale,
                                           bool *half, struct err *e);
/* Writes an image as float32 EXR, bit for bit, atomically (by rename). */
NODISCARD bool replicate_images_write(const char *path, int width, int height,
                                      const float *pixels_rgb, struct err *e);

/* Finds repeated images: they betray a seed without effect and would make standard errors too small. The exception is
 * light without noise: every pixel has its own random numbers, so if all pixels of all images agree bit for bit, no
 * random number matters, and the result is exact. */
struct replicate_repeats {
    int num, capacity;
    int same;           /* the first that repeats an earlier one; -1: none */
    bool without_noise; /* all pixels of all so far agree */
    char (*sha256)[65]; /* of each */
};
NODISCARD bool replicate_repeats_alloc(struct replicate_repeats *r, int capacity, struct err *e);
/* Adds an image; returns the number of the first equal one, its own if there is none. */
int replicate_repeats_add(struct replicate_repeats *r, const float *pixels_rgb, size_t pixels);
void replicate_repeats_free(struct replicate_repeats *r);

#endif
