#include "truth_mirrors_and_glass.h"

#include "truth_pixel_mean.h"
#include "truth_values.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <gsl/gsl_math.h>
#include <gsl/gsl_sort.h>

double truth_fresnel(double cos_i, double n, double *cos_t)
{
    double sin_t2 = (1 - cos_i * cos_i) / (n * n), c = sin_t2 < 1 ? sqrt(1 - sin_t2) : 0;
    if (cos_t != NULL)
        *cos_t = c;
    double s = (cos_i - n * c) / (cos_i + n * c), p = (n * cos_i - c) / (n * cos_i + c);
    return 0.5 * (s * s + p * p);
}

/* Weight of the light that leaves a slab, or any body in which every internal reflection is like the first,
 * after j internal reflections (j + 2 bounces): (1 - f)^2 f^j, f being the reflectance on entry, or 0 if that is
 * more than `depth` bounces. */
static double glass_weight(double f, int j, int depth)
{
    return j + 2 <= depth ? (1 - f) * (1 - f) * gsl_pow_int(f, j) : 0;
}

static bool unpack_range(const char *name, const double v[2], struct err *e)
{
    return v[0] < v[1] || err_set(e, "%s is [%g, %g]: not a range", name, v[0], v[1]);
}

/* The mirror box. */

/* Where the unfolded coordinate t of a mirrored room [lo, hi] lies in the room itself, and how often
 * the way there from inside the room meets each of the two mirrors. */
static double fold(double t, const double range[2], int *at_lo, int *at_hi)
{
    double size = range[1] - range[0], inside = t - range[0];
    int cell = (int)floor(inside / size), count = abs(cell);
    inside -= cell * size;
    /* The first mirror met is the one on the side of t, then they take turns. */
    *at_lo = cell < 0 ? (count + 1) / 2 : count / 2;
    *at_hi = count - *at_lo;
    return cell % 2 == 0 ? range[0] + inside : range[1] - inside;
}

void truth_mirror_box_radiance(const struct truth_mirror_box *b, int depth, double sx, double sy,
                               double light[3])
{
    double length = b->z[1] - b->z[0];
    light[0] = light[1] = light[2] = 0;
    /* Arrival at the end after n reflections there and n at the back. */
    for (int n = 0; 2 * n <= depth; n++) {
        double way = b->eye[2] - b->z[0] + 2 * n * length;
        int met[6] = {[4] = n, [5] = n}, bounces = 0;
        double x = fold(b->eye[0] + sx * way, b->x, &met[0], &met[1]);
        double y = fold(b->eye[1] + sy * way, b->y, &met[2], &met[3]);
        for (int k = 0; k < 6; k++)
            bounces += met[k];
        if (bounces > depth)
            return;
        int panel = (x < b->split[0] ? 0 : 1) + (y < b->split[1] ? 2 : 0);
        if (panel == 3)
            continue;
        for (int c = 0; c < 3; c++) {
            light[c] = b->radiance[panel][c];
            for (int k = 0; k < 6; k++)
                light[c] *= pow(b->reflectance[k][c], met[k]);
        }
        return;
    }
}

/* Slopes between -tan_half and tan_half at which a mirror or the panels' border begins, in any of the
 * arrivals, and the borders of `pixels` pixels; sorted. The caller frees; NULL without memory. */
static double *breaks(const struct truth_mirror_box *b, int depth, int axis, int pixels, int *num)
{
    const double *range = axis == 0 ? b->x : b->y, size = range[1] - range[0];
    double t = b->tan_half, length = b->z[1] - b->z[0];
    double longest = b->eye[2] - b->z[0] + 2 * (depth / 2) * length;
    int cells = (int)ceil(t * longest / size) + 2;
    double *s =
        calloc((size_t)(depth / 2 + 1) * (size_t)(4 * cells + 2) + (size_t)pixels + 1, sizeof *s);
    if (s == NULL)
        return NULL;
    int n = 0;
    for (int i = 0; i <= pixels; i++)
        s[n++] = t * (2.0 * i / pixels - 1);
    for (int k = 0; k <= depth / 2; k++) {
        double way = b->eye[2] - b->z[0] + 2 * k * length;
        for (int cell = -cells; cell <= cells; cell++) {
            double edge = range[0] + cell * size, split = b->split[axis] - range[0];
            double at[2] = {edge, edge + (cell % 2 == 0 ? split : size - split)};
            for (int i = 0; i < 2; i++) {
                double slope = (at[i] - b->eye[axis]) / way;
                if (fabs(slope) < t)
                    s[n++] = slope;
            }
        }
    }
    gsl_sort(s, 1, (size_t)n);
    *num = n;
    return s;
}

