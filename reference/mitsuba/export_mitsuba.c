#include "export_mitsuba.h"

#include "reference/replicates/replicate_images.h"
#include "reference/suite/features.h"
#include "mitsuba_xml.h"

#include "renderer/scene/environment.h"
#include "renderer/base/fs.h"

#include <assert.h>
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What the writers below share. */
struct writer {
    struct mitsuba_xml *xml;
    const struct scene *s;
    const struct camera *c;
    const char *stem; /* path without its ending */
    const char *base; /* the same without its directory */
};

/* The reference to a file beside the scene. */
static void filename(struct writer *w, const char *ending)
{
    mitsuba_text(w->xml, "string", "filename", fs_path("%s_%s", w->base, ending).s);
}

/* Only for filters that check_filter() accepts. */
static void put_filter(struct writer *w, const struct pixel_filter *f)
{
    static const char *const names[] = {"box", "tent", "gaussian"};
    mitsuba_begin(w->xml, "rfilter", names[f->kind], NULL, NULL);
    if (f->kind == PIXEL_FILTER_TENT)
        mitsuba_real(w->xml, "float", "radius", f->radius);
    if (f->kind == PIXEL_FILTER_GAUSS)
        mitsuba_real(w->xml, "float", "stddev", f->sigma);
    mitsuba_end(w->xml);
}

/* The camera looks along +Z with +X to the left. */
static void put_camera(struct writer *w)
{
    const struct camera *c = w->c;
    mitsuba_begin(w->xml, "sensor", c->lens_radius > 0 ? "thinlens" : "perspective", NULL, NULL);
    mitsuba_real(w->xml, "float", "fov", 2 * atan((double)c->tan_h) * 180 / M_PI);
    mitsuba_text(w->xml, "string", "fov_axis", "x");
    /* Mitsuba's are depths, ours distances along the ray; nothing is cut
     * (features_check_exportable()). */
    double corner = sqrt(1 + (double)c->tan_h * c->tan_h + (double)c->tan_v * c->tan_v);
    mitsuba_real(w->xml, "float", "near_clip", (double)c->near / corner);
    mitsuba_real(w->xml, "float", "far_clip", (double)c->far);
    if (c->lens_radius > 0) {
        mitsuba_real(w->xml, "float", "aperture_radius", (double)c->lens_radius);
        mitsuba_real(w->xml, "float", "focus_distance", (double)c->focal_distance);
    }
    mitsuba_transform(w->xml, neg(c->right), c->up, neg(c->backward), c->eye);
    mitsuba_begin(w->xml, "sampler", "independent", NULL, NULL);
    mitsuba_text(w->xml, "integer", "sample_count", "$spp");
    mitsuba_text(w->xml, "integer", "seed", "$seed");
    mitsuba_end(w->xml);
    mitsuba_begin(w->xml, "film", "hdrfilm", NULL, NULL);
    mitsuba_integer(w->xml, "width", c->width);
    mitsuba_integer(w->xml, "height", c->height);
    mitsuba_text(w->xml, "string", "pixel_format", "rgb");
    mitsuba_text(w->xml, "string", "component_format", "float32");
    put_filter(w, &c->filter);
    mitsuba_end(w->xml);
    mitsuba_end(w->xml);
}

/* An index of refraction; a coloured one goes into an image, as Mitsuba limits other rgb values to
 * 1. */
static bool put_index(struct writer *w, const char *name, uint32_t material, rgb value,
                      struct err *e)
{
    if (value.r == value.g && value.g == value.b) {
        mitsuba_real(w->xml, "spectrum", name, (double)value.r);
        return true;
    }
    char ending[64];
    rgb px[4] = {value, value, value, value};
    snprintf(ending, sizeof ending, "material_%u_%s.exr", material, name);
    bool ok = replicate_images_write(fs_path("%s_%s", w->stem, ending).s, 2, 2, &px->r, e);
    mitsuba_begin(w->xml, "texture", "bitmap", "name", name);
    filename(w, ending);
    mitsuba_text(w->xml, "string", "filter_type", "nearest");
    mitsuba_text(w->xml, "boolean", "raw", "true");
    mitsuba_end(w->xml);
    return ok;
}

