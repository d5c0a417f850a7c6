/* A scene as plain data, in world space: right-handed, Y up, lengths as in the file times its unit,
 * radiance in W sr^-1 m^-2 (linear Rec. 709). Filled by collada_load(); const for every thread
 * afterwards. Arrays belong to the scene and go with scene_free().
 *
 * Primitives are numbered: 0 .. num_triangles-1 are triangles, then come the spheres. */
#ifndef ASSAY_SCENE_H
#define ASSAY_SCENE_H

#include "texture.h"

#include "renderer/base/err.h"
#include "renderer/image/image.h"

#include <stddef.h>
#include <stdint.h>

/* Whose conventions a file follows (renderer/docs/dialect.md). */
enum dialect {
    DIALECT_AUTO,    /* as an option only: CGL if the file has a profile="CGL" technique */
    DIALECT_COLLADA, /* the file is taken at its word */
    DIALECT_CGL      /* the CS184 assignment: camera re-placed, -r crops, lights without falloff */
};

/* Coordinates beyond this, which would overflow float32 when squared, are refused in every file. */
#define FARTHEST 1e18

/* Relative index of refraction: 1/MAX_IOR to MAX_IOR. */
#define MAX_IOR 100.0f

enum material_kind {
    MATERIAL_DIFFUSE,
    MATERIAL_MIRROR,
    MATERIAL_REFRACTION, /* only the refracted ray; nothing under total reflection */
    MATERIAL_GLASS,      /* smooth dielectric: reflects by Fresnel's equations, refracts the rest */
    MATERIAL_MICROFACET, /* rough conductor */
    MATERIAL_PLASTIC /* sum of a diffuse lobe, a highlight (a rough lobe whose colour is the same at all angles) and a
                            mirror image; each may be black */
};
/* Sets of material kinds as bit masks (1 << kind), so that code can ask for a property and need not list kinds. */
enum {
    NUM_MATERIAL_KINDS = MATERIAL_PLASTIC + 1,
    MATERIAL_REFRACTS = 1 << MATERIAL_REFRACTION | 1 << MATERIAL_GLASS,   /* by ior */
    MATERIAL_IS_ROUGH = 1 << MATERIAL_MICROFACET | 1 << MATERIAL_PLASTIC, /* by alpha */
    MATERIAL_IS_MATT = 1 << MATERIAL_DIFFUSE | 1 << MATERIAL_PLASTIC,     /* may have a texture */
    MATERIAL_SCATTERS = MATERIAL_IS_MATT | MATERIAL_IS_ROUGH /* has a lobe with a density */
};

enum microfacet_kind {
    MICROFACET_GGX,
    MICROFACET_BECKMANN,
    MICROFACET_BECKMANN_STARTER /* Beckmann's, but for microfacet_g2() (cs184_deviations.h) */
};

/* Least alpha of a rough material: below, float32 hardly tells the facets' normals apart. */
#define MICROFACET_MIN_ALPHA 1e-4f

/* Emission and reflection are independent: an emitter may reflect too. A factor that a kind does
 * not have is 0, and only rough conductors have `conductor` set. A map is 1 + the number of the
 * texture by which the colour is multiplied at every place, or 0 for none; only diffuse reflectance
 * and radiance may have one. */
struct material {
    char name[64];
    enum material_kind kind;
    rgb reflectance; /* diffuse, plastic: albedo in [0,1]; mirror, glass: factor of the mirror ray */
    rgb specular; /* plastic: what its facets reflect at any angle, f = specular D G2 / (4 cos cos) */
    rgb mirror;   /* plastic: factor of the mirror ray */
    rgb transmittance; /* refraction, glass: factor of the refracted ray */
    float ior;         /* refraction, glass: of the side that the normal points away from,
                                 relative to the side it points to; above 1 for glass in air */
    bool schlick;      /* glass: Schlick's approximation, as the assignment has it */
    enum microfacet_kind microfacet;
    float alpha;    /* microfacet, plastic: roughness, root mean square slope times sqrt(2) */
    bool separable; /* microfacet, plastic: shadowing and masking independent */
    bool conductor; /* microfacet: Fresnel by eta and k; else reflectance, at any angle */
    rgb eta, k;     /* microfacet: complex index of refraction against air */
    rgb radiance;   /* emitted radiance; zero for most */
    bool radiance_both_sides; /* else only from the side the geometric normal points to */
    uint32_t reflectance_map, radiance_map;
};

