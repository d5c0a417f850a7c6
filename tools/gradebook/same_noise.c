#include "same_noise.h"

#include "renderer/base/fs.h"
#include "tools/results/results.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double least_kappa = 0.25, clip_sd = 5;
enum { GREEN = 1, DETAILS = 3 };

void same_noise_free(struct noise_print *n)
{
    free(n->detail);
    free(n->shared);
    *n = (struct noise_print){0};
}

/* Is there noise in all four pixels that rounding and clipping leave as it is? */
static bool is_usable(const struct submitted_image *s, const struct moments *m,
                      const size_t pixel[4], double spp)
{
    for (int k = 0; k < 4; k++) {
        size_t i = 3 * pixel[k] + GREEN;
        double sd = submitted_image_expected_sd(m, i, spp);
        if (!(sd > 0) || sd < 2 * s->tolerance[i] || s->clipped[i] ||
            m->mean[i] + clip_sd * sd > s->clip)
            return false;
    }
    return true;
}

/* Of a block of 2 x 2 values the three differences that are orthogonal to its mean. */
static void details_of(const double value[4], double out[DETAILS])
{
    out[0] = (value[0] - value[1] + value[2] - value[3]) / 2;
    out[1] = (value[0] + value[1] - value[2] - value[3]) / 2;
    out[2] = (value[0] - value[1] - value[2] + value[3]) / 2;
}

bool same_noise_of(const struct submitted_image *s, const struct moments *m, double spp,
                   struct noise_print *out, struct err *e)
{
    int columns = s->width / 2, rows = s->height / 2;
    double found = 0, expected = 0;
    size_t blocks = (size_t)columns * (size_t)rows;
    *out = (struct noise_print){.blocks = columns * rows,
                                .detail = calloc(blocks, DETAILS * sizeof(float)),
                                .shared = calloc(blocks, sizeof(float))};
    if (out->detail == NULL || out->shared == NULL) {
        same_noise_free(out);
        return err_set(e, "out of memory");
    }
    for (int b = 0; b < out->blocks; b++) {
        size_t first = (size_t)(b / columns * 2) * (size_t)s->width + (size_t)(b % columns * 2);
        const size_t pixel[4] = {first, first + 1, first + (size_t)s->width,
                                 first + (size_t)s->width + 1};
        double d[4], ours = 0, reference = 0;
        for (int k = 0; k < 4; k++) {
            size_t i = 3 * pixel[k] + GREEN;
            double n = m->n[pixel[k]];
            d[k] = s->mean[i] - m->mean[i];
            ours += pow(submitted_image_expected_sd(m, i, spp), 2) / 4;
            reference += n > 1 ? m->m2[i] / (n * (n - 1)) / 4 : 0;
        }
        float *detail = out->detail + DETAILS * b;
        double three[DETAILS];
        if (!is_usable(s, m, pixel, spp)) {
            detail[0] = NAN;
            continue;
        }
        details_of(d, three);
        for (int k = 0; k < DETAILS; k++)
            detail[k] = (float)three[k];
        out->shared[b] = (float)(DETAILS * reference);
        for (int k = 0; k < DETAILS; k++)
            found += (double)detail[k] * (double)detail[k];
        expected += DETAILS * (ours + reference);
    }
    if (found < least_kappa * expected)
        out->blocks = 0;
    return true;
}

double same_noise_t(const struct noise_print *a, const struct noise_print *b)
{
    double sum = 0, squares = 0;
    int used = 0;
    for (int i = 0; i < a->blocks && i < b->blocks; i++) {
        const float *x = a->detail + DETAILS * i, *y = b->detail + DETAILS * i;
        if (isnan(x[0]) || isnan(y[0]))
            continue;
        double p = -(double)a->shared[i];
        for (int k = 0; k < DETAILS; k++)
            p += (double)x[k] * (double)y[k];
        sum += p;
        squares += p * p;
        used++;
    }
    return used >= SAME_NOISE_FEWEST && squares > 0 ? sum / sqrt(squares) : NAN;
}

double same_noise_copy_t(const struct submitted_image *s, const struct moments *m,
                         const struct moments *twin)
{
    double sum = 0, squares = 0;
    int used = 0;
    for (int y = 0; y + 1 < s->height; y += 2)
        for (int x = 0; x + 1 < s->width; x += 2) {
            double rest[4], ours[4], d[DETAILS], e[DETAILS], p = 0;
            bool clipped = false;
            for (int k = 0; k < 4; k++) {
                size_t i =
                    3 * ((size_t)(y + k / 2) * (size_t)s->width + (size_t)(x + k % 2)) + GREEN;
                rest[k] = s->mean[i] - (m->mean[i] + twin->mean[i]) / 2;
                ours[k] = m->mean[i] - twin->mean[i];
                clipped |= s->clipped[i] != 0;
            }
            details_of(rest, d);
            details_of(ours, e);
            for (int k = 0; k < DETAILS; k++)
                p += d[k] * e[k];
            if (clipped || p == 0)
                continue;
            sum += p;
            squares += p * p;
            used++;
        }
    return used >= SAME_NOISE_FEWEST ? sum / sqrt(squares) : NAN;
}