static bool box_values(const json_t *values, struct truth_mirror_box *b, struct err *e)
{
    double(*l)[3] = b->radiance, (*r)[3] = b->reflectance;
    if (!truth_values_read(
            values, e,
            "x[2] y[2] z[2] eye[3] tan_half>0 split[2] "
            "radiance.left_top[3]>=0 radiance.right_top[3]>=0 radiance.left_bottom[3]>=0 "
            "reflectance.left[3]=0..1 reflectance.right[3]=0..1 reflectance.bottom[3]=0..1 "
            "reflectance.top[3]=0..1 reflectance.end[3]=0..1 reflectance.back[3]=0..1",
            b->x, b->y, b->z, b->eye, &b->tan_half, b->split, l[0], l[1], l[2], r[0], r[1], r[2],
            r[3], r[4], r[5]))
        return false;
    if (!unpack_range("x", b->x, e) || !unpack_range("y", b->y, e) || !unpack_range("z", b->z, e))
        return false;
    const double *range[3] = {b->x, b->y, b->z};
    for (int k = 0; k < 3; k++)
        if (!(b->eye[k] > range[k][0] && b->eye[k] < range[k][1]))
            return err_set(e, "the eye is not inside the box");
    for (int k = 0; k < 2; k++)
        if (!(b->split[k] >= range[k][0] && b->split[k] <= range[k][1]))
            return err_set(e, "split[%d] is not inside the end", k);
    return true;
}

static bool fill_mirror_box(const struct suite_scene *scene, const struct suite_reference *ref,
                            struct moments *out, struct err *e)
{
    struct truth_mirror_box b = {0};
    if (!box_values(ref->values, &b, e))
        return false;
    if (out->width != out->height)
        return err_set(e, "the image is %d x %d, not square", out->width, out->height);
    int size = out->width, num_x, num_y;
    double pixel = 2 * b.tan_half / size;
    double *x = breaks(&b, scene->depth, 0, size, &num_x);
    double *y = breaks(&b, scene->depth, 1, size, &num_y);
    bool ok = x != NULL && y != NULL;
    if (!ok)
        err_set(e, "out of memory");
    for (int j = 0; ok && j + 1 < num_y; j++)
        for (int i = 0; i + 1 < num_x; i++) {
            double sx = 0.5 * (x[i] + x[i + 1]), sy = 0.5 * (y[j] + y[j + 1]), light[3];
            double area = (x[i + 1] - x[i]) * (y[j + 1] - y[j]);
            int col = (int)((sx + b.tan_half) / pixel), row = (int)((b.tan_half - sy) / pixel);
            if (area == 0)
                continue;
            truth_mirror_box_radiance(&b, scene->depth, sx, sy, light);
            for (int c = 0; c < 3; c++)
                out->mean[3 * ((size_t)row * (size_t)size + (size_t)col) + (size_t)c] +=
                    light[c] * area / (pixel * pixel);
        }
    free(x);
    free(y);
    return ok;
}

/* The slab, and the window, which is its surface seen from inside. */

struct pane {
    double n, front[3], behind[3]; /* radiance; of a window: below and above it */
    int depth;
    bool is_window;
};

void truth_slab_shares(double cos_i, double n, int depth, double *front, double *behind)
{
    double f = truth_fresnel(cos_i, n, NULL), share[2] = {0, 0};
    for (int j = 0; j + 2 <= depth; j++)
        share[j % 2] += glass_weight(f, j, depth);
    *behind = share[0];
    *front = share[1] + (depth >= 1 ? f : 0);
}

void truth_window_shares(double cosine, double n, double *floor, double *sky)
{
    *floor = truth_fresnel(cosine, 1 / n, NULL);
    *sky = n * n * (1 - *floor);
}

static int pane_radiance(const void *form, const double eye[3], const double d[3], double light[3])
{
    const struct pane *s = form;
    double front, behind;
    (void)eye;
    if (s->is_window)
        truth_window_shares(d[1], s->n, &front, &behind);
    else
        truth_slab_shares(fabs(d[2]), s->n, s->depth, &front, &behind);
    for (int c = 0; c < 3; c++)
        light[c] = front * s->front[c] + behind * s->behind[c];
    return s->is_window ? behind > 0 : d[2] < 0;
}

static bool fill_pane(const struct suite_scene *scene, const struct suite_reference *ref,
                      struct moments *out, struct err *e)
{
    struct pane s = {.depth = scene->depth, .is_window = strcmp(ref->kind, "snell_window") == 0};
    struct truth_view view;
    if (!truth_values_read(ref->values, e,
                           s.is_window ? "(view) ior>1 floor[3]>=0 sky[3]>=0"
                                       : "(view) ior>1 front[3]>=0 behind[3]>=0",
                           &s.n, s.front, s.behind) ||
        !truth_view_read(ref->values, scene, &view, e) ||
        (s.is_window && !truth_check_depth(scene, e)))
        return false;
    if (s.is_window && !(view.eye[1] < 0))
        return err_set(e, "the eye is at height %g, not below the surface", view.eye[1]);
    for (int k = 0; k < 4; k++) {
        double d[3];
        truth_view_direction(&view, k % 2 ? 1 : -1, k / 2 ? 1 : -1, d);
        if (!(s.is_window ? d[1] > 0 : d[2] < 0))
            return err_set(e, "a corner of the image does not look %s",
                           s.is_window ? "up" : "at the slab");
    }
    return truth_view_render(&view, pane_radiance, &s, out, e);
}

/* The sphere. */

