/* What the files of the COLLADA loader share: the loader's state, then the functions of each file
 * below its name: XML (collada_xml.c, collada_element.c, ..), the parts of a document
 * (collada_mesh.c, ..), and the growing scene (collada_build.c).
 *
 * The first failure puts "path:line: what" into loader.err and sets loader.failed; later ones change nothing. After a
 * failure readers go on with zeros, black and NULL (the functions of collada_element.c accept NULL as an element), and
 * check `failed` before they loop for long, write to an array or follow a pointer. Those of type bool return !failed.
 */
#ifndef ASSAY_COLLADA_INTERNAL_H
#define ASSAY_COLLADA_INTERNAL_H

#include "collada.h"
#include "renderer/math/mat4.h"

#include <float.h>
#include <libxml/hash.h>
#include <libxml/tree.h>
#include <stdio.h>

#define PI     M_PI
#define DEGREE (PI / 180)

/* Limits that only a broken or hostile file reaches. */
enum {
    MAX_FILE_BYTES = 1 << 30,
    MAX_XML_DEPTH = 200,
    MAX_NODE_DEPTH = 100,
    MAX_NODES = 1 << 20, /* visited, so instances count */
    MAX_TRIANGLES = 1 << 25,
    MAX_POLYGON_CORNERS = 1 << 14,
    MAX_UV_SETS = 8 /* of one primitive */
};

/* Arrays grown by build_grow(). */
struct doubles {
    double *data;
    size_t count;
};
struct uints {
    uint32_t *data;
    size_t count;
};

/* A corner of a triangle in the geometry's own space. The normal is zero where the file has none.
 */
struct corner {
    dvec3 position;
    vec3 normal;
    uint32_t uv; /* index in mesh.uv of the first of its group's num_uv coordinates */
};

/* One <polylist>, <triangles> or <polygons>. */
struct mesh_group {
    const char *symbol; /* of the material; NULL if absent; lives in the document */
    const xmlNode *node;
    size_t first, count; /* triangles */
    size_t num_uv;       /* sets of texture coordinates, and their numbers */
    uint64_t uv_set[MAX_UV_SETS];
};

/* A parsed <geometry>: triangles in groups, or one sphere. */
struct mesh {
    const xmlNode *node;
    struct corner *corners; /* 3 per triangle */
    size_t num_triangles;
    struct mesh_group *groups;
    size_t num_groups;
    struct uv *uv;
    size_t num_uv;
    bool is_sphere;
    double radius;
    float normal_out;
};

struct material_slot {
    const xmlNode *node; /* <material>; NULL: the grey of CGL */
    uint32_t index;
    const char *texcoord; /* semantic of its textures' coordinates */
};

/* What the scene leaves out of a file, or changes: counted for the scene's note. */
enum left_out {
    LEFT_OUT_MOVING,
    LEFT_OUT_LINES,
    LEFT_OUT_TRANSPARENT,
    LEFT_OUT_MATERIAL,
    LEFT_OUT_BRIGHT,
    LEFT_OUT_CROSSED,
    LEFT_OUT_RADIUS,
    LEFT_OUT_BLEND,
    LEFT_OUT_UPRIGHT,
    NUM_LEFT_OUT
};
#define NO_SURFACE UINT32_MAX /* the material of a wholly transparent surface */

/* A file that is read: the scene's own first, then those that it refers to. */
struct document {
    const char *path;
    bool is_file;      /* references to files beside it work */
    xmlDoc *doc;       /* whose _private is this */
    xmlHashTable *ids; /* id to element, or to this document if several have it */
};

