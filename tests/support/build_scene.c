#include "build_scene.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROOM = 4096 };

static void *array(size_t size)
{
    void *p = calloc(ROOM, size);
    assert(p != NULL);
    return p;
}

struct scene build_scene(void)
{
    struct scene s = {.dialect = DIALECT_COLLADA};
    s.position = array(3 * sizeof *s.position);
    s.normal = array(3 * sizeof *s.normal);
    s.tri_material = array(sizeof *s.tri_material);
    s.tri_object = array(sizeof *s.tri_object);
    s.spheres = array(sizeof *s.spheres);
    s.sphere_material = array(sizeof *s.sphere_material);
    s.sphere_object = array(sizeof *s.sphere_object);
    s.materials = array(sizeof *s.materials);
    s.lights = array(sizeof *s.lights);
    s.objects = array(sizeof *s.objects);
    s.uv = array(3 * sizeof *s.uv);
    s.images = array(sizeof *s.images);
    s.textures = array(sizeof *s.textures);
    return s;
}

uint32_t build_material(struct scene *s, rgb reflectance, rgb radiance)
{
    assert(s->num_materials < ROOM);
    s->materials[s->num_materials] = (struct material){
        .name = "m", .kind = MATERIAL_DIFFUSE, .reflectance = reflectance, .radiance = radiance};
    return s->num_materials++;
}

uint32_t build_like(struct scene *s, struct material m)
{
    uint32_t i = build_material(s, m.reflectance, m.radiance);
    memcpy(m.name, s->materials[i].name, sizeof m.name);
    s->materials[i] = m;
    return i;
}

static struct object *new_object(struct scene *s, uint32_t material)
{
    assert(s->num_objects < ROOM);
    struct object *o = &s->objects[s->num_objects++];
    *o = (struct object){.name = "o",
                         .first_triangle = s->num_triangles,
                         .first_sphere = s->num_spheres,
                         .material = material};
    return o;
}

static void put_triangle(struct scene *s, vec3 a, vec3 b, vec3 c, uint32_t material)
{
    assert(s->num_triangles < ROOM);
    uint32_t i = s->num_triangles++;
    vec3 n = normalize(cross(sub(b, a), sub(c, a)));
    vec3 *p = s->position + 3 * (size_t)i;
    p[0] = a;
    p[1] = b;
    p[2] = c;
    for (int k = 0; k < 3; k++)
        s->normal[3 * i + (uint32_t)k] = n;
    s->tri_material[i] = material;
    s->tri_object[i] = s->num_objects - 1;
}

void build_quad(struct scene *s, vec3 p, vec3 u, vec3 v, uint32_t material)
{
    struct object *o = new_object(s, material);
    put_triangle(s, p, add(p, u), add(add(p, u), v), material);
    put_triangle(s, p, add(add(p, u), v), add(p, v), material);
    o->num_triangles = 2;
    const struct uv corners[6] = {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}};
    memcpy(s->uv + 3 * (size_t)o->first_triangle, corners, sizeof corners);
}

uint32_t build_texture(struct scene *s, int width, int height, const rgb *colours, bool nearest,
                       enum texture_wrap wrap)
{
    assert(s->num_images < ROOM);
    struct image *im = &s->images[s->num_images++];
    *im = build_image(width, height);
    memcpy(im->data, colours, (size_t)width * (size_t)height * sizeof *colours);
    s->textures[s->num_textures++] = (struct texture){.width = width,
                                                      .height = height,
                                                      .wrap = {wrap, wrap},
                                                      .nearest = nearest,
                                                      .texel = im->data};
    return s->num_textures;
}

void build_uv(struct scene *s, uint32_t first, float scale, struct uv offset)
{
    for (size_t k = 3 * (size_t)first; k < 3 * (size_t)s->num_triangles; k++)
        s->uv[k] = (struct uv){offset.u + scale * s->uv[k].u, offset.v + scale * s->uv[k].v};
}

void build_triangle(struct scene *s, vec3 a, vec3 b, vec3 c, uint32_t material)
{
    struct object *o = new_object(s, material);
    put_triangle(s, a, b, c, material);
    o->num_triangles = 1;
}

