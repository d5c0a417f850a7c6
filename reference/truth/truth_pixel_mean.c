#include "truth_pixel_mean.h"

#include "truth_values.h"

#include <gsl/gsl_integration.h>
#include <gsl/gsl_math.h>

/* ORDER and twice as many points are compared for smooth pixels; in pixels with edges, a part with
 * its two halves. */
enum { ORDER = 8, SCAN = 32, MAX_HALVINGS = 40 };
static const double smooth_tolerance = 1e-10, edge_tolerance = 1e-6;

static double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

bool truth_view_read(const json_t *values, const struct suite_scene *scene, struct truth_view *view,
                     struct err *e)
{
    double *r = view->right, *u = view->up, *f = view->forward;
    if (!truth_values_read(json_object_get(values, "view"), e,
                           "eye[3] right[3] up[3] forward[3] tan_half>0", view->eye, r, u, f,
                           &view->tan_half))
        return err_prefix(e, "view");
    const double *axis[3] = {r, u, f};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k <= i; k++)
            if (!(fabs(dot3(axis[i], axis[k]) - (i == k)) < 1e-12))
                return err_set(e, "view: right, up and forward are not unit and orthogonal");
    view->filter = &scene->filter;
    view->edge = 1;
    if (scene->filter.radius > 0)
        view->edge += 2 * (scene->filter.radius - 0.5) / scene->width;
    return true;
}

void truth_view_direction(const struct truth_view *view, double u, double v, double d[3])
{
    double x = view->tan_half * u, y = -view->tan_half * v, length = sqrt(1 + x * x + y * y);
    for (int k = 0; k < 3; k++)
        d[k] = (view->forward[k] + x * view->right[k] + y * view->up[k]) / length;
}

bool truth_sphere_hit(const double o[3], const double d[3], const double centre[3], double radius,
                      double *cos_i, double normal[3])
{
    double v[3];
    for (int k = 0; k < 3; k++)
        v[k] = o[k] - centre[k];
    double half = dot3(v, d), chord2 = radius * radius - dot3(v, v) + half * half;
    if (half >= 0 || chord2 <= 0)
        return false;
    for (int k = 0; k < 3; k++)
        normal[k] = (v[k] - (half + sqrt(chord2)) * d[k]) / radius;
    *cos_i = sqrt(chord2) / radius;
    return true;
}

bool truth_view_filled(const struct truth_view *view, const double centre[3], double radius,
                       double *min_cos, struct err *e)
{
    if (!(radius > 0))
        return err_set(e, "radius is %g, not above 0", radius);
    *min_cos = 1;
    /* Directions that hit the sphere form a cone about its centre; of a square image, a corner is furthest from it. */
    for (int k = 0; k < 4; k++) {
        double d[3], cos_i, normal[3];
        truth_view_direction(view, k % 2 ? view->edge : -view->edge,
                             k / 2 ? view->edge : -view->edge, d);
        if (!truth_sphere_hit(view->eye, d, centre, radius, &cos_i, normal))
            return err_set(e, "the sphere does not fill the image");
        *min_cos = fmin(*min_cos, cos_i);
    }
    return true;
}

struct pixel_integral {
    const struct truth_view *view;
    truth_shade *shade;
    const void *form;
    gsl_integration_glfixed_table *rule, *check;
    double v;         /* of the scan line */
    double width;     /* of a pixel in u and v; with a filter, of a quarter of its support */
    double centre[2]; /* of the pixel; only with a filter */
    double scale;     /* of the pixel's value, for the tolerance */
    bool converged;
};

static int look(const struct pixel_integral *p, double u, double v, double light[3])
{
    double d[3];
    truth_view_direction(p->view, u, v, d);
    int id = p->shade(p->form, p->view->eye, d, light);
    if (p->view->filter->radius == 0)
        return id;
    /* Scaled so that the mean over a quarter is that quarter's contribution to the pixel. */
    double r = p->view->filter->radius;
    double weight = pixel_filter_value(p->view->filter, (u - p->centre[0]) * r / p->width) *
                    pixel_filter_value(p->view->filter, (v - p->centre[1]) * r / p->width) * r * r;
    for (int c = 0; c < 3; c++)
        light[c] *= weight;
    return id;
}

