/* From pixels to rays: pinhole, thin lens or orthographic camera, and the pixel filter. */
#ifndef ASSAY_CAMERA_H
#define ASSAY_CAMERA_H

#include "pixel_filter.h"
#include "scene.h"

/* The camera of one image. Row 0 is the top row. Image-plane point (sx, sy), both in [-1,1] with
 * sy up, lies in direction sx*tan_h*right + sy*tan_v*up - backward; of an orthographic camera it lies
 * at eye + sx*tan_h*right + sy*tan_v*up in direction -backward. */
struct camera {
    vec3 eye, right, up, backward; /* unit, orthogonal */
    bool is_orthographic;
    float tan_h, tan_v;         /* tangents of the half angles of view; orthographic: half sizes */
    float near, far;            /* measured along the ray, as the assignment does */
    int width, height;          /* of the full image, pixels */
    float lens_radius;          /* 0: pinhole */
    float focal_distance;       /* of the plane in focus, along the axis */
    struct pixel_filter filter; /* all zero: the box of one pixel */
};

/* Frames the scene for an image of width x height pixels. COLLADA: keeps the file's pose and its
 * horizontal angle or size (the vertical one if it has no other), with square pixels. CGL: puts the
 * eye on the file's viewing direction, 1.5 diagonals of the frame box from its centre, fits the angle
 * to 800 x 600 pixels and crops to the size asked for. Pinhole. Fails if a COLLADA file has no camera. */
NODISCARD bool camera_init(struct camera *c, const struct scene *s, int width, int height,
                           struct err *e);

/* For a camera of the CGL dialect: at any size shows all that the assignment shows at 800 x 600. */
void camera_show_whole(struct camera *c);

/* Replaces pose and angles by those of a camera file of the assignment (its key D writes them).
 * The image's size stays. */
NODISCARD bool camera_read_file(struct camera *c, const char *path, struct err *e);

/* The ray through (x, y) in pixels, origin at the top left corner, lens point (u, v) in [0,1)^2. */
ray camera_ray(const struct camera *c, float x, float y, float u, float v);

#endif
