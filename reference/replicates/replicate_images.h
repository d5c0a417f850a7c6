/* The images that a reference of an engine is folded from: files of float32 R, G and B. Those of Cycles are its
 * replicates; those of POV-Ray the windows and then, unless the scene has no noise, what each replicate adds to
 * them (povray_replicate_parts.h). An image depends on its number and the seed of all, not on which others are made. */
#ifndef ASSAY_REPLICATE_IMAGES_H
#define ASSAY_REPLICATE_IMAGES_H

#include "renderer/base/err.h"

#include <stddef.h>
#include <stdint.h>

enum { REPLICATE_IMAGE_PATH = 4096 + 64 };

/* Where each of them is. */
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
/* The same for any format that image_read() takes, values times scale; sets *half if the file has fewer than 32 bits, never clears
 * it. Values may be negative: spectral renderers have colours outside the gamut; only the mean has to make sense. */
NODISCARD float *replicate_images_read_any(const char *path, int width, int height, double scale,
                                           bool *half, struct err *e);
/* The same bits as a file, which appears whole. */
NODISCARD bool replicate_images_write(const char *path, int width, int height,
                                      const float *pixels_rgb, struct err *e);

/* Images that repeat betray a seed without effect, and would make a standard error that is too small. The exception is
 * light without noise: every pixel has random numbers of its own, so if all pixels of all images agree to the bit, no
 * random number matters, and the answer is exact. */
struct replicate_repeats {
    int num, capacity;
    int same;           /* the first that repeats an earlier one; -1: none */
    bool without_noise; /* all pixels of all so far agree */
    uint8_t (*digest)[32];
};
NODISCARD bool replicate_repeats_alloc(struct replicate_repeats *r, int capacity, struct err *e);
/* Adds an image; returns the number of the first equal one, its own if there is none. */
int replicate_repeats_add(struct replicate_repeats *r, const float *pixels_rgb, size_t pixels);
void replicate_repeats_free(struct replicate_repeats *r);

#endif
