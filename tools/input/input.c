#include "input_internal.h"

#include "reference/replicates/independence.h"
#include "tools/compare/region.h"
#include "tools/images/replicate_dir.h"
#include "tools/stats/noise_estimate.h"
#include "tools/stats/third_moment.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const double most_censored = 0.05;     /* of the image, for EQUIVALENT */
static const double most_censored_tile = 0.5; /* of a reporting tile */
enum { WHITE = 7 };                           /* in censored[] */
static const double sharing_alpha = 1e-6;     /* of "pixels share noise" where they do not */
static const double least_correlation = 0.1;  /* of two renders that share noise */
enum { most_measured = 64 };                  /* renders that this is measured on */

/* Refuses renders that share noise with each other: a seed used twice on two machines, a render that goes on from the
 * one before. Renders of unequal noise, as of equal times, are correlated a little without that. */
static bool check_pairs(const char *path, const struct replicate_dir *from,
                        const struct replicates *r, const struct shared_noise *shared,
                        struct err *e)
{
    struct independence t;
    if (!independence_test(r, shared, sharing_alpha, &t, e))
        return false;
    const bool next = t.neighbours_z > t.limit && t.neighbours_r > least_correlation - 1.0 / r->num;
    const bool pair = t.pair_z > t.pair_limit && t.pair_r > least_correlation - 1.0 / r->num;
    if (!t.tested || (!next && !pair))
        return true;
    char number[2][16];
    const char *name[2];
    for (int i = 0; i < 2; i++) {
        snprintf(number[i], sizeof number[i], "%d", t.pair[i] + 1);
        name[i] =
            from->name != NULL && from->name[t.pair[i]] != NULL ? from->name[t.pair[i]] : number[i];
    }
    return err_set(e,
                   "%s: renders %s and %s share noise (correlation %.2g): the same seed, or some "
                   "of the same samples? Each render needs a seed of its own",
                   path, pair ? name[0] : "one", pair ? name[1] : "the next",
                   pair ? t.pair_r : t.neighbours_r);
}

bool input_measure_sharing(const char *path, const struct replicate_dir *from, struct input *out,
                           struct err *e)
{
    struct replicates r;
    struct shared_noise s;
    const struct square_noise *unlimited;
    const int num = from->num < most_measured ? from->num : most_measured;
    if (!replicates_alloc(&r, from->width, from->height, num, e))
        return false;
    for (int k = 0; k < num; k++)
        replicates_add(&r, from->rgb[k]);
    bool ok = shared_noise_measure(&r, &s, e);
    if (ok) {
        r.sharing = out->sharing = shared_noise_factor(&s, sharing_alpha, &unlimited);
        if (unlimited != NULL)
            out->unlimited = *unlimited;
        else if (path != NULL)
            ok = check_pairs(path, from, &r, &s, e);
    }
    replicates_free(&r);
    return ok;
}

/* spp: paths per pixel of each; 0: as they say themselves. */
static bool take_replicates(const char *path, char side, const struct replicate_dir *r, double spp,
                            struct input *out, struct notes *notes, struct err *e)
{
    out->kind = INPUT_REPLICATES;
    input_notes_add(notes, "%s: %d replicates, each taken for a render with a seed of its own",
                    path, r->num);
    if (spp > 0 && r->spp > 0)
        return err_set(e, "%s: --spp-%c: its renders say themselves how many samples they have",
                       path, side);
    if (!input_measure_sharing(path, r, out, e) || !replicate_dir_moments(r, &out->m, e))
        return false;
    if (spp > 0)
        out->m.spp = spp;
    return true;
}

static bool read_directory(const char *path, char side, const struct input_options *opt,
                           struct input *out, struct notes *notes, struct err *e)
{
    struct replicate_dir r;
    if (!replicate_dir_read(path, &r, e))
        return false;
    bool ok = take_replicates(path, side, &r, opt->spp, out, notes, e);
    replicate_dir_free(&r);
    return ok;
}

static bool is_moments(const struct image *im)
{
    return image_channel(im, "M2.R") >= 0;
}

