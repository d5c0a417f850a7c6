/* What a primitive's <input>s lead to: <source>s of triples behind accessors. */
#include "collada_internal.h"

#include <stdlib.h>
#include <string.h>

#define NO_PARAM UINT64_MAX /* of points in a plane, where z is 0 */

void source_release(struct sources *all)
{
    for (size_t i = 0; i < all->count; i++)
        free(all->data[i].xyz);
    free(all->data);
    *all = (struct sources){NULL, 0, 0};
}

/* Positions of the first `width` named <param>s, of three at least two: unnamed ones are not for us to
 * see. */
static bool read_params(struct loader *ld, const xmlNode *accessor, uint64_t stride, unsigned width,
                        uint64_t param[3])
{
    uint64_t place = 0, named = 0;
    for (const xmlNode *p = element_first_child(accessor); p != NULL;
         p = element_next_sibling(p), place++) {
        if (!element_is(p, "param"))
            return element_fail_unexpected(ld, p);
        const char *name = element_attribute(p, "name"), *type = element_attribute(p, "type");
        if (type != NULL && strcmp(type, "float") != 0 && strcmp(type, "double") != 0)
            return fail_at(ld, p, "<param> of type '%.60s' where numbers are needed", type);
        if (name != NULL && name[0] != '\0' && named < width)
            param[named++] = place;
    }
    if (named < 2)
        return fail_at(ld, accessor, "<accessor> has %d named <param>s where %u are needed",
                       (int)named, width);
    if (named < 3)
        param[2] = NO_PARAM;
    if (stride < place)
        return fail_at(ld, accessor, "<accessor> has more <param>s than its stride");
    return true;
}

static bool read_source(struct loader *ld, const xmlNode *node, unsigned width, struct source *out)
{
    struct doubles d = {NULL, 0, 0};
    bool ok = false;
    xmlNode *common, *accessor = NULL;
    if (!element_one_child(ld, node, "technique_common", &common) ||
        (common != NULL && !element_one_child(ld, common, "accessor", &accessor)))
        return false;
    if (accessor == NULL)
        return fail_at(ld, node, "<source> without an <accessor>");
    uint64_t count, stride, offset, declared, param[3];
    const xmlNode *array;
    if (!element_attribute_count(ld, accessor, "count", &count) ||
        !element_attribute_count_or(ld, accessor, "stride", 1, &stride) ||
        !element_attribute_count_or(ld, accessor, "offset", 0, &offset) ||
        !read_params(ld, accessor, stride, width, param) ||
        !reference_follow(ld, accessor, "source", "float_array", &array) ||
        !element_attribute_count(ld, array, "count", &declared) ||
        !text_read_doubles(ld, array, &d))
        goto done;
    if (d.count != declared) {
        fail_at(ld, array, "<float_array> has %zu numbers, its count says %llu", d.count,
                (unsigned long long)declared);
        goto done;
    }
    uint64_t last = width < 3 || param[2] == NO_PARAM ? param[1] : param[2];
    if (count > 0 && offset + (count - 1) * stride + last >= d.count) {
        fail_at(ld, accessor, "<accessor> reaches beyond the end of its <float_array>");
        goto done;
    }
    if (offset == 0 && stride == 3 && width == 3 && param[2] == 2) {
        *out = (struct source){node, d.data, (uint32_t)count, width};
        return true;
    }
    *out = (struct source){node, malloc((width * count + 1) * sizeof *out->xyz), (uint32_t)count,
                           width};
    if (out->xyz == NULL) {
        fail_memory(ld);
        goto done;
    }
    for (uint64_t i = 0; i < count; i++)
        for (unsigned k = 0; k < width; k++)
            out->xyz[width * i + k] =
                param[k] == NO_PARAM ? 0 : d.data[offset + i * stride + param[k]];
    ok = true;
done:
    free(d.data);
    return ok;
}

static bool get_source(struct loader *ld, struct sources *all, const xmlNode *input, unsigned width,
                       long *index)
{
    const xmlNode *node;
    if (!reference_follow(ld, input, "source", "source", &node))
        return false;
    for (size_t i = 0; i < all->count; i++) {
        if (all->data[i].node == node && all->data[i].width == width) {
            *index = (long)i;
            return true;
        }
    }
    struct source *grown = build_grow(ld, all->data, sizeof *grown, all->count, &all->capacity);
    if (grown == NULL)
        return false;
    all->data = grown;
    if (!read_source(ld, node, width, &grown[all->count]))
        return false;
    *index = (long)all->count++;
    return true;
}

static bool is_uv(const char *semantic)
{
    return strcmp(semantic, "TEXCOORD") == 0 || strcmp(semantic, "UV") == 0;
}

