/* libassay: two renders, in memory or in files, to a verdict with its error rates and what it could have missed.
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
 * It does what the command `assay compare` does, by the same code: `man assay-compare` and guide-report.md say what the
 * options mean, background/verdict.md the procedure. Nothing is printed, no state is kept between calls, any number of
 * threads may call at once on objects of their own. struct assay_options and assay_result may grow at their end, all else changes
 * with ASSAY_ABI only. */
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

/* ASSAY_ABI of the library that is loaded, and what build it is ("0.1 (commit 1a2b3c4d5e6f)"). */
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

/* What the numbers of an image are. */
enum assay_type {
    ASSAY_FLOAT32, /* linear radiance */
    ASSAY_UINT8,   /* codes; assay_options.curve says what light they are */
    ASSAY_UINT16,
    ASSAY_HALF /* 32-bit floats that were rounded to 16 bits; that is then allowed for */
};

/* One side: a path, or pixels, or moments. All arrays are the caller's, rows from the top, pixels from the left, channels last,
 * without gaps; channels is 3 (R, G, B) or 1 (grey). They are only read, and only during the call. */
struct assay_side {
    const char *name; /* in messages and on the page; NULL: the path, or "A" or "B" */
    const char *
        path; /* whatever `assay compare` takes: moments EXR, image, directory of replicates; or NULL, and: */
    int num, width, height, channels;
    /* num images after each other: 1, whose noise is then told by its neighbours, or at least 3 replicates (float32), each with a
     * seed of its own. */
    enum assay_type type;
    const void *pixels;
    /* Or, with num 0, over n observations of each pixel (height x width) their mean, the sum of squared differences from it and of
     * cubed ones (height x width x channels each). m3 may be NULL: its size is then bounded by what the pixels tell. */
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
        accept_mdb; /* 0: NO DIFFERENCE FOUND never passes; else it does if an error of so much could not be missed */
    double accept_mdb_tile; /* 0: 4 times that */
    double spp[2];          /* of a file that has a variance but no number of samples */
    const char *curve; /* of integers: "srgb", "linear", "gamma=2.2", "cgl"; NULL: none are there */
    int tile;          /* 16: side of a reporting tile, pixels */
    bool paired;       /* both sides share their noise: it is taken from A - B */
    bool exchangeable; /* an exact test by permutation of replicates, without margins */
    bool
        same_program; /* two versions of one program, equally many samples: an exact test by flips of pixels */
    int filter_width; /* of that: pixels nearer than this may share noise; 0: they are looked at */
    int min_side;     /* of a region to permute, pixels; 0: about 1/32 of the image */
};
/* The defaults. size: sizeof of the struct that the caller was compiled with. */
void assay_options_init(struct assay_options *options, size_t size);

/* A square region (or the image) in one channel: 0 to 2 R, G, B, 3 luminance. Relative numbers are in units of the larger of B's
 * mean there and 5 % of its mean luminance. */
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
/* A is tested, B the reference. True: it was judged, whatever the verdict. False: it could not be, with a line; *out is then
 * NULL. The caller frees *out with assay_free(). */
bool assay_compare(const struct assay_side *a, const struct assay_side *b,
                   const struct assay_options *options, struct assay_comparison **out,
                   char error[ASSAY_ERROR_SIZE]);
/* The same with fresh renders of both: DIFFERENT only if they confirm what A and B show. */
bool assay_compare_again(const struct assay_side *a, const struct assay_side *b,
                         const struct assay_side *a2, const struct assay_side *b2,
                         const struct assay_options *options, struct assay_comparison **out,
                         char error[ASSAY_ERROR_SIZE]);
/* Valid until assay_free(). */
const struct assay_result *assay_result_of(const struct assay_comparison *comparison);
/* Luminance of every pixel: difference over its standard error, and relative difference; rows from the top, *width x *height.
 * Valid until assay_free(); NULL where the means could not be compared. */
const float *assay_z_map(const struct assay_comparison *comparison, int *width, int *height);
const float *assay_relative_map(const struct assay_comparison *comparison, int *width, int *height);
/* One HTML page that opens from disk; results.json with the images beside it. */
bool assay_write_report(const struct assay_comparison *comparison, const char *path,
                        char error[ASSAY_ERROR_SIZE]);
bool assay_write_json(const struct assay_comparison *comparison, const char *path,
                      char error[ASSAY_ERROR_SIZE]);
void assay_free(struct assay_comparison *comparison);

/* Moments as a renderer accumulates them: every pixel has its own number of observations. One thread at a time for each object;
 * renderers with many give each its own and merge them. */
struct assay_moments;
/* Without observations; unit and spp as of a side. NULL: out of memory, sizes below 1, another unit. */
struct assay_moments *assay_moments_new(int width, int height, const char *unit, double spp);
/* One sample of one pixel, R, G, B; x from the left, y from the top. Out of range or not finite: false, nothing is added. */
bool assay_moments_add(struct assay_moments *moments, int x, int y, const double rgb[3]);
/* One observation of every pixel (height x width x 3 floats): a whole replicate. Not finite: false, nothing is added. */
bool assay_moments_add_image(struct assay_moments *moments, const float *rgb);
/* to += from, as if all had been added to one. */
bool assay_moments_merge(struct assay_moments *to, const struct assay_moments *from,
                         char error[ASSAY_ERROR_SIZE]);
/* A moments EXR (formats/moments-exr.md), which every command reads. */
bool assay_moments_write(const struct assay_moments *moments, const char *path,
                         char error[ASSAY_ERROR_SIZE]);
/* A side for assay_compare(); it points into `moments`. */
struct assay_side assay_moments_side(const struct assay_moments *moments);
void assay_moments_free(struct assay_moments *moments);

#ifdef __cplusplus
}
#endif

#endif
