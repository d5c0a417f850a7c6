/* A PNG of pathtracer made again from its texts, and what that shares with an EXR (reproduce.c). */
#ifndef ASSAY_REPRODUCE_PNG_H
#define ASSAY_REPRODUCE_PNG_H

#include "renderer/image/image.h"
#include "reproduce.h"

/* As reproduce(): an image, the rates of an adaptive one or a heat map (renderer/pathtracer/png_metadata.h); all 8-bit codes are compared, and the
 * texts about what was rendered. Works in the directory `dir`, which exists; opt->pathtracer is there. */
bool reproduce_png(const char *path, const struct reproduce_options *opt, const char *dir,
                   struct reproduced *out, struct err *e) __attribute__((warn_unused_result));

/* Renders the samples "A:B" again by the words of a command, whose scene has to have the hash that the image says, into the
 * picture `to` and, unless it is NULL, a heat map. Sets out->command. `path` names the image in messages. */
bool reproduce_render(const char *path, const struct image *im, char **word, int num,
                      const char *samples, const struct reproduce_options *opt, const char *to,
                      const char *heatmap, struct reproduced *out, struct err *e)
    __attribute__((warn_unused_result));
/* The same for jobs of sample ranges, as the image says them, run here one after the other and added up as they were. */
bool reproduce_ranges(const char *path, const struct image *im, char **word, int num,
                      const struct reproduce_options *opt, const char *to, struct reproduced *out,
                      struct err *e) __attribute__((warn_unused_result));
/* Bit by bit into out->num_values, num_different and first. False if size or channels are others. */
bool reproduce_compare(const char *path, const struct image *a, const struct image *b,
                       struct reproduced *out, struct err *e) __attribute__((warn_unused_result));

#endif