struct loader {
    const char *path; /* of the scene; while parsing, of the document */
    FILE *file;       /* being parsed */
    struct err *err;
    bool failed;
    enum dialect dialect;
    double blender_version; /* of the writer; 0: another program */
    bool is_course_export;  /* taken for a file of the assignment by the program that wrote it */
    unsigned num_specular;  /* materials in use whose highlight the dialect leaves out */
    unsigned num_left_out[NUM_LEFT_OUT];
    bool is_transparent;            /* the material that is being read */
    const xmlNode *instance_effect; /* of the material that is being read */
    struct document **documents;
    size_t num_documents;
    double unit; /* metres per length unit of the light or camera that is being read */
    struct mesh *meshes;
    size_t num_meshes;
    struct material_slot *slots;
    size_t num_slots;
    bool has_textures;    /* possibly: texture coordinates are read */
    const char *texcoord; /* of the material that is being read */
    bool *is_lamp;        /* per object: it came from a light element */
    size_t num_nodes;
    rgb ambient;        /* of all ambient lights */
    struct scene scene; /* under construction; num_* are also the array sizes in use */
};

/* collada_xml.c */

/* Parses the text into a new document, refuses document types, foreign structure and other versions,
 * indexes the ids and resolves DIALECT_AUTO. The path must live as long as the loader. NULL: failed. */
const struct document *xml_open(struct loader *ld, const char *path, FILE *file, bool is_file);

/* collada_element.c */

/* Sets the line "path:line: ...", unless one is set. Always false. */
#define fail_at(ld, n, ...) element_fail_line(ld, n, element_line(n), __VA_ARGS__)
/* n: any element of the document to be named; NULL: names ld->path. line 0: no line number. */
bool element_fail_line(struct loader *ld, const xmlNode *n, long line, const char *fmt, ...)
    __attribute__((format(printf, 4, 5)));
bool element_fail_memory(struct loader *ld);
/* "unexpected <child> in <parent>". */
bool element_fail_unexpected(struct loader *ld, const xmlNode *child);
long element_line(const xmlNode *n);
const struct document *element_document(const xmlNode *n);

/* Child elements in document order; NULL at the end. */
const xmlNode *element_first(const xmlNode *n);
const xmlNode *element_next(const xmlNode *n);
/* First child element of that name or NULL. */
const xmlNode *element_child(const xmlNode *n, const char *name);
/* The first child of that name whose attribute has that value; NULL if there is none. */
const xmlNode *element_child_with(const xmlNode *n, const char *name, const char *attribute,
                                  const char *value);
/* True if n is the COLLADA element of that name. */
bool element_is(const xmlNode *n, const char *name);
/* Index of `name` among words separated by blanks (A|B: either; "*": any name); -1: none. */
int element_place_among(const char *name, const char *words);
/* True if the COLLADA element n has one of these names. */
bool element_is_one_of(const xmlNode *n, const char *words);
/* Fails unless the children of n match `words`, blanks between, in any order: NAME, one; NAME?, at most one; NAME*, any
 * number; A|B, one of either name; *, whatever else. */
bool element_check(struct loader *ld, const xmlNode *n, const char *words);
/* The attribute's value or NULL; lives in the document. */
const char *element_attribute(const xmlNode *n, const char *name);
/* The same; fails, and returns "", if it is missing. */
const char *element_needed_attribute(struct loader *ld, const xmlNode *n, const char *name);
/* Value of an unsigned attribute below 2^32-1: required, or `missing` if it is not there. */
uint64_t element_count(struct loader *ld, const xmlNode *n, const char *name);
uint64_t element_count_or(struct loader *ld, const xmlNode *n, const char *name, uint64_t missing);
/* True for "ASSAY" and "CGL". */
bool element_is_own_profile(const char *profile);
/* The profile="ASSAY" or profile="CGL" technique in the element's <extra>s, NULL if none. */
const xmlNode *element_own_technique(struct loader *ld, const xmlNode *n);

/* collada_text.c */

