#include "truth_sky.h"

#include "truth_pixel_mean.h"
#include "truth_values.h"

#include <gsl/gsl_math.h>

/* The rectangle from z = 0 to z = b; odd in b. */
static double share_of_half(double distance, double b, double height)
{
    double slant = hypot(distance, height);
    return (atan(b / distance) - distance / slant * atan(b / slant)) / (2 * M_PI);
}

double truth_wall_share(double distance, const double z[2], double height)
{
    return share_of_half(distance, z[1], height) - share_of_half(distance, z[0], height);
}

struct floor_scene {
    double sky[3], albedo[3], edge, wall_x, wall_z[2], height;
};

static void floor_point(const double eye[3], const double d[3], double *x, double *z)
{
    double t = -eye[1] / d[1];
    *x = eye[0] + t * d[0];
    *z = eye[2] + t * d[2];
}

static int floor_radiance(const void *form, const double eye[3], const double d[3], double light[3])
{
    const struct floor_scene *s = form;
    double x, z;
    floor_point(eye, d, &x, &z);
    bool is_floor = x < s->edge;
    double local[2] = {s->wall_z[0] - z, s->wall_z[1] - z};
    double seen = is_floor ? 1 - truth_wall_share(x - s->wall_x, local, s->height) : 1;
    for (int c = 0; c < 3; c++)
        light[c] = s->sky[c] * (is_floor ? s->albedo[c] * seen : 1);
    return is_floor;
}

static bool fill_floor(const struct suite_scene *scene, const struct suite_reference *ref,
                       struct moments *out, struct err *e)
{
    struct floor_scene s;
    struct truth_view view;
    if (!truth_values_read(
            ref->values, e,
            "(view) sky[3]>=0 albedo[3]=0..1 floor_edge wall.x wall.z[2] wall.height", s.sky,
            s.albedo, &s.edge, &s.wall_x, s.wall_z, &s.height) ||
        !truth_view_read(ref->values, scene, &view, e) || !truth_check_depth(scene, e))
        return false;
    if (!(s.height > 0 && s.wall_z[0] < s.wall_z[1]))
        return err_set(e, "the wall has no area");
    for (int k = 0; k < 4; k++) {
        double d[3], x, z;
        truth_view_direction(&view, k % 2 ? 1 : -1, k / 2 ? 1 : -1, d);
        floor_point(view.eye, d, &x, &z);
        if (!(view.eye[1] > 0 && d[1] < 0 && x > s.wall_x && view.eye[0] > s.wall_x))
            return err_set(e, "a corner of the image does not look down past the wall");
    }
    return truth_view_render(&view, floor_radiance, &s, out, e);
}

double truth_gradient_reflected(const struct truth_gradient *g, int channel, const double n[3])
{
    double slope = 0;
    for (int k = 0; k < 3; k++)
        slope += g->gradient[k][channel] * n[k];
    return g->mean[channel] + 2.0 / 3 * slope;
}

/* The factor by which linear interpolation between samples `step` apart attenuates cos(t): the Fourier
 * transform of the tent, sinc^2(step/2). */
static double flattening(double step)
{
    double s = sin(step / 2) / (step / 2);
    return s * s;
}

double truth_gradient_texel(const struct truth_gradient *g, int channel, int width, int height,
                            int col, int row)
{
    double down = M_PI / height, around = 2 * M_PI / width;
    double theta = down * (row + 0.5), phi = around * (col + 0.5) - M_PI;
    double w[3] = {sin(theta) * cos(phi) / flattening(around), cos(theta),
                   -sin(theta) * sin(phi) / flattening(around)};
    double v = g->mean[channel];
    for (int k = 0; k < 3; k++)
        v += g->gradient[k][channel] * w[k] / flattening(down);
    return v;
}

bool truth_gradient_read(const json_t *values, struct truth_gradient *g, struct err *e)
{
    double(*b)[3] = g->gradient;
    if (!truth_values_read(
            values, e,
            "mean[3] gradient.x[3] gradient.y[3] gradient.z[3] (view) (centre) (radius) (albedo)",
            g->mean, b[0], b[1], b[2]))
        return false;
    for (int c = 0; c < 3; c++)
        if (!(hypot(hypot(b[0][c], b[1][c]), b[2][c]) < g->mean[c]))
            return err_set(e, "channel %d: the gradient makes radiance negative somewhere", c);
    return true;
}

struct gradient_sphere {
    struct truth_gradient sky;
    double centre[3], radius, albedo[3];
};

static int gradient_radiance(const void *form, const double eye[3], const double d[3],
                             double light[3])
{
    const struct gradient_sphere *s = form;
    double cos_i, n[3];
    bool hit = truth_sphere_hit(eye, d, s->centre, s->radius, &cos_i, n);
    for (int c = 0; c < 3; c++)
        light[c] = hit ? s->albedo[c] * truth_gradient_reflected(&s->sky, c, n) : NAN;
    return hit;
}

static bool fill_gradient(const struct suite_scene *scene, const struct suite_reference *ref,
                          struct moments *out, struct err *e)
{
    struct gradient_sphere s;
    struct truth_view view;
    double min_cos;
    if (!truth_values_read(ref->values, e,
                           "(view) centre[3] radius>0 albedo[3]=0..1 (mean) (gradient)", s.centre,
                           &s.radius, s.albedo) ||
        !truth_gradient_read(ref->values, &s.sky, e) ||
        !truth_view_read(ref->values, scene, &view, e) ||
        !truth_view_filled(&view, s.centre, s.radius, &min_cos, e) || !truth_check_depth(scene, e))
        return false;
    return truth_view_render(&view, gradient_radiance, &s, out, e);
}

const struct truth_kind truth_sky[] = {
    {"sky_and_wall", fill_floor, true}, {"sky_gradient", fill_gradient, false}, {0}};
