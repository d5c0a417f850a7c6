/* The text of elements as numbers and words. */
#include "collada_internal.h"
#include "renderer/base/number.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

/* The document's own bytes where an element has one text and nothing else, as meshes do; else a copy. */
struct text {
    char *data;
    size_t size;
    bool is_borrowed;
};

static void text_free(struct text *t)
{
    if (!t->is_borrowed)
        free(t->data);
}

static bool append(struct loader *ld, struct text *t, const char *s, size_t size)
{
    char *p = realloc(t->data, t->size + size + 1);
    if (p == NULL)
        return fail_memory(ld);
    t->data = p;
    memcpy(p + t->size, s, size);
    t->size += size;
    p[t->size] = '\0';
    return true;
}

/* All character data of the element. Comments leave their line ends, so that a place in the text
 * can be told by its line. The caller calls text_free(), also after failure. */
static bool collect(struct loader *ld, const xmlNode *n, struct text *t)
{
    const xmlNode *only = n->children;
    if (only != NULL && only->next == NULL && only->type == XML_TEXT_NODE &&
        only->content != NULL) {
        *t = (struct text){(char *)only->content, strlen((char *)only->content), true};
        return true;
    }
    *t = (struct text){NULL, 0, false};
    if (!append(ld, t, "", 0))
        return false;
    for (const xmlNode *c = n->children; c != NULL; c = c->next) {
        const char *s = c->content != NULL ? (const char *)c->content : "";
        if (c->type == XML_TEXT_NODE || c->type == XML_CDATA_SECTION_NODE) {
            if (!append(ld, t, s, strlen(s)))
                return false;
        } else if (c->type == XML_COMMENT_NODE || c->type == XML_PI_NODE) {
            if (!append(ld, t, " ", 1))
                return false;
            for (; *s != '\0'; s++)
                if (*s == '\n' && !append(ld, t, s, 1))
                    return false;
        } else if (c->type == XML_ELEMENT_NODE) {
            return element_fail_unexpected(ld, c);
        } else {
            return fail_at(ld, n, "<%.60s> holds something that is not text",
                           (const char *)n->name);
        }
    }
    return true;
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

static int token_length(const char *s)
{
    int n = 0;
    while (s[n] != '\0' && !is_space(s[n]) && n < 40)
        n++;
    return n;
}

bool text_read_doubles(struct loader *ld, const xmlNode *n, struct doubles *out)
{
    struct text t;
    bool ok = collect(ld, n, &t);
    const char *s = t.data;
    long line = element_line(n);
    while (ok && next_token(&s, &line)) {
        double v, *grown = build_grow(ld, out->data, sizeof *grown, out->count, &out->capacity);
        ok = grown != NULL;
        if (!ok)
            break;
        out->data = grown;
        const char *end = s;
        if (!number_parse(s, &end, &v))
            ok = fail_line(ld, n, line, "<%.60s>: '%.*s' is not a finite number",
                           (const char *)n->name, token_length(s), s);
        else
            out->data[out->count++] = v;
        s = end;
    }
    text_free(&t);
    return ok;
}

bool text_read_uints(struct loader *ld, const xmlNode *n, struct uints *out)
{
    struct text t;
    bool ok = collect(ld, n, &t);
    const char *s = t.data;
    long line = element_line(n);
    while (ok && next_token(&s, &line)) {
        uint32_t *grown = build_grow(ld, out->data, sizeof *grown, out->count, &out->capacity);
        ok = grown != NULL;
        if (!ok)
            break;
        out->data = grown;
        const char *start = s;
        uint64_t v = 0;
        for (; *s >= '0' && *s <= '9' && v <= UINT32_MAX; s++)
            v = 10 * v + (uint64_t)(*s - '0');
        if (s == start || v > UINT32_MAX || (*s != '\0' && !is_space(*s)))
            ok = fail_line(ld, n, line, "<%.60s>: '%.*s' is not an index", (const char *)n->name,
                           token_length(start), start);
        else
            out->data[out->count++] = (uint32_t)v;
    }
    text_free(&t);
    return ok;
}

/* Between least and most numbers. */
static bool read_some(struct loader *ld, const xmlNode *n, double *out, size_t least, size_t most,
                      size_t *count)
{
    struct doubles d = {NULL, 0, 0};
    bool ok = text_read_doubles(ld, n, &d);
    if (ok && (d.count < least || d.count > most))
        ok = fail_at(ld, n, "<%.60s> has %zu numbers instead of %zu", (const char *)n->name,
                     d.count, d.count < least ? least : most);
    if (ok) {
        memcpy(out, d.data, d.count * sizeof *out);
        *count = d.count;
    }
    free(d.data);
    return ok;
}

bool text_read_exactly(struct loader *ld, const xmlNode *n, double *out, size_t count)
{
    return read_some(ld, n, out, count, count, &count);
}

bool text_read_up_to(struct loader *ld, const xmlNode *n, double *out, size_t most)
{
    size_t count;
    memset(out, 0, most * sizeof *out);
    return read_some(ld, n, out, 1, most, &count);
}

bool text_read_color(struct loader *ld, const xmlNode *n, rgb *out, double *alpha)
{
    double v[4] = {0, 0, 0, 1};
    size_t count;
    if (!read_some(ld, n, v, 3, 4, &count))
        return false;
    for (int i = 0; i < 3; i++)
        if (v[i] < 0 || v[i] > FLT_MAX)
            return fail_at(ld, n, "<%.60s>: negative or too large: %g", (const char *)n->name,
                           v[i]);
    *out = (rgb){(float)v[0], (float)v[1], (float)v[2]};
    if (alpha != NULL)
        *alpha = v[3];
    return true;
}

char *text_read_word(struct loader *ld, const xmlNode *n)
{
    struct text t;
    char *word = NULL;
    if (collect(ld, n, &t)) {
        const char *start = t.data, *end = t.data + t.size;
        while (start < end && is_space(*start))
            start++;
        while (end > start && is_space(end[-1]))
            end--;
        word = strndup(start, (size_t)(end - start));
        if (word == NULL)
            fail_memory(ld);
    }
    text_free(&t);
    return word;
}

static int hex_digit(char c)
{
    const char *digits = "0123456789abcdef", *at = c != '\0' ? strchr(digits, c | 0x20) : NULL;
    return at != NULL ? (int)(at - digits) : -1;
}

void text_decode_percents(char *s)
{
    char *to = s;
    for (; *s != '\0'; s++) {
        int high = *s == '%' ? hex_digit(s[1]) : -1, low = high >= 0 ? hex_digit(s[2]) : -1;
        bool escape = low >= 0 && high + low > 0;
        *to++ = escape ? (char)(16 * high + low) : *s;
        s += escape ? 2 : 0;
    }
    *to = '\0';
}