/* Appends the element's text, as finite numbers or as indices, to *out. */
bool text_read_doubles(struct loader *ld, const xmlNode *n, struct doubles *out);
bool text_read_uints(struct loader *ld, const xmlNode *n, struct uints *out);
/* Reads `least` to `most` numbers into out[] and returns how many. Missing ones, and all after a failure, are 0. */
size_t text_read_numbers(struct loader *ld, const xmlNode *n, double *out, size_t least,
                         size_t most);
/* A non-negative colour, black after a failure; *alpha (alpha may be NULL) is 1 if there are only three numbers. */
rgb text_read_color(struct loader *ld, const xmlNode *n, double *alpha);
/* The element's text without blanks around it; lives in the document. */
const char *text_read_word(struct loader *ld, const xmlNode *n);

/* collada_field.c: the value of n's only child of that name. */

#define ANY_NUMBER -DBL_MAX, DBL_MAX
#define ANY_LENGTH 1e-300, 1e300
/* A number from lo to hi; `missing` if there is no such child. */
double field_number(struct loader *ld, const xmlNode *n, const char *name, double missing,
                    double lo, double hi);
/* A colour without a channel above `most`; black if there is no such child. */
rgb field_color(struct loader *ld, const xmlNode *n, const char *name, float most);
/* Index of the text among words separated by blanks; `missing` if there is no such child. */
int field_choice(struct loader *ld, const xmlNode *n, const char *name, const char *words,
                 int missing);

/* collada_reference.c: both return NULL after a failure. */

/* The `element` with that id in the document of n, whose line an error names. */
const xmlNode *reference_find(struct loader *ld, const xmlNode *n, const char *id,
                              const char *element);
/* The element that attribute `name` points to, by "#id" or "file.dae#id", which is read from beside
 * the document; it must be called `element`. */
const xmlNode *reference_follow(struct loader *ld, const xmlNode *n, const char *name,
                                const char *element);

/* collada_parameter.c */

/* The value (<float4>, <sampler2D>, ...) of the parameter `sid` for an element of an effect: what
 * the <instance_effect> sets, else what the <newparam> nearest above says. It must be one of the
 * kinds, separated by blanks. NULL: failed. */
const xmlNode *parameter_get(struct loader *ld, const xmlNode *user, const char *sid,
                             const char *kinds);
/* What a <texture> leads to; all live in the document. */
struct texture_use {
    const xmlNode *sampler; /* <sampler2D>: wrap_s, wrap_t, magfilter, ...; NULL if there is none */
    const xmlNode *image;
    const char *texcoord; /* the semantic that <bind_vertex_input> gives a set; NULL if absent */
};
struct texture_use parameter_get_texture(struct loader *ld, const xmlNode *texture);

/* collada_texture.c */

/* The map (struct material) of a <texture>; reads its image at first use. *texcoord: semantic of its coordinates. */
uint32_t texture_get(struct loader *ld, const xmlNode *texture, const char **texcoord);
/* Index of the group's set of texture coordinates that `texcoord` stands for in an <instance_geometry>,
 * by its <instance_material> `binding`. group NULL: a sphere. */
size_t texture_find_set(struct loader *ld, const xmlNode *instance, const xmlNode *binding,
                        const char *texcoord, const struct mesh_group *group);

/* collada_extra.c */

/* Reads our or the assignment's material tag from a technique of that profile into *m, which already
 * holds what profile_COMMON says. */
void extra_read_material(struct loader *ld, const xmlNode *technique, struct material *m);

/* collada_build.c */

void *build_grow_now(struct loader *ld, void *data, size_t size, size_t count);
/* Makes room for one more element in `data`, which has `count` elements of `size` bytes and was grown by this function
 * only. Returns the array, which may have moved; after a failure the old one, so check ld->failed before writing. The
 * capacity is 8, then the next power of two. */
