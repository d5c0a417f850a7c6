/* Export to POV-Ray: light sources (point, spot, directional, area) and the sky. */
#include "export_povray_internal.h"
#include "povray_lamp.h"

#include "renderer/scene/environment.h"
#include "renderer/math/sampler.h"

#include <assert.h>
#include <gsl/gsl_math.h>

/* fade_distance d, relative to the extent. POV-Ray's falloff is 2 / (1 + (r/d)^2), a relative
 * (d/r)^2 below the inverse square law. */
#define FADE 1e-6

/* Position of node i of n on [0,1]: pairs of cells with the 2-point Gauss rule. */
static double gauss2(int i, int n)
{
    return (2 * (i / 2) + 1 + (i % 2 == 0 ? -1 : 1) / sqrt(3.0)) / n;
}

/* The spotlight at one of n points: colour times falloff is radiance x area / (n pi r^2). */
static void put_lamp_head(const struct povray_writer *w, const struct povray_lamp *l,
                          uint32_t index, const char *parameters, int n)
{
    double d = FADE * w->plan->extent;
    double c = (double)l->area / n / (2 * M_PI * d * d);
    fprintf(w->f, "#macro Lamp%u(%s)\n  light_source { P ", index, parameters);
    povray_put_rgb(w, "rgb S*", c * (double)l->radiance.r, c * (double)l->radiance.g,
                   c * (double)l->radiance.b, " spotlight point_at P+");
}

static void put_lamp_tail(const struct povray_writer *w)
{
    fprintf(w->f,
            "\n    tightness 1 radius 90 falloff 90 fade_distance %.9g fade_power 2 }\n#end\n",
            FADE * w->plan->extent);
}

/* The variant's shift for this lamp. */
static void lamp_shift(const struct povray_writer *w, uint32_t index, double shift[3])
{
    struct sample4 r = sampler_get(w->v->lamp_seed, index, 0, 0, PURPOSE_LIGHT);
    for (int k = 0; k < 3; k++) {
        double x = w->v->lamp_shift[k] + index * 0.6180339887498949;
        shift[k] = w->v->rule == POVRAY_JITTER ? (double)r.u[k] : x - floor(x);
    }
}

static void put_rectangle(const struct povray_writer *w, const struct povray_lamp *l,
                          uint32_t index)
{
    int n = w->v->lamp_cells;
    double shift[3];
    lamp_shift(w, index, shift);
    fprintf(w->f, "\n// rectangle of radiance <%g,%g,%g>, area %.9g, as %d x %d spotlights\n",
            (double)l->radiance.r, (double)l->radiance.g, (double)l->radiance.b, (double)l->area, n,
            n);
    put_lamp_head(w, l, index, "P", n * n);
    povray_put(w, d3_of(l->normal));
    put_lamp_tail(w);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            double u = gauss2(i, n), v = gauss2(j, n);
            if (w->v->rule == POVRAY_SHIFT) {
                u = (i + shift[0]) / n;
                v = (j + shift[1]) / n;
            } else if (w->v->rule == POVRAY_JITTER) {
                struct sample4 r =
                    sampler_get(w->v->lamp_seed, index, (uint32_t)(i * n + j), 0, PURPOSE_LIGHT);
                u = (i + (double)r.u[0]) / n;
                v = (j + (double)r.u[1]) / n;
            }
            fprintf(w->f, "Lamp%u(", index);
            povray_put(w, povray_moved(povray_moved(d3_of(l->corner), u, l->edge1), v, l->edge2));
            fputs(j == n - 1 ? ")\n" : ") ", w->f);
        }
}

/* A ball or a mesh. */
static void put_points(const struct povray_writer *w, const struct povray_lamp *l, uint32_t index)
{
    enum { AT_A_TIME = 32 * 32 };
    vec3 p[AT_A_TIME], normal[AT_A_TIME];
    double shift[3];
    int n = w->v->lamp_cells * w->v->lamp_cells;
    assert(n <= AT_A_TIME);
    lamp_shift(w, index, shift);
    povray_lamp_points(w->s, l, shift, n, p, normal);
    fprintf(w->f, "\n// %s of radiance <%g,%g,%g>, area %.9g, as %d spotlights\n",
            l->kind == POVRAY_BALL ? "ball" : "mesh", (double)l->radiance.r, (double)l->radiance.g,
            (double)l->radiance.b, (double)l->area, n);
    put_lamp_head(w, l, index, "P,N", n);
    fputs("N", w->f);
    put_lamp_tail(w);
    for (int i = 0; i < n; i++) {
        fprintf(w->f, "Lamp%u(", index);
        povray_put(w, d3_of(p[i]));
        fputc(',', w->f);
        povray_put(w, d3_of(normal[i]));
        fputs(i % 4 == 3 || i == n - 1 ? ")\n" : ") ", w->f);
    }
}

