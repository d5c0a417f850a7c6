/* The text of elements as numbers and words. */
#include "collada_internal.h"
#include "renderer/base/number.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

#define BLANKS " \t\r\n"

/* The element's text. Without child elements the parser leaves at most one text node. */
static const char *text_of(struct loader *ld, const xmlNode *n)
{
    const xmlNode *child = element_first(n);
    if (child != NULL)
        element_fail_unexpected(ld, child);
    return n != NULL && child == NULL && n->children != NULL ? (const char *)n->children->content
                                                             : "";
}

static bool is_space(char c)
{
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

/* Steps to the next token, counting lines. False at the end. */
static bool next_token(const char **s, long *line)
{
    for (; is_space(**s); ++*s)
        *line += **s == '\n';
    return **s != '\0';
}

static bool fail_token(struct loader *ld, const xmlNode *n, long line, const char *s,
                       const char *wanted)
{
    size_t length = strcspn(s, BLANKS);
    return element_fail_line(ld, n, line, "<%.60s>: '%.*s' is not %s", (const char *)n->name,
                             (int)(length < 40 ? length : 40), s, wanted);
}

bool text_read_doubles(struct loader *ld, const xmlNode *n, struct doubles *out)
{
    const char *s = text_of(ld, n);
    long line = element_line(n);
    while (next_token(&s, &line)) {
        const char *start = s;
        out->data = build_grow(ld, out->data, sizeof *out->data, out->count);
        if (ld->failed || !number_parse(start, &s, &out->data[out->count]))
            return fail_token(ld, n, line, start, "a finite number");
        out->count++;
    }
    return !ld->failed;
}

bool text_read_uints(struct loader *ld, const xmlNode *n, struct uints *out)
{
    const char *s = text_of(ld, n);
    long line = element_line(n);
    while (next_token(&s, &line)) {
        const char *start = s;
        uint64_t v = 0;
        for (; *s >= '0' && *s <= '9' && v <= UINT32_MAX; s++)
            v = 10 * v + (uint64_t)(*s - '0');
        out->data = build_grow(ld, out->data, sizeof *out->data, out->count);
        if (ld->failed || s == start || v > UINT32_MAX || (*s != '\0' && !is_space(*s)))
            return fail_token(ld, n, line, start, "an index");
        out->data[out->count++] = (uint32_t)v;
    }
    return !ld->failed;
}

size_t text_read_numbers(struct loader *ld, const xmlNode *n, double *out, size_t least,
                         size_t most)
{
    struct doubles d = {NULL, 0};
    text_read_doubles(ld, n, &d);
    memset(out, 0, most * sizeof *out);
    if (d.count < least || d.count > most)
        fail_at(ld, n, "<%.60s> has %zu numbers instead of %zu", (const char *)n->name, d.count,
                d.count < least ? least : most);
    else if (d.count > 0)
        memcpy(out, d.data, d.count * sizeof *out);
    free(d.data);
    return d.count;
}

rgb text_read_color(struct loader *ld, const xmlNode *n, double *alpha)
{
    double v[4];
    size_t count = text_read_numbers(ld, n, v, 3, 4);
    for (int i = 0; i < 3; i++)
        if (v[i] < 0 || v[i] > FLT_MAX)
            fail_at(ld, n, "<%.60s>: negative or too large: %g", (const char *)n->name, v[i]);
    if (alpha != NULL)
        *alpha = count == 4 ? v[3] : 1;
    return ld->failed ? grey(0) : (rgb){(float)v[0], (float)v[1], (float)v[2]};
}

const char *text_read_word(struct loader *ld, const xmlNode *n)
{
    const char *start = text_of(ld, n), *word;
    start += strspn(start, BLANKS);
    size_t size = strlen(start);
    while (size > 0 && is_space(start[size - 1]))
        size--;
    word = (const char *)xmlDictLookup(n->doc->dict, (const xmlChar *)start, (int)size);
    if (word == NULL)
        element_fail_memory(ld);
    return word != NULL ? word : "";
}