/* A rough conductor or a mirror. */
static bool put_metal(struct writer *w, uint32_t index, struct err *e)
{
    const struct material *m = &w->s->materials[index];
    const bool rough = m->kind == MATERIAL_MICROFACET;
    bool ok = true;
    mitsuba_begin(w->xml, "bsdf", rough ? "roughconductor" : "conductor", NULL, NULL);
    if (rough) {
        mitsuba_text(w->xml, "string", "distribution",
                     m->microfacet == MICROFACET_GGX ? "ggx" : "beckmann");
        mitsuba_real(w->xml, "float", "alpha", (double)m->alpha);
    }
    if (rough && m->conductor) {
        ok = put_index(w, "eta", index, m->eta, e) && put_index(w, "k", index, m->k, e);
    } else {
        mitsuba_text(w->xml, "string", "material", "none");
        mitsuba_rgb(w->xml, "specular_reflectance", m->reflectance);
    }
    mitsuba_end(w->xml);
    return ok;
}

static bool check_material(const struct material *m, struct err *e)
{
    const unsigned expressed = 1u << MATERIAL_DIFFUSE | 1u << MATERIAL_MIRROR |
                               1u << MATERIAL_GLASS | 1u << MATERIAL_MICROFACET;
    const char *why = NULL;
    if (!(1u << m->kind & expressed))
        why = features_material_names[m->kind];
    else if (m->kind == MATERIAL_GLASS && m->schlick)
        why = "Schlick's approximation";
    else if (m->kind == MATERIAL_MICROFACET && !m->separable)
        why = "shadowing and masking that are correlated";
    else if (!rgb_is_zero(m->radiance) && m->radiance_both_sides)
        why = "emission on both sides";
    return why == NULL || err_set(e, "Mitsuba does not have %s (material '%s')", why, m->name);
}

static bool put_material(struct writer *w, uint32_t index, struct err *e)
{
    const struct material *m = &w->s->materials[index];
    char id[32];
    if (!check_material(m, e))
        return false;
    snprintf(id, sizeof id, "material_%u", index);
    mitsuba_begin(w->xml, "bsdf", m->kind == MATERIAL_GLASS ? "dielectric" : "twosided", "id", id);
    bool ok = true;
    if (m->kind == MATERIAL_GLASS) {
        mitsuba_real(w->xml, "float", "int_ior", (double)m->ior);
        mitsuba_real(w->xml, "float", "ext_ior", 1);
        mitsuba_rgb(w->xml, "specular_reflectance", m->reflectance);
        mitsuba_rgb(w->xml, "specular_transmittance", m->transmittance);
    } else if (m->kind == MATERIAL_DIFFUSE) {
        mitsuba_begin(w->xml, "bsdf", "diffuse", NULL, NULL);
        mitsuba_rgb(w->xml, "reflectance", m->reflectance);
        mitsuba_end(w->xml);
    } else {
        ok = put_metal(w, index, e);
    }
    mitsuba_end(w->xml);
    return ok;
}

/* Writes an object as binary PLY; each triangle has three vertices of its own. */
static bool write_mesh(const struct writer *w, const struct object *o, const char *ending,
                       bool smooth, struct err *e)
{
    struct out_file out;
    if (!out_open(&out, fs_path("%s_%s", w->stem, ending).s, e))
        return false;
    fprintf(out.f,
            "ply\nformat binary_little_endian 1.0\nelement vertex %u\nproperty float x\n"
            "property float y\nproperty float z\n%selement face %u\n"
            "property list uchar int vertex_indices\nend_header\n",
            3 * o->num_triangles,
            smooth ? "property float nx\nproperty float ny\nproperty float nz\n" : "",
            o->num_triangles);
    for (size_t i = 3 * (size_t)o->first_triangle;
         i < 3 * ((size_t)o->first_triangle + o->num_triangles); i++) {
        const vec3 p = w->s->position[i], n = w->s->normal[i];
        const float v[6] = {p.x, p.y, p.z, n.x, n.y, n.z};
        fwrite(v, sizeof *v, smooth ? 6 : 3, out.f);
    }
    for (uint32_t i = 0; i < o->num_triangles; i++) {
        const uint32_t v[3] = {3 * i, 3 * i + 1, 3 * i + 2};
        fputc(3, out.f);
        fwrite(v, sizeof *v, 3, out.f);
    }
    return out_commit(&out, e);
}