/* Recognises our moments by the header, without loading OpenImageIO. Fails only out of memory. */
static bool look_for_moments(const char *path, bool *says, struct err *e)
{
    struct image head;
    struct err why;
    *says = false;
    if (!image_read_exr_head(path, &head, &why))
        return !err_is_of_memory(&why) || err_set(e, "%s", why.msg);
    *says = is_moments(&head);
    image_free(&head);
    return true;
}

static bool read_moments(const char *path, char side, const struct input_options *opt,
                         struct input *out, struct err *e)
{
    out->kind = INPUT_MOMENTS;
    if (!(opt->packed ? moments_read_packed(path, &out->m, e)
                      : moments_read(path, &out->m, NULL, e)))
        return false;
    if (strcmp(out->m.unit, "picture") == 0)
        return err_set(e, "%s: is one side of a comparison; its variance belongs to both", path);
    return !(opt->spp > 0) ||
           err_set(e, "%s: --spp-%c: a moments image says itself how many samples it has", path,
                   side);
}

static bool read_file(const char *path, char side, const struct input_options *opt,
                      struct input *out, struct notes *notes, struct err *e)
{
    struct image_info info;
    struct image im;
    bool mitsuba = false, ours;
    if (!look_for_moments(path, &ours, e))
        return false;
    if (ours)
        return read_moments(path, side, opt, out, e);
    if (!image_inspect(path, &info, e))
        return false;
    if (strcmp(info.format, "openexr") != 0)
        return plain_image_input(path, side, opt, out, notes, e);
    if (!image_read(path, &im, NULL, e))
        return false;
    if (!is_moments(&im) && !image_uncrop(&info, &im, e)) {
        image_free(&im);
        return false;
    }
    bool ok = is_moments(&im) ? read_moments(path, side, opt, out, e)
                              : input_mitsuba(path, side, &im, &info, opt, out, &mitsuba, notes, e);
    bool done = !ok || is_moments(&im) || mitsuba;
    image_free(&im);
    return done ? ok : plain_image_input(path, side, opt, out, notes, e);
}

bool input_read(const char *path, char side, const struct input_options *opt, struct input *out,
                struct notes *notes, struct err *e)
{
    *out = (struct input){0};
    struct stat st;
    bool directory = stat(path, &st) == 0 && S_ISDIR(st.st_mode);
    bool ok = directory ? read_directory(path, side, opt, out, notes, e)
                        : read_file(path, side, opt, out, notes, e);
    if (!ok)
        input_free(out);
    return ok;
}

bool input_take(const struct input_memory *memory, const char *name, char side,
                const struct input_options *opt, struct input *out, struct notes *notes,
                struct err *e)
{
    const struct replicate_dir *r = &memory->renders;
    const struct image_file pic = {
        r->width, r->height, r->num > 0 ? r->rgb[0] : NULL, {.type = memory->type}, 0, 0};
    *out = (struct input){0};
    bool ok = true;
    if (opt->spp > 0 && memory->moments != NULL) {
        ok = err_set(e, "%s: how many samples it has is known", name);
    } else if (memory->moments != NULL) {
        out->kind = memory->has_m3 ? INPUT_MOMENTS : INPUT_VARIANCE;
        ok = moments_copy(memory->moments, &out->m, e);
    } else if (r->num > 1) {
        ok = r->num >= 3
                 ? take_replicates(name, side, r, opt->spp, out, notes, e)
                 : err_set(e, "%s: has %d images, at least 3 replicates are needed", name, r->num);
    } else {
        ok = plain_image_take(name, side, &pic, opt, out, notes, e);
    }
    if (!ok)
        input_free(out);
    return ok;
}

void input_free(struct input *in)
{
    moments_free(&in->m);
    free(in->censored);
    free(in->rounding);
    *in = (struct input){0};
}

