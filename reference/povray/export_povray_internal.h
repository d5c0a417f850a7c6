/* Shared by the two halves of the POV-Ray writer: export_povray.c (camera, objects) and
 * export_povray_light.c (light sources, sky). */
#ifndef ASSAY_EXPORT_POVRAY_INTERNAL_H
#define ASSAY_EXPORT_POVRAY_INTERNAL_H

#include "export_povray.h"
#include "renderer/math/mat4.h"

struct povray_writer {
    FILE *f;
    const struct scene *s;
    const struct povray_variant *v;
    const struct povray_passes *plan;
    const struct povray_pass *pass;
    bool radiosity;
    bool hide_reflections; /* totally reflected rays must find nothing */
    double roulette;
    vec3 eye;
};

static inline dvec3 povray_moved(dvec3 p, double s, vec3 d)
{
    return d3_add(p, d3_scale(d3_of(d), s));
}

/* "<x,y,z>", turned by the variant's rotation. The last zero is there so that no coordinate reads -0. */
static inline void povray_put(const struct povray_writer *w, dvec3 p)
{
    const double(*r)[3] = w->v->rotation;
    fprintf(w->f, "<%.9g,%.9g,%.9g>", r[0][0] * p.x + r[0][1] * p.y + r[0][2] * p.z + 0.0,
            r[1][0] * p.x + r[1][1] * p.y + r[1][2] * p.z + 0.0,
            r[2][0] * p.x + r[2][1] * p.y + r[2][2] * p.z + 0.0);
}
/* Prints `before`, "<r,g,b>" and `after`. */
static inline void povray_put_rgb(const struct povray_writer *w, const char *before, double r,
                                  double g, double b, const char *after)
{
    fprintf(w->f, "%s<%.9g,%.9g,%.9g>%s", before, r, g, b, after);
}

/* All light sources of the pass. */
void povray_put_lights(const struct povray_writer *w);
/* The environment, if there is one and the pass sees it. */
void povray_put_sky(const struct povray_writer *w);

#endif