/* normal_out: +1, the geometric normal points away from the centre; -1, towards it (an interior).
 */
struct sphere {
    vec3 centre;
    float radius;
    float normal_out;
};

enum light_kind {
    LIGHT_POINT, /* radiant intensity value / (att[0] + att[1] d + att[2] d^2); att = {0,0,1} is
                    physical and value is then W sr^-1 */
    LIGHT_SPOT,  /* the same, times cos(angle to axis)^exponent; 0 where cos <= cos_cutoff */
    LIGHT_DIRECTIONAL, /* value: irradiance on a plane facing it, W m^-2 */
    LIGHT_TRIANGLES,   /* emissive triangles, all of one object */
    LIGHT_SPHERE,      /* one emissive sphere */
    LIGHT_ENVIRONMENT  /* the scene's environment */
};

struct environment;

struct light {
    enum light_kind kind;
    rgb value;                  /* point, spot, directional */
    vec3 position;              /* point, spot */
    vec3 axis;                  /* spot: unit, the direction it shines in */
    float cos_cutoff, exponent; /* spot: 0 <= cos_cutoff < 1, exponent >= 0 */
    vec3 to_light;              /* directional: unit, from the scene towards the light */
    float attenuation[3];
    uint32_t first; /* triangles: first triangle; sphere: index of the sphere */
    uint32_t count; /* triangles: they are contiguous, first .. first+count-1 */
    float area;     /* triangles, sphere: total, one side */
    bool textured;  /* triangles: radiance differs from place to place */
};

/* One named node instance of the file; the unit of object-id images and of the exporters. */
struct object {
    char name[64];
    uint32_t first_triangle, num_triangles;
    uint32_t first_sphere, num_spheres;
    uint32_t material;
};

/* The camera as the file has it, after transforms; camera_init() makes the image's camera of it.
 * c2w columns: right, up, backward (it looks along -Z), unit length; eye is its position. Angles
 * are full angles in radians; 0 where the file is silent. In the CGL dialect all fields are filled
 * even if not present (by the assignment's defaults), backward is the assignment's direction from
 * the scene to the eye, and right and up follow from it and world +Y. */
struct scene_camera {
    char name[64]; /* of its node */
    bool present;
    vec3 right, up, backward, eye;
    float hfov, vfov, aspect;
    float xmag,
        ymag; /* orthographic: half width and height, and no angles; 0 where the file is silent */
    float near, far;
};

#define SCENE_IMAGE_FILE "assay:file"

