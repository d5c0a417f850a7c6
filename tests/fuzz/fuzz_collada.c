/* COLLADA files; a scene that was loaded has to hold all that the renderer relies on. */
#include "renderer/scene/camera.h"
#include "renderer/collada/collada.h"
#include "fuzz.h"

#include <math.h>

/* Images are looked for beside this path, where those of the suite are. */
#define PLACE "reference/scenes/fuzz.dae"

static int finite3(vec3 v)
{
    return isfinite(v.x) && isfinite(v.y) && isfinite(v.z);
}

static void check_light(const struct scene *s, const struct light *l)
{
    if (l->kind == LIGHT_TRIANGLES)
        fuzz_require(l->count > 0 && l->first < s->num_triangles &&
                         l->count <= s->num_triangles - l->first && l->area > 0,
                     "a light of triangles that are not there");
    if (l->kind == LIGHT_SPHERE)
        fuzz_require(l->first < s->num_spheres && l->area > 0,
                     "a light of a sphere that is not there");
}

static void check_scene(const struct scene *s)
{
    fuzz_require(s->dialect != DIALECT_AUTO, "a dialect left open");
    for (uint32_t i = 0; i < s->num_triangles; i++) {
        fuzz_require(s->tri_material[i] < s->num_materials && s->tri_object[i] < s->num_objects &&
                         s->tri_light[i] < (int32_t)s->num_lights,
                     "a triangle's index is out of range");
        for (uint32_t k = 3 * i; k < 3 * i + 3; k++)
            fuzz_require(finite3(s->position[k]) && fabsf(length(s->normal[k]) - 1) < 1e-3f,
                         "a corner or a normal is not a number");
    }
    for (uint32_t i = 0; i < s->num_spheres; i++)
        fuzz_require(s->sphere_material[i] < s->num_materials &&
                         s->sphere_object[i] < s->num_objects &&
                         s->sphere_light[i] < (int32_t)s->num_lights && s->spheres[i].radius > 0 &&
                         isfinite(s->spheres[i].radius) && finite3(s->spheres[i].centre),
                     "a sphere's index or size is out of range");
    for (uint32_t i = 0; i < s->num_lights; i++)
        check_light(s, &s->lights[i]);
    for (uint32_t i = 0; i < s->num_materials; i++) {
        const struct material *m = &s->materials[i];
        fuzz_require(m->reflectance_map <= s->num_textures && m->radiance_map <= s->num_textures &&
                         (s->uv != NULL || !material_has_map(m)),
                     "a map that is not there");
    }
    for (size_t k = 0; s->uv != NULL && k < 3 * (size_t)s->num_triangles; k++)
        for (uint32_t i = 0; i < s->num_textures; i++) {
            rgb c = texture_lookup(&s->textures[i], s->uv[k]);
            fuzz_require(isfinite(c.r + c.g + c.b), "a texel that is not a number");
        }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const enum dialect dialects[] = {DIALECT_AUTO, DIALECT_COLLADA, DIALECT_CGL};
    for (int i = 0; i < 3; i++) {
        struct scene s;
        struct camera c;
        struct err e = {""};
        if (!collada_parse((const char *)data, size, PLACE, dialects[i], &s, &e)) {
            fuzz_check_line(&e, PLACE);
            continue;
        }
        check_scene(&s);
        if (!camera_init(&c, &s, 40, 30, &e))
            fuzz_check_line(&e, NULL);
        for (uint32_t k = 0; k < s.num_cameras; k++) {
            fuzz_require(scene_choose_camera(&s, s.cameras[k].name), "a camera without its name");
            fuzz_require(camera_init(&c, &s, 40, 30, &e), "a camera that is none");
            ray r = camera_ray(&c, 3, 4, 0.5f, 0.5f);
            fuzz_require(finite3(r.o) && fabsf(length(r.d) - 1) < 1e-3f, "a ray that is none");
        }
        scene_free(&s);
    }
    return 0;
}
