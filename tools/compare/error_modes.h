/* What a known kind of error would add to each pixel, as an image: the directions of matched_filter.c.
 *
 * A direction is computed from the two sides themselves. To keep the level of the test, nothing that is
 * seen in pixel p may enter the direction or its weight in p: its neighbours are used instead. */
#ifndef ASSAY_ERROR_MODES_H
#define ASSAY_ERROR_MODES_H

#include "renderer/image/moments.h"

enum error_mode_kind {
    ERROR_SCALE,     /* all radiance times a factor */
    ERROR_OFFSET,    /* a constant added */
    ERROR_GAMMA,     /* a power of radiance */
    ERROR_SHIFT_X,   /* moved to the right */
    ERROR_SHIFT_Y,   /* moved down */
    ERROR_FLIP_X,    /* left and right exchanged */
    ERROR_FLIP_Y,    /* top and bottom exchanged */
    ERROR_ROTATE,    /* both */
    ERROR_TRANSPOSE, /* columns and rows exchanged; square images only */
    ERROR_SWAP_RB,
    ERROR_SWAP_RG,
    ERROR_SWAP_GB,
    ERROR_CLAMP, /* radiance above 1 cut off */
    NUM_ERROR_MODES
};

extern const char *const error_mode_name[NUM_ERROR_MODES];

/* A part of the image with a margin around it: one plane for n, three (R, G, B) of the others, `across` columns
 * each. */
struct error_modes_frame {
    int x, y, across, down; /* where it lies in the image */
    size_t room;            /* pixels that a plane has room for */
    double *n[2], *mean[2]; /* of A and B */
    double *sd[2];          /* of their means, 0 where exact */
    double *root[2];        /* cube roots of their third cumulants */
    double *around[2];      /* squares of sd, mean over the 5 x 5 pixels around p without p */
    /* 1 / (variance of A plus B around p), which is taken to be at least 3 % of its mean over the image;
     * 0 if a channel has no noise anywhere. */
    double *weight;
    /* Mean of A and B weighted by the inverse of `around`: its noise is uncorrelated with that of A - B
     * if the variances near p are those of p. */
    double *mix;
    double *mix_around; /* mean of mix over the 3 x 3 pixels around p without p */
    double *b_around;   /* of B */
    double *row;        /* workspace for sums along rows */
    double *data;       /* the memory that holds all these */
};
/* Index of pixel (x, y) of the image in the first plane; each further channel adds `room`. */
size_t error_modes_at(const struct error_modes_frame *f, int x, int y);

/* What directions are computed from, for some rows of the image at a time. */
struct error_modes {
    const struct moments *side[2];
    int width, height;
    double least[3]; /* lower limit of the variance in `weight`, per channel */
    struct error_modes_frame own, turned,
        columns; /* of the rows; of the rows that a flip top to bottom puts in their place;
                                                   of a square image, of the columns that transposing does */
};

/* At least 2 pixels. Fails only out of memory. Release with error_modes_free(). */
NODISCARD bool error_modes_open(const struct moments *a, const struct moments *b,
                                struct error_modes *out, struct err *e);
void error_modes_free(struct error_modes *modes);

/* Does the direction exist for this size of image? */
bool error_mode_applies(const struct error_modes *modes, enum error_mode_kind kind);

enum { ERROR_MODES_BAND = 32 };
/* Prepares rows y .. y+rows-1 for error_mode_row(), ERROR_MODES_BAND at most. */
void error_modes_go_to(struct error_modes *modes, int y, int rows);

/* One direction in one of the prepared rows, by columns. */
struct error_change {
    double *d[3]; /* independent of what is seen in the pixel */
    /* Extra variance of sum w D. The direction at p is computed from other pixels, whose directions
     * in turn are computed from p; where d is made of B alone, these products do not average out. */
    double *coupled;
};
void error_mode_row(const struct error_modes *modes, enum error_mode_kind kind, int y,
                    const struct error_change *out);

/* Does a multiple of the direction make sense? There is a shift by 0.3 pixels, but no flip by 0.3. */
bool error_mode_has_amount(enum error_mode_kind kind);

#endif