/* A point or spot light. POV-Ray's falloff is 2 / (1 + (r/d)^2). */
static void put_point(const struct povray_writer *w, const struct light *l)
{
    bool constant = l->attenuation[0] > 0;
    double d = FADE * w->plan->extent;
    double c = constant ? 1 / (M_PI * (double)l->attenuation[0])
                        : 1 / (2 * M_PI * d * d * (double)l->attenuation[2]);
    fprintf(w->f, "\n// %s light%s\nlight_source { ", l->kind == LIGHT_SPOT ? "spot" : "point",
            constant ? " without falloff" : "");
    povray_put(w, d3_of(l->position));
    povray_put_rgb(w, " rgb S*", c * (double)l->value.r, c * (double)l->value.g,
                   c * (double)l->value.b, "");
    if (l->kind == LIGHT_SPOT) {
        double cutoff = acos((double)l->cos_cutoff) * 180 / M_PI;
        fputs(" spotlight point_at ", w->f);
        povray_put(w, povray_moved(d3_of(l->position), 1, l->axis));
        fprintf(w->f, "\n    tightness %.9g radius %.12g falloff %.12g", (double)l->exponent,
                cutoff, cutoff);
    }
    if (!constant)
        fprintf(w->f, " fade_distance %.9g fade_power 2", d);
    fputs(" }\n", w->f);
}

static void put_directional(const struct povray_writer *w, const struct light *l)
{
    vec3 middle = scale(add(w->s->bounds_min, w->s->bounds_max), 0.5f);
    fputs("\n// directional light\nlight_source { ", w->f);
    povray_put(w, povray_moved(d3_of(middle), 10 * w->plan->extent, l->to_light));
    povray_put_rgb(w, " rgb S*", (double)l->value.r / M_PI, (double)l->value.g / M_PI,
                   (double)l->value.b / M_PI, " parallel point_at ");
    povray_put(w, d3_of(middle));
    fputs(" }\n", w->f);
}

void povray_put_lights(const struct povray_writer *w)
{
    for (uint32_t i = 0; i < w->s->num_lights; i++) {
        const struct light *l = &w->s->lights[i];
        struct povray_lamp lamp;
        switch (l->kind) {
        case LIGHT_POINT:
        case LIGHT_SPOT: put_point(w, l); break;
        case LIGHT_DIRECTIONAL: put_directional(w, l); break;
        case LIGHT_ENVIRONMENT: break;
        case LIGHT_TRIANGLES:
        case LIGHT_SPHERE:
            if (!povray_lamp(w->s, l, &lamp))
                break; /* not a lamp: it only glows */
            if (lamp.kind == POVRAY_RECTANGLE)
                put_rectangle(w, &lamp, i);
            else
                put_points(w, &lamp, i);
            break;
        }
    }
}

static void put_entry(const struct povray_writer *w, double at, rgb c)
{
    fprintf(w->f, "[%.9g rgb S*<%.9g,%.9g,%.9g>]", at, (double)c.r, (double)c.g, (double)c.b);
}

/* A row of texels as a color_map around the circle, linear between texel centres; its two ends meet
 * halfway between the last and the first texel. */
static void put_sky_row(const struct povray_writer *w, const rgb *texel, uint32_t width)
{
    rgb seam = rgb_scale(rgb_add(texel[0], texel[width - 1]), 0.5f);
    fputs("function { (atan2(-z,x) + pi)/(2*pi) } color_map {\n      ", w->f);
    put_entry(w, 0, seam);
    for (uint32_t c = 0; c < width; c++) {
        fputs(c % 4 == 3 ? "\n      " : " ", w->f);
        put_entry(w, (c + 0.5) / width, texel[c]);
    }
    fputc(' ', w->f);
    put_entry(w, 1, seam);
    fputs(" }", w->f);
}

void povray_put_sky(const struct povray_writer *w)
{
    const double(*r)[3] = w->v->rotation;
    if (w->s->environment == NULL || !w->pass->glow)
        return;
    struct environment_parts sky = environment_parts(w->s->environment);
    if (sky.kind != ENVIRONMENT_IMAGE) {
        povray_put_rgb(w, "\n// environment\nbackground { rgb S*", (double)sky.radiance.r,
                       (double)sky.radiance.g, (double)sky.radiance.b, " }\n");
        return;
    }
    fprintf(w->f,
            "\n// environment, %u x %u texels\nsky_sphere { pigment {\n"
            "  function { atan2(sqrt(x*x + z*z),y)/pi } pigment_map {\n",
            sky.width, sky.height);
    for (uint32_t row = 0; row < sky.height; row++) {
        fprintf(w->f, "    [%.9g ", (row + 0.5) / sky.height);
        put_sky_row(w, sky.texel + (size_t)row * sky.width, sky.width);
        fputs("]\n", w->f);
    }
    fputs("  } }\n  matrix <", w->f);
    for (int column = 0; column < 3; column++)
        for (int row = 0; row < 3; row++)
            fprintf(w->f, "%.17g,", r[row][column]);
    fputs("0,0,0> }\n", w->f);
}
