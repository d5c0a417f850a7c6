/* libassay: compares two renders, in memory or in files; a verdict with its error rates and what it could have missed.
 *
 *     struct assay_side mine = {.num = 1, .width = 640, .height = 480, .channels = 3, .pixels = rgb}, gold = {.path = "gold.exr"};
 *     struct assay_options options;
 *     struct assay_comparison *c;
 *     char error[ASSAY_ERROR_SIZE];
 *     assay_options_init(&options, sizeof options);
 *     options.margin = 0.01;
 *     if (!assay_compare(&mine, &gold, &options, &c, error))
 *         fputs(error, stderr);          // could not be judged: never a pass
 *     else
 *         puts(assay_result_of(c)->reason);
 *     assay_free(c);
 *
 * It does what the command `assay compare` does, with the same code: `man assay-compare` and guide-report.md
 * explain the options, background/verdict.md the procedure. It prints nothing and keeps no state between calls; any
 * number of threads may call it at once on objects of their own. struct assay_options and assay_result may grow at
 * their ends; all else changes only with ASSAY_ABI. */
#ifndef ASSAY_H
#define ASSAY_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#define ASSAY_ABI 1
#define ASSAY_ERROR_SIZE                                                                           \
    1024 /* of every `error`, which receives one line where a function returns false; may be NULL */

/* ASSAY_ABI and the build ("0.1 (commit 1a2b3c4d5e6f)") of the library that is loaded. */
int assay_abi(void);
const char *assay_build(void);

enum assay_verdict {
    ASSAY_EQUIVALENT, /* inside the margins */
    ASSAY_DIFFERENT,
    ASSAY_INCONCLUSIVE, /* neither is shown, or something that was asked for could not be tested */
    ASSAY_NOTHING_FOUND /* no margin, and nothing stands out: see mdb */
};
/* "EQUIVALENT", "DIFFERENT", "INCONCLUSIVE", "NO DIFFERENCE FOUND". */
const char *assay_verdict_name(enum assay_verdict verdict);

/* The type and meaning of the numbers of an image. */
enum assay_type {
    ASSAY_FLOAT32, /* linear radiance */
    ASSAY_UINT8,   /* codes of the tone curve assay_options.curve */
    ASSAY_UINT16,
    ASSAY_HALF /* 32-bit floats that were rounded to 16 bits; that is then allowed for */
};

/* One side: a path, pixels, or moments. Arrays have rows from the top, pixels from the left and channels last, without
 * padding; channels is 3 (R, G, B) or 1 (grey). They stay the caller's, and are only read, and only during the call. */
struct assay_side {
    const char *name; /* in messages and on the page; NULL: the path, or "A" or "B" */
    const char *
        path; /* whatever `assay compare` takes: moments EXR, image, directory of replicates; or NULL, and: */
    int num, width, height, channels;
    /* num images, one after the other: a single one, whose noise is estimated from neighbouring pixels, or at least 3
     * replicates (ASSAY_FLOAT32), each with a seed of its own. */
    enum assay_type type;
    const void *pixels;
    /* Or, with num 0, moments: the number of observations of each pixel (height x width), their mean, and the sums of
     * squared and of cubed differences from it (height x width x channels each). m3 may be NULL: the skewness is then
     * bounded by what neighbouring pixels show. */
    const double *n, *mean, *m2, *m3;
    const char *
        unit; /* what one observation is: "sample" (NULL), "replicate" or "exact" (a closed form: n 1, m2 and m3 0) */
    double spp; /* paths in one observation, if known; else 0 */
};

struct assay_options {
    size_t size;        /* of this struct as the caller knows it; set by assay_options_init() */
    double alpha;       /* 1e-3: chance of a wrong DIFFERENT, and of a wrong EQUIVALENT */
    double margin;      /* 0: none, so that nothing is EQUIVALENT; relative, of the image's mean */
    double margin_tile; /* 0: 4 times that; of a tile's mean */
    double margin_variance; /* 0: variances are not judged; relative */
    double
        accept_mdb; /* 0: NO DIFFERENCE FOUND never passes; else it does if the image's MDB is at most this, relative */
    double accept_mdb_tile; /* 0: 4 times that */
    double spp[2];     /* samples per pixel, of a file that has a variance but not these, or of each replicate */
    const char *
        curve; /* tone curve of integers: "srgb", "linear", "gamma=2.2", "exposure=1", "cgl"; or NULL */
    int tile;          /* 16: side of a reporting tile, pixels */
    bool paired;       /* both sides share their noise: it is taken from A - B */
    bool exchangeable; /* an exact test by permutation of replicates, without margins */
    bool
        same_program; /* two versions of one program, equally many samples: an exact test by flips of pixels */
    int filter_width; /* same_program: pixels nearer than this may share noise; 0: is tested. 1: pixels of images without
                         moments share none, either */
    int min_side;     /* exchangeable: least side of a region, pixels; 0: about 1/32 of the image */
};
/* The defaults. size: sizeof of the struct that the caller was compiled with. */
void assay_options_init(struct assay_options *options, size_t size);

