/* A suite of one's own, judged again after a change: the engine gets the seeds of the stored reference first. The same
 * bits need no statistics, so they are EQUIVALENT however noisy the images are. Of other images each is compared with
 * the stored one of its seed, in means of blocks: where a change leaves most paths as they were, their noise cancels. A
 * pair's difference needs no assumption of how alike the two are, while images of the same seeds, taken as independent,
 * might have noise that cancels, or adds. What pairs leave undecided is judged by fresh seeds, each test with half of
 * alpha. */
#include "validate_internal.h"

#include "reference/base/json_node.h"
#include "reference/replicates/block_means.h"
#include "reference/replicates/independence.h"
#include "tools/compare/hint.h"
#include "tools/compare/region.h"
#include "tools/compare/verdict.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A copy whose mean has no error. */
static bool without_noise(const struct moments *m, struct moments *out, struct err *e)
{
    if (!moments_copy(m, out, e))
        return false;
    moments_make_exact(out);
    out->sharing = 0;
    return true;
}

static bool judge_bits(struct side_image *const image[2], const struct compare_options *opt,
                       struct comparison *out, struct err *e)
{
    struct compare_options exact = *opt;
    struct moments m[2] = {0};
    exact.margin_variance = 0; /* of the same bits the variance is the same */
    const bool ok = without_noise(&image[1]->m, &m[0], e) && moments_copy(&m[0], &m[1], e) &&
                    compare_moments(&m[0], &m[1], &exact, out, e);
    moments_free(&m[0]);
    moments_free(&m[1]);
    if (!ok)
        return false;
    const struct moments *b = &image[1]->m;
    out->variance = (struct variance_ratio){
        1, 1, 1, .valid = true, .of_paths = b->spp > 0, .is_shared = b->sharing > 0};
    const double all = member_number(image[1]->manifest, "replicates"),
                 num = member_number(image[0]->manifest, "replicates");
    char of[32] = "all";
    if (num < all)
        snprintf(of, sizeof of, "the first %g of", num);
    snprintf(out->reason, sizeof out->reason,
             "the same bits as %s %g images of the reference, seed by seed", of, all);
    return true;
}

/* From blocks to pixels. */
static void enlarge_region(struct region *r, const struct block_means *b)
{
    const int x1 = r->x + r->width, y1 = r->y + r->height;
    r->x *= b->side;
    r->y *= b->side;
    r->width = (x1 == b->nx ? b->width : x1 * b->side) - r->x;
    r->height = (y1 == b->ny ? b->height : y1 * b->side) - r->y;
}

static bool enlarge_image(struct image *im, const struct block_means *b, struct err *e)
{
    struct image large;
    const char *const name[1] = {im->names[0]};
    if (!image_alloc(&large, b->width, b->height, 1, name, e))
        return false;
    for (int y = 0; y < b->height; y++)
        for (int x = 0; x < b->width; x++) {
            const int bx = x / b->side < b->nx ? x / b->side : b->nx - 1,
                      by = y / b->side < b->ny ? y / b->side : b->ny - 1;
            large.data[(size_t)y * (size_t)b->width + (size_t)x] =
                im->data[(size_t)by * (size_t)b->nx + (size_t)bx];
        }
    image_free(im);
    *im = large;
    return true;
}

static bool enlarge(struct comparison *c, const struct block_means *b, struct err *e)
{
    for (int i = 0; i < 4; i++)
        enlarge_region(&c->global[i], b);
    enlarge_region(&c->worst, b);
    enlarge_region(&c->worst_tile, b);
    c->finest_side *= b->side;
    return enlarge_image(&c->z, b, e) && enlarge_image(&c->relative, b, e);
}

/* Do the differences of blocks vary independently, as sums of them need? Images may differ in how much they do. */
static bool share_no_noise(const struct block_means *a, const struct block_means *b, struct err *e)
{
    const size_t values = 3 * (size_t)a->nx * (size_t)a->ny;
    const struct square_noise *unlimited = NULL;
    struct shared_noise shared;
    struct replicates r;
    float *difference = malloc(values * sizeof *difference);
    bool ok = replicates_alloc(&r, a->nx, a->ny, a->num, e) && difference != NULL;
    for (int k = 0; ok && k < a->num && k < b->num; k++) {
        for (size_t i = 0; i < values; i++)
            difference[i] = a->value[values * (size_t)k + i] - b->value[values * (size_t)k + i];
        replicates_add(&r, difference);
    }
    ok = ok && r.num >= SHARED_NOISE_FEWEST && shared_noise_measure(&r, &shared, e) &&
         !(shared_noise_factor(&shared, INDEPENDENCE_ALPHA, &unlimited) > 1) && unlimited == NULL;
    replicates_free(&r);
    free(difference);
    return ok;
}