double same_noise_bound(double tests, double alpha)
{
    return sqrt(2 * log(fmax(1, tests) / alpha));
}

/* Is it the image of an `equal` check, and did it cost no points? */
static bool is_right(const json_t *grade, const char *image)
{
    bool asked = false;
    json_each(c, json_object_get(grade, "checks")) {
        if (strcmp(member_or_empty(c, "kind"), "equal") != 0 ||
            strcmp(member_or_empty(c, "picture"), image) != 0)
            continue;
        asked = true;
        if (member_number(c, "share") < 1)
            return false;
    }
    return asked;
}

static json_t *list_of(json_t *grade, const char *name)
{
    json_t *list = json_object_get(grade, name);
    if (list == NULL) {
        list = json_array();
        json_object_set_new(grade, name, list);
    }
    return list;
}

/* What a submission's images so far say of the reference's noise in them. */
struct copy {
    double sum, bound; /* of T */
    int images;
};

/* Adds to "copied" if t exceeds the bound. image NULL: all images together. */
static void add_copied(json_t *grade, const char *image, double t, double bound)
{
    if (t > bound)
        json_array_append_new(list_of(grade, "copied"),
                              json_pack("{ss*, sf, sf}", "picture", image, "t", t, "bound", bound));
}

/* Tests an image that cost no points for the reference's noise, and makes its noise print. One that
 * cannot be read any more is left out; fails only out of memory. */
static bool read_noise(const char *out, const struct rubric *r, const struct answer_key *a, int i,
                       json_t *grade, struct copy *copy, struct noise_print *noise, struct err *e)
{
    const json_t *made = json_array_get(json_object_get(grade, "pictures"), (size_t)i);
    const struct rubric_image *p = &r->image[i];
    struct submitted_image s;
    struct err why;
    const struct path path =
        fs_path("%s/%s/%s", out, member_or_empty(grade, "id"), member_or_empty(made, "file"));
    if (!is_right(grade, p->name) || member_or_empty(made, "file")[0] == '\0')
        return true;
    if (!submitted_image_read(path.s, r->curve, p->width, p->height, &s, &why))
        return !err_is_of_memory(&why) || err_set(e, "%s", why.msg);
    int set = answer_key_set(r, member_or_empty(grade, "accepted"));
    bool ok = same_noise_of(&s, answer_key_image(a, set, i), p->spp, noise, e);
    const struct answer *plain = &a->of[0][i];
    double t = plain->twin.width > 0 ? same_noise_copy_t(&s, &plain->m, &plain->twin) : NAN;
    if (isfinite(t)) {
        copy->sum += t;
        copy->images++;
    }
    add_copied(grade, p->name, t, copy->bound);
    submitted_image_free(&s);
    return ok;
}

static void add_like(json_t *grade, const json_t *other, const char *image, double t, double bound)
{
    json_t *list = list_of(grade, "alike");
    size_t last = json_array_size(list);
    const char *id = member_or_empty(other, "id");
    for (size_t i = 0; i < last; i++)
        if (strcmp(member_or_empty(json_array_get(list, i), "id"), id) == 0)
            return; /* by an earlier image */
    json_array_append_new(
        list, json_pack("{ss, ss, sf, sf}", "id", id, "picture", image, "t", t, "bound", bound));
}

bool same_noise(const char *out, const struct rubric *r, const struct answer_key *a, json_t *grades,
                struct err *e)
{
    size_t num = json_array_size(grades);
    struct noise_print *noise = calloc(num + 1, sizeof *noise);
    double bound =
        same_noise_bound((double)num * ((double)num - 1) / 2 * r->num_images, SAME_NOISE_ALPHA);
    struct copy *copy = calloc(num + 1, sizeof *copy);
    bool ok = (noise != NULL && copy != NULL) || err_set(e, "out of memory");
    for (size_t k = 0; ok && k < num; k++)
        copy[k].bound = same_noise_bound((double)num * (r->num_images + 1), SAME_NOISE_ALPHA);
    for (int i = 0; ok && i < r->num_images; i++) {
        for (size_t k = 0; ok && k < num; k++)
            ok = a->of[0][i].m.width == 0 ||
                 read_noise(out, r, a, i, json_array_get(grades, k), &copy[k], &noise[k], e);
        for (size_t k = 0; ok && k < num; k++)
            for (size_t j = 0; noise[k].blocks > 0 && j < k; j++) {
                double t = same_noise_t(&noise[k], &noise[j]); /* NAN: not told */
                json_t *x = json_array_get(grades, k), *y = json_array_get(grades, j);
                if (t > bound) {
                    add_like(x, y, r->image[i].name, t, bound);
                    add_like(y, x, r->image[i].name, t, bound);
                }
            }
        for (size_t k = 0; noise != NULL && k < num; k++)
            same_noise_free(&noise[k]);
    }
    for (size_t k = 0; ok && k < num; k++)
        if (copy[k].images > 1)
            add_copied(json_array_get(grades, k), NULL, copy[k].sum / sqrt(copy[k].images),
                       copy[k].bound);
    free(copy);
    free(noise);
    return ok;
}