static void put_surface(struct writer *w, const struct object *o)
{
    const struct material *m = &w->s->materials[o->material];
    char id[32];
    snprintf(id, sizeof id, "material_%u", o->material);
    mitsuba_begin(w->xml, "ref", NULL, "id", id);
    mitsuba_end(w->xml);
    if (!rgb_is_zero(m->radiance)) {
        mitsuba_begin(w->xml, "emitter", "area", NULL, NULL);
        mitsuba_rgb(w->xml, "radiance", m->radiance);
        mitsuba_end(w->xml);
    }
}

static bool put_object(struct writer *w, uint32_t index, struct err *e)
{
    const struct object *o = &w->s->objects[index];
    const struct material *m = &w->s->materials[o->material];
    char ending[32];
    bool smooth = features_are_smooth(w->s, o->first_triangle, o->num_triangles);
    /* The emitting side is given by the geometric normal for us, by the shading normal in
     * Mitsuba. */
    if (smooth && !rgb_is_zero(m->radiance)) {
        smooth = false;
        if (m->kind != MATERIAL_DIFFUSE || !rgb_is_zero(m->reflectance))
            return err_set(e, "Mitsuba: object '%s' glows, reflects and is smooth", o->name);
    }
    if (o->num_triangles > 0) {
        snprintf(ending, sizeof ending, "object_%u.ply", index);
        if (!write_mesh(w, o, ending, smooth, e))
            return false;
        mitsuba_begin(w->xml, "shape", "ply", NULL, NULL);
        filename(w, ending);
        mitsuba_text(w->xml, "boolean", "face_normals", smooth ? "false" : "true");
        put_surface(w, o);
        mitsuba_end(w->xml);
    }
    for (uint32_t i = o->first_sphere; i < o->first_sphere + o->num_spheres; i++) {
        const struct sphere *b = &w->s->spheres[i];
        mitsuba_begin(w->xml, "shape", "sphere", NULL, NULL);
        mitsuba_point(w->xml, "point", "center", b->centre);
        mitsuba_real(w->xml, "float", "radius", (double)b->radius);
        mitsuba_text(w->xml, "boolean", "flip_normals", b->normal_out < 0 ? "true" : "false");
        put_surface(w, o);
        mitsuba_end(w->xml);
    }
    return true;
}

/* In Mitsuba's environment image columns run in the opposite direction, and row r is at theta = pi
 * r/(H-1). With two rows for each of ours every kink of our interpolation falls on a row or column,
 * so that both interpolations agree. */
static bool put_sky_image(struct writer *w, int width, int height, struct err *e)
{
    const int rows = 2 * height + 1;
    rgb *px = malloc((size_t)width * (size_t)rows * sizeof *px);
    if (px == NULL)
        return err_set(e, "out of memory");
    for (int y = 0; y < rows; y++)
        for (int x = 0; x < width; x++) {
            /* Clamped next to the poles, where our interpolation is constant in theta, so that the
             * direction keeps its longitude. */
            double row = fmin(fmax(y, 0.5), rows - 1.5), theta = M_PI * row / (rows - 1);
            double phi = 2 * M_PI * (width - 1 - x + 0.5) / width;
            vec3 d = v3((float)(-cos(phi) * sin(theta)), (float)cos(theta),
                        (float)(sin(phi) * sin(theta)));
            px[(size_t)y * (size_t)width + (size_t)x] = environment_radiance(w->s->environment, d);
        }
    bool ok =
        replicate_images_write(fs_path("%s_environment.exr", w->stem).s, width, rows, &px->r, e);
    free(px);
    mitsuba_begin(w->xml, "emitter", "envmap", NULL, NULL);
    filename(w, "environment.exr");
    mitsuba_transform(w->xml, v3(0, 0, -1), v3(0, 1, 0), v3(1, 0, 0), v3(0, 0, 0));
    mitsuba_end(w->xml);
    return ok;
}

static bool put_sky(struct writer *w, struct err *e)
{
    struct environment_parts sky = environment_parts(w->s->environment);
    if (sky.kind == ENVIRONMENT_IMAGE)
        return put_sky_image(w, (int)sky.width, (int)sky.height, e);
    mitsuba_begin(w->xml, "emitter", "constant", NULL, NULL);
    mitsuba_rgb(w->xml, "radiance", sky.radiance);
    mitsuba_end(w->xml);
    return true;
}

