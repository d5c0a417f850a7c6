/* Export to Cycles: point, spot and directional lights, and the environment. */
#include "export_cycles_internal.h"

#include "reference/replicates/replicate_images.h"
#include "renderer/base/fs.h"
#include "renderer/scene/environment.h"

static json_t *falling_off(const struct light *l, const char *kind)
{
    const float *a = l->attenuation;
    return json_pack("{ss,so,so,so}", "kind", kind, "position", cycles_vec3(l->position), "value",
                     cycles_rgb(l->value), "attenuation", cycles_vec3(v3(a[0], a[1], a[2])));
}

static json_t *spot(const struct light *l)
{
    json_t *o = falling_off(l, "spot");
    json_object_update_new(o, json_pack("{so,sf,sf}", "axis", cycles_vec3(l->axis), "cos_cutoff",
                                        (double)l->cos_cutoff, "exponent", (double)l->exponent));
    return o;
}

json_t *cycles_lights(const struct scene *s)
{
    json_t *out = json_array();
    for (uint32_t i = 0; i < s->num_lights; i++) {
        const struct light *l = &s->lights[i];
        switch (l->kind) {
        case LIGHT_POINT: json_array_append_new(out, falling_off(l, "point")); break;
        case LIGHT_SPOT: json_array_append_new(out, spot(l)); break;
        case LIGHT_DIRECTIONAL:
            json_array_append_new(out, json_pack("{ss,so,so}", "kind", "directional", "to_light",
                                                 cycles_vec3(l->to_light), "irradiance",
                                                 cycles_rgb(l->value)));
            break;
        case LIGHT_ENVIRONMENT: /* a part of its own */
        case LIGHT_TRIANGLES:   /* by their material */
        case LIGHT_SPHERE: break;
        }
    }
    return out;
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
    *image_written =
        replicate_images_write(image_path, (int)p.width, (int)p.height, &p.texel->r, e);
    return *image_written ? json_pack("{ss,ss}", "kind", "image", "file", fs_base(image_path))
                          : NULL;
}
