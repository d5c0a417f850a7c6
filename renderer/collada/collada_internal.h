/* What the files of the COLLADA loader share: the loader's state, the reading of XML
 * (collada_xml.c, collada_text.c), of meshes (collada_mesh.c), materials (collada_material.c),
 * lights (collada_light.c), cameras (collada_camera.c), and the growing scene (collada_build.c). Every bool
 * function fails with "path:line: what" in loader.err. */
#ifndef ASSAY_COLLADA_INTERNAL_H
#define ASSAY_COLLADA_INTERNAL_H

#include "collada.h"
#include "renderer/math/mat4.h"

#include <libxml/tree.h>
#include <stdio.h>

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

struct id_entry {
    const char *id;
    xmlNode *node;
};

/* Grows by doubling; `data` belongs to it. */
struct doubles {
    double *data;
    size_t count, capacity;
};
struct uints {
    uint32_t *data;
    size_t count, capacity;
};

/* A corner of a triangle in the geometry's own space. The normal is zero where the file has none.
 */
struct corner {
    dvec3 position;
    float normal[3];
    uint32_t uv; /* where the group's sets of texture coordinates begin in the mesh */
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
    size_t num_triangles, capacity;
    struct mesh_group *groups;
    size_t num_groups;
    struct uv *uv;
    size_t num_uv, cap_uv;
    bool is_sphere;
    double radius;
    float normal_out;
};

struct material_slot {
    const xmlNode *node; /* <material>; NULL: the grey of CGL */
    uint32_t index;
    const char *texcoord; /* what its textures are looked up by */
};

/* What is in a file and not in a still image of surfaces: counted for the note. */
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
#define NO_SURFACE UINT32_MAX /* a material that lets everything through */

/* A file that is read: the scene's own first, then those that it refers to. */
struct document {
    char *path;
    bool is_file;         /* so that others can be beside it */
    xmlDoc *doc;          /* whose _private is this */
    struct id_entry *ids; /* sorted by id */
    size_t num_ids;
};

struct loader {
    const char *path; /* of the scene */
    struct err *err;
    bool parse_failed;
    enum dialect dialect;
    double blender_version; /* that wrote the scene; 0: another program */
    bool is_course_export;  /* taken for a file of the assignment by the program that wrote it */
    unsigned num_specular;  /* materials in use whose highlight the dialect leaves out */
    unsigned num_left_out[NUM_LEFT_OUT];
    bool is_transparent;            /* the material that is being read */
    const xmlNode *instance_effect; /* of the material that is being read */
    struct document **documents;
    size_t num_documents, cap_documents;
    double unit; /* metres per length unit of the light or camera that is being read */
    struct mesh *meshes;
    size_t num_meshes, cap_meshes;
    struct material_slot *slots;
    size_t num_slots, cap_slots;
    bool has_textures;    /* somewhere: texture coordinates are read */
    const char *texcoord; /* of the material that is being read */
    bool *is_lamp;        /* per object: it came from a light element */
    size_t num_nodes;
    size_t cap_cameras;
    rgb ambient;        /* of all ambient lights */
    struct scene scene; /* under construction; num_* are also the array sizes in use */
    size_t cap_triangles, cap_spheres, cap_materials, cap_lights, cap_objects, cap_images,
        cap_textures;
};

/* collada_xml.c */

/* Where the text comes from: a file or memory, whatever is left to read. */
struct text_input {
    FILE *file; /* NULL: memory */
    const char *text;
    size_t size, taken;
    bool failed; /* the error is set */
};
/* Parses the text into a new document, refuses document types, foreign structure and other versions,
 * indexes the ids and resolves DIALECT_AUTO. */
bool xml_open(struct loader *ld, const char *path, struct text_input *in, struct document **out);

/* collada_element.c */

/* Sets the line "path:line: ..."; control characters become '?'. Always false. */
bool fail_at(struct loader *ld, const xmlNode *n, const char *fmt, ...)
    __attribute__((format(printf, 3, 4)));
/* n: of the document that is meant; NULL: ld->path. */
bool fail_line(struct loader *ld, const xmlNode *n, long line, const char *fmt, ...)
    __attribute__((format(printf, 4, 5)));
bool fail_memory(struct loader *ld);
#ifdef __clang_analyzer__ /* as in err.h */
#define fail_at(...)    ((void)fail_at(__VA_ARGS__), false)
#define fail_line(...)  ((void)fail_line(__VA_ARGS__), false)
#define fail_memory(ld) ((void)fail_memory(ld), false)
#endif
/* "unexpected <child> in <parent>". */
bool element_fail_unexpected(struct loader *ld, const xmlNode *child);
long element_line(const xmlNode *n);
const struct document *element_document(const xmlNode *n);

