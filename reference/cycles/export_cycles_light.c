#include "export_cycles_internal.h"

#include "renderer/scene/environment.h"

#include <string.h>

static json_t *falling_off(const struct light *l, const char *kind)
{
    const float *a = l->attenuation;
    return json_pack("{ss,so,so,so}", "kind", kind, "position", cycles_vec3(l->position), "value",
                     cycles_rgb(l->value), "attenuation", cycles_vec3(v3(a[0], a[1], a[2])));
}

static json_t *spot(const struct light *l)
{
    json_t *o = falling_off(l, "spot");
    json_t *cone = json_pack("{so,sf,sf}", "axis", cycles_vec3(l->axis), "cos_cutoff",
                             (double)l->cos_cutoff, "exponent", (double)l->exponent);
    if (json_object_update_missing(o, cone) != 0) {
        json_decref(o);
        o = NULL;
    }
    json_decref(cone);
    return o;
}

json_t *cycles_lights(const struct scene *s)
{
    json_t *out = json_array();
    for (uint32_t i = 0; i < s->num_lights; i++) {
        const struct light *l = &s->lights[i];
        switch (l->kind) {
        case LIGHT_POINT: cycles_push(&out, falling_off(l, "point")); break;
        case LIGHT_SPOT: cycles_push(&out, spot(l)); break;
        case LIGHT_DIRECTIONAL:
            cycles_push(&out,
                        json_pack("{ss,so,so}", "kind", "directional", "to_light",
                                  cycles_vec3(l->to_light), "irradiance", cycles_rgb(l->value)));
            break;
        case LIGHT_ENVIRONMENT: /* a part of its own */
        case LIGHT_TRIANGLES:   /* by their material */
        case LIGHT_SPHERE: break;
        }
    }
    return out;
}

static bool write_image(const struct environment_parts *p, const char *path, struct err *e)
{
    static const char *const NAMES[3] = {"R", "G", "B"};
    struct image im;
    if (!image_alloc(&im, (int)p->width, (int)p->height, 3, NAMES, e))
        return false;
    for (size_t i = 0; i < (size_t)p->width * p->height; i++) {
        im.data[3 * i] = p->texel[i].r;
        im.data[3 * i + 1] = p->texel[i].g;
        im.data[3 * i + 2] = p->texel[i].b;
    }
    bool ok = image_write_exr(path, &im, e);
    image_free(&im);
    return ok;
}

json_t *cycles_environment(const struct scene *s, const char *image_path, bool *image_written,
                           struct err *e)
{
    if (s->environment == NULL)
        return json_null();
    struct environment_parts p = environment_parts(s->environment);
    switch (p.kind) {
    case ENVIRONMENT_CONSTANT:
        return json_pack("{ss,so}", "kind", "constant", "radiance", cycles_rgb(p.radiance));
    case ENVIRONMENT_UPPER_HALF:
        return json_pack("{ss,so}", "kind", "upper_half", "radiance", cycles_rgb(p.radiance));
    case ENVIRONMENT_IMAGE: break;
    }
    *image_written = write_image(&p, image_path, e);
    if (!*image_written)
        return NULL;
    const char *slash = strrchr(image_path, '/');
    return json_pack("{ss,ss}", "kind", "image", "file", slash != NULL ? slash + 1 : image_path);
}