/* Do the pixel's whole border and its centre lie in one piece? */
static bool is_one_piece(const struct pixel_integral *p, double u, double v)
{
    double light[3], w = p->width;
    int id = look(p, u + w / 2, v + w / 2, light);
    for (int i = 0; i < SCAN; i++) {
        double t = w * i / SCAN;
        if (look(p, u + t, v, light) != id || look(p, u + w, v + t, light) != id ||
            look(p, u + w - t, v + w, light) != id || look(p, u, v + w - t, light) != id)
            return false;
    }
    return true;
}

static void product_rule(const struct pixel_integral *p, const gsl_integration_glfixed_table *rule,
                         double u0, double v0, double mean[3])
{
    for (int c = 0; c < 3; c++)
        mean[c] = 0;
    for (size_t i = 0; i < rule->n; i++)
        for (size_t j = 0; j < rule->n; j++) {
            double u, v, wu, wv, light[3];
            gsl_integration_glfixed_point(0, 1, i, &u, &wu, rule);
            gsl_integration_glfixed_point(0, 1, j, &v, &wv, rule);
            look(p, u0 + p->width * u, v0 + p->width * v, light);
            for (int c = 0; c < 3; c++)
                mean[c] += wu * wv * light[c];
        }
}

typedef void line_function(struct pixel_integral *p, double t, double light[3]);

static void rule_on(struct pixel_integral *p, line_function *f, double a, double b, double sum[3])
{
    sum[0] = sum[1] = sum[2] = 0;
    for (size_t i = 0; i < p->rule->n; i++) {
        double t, w, light[3];
        gsl_integration_glfixed_point(a, b, i, &t, &w, p->rule);
        f(p, t, light);
        for (int c = 0; c < 3; c++)
            sum[c] += w * light[c];
    }
}

/* Adds the integral of f over [a,b], of which `whole` is the rule's estimate, to sum. The tolerance
 * is absolute and divided among parts by length; a part with a jump, which no halving removes, may be off
 * by `most`. */
static void refine(struct pixel_integral *p, line_function *f, double a, double b,
                   const double whole[3], double tolerance, double most, int halvings,
                   double sum[3])
{
    double m = 0.5 * (a + b), left[3], right[3], worst = 0;
    rule_on(p, f, a, m, left);
    rule_on(p, f, m, b, right);
    for (int c = 0; c < 3; c++)
        worst = fmax(worst, fabs(left[c] + right[c] - whole[c]));
    if (worst <= fmax(tolerance, most)) {
        for (int c = 0; c < 3; c++)
            sum[c] += left[c] + right[c];
    } else if (halvings == MAX_HALVINGS) {
        p->converged = false;
    } else {
        refine(p, f, a, m, left, tolerance / 2, most, halvings + 1, sum);
        refine(p, f, m, b, right, tolerance / 2, most, halvings + 1, sum);
    }
}

static void integrate(struct pixel_integral *p, line_function *f, double a, double b, double tolerance,
                      double sum[3])
{
    double whole[3];
    rule_on(p, f, a, b, whole);
    refine(p, f, a, b, whole, tolerance, 0.01 * tolerance, 0, sum);
}

static void at_point(struct pixel_integral *p, double u, double light[3])
{
    look(p, u, p->v, light);
}

/* Integral along the scan line at v from a to b, piece by piece. */
static void along_line(struct pixel_integral *p, double a, double b, double sum[3])
{
    double tolerance = 0.1 * edge_tolerance * p->scale * (b - a), start = a, light[3];
    int id = look(p, a, p->v, light);
    sum[0] = sum[1] = sum[2] = 0;
    for (int i = 1; i <= SCAN; i++) {
        double known = a + (b - a) * (i - 1) / SCAN, end = a + (b - a) * i / SCAN;
        int last = look(p, end, p->v, light);
        while (id != last) {
            double lo = known, hi = end;
            while (hi - lo > 1e-10 * (b - a)) {
                double m = 0.5 * (lo + hi);
                if (look(p, m, p->v, light) == id)
                    lo = m;
                else
                    hi = m;
            }
            integrate(p, at_point, start, lo, tolerance, sum);
            start = known = hi;
            id = look(p, hi, p->v, light);
        }
    }
    integrate(p, at_point, start, b, tolerance, sum);
}