/* Both sides get the union of the censored pixels, in which both become 0 without noise. */
static bool censor(struct input *a, struct input *b, struct notes *notes, struct err *e)
{
    if (a->censored == NULL && b->censored == NULL)
        return true;
    size_t pixels = (size_t)a->m.width * (size_t)a->m.height, num = 0, white = 0;
    for (int i = 0; i < 2; i++) {
        struct input *in = i ? b : a;
        if (in->censored == NULL)
            in->censored = calloc(pixels, 1);
        if (in->censored == NULL)
            return err_set(e, "out of memory for %zu pixels", pixels);
    }
    for (size_t p = 0; p < pixels; p++) {
        const bool out = a->censored[p] || b->censored[p];
        const bool is_white = (a->censored[p] & b->censored[p]) == WHITE;
        a->censored[p] = b->censored[p] = is_white ? WHITE : out;
        num += out;
        white += is_white;
        for (size_t i = 3 * p; out && i < 3 * p + 3; i++) {
            a->m.mean[i] = b->m.mean[i] = 0;
            a->m.m2[i] = b->m.m2[i] = a->m.m3[i] = b->m.m3[i] = 0;
            if (a->m.tolerance != NULL)
                a->m.tolerance[i] = 0;
            if (b->m.tolerance != NULL)
                b->m.tolerance[i] = 0;
        }
    }
    a->num_censored = b->num_censored = num;
    a->num_white = b->num_white = white;
    if (num == pixels)
        return err_set(e, "every pixel is saturated in one of the images");
    if (num > 0)
        input_notes_add(
            notes,
            "saturated: %zu of %zu pixels (%.2g %%) have the brightest code in an image; they are in "
            "no sum. %zu are white in both: equal as far as codes go, how bright is not known. Of the others nothing is "
            "said. Regions around them are measured by what is left",
            num, pixels, 100 * (double)num / (double)pixels, white);
    return true;
}

static bool pair_images(struct input *a, struct input *b, bool independent, struct notes *notes,
                        struct err *e)
{
    struct noise_estimate s;
    if (a->kind != INPUT_IMAGE || b->kind != INPUT_IMAGE)
        input_notes_add(notes, "the variance that %c has is not used: the other side has none",
                        a->kind == INPUT_IMAGE ? 'B' : 'A');
    if (!noise_estimate_variance(&a->m, &b->m, a->rounding, b->rounding, a->censored, independent,
                                 &s, e))
        return false;
    a->is_guessed = b->is_guessed = true;
    input_notes_add(
        notes, "approximate: without moments, the noise is taken from second differences of A - B "
               "in blocks of 8 x 8 pixels (1/6 degree of freedom a pixel); an error as fine as a "
               "pixel or two counts as noise and is missed");
    if (!independent)
        input_notes_add(
            notes,
            "pixels share noise, or differ: means of squares, or of lines, have %.2f, %.2f, %.2f times the variance "
            "(R, G, B) that independent pixels of the same second differences have. It is taken for noise; "
            "--filter-width 1 says that each pixel has samples of its own",
            s.factor[0], s.factor[1], s.factor[2]);
    input_notes_add(
        notes,
        "skewness of A - B in one pixel: %+.2f, %+.2f, %+.2f (+-%.2f, %.2f, %.2f); unequal "
        "sample counts or fireflies keep small regions, or all, from being tested",
        s.skewness[0], s.skewness[1], s.skewness[2], s.skew_error[0], s.skew_error[1],
        s.skew_error[2]);
    return true;
}

/* Does input_pair() have nothing to change in it? */
static bool is_ready(const struct input *in)
{
    return (in->kind == INPUT_MOMENTS || in->kind == INPUT_REPLICATES) && !in->is_xyz &&
           in->censored == NULL && !(in->sharing > 1);
}

/* Where sums of pixels vary f times as much as independent pixels would, their variances are taken f times as large,
 * and third cumulants f^2 times: with weights w of sum 1, f = 1/sum w^2, and sum w^3 >= (sum w^2)^2. */
