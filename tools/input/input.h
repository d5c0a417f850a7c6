/* What `assay compare` takes for a side, turned into moments (tools/docs/background/inputs.md):
 *   a moments EXR; a directory of replicates; the output of Mitsuba 3's moment integrator, or its
 *   reference with a variance image beside it; a plain image: EXR, HDR, PFM of floats; a PNG of
 *   known tone curve.
 * Assumptions made on the way are reported in notes, which must be shown with every verdict. */
#ifndef ASSAY_INPUT_H
#define ASSAY_INPUT_H

#include "reference/replicates/shared_noise.h"
#include "tools/compare/compare.h"
#include "tools/images/image_file.h"
#include "tools/images/replicate_dir.h"

struct notes {
    int num;
    char line[16][320];
};
/* Adds a note, unless the same text is there already or there is no room. */
void input_notes_add(struct notes *notes, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

enum input_kind {
    INPUT_MOMENTS,    /* all there */
    INPUT_REPLICATES, /* all there, from a directory */
    INPUT_VARIANCE,   /* mean and variance, no skewness */
    INPUT_IMAGE       /* the mean alone */
};

struct input_options {
    const char *curve; /* of integer images (tone_curve.h); NULL: not known */
    double spp;        /* samples per pixel of a side (of each render) whose file does not say; 0: not known */
    bool packed;       /* leave those of a moments EXR packed (moments.h) */
};

struct input {
    enum input_kind kind;
    struct moments m;        /* of INPUT_VARIANCE M3 is 0, of INPUT_IMAGE n, M2, M3 are 0, until
                                input_pair() */
    bool is_xyz;             /* CIE X, Y, Z instead of R, G, B */
    unsigned char *censored; /* 1 per pixel, or NULL: bit c where channel c is saturated; after input_pair() of
                                both sides: 7 where all channels of both are, 1 where any is, else 0 */
    double *rounding;        /* 3 per pixel: variance that rounding to a code has added, or NULL */
    size_t num_censored;     /* by input_pair() */
    size_t num_white;        /* of these: all channels of both sides */
    /* Of INPUT_REPLICATES: shared_noise_factor(), by which input_pair() multiplies the variance; else 0. */
    double sharing;
    struct square_noise unlimited; /* squares that show there is no such factor; side 0: there is */
    bool is_guessed; /* by input_pair(): n, unit and spp stand for nothing that was observed */
};

/* A side that is in memory; nothing of it is changed or kept. */
struct input_memory {
    const struct moments *moments; /* or NULL, and renders */
    bool has_m3;                   /* false: M3 of the moments is not known */
    struct replicate_dir
        renders; /* one image, or at least 3 replicates, of finite numbers; names are not looked at */
    enum image_type type; /* what the renders' numbers were rounded to; replicates: IMAGE_FLOAT */
};

/* Reads one side; `side` is 'a' or 'b', for messages. The caller frees with input_free(). */
NODISCARD bool input_read(const char *path, char side, const struct input_options *opt,
                          struct input *out, struct notes *notes, struct err *e);
/* The same of one in memory; `name` is for messages and notes. */
NODISCARD bool input_take(const struct input_memory *memory, const char *name, char side,
                          const struct input_options *opt, struct input *out, struct notes *notes,
                          struct err *e);
void input_free(struct input *in);

/* Prepares both for compare_moments(), packed or not: converts to one colour space, sets censored pixels to 0 without
 * noise in both, bounds skewness where it is not known, allows for noise that pixels of replicates share, and
 * estimates the variance from the images themselves if one of them has none. Fails on replicates that share noise
 * over more pixels than can be allowed for. */
NODISCARD bool input_pair(struct input *a, struct input *b, bool independent, struct notes *notes,
                          struct err *e);

/* After compare_moments() on a pair: EQUIVALENT and NO DIFFERENCE FOUND become INCONCLUSIVE, with the reason, if more than
 * 5 % of the image or half of a reporting tile is censored and not white on both sides; in the latter case nothing is
 * detectable in that tile, and mdb_tile says so. */
void input_limit(const struct input *a, int tile, struct comparison *c);

#endif
