#include "truth_lens.h"

#include "truth_values.h"

#include <math.h>

enum { MAX_PANELS = 8 };

/* Below this the mixed difference of the second antiderivative loses its digits. */
static const double min_slope = 1e-3;

struct panel {
    double radiance[3], distance, normal[2], offset;
};

double truth_disc_share(double k)
{
    k = fmin(fmax(k, -1), 1);
    return (acos(k) - k * sqrt(1 - k * k)) / M_PI;
}

/* The second antiderivative of truth_disc_share() that vanishes for k >= 1. */
static double disc_share_twice(double k)
{
    if (k >= 1)
        return 0;
    double inside = fmax(k, -1), s = sqrt(1 - inside * inside);
    return (acos(inside) * (0.125 + k * k / 2) - inside * s * (0.625 - s * s / 12)) / M_PI;
}

double truth_disc_share_mean(double k0, double a, double b)
{
    double low = k0 + fmin(a, 0) + fmin(b, 0), high = k0 + fmax(a, 0) + fmax(b, 0);
    if (low >= 1)
        return 0;
    if (high <= -1)
        return 1;
    return (disc_share_twice(k0 + a + b) - disc_share_twice(k0 + a) - disc_share_twice(k0 + b) +
            disc_share_twice(k0)) /
           (a * b);
}

static bool read_panel(const json_t *value, const struct suite_scene *s, struct panel *p,
                       struct err *e)
{
    if (!truth_values_read(value, e, "radiance[3]>=0 distance>0 normal[2] offset", p->radiance,
                           &p->distance, p->normal, &p->offset))
        return false;
    if (p->distance == s->focal_distance)
        return err_set(e, "a panel is in focus");
    if (!(fabs(hypot(p->normal[0], p->normal[1]) - 1) < 1e-9))
        return err_set(e, "a panel's normal is not of unit length");
    if (fabs(p->normal[0]) < min_slope || fabs(p->normal[1]) < min_slope)
        return err_set(e, "a panel's edge is parallel to the image's sides");
    return true;
}

/* Share of a pixel's rays that hit the panel; (x, y) is the pixel's lower corner at distance 1. A ray from
 * the lens point r l through the image point s meets the panel's plane, at distance D, in
 * D s + r (1 - D/F) l. */
static double panel_share(const struct panel *p, const struct suite_scene *s, double x, double y,
                          double dx, double dy)
{
    double blur = s->lens_radius * fabs(1 - p->distance / s->focal_distance);
    double unit = p->distance / blur, nx = p->normal[0], ny = p->normal[1];
    return truth_disc_share_mean(p->offset / blur - unit * (nx * x + ny * y), -unit * nx * dx,
                                 -unit * ny * dy);
}

static bool fill_lens_steps(const struct suite_scene *scene, const struct suite_reference *ref,
                            struct moments *out, struct err *e)
{
    double background[3], foot_x[2], foot_y[2];
    struct panel panel[MAX_PANELS];
    if (!truth_values_read(ref->values, e,
                           "background[3]>=0 (panels) footprint.x[2] footprint.y[2]", background,
                           foot_x, foot_y))
        return false;
    const json_t *panels = json_object_get(ref->values, "panels");
    size_t num = json_array_size(panels);
    if (num < 1 || num > MAX_PANELS)
        return err_set(e, "panels is not an array of 1 to %d", MAX_PANELS);
    if (!(scene->lens_radius > 0 && scene->focal_distance > 0))
        return err_set(e, "the scene has no lens");
    if (foot_x[0] == foot_x[1] || foot_y[0] == foot_y[1])
        return err_set(e, "footprint has no area");
    for (size_t i = 0; i < num; i++)
        if (!read_panel(json_array_get(panels, i), scene, &panel[i], e))
            return false;
    double dx = (foot_x[1] - foot_x[0]) / out->width, dy = (foot_y[1] - foot_y[0]) / out->height;
    for (int row = 0; row < out->height; row++)
        for (int col = 0; col < out->width; col++) {
            double *mean = &out->mean[3 * ((size_t)row * (size_t)out->width + (size_t)col)];
            for (int c = 0; c < 3; c++)
                mean[c] = background[c];
            int seen = 0;
            for (size_t i = 0; i < num; i++) {
                double share = panel_share(&panel[i], scene, foot_x[0] + dx * col,
                                           foot_y[0] + dy * row, dx, dy);
                seen += share > 0;
                for (int c = 0; c < 3; c++)
                    mean[c] += share * (panel[i].radiance[c] - background[c]);
            }
            if (seen > 1)
                return err_set(e, "pixel (%d,%d): two panels", col, row);
        }
    return true;
}

const struct truth_kind truth_lens[] = {{"lens_steps", fill_lens_steps, false}, {0}};
