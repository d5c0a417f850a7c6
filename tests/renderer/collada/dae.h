/* Small COLLADA documents for the loader's tests, put together from pieces. */
#ifndef ASSAY_TEST_DAE_H
#define ASSAY_TEST_DAE_H

#include "renderer/collada/collada.h"
#include "tests/support/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BIND(target)                                                                               \
    "<bind_material><technique_common><instance_material symbol=\"m\" target=\"#" target "\"/>"    \
    "</technique_common></bind_material>"
#define INSTANCE(geometry)                                                                         \
    "<instance_geometry url=\"#" geometry "\">" BIND("grey") "</instance_geometry>"
#define PARAMS "<param name=\"X\"/><param name=\"Y\"/><param name=\"Z\"/>"
/* A <source> of n triples; numbers is their text and count 3n. */
#define SOURCE(id, count, n, numbers)                                                              \
    "<source id=\"" id "\"><float_array id=\"" id "-array\" count=\"" #count "\">" numbers         \
    "</float_array><technique_common><accessor source=\"#" id "-array\" count=\"" #n               \
    "\" stride=\"3\">" PARAMS "</accessor></technique_common></source>"
#define VERTICES(id, source)                                                                       \
    "<vertices id=\"" id "\"><input semantic=\"POSITION\" source=\"#" source "\"/></vertices>"
#define GEOMETRY(id, mesh) "<geometry id=\"" id "\"><mesh>" mesh "</mesh></geometry>"
#define EFFECT(id, body)   "<effect id=\"" id "-fx\">" body "</effect>"
#define COMMON(shader)                                                                             \
    "<profile_COMMON><technique sid=\"c\">" shader "</technique></profile_COMMON>"
#define MATERIAL(id) "<material id=\"" id "\"><instance_effect url=\"#" id "-fx\"/></material>"
#define EXTRA(profile, body)                                                                       \
    "<extra><technique profile=\"" profile "\">" body "</technique></extra>"

/* What every document has: a grey material and the triangle "tri" (0,0,0) (1,0,0) (0,1,0), whose
 * front is +Z, bound by the symbol "m". */
#define DAE_LIBRARIES                                                                              \
    EFFECT("grey", COMMON("<lambert><diffuse><color>0.5 0.5 0.5 1</color></diffuse></lambert>"))   \
    "</library_effects><library_materials>" MATERIAL(                                              \
        "grey") "</library_materials><library_geometries>" GEOMETRY("tri",                         \
                                                                    SOURCE("tri-p", 9, 3,          \
                                                                           "0 0 0 1 0 0 0 1 0")    \
                                                                        VERTICES(                  \
                                                                            "tri-v",               \
                                                                            "tri-p") "<triangles " \
                                                                                     "material="   \
                                                                                     "\"m\" "      \
                                                                                     "count="      \
                                                                                     "\"1\"><"     \
                                                                                     "input "      \
                                                                                     "semantic="   \
                                                                                     "\"VERTEX\" " \
                                                                                     "source=\"#"  \
                                                                                     "tri-v\" "    \
                                                                                     "offset="     \
                                                                                     "\"0\"/"      \
                                                                                     "><p>0 1 "    \
                                                                                     "2</p></"     \
                                                                                     "triangles>")

/* Pieces of a document; NULL for none. `libraries` are whole <library_...> elements. */
struct dae {
    const char *asset, *libraries, *nodes;
};

static inline char *dae_text(const struct dae *d)
{
    static const char FORMAT[] =
        "<?xml version=\"1.0\"?>\n"
        "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n"
        "<asset>%s</asset>\n<library_effects>" DAE_LIBRARIES "</library_geometries>\n%s\n"
        "<library_visual_scenes><visual_scene id=\"w\">%s</visual_scene></library_visual_scenes>\n"
        "<scene><instance_visual_scene url=\"#w\"/></scene></COLLADA>\n";
    const char *asset = d->asset != NULL ? d->asset : "";
    const char *libraries = d->libraries != NULL ? d->libraries : "";
    const char *nodes = d->nodes != NULL ? d->nodes : "";
    size_t size = sizeof FORMAT + strlen(asset) + strlen(libraries) + strlen(nodes);
    char *text = malloc(size);
    assert_non_null(text);
    snprintf(text, size, FORMAT, asset, libraries, nodes);
    return text;
}

static inline bool dae_load(const struct dae *d, enum dialect dialect, struct scene *s,
                            struct err *e)
{
    char *text = dae_text(d);
    bool ok = collada_parse(text, strlen(text), "test.dae", dialect, s, e);
    free(text);
    return ok;
}

/* Loads, or fails the test with the line. */
static inline struct scene dae_must_load(struct dae d, enum dialect dialect)
{
    struct scene s = {0};
    struct err e = {""};
    if (!dae_load(&d, dialect, &s, &e))
        fail_msg("%s", e.msg);
    return s;
}

/* Must fail with the keyword in its line. */
static inline void dae_must_fail(struct dae d, enum dialect dialect, const char *keyword)
{
    struct scene s = {0};
    struct err e = {""};
    if (dae_load(&d, dialect, &s, &e))
        fail_msg("loads, but should fail with '%s'", keyword);
    if (strncmp(e.msg, "test.dae:", 9) != 0 || strstr(e.msg, keyword) == NULL)
        fail_msg("expected '%s', got '%s'", keyword, e.msg);
}

#define assert_vec(a, X, Y, Z)                                                                     \
    do {                                                                                           \
        vec3 v_ = (a);                                                                             \
        double x_ = (X), y_ = (Y), z_ = (Z);                                                       \
        double far_ = fmax(fabs(v_.x - x_), fmax(fabs(v_.y - y_), fabs(v_.z - z_)));               \
        if (!(far_ <= 2e-6 * fmax(1, fmax(fabs(x_), fmax(fabs(y_), fabs(z_))))))                   \
            fail_msg("%s is (%.9g %.9g %.9g), expected (%.9g %.9g %.9g)", #a, v_.x, v_.y, v_.z,    \
                     x_, y_, z_);                                                                  \
    } while (0)

/* Unit normal by the winding of triangle i. */
static inline vec3 front(const struct scene *s, uint32_t i)
{
    const vec3 *p = s->position + 3 * (size_t)i;
    return normalize(cross(sub(p[1], p[0]), sub(p[2], p[0])));
}

#endif