/* Child elements in document order; NULL at the end. */
xmlNode *element_first_child(const xmlNode *n);
xmlNode *element_next_sibling(const xmlNode *n);
/* First child element of that name or NULL. */
xmlNode *element_child_named(const xmlNode *n, const char *name);
/* The only child element of that name, NULL if there is none; fails if there are two. */
bool element_one_child(struct loader *ld, const xmlNode *n, const char *name, xmlNode **out);
/* Is it the COLLADA element of that name? */
bool element_is(const xmlNode *n, const char *name);
bool element_word_is_one_of(const char *word, const char *words);
/* Is its name one of the words, separated by blanks? */
bool element_is_one_of(const xmlNode *n, const char *words);
/* Fails if a child's name is not one of the words. */
bool element_only_children(struct loader *ld, const xmlNode *n, const char *words);
/* The attribute's value or NULL; lives in the document. */
const char *element_attribute(const xmlNode *n, const char *name);
/* Required unsigned attribute. */
bool element_attribute_count(struct loader *ld, const xmlNode *n, const char *name, uint64_t *out);
/* The same with a default. */
bool element_attribute_count_or(struct loader *ld, const xmlNode *n, const char *name,
                                uint64_t missing, uint64_t *out);
/* Orders ids by name, for qsort() and bsearch(). */
int element_compare_ids(const void *a, const void *b);
/* Is it "ASSAY" or "CGL"? */
bool element_is_own_profile(const char *profile);
/* The profile="ASSAY" or profile="CGL" technique in the element's <extra>s, NULL if none. */
bool element_own_technique(struct loader *ld, const xmlNode *n, xmlNode **out);
/* The only child element of a technique of ours. */
bool element_technique_content(struct loader *ld, const xmlNode *technique, xmlNode **out);

/* collada_text.c */

/* The element's text as finite numbers, appended. */
bool text_read_doubles(struct loader *ld, const xmlNode *n, struct doubles *out);
bool text_read_uints(struct loader *ld, const xmlNode *n, struct uints *out);
/* Exactly n of them. */
bool text_read_exactly(struct loader *ld, const xmlNode *n, double *out, size_t count);
/* At least one, at most `most`; the missing ones are 0. */
bool text_read_up_to(struct loader *ld, const xmlNode *n, double *out, size_t most);
/* A non-negative colour; alpha (may be NULL) is 1 where there are only three numbers. */
bool text_read_color(struct loader *ld, const xmlNode *n, rgb *out, double *alpha);
/* The element's text without blanks around it; the caller frees. NULL: failed. */
char *text_read_word(struct loader *ld, const xmlNode *n);

/* Writes every %xx of a URI out, in place. What is no escape stays: many programs write names as they
 * are. */
void text_decode_percents(char *s);

/* collada_field.c */

/* A child element that a reader knows. `out` stays as it is where the element is missing. */
struct field {
    const char *name;
    enum { FIELD_NUMBER, FIELD_FLOAT, FIELD_COLOR, FIELD_CHOICE } kind;
    void *out; /* double, float, rgb, or bool: is it the second of two words? */
    bool is_needed;
    double lo, hi; /* what a number may be; no part of a colour is above hi, unless hi is 0 */
    const char *words[2];
};
#define FIELDS(...)                                                                                \
    (const struct field[]){__VA_ARGS__},                                                           \
        sizeof((const struct field[]){__VA_ARGS__}) / sizeof(struct field)
/* One that has to be there. */
#define FIELD_OF_COLOR(name, out, most) name, FIELD_COLOR, out, true, .hi = (most)
#define FIELD_OF_LENGTH(name, out, needed)                                                         \
    name, FIELD_NUMBER, out, needed, .lo = 1e-300, .hi = 1e300
/* Reads all children of n, which are those fields in any order, each once at most. */
bool field_read_all(struct loader *ld, const xmlNode *n, const struct field *fields, size_t count);

/* collada_reference.c */

/* The element of that id in the document of n, who is to blame; it must be called `element`. */
bool reference_find(struct loader *ld, const xmlNode *n, const char *id, const char *element,
                    const xmlNode **out);
/* The element that attribute `name` points to, by "#id" or "file.dae#id", which is read from beside
 * the document; it must be called `element`. */
bool reference_follow(struct loader *ld, const xmlNode *n, const char *name, const char *element,
                      const xmlNode **out);

/* collada_parameter.c */

/* The value (<float4>, <sampler2D>, ...) of the parameter `sid` for an element of an effect: what
 * the <instance_effect> sets, else what the <newparam> nearest above says. It must be one of the
 * kinds, separated by blanks. */
bool parameter_get(struct loader *ld, const xmlNode *user, const char *sid, const char *kinds,
                   const xmlNode **value);