static inline void *build_grow(struct loader *ld, void *data, size_t size, size_t count)
{
    bool has_room = count < 8 ? count != 0 : (count & (count - 1)) != 0;
    return has_room ? data : build_grow_now(ld, data, size, count);
}
/* Copies a name: at most size-1 bytes, whole UTF-8 characters, no control characters. */
void build_copy_name(char *out, size_t size, const char *name);
/* Returns the material's index. */
uint32_t build_add_material(struct loader *ld, const struct material *m);
void build_add_light(struct loader *ld, const struct light *l);
vec3 build_to_float(dvec3 v);
/* p transformed to world space. Fails, naming n and `what`, if it is beyond FARTHEST. */
vec3 build_place(struct loader *ld, const xmlNode *n, const char *what, const mat4 *m, dvec3 p);
/* The unit vector along v. Fails, naming n, if v has no length. */
vec3 build_direction(struct loader *ld, const xmlNode *n, dvec3 v);
/* Begins an object, to which the following triangles and spheres belong. */
void build_begin_object(struct loader *ld, const char *name, const char *symbol, uint32_t material,
                        bool is_lamp);
/* Adds a triangle to the object begun last, by the transform m, whose determinant has that sign.
 * Errors name n. uv: of the three; NULL: not needed. */
void build_add_triangle(struct loader *ld, const xmlNode *n, const mat4 *m, double sign,
                        const struct corner c[3], const struct uv uv[3]);
void build_add_sphere(struct loader *ld, const xmlNode *n, const mat4 *m, double radius,
                      float normal_out);
/* Sign of the determinant; fails for a matrix that is singular or not affine. */
double build_transform_sign(struct loader *ld, const xmlNode *n, const mat4 *m);
/* Bounds of all primitives, with or without those of light elements. False if there are none. */
bool build_find_bounds(const struct loader *ld, bool with_lamps, vec3 *lo, vec3 *hi);
/* CGL: removes emissive meshes that show the same lamp as an area light. */
void build_drop_twin_lamps(struct loader *ld);

/* collada_source.c */

/* The points or pairs that an accessor picks out of a <float_array>, one after the other. */
struct source {
    const xmlNode *node;
    struct doubles array;
    uint64_t count;
    unsigned wanted, size; /* numbers per element: asked for; present (2 for points in a plane) */
};

/* Sources of one mesh are parsed once, however many primitives share them. */
struct sources {
    struct source *data;
    size_t count;
};

/* Those inputs of one primitive that are read. */
struct inputs {
    uint64_t stride; /* numbers per corner */
    struct input {
        bool present, by_vertex; /* by_vertex: indexed like the vertex */
        uint64_t offset;
        size_t source; /* index into `sources` */
        uint64_t set;
    } position, normal, uv[MAX_UV_SETS];
    size_t num_uv;
};

/* Reads the inputs of a <polylist>, <triangles> or <polygons>. */
struct inputs source_read_inputs(struct loader *ld, struct sources *all, const xmlNode *primitive);
void source_release(struct sources *all);

/* collada_mesh.c: NULL: failed. */
const struct mesh *mesh_of_geometry(struct loader *ld, const xmlNode *geometry);
void mesh_release(struct mesh *m);

/* collada_material.c */

/* The material bound to `symbol` (NULL: the only one) by an <instance_geometry>, or NO_SURFACE. *uv_set:
 * the group's set of texture coordinates that it uses, if it has textures. group NULL: a sphere. */
uint32_t material_get(struct loader *ld, const xmlNode *instance, const xmlNode *user,
                      const char *symbol, const struct mesh_group *group, size_t *uv_set);

/* collada_light.c */
void light_instance(struct loader *ld, const xmlNode *instance, const xmlNode *light,
                    const char *node_name, const mat4 *m);
/* Makes the environment from the sum of all ambient lights. */
void light_finish(struct loader *ld);

/* collada_camera.c */
void camera_instance(struct loader *ld, const xmlNode *instance, const xmlNode *camera,
                     const char *node_name, const mat4 *m);
/* Sets the camera that the assignment uses for a file without one. */
void camera_default(struct loader *ld);

#endif
