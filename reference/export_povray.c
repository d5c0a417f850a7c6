#include "export_povray.h"

#include "../renderer/sampler.h"

#include <assert.h>
#include <gsl/gsl_math.h>

/* Of the extent: the distance of the black sheet behind a one-sided emitter. mesh2 vertices are
 * float32, 1e-7 of the extent. */
#define BACKING 2e-5
/* Of the extent: the distance at which a light source stops growing. POV-Ray's falloff is
 * 2 / (1 + (r/d)^2), so the inverse square law is wrong by (d/r)^2. */
#define FADE 1e-6

struct povray_variant povray_variant_plain(void)
{
    return (struct povray_variant){.rotation = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                   .lamp_cells = 16,
                                   .indirect = true,
                                   .roulette = 0.1,
                                   .scale = 1};
}

/* What the writers below share. */
struct writer {
    FILE *f;
    const struct scene *s;
    const struct povray_variant *v;
    const struct povray_plan *plan;
    bool radiosity;
    double roulette;
};

struct point {
    double x, y, z;
};

static struct point at(vec3 p)
{
    return (struct point){p.x, p.y, p.z};
}

static struct point moved(struct point p, double s, vec3 d)
{
    return (struct point){p.x + s * d.x, p.y + s * d.y, p.z + s * d.z};
}

/* The last zero is there so that no coordinate reads -0. */
static void put(const struct writer *w, struct point p)
{
    const double(*r)[3] = w->v->rotation;
    fprintf(w->f, "<%.9g,%.9g,%.9g>", r[0][0] * p.x + r[0][1] * p.y + r[0][2] * p.z + 0.0,
            r[1][0] * p.x + r[1][1] * p.y + r[1][2] * p.z + 0.0,
            r[2][0] * p.x + r[2][1] * p.y + r[2][2] * p.z + 0.0);
}

static void put_rgb(const struct writer *w, const char *before, double r, double g, double b,
                    const char *after)
{
    fprintf(w->f, "%s<%.9g,%.9g,%.9g>%s", before, r, g, b, after);
}

/* Emission is multiplied by the pigment, so it is divided by it here. */
static void put_surface(const struct writer *w, rgb albedo, rgb radiance, double boost)
{
    double r = albedo.r * boost, g = albedo.g * boost, b = albedo.b * boost;
    if (rgb_is_zero(albedo) || boost == 0) {
        fputs("pigment { rgb 1 } finish { diffuse 0", w->f);
        r = g = b = 1;
    } else {
        put_rgb(w, "pigment { rgb ", r, g, b, " } finish { diffuse 1");
    }
    if (!rgb_is_zero(radiance))
        put_rgb(w, " emission S*", radiance.r > 0 ? radiance.r / r : 0,
                radiance.g > 0 ? radiance.g / g : 0, radiance.b > 0 ? radiance.b / b : 0, "");
    fputs(" }", w->f);
}

static void put_texture(const struct writer *w, rgb albedo, rgb radiance)
{
    fputs("  texture { ", w->f);
    if (w->roulette > 0 && !rgb_is_zero(albedo)) {
        fprintf(w->f, "function { Fate(x,y,z) } texture_map {\n    [%.9g ", w->roulette);
        put_surface(w, albedo, radiance, 0);
        fprintf(w->f, "]\n    [%.9g ", w->roulette);
        put_surface(w, albedo, radiance, 1 / (1 - w->roulette));
        fputs("] }", w->f);
    } else {
        put_surface(w, albedo, radiance, 1);
    }
    fputs(" }\n", w->f);
}

static vec3 geometric_normal(const vec3 *p)
{
    return normalize(cross(sub(p[1], p[0]), sub(p[2], p[0])));
}

/* mesh2 of an object, its vertices moved by `offset` along the geometric normals. */
static void put_mesh(const struct writer *w, const struct object *o, double offset)
{
    const struct scene *s = w->s;
    bool smooth = false;
    fprintf(w->f, "mesh2 {\n  vertex_vectors { %u", 3 * o->num_triangles);
    for (uint32_t i = o->first_triangle; i < o->first_triangle + o->num_triangles; i++) {
        const vec3 *p = &s->position[3 * (size_t)i];
        vec3 n = geometric_normal(p);
        for (int k = 0; k < 3; k++) {
            fputs(k == 0 ? ",\n    " : ",", w->f);
            put(w, moved(at(p[k]), offset, n));
            smooth |= dot(n, s->normal[3 * (size_t)i + (size_t)k]) < 1 - 1e-6f;
        }
    }
    if (smooth && offset == 0) {
        fprintf(w->f, " }\n  normal_vectors { %u", 3 * o->num_triangles);
        for (uint32_t i = o->first_triangle; i < o->first_triangle + o->num_triangles; i++)
            for (int k = 0; k < 3; k++) {
                fputs(k == 0 ? ",\n    " : ",", w->f);
                put(w, at(s->normal[3 * (size_t)i + (size_t)k]));
            }
    }
    fprintf(w->f, " }\n  face_indices { %u", o->num_triangles);
    for (uint32_t i = 0; i < o->num_triangles; i++)
        fprintf(w->f, "%s<%u,%u,%u>", i % 8 == 0 ? ",\n    " : ",", 3 * i, 3 * i + 1, 3 * i + 2);
    fputs(" }\n", w->f);
}

