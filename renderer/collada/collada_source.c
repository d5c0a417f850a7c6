/* Reads the <input>s of primitives: <source>s of points and pairs, through their accessors. */
#include "collada_internal.h"

#include <stdlib.h>
#include <string.h>

void source_release(struct sources *all)
{
    for (size_t i = 0; i < all->count; i++)
        free(all->data[i].array.data);
    free(all->data);
}

/* Finds the positions within a stride of the first s->wanted named <param>s; unnamed ones are to be skipped. */
static void read_params(struct loader *ld, const xmlNode *accessor, uint64_t stride,
                        struct source *s, uint64_t param[3])
{
    uint64_t place = 0;
    element_check(ld, accessor, "param*");
    for (const xmlNode *p = element_first(accessor); p != NULL; p = element_next(p), place++) {
        const char *name = element_attribute(p, "name"), *type = element_attribute(p, "type");
        if (type != NULL && element_place_among(type, "float double") < 0)
            fail_at(ld, p, "<param> of type '%.60s' where numbers are needed", type);
        if (name != NULL && name[0] != '\0' && s->size < s->wanted)
            param[s->size++] = place;
    }
    if (s->size < 2)
        fail_at(ld, accessor, "<accessor> has %u named <param>s where %u are needed", s->size,
                s->wanted);
    if (stride < place)
        fail_at(ld, accessor, "<accessor> has more <param>s than its stride");
}

static void read_source(struct loader *ld, struct source *s)
{
    element_check(ld, s->node, "technique_common *");
    const xmlNode *common = element_child(s->node, "technique_common");
    element_check(ld, common, "accessor *");
    const xmlNode *accessor = element_child(common, "accessor");
    if (ld->failed)
        return;
    uint64_t stride = element_count_or(ld, accessor, "stride", 1),
             offset = element_count_or(ld, accessor, "offset", 0), param[3] = {0, 0, 0};
    s->count = element_count(ld, accessor, "count");
    read_params(ld, accessor, stride, s, param);
    const xmlNode *array = reference_follow(ld, accessor, "source", "float_array");
    if (array == NULL)
        return;
    uint64_t declared = element_count(ld, array, "count");
    text_read_doubles(ld, array, &s->array);
    if (s->array.count != declared)
        fail_at(ld, array, "<float_array> has %zu numbers, its count says %llu", s->array.count,
                (unsigned long long)declared);
    if (s->count > 0 && offset + (s->count - 1) * stride + param[s->size - 1] >= s->array.count)
        fail_at(ld, accessor, "<accessor> reaches beyond the end of its <float_array>");
    /* In place, downwards: no stride is below the size. */
    double *out = s->array.data;
    for (uint64_t i = 0; i < s->count && !ld->failed; i++)
        for (unsigned k = 0; k < s->size; k++)
            *out++ = s->array.data[offset + i * stride + param[k]];
}

/* Index in `all` of an input's source, which is read at the first call. */
static size_t get_source(struct loader *ld, struct sources *all, const xmlNode *input,
                         unsigned wanted)
{
    const xmlNode *node = reference_follow(ld, input, "source", "source");
    for (size_t i = 0; i < all->count; i++)
        if (all->data[i].node == node && all->data[i].wanted == wanted)
            return i;
    all->data = build_grow(ld, all->data, sizeof *all->data, all->count);
    if (ld->failed)
        return 0;
    struct source *s = &all->data[all->count++];
    *s = (struct source){.node = node, .wanted = wanted};
    read_source(ld, s);
    return all->count - 1;
}

/* Reads an <input> of a primitive, or of its <vertices> (then *of_vertex is the offset of the
 * vertex index). Tangents and other semantics that nothing uses are skipped. Vertex colours are
 * ignored in the CGL dialect and an error in COLLADA, where a user would expect to see them. */
static void read_input(struct loader *ld, struct sources *all, const xmlNode *input,
                       const uint64_t *of_vertex, struct inputs *in)
{
    const char *semantic = element_needed_attribute(ld, input, "semantic");
    struct input one = {.present = true, .by_vertex = of_vertex != NULL}, *to = NULL;
    one.offset = of_vertex != NULL ? *of_vertex : element_count(ld, input, "offset");
    if (one.offset > 255)
        fail_at(ld, input, "<input> offset above 255");
    in->stride = one.offset + 1 > in->stride ? one.offset + 1 : in->stride;
    if (strcmp(semantic, one.by_vertex ? "POSITION" : "VERTEX") == 0) {
        to = &in->position;
    } else if (strcmp(semantic, "NORMAL") == 0) {
        /* The normals of corners win over those of vertices. */
        if (one.by_vertex && in->normal.present && !in->normal.by_vertex)
            return;
        if (in->normal.by_vertex && !one.by_vertex)
            in->normal.present = false;
        to = &in->normal;
    } else if (element_place_among(semantic, "TEXCOORD UV") >= 0) {
        if (!ld->has_textures)
            return;
        if (in->num_uv == MAX_UV_SETS)
            fail_at(ld, input, "more than %d sets of texture coordinates", MAX_UV_SETS);
        else
            to = &in->uv[in->num_uv++];
        one.set = element_count_or(ld, input, "set", 0);
    } else if (ld->dialect == DIALECT_COLLADA && strcmp(semantic, "COLOR") == 0) {
        fail_at(ld, input, "<input> of semantic 'COLOR' (vertex colours) is not supported");
    }
    if (to == NULL || ld->failed)
        return;
    if (to->present)
        fail_at(ld, input, "a second <input> of semantic '%s'", semantic);
    if (to != &in->position || one.by_vertex) {
        one.source = get_source(ld, all, input, to == &in->position || to == &in->normal ? 3 : 2);
        *to = one;
        return;
    }
    const xmlNode *vertices = reference_follow(ld, input, "source", "vertices");
    element_check(ld, vertices, "input* extra*");
    for (const xmlNode *c = element_first(vertices); c != NULL; c = element_next(c))
        if (element_is(c, "input"))
            read_input(ld, all, c, &one.offset, in);
    if (!in->position.present)
        fail_at(ld, vertices, "<vertices> without an <input> of semantic 'POSITION'");
}

struct inputs source_read_inputs(struct loader *ld, struct sources *all, const xmlNode *primitive)
{
    struct inputs in = {0};
    for (const xmlNode *c = element_first(primitive); c != NULL; c = element_next(c))
        if (element_is(c, "input"))
            read_input(ld, all, c, NULL, &in);
    if (!in.position.present)
        fail_at(ld, primitive, "<%s> without an <input> of semantic 'VERTEX'",
                (const char *)primitive->name);
    return in;
}