/* What a <texture> leads to; all live in the document. */
struct texture_use {
    const xmlNode *sampler; /* <sampler2D>: wrap_s, wrap_t, magfilter, ...; NULL if there is none */
    const xmlNode *image;
    const char *texcoord; /* the semantic that <bind_vertex_input> gives a set; NULL if absent */
};
bool parameter_get_texture(struct loader *ld, const xmlNode *texture, struct texture_use *out);

/* collada_texture.c */

/* The map of a <texture>, its image read if it has not been; *texcoord: what it is looked up by. */
bool texture_get(struct loader *ld, const xmlNode *texture, uint32_t *map, const char **texcoord);
/* Which set of a group that name stands for in an <instance_geometry>, by its <instance_material>;
 * group NULL: a sphere. */
bool texture_find_set(struct loader *ld, const xmlNode *instance, const xmlNode *binding,
                      const char *texcoord, const struct mesh_group *group, size_t *which);

/* collada_extra.c */

/* Our or the assignment's material tag in a technique of theirs, on top of what profile_COMMON has
 * put into *m. */
bool extra_read_material(struct loader *ld, const xmlNode *technique, struct material *m);

/* collada_build.c */

/* `data` (count elements of size bytes, room for *capacity) with room for one more: moved or as it
 * was. NULL: out of memory, and `data` still belongs to the caller. */
void *build_grow(struct loader *ld, void *data, size_t size, size_t count, size_t *capacity);
/* Copies a name: at most size-1 bytes, whole UTF-8 characters, no control characters. */
void build_copy_name(char *out, size_t size, const char *name);
bool build_add_material(struct loader *ld, const struct material *m, uint32_t *index);
bool build_add_light(struct loader *ld, const struct light *l);
vec3 build_to_float(dvec3 v);
/* A new object that the following triangles and spheres belong to. */
bool build_begin_object(struct loader *ld, const char *name, const char *symbol, uint32_t material,
                        bool is_lamp);
/* One triangle of the object begun last, through the transform, whose determinant has that sign.
 * `n` is who to blame. uv: of the three; NULL: of no use. */
bool build_add_triangle(struct loader *ld, const xmlNode *n, const mat4 *m, double sign,
                        const struct corner c[3], const struct uv uv[3]);
bool build_add_sphere(struct loader *ld, const xmlNode *n, const mat4 *m, double radius,
                      float normal_out);
/* Sign of the determinant; fails for a matrix that is singular or not affine. */
bool build_transform_sign(struct loader *ld, const xmlNode *n, const mat4 *m, double *sign);
/* Bounds of all primitives, with or without those of light elements. False if there are none. */
bool build_find_bounds(const struct loader *ld, bool with_lamps, vec3 *lo, vec3 *hi);
/* CGL: emissive meshes that show the same lamp as an area light are taken out. */
void build_drop_twin_lamps(struct loader *ld);

/* collada_source.c */

/* The triples or pairs that an accessor picks out of a <float_array>. */
struct source {
    const xmlNode *node;
    double *xyz; /* `width` per item */
    uint32_t count;
    unsigned width;
};

/* Sources of one mesh are parsed once, however many primitives share them. */
struct sources {
    struct source *data;
    size_t count, capacity;
};

/* The inputs of one primitive that are read. Indices into `sources`; -1: none. */
struct inputs {
    uint64_t stride; /* numbers per corner */
    uint64_t vertex_offset, normal_offset;
    long position, normal;
    bool normal_by_vertex; /* the normal's index is the vertex's */
    size_t num_uv;
    struct uv_input {
        uint64_t set, offset;
        long source;
        bool by_vertex;
    } uv[MAX_UV_SETS];
};

/* Reads the inputs of a <polylist>, <triangles> or <polygons>. */
bool source_read_inputs(struct loader *ld, struct sources *all, const xmlNode *primitive,
                        struct inputs *in);
void source_release(struct sources *all);

/* collada_mesh.c */
bool geometry_get(struct loader *ld, const xmlNode *geometry, const struct mesh **out);
void mesh_release(struct mesh *m);

/* collada_material.c */

/* The material bound to `symbol` (NULL: the only one) by an <instance_geometry>, or NO_SURFACE; which
 * of the group's sets of texture coordinates it means, if it has textures. group NULL: a sphere. */
bool material_get(struct loader *ld, const xmlNode *instance, const xmlNode *user,
                  const char *symbol, const struct mesh_group *group, uint32_t *index,
                  size_t *uv_set);

/* collada_light.c */
bool light_instance(struct loader *ld, const xmlNode *instance, const xmlNode *light,
                    const char *node_name, const mat4 *m);
/* What all ambient lights give together becomes the environment. */
bool light_finish(struct loader *ld);

/* collada_camera.c */
bool camera_instance(struct loader *ld, const xmlNode *instance, const xmlNode *camera,
                     const char *node_name, const mat4 *m);
/* What the assignment uses for a file without a camera. */
void camera_default(struct loader *ld);

#endif