void build_sphere(struct scene *s, vec3 centre, float radius, float normal_out, uint32_t material)
{
    assert(s->num_spheres < ROOM);
    struct object *o = new_object(s, material);
    o->num_spheres = 1;
    s->sphere_material[s->num_spheres] = material;
    s->sphere_object[s->num_spheres] = s->num_objects - 1;
    s->spheres[s->num_spheres++] =
        (struct sphere){.centre = centre, .radius = radius, .normal_out = normal_out};
}

void build_join(struct scene *s, uint32_t first)
{
    struct object *o = &s->objects[first];
    o->num_triangles = s->num_triangles - o->first_triangle;
    for (uint32_t i = o->first_triangle; i < s->num_triangles; i++)
        s->tri_object[i] = first;
    s->num_objects = first + 1;
}

void build_box(struct scene *s, vec3 p, vec3 d, uint32_t material)
{
    vec3 x = {d.x, 0, 0}, y = {0, d.y, 0}, z = {0, 0, d.z}, q = add(p, d);
    uint32_t first = s->num_objects;
    build_quad(s, p, y, x, material);
    build_quad(s, p, x, z, material);
    build_quad(s, p, z, y, material);
    build_quad(s, q, neg(x), neg(y), material);
    build_quad(s, q, neg(z), neg(x), material);
    build_quad(s, q, neg(y), neg(z), material);
    build_join(s, first);
}

void build_light(struct scene *s, struct light light)
{
    assert(s->num_lights < ROOM);
    s->lights[s->num_lights++] = light;
}

void build_point(struct scene *s, vec3 position, rgb value)
{
    build_light(s, (struct light){.kind = LIGHT_POINT,
                                  .value = value,
                                  .position = position,
                                  .attenuation = {0, 0, 1}});
}

void build_spot(struct scene *s, vec3 position, vec3 axis, float cos_cutoff, float exponent,
                rgb value)
{
    build_light(s, (struct light){.kind = LIGHT_SPOT,
                                  .value = value,
                                  .position = position,
                                  .axis = axis,
                                  .cos_cutoff = cos_cutoff,
                                  .exponent = exponent,
                                  .attenuation = {0, 0, 1}});
}

void build_sun(struct scene *s, vec3 to_light, rgb value)
{
    build_light(s, (struct light){.kind = LIGHT_DIRECTIONAL, .value = value, .to_light = to_light});
}

struct scene build_room(float radiance)
{
    struct scene s = build_scene();
    uint32_t white = build_material(&s, grey(0.6f), grey(0));
    uint32_t red = build_material(&s, (rgb){0.6f, 0.2f, 0.2f}, grey(0));
    uint32_t lamp = build_material(&s, grey(0), grey(radiance));
    build_quad(&s, v3(-1, 0, 1), v3(2, 0, 0), v3(0, 0, -2), white);
    build_quad(&s, v3(-1, 1.5f, -1), v3(2, 0, 0), v3(0, 0, 2), white);
    build_quad(&s, v3(-1, 0, -1), v3(2, 0, 0), v3(0, 1.5f, 0), white);
    build_quad(&s, v3(-1, 0, 1), v3(0, 0, -2), v3(0, 1.5f, 0), red);
    build_quad(&s, v3(-0.3f, 1.49f, -0.4f), v3(0.6f, 0, 0), v3(0, 0, 0.8f), lamp);
    build_sphere(&s, v3(0.4f, 0.3f, 0.3f), 0.3f, 1, white);
    build_camera(&s, v3(0, 0.75f, 3), 49);
    return s;
}

struct image build_image(int width, int height)
{
    struct err e;
    struct image im;
    if (!image_alloc(&im, width, height, 3, (const char *const[]){"R", "G", "B"}, &e))
        abort();
    return im;
}

void build_camera(struct scene *s, vec3 eye, float hfov_degrees)
{
    s->camera = (struct scene_camera){.present = true,
                                      .right = {1, 0, 0},
                                      .up = {0, 1, 0},
                                      .backward = {0, 0, 1},
                                      .eye = eye,
                                      .hfov = hfov_degrees * PI_F / 180,
                                      .near = 1e-3f,
                                      .far = 1e6f};
}

struct camera build_finish(struct scene *s, int width, int height)
{
    struct err e;
    struct camera c;
    if (scene_finish(s, "test", &e) && camera_init(&c, s, width, height, &e))
        return c;
    fprintf(stderr, "%s\n", e.msg);
    abort();
}
