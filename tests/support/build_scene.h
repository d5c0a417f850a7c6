/* Scenes built in C, so that tests of the renderer do not depend on the loader. */
#ifndef ASSAY_BUILD_SCENE_H
#define ASSAY_BUILD_SCENE_H

#include "renderer/scene/camera.h"
#include "renderer/scene/scene.h"

/* An empty scene with room for 4096 triangles, spheres, materials, ... each; the helpers below
 * append to it, and abort on overflow; scene_finish() completes it, scene_free() frees it. */
struct scene build_scene(void);

/* Append a diffuse material, or a copy of m but for the name; return its index. */
uint32_t build_material(struct scene *s, rgb reflectance, rgb radiance);
uint32_t build_like(struct scene *s, struct material m);
/* Parallelogram p, p+u, p+u+v, p+v as two triangles of one object; front side u x v. */
void build_quad(struct scene *s, vec3 p, vec3 u, vec3 v, uint32_t material);
void build_triangle(struct scene *s, vec3 a, vec3 b, vec3 c, uint32_t material);
/* Appends a texture of width x height colours, by rows from the top, as an image of its own;
 * returns the map's number, from 1. Quads have the coordinates (0,0) at p and (1,1) at p+u+v;
 * build_uv() scales those of triangle `first` and all after it, and then adds the offset. */
uint32_t build_texture(struct scene *s, int width, int height, const rgb *colours, bool nearest,
                       enum texture_wrap wrap);
void build_uv(struct scene *s, uint32_t first, float scale, struct uv offset);
void build_sphere(struct scene *s, vec3 centre, float radius, float normal_out, uint32_t material);
/* Joins object `first` and all after it, all of triangles, into one. */
void build_join(struct scene *s, uint32_t first);
/* A closed box from p to p + d, front sides outside; one object. */
void build_box(struct scene *s, vec3 p, vec3 d, uint32_t material);
void build_light(struct scene *s, struct light light);
/* Point and spot lights fall off with the inverse square of the distance; to_light: unit direction
 * to the sun. */
void build_point(struct scene *s, vec3 position, rgb value);
void build_spot(struct scene *s, vec3 position, vec3 axis, float cos_cutoff, float exponent,
                rgb value);
void build_sun(struct scene *s, vec3 to_light, rgb value);
/* Pinhole at `eye` looking along -Z with Y up, full horizontal angle in degrees. */
void build_camera(struct scene *s, vec3 eye, float hfov_degrees);

/* Half a room of 2 x 1.5 x 2 over the origin, its left wall red, with a lamp below its ceiling, a white ball in it, and a
 * camera before it: 11 primitives, not completed. Materials: white, red, lamp. */
struct scene build_room(float radiance);

/* Black, of channels R, G, B. The caller frees. */
struct image build_image(int width, int height);

/* Completes the scene and returns its camera for so many pixels; aborts on failure. */
struct camera build_finish(struct scene *s, int width, int height);

#endif
