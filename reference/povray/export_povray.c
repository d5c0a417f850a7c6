#include "export_povray.h"

#include "export_povray_internal.h"
#include "povray_glass.h"
#include "povray_lamp.h"
#include "povray_texture.h"

#include <assert.h>
#include <errno.h>
#include <string.h>

/* Distance of the black sheet behind a one-sided emitter, relative to the extent. mesh2 vertices are
 * float32, precise to 1e-7 of the extent. */
#define BACKING 2e-5

struct povray_variant povray_variant_plain(void)
{
    return (struct povray_variant){.rotation = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                   .lamp_cells = 16,
                                   .indirect = true,
                                   .roulette = 0.1,
                                   .scale = 1};
}

/* How a shape looks. */
struct look {
    const struct material *specular; /* mirror, refraction, glass; NULL: diffuse */
    rgb albedo;                      /* diffuse */
    rgb radiance;
    uint32_t material, reflectance_map, radiance_map; /* 0 and 0: no texture */
    const char *flags;
};

/* POV-Ray multiplies emission by the pigment, so we divide by it. boost: factor of the albedo. */
static void put_surface(const struct povray_writer *w, const struct look *l, double boost)
{
    const rgb albedo = l->albedo, radiance = l->radiance;
    if (l->reflectance_map != 0 && boost > 0) {
        povray_put_texture(w, l->material, l->reflectance_map, rgb_scale(albedo, (float)boost));
        fputs(" finish { diffuse 1 }", w->f);
        return;
    }
    if (l->radiance_map != 0 && !rgb_is_zero(radiance)) {
        povray_put_texture(w, l->material, l->radiance_map, radiance);
        fputs(" finish { diffuse 0 emission S }", w->f);
        return;
    }
    double r = albedo.r * boost, g = albedo.g * boost, b = albedo.b * boost;
    if (rgb_is_zero(albedo) || boost == 0) {
        fputs("pigment { rgb 1 } finish { diffuse 0", w->f);
        r = g = b = 1;
    } else {
        povray_put_rgb(w, "pigment { rgb ", r, g, b, " } finish { diffuse 1");
    }
    if (!rgb_is_zero(radiance))
        povray_put_rgb(w, " emission S*", radiance.r > 0 ? radiance.r / r : 0,
                       radiance.g > 0 ? radiance.g / g : 0, radiance.b > 0 ? radiance.b / b : 0,
                       "");
    fputs(" }", w->f);
}

static void put_mirror(const struct povray_writer *w, const struct look *l)
{
    rgb r = l->specular->reflectance, e = l->radiance;
    povray_put_rgb(w, "  texture { pigment { rgb 1 } finish { diffuse 0 reflection { rgb ",
                   (double)r.r, (double)r.g, (double)r.b, " }");
    if (!rgb_is_zero(e))
        povray_put_rgb(w, " emission S*", (double)e.r, (double)e.g, (double)e.b, "");
    fputs(" } }\n", w->f);
}

/* With `fresnel`, conserve_energy is needed to subtract the reflected light from the refracted ray. */
static void put_glass(const struct povray_writer *w, const struct material *m)
{
    fprintf(w->f,
            "  texture { pigment { rgbf <%.9g,%.9g,%.9g,1> } finish { diffuse 0%s } }\n"
            "  interior { ior %.9g }\n",
            (double)m->transmittance.r, (double)m->transmittance.g, (double)m->transmittance.b,
            m->kind == MATERIAL_GLASS ? " reflection { rgb 0, rgb 1 fresnel on } conserve_energy"
                                      : "",
            (double)m->ior);
}

static void put_diffuse(const struct povray_writer *w, const struct look *l)
{
    fputs("  texture { ", w->f);
    if (w->roulette > 0 && !rgb_is_zero(l->albedo)) {
        fprintf(w->f, "function { Fate(x,y,z) } texture_map {\n    [%.9g ", w->roulette);
        put_surface(w, l, 0);
        fprintf(w->f, "]\n    [%.9g ", w->roulette);
        put_surface(w, l, 1 / (1 - w->roulette));
        fputs("] }", w->f);
    } else {
        put_surface(w, l, 1);
    }
    fputs(" }\n", w->f);
}

static void put_look(const struct povray_writer *w, const struct look *l)
{
    if (l->specular == NULL)
        put_diffuse(w, l);
    else if (povray_is_glass(l->specular))
        put_glass(w, l->specular);
    else
        put_mirror(w, l);
    if (w->hide_reflections)
        fputs("  no_reflection\n", w->f);
    fprintf(w->f, "%s}\n", l->flags);
}

static vec3 geometric_normal(const vec3 *p)
{
    return normalize(cross(sub(p[1], p[0]), sub(p[2], p[0])));
}

