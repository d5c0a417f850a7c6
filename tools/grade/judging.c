#include "judging.h"

#include "tools/submission/rate_image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const struct rubric_image *judging_image(const struct judging *w, int k)
{
    return &w->g->r->image[w->check->images[k]];
}

const struct submitted_image *judging_student(const struct judging *w, int k)
{
    return &w->g->h->image[w->check->images[k]];
}

const struct moments *judging_reference(const struct judging *w, int k)
{
    return answer_key_image(w->g->a, w->set, w->check->images[k]);
}

static const struct moments *expected(const struct grading *g, int set, int image)
{
    const struct moments *own = &g->a->of[set][image].m;
    return own->width > 0 ? own : &g->a->of[0][image].noise;
}

const struct moments *judging_expected(const struct judging *w, int k)
{
    return expected(w->g, w->set, w->check->images[k]);
}

bool judging_masks(const struct judging *w, const struct submitted_image *s, size_t p)
{
    return rubric_masks(w->g->r, s->width, s->height, p);
}

bool judging_can_buy(const struct judging *w)
{
    bool all = w->g->h->can_buy;
    for (int k = 0; k < w->check->num_images; k++)
        all = all && !w->g->h->fixed[w->check->images[k]];
    return all;
}

/* Factor of samples to ask for where it is not known how many are needed. */
static const double few = 4;

/* Samples a pixel of the smallest run of image k, whose noise reaches the clipping point first. */
static double least_samples(const struct judging *w, int k)
{
    const struct submitted_image *s = judging_student(w, k);
    double least = s->num_runs > 0 ? INFINITY : judging_image(w, k)->spp;
    for (int run = 0; run < s->num_runs; run++)
        least = fmin(least, s->run[run].spp);
    return least;
}

/* kappa of image k, 1 where its noise is measured from run to run, and the variance that it adds to
 * a sum of pixels. */
static bool measure_noise(const struct judging *w, int k, const unsigned char *use, double *kappa,
                          double *noise, struct err *e)
{
    struct submitted_image right;
    const struct submitted_image *s = judging_student(w, k);
    if (!submitted_image_from(judging_expected(w, k), s, &right, e))
        return false;
    *kappa = s->num_runs > 1 ? 1 : difference_kappa(s, &right, use);
    *noise = 0;
    for (size_t i = 0; i < 3 * (size_t)s->width * (size_t)s->height; i++)
        if (use[i / 3])
            *noise += s->num_runs > 1 ? s->measured[i / 3 * 4 + i % 3] : *kappa * s->variance[i];
    submitted_image_free(&right);
    return true;
}

/* If some images of a check have several runs, the measured variance of the others is modelled by
 * their kappa. */
static void model_noise(const struct judging *w, const unsigned char *use, const double *kappa)
{
    bool any = false;
    for (int k = 0; k < w->check->num_images; k++)
        any = any || judging_student(w, k)->num_runs > 1;
    for (int k = 0; k < w->check->num_images; k++)
        if (judging_student(w, k)->num_runs <= 1)
            submitted_image_model(&w->g->h->image[w->check->images[k]], any ? kappa[k] : 0);
    for (int k = 0; any && k < w->check->num_images; k++)
        submitted_image_scale_skewness(&w->g->h->image[w->check->images[k]], use);
}

bool judging_find_usable(struct judging *w, struct result *out, struct err *e)
{
    static const double louder = 1.3, fewest = 0.3;
    size_t pixels = (size_t)judging_student(w, 0)->width * (size_t)judging_student(w, 0)->height,
           left = 0;
    unsigned char *use = w->use = malloc(2 * pixels);
    double kappa[CHECK_IMAGES];
    if (use == NULL)
        return err_set(e, "out of memory for %zu pixels", pixels);
    unsigned char *quiet = use + pixels;
    for (size_t p = 0; p < pixels; p++)
        use[p] = !judging_masks(w, judging_student(w, 0), p);
    for (int k = 0; k < w->check->num_images; k++)
        if (!submitted_image_comparable(judging_student(w, k), judging_expected(w, k),
                                        least_samples(w, k), false, use, e))
            return false;
    for (int k = 0; k < w->check->num_images; k++)
        if (!measure_noise(w, k, use, &kappa[k], &out->noise[k], e))
            return false;
    model_noise(w, use, kappa);
    memcpy(quiet, use, pixels);
    for (int k = 0; k < w->check->num_images; k++)
        if ((kappa[k] > louder || judging_student(w, k)->num_runs > 1) &&
            !submitted_image_comparable(judging_student(w, k), judging_expected(w, k),
                                        least_samples(w, k) / kappa[k], true, quiet, e))
            return false;
    for (size_t p = 0; p < pixels; p++)
        left += quiet[p];
    if ((double)left >= fewest * (double)pixels)
        memcpy(use, quiet, pixels);
    else if (memcmp(use, quiet, pixels) != 0)
        out->more = few;
    return true;
}

bool judging_stopping(const struct judging *w, struct stopping *out, struct err *e)
{
    struct submitted_image right;
    if (!submitted_image_from(judging_expected(w, 0), judging_student(w, 0), &right, e))
        return false;
    bool ok = stopping_rule_range(judging_image(w, 0), judging_student(w, 0), &right,
                                  judging_expected(w, 0), w->use, out, e);
    submitted_image_free(&right);
    return ok;
}

/* With adaptive sampling, scales the expected noise to the samples that the rate image states. */
static void scale_noise(struct submitted_image *s, const double *count, double spp)
{
    for (size_t i = 0; i < 3 * (size_t)s->width * (size_t)s->height; i++) {
        s->variance[i] *= spp / count[i / 3];
        s->k3[i] *= pow(spp / count[i / 3], 2);
    }
    for (int k = 0; k < s->num_runs; k++)
        scale_noise(&s->run[k], count, spp);
}

bool judging_expect_noise(const struct grading *g, int set, int image, struct err *e)
{
    const struct rubric_image *p = &g->r->image[image];
    const struct made *made = &g->h->made[image];
    struct submitted_image *s = &g->h->image[image];
    struct err no_rates = {""};
    submitted_image_expect(s, expected(g, set, image), p->spp);
    if (made->rates[0] == '\0' || !rubric_is_adaptive(p))
        return true;
    double *count = calloc((size_t)s->width * (size_t)s->height, sizeof *count);
    if (count == NULL)
        return err_set(e, "out of memory");
    bool known = rate_image_counts(made->rates, p, count, &no_rates);
    if (known)
        scale_noise(s, count, p->spp);
    free(count);
    return known || !err_is_of_memory(&no_rates) || err_set(e, "%s", no_rates.msg);
}

bool judging_samples(const struct grading *g, int set, int image,
                     struct stopping out[NUM_STOPPING_KINDS], struct err *e)
{
    return judging_expect_noise(g, set, image, e) &&
           stopping_rule_samples(&g->r->image[image], &g->h->image[image],
                                 answer_key_image(g->a, set, image), out, e);
}