struct column {
    struct pixel_integral p; /* first, so that at_line() can cast a pointer to it */
    double u;
};

static void at_line(struct pixel_integral *p, double v, double light[3])
{
    struct column *c = (struct column *)p;
    p->v = v;
    along_line(p, c->u, c->u + p->width, light);
}

static bool edge_pixel(struct pixel_integral *p, double u, double v, double mean[3], struct err *e)
{
    struct column c = {.p = *p, .u = u};
    double area = p->width * p->width, sum[3] = {0};
    product_rule(p, p->check, u, v, mean);
    c.p.scale = fmin(mean[0], fmin(mean[1], mean[2]));
    c.p.converged = true;
    if (!(c.p.scale > 0))
        return err_set(e, "a pixel with edges is black in a channel: no scale for its tolerance");
    integrate(&c.p, at_line, v, v + p->width, edge_tolerance * c.p.scale * area, sum);
    for (int k = 0; k < 3; k++)
        mean[k] = sum[k] / area;
    return c.p.converged || err_set(e, "quadrature not converged at an edge");
}

static bool smooth_pixel(const struct pixel_integral *p, double u, double v, double mean[3])
{
    double coarse[3];
    product_rule(p, p->rule, u, v, coarse);
    product_rule(p, p->check, u, v, mean);
    bool same = true;
    for (int c = 0; c < 3; c++)
        same = same && fabs(coarse[c] - mean[c]) <= smooth_tolerance * mean[c];
    return same;
}

static bool part_of_pixel(struct pixel_integral *p, double u, double v, double mean[3], struct err *e)
{
    return (is_one_piece(p, u, v) && smooth_pixel(p, u, v, mean)) || edge_pixel(p, u, v, mean, e);
}

static bool filtered_pixel(struct pixel_integral *p, double u, double v, double mean[3], struct err *e)
{
    p->centre[0] = u;
    p->centre[1] = v;
    mean[0] = mean[1] = mean[2] = 0;
    for (int k = 0; k < 4; k++) {
        double part[3];
        if (!part_of_pixel(p, k % 2 ? u : u - p->width, k / 2 ? v : v - p->width, part, e))
            return false;
        for (int c = 0; c < 3; c++)
            mean[c] += part[c];
    }
    return true;
}

bool truth_view_render(const struct truth_view *view, truth_shade *shade, const void *form,
                       struct moments *out, struct err *e)
{
    if (out->width != out->height)
        return err_set(e, "the image is %d x %d, not square", out->width, out->height);
    struct pixel_integral p = {.view = view,
                           .shade = shade,
                           .form = form,
                           .rule = gsl_integration_glfixed_table_alloc(ORDER),
                           .check = gsl_integration_glfixed_table_alloc(2 * ORDER),
                           .width = 2.0 / out->width};
    const double pixel = p.width;
    if (view->filter->radius > 0)
        p.width *= view->filter->radius;
    bool ok = p.rule != NULL && p.check != NULL;
    if (!ok)
        err_set(e, "out of memory for a quadrature rule");
    for (int i = 0; ok && i < out->width * out->height; i++) {
        int col = i % out->width, row = i / out->width;
        double u = pixel * col - 1, v = pixel * row - 1, *mean = out->mean + 3 * (size_t)i;
        ok = (view->filter->radius > 0
                  ? filtered_pixel(&p, u + 0.5 * pixel, v + 0.5 * pixel, mean, e)
                  : part_of_pixel(&p, u, v, mean, e)) ||
             err_prefix(e, "pixel (%d,%d)", col, row);
        if (ok && !(isfinite(mean[0]) && isfinite(mean[1]) && isfinite(mean[2])))
            ok = err_set(e, "pixel (%d,%d) is not a number", col, row);
    }
    gsl_integration_glfixed_table_free(p.rule);
    gsl_integration_glfixed_table_free(p.check);
    return ok;
}

bool truth_check_depth(const struct suite_scene *scene, struct err *e)
{
    return scene->depth >= 1 ||
           err_set(e, "depth is %d, but the form needs one bounce, direct light", scene->depth);
}
