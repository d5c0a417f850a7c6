/* Closed forms of light that mirrors reflect and smooth glass reflects and refracts, by geometrical
 * optics: no randomness, every path is found by unfolding.
 *
 * kind          "values" in the .json (all keys needed, no others; triples are R, G, B)
 * mirror_box    x [left, right], y [bottom, top], z [end, back] of the box, eye, tan_half,
 *               split [x, y], radiance {left_top, right_top, left_bottom}, reflectance {left, right,
 *               bottom, top, end, back}
 * glass_slab    view (truth_pixel_mean.h), ior, front, behind [radiance on either side]
 * glass_sphere  view, ior, centre, radius, room {x, y, z: [lo, hi]}, walls {left, right, bottom, top,
 *               far, near: radiance of the walls at x lo, x hi, y lo, y hi, z lo, z hi}
 * snell_window  view, ior, sky, floor [radiance]
 *
 * mirror_box: the camera at `eye` looks along -Z, image up being +Y; tan_half is the tangent of half
 * its angle. All walls are mirrors but three of the four panels into which `split` divides the end:
 * these glow and reflect nothing. The image is constant on rectangles whose sides are parallel to the
 * pixels' sides, and is integrated exactly.
 * glass_slab: a slab parallel to the plane z = 0 with clear sides far away; what is on the side of +Z,
 * where the eye is, has the radiance `front`, what is on the other side `behind`.
 * glass_sphere: in a closed room of black glowing walls; the eye in the room, outside the sphere.
 * snell_window: the plane y = 0 bounds glass below it. The eye is in the glass and looks up. Above, the radiance
 * `sky` comes from everywhere; what the surface reflects comes from a floor of radiance `floor`.
 * Glass absorbs nothing. Every reflection and every refraction counts as one bounce. */
#ifndef ASSAY_TRUTH_MIRRORS_AND_GLASS_H
#define ASSAY_TRUTH_MIRRORS_AND_GLASS_H

#include "truth.h"

extern const struct truth_kind truth_mirrors_and_glass[]; /* ends with a NULL name */

/* Unpolarised reflectance of a smooth boundary by Fresnel's equations [Born99 1.5.2]; cos_i in (0,1],
 * n: index behind over index in front. *cos_t (may be NULL): cosine behind, 0 under total reflection. */
double truth_fresnel(double cos_i, double n, double *cos_t);

struct truth_mirror_box {
    double x[2], y[2], z[2], eye[3], tan_half, split[2];
    double radiance[4][3]; /* left top, right top, left bottom, right bottom (a mirror: unused) */
    double reflectance[6][3]; /* left, right, bottom, top, end, back */
};

/* Radiance that arrives from the direction (sx, sy, -1) on paths of at most `depth` bounces. */
void truth_mirror_box_radiance(const struct truth_mirror_box *b, int depth, double sx, double sy,
                               double light[3]);

/* Weights of the radiances in front of and behind the slab in what is seen under cos_i, by at most `depth` bounces. */
void truth_slab_shares(double cos_i, double n, int depth, double *front, double *behind);

/* Shares of floor and sky in the radiance inside that is seen under the angle with that cosine from the
 * normal: F and n^2 (1 - F), F by Fresnel's equations from inside [Veach97 5.2]. */
void truth_window_shares(double cosine, double n, double *floor, double *sky);

struct truth_glass_sphere {
    double n, centre[3], radius;
    double room[3][2];  /* x, y, z */
    double walls[6][3]; /* x lo, x hi, y lo, y hi, z lo, z hi */
    int depth;
};

/* Radiance that arrives at `eye` from the unit direction d. Returns a number that tells which walls it comes
 * from along which paths: a truth_shade (truth_pixel_mean.h) whose form is a struct truth_glass_sphere. */
int truth_glass_sphere_radiance(const void *sphere, const double eye[3], const double d[3],
                                double light[3]);

#endif
