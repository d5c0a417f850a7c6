#include "povray_texture.h"

#include <math.h>

/* Texels first .. first + count - 1 of the infinitely repeated row: all that a material's triangles
 * show. */
struct stretch {
    long first, count;
};

/* Those of a material, along u (axis 0) or v. */
static struct stretch stretch_of(const struct scene *s, uint32_t material, const struct texture *t,
                                 int axis)
{
    const double n = axis == 0 ? t->width : t->height;
    double lo = INFINITY, hi = -INFINITY;
    for (size_t k = 0; k < 3 * (size_t)s->num_triangles; k++)
        if (s->tri_material[k / 3] == material) {
            double x = axis == 0 ? (double)s->uv[k].u : (double)s->uv[k].v;
            lo = fmin(lo, x);
            hi = fmax(hi, x);
        }
    if (!(lo <= hi))
        return (struct stretch){0, 1};
    /* One more on each side, for interpolation beyond the outermost centres. */
    long first = (long)floor(lo * n) - 1;
    return (struct stretch){first, (long)floor(hi * n) + 2 - first};
}

static bool check_map(const struct scene *s, uint32_t material, uint32_t map, struct err *e)
{
    const struct texture *t = &s->textures[map - 1];
    const long most = t->nearest ? POVRAY_MOST_TEXELS / 2 : POVRAY_MOST_TEXELS;
    const long across = stretch_of(s, material, t, 0).count,
               up = stretch_of(s, material, t, 1).count;
    return (across <= most && up <= most) ||
           err_set(
               e,
               "POV-Ray: material '%s' shows %ld x %ld texels, edges written out, of which %ld x "
               "%ld is the most",
               s->materials[material].name, across, up, most, most);
}

bool povray_check_textures(const struct scene *s, struct err *e)
{
    for (uint32_t i = 0; i < s->num_materials; i++) {
        const struct material *m = &s->materials[i];
        if (!material_has_map(m))
            continue;
        if (!rgb_is_zero(m->reflectance) && !rgb_is_zero(m->radiance))
            return err_set(e,
                           "POV-Ray cannot express material '%s': it reflects and glows, one of "
                           "both with a texture",
                           m->name);
        if ((m->reflectance_map != 0 && !check_map(s, i, m->reflectance_map, e)) ||
            (m->radiance_map != 0 && !check_map(s, i, m->radiance_map, e)))
            return false;
    }
    return true;
}

/* Positions of the map entries of item k of `count`: its centre or, if nearest, its two edges.
 * Returns how many. */
static int entries(long k, long count, bool nearest, double at[2])
{
    const double n = (double)count;
    at[0] = nearest ? (double)k / n : ((double)k + 0.5) / n;
    at[1] = ((double)k + 1) / n;
    return nearest ? 2 : 1;
}

static void put_row(const struct povray_writer *w, const struct texture *t, struct stretch x,
                    long row, rgb factor)
{
    struct texture exact = *t;
    exact.nearest = true;
    fprintf(w->f, "function { x*%.17g - %.17g } color_map {", t->width / (double)x.count,
            (double)x.first / (double)x.count);
    for (long k = 0; k < x.count; k++) {
        const struct uv centre = {((float)(x.first + k) + 0.5f) / (float)t->width,
                                  ((float)row + 0.5f) / (float)t->height};
        const rgb c = rgb_mul(factor, texture_lookup(&exact, centre));
        double at[2];
        for (int i = 0, n = entries(k, x.count, t->nearest, at); i < n; i++) {
            fprintf(w->f, "%s[%.9g ", k % 4 == 0 && i == 0 ? "\n      " : " ", at[i]);
            povray_put_rgb(w, "rgb ", (double)c.r, (double)c.g, (double)c.b, "]");
        }
    }
    fputs(" }", w->f);
}

void povray_put_texture(const struct povray_writer *w, uint32_t material, uint32_t map, rgb factor)
{
    const struct texture *t = &w->s->textures[map - 1];
    const struct stretch x = stretch_of(w->s, material, t, 0), y = stretch_of(w->s, material, t, 1);
    fprintf(w->f, "pigment { uv_mapping\n    function { y*%.17g - %.17g } pigment_map {",
            t->height / (double)y.count, (double)y.first / (double)y.count);
    for (long k = 0; k < y.count; k++) {
        double at[2];
        for (int i = 0, n = entries(k, y.count, t->nearest, at); i < n; i++) {
            fprintf(w->f, "\n    [%.9g ", at[i]);
            put_row(w, t, x, y.first + k, factor);
            fputc(']', w->f);
        }
    }
    fputs("\n  } }", w->f);
}