static void put_sphere(const struct writer *w, const struct sphere *b, double offset)
{
    fputs("sphere { ", w->f);
    put(w, at(b->centre));
    fprintf(w->f, ", %.9g\n", b->radius + b->normal_out * offset);
}

/* The object's shapes, each with that texture and those flags. */
static void put_shapes(const struct writer *w, const struct object *o, double offset, rgb albedo,
                       rgb radiance, const char *flags)
{
    if (o->num_triangles > 0) {
        put_mesh(w, o, offset);
        put_texture(w, albedo, radiance);
        fprintf(w->f, "%s}\n", flags);
    }
    for (uint32_t i = 0; i < o->num_spheres; i++) {
        put_sphere(w, &w->s->spheres[o->first_sphere + i], offset);
        put_texture(w, albedo, radiance);
        fprintf(w->f, "%s}\n", flags);
    }
}

/* Names come from the file and end up in a comment line. */
static void put_name(const struct writer *w, const char *name)
{
    for (; *name != '\0'; name++)
        fputc((unsigned char)*name < ' ' ? ' ' : *name, w->f);
}

static void put_object(const struct writer *w, const struct object *o)
{
    const struct material *m = &w->s->materials[o->material];
    const rgb black = {0};
    double behind = -BACKING * w->plan->extent;
    fputs("\n// ", w->f);
    put_name(w, o->name);
    fputc('\n', w->f);
    if (rgb_is_zero(m->radiance)) {
        put_shapes(w, o, 0, m->reflectance, black, "");
    } else if (w->plan->sources) {
        fputs("// lamp: the glow is for the camera only, the spotlights below do the lighting\n",
              w->f);
        put_shapes(w, o, 0, black, m->radiance, "  no_shadow no_radiosity\n");
        put_shapes(w, o, behind, black, black, "");
    } else {
        put_shapes(w, o, 0, m->reflectance, m->radiance, "");
        if (!m->radiance_both_sides) {
            fputs("// its back, which does not glow\n", w->f);
            put_shapes(w, o, behind, m->reflectance, black, "");
        }
    }
}

/* Position of node i of n on [0,1]: pairs of cells with the 2-point Gauss rule. */
static double gauss2(int i, int n)
{
    return (2 * (i / 2) + 1 + (i % 2 == 0 ? -1 : 1) / sqrt(3.0)) / n;
}

static void put_lamp(const struct writer *w, const struct povray_lamp *l, uint32_t index)
{
    int n = w->v->lamp_cells;
    double d = FADE * w->plan->extent;
    double c = l->area / ((double)n * n) / (2 * M_PI * d * d);
    fprintf(w->f, "\n// rectangle of radiance <%g,%g,%g>, area %.9g, as %d x %d spotlights\n",
            l->radiance.r, l->radiance.g, l->radiance.b, l->area, n, n);
    fprintf(w->f, "#macro Lamp%u(P)\n  light_source { P ", index);
    put_rgb(w, "rgb S*", c * l->radiance.r, c * l->radiance.g, c * l->radiance.b,
            " spotlight point_at P+");
    put(w, at(l->normal));
    fprintf(w->f,
            "\n    tightness 1 radius 90 falloff 90 fade_distance %.9g fade_power 2 }\n#end\n", d);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            double u = gauss2(i, n), v = gauss2(j, n);
            if (w->v->lamp_jitter) {
                struct sample4 r =
                    sampler_get(w->v->lamp_seed, index, (uint32_t)(i * n + j), 0, PURPOSE_LIGHT);
                u = (i + (double)r.u[0]) / n;
                v = (j + (double)r.u[1]) / n;
            }
            fprintf(w->f, "Lamp%u(", index);
            put(w, moved(moved(at(l->corner), u, l->edge1), v, l->edge2));
            fputs(j == n - 1 ? ")\n" : ") ", w->f);
        }
}

