#include "same_program.h"

#include "tools/compare/verdict.h"

#include "tools/compare/region.h"
#include "tools/images/image_file.h"
#include "tools/images/replicate_dir.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

/* The renders of a side. all: borrowed from memory, or from one of the members below, which are owned. */
struct renders {
    struct replicate_dir all, dir;
    struct image_file file;
    float *mean;
};

static void renders_free(struct renders *r)
{
    replicate_dir_free(&r->dir);
    image_file_free(&r->file);
    free(r->mean);
}

static bool renders_take(const struct moments *m, struct renders *r, struct err *e)
{
    size_t values = 3 * (size_t)m->width * (size_t)m->height;
    r->mean = malloc(values * sizeof *r->mean);
    if (r->mean == NULL)
        return err_set(e, "out of memory for an image");
    for (size_t i = 0; i < values; i++)
        r->mean[i] = (float)moments_mean(m, i);
    r->all = (struct replicate_dir){1, m->width, m->height, .rgb = &r->mean};
    return true;
}

static bool renders_read(const char *path, const struct input_memory *memory, struct renders *r,
                         struct err *e)
{
    struct stat st;
    if (memory != NULL && memory->moments != NULL)
        return renders_take(memory->moments, r, e);
    if (memory != NULL) {
        r->all = memory->renders;
        return true;
    }
    if (stat(path, &st) == 0 && S_ISDIR(st.st_mode)) {
        bool ok = replicate_dir_read(path, &r->dir, e);
        r->all = r->dir;
        return ok;
    }
    bool ok = image_file_read(path, &r->file, e);
    r->all = (struct replicate_dir){1, r->file.width, r->file.height, .rgb = &r->file.rgb};
    return ok;
}

/* Both sides must have been asked for equally many samples. That is known only if each has the same number in all
 * pixels; else (adaptive sampling) nothing is checked. */
static bool check_samples(const struct moments *m, struct err *e)
{
    double first[2] = {moments_n(&m[0], 0), moments_n(&m[1], 0)},
           n[2] = {first[0] * m[0].spp, first[1] * m[1].spp};
    size_t pixels = (size_t)m[0].width * (size_t)m[0].height;
    for (size_t i = 0; i < pixels; i++)
        if (moments_n(&m[0], i) != first[0] || moments_n(&m[1], i) != first[1])
            return true;
    return n[0] == n[1] || err_set(e,
                                   "A has %g samples a pixel, B %g: only with equally many can two "
                                   "renders have one law",
                                   n[0], n[1]);
}

/* Standard errors of A - B from those that both sides state, 3 per pixel, to free(); NULL: out of memory. */
static float *stated_error(const struct moments *m)
{
    size_t values = 3 * (size_t)m->width * (size_t)m->height;
    float *error = malloc(values * sizeof *error);
    for (size_t i = 0; error != NULL && i < values; i++) {
        double v = moments_var_of_mean(&m[0], i / 3, (int)(i % 3)) +
                   moments_var_of_mean(&m[1], i / 3, (int)(i % 3));
        error[i] = v > 0 ? (float)sqrt(v) : 0; /* 0 also where v is NaN: not known */
    }
    return error;
}

bool same_program_judge(const char *const path[2], const struct input_memory *const memory[2],
                        const struct moments *m, const struct sign_flip_options *opt,
                        struct sign_flip *out, struct err *e)
{
    struct renders r[2] = {0};
    float *error = NULL;
    bool ok = true;
    for (int i = 0; ok && i < 2; i++)
        ok = m != NULL ? renders_take(&m[i], &r[i], e) : renders_read(path[i], memory[i], &r[i], e);
    const struct replicate_dir *a = &r[0].all, *b = &r[1].all;
    if (ok && (a->width != b->width || a->height != b->height))
        ok = err_set(e, "A is %d x %d pixels, B is %d x %d", a->width, a->height, b->width,
                     b->height);
    if (ok && a->num != b->num)
        ok = err_set(e, "A has %d renders, B %d: each of A is held against one of B", a->num,
                     b->num);
    if (ok && m != NULL) {
        error = stated_error(m);
        ok = error != NULL ? check_samples(m, e) : err_set(e, "out of memory for errors");
    }
    struct sign_flip_images in = {a->num, a->width, a->height, a->rgb, b->rgb, error};
    ok = ok && sign_flip_test(&in, opt, out, e);
    free(error);
    renders_free(&r[0]);
    renders_free(&r[1]);
    return ok;
}

void same_program_decide(const struct sign_flip *f, double alpha, struct comparison *r)
{
    char where[96], image[32], tile[32];
    size_t size = sizeof r->reason;
    r->mdb_global = f->mdb_global;
    r->mdb_tile = f->mdb_tile;
    r->extra_factor = 1;
    if (f->shares_noise) {
        r->verdict = VERDICT_INCONCLUSIVE;
        snprintf(
            r->reason, size,
            "pixels look as if they shared noise: by a filter (--filter-width N is its width in pixels; 1: they "
            "share none), or as every row or tile begins the same random numbers (compare directories of "
            "renders, without --same-program)");
    } else if (f->log10_p <= log10(alpha)) {
        const char *more = f->t > 0 ? "brighter" : "darker",
                   *noise = f->t > 0 ? "noisier" : "less noisy";
        r->verdict = VERDICT_DIFFERENT;
        region_name(f->width, f->height, f->rect, f->channel, where, sizeof where);
        if (f->score == SIGN_FLIP_SPREAD)
            snprintf(r->reason, size, "the law changed: %s: A is %s, %s", where, noise,
                     verdict_p(f->log10_p).s);
        else
            snprintf(r->reason, size,
                     "the law changed: %s: A is %s in %.0f %% of the pixels, mean %+.3g %%, %s",
                     where, more, 100 * (f->t > 0 ? f->larger : 1 - f->larger), 100 * f->difference,
                     verdict_p(f->log10_p).s);
    } else if (f->mdb_global < region_mdb_none) {
        r->verdict = VERDICT_NOTHING_FOUND;
        snprintf(
            r->reason, size,
            "no sign of another law; an error of %s of the image or %s of a tile would have been "
            "seen with 95 %%",
            region_mdb_text(f->mdb_global, image), region_mdb_text(f->mdb_tile, tile));
    } else {
        r->verdict = VERDICT_INCONCLUSIVE;
        snprintf(r->reason, size,
                 "%zu pixels of so much noise cannot show any change at alpha %.2g", f->num_pixels,
                 alpha);
    }
}