static bool put_light(struct writer *w, uint32_t index, struct err *e)
{
    const struct light *l = &w->s->lights[index];
    switch (l->kind) {
    case LIGHT_POINT:
        mitsuba_begin(w->xml, "emitter", "point", NULL, NULL);
        mitsuba_point(w->xml, "point", "position", l->position);
        mitsuba_rgb(w->xml, "intensity", rgb_scale(l->value, 1 / l->attenuation[2]));
        mitsuba_end(w->xml);
        return true;
    case LIGHT_SPOT: {
        double angle = acos((double)l->cos_cutoff) * 180 / M_PI;
        frame f = frame_from_normal(l->axis);
        mitsuba_begin(w->xml, "emitter", "spot", NULL, NULL);
        mitsuba_rgb(w->xml, "intensity", rgb_scale(l->value, 1 / l->attenuation[2]));
        mitsuba_real(w->xml, "float", "cutoff_angle", angle);
        mitsuba_real(w->xml, "float", "beam_width", angle);
        mitsuba_transform(w->xml, f.s, f.t, f.n, l->position);
        mitsuba_end(w->xml);
        return true;
    }
    case LIGHT_DIRECTIONAL:
        mitsuba_begin(w->xml, "emitter", "directional", NULL, NULL);
        mitsuba_point(w->xml, "vector", "direction", neg(l->to_light));
        mitsuba_rgb(w->xml, "irradiance", l->value);
        mitsuba_end(w->xml);
        return true;
    case LIGHT_ENVIRONMENT: return put_sky(w, e);
    case LIGHT_TRIANGLES:
    case LIGHT_SPHERE: break; /* by their material */
    }
    return true;
}

static bool put_scene(struct writer *w, int depth, struct err *e)
{
    mitsuba_text(w->xml, "default", "spp", "16");
    mitsuba_text(w->xml, "default", "seed", "0");
    mitsuba_begin(w->xml, "integrator", "path", NULL, NULL);
    mitsuba_integer(w->xml, "max_depth",
                    depth + 1); /* light seen directly counts as depth 1 */
    mitsuba_integer(w->xml, "rr_depth", 1000000);
    mitsuba_end(w->xml);
    put_camera(w);
    bool ok = true;
    for (uint32_t i = 0; ok && i < w->s->num_materials; i++)
        ok = put_material(w, i, e);
    for (uint32_t i = 0; ok && i < w->s->num_objects; i++)
        ok = put_object(w, i, e);
    for (uint32_t i = 0; ok && i < w->s->num_lights; i++)
        ok = put_light(w, i, e);
    return ok;
}

/* Mitsuba's box is one pixel wide, and its Gauss has a radius of 4 sigma. */
static bool check_filter(const struct pixel_filter *f, struct err *e)
{
    char text[PIXEL_FILTER_TEXT];
    if (f->radius == 0 || f->kind == PIXEL_FILTER_TENT || pixel_filter_is_gauss(f, 4))
        return true;
    pixel_filter_print(f, text);
    return err_set(
        e, "Mitsuba: a pixel filter %s, not the box of one pixel, a tent, or gauss:SIGMA:(4 SIGMA)",
        text);
}

bool export_mitsuba(const struct scene *s, const struct camera *c, int depth, const char *path,
                    struct err *e)
{
    assert(depth >= 0);
    struct path stem = fs_path("%s", path);
    char *slash = strrchr(stem.s, '/'), *dot = strrchr(stem.s, '.');
    if (dot != NULL && (slash == NULL || dot > slash + 1))
        *dot = '\0';
    struct mitsuba_xml xml;
    struct writer w = {.xml = &xml, .s = s, .c = c, .stem = stem.s, .base = fs_base(stem.s)};
    if (!features_check_exportable("Mitsuba", s, c, e) || !check_filter(&c->filter, e))
        return false;
    bool ok = mitsuba_new(&xml, e) && put_scene(&w, depth, e) && mitsuba_write(&xml, path, e);
    mitsuba_free(&xml);
    return ok;
}
