#include "truth.h"

#include "truth_ggx.h"
#include "truth_lens.h"
#include "truth_lamps.h"
#include "truth_mirrors_and_glass.h"
#include "truth_sky.h"
#include "truth_sun.h"
#include "truth_values.h"

#include <stdio.h>
#include <string.h>

double truth_furnace(double emission, double albedo, int depth)
{
    double sum = 1;
    for (int k = 0; k < depth; k++)
        sum = 1 + albedo * sum;
    return emission * sum;
}

static bool fill_furnace(const struct suite_scene *scene, const struct suite_reference *ref,
                         struct moments *out, struct err *e)
{
    double emission[3], albedo[3];
    if (!truth_values_read(ref->values, e, "emission[3]>=0 albedo[3]=0..1", emission, albedo))
        return false;
    size_t pixels = (size_t)out->width * (size_t)out->height;
    for (size_t i = 0; i < 3 * pixels; i++)
        out->mean[i] = truth_furnace(emission[i % 3], albedo[i % 3], scene->depth);
    return true;
}

static const struct truth_kind furnaces[] = {{"furnace", fill_furnace, true}, {0}};

static const struct truth_kind *const families[] = {
    furnaces,  truth_lamps, truth_lens, truth_mirrors_and_glass,
    truth_ggx, truth_sky,   truth_sun,  truth_texture};

static const struct truth_kind *find_kind(const char *name)
{
    for (size_t i = 0; i < sizeof families / sizeof families[0]; i++)
        for (const struct truth_kind *k = families[i]; k->name != NULL; k++)
            if (strcmp(k->name, name) == 0)
                return k;
    return NULL;
}

bool truth_knows(const struct suite_scene *scene, const struct suite_reference *ref, struct err *e)
{
    const struct truth_kind *kind = find_kind(ref->kind);
    if (kind == NULL)
        return err_set(e, "unknown closed form");
    return scene->filter.radius == 0 || kind->by_any_filter ||
           err_set(e, "the closed form is known for the box of one pixel alone");
}

bool truth_render(const struct suite_scene *scene, const struct suite_reference *ref,
                  struct moments *out, struct err *e)
{
    struct moments m = {0};
    bool ok = moments_alloc(&m, scene->width, scene->height, e);
    if (ok) {
        moments_make_exact(&m);
        m.spp = 0;
        ok = truth_knows(scene, ref, e) && find_kind(ref->kind)->fill(scene, ref, &m, e);
    }
    if (!ok) {
        moments_free(&m);
        return err_prefix(e, "%s: truth '%s'", scene->name, ref->kind);
    }
    *out = m;
    return true;
}
