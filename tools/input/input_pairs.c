#include "input_pairs.h"

#include "input_internal.h"

#include <stdlib.h>
#include <string.h>

static const char all_the_same[] = "--paired: both sides are the same to the bit";

void input_pairs_of_images(struct input in[2], struct notes *notes)
{
    struct moments *m[2] = {&in[0].m, &in[1].m};
    size_t values = 3 * (size_t)m[0]->width * (size_t)m[0]->height;
    bool same = m[0]->width == m[1]->width && m[0]->height == m[1]->height &&
                memcmp(m[0]->mean, m[1]->mean, values * sizeof *m[0]->mean) == 0;
    for (int i = 0; i < 2; i++) {
        in[i].kind = same ? INPUT_MOMENTS : INPUT_IMAGE;
        in[i].is_guessed = true;
        if (same)
            moments_make_exact(m[i]);
    }
    input_notes_add(notes, "%s",
                    same ? all_the_same
                         : "--paired: the noise is that of A - B, whatever the sides state");
}

static bool fit(const char *const path[2], const struct replicate_dir r[2], struct err *e)
{
    if (r[0].num != r[1].num)
        return err_set(e, "--paired: %s has %d renders, %s has %d: each is compared with its pair",
                       path[0], r[0].num, path[1], r[1].num);
    if (r[0].width != r[1].width || r[0].height != r[1].height)
        return err_set(e, "A is %d x %d pixels, B is %d x %d", r[0].width, r[0].height, r[1].width,
                       r[1].height);
    for (int k = 0; r[0].name != NULL && r[1].name != NULL && k < r[0].num; k++)
        if (strcmp(r[0].name[k], r[1].name[k]) != 0)
            return err_set(e,
                           "--paired: %s/%s and %s/%s: renders of one seed need the same name in "
                           "both directories",
                           path[0], r[0].name[k], path[1], r[1].name[k]);
    return true;
}

/* Images of mean + A - B; without names. */
static bool differences(const struct replicate_dir r[2], const struct moments *mean,
                        struct replicate_dir *out, struct err *e)
{
    const size_t values = 3 * (size_t)r[0].width * (size_t)r[0].height;
    *out = (struct replicate_dir){.width = r[0].width, .height = r[0].height};
    out->rgb = calloc((size_t)r[0].num, sizeof *out->rgb);
    bool ok = out->rgb != NULL;
    for (int k = 0; ok && k < r[0].num; k++) {
        float *d = out->rgb[k] = malloc(values * sizeof *d);
        ok = d != NULL;
        out->num++;
        for (size_t i = 0; ok && i < values; i++)
            d[i] = (float)(mean->mean[i] + ((double)r[0].rgb[k][i] - (double)r[1].rgb[k][i]));
    }
    return ok || err_set(e, "out of memory for the differences of %d renders", r[0].num);
}

bool input_pairs_of_renders(const char *const path[2], const struct replicate_dir r[2],
                            struct input in[2], struct notes *notes, struct err *e)
{
    struct replicate_dir d = {0};
    in[0] = in[1] = (struct input){.kind = INPUT_REPLICATES};
    bool ok = fit(path, r, e) && replicate_dir_moments(&r[1], &in[1].m, e) &&
              differences(r, &in[1].m, &d, e);
    const size_t bytes = ok ? 3 * (size_t)r[0].width * (size_t)r[0].height * sizeof(float) : 0;
    bool same = true;
    for (int k = 0; ok && k < r[0].num; k++)
        same = same && memcmp(r[0].rgb[k], r[1].rgb[k], bytes) == 0;
    if (ok && same)
        ok = moments_copy(&in[1].m, &in[0].m, e);
    else if (ok)
        ok = input_measure_sharing(NULL, &d, &in[0], e) && replicate_dir_moments(&d, &in[0].m, e);
    if (ok) {
        moments_make_exact(&in[1].m);
        if (same)
            moments_make_exact(&in[0].m);
    }
    if (ok && same)
        input_notes_add(notes, "%s", all_the_same);
    else if (ok)
        input_notes_add(notes, "--paired: %d renders, each compared with B's of its %s", r[0].num,
                        r[0].name != NULL && r[1].name != NULL ? "name" : "place");
    replicate_dir_free(&d);
    return ok;
}
