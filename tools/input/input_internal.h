/* One function for each kind of input. The caller has zeroed `out`. */
#ifndef ASSAY_INPUT_INTERNAL_H
#define ASSAY_INPUT_INTERNAL_H

#include "renderer/image/image_oiio.h"
#include "input.h"

/* Adds a note if the file stores a rectangle other than the whole image. */
void input_note_crop(struct notes *notes, const char *path, const struct image_info *info);

/* Fills sharing and unlimited from renders. path: refuses renders that share noise with each other, in a line that
 * begins with it; NULL: does not look (input.c). */
NODISCARD bool input_measure_sharing(const char *path, const struct replicate_dir *from,
                                     struct input *out, struct err *e);

/* Mitsuba 3 (input_mitsuba.c). *is_it: whether the file is one of Mitsuba's at all; if not, returns
 * true and leaves `out` as it is. `im`: the file's content. */
NODISCARD bool input_mitsuba(const char *path, char side, const struct image *im,
                             const struct image_info *info, const struct input_options *opt,
                             struct input *out, bool *is_it, struct notes *notes, struct err *e);
/* R, G, B to X, Y, Z: means, and bounds of the rest for any correlation of the channels. */
void input_to_xyz(struct input *in);

/* Images without moments (plain_image.c). */
NODISCARD bool plain_image_input(const char *path, char side, const struct input_options *opt,
                                 struct input *out, struct notes *notes, struct err *e);
/* The same for an image that has been read; `path` is for messages. */
NODISCARD bool plain_image_take(const char *path, char side, const struct image_file *pic,
                                const struct input_options *opt, struct input *out,
                                struct notes *notes, struct err *e);

#endif
