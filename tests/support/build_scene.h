/* Scenes built in C, so that tests of the renderer do not lean on the loader. */
#ifndef ASSAY_BUILD_SCENE_H
#define ASSAY_BUILD_SCENE_H

#include "renderer/scene/camera.h"
#include "renderer/scene/scene.h"

/* An empty scene with room for a few hundred primitives; the helpers below append to it, and
 * scene_finish() completes it. Abort on overflow. */
struct scene build_scene(void);

uint32_t build_material(struct scene *s, rgb reflectance, rgb radiance);
/* One that is `m`, but for its name. */
uint32_t build_like(struct scene *s, struct material m);
/* Parallelogram p, p+u, p+u+v, p+v as two triangles of one object; front side u x v. */
void build_quad(struct scene *s, vec3 p, vec3 u, vec3 v, uint32_t material);
void build_triangle(struct scene *s, vec3 a, vec3 b, vec3 c, uint32_t material);
/* A texture of width x height colours by rows from the top, its own image; the map's number. Coordinates of quads are (0,0) at p and
 * (1,1) at p+u+v; build_uv() moves those of triangles from `first` on to offset + scale times that. */
uint32_t build_texture(struct scene *s, int width, int height, const rgb *colours, bool nearest,
                       enum texture_wrap wrap);
void build_uv(struct scene *s, uint32_t first, float scale, struct uv offset);
void build_sphere(struct scene *s, vec3 centre, float radius, float normal_out, uint32_t material);
/* Objects from that one on, of triangles, become one. */
void build_join(struct scene *s, uint32_t first);
/* Closed, from p to p + d, its front outside; one object. */
void build_box(struct scene *s, vec3 p, vec3 d, uint32_t material);
void build_light(struct scene *s, struct light light);
/* With the inverse square of the distance; the sun from `to_light` on. */
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

/* Completes the scene, and its camera for so many pixels; abort where that fails. */
struct camera build_finish(struct scene *s, int width, int height);

#endif