struct scene {
    enum dialect dialect; /* COLLADA or CGL, never AUTO */
    uint32_t num_triangles, num_spheres, num_materials, num_lights, num_objects;
    vec3 *position; /* 3 per triangle; counter-clockwise seen from the front */
    vec3 *normal;   /* 3 per triangle, unit shading normals (geometric where the file has none);
                       the sum of the three is on the front side */
    uint32_t *tri_material; /* per triangle */
    uint32_t *tri_object;
    int32_t *tri_light; /* per triangle: index into lights, -1 if it does not emit */
    struct sphere *spheres;
    uint32_t *sphere_material, *sphere_object;
    int32_t *sphere_light;
    uint32_t num_images, num_textures;
    struct image *images; /* R G B, linear; attribute SCENE_IMAGE_FILE: the file it was read from */
    struct texture *textures; /* of these images */
    struct uv *uv; /* 3 per triangle, set where its material has a map; NULL: no map anywhere */
    struct material *materials;
    struct light *lights;
    struct object *objects;
    struct environment *environment; /* NULL if there is none */
    int32_t environment_light;       /* index into lights, -1 if there is none */
    char **documents;                /* paths of the other files that it was read from */
    uint32_t num_documents;
    struct scene_camera camera;   /* the one in use: the first, in the CGL dialect the last */
    struct scene_camera *cameras; /* all */
    uint32_t num_cameras;
    vec3 bounds_min, bounds_max; /* of all primitives; 0 if there are none */
    /* The box that the assignment's camera frames. CGL: bounds of all but the rectangles of area
     * lights, including the emissive meshes that these replace; else the scene's bounds. */
    vec3 frame_min, frame_max;
    unsigned num_degenerate;   /* triangles without area that were dropped at loading */
    unsigned num_zero_normals; /* corners whose normal in the file had no length; they got the
                                  triangle's own */
    unsigned num_dark_lights;  /* point, spot and directional lights of zero power */
    unsigned starter;          /* bits 1 << enum cs184_deviation; 0: none */
    char note[512];            /* what was merged or left out, one line for the user; else empty */
};

/* Frees all arrays and zeroes the struct; a zeroed scene is fine. */
void scene_free(struct scene *s);
/* The material scatters no light at all. */
bool material_is_black(const struct material *m);

static inline bool material_has_map(const struct material *m)
{
    return m->reflectance_map != 0 || m->radiance_map != 0;
}

/* Completes a scene whose triangles, spheres, materials, objects, camera, delta lights and
 * environment (with its light) are in place: drops nothing, appends one area light for the
 * triangles and one for each sphere of each emissive object (in object order), allocates and fills
 * tri_light and sphere_light, fills areas and bounds. `lights` must come from malloc() or be NULL.
 * Fails on an index out of range, objects that are not contiguous, a value that is not finite, a
 * normal not of unit length, a negative reflectance or radiance, a reflectance above 1 (times that
 * of its texture), a texture on a sphere, a texture coordinate beyond 1e6, an emitter without area, or
 * out of memory; `where` starts the line. A scene without primitives is fine. */
NODISCARD bool scene_finish(struct scene *s, const char *where, struct err *e);

/* Uses the first camera of that name. False if there is none. */
NODISCARD bool scene_choose_camera(struct scene *s, const char *name);

/* Adds an environment to a finished scene, with its light after all others. The scene then owns it; on
 * failure (there is one already; out of memory) the caller still does. */
NODISCARD bool scene_add_environment(struct scene *s, struct environment *env, struct err *e);
/* The same with an environment read from a file (environment_read()). The error line has its path. */
NODISCARD bool scene_read_environment(struct scene *s, const char *path, struct err *e);

/* Value of a map (not 0) at barycentric coordinates (b1, b2) of a triangle. */
static inline rgb scene_map_at(const struct scene *s, uint32_t map, uint32_t triangle, float b1,
                               float b2)
{
    return texture_on_triangle(&s->textures[map - 1], s->uv + 3 * (size_t)triangle, b1, b2);
}

static inline uint32_t scene_num_primitives(const struct scene *s)
{
    return s->num_triangles + s->num_spheres;
}

/* Bounding box of a primitive. */
static inline void scene_primitive_bounds(const struct scene *s, uint32_t prim, vec3 *lo, vec3 *hi)
{
    if (prim < s->num_triangles) {
        const vec3 *p = s->position + 3 * (size_t)prim;
        *lo = vmin(vmin(p[0], p[1]), p[2]);
        *hi = vmax(vmax(p[0], p[1]), p[2]);
        return;
    }
    const struct sphere *sp = &s->spheres[prim - s->num_triangles];
    const vec3 r = v3(sp->radius, sp->radius, sp->radius);
    *lo = sub(sp->centre, r);
    *hi = add(sp->centre, r);
}

#endif