static bool allow_for_sharing(struct input *in, char side, struct notes *notes, struct err *e)
{
    const double f = in->sharing;
    const size_t values = 3 * (size_t)in->m.width * (size_t)in->m.height;
    if (!(f > 1))
        return true;
    if (in->unlimited.side > 0)
        return err_set(
            e,
            "%c: pixels of a render share noise over more of the image than can be allowed for "
            "(sums over %d x %d pixels vary %.2g times as much as independent pixels would): a "
            "denoiser, a photon map, too few pixels? --exchangeable compares whole images",
            side, in->unlimited.side, in->unlimited.side, in->unlimited.ratio);
    for (size_t i = 0; i < values; i++) {
        in->m.m2[i] *= f;
        in->m.m3[i] *= f * f;
    }
    in->m.sharing = f;
    input_notes_add(
        notes,
        "%c: pixels of a render share noise, as by a pixel filter or in a pattern that repeats: sums of many vary "
        "%.2g times as much as independent pixels would. This is allowed for",
        side, f);
    return true;
}

bool input_pair(struct input *a, struct input *b, bool independent, struct notes *notes,
                struct err *e)
{
    if (a->m.width != b->m.width || a->m.height != b->m.height)
        return err_set(e, "A is %d x %d pixels, B is %d x %d", a->m.width, a->m.height, b->m.width,
                       b->m.height);
    if (is_ready(a) && is_ready(b))
        return true;
    if (!moments_unpack(&a->m, e) || !moments_unpack(&b->m, e))
        return false;
    if (a->is_xyz || b->is_xyz) {
        input_to_xyz(a);
        input_to_xyz(b);
        input_notes_add(notes,
                        "compared as CIE X, Y, Z, in which one side has its variance: red, green "
                        "and blue stand for X, Y and Z, luminance for .2126 X + .7152 Y + .0722 Z");
    }
    if (!censor(a, b, notes, e))
        return false;
    if (a->kind == INPUT_IMAGE || b->kind == INPUT_IMAGE)
        return pair_images(a, b, independent, notes, e);
    if (!allow_for_sharing(a, 'A', notes, e) || !allow_for_sharing(b, 'B', notes, e))
        return false;
    bool lacks_a = a->kind == INPUT_VARIANCE, lacks_b = b->kind == INPUT_VARIANCE;
    return (!lacks_a && !lacks_b) || third_moment_bound(&a->m, &b->m, lacks_a, lacks_b, e);
}

void input_limit(const struct input *a, int tile, struct comparison *c)
{
    if (a->censored == NULL)
        return;
    double pixels = (double)a->m.width * a->m.height,
           share = (double)(a->num_censored - a->num_white) / pixels;
    double worst = 0;
    int worst_x = 0, worst_y = 0;
    for (int row = 0; row < c->tiles_y; row++)
        for (int column = 0; column < c->tiles_x; column++) {
            int x = column * tile, right = column + 1 < c->tiles_x ? x + tile : a->m.width;
            int y = row * tile, bottom = row + 1 < c->tiles_y ? y + tile : a->m.height;
            double num = 0;
            for (int i = y; i < bottom; i++)
                for (int j = x; j < right; j++)
                    num += a->censored[(size_t)i * (size_t)a->m.width + (size_t)j] % WHITE != 0;
            num /= (double)(right - x) * (bottom - y);
            if (num > worst) {
                worst = num;
                worst_x = x;
                worst_y = y;
            }
        }
    if (worst > most_censored_tile)
        c->mdb_tile = region_mdb_none;
    bool passes = c->verdict == VERDICT_EQUIVALENT || c->verdict == VERDICT_NOTHING_FOUND;
    if (!passes || (share <= most_censored && worst <= most_censored_tile))
        return;
    c->verdict = VERDICT_INCONCLUSIVE;
    c->extra_factor = 1;
    if (share > most_censored)
        snprintf(
            c->reason, sizeof c->reason,
            "%.3g %% of the pixels are saturated and not white in both images, more than the %.3g %% that may be: they may "
            "hide a difference; make darker images, or files of floats",
            100 * share, 100 * most_censored);
    else
        snprintf(
            c->reason, sizeof c->reason,
            "%.3g %% of the tile at %d,%d is saturated and not white in both images: it may hide a difference; "
            "make darker images, or files of floats",
            100 * worst, worst_x, worst_y);
}