/* mesh2 of an object, its vertices moved by `offset` along the geometric normals. */
static void put_mesh(const struct povray_writer *w, const struct object *o, double offset)
{
    const struct scene *s = w->s;
    bool smooth = false;
    fprintf(w->f, "mesh2 {\n  vertex_vectors { %u", 3 * o->num_triangles);
    for (uint32_t i = o->first_triangle; i < o->first_triangle + o->num_triangles; i++) {
        const vec3 *p = &s->position[3 * (size_t)i];
        vec3 n = geometric_normal(p);
        for (int k = 0; k < 3; k++) {
            fputs(k == 0 ? ",\n    " : ",", w->f);
            povray_put(w, povray_moved(d3_of(p[k]), offset, n));
            smooth |= dot(n, s->normal[3 * (size_t)i + (size_t)k]) < 1 - 1e-6f;
        }
    }
    if (smooth && offset == 0) {
        fprintf(w->f, " }\n  normal_vectors { %u", 3 * o->num_triangles);
        for (uint32_t i = o->first_triangle; i < o->first_triangle + o->num_triangles; i++)
            for (int k = 0; k < 3; k++) {
                fputs(k == 0 ? ",\n    " : ",", w->f);
                povray_put(w, d3_of(s->normal[3 * (size_t)i + (size_t)k]));
            }
    }
    if (material_has_map(&s->materials[o->material])) {
        fprintf(w->f, " }\n  uv_vectors { %u", 3 * o->num_triangles);
        for (size_t k = 3 * (size_t)o->first_triangle;
             k < 3 * ((size_t)o->first_triangle + o->num_triangles); k++)
            fprintf(w->f, "%s<%.9g,%.9g>", k % 6 == 0 ? ",\n    " : ",", (double)s->uv[k].u,
                    (double)s->uv[k].v);
    }
    fprintf(w->f, " }\n  face_indices { %u", o->num_triangles);
    for (uint32_t i = 0; i < o->num_triangles; i++)
        fprintf(w->f, "%s<%u,%u,%u>", i % 8 == 0 ? ",\n    " : ",", 3 * i, 3 * i + 1, 3 * i + 2);
    fputs(" }\n", w->f);
}

static void put_sphere(const struct povray_writer *w, const struct sphere *b, double offset)
{
    fputs("sphere { ", w->f);
    povray_put(w, d3_of(b->centre));
    fprintf(w->f, ", %.9g\n", b->radius + b->normal_out * offset);
    /* For rays that start inside a body, POV-Ray takes internal reflection in glass inside that body to be
     * zero; `inverse` makes the eye count as outside. */
    if (length(sub(w->eye, b->centre)) < b->radius)
        fputs("  inverse\n", w->f);
}

/* What becomes one POV-Ray object: the triangles of an object or one of its spheres. */
struct shape {
    const struct object *object;
    const struct sphere *ball; /* NULL: the triangles */
    int32_t light;             /* index into lights, -1 if it does not emit */
};

static void put_shape(const struct povray_writer *w, const struct shape *s, double offset,
                      const struct look *l)
{
    if (s->ball != NULL)
        put_sphere(w, s->ball, offset);
    else
        put_mesh(w, s->object, offset);
    put_look(w, l);
}

/* A lamp. The light sources do the lighting, so diffuse surfaces must not see the glow; the shield that
 * hides it from them does not exist for reflected and refracted rays. */
static void put_lamp(const struct povray_writer *w, const struct shape *s, rgb radiance)
{
    double sheet = BACKING * w->plan->extent;
    struct look glow = {.radiance = radiance, .flags = "  no_shadow no_radiosity\n"};
    const struct look black = {.flags = ""};
    const struct look shield = {.flags = "  no_image no_reflection no_shadow\n"};
    if (w->pass->glow) {
        fputs("// lamp: spotlights do the lighting, the glow is for the camera", w->f);
        fputs(w->plan->specular ? ", mirrors and glass\n" : "\n", w->f);
        if (w->plan->specular)
            glow.flags = "  no_shadow\n";
        put_shape(w, s, 0, &glow);
        if (w->plan->specular)
            put_shape(w, s, sheet, &shield);
    }
    put_shape(w, s, -sheet, &black);
}

/* POV-Ray's shadow rays pass straight through glass, ours are blocked: so glass gets an opaque shadow. */
static void put_glass_body(const struct povray_writer *w, const struct shape *s,
                           const struct material *m)
{
    const struct look glass = {.specular = m, .flags = w->pass->sources ? "  no_shadow\n" : ""};
    const struct look shadow = {.flags = "  no_image no_reflection no_radiosity\n"};
    put_shape(w, s, 0, &glass);
    if (w->pass->sources) {
        fputs("// its shadow\n", w->f);
        put_shape(w, s, 0, &shadow);
    }
}

