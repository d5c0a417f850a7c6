/* A directory of images of one scene by one engine, each with a seed of its own. */
#ifndef ASSAY_REPLICATE_DIR_H
#define ASSAY_REPLICATE_DIR_H

#include "renderer/image/moments.h"

struct replicate_dir {
    int num, width, height;
    float **rgb; /* num images: 3 floats a pixel */
    char **name; /* their file names, sorted */
    double spp;  /* paths per pixel of one image, the mean over all; 0: not known */
};

/* Reads every file of the directory (but hidden ones) in the order of their names. Fails with a line
 * unless all are images of 32-bit floats (image_file.h) of one size, at least 3, no two of them the
 * same ("the seed was ignored"). spp is known if all state it (image_file.h). The caller frees with replicate_dir_free(). */
NODISCARD bool replicate_dir_read(const char *dir, struct replicate_dir *out, struct err *e);
void replicate_dir_free(struct replicate_dir *r);

/* Do a and b, of one size, share an image, bit for bit? If so, *i and *j are its numbers. */
bool replicate_dir_share(const struct replicate_dir *a, const struct replicate_dir *b, int *i,
                         int *j);

/* Their moments, unit "replicate". */
NODISCARD bool replicate_dir_moments(const struct replicate_dir *r, struct moments *out,
                                     struct err *e);

#endif
