/* A suite of one's own, judged again after a change that changed no image: the engine gets the seeds of the stored
 * reference first. The same bits need no statistics, so they are EQUIVALENT however noisy the images are. Other images of
 * the same seeds are not used: with common random numbers the noise of both sides may cancel, or add. */
#include "validate_internal.h"

#include "reference/base/json_node.h"

#include <stdio.h>
#include <string.h>

bool repeated_seeds_render(struct validation *v, struct claim_run *t, struct side_image *image[2])
{
    struct side *again = &t->again, *a = t->a;
    if (!v->opt->repeats_seeds || a->kind != SIDE_ENGINE || t->b->kind != SIDE_GOLDEN ||
        t->expected != VERDICT_EQUIVALENT || side_at(v, t->b, 0, t->next, &image[1]) != FETCH_OK)
        return false;
    const json_t *stored = image[1]->manifest, *images = json_object_get(stored, "images_sha256"),
                 *seed = json_object_get(stored, "seed");
    const struct validate_options *o = v->opt;
    const int spp = o->engine_spp > 0 ? o->engine_spp : o->engine->spp,
              replicates = o->engine_replicates > 0 ? o->engine_replicates : o->engine->replicates;
    if (json_array_size(images) < (size_t)replicates || !json_is_integer(seed) ||
        member_number(stored, "spp") != spp)
        return false;
    *again = (struct side){.kind = SIDE_ENGINE,
                           .name = a->name,
                           .scene = a->scene,
                           .users = 1,
                           .of = t->b->name,
                           .seed = (uint32_t)json_integer_value(seed),
                           .same_as = images};
    if (side_at(v, again, 0, t->next, &image[0]) == FETCH_OK) {
        a->users--;
        t->a = again;
        return true;
    }
    /* A program that crashes does so with other seeds, too. */
    if (again->failed && !again->differs) {
        a->failed = true;
        a->e = again->e;
    }
    side_free(again);
    return false;
}

/* A copy whose mean has no error. */
static bool without_noise(const struct moments *m, struct moments *out, struct err *e)
{
    const size_t pixels = (size_t)m->width * (size_t)m->height;
    if (!moments_copy(m, out, e))
        return false;
    strcpy(out->unit, "exact");
    out->sharing = 0;
    for (size_t p = 0; p < pixels; p++)
        out->n[p] = 1;
    memset(out->m2, 0, 3 * pixels * sizeof *out->m2);
    memset(out->m3, 0, 3 * pixels * sizeof *out->m3);
    return true;
}

bool repeated_seeds_judge(struct side_image *const image[2], const struct compare_options *opt,
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
