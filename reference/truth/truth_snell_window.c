#include "truth_snell_window.h"

#include "truth_mirrors_and_glass.h"
#include "truth_pixel_mean.h"
#include "truth_values.h"

#include <math.h>

struct window {
    double n, sky[3], floor[3];
};

void truth_window_shares(double cosine, double n, double *floor, double *sky)
{
    double f = truth_fresnel(cosine, 1 / n, NULL);
    *floor = f;
    *sky = n * n * (1 - f);
}

static int window_radiance(const void *form, const double eye[3], const double d[3],
                           double light[3])
{
    const struct window *w = form;
    double floor, sky;
    (void)eye;
    truth_window_shares(d[1], w->n, &floor, &sky);
    for (int c = 0; c < 3; c++)
        light[c] = floor * w->floor[c] + sky * w->sky[c];
    return sky > 0;
}

static bool fill_window(const struct suite_scene *scene, const struct suite_reference *ref,
                        struct moments *out, struct err *e)
{
    struct window w;
    struct truth_view view;
    if (!truth_values_read(ref->values, e, "(view) ior>1 sky[3]>=0 floor[3]>=0", &w.n, w.sky,
                           w.floor) ||
        !truth_view_read(ref->values, scene, &view, e) || !truth_check_depth(scene, e))
        return false;
    if (!(view.eye[1] < 0))
        return err_set(e, "the eye is at height %g, not below the surface", view.eye[1]);
    for (int k = 0; k < 4; k++) {
        double d[3];
        truth_view_direction(&view, k % 2 ? 1 : -1, k / 2 ? 1 : -1, d);
        if (!(d[1] > 0))
            return err_set(e, "a corner of the image does not look up");
    }
    return truth_view_render(&view, window_radiance, &w, out, e);
}

const struct truth_kind truth_snell_window[] = {{"snell_window", fill_window, true}, {0}};
