#include "drawing.h"

#include "renderer/base/fs.h"

#include <assert.h>
#include <math.h>

void drawing_add(struct drawing_series *s, double x, double y, double lo, double hi)
{
    assert(s->num < DRAWING_POINTS);
    s->x[s->num] = x;
    s->y[s->num] = y;
    s->lo[s->num] = lo;
    s->hi[s->num++] = hi;
}

static void draw_series(struct plot *p, const struct drawing_series *s, size_t number)
{
    plot_series(p, number, s->name);
    for (int i = 0; i < s->num; i++) {
        plot_line_to(p, s->x[i], s->y[i]);
        if (s->hi[i] > s->lo[i]) {
            plot_segment(p, "line", s->x[i], s->lo[i], s->x[i], s->hi[i]);
            plot_point(p, number, s->x[i], s->y[i], "%s: %.3g at %.3g, %.3g to %.3g", s->name,
                       s->y[i], s->x[i], s->lo[i], s->hi[i]);
        } else {
            plot_point(p, number, s->x[i], s->y[i], "%s: %.3g at %.3g", s->name, s->y[i], s->x[i]);
        }
    }
    plot_series_end(p);
}

bool drawing_write(const char *path, const struct drawing *d, struct err *e)
{
    struct out_file out;
    if (!out_open(&out, path, e))
        return false;
    struct plot p = plot_sized(out.f, 430, 330);
    p.title = d->title;
    p.top = 40;
    p.right = 210;
    p.x = d->x;
    p.y = d->y;
    p.x.has_grid = p.y.has_grid = true;
    plot_open(&p, "%s", d->title);
    if (d->is_diagonal) {
        double lo = fmax(d->x.lo, d->y.lo), hi = fmin(d->x.hi, d->y.hi);
        plot_segment(&p, "expected", lo, lo, hi, hi);
    }
    if (d->mark_x > 0) {
        plot_segment(&p, "expected", d->mark_x, d->y.lo, d->mark_x, d->y.hi);
        plot_text(&p, d->mark_x, d->y.lo, -5, -8, "end", "%s", d->mark_text);
    }
    if (d->mark_y > 0)
        plot_segment(&p, "expected", d->x.lo, d->mark_y, d->x.hi, d->mark_y);
    for (int i = 0; i < d->num; i++)
        draw_series(&p, &d->series[i], (size_t)i);
    plot_close(&p);
    return out_commit(&out, e);
}