/* What decided, in pixels. False: nothing that is known by its place. */
static bool say_what_decided(struct comparison *c, const struct compare_options *opt)
{
    static const char by[] = "with the reference's seeds, image by image, ";
    char was[sizeof c->reason], where[96];
    memcpy(was, c->reason, sizeof was);
    if (c->verdict == VERDICT_EQUIVALENT) {
        snprintf(c->reason, sizeof c->reason, "%s%.200s", by, was);
        return true;
    }
    if (!verdict_rejects(c, STATISTIC_IMAGE, opt->alpha) &&
        !verdict_rejects(c, STATISTIC_PYRAMID, opt->alpha))
        return false;
    const struct region *w = &c->worst;
    const struct rect rect = {w->x, w->y, w->width, w->height};
    region_name(c->z.width, c->z.height, rect, w->channel, where, sizeof where);
    snprintf(
        c->reason, sizeof c->reason,
        "%s%s: difference %+.3g %% (standard error %.2g %%) is beyond the margin of %.3g %%, %s",
        by, where, 100 * w->difference, 100 * w->std_error, 100 * w->margin,
        verdict_p(w->log10_p).s);
    return true;
}

/* Adds what the difference looks like, which needs whole images; their noise is mostly the same. */
static bool add_hint(struct side_image *const image[2], struct comparison *c, struct err *e)
{
    struct moments m[2] = {0};
    const bool ok = without_noise(&image[0]->m, &m[0], e) &&
                    without_noise(&image[1]->m, &m[1], e) && hint_add(&m[0], &m[1], 1, c, e);
    moments_free(&m[0]);
    moments_free(&m[1]);
    return ok;
}

static bool judge_pairs(struct side_image *const image[2], const struct suite_scene *scene,
                        const struct compare_options *opt, struct comparison *out, struct err *e)
{
    struct block_means b[2] = {0};
    struct moments pairs = {0}, mean = {0};
    struct compare_options in_blocks = *opt;
    bool ok = true;
    for (int i = 0; ok && i < 2; i++)
        ok = block_means_from_json(json_object_get(image[i]->manifest, "blocks"), scene->width,
                                   scene->height, &b[i], e);
    ok = ok && scene->tile % b[1].side == 0 && share_no_noise(&b[0], &b[1], e) &&
         block_means_pair(&b[0], &b[1], &pairs, &mean, e);
    bool compared = false;
    if (ok) {
        in_blocks.tile = opt->tile / b[1].side;
        in_blocks.is_paired = true;
        compared = compare_moments(&pairs, &mean, &in_blocks, out, e);
        ok = compared && verdict_decides(out->verdict) && enlarge(out, &b[1], e) &&
             say_what_decided(out, &in_blocks) && add_hint(image, out, e);
    }
    if (compared && !ok)
        comparison_free(out);
    moments_free(&pairs);
    moments_free(&mean);
    block_means_free(&b[0]);
    block_means_free(&b[1]);
    return ok;
}

/* The engine of a claim with the seeds of its reference; false if that was not made with such seeds. */
static bool find_seeds(struct validation *v, struct claim_run *t, const json_t *stored)
{
    const json_t *images = json_object_get(stored, "images_sha256"),
                 *seed = json_object_get(stored, "seed");
    const struct validate_options *o = v->opt;
    const int spp = o->engine_spp > 0 ? o->engine_spp : o->engine->spp,
              replicates = o->engine_replicates > 0 ? o->engine_replicates : o->engine->replicates;
    if (json_array_size(images) < (size_t)replicates || !json_is_integer(seed) ||
        member_number(stored, "spp") != spp)
        return false;
    /* Pairs say nothing of the variance. */
    const bool makes_pairs =
        json_object_get(stored, "blocks") != NULL && !(t->ref.margin_variance > 0);
    t->again = (struct side){.kind = SIDE_ENGINE,
                             .name = t->a->name,
                             .scene = t->a->scene,
                             .users = 1,
                             .of = t->b->name,
                             .seed = (uint32_t)json_integer_value(seed),
                             .same_as = images,
                             .goes_on = makes_pairs};
    return true;
}

bool repeated_seeds_judge(struct validation *v, struct claim_run *t,
                          const struct compare_options *opt, struct side_image *image[2],
                          struct comparison *out)
{
    struct side *again = &t->again, *a = t->a;
    struct err ignored; /* what cannot be judged so is judged, or refused, by fresh seeds */
    if (!v->opt->repeats_seeds || a->kind != SIDE_ENGINE || t->b->kind != SIDE_GOLDEN ||
        t->expected != VERDICT_EQUIVALENT || side_at(v, t->b, 0, t->next, &image[1]) != FETCH_OK ||
        !find_seeds(v, t, image[1]->manifest))
        return false;
    bool decided = false;
    if (side_at(v, again, 0, t->next, &image[0]) == FETCH_OK) {
        struct compare_options half = *opt;
        half.alpha *= t->looks->share[t->next] / 2;
        t->tried_pairs = again->differs;
        decided = again->differs ? judge_pairs(image, t->scene, &half, out, &ignored)
                                 : judge_bits(image, opt, out, &ignored);
    } else if (again->failed && (again->goes_on || !again->differs)) {
        /* A program that crashes does so with other seeds, too. */
        a->failed = true;
        a->e = again->e;
    }
    if (!decided) {
        side_free(again);
        return false;
    }
    t->seeds = again->differs ? SEEDS_PAIRED : SEEDS_SAME_BITS;
    a->users--;
    t->a = again;
    return true;
}