/* One more set of texture coordinates, of no use where nothing has a texture. */
static bool add_uv(struct loader *ld, struct sources *all, const xmlNode *input, uint64_t offset,
                   bool by_vertex, struct inputs *in)
{
    struct uv_input *uv = &in->uv[in->num_uv];
    if (!ld->has_textures)
        return true;
    if (in->num_uv == MAX_UV_SETS)
        return fail_at(ld, input, "more than %d sets of texture coordinates", MAX_UV_SETS);
    in->num_uv++;
    uv->offset = offset;
    uv->by_vertex = by_vertex;
    return element_attribute_count_or(ld, input, "set", 0, &uv->set) &&
           get_source(ld, all, input, 2, &uv->source);
}

/* What hangs on texture coordinates shows nothing of its own, and unknown semantics mean something to
 * some other program. Vertex colours do not show in the assignment; elsewhere they would be expected
 * to. */
static bool skip_input(struct loader *ld, const xmlNode *input, const char *semantic)
{
    return ld->dialect == DIALECT_CGL || strcmp(semantic, "COLOR") != 0 ||
           fail_at(ld, input, "<input> of semantic 'COLOR' (vertex colours) is not supported");
}

static bool read_vertices(struct loader *ld, struct sources *all, const xmlNode *vertices,
                          struct inputs *in)
{
    in->position = -1;
    for (const xmlNode *c = element_first_child(vertices); c != NULL; c = element_next_sibling(c)) {
        if (element_is(c, "extra"))
            continue;
        if (!element_is(c, "input"))
            return element_fail_unexpected(ld, c);
        const char *semantic = element_attribute(c, "semantic");
        if (semantic == NULL)
            return fail_at(ld, c, "<input> without attribute 'semantic'");
        if (strcmp(semantic, "POSITION") == 0) {
            if (in->position >= 0)
                return fail_at(ld, c, "a second <input> of semantic 'POSITION'");
            if (!get_source(ld, all, c, 3, &in->position))
                return false;
        } else if (strcmp(semantic, "NORMAL") == 0) {
            /* The normals of corners win over those of vertices. */
            if (in->normal >= 0 && !in->normal_by_vertex)
                continue;
            if (in->normal >= 0)
                return fail_at(ld, c, "a second <input> of semantic 'NORMAL'");
            if (!get_source(ld, all, c, 3, &in->normal))
                return false;
            in->normal_by_vertex = true;
        } else if (is_uv(semantic)) {
            if (!add_uv(ld, all, c, 0, true, in))
                return false;
        } else if (!skip_input(ld, c, semantic)) {
            return false;
        }
    }
    if (in->position < 0)
        return fail_at(ld, vertices, "<vertices> without an <input> of semantic 'POSITION'");
    return true;
}

bool source_read_inputs(struct loader *ld, struct sources *all, const xmlNode *primitive,
                        struct inputs *in)
{
    *in = (struct inputs){.position = -1, .normal = -1};
    bool has_vertex = false;
    for (const xmlNode *c = element_first_child(primitive); c != NULL;
         c = element_next_sibling(c)) {
        if (!element_is(c, "input"))
            continue;
        const char *semantic = element_attribute(c, "semantic");
        uint64_t offset;
        if (semantic == NULL)
            return fail_at(ld, c, "<input> without attribute 'semantic'");
        if (!element_attribute_count(ld, c, "offset", &offset))
            return false;
        if (offset > 255)
            return fail_at(ld, c, "<input> offset above 255");
        in->stride = offset + 1 > in->stride ? offset + 1 : in->stride;
        if (strcmp(semantic, "VERTEX") == 0) {
            const xmlNode *vertices;
            if (has_vertex)
                return fail_at(ld, c, "a second <input> of semantic 'VERTEX'");
            if (!reference_follow(ld, c, "source", "vertices", &vertices) ||
                !read_vertices(ld, all, vertices, in))
                return false;
            has_vertex = true;
            in->vertex_offset = offset;
        } else if (strcmp(semantic, "NORMAL") == 0) {
            if (in->normal >= 0 && !in->normal_by_vertex)
                return fail_at(ld, c, "a second <input> of semantic 'NORMAL'");
            if (!get_source(ld, all, c, 3, &in->normal))
                return false;
            in->normal_by_vertex = false;
            in->normal_offset = offset;
        } else if (is_uv(semantic)) {
            if (!add_uv(ld, all, c, offset, false, in))
                return false;
        } else if (!skip_input(ld, c, semantic)) {
            return false;
        }
    }
    if (!has_vertex)
        return fail_at(ld, primitive, "<%s> without an <input> of semantic 'VERTEX'",
                       (const char *)primitive->name);
    return true;
}
