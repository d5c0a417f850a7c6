/* A rubric: what a course asks of a submission, how many points it gives, and what is said where it is not
 * met; its manual is tools/docs/formats/rubric.md. A file of lines, one statement each, because staff
 * edit it by hand, and because every mistake can be reported with its line, which a JSON tree has lost.
 * Lists below are in the order of the file. */
#ifndef ASSAY_RUBRIC_H
#define ASSAY_RUBRIC_H

#include "reference/suite/suite.h"
#include "renderer/base/fs.h"
#include "tools/base/sandbox.h"

enum {
    RUBRIC_PARTS = 24,
    RUBRIC_IMAGES = 96,
    RUBRIC_CHECKS = 128,
    CHECK_IMAGES = 8,
    RUBRIC_ACCEPTED = 3,                      /* by words */
    RUBRIC_SETS = (1 << RUBRIC_ACCEPTED) + 4, /* choices of them, and those by images */
    RUBRIC_TILE = 8
};

enum check_kind {
    CHECK_EQUAL,
    CHECK_AGREE,
    CHECK_SUM,
    CHECK_EXACT,
    CHECK_NOISE,
    CHECK_RATES,
    CHECK_GROWTH,
    NUM_CHECK_KINDS
};
extern const char *const rubric_check_kind_name[NUM_CHECK_KINDS];

enum rubric_reference {
    REFERENCE_NONE,
    REFERENCE_TRUTH,
    REFERENCE_GOLDENS, /* of the first of engine_table.h, and so on */
    REFERENCE_OURS = REFERENCE_GOLDENS + NUM_ENGINES_WITH_GOLDENS
};
extern const char *const rubric_reference_names[]; /* "none", "truth", ... */

struct accepted {
    int line;
    char name[48];
    char how[256]; /* options of our renderer (of an image: if they begin with -), or a moments file */
    char words[160]; /* what students read of it; "": its name */
};

/* A set of accepted deviations that a program may have all at once. The first set is empty. */
struct rubric_set {
    char name[160];  /* "light_pdf, turned_lamp" */
    char words[800]; /* "" of those by images */
};

/* Where a statement of the whole, of an image or of a check stands; word NULL: it was not given. */
struct rubric_line {
    const char *word;
    int line;
};
enum { RUBRIC_STATEMENTS = 20 };

struct rubric_image {
    int line;
    struct rubric_line lines[RUBRIC_STATEMENTS];
    char name[48];
    char scene[256];                 /* as written: of the suite, or ending in .dae */
    const struct suite_scene *suite; /* NULL: a file beside the rubric */
    int width, height, spp, lights, bounces;
    char options[256], environment[256];
    enum rubric_reference reference;
    int reference_spp;
    char reference_options[256]; /* "" : those of the student */
    struct accepted accept[RUBRIC_SETS];
    int num_accepted;
    bool used;
};

/* Full points up to `full`, none from `none` on, linear between. */
struct margin {
    double full, none;
    bool given;
};

struct rubric_check {
    int line, part;
    struct rubric_line lines[RUBRIC_STATEMENTS];
    char name[48];
    double points;
    enum check_kind kind;
    int images[CHECK_IMAGES], num_images; /* indices */
    struct margin image, tile, share, log_ratio, count, carried;
    int batch;
    int after; /* index of the image of an earlier part that the mistake may come from; -1: none */
    char title[160], hint[512], where[160], visibility[24];
};

struct rubric_part {
    int line;
    char number[16], title[128];
};

struct rubric {
    char path[4096], dir[4096]; /* of the file; of what lies beside it */
    char title[160], curve[32], command[1024], output[64], program[128], bugs[128];
    char build[2048];    /* lines for sh(1) */
    char packages[1024]; /* of Debian, for `build` */
    struct sandbox_limits limit;
    double build_s, total;
    double budget_s;     /* CPU time of further runs of one submission */
    size_t build_memory; /* bytes */
    int mask[4];         /* x y width height, from the bottom left; width 0: none */
    struct accepted accept[RUBRIC_ACCEPTED];
    int num_accepted;
    struct rubric_set set[RUBRIC_SETS];
    int num_sets;
    struct rubric_part part[RUBRIC_PARTS];
    struct rubric_image image[RUBRIC_IMAGES];
    struct rubric_check check[RUBRIC_CHECKS];
    int num_parts, num_images, num_checks;
    struct rubric_line lines[RUBRIC_STATEMENTS];
    bool images;           /* what is handed in may be images alone */
    int variants, variant; /* how many there are, and which one this is, from 1; 0: none */
    int old_word_line;     /* the first that says "picture" for "image"; 0: none */
};

struct rubric_mistakes {
    int num; /* how many; the first 64 are kept */
    struct {
        int line;
        char text[200];
    } at[64];
};

/* Reads the file and finds all of its mistakes; *m is sorted by line. Scenes named are looked up in the
 * suite, which has to outlive the rubric. variant: what "{variant}" stands for where the rubric has
 * variants; 0: the first. Fails only if the file cannot be read or is longer than 1 MiB; a rubric with
 * mistakes must not be used. *out is large: not for the stack. */
NODISCARD bool rubric_read(const char *path, const struct suite *suite, int variant,
                           struct rubric *out, struct rubric_mistakes *m, struct err *e);

/* The k-th number (k 0, 1) after an option of an image, as in `-a BATCH TOLERANCE`; 0 if the option
 * is not there. */
double rubric_option(const struct rubric_image *p, const char *option, int k);

/* Is the image sampled adaptively (`-a BATCH TOLERANCE` with a batch of at most spp)? */
bool rubric_is_adaptive(const struct rubric_image *p);

double rubric_points(const struct rubric *r);

/* May students see the check before the due date? */
bool rubric_is_shown(const struct rubric_check *c);

/* The line of a statement among `lines`, or `otherwise` where it was not given. */
int rubric_line_of(const struct rubric_line lines[RUBRIC_STATEMENTS], const char *word,
                   int otherwise);

/* The file of an image's scene. */
struct path rubric_scene(const struct rubric *r, const struct rubric_image *p);

/* Is pixel number `pixel`, by rows from the top, one that no check looks at? */
bool rubric_masks(const struct rubric *r, int width, int height, size_t pixel);

#endif