/* The wall that a ray from inside the room meets. */
static int wall_of(const struct truth_glass_sphere *s, const double p[3], const double d[3])
{
    double nearest = HUGE_VAL;
    int wall = 0;
    for (int k = 0; k < 3; k++) {
        int side = d[k] > 0;
        double t = d[k] != 0 ? (s->room[k][side] - p[k]) / d[k] : HUGE_VAL;
        if (t < nearest) {
            nearest = t;
            wall = 2 * k + side;
        }
    }
    return wall;
}

static int add_wall(const struct truth_glass_sphere *s, const double p[3], const double d[3],
                    double weight, double light[3])
{
    int wall = wall_of(s, p, d);
    for (int c = 0; c < 3; c++)
        light[c] += weight * s->walls[wall][c];
    return wall;
}

int truth_glass_sphere_radiance(const void *sphere, const double eye[3], const double d[3],
                                double light[3])
{
    const struct truth_glass_sphere *s = sphere;
    double normal[3], along[3], cos_i;
    light[0] = light[1] = light[2] = 0;
    if (!truth_sphere_hit(eye, d, s->centre, s->radius, &cos_i, normal))
        return add_wall(s, eye, d, 1, light);
    double sin_i = sqrt(1 - cos_i * cos_i), f = truth_fresnel(cos_i, s->n, NULL);
    /* Unit vector in the plane of incidence, perpendicular to the normal at entry, in the ray's direction. */
    for (int k = 0; k < 3; k++)
        along[k] = sin_i > 0 ? (d[k] + cos_i * normal[k]) / sin_i : 0;
    /* The ray leaves after j internal reflections at the polar angle (j + 1)(pi - 2 theta_t) from the
     * point of entry, counted towards `along`, and there at the angle theta_i to the normal, on the
     * side it is turning to. j = -1 is the reflection at the point of entry. */
    double sin_t = sin_i / s->n, cos_t = sqrt(1 - sin_t * sin_t);
    double turn[2] = {2 * sin_t * sin_t - 1, 2 * sin_t * cos_t}; /* cosine and sine */
    double polar[2] = {1, 0};
    int id = 6;
    for (int j = -1; j + 2 <= s->depth; j++) {
        double out[2] = {polar[0] * cos_i - polar[1] * sin_i, polar[1] * cos_i + polar[0] * sin_i};
        double p[3], w[3];
        for (int k = 0; k < 3; k++) {
            p[k] = s->centre[k] + s->radius * (polar[0] * normal[k] + polar[1] * along[k]);
            w[k] = out[0] * normal[k] + out[1] * along[k];
        }
        double next = polar[0] * turn[0] - polar[1] * turn[1];
        polar[1] = polar[1] * turn[0] + polar[0] * turn[1];
        polar[0] = next;
        double weight = j < 0 ? f : glass_weight(f, j, s->depth);
        id = 6 * id + add_wall(s, p, w, weight, light);
    }
    return id;
}

static bool sphere_values(const json_t *values, struct truth_glass_sphere *s, struct err *e)
{
    double(*r)[2] = s->room, (*w)[3] = s->walls;
    if (!truth_values_read(values, e,
                           "(view) ior>1 centre[3] radius>0 room.x[2] room.y[2] room.z[2] "
                           "walls.left[3]>=0 walls.right[3]>=0 walls.bottom[3]>=0 "
                           "walls.top[3]>=0 walls.far[3]>=0 walls.near[3]>=0",
                           &s->n, s->centre, &s->radius, r[0], r[1], r[2], w[0], w[1], w[2], w[3],
                           w[4], w[5]))
        return false;
    for (int k = 0; k < 3; k++)
        if (!(s->centre[k] - s->radius > r[k][0] && s->centre[k] + s->radius < r[k][1]))
            return err_set(e, "the sphere is not inside the room");
    return true;
}

static bool fill_sphere(const struct suite_scene *scene, const struct suite_reference *ref,
                        struct moments *out, struct err *e)
{
    /* The number that tells the pieces apart has one base-6 digit for each path. */
    enum { MAX_DEPTH = 10 };
    struct truth_glass_sphere s = {.depth = scene->depth};
    struct truth_view view;
    if (!sphere_values(ref->values, &s, e) || !truth_view_read(ref->values, scene, &view, e))
        return false;
    double distance2 = 0;
    for (int k = 0; k < 3; k++) {
        if (!(view.eye[k] > s.room[k][0] && view.eye[k] < s.room[k][1]))
            return err_set(e, "the eye is not inside the room");
        distance2 += (view.eye[k] - s.centre[k]) * (view.eye[k] - s.centre[k]);
    }
    if (!(distance2 > s.radius * s.radius))
        return err_set(e, "the eye is inside the sphere");
    if (s.depth > MAX_DEPTH)
        return err_set(e, "depth is %d, more than %d", s.depth, MAX_DEPTH);
    return truth_view_render(&view, truth_glass_sphere_radiance, &s, out, e);
}

const struct truth_kind truth_mirrors_and_glass[] = {{"mirror_box", fill_mirror_box, false},
                                                     {"glass_slab", fill_pane, true},
                                                     {"glass_sphere", fill_sphere, true},
                                                     {"snell_window", fill_pane, true},
                                                     {0}};
