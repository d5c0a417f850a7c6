/* Camera rays by lanes. */
#ifndef ASSAY_CAMERA_SIMD_H
#define ASSAY_CAMERA_SIMD_H

#include "camera.h"
#include "renderer/math/warp.h"

/* Origins and unit directions of the rays described at camera_ray(). */
INLINE void camera_rays(const struct camera *c, vf x, vf y, vf u, vf v, vec3v *o, vec3v *d)
{
    vf sx = (2 * x / (float)c->width - 1) * c->tan_h;
    vf sy = (1 - 2 * y / (float)c->height) * c->tan_v;
    const vec3v right = v3_all(c->right), up = v3_all(c->up);
    *d = subv(madv(scalev(right, sx), sy, up), v3_all(c->backward));
    *o = v3_all(c->eye);
    if (c->is_orthographic) {
        *o = addv(*o, madv(scalev(right, sx), sy, up));
        *d = v3_all(neg(c->backward));
    }
    if (c->lens_radius > 0) {
        vf lx, ly;
        warp_disk(u, v, &lx, &ly);
        /* Both as seen from the eye: far from the origin their difference would be lost. */
        vec3v focus = scalev(*d, vf_set(c->focal_distance));
        vec3v lens = madv(scalev(right, lx * c->lens_radius), ly * c->lens_radius, up);
        *o = addv(*o, lens);
        *d = subv(focus, lens);
    }
    *d = normalizev(*d);
}

#endif