static void put_light(const struct writer *w, uint32_t index)
{
    const struct light *l = &w->s->lights[index];
    struct povray_lamp lamp;
    switch (l->kind) {
    case LIGHT_POINT: {
        bool constant = l->attenuation[0] > 0;
        double d = FADE * w->plan->extent;
        double c =
            constant ? 1 / (M_PI * l->attenuation[0]) : 1 / (2 * M_PI * d * d * l->attenuation[2]);
        fputs(constant ? "\n// point light without falloff\nlight_source { "
                       : "\n// point light\nlight_source { ",
              w->f);
        put(w, at(l->position));
        put_rgb(w, " rgb S*", c * l->value.r, c * l->value.g, c * l->value.b, "");
        if (!constant)
            fprintf(w->f, " fade_distance %.9g fade_power 2", d);
        fputs(" }\n", w->f);
        break;
    }
    case LIGHT_DIRECTIONAL: {
        vec3 middle = scale(add(w->s->bounds_min, w->s->bounds_max), 0.5f);
        fputs("\n// directional light\nlight_source { ", w->f);
        put(w, moved(at(middle), 10 * w->plan->extent, l->to_light));
        put_rgb(w, " rgb S*", l->value.r / M_PI, l->value.g / M_PI, l->value.b / M_PI,
                " parallel point_at ");
        put(w, at(middle));
        fputs(" }\n", w->f);
        break;
    }
    case LIGHT_SPOT:
    case LIGHT_ENVIRONMENT: assert(false); break; /* the plan has refused them */
    case LIGHT_TRIANGLES:
    case LIGHT_SPHERE: {
        bool ok = povray_lamp(w->s, l, &lamp);
        assert(ok);
        if (ok)
            put_lamp(w, &lamp, index);
        break;
    }
    }
}

static void put_header(const struct writer *w, const struct camera *c)
{
    fprintf(w->f,
            "// Render linear: povray +Iscene.pov +Oscene.exr +FE +W%d +H%d -A -D -P +WT1 "
            "File_Gamma=1.0\n"
            "// Numbers are radiance times S, right-handed, Y up.\n"
            "#version 3.7;\n#declare S = %.17g;\n"
            "global_settings { assumed_gamma 1.0 max_trace_level 60 adc_bailout 1e-9",
            c->width, c->height, w->v->scale);
    if (w->radiosity)
        fprintf(w->f,
                "\n  // a path tracer: no sample is kept, one of the five rays is followed\n"
                "  radiosity { pretrace_start 1 pretrace_end 1 count 5,100003 recursion_limit %d\n"
                "    nearest_count 1 error_bound 1e-3 low_error_factor 1 gray_threshold 0 "
                "brightness 1\n"
                "    adc_bailout 1e-9 always_sample on normal off media off\n"
                "    maximum_reuse 1e30 minimum_reuse 0 }\n}\n#default { radiosity { importance "
                "0.01 } }\n",
                w->plan->recursion);
    else
        fputs(" }\n", w->f);
    if (w->roulette > 0)
        fprintf(w->f,
                "// Russian roulette: a point reflects nothing where Fate < %g, else 1/%g of its "
                "share\n#declare Fate = function(x,y,z) {\n"
                "  mod(abs(sin(12951*x+77529*y+37078*z)*43758.5453)\n"
                "      + abs(sin(71993*x+31337*y+53299*z+1)*22578.1459), 1) }\n",
                w->roulette, 1 - w->roulette);
    fputs("#default { finish { ambient 0 } }\n", w->f);
}

static void put_camera(const struct writer *w, const struct camera *c)
{
    double width = 2 * (double)c->tan_h, height = 2 * (double)c->tan_v;
    fputs("camera { location ", w->f);
    put(w, at(c->eye));
    fputs("\n  direction ", w->f);
    put(w, moved(moved(moved((struct point){0}, -1, c->backward), w->v->shift_x * width, c->right),
                 w->v->shift_y * height, c->up));
    fputs("\n  right ", w->f);
    put(w, moved((struct point){0}, width, c->right));
    fputs("\n  up ", w->f);
    put(w, moved((struct point){0}, height, c->up));
    fputs(" }\n", w->f);
}

bool export_povray(const struct scene *s, const struct camera *c, int depth,
                   const struct povray_variant *v, FILE *f, struct err *e)
{
    assert(v->lamp_cells >= 1 && (v->lamp_jitter || v->lamp_cells % 2 == 0));
    assert(v->roulette >= 0 && v->roulette < 1 && v->scale > 0);
    struct povray_plan plan;
    if (!povray_plan(s, c, depth, &plan, e))
        return false;
    bool radiosity = v->indirect && plan.recursion > 0;
    struct writer w = {.f = f,
                       .s = s,
                       .v = v,
                       .plan = &plan,
                       .radiosity = radiosity,
                       .roulette = plan.recursion > 0 && !plan.constant ? v->roulette : 0};
    put_header(&w, c);
    put_camera(&w, c);
    for (uint32_t i = 0; i < s->num_objects; i++)
        put_object(&w, &s->objects[i]);
    if (plan.sources && depth > 0)
        for (uint32_t i = 0; i < s->num_lights; i++)
            put_light(&w, i);
    if (ferror(f))
        return err_set(e, "cannot write the POV-Ray scene");
    return true;
}