static void put_part(const struct povray_writer *w, const struct shape *s)
{
    const struct material *m = &w->s->materials[s->object->material];
    struct povray_lamp lamp;
    if (s->light >= 0 && povray_lamp(w->s, &w->s->lights[s->light], &lamp)) {
        put_lamp(w, s, m->radiance);
        return;
    }
    if (povray_is_glass(m) && !material_is_black(m)) {
        put_glass_body(w, s, m);
        return;
    }
    struct look look = {.albedo = m->reflectance,
                        .material = s->object->material,
                        .reflectance_map = m->reflectance_map,
                        .radiance_map = m->radiance_map,
                        .flags = ""};
    if (m->kind != MATERIAL_DIFFUSE)
        look = (struct look){.specular = material_is_black(m) ? NULL : m,
                             .material = s->object->material,
                             .radiance_map = m->radiance_map,
                             .flags = ""};
    bool glows = w->pass->glow && !rgb_is_zero(m->radiance);
    if (glows)
        look.radiance = m->radiance;
    put_shape(w, s, 0, &look);
    if (glows && !m->radiance_both_sides) {
        look.radiance = grey(0);
        fputs("// its back, which does not glow\n", w->f);
        put_shape(w, s, -BACKING * w->plan->extent, &look);
    }
}

/* Names come from the file and end up in a comment line. */
static void put_name(const struct povray_writer *w, const char *name)
{
    for (; *name != '\0'; name++)
        fputc((unsigned char)*name < ' ' ? ' ' : *name, w->f);
}

static void put_object(const struct povray_writer *w, const struct object *o)
{
    fputs("\n// ", w->f);
    put_name(w, o->name);
    fputc('\n', w->f);
    if (o->num_triangles > 0)
        put_part(w, &(struct shape){.object = o, .light = w->s->tri_light[o->first_triangle]});
    for (uint32_t i = o->first_sphere; i < o->first_sphere + o->num_spheres; i++)
        put_part(w, &(struct shape){
                        .object = o, .ball = &w->s->spheres[i], .light = w->s->sphere_light[i]});
}

static void put_header(const struct povray_writer *w, const struct camera *c)
{
    bool deep = w->radiosity || w->v->indirect_levels;
    fprintf(w->f,
            "// Render linear: povray +Iscene.pov +Oscene.exr +FE +W%d +H%d -A -D -P +WT1 "
            "File_Gamma=1.0\n"
            "// Numbers are radiance times S, right-handed, Y up.\n"
            "#version 3.7;\n#declare S = %.17g;\n"
            "global_settings { assumed_gamma 1.0 max_trace_level %d adc_bailout %g",
            c->width, c->height, w->v->scale, deep ? w->pass->levels_indirect : w->pass->levels,
            deep ? w->pass->bailout_indirect : 1e-9);
    if (w->radiosity)
        fprintf(w->f,
                "\n  // a path tracer: no sample is kept, one of the five rays is followed\n"
                "  radiosity { pretrace_start 1 pretrace_end 1 count 5,100003 recursion_limit %d\n"
                "    nearest_count 1 error_bound 1e-3 low_error_factor 1 gray_threshold 0 "
                "brightness 1\n"
                "    adc_bailout %g always_sample on normal off media off\n"
                "    maximum_reuse 1e30 minimum_reuse 0 }\n}\n#default { radiosity { importance "
                "0.01 } }\n",
                w->pass->recursion, w->pass->bailout_indirect);
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

static void put_camera(const struct povray_writer *w, const struct camera *c)
{
    double width = 2 * (double)c->tan_h, height = 2 * (double)c->tan_v;
    fputs("camera { location ", w->f);
    povray_put(w, d3_of(c->eye));
    fputs("\n  direction ", w->f);
    povray_put(w, povray_moved(povray_moved(povray_moved((dvec3){0}, -1, c->backward),
                                            w->v->shift_x * width, c->right),
                               w->v->shift_y * height, c->up));
    fputs("\n  right ", w->f);
    povray_put(w, povray_moved((dvec3){0}, width, c->right));
    fputs("\n  up ", w->f);
    povray_put(w, povray_moved((dvec3){0}, height, c->up));
    fputs(" }\n", w->f);
}

bool export_povray(const struct scene *s, const struct camera *c, int depth,
                   const struct povray_variant *v, FILE *f, struct err *e)
{
    assert(v->lamp_cells >= 1 && (v->rule != POVRAY_GAUSS || v->lamp_cells % 2 == 0));
    assert(v->roulette >= 0 && v->roulette < 1 && v->scale > 0);
    struct povray_passes plan;
    if (!povray_passes(s, c, depth, &plan, e))
        return false;
    assert(v->pass >= 0 && v->pass < plan.num_passes);
    const struct povray_pass *pass = &plan.pass[v->pass];
    struct povray_writer w = {.f = f,
                              .s = s,
                              .v = v,
                              .plan = &plan,
                              .pass = pass,
                              .eye = c->eye,
                              .radiosity = v->indirect && pass->recursion > 0,
                              .hide_reflections = povray_hides_total_reflection(s),
                              .roulette = pass->recursion > 0 && !plan.constant ? v->roulette : 0};
    put_header(&w, c);
    put_camera(&w, c);
    for (uint32_t i = 0; i < s->num_objects; i++)
        put_object(&w, &s->objects[i]);
    if (pass->sources)
        povray_put_lights(&w);
    povray_put_sky(&w);
    if (ferror(f))
        return err_set(e, "cannot write the POV-Ray scene: %s", strerror(errno));
    return true;
}