/* A square region (or the image) in one channel: 0 to 2 for R, G, B, 3 for luminance. Relative numbers are in units
 * of B's mean there or of 5 % of its mean luminance, whichever is larger. */
struct assay_region {
    int x, y, width, height, channel;
    double mean_a, mean_b; /* radiance */
    double difference;     /* (A - B), relative */
    double ci_lo, ci_hi;   /* 1 - 2 alpha interval of that */
    double t, dof;         /* Welch's; 0 degrees of freedom: there is no noise */
    double log10_p;        /* of "no difference beyond the margin" */
    double mdb;            /* the smallest true |difference| that comes out DIFFERENT with 95 % */
};

struct assay_result {
    enum assay_verdict verdict;
    bool
        passes; /* EQUIVALENT; or NO DIFFERENCE FOUND and no more than accept_mdb could have been missed */
    char reason[256];          /* one sentence: what decided */
    struct assay_region image; /* luminance of the whole image */
    struct assay_region worst; /* of all regions; with exchangeable and same_program of the means */
    struct assay_region worst_tile; /* the reporting tile that reaches furthest out, luminance */
    double mdb,
        mdb_tile; /* the smallest relative error, of the image and of any tile, that would have been found with 95 %; 1e6:
                             none would */
    double
        extra_factor; /* not decided: about how many times the samples would decide; 100: that or more */
    double variance_ratio, variance_lo,
        variance_hi; /* A's variance over B's, with its interval; NAN: not known */
    double exact_p;  /* of exchangeable or same_program, an upper bound; else NAN */
    int num_tests;
    int num_notes;
    const char *const *notes; /* what had to be assumed: shown beside every verdict */
};

struct assay_comparison;
/* Compares A, which is tested, with the reference B. options NULL: the defaults. True: judged, whatever the
 * verdict. False: could not be judged, with a line in error; *out is then NULL. The caller frees *out with
 * assay_free(). */
bool assay_compare(const struct assay_side *a, const struct assay_side *b,
                   const struct assay_options *options, struct assay_comparison **out,
                   char error[ASSAY_ERROR_SIZE]);
/* The same with fresh renders of both sides: DIFFERENT only if these confirm what A and B show. */
bool assay_compare_again(const struct assay_side *a, const struct assay_side *b,
                         const struct assay_side *a2, const struct assay_side *b2,
                         const struct assay_options *options, struct assay_comparison **out,
                         char error[ASSAY_ERROR_SIZE]);
/* Valid, as part of the comparison, until assay_free(). */
const struct assay_result *assay_result_of(const struct assay_comparison *comparison);
/* Maps of luminance, one float per pixel: difference over its standard error, and relative difference; rows from
 * the top, *width x *height. Valid until assay_free(); NULL if the means could not be compared. */
const float *assay_z_map(const struct assay_comparison *comparison, int *width, int *height);
const float *assay_relative_map(const struct assay_comparison *comparison, int *width, int *height);
/* Write one HTML page that opens from disk, or a results.json with the images beside it. False with a line, also if the
 * means could not be compared. */
bool assay_write_report(const struct assay_comparison *comparison, const char *path,
                        char error[ASSAY_ERROR_SIZE]);
bool assay_write_json(const struct assay_comparison *comparison, const char *path,
                      char error[ASSAY_ERROR_SIZE]);
void assay_free(struct assay_comparison *comparison);

/* Moments as a renderer accumulates them: every pixel has its own number of observations. An object may be used by one
 * thread at a time; a renderer with many threads gives each an object and merges them. */
struct assay_moments;
/* A new object without observations, to be freed with assay_moments_free(). unit: "sample" (NULL) or "replicate";
 * spp as in a side. NULL: out of memory, a size below 1, a negative spp, or another unit. */
struct assay_moments *assay_moments_new(int width, int height, const char *unit, double spp);
/* Adds a sample (R, G, B) of pixel (x, y), from the top left. False, and nothing is added, if that is out of range
 * or the sample not finite. */
bool assay_moments_add(struct assay_moments *moments, int x, int y, const double rgb[3]);
/* Adds an observation of every pixel (height x width x 3 floats): a whole replicate. False, and nothing is added,
 * if one is not finite. */
bool assay_moments_add_image(struct assay_moments *moments, const float *rgb);
/* to += from, as if all had been added to one. */
bool assay_moments_merge(struct assay_moments *to, const struct assay_moments *from,
                         char error[ASSAY_ERROR_SIZE]);
/* Writes a moments EXR (formats/moments-exr.md), which every command reads. */
bool assay_moments_write(const struct assay_moments *moments, const char *path,
                         char error[ASSAY_ERROR_SIZE]);
/* A side for assay_compare(); it points into `moments`, which must outlive it. */
struct assay_side assay_moments_side(const struct assay_moments *moments);
void assay_moments_free(struct assay_moments *moments);

#ifdef __cplusplus
}
#endif

#endif
