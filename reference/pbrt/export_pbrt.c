#include "export_pbrt.h"

#include "reference/suite/features.h"

#include "renderer/base/fs.h"
#include "renderer/image/image.h"
#include "renderer/scene/environment.h"

#include <assert.h>
#include <gsl/gsl_math.h>
#include <string.h>

struct writer {
    FILE *f;
    const struct scene *s;
    const char *path; /* of the scene file */
};

static void put3(const struct writer *w, const char *type, const char *name, double x, double y,
                 double z)
{
    fprintf(w->f, " \"%s %s\" [%.9g %.9g %.9g]", type, name, x + 0.0, y + 0.0, z + 0.0);
}

static void put_rgb(const struct writer *w, const char *name, rgb c)
{
    put3(w, "rgb", name, (double)c.r, (double)c.g, (double)c.b);
}

static void put_point(const struct writer *w, const char *name, vec3 p)
{
    put3(w, "point3", name, (double)p.x, (double)p.y, (double)p.z);
}

/* pbrt's Gauss is defined like ours: minus its value at the radius. */
static void put_filter(const struct writer *w, const struct pixel_filter *f)
{
    static const char *const names[] = {"box", "triangle", "gaussian"};
    double radius = f->radius > 0 ? f->radius : 0.5;
    fprintf(w->f, "PixelFilter \"%s\" \"float xradius\" [%.9g] \"float yradius\" [%.9g]",
            names[f->kind], radius, radius);
    if (f->kind == PIXEL_FILTER_GAUSS)
        fprintf(w->f, " \"float sigma\" [%.9g]", f->sigma);
    fputs("\n", w->f);
}

/* The world-to-camera matrix, column by column; the camera looks along +Z with +X to the right. */
static void put_camera(const struct writer *w, const struct camera *c)
{
    const vec3 row[3] = {c->right, c->up, neg(c->backward)};
    fputs("Transform [", w->f);
    for (int k = 0; k < 4; k++) {
        for (int i = 0; i < 3; i++) {
            const double axis[3] = {(double)row[i].x, (double)row[i].y, (double)row[i].z};
            double moved = -(axis[0] * (double)c->eye.x + axis[1] * (double)c->eye.y +
                             axis[2] * (double)c->eye.z);
            fprintf(w->f, "%.9g ", (k < 3 ? axis[k] : moved) + 0.0);
        }
        fputs(k < 3 ? "0  " : "1", w->f);
    }
    double h = (double)c->tan_h, v = (double)c->tan_v;
    fprintf(w->f,
            "]\nCamera \"perspective\" \"float fov\" [90] \"float screenwindow\" "
            "[%.9g %.9g %.9g %.9g]",
            -h, h, -v, v);
    if (c->lens_radius > 0)
        fprintf(w->f, " \"float lensradius\" [%.9g] \"float focaldistance\" [%.9g]",
                (double)c->lens_radius, (double)c->focal_distance);
    fprintf(w->f,
            "\nFilm \"rgb\" \"integer xresolution\" [%d] \"integer yresolution\" [%d]"
            " \"bool savefp16\" [false] \"string filename\" [\"pbrt.exr\"]\n",
            c->width, c->height);
    put_filter(w, &c->filter);
    fputs("Sampler \"independent\" \"integer pixelsamples\" [16]\n", w->f);
}

static bool is_one(rgb c)
{
    return c.r == 1 && c.g == 1 && c.b == 1;
}

static bool is_grey(rgb c)
{
    return c.r == c.g && c.g == c.b && c.r <= 1;
}

static const char *what_mirrors_lack(const struct material *m)
{
    return is_grey(m->reflectance) ? NULL : "a mirror of a colour (each channel by itself is grey)";
}

static const char *what_glass_lacks(const struct material *m)
{
    if (m->schlick)
        return "Schlick's approximation";
    return is_one(m->reflectance) && is_one(m->transmittance) ? NULL : "tinted glass";
}

static const char *what_metals_lack(const struct material *m)
{
    if (m->microfacet != MICROFACET_GGX)
        return "Beckmann's distribution";
    if (m->separable)
        return "shadowing and masking that are independent";
    return m->conductor || is_grey(m->reflectance)
               ? NULL
               : "a rough metal of a colour without an index of refraction (each channel by itself is grey)";
}

static void put_diffuse(const struct writer *w, const struct material *m)
{
    put_rgb(w, "reflectance", m->reflectance);
}

static void put_glass(const struct writer *w, const struct material *m)
{
    fprintf(w->f, " \"float eta\" [%.9g]", (double)m->ior);
}

static void put_metal(const struct writer *w, const struct material *m)
{
    if (m->kind == MATERIAL_MICROFACET && m->conductor) {
        put_rgb(w, "eta", m->eta);
        put_rgb(w, "k", m->k);
    } else {
        put_rgb(w, "reflectance", grey(1));
    }
    if (m->kind == MATERIAL_MICROFACET)
        fprintf(w->f, " \"float roughness\" [%.9g] \"bool remaproughness\" [false]",
                (double)m->alpha);
}

/* Kinds without a type do not exist in pbrt. */
static const struct {
    const char *type;
    const char *(*missing)(const struct material *m); /* what pbrt lacks of a material; NULL: nothing */
    void (*put)(const struct writer *w, const struct material *m);
} KIND[NUM_MATERIAL_KINDS] = {[MATERIAL_DIFFUSE] = {"diffuse", NULL, put_diffuse},
                              [MATERIAL_MIRROR] = {"conductor", what_mirrors_lack, put_metal},
                              [MATERIAL_GLASS] = {"dielectric", what_glass_lacks, put_glass},
                              [MATERIAL_MICROFACET] = {"conductor", what_metals_lack, put_metal}};

/* A reflectance below 1 at every angle, which no index of refraction gives, as a mix: pbrt picks one of two materials
 * at random, the second (black) with probability `amount`. Its reflectance of 1 is really 0.9999. */
static void put_part(const struct writer *w, uint32_t index, double reflectance)
{
    fprintf(w->f, "MakeNamedMaterial \"material_%u_black\" \"string type\" [\"diffuse\"]", index);
    put_rgb(w, "reflectance", grey(0));
    fprintf(w->f,
            "\nMakeNamedMaterial \"material_%u\" \"string type\" [\"mix\"] \"string materials\" "
            "[\"material_%u_whole\" \"material_%u_black\"] \"float amount\" [%.9g]\n",
            index, index, index, fmax(0, 1 - reflectance / 0.9999));
}

static bool put_material(const struct writer *w, uint32_t index, struct err *e)
{
    const struct material *m = &w->s->materials[index];
    const char *missing = NULL;
    if (KIND[m->kind].type == NULL)
        missing = features_material_names[m->kind];
    else if (KIND[m->kind].missing != NULL)
        missing = KIND[m->kind].missing(m);
    if (missing != NULL)
        return err_set(e, "pbrt does not have %s (material '%s')", missing, m->name);
    bool darker = m->kind == MATERIAL_MIRROR || (m->kind == MATERIAL_MICROFACET && !m->conductor);
    darker = darker && !is_one(m->reflectance);
    fprintf(w->f, "MakeNamedMaterial \"material_%u%s\" \"string type\" [\"%s\"]", index,
            darker ? "_whole" : "", KIND[m->kind].type);
    KIND[m->kind].put(w, m);
    fputc('\n', w->f);
    if (darker)
        put_part(w, index, (double)m->reflectance.r);
    return true;
}

static void put_vertices(const struct writer *w, const struct object *o, const vec3 *v)
{
    v += 3 * (size_t)o->first_triangle;
    for (size_t k = 0; k < 3 * (size_t)o->num_triangles; k++)
        fprintf(w->f, "\n  %.9g %.9g %.9g", (double)v[k].x, (double)v[k].y, (double)v[k].z);
}

static void put_mesh(const struct writer *w, const struct object *o)
{
    fputs("Shape \"trianglemesh\" \"point3 P\" [", w->f);
    put_vertices(w, o, w->s->position);
    if (features_are_smooth(w->s, o->first_triangle, o->num_triangles)) {
        fputs("]\n \"normal N\" [", w->f);
        put_vertices(w, o, w->s->normal);
    }
    fputs("]\n \"integer indices\" [", w->f);
    for (uint32_t i = 0; i < 3 * o->num_triangles; i++)
        fprintf(w->f, i % 24 == 0 ? "\n  %u" : " %u", i);
    fputs("]\n", w->f);
}

static void put_object(const struct writer *w, const struct object *o)
{
    const struct material *m = &w->s->materials[o->material];
    fprintf(w->f, "AttributeBegin\nNamedMaterial \"material_%u\"\n", o->material);
    if (!rgb_is_zero(m->radiance)) {
        fputs("AreaLightSource \"diffuse\"", w->f);
        put_rgb(w, "L", m->radiance);
        fprintf(w->f, " \"bool twosided\" [%s]\n", m->radiance_both_sides ? "true" : "false");
    }
    if (o->num_triangles > 0)
        put_mesh(w, o);
    for (uint32_t i = o->first_sphere; i < o->first_sphere + o->num_spheres; i++) {
        const struct sphere *b = &w->s->spheres[i];
        fprintf(
            w->f,
            "AttributeBegin\nTranslate %.9g %.9g %.9g\n%sShape \"sphere\" \"float radius\" [%.9g]\nAttributeEnd\n",
            (double)b->centre.x, (double)b->centre.y, (double)b->centre.z,
            b->normal_out < 0 ? "ReverseOrientation\n" : "", (double)b->radius);
    }
    fputs("AttributeEnd\n", w->f);
}

/* The direction of a point of the unit square in pbrt's equal-area mapping of the sphere [Clarberg08]. */
static vec3 square_to_sphere(double x, double y)
{
    double u = 2 * x - 1, v = 2 * y - 1, from_rim = 1 - (fabs(u) + fabs(v));
    double r = 1 - fabs(from_rim), phi = (r == 0 ? 1 : (fabs(v) - fabs(u)) / r + 1) * M_PI / 4;
    double across = r * sqrt(2 - r * r);
    return v3((float)copysign(cos(phi) * across, u), (float)copysign(sin(phi) * across, v),
              (float)copysign(1 - r * r, from_rim));
}

/* pbrt does not interpolate texels: one texel of ours becomes up to so many of its image in each direction. */
enum { TEXELS_PER_ROW = 16, MOST_TEXELS = 4096, MOST_ROWS = 512 };

static bool put_sky_image(const struct writer *w, uint32_t rows, struct err *e)
{
    struct path name = fs_path("%s", w->path);
    char *slash = strrchr(name.s, '/'), *dot = strrchr(name.s, '.');
    struct image im;
    int side = (int)rows * TEXELS_PER_ROW;
    if (rows > MOST_ROWS)
        return err_set(
            e,
            "pbrt: an environment image of %u rows, at most %d have their like in one of "
            "%d x %d texels without interpolation",
            rows, MOST_ROWS, MOST_TEXELS, MOST_TEXELS);
    if (dot != NULL && (slash == NULL || dot > slash + 1))
        *dot = '\0';
    name = fs_path("%s_environment.exr", name.s);
    side = side < MOST_TEXELS ? side : MOST_TEXELS;
    if (!image_alloc(&im, side, side, 3, (const char *const[]){"R", "G", "B"}, e))
        return false;
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++) {
            rgb mean = grey(0);
            for (int k = 0; k < 4; k++)
                mean = rgb_add(mean, environment_radiance(
                                         w->s->environment,
                                         square_to_sphere((x + 0.25 + 0.5 * (k & 1)) / side,
                                                          (y + 0.25 + 0.5 * (k >> 1)) / side)));
            const float texel[3] = {mean.r / 4, mean.g / 4, mean.b / 4};
            memcpy(im.data + 3 * ((size_t)y * (size_t)side + (size_t)x), texel, sizeof texel);
        }
    bool ok = image_write_exr(name.s, &im, e);
    image_free(&im);
    fprintf(w->f, "LightSource \"infinite\" \"string filename\" [\"%s\"]\n", fs_base(name.s));
    return ok;
}

static bool put_sky(const struct writer *w, struct err *e)
{
    struct environment_parts sky = environment_parts(w->s->environment);
    if (sky.kind == ENVIRONMENT_IMAGE)
        return put_sky_image(w, sky.height, e);
    fputs("LightSource \"infinite\"", w->f);
    put_rgb(w, "L", sky.radiance);
    fputc('\n', w->f);
    return true;
}

static bool put_light(const struct writer *w, uint32_t index, struct err *e)
{
    const struct light *l = &w->s->lights[index];
    switch (l->kind) {
    case LIGHT_POINT:
        fputs("LightSource \"point\"", w->f);
        put_rgb(w, "I", rgb_scale(l->value, 1 / l->attenuation[2]));
        put_point(w, "from", l->position);
        break;
    case LIGHT_SPOT:
        fputs("LightSource \"spot\"", w->f);
        put_rgb(w, "I", rgb_scale(l->value, 1 / l->attenuation[2]));
        put_point(w, "from", l->position);
        put_point(w, "to", add(l->position, l->axis));
        fprintf(w->f, " \"float coneangle\" [%.9g] \"float conedeltaangle\" [0]",
                acos((double)l->cos_cutoff) * 180 / M_PI);
        break;
    case LIGHT_DIRECTIONAL:
        fputs("LightSource \"distant\"", w->f);
        put_rgb(w, "L", l->value);
        put_point(w, "from", l->to_light);
        put_point(w, "to", v3(0, 0, 0));
        break;
    case LIGHT_ENVIRONMENT: return put_sky(w, e);
    case LIGHT_TRIANGLES:
    case LIGHT_SPHERE: return true; /* with their object */
    }
    fputc('\n', w->f);
    return true;
}

static bool put_scene(const struct writer *w, const struct camera *c, int depth, struct err *e)
{
    fprintf(w->f,
            "# pbrt --spp 64 --seed 1 --outfile OUT.exr THIS\n"
            "Integrator \"path\" \"integer maxdepth\" [%d] \"bool regularize\" [false]\n",
            depth);
    put_camera(w, c);
    fputs("WorldBegin\n", w->f);
    bool ok = true;
    for (uint32_t i = 0; ok && i < w->s->num_materials; i++)
        ok = put_material(w, i, e);
    for (uint32_t i = 0; ok && i < w->s->num_lights; i++)
        ok = put_light(w, i, e);
    for (uint32_t i = 0; ok && i < w->s->num_objects; i++)
        put_object(w, &w->s->objects[i]);
    return ok;
}

bool export_pbrt(const struct scene *s, const struct camera *c, int depth, const char *path,
                 struct err *e)
{
    struct out_file out;
    assert(depth >= 0);
    if (!features_check_exportable("pbrt", s, c, e) || !out_open(&out, path, e))
        return false;
    if (put_scene(&(struct writer){out.f, s, path}, c, depth, e))
        return out_commit(&out, e);
    out_abandon(&out);
    return false;
}
