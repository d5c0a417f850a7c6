/* Reading elements: names, attributes, extras; and the error lines. */
#include "collada_internal.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool element_fail_line(struct loader *ld, const xmlNode *n, long line, const char *fmt, ...)
{
    char text[900];
    va_list ap;
    if (ld->failed)
        return false;
    ld->failed = true;
    va_start(ap, fmt);
    vsnprintf(text, sizeof text, fmt, ap);
    va_end(ap);
    const char *path = n != NULL ? element_document(n)->path : ld->path;
    return line > 0 ? err_set(ld->err, "%s:%ld: %s", path, line, text)
                    : err_set(ld->err, "%s: %s", path, text);
}

bool element_fail_memory(struct loader *ld)
{
    return element_fail_line(ld, NULL, 0, "out of memory");
}

bool element_fail_unexpected(struct loader *ld, const xmlNode *child)
{
    static const char *const UNSUPPORTED[][2] = {{"brep", "solids by their boundaries"},
                                                 {"convex_mesh", "convex hulls"},
                                                 {"instance_controller", "skins and morphs"},
                                                 {"ph", "polygons with holes"},
                                                 {"spline", "curves"}};
    for (size_t i = 0; i < sizeof UNSUPPORTED / sizeof *UNSUPPORTED; i++)
        if (element_is(child, UNSUPPORTED[i][0]))
            return fail_at(ld, child, "<%s>: %s are not supported", UNSUPPORTED[i][0],
                           UNSUPPORTED[i][1]);
    return fail_at(ld, child, "unexpected <%.60s> in <%.60s>", (const char *)child->name,
                   (const char *)child->parent->name);
}

/* The parser's own line numbers end at 65535, so element_start() keeps them in _private. */
long element_line(const xmlNode *n)
{
    return n != NULL ? (long)(intptr_t)n->_private : 0;
}

const struct document *element_document(const xmlNode *n)
{
    return n->doc->_private;
}

static bool has_our_namespace(const xmlNode *n)
{
    const xmlNs *a = n->ns, *b = xmlDocGetRootElement(n->doc)->ns;
    return a == b || (a != NULL && b != NULL && xmlStrEqual(a->href, b->href));
}

const xmlNode *element_first(const xmlNode *n)
{
    return xmlFirstElementChild((xmlNode *)n);
}

const xmlNode *element_next(const xmlNode *n)
{
    return xmlNextElementSibling((xmlNode *)n);
}

bool element_is(const xmlNode *n, const char *name)
{
    return n != NULL && strcmp((const char *)n->name, name) == 0 && has_our_namespace(n);
}

/* A word of a list in the syntax of element_check(). */
struct word {
    const char *names; /* between bars */
    int length;
    char how_many; /* '?', '*', or else one */
};

/* Takes the next word from a list. False at the end. */
static bool next_word(const char **list, struct word *w)
{
    *list += strspn(*list, " ");
    w->names = *list;
    w->length = (int)strcspn(*list, " ");
    *list += w->length;
    if (w->length == 0)
        return false;
    w->how_many = w->names[w->length - 1];
    if (w->how_many == '?' || w->how_many == '*')
        w->length--;
    return true;
}

static bool word_has(const struct word *w, const char *name)
{
    size_t size = strlen(name);
    for (const char *at = w->names, *end = at + w->length; at < end;) {
        const char *bar = memchr(at, '|', (size_t)(end - at));
        bar = bar != NULL ? bar : end;
        if ((size_t)(bar - at) == size && memcmp(at, name, size) == 0)
            return true;
        at = bar + 1;
    }
    return false;
}

int element_place_among(const char *name, const char *words)
{
    struct word w;
    for (int place = 0; next_word(&words, &w); place++)
        if (word_has(&w, name) || w.length == 0)
            return place;
    return -1;
}

bool element_is_one_of(const xmlNode *n, const char *words)
{
    return n != NULL && element_place_among((const char *)n->name, words) >= 0 &&
           has_our_namespace(n);
}

bool element_check(struct loader *ld, const xmlNode *n, const char *words)
{
    struct word w;
    for (const xmlNode *c = element_first(n); c != NULL; c = element_next(c))
        if (!element_is_one_of(c, words))
            return element_fail_unexpected(ld, c);
    while (n != NULL && next_word(&words, &w)) {
        const xmlNode *one = NULL;
        if (w.how_many == '*')
            continue;
        for (const xmlNode *c = element_first(n); c != NULL; c = element_next(c)) {
            if (!word_has(&w, (const char *)c->name) || !has_our_namespace(c))
                continue;
            if (one != NULL)
                return xmlStrEqual(one->name, c->name)
                           ? fail_at(ld, c, "a second <%.60s> in <%.60s>", (const char *)c->name,
                                     (const char *)n->name)
                           : element_fail_unexpected(ld, c);
            one = c;
        }
        if (one == NULL && w.how_many != '?')
            return fail_at(ld, n, "<%.60s> without <%.*s>", (const char *)n->name, w.length,
                           w.names);
    }
    return !ld->failed;
}

const xmlNode *element_child(const xmlNode *n, const char *name)
{
    const xmlNode *c = element_first(n);
    while (c != NULL && !element_is(c, name))
        c = element_next(c);
    return c;
}

const xmlNode *element_child_with(const xmlNode *n, const char *name, const char *attribute,
                                  const char *value)
{
    for (const xmlNode *c = element_first(n); c != NULL; c = element_next(c))
        if (value != NULL && element_is(c, name) &&
            xmlStrEqual(BAD_CAST element_attribute(c, attribute), BAD_CAST value))
            return c;
    return NULL;
}

const char *element_attribute(const xmlNode *n, const char *name)
{
    for (const xmlAttr *a = n != NULL ? n->properties : NULL; a != NULL; a = a->next)
        if (a->ns == NULL && strcmp((const char *)a->name, name) == 0)
            return a->children != NULL && a->children->content != NULL
                       ? (const char *)a->children->content
                       : "";
    return NULL;
}

const char *element_needed_attribute(struct loader *ld, const xmlNode *n, const char *name)
{
    const char *value = element_attribute(n, name);
    if (value == NULL && !ld->failed)
        fail_at(ld, n, "<%.60s> without attribute '%s'", (const char *)n->name, name);
    return value != NULL ? value : "";
}

uint64_t element_count_or(struct loader *ld, const xmlNode *n, const char *name, uint64_t missing)
{
    const char *s = element_attribute(n, name);
    if (s == NULL)
        return missing;
    char *end;
    uint64_t v = strtoull(s, &end, 10);
    if (end == s || end[strspn(end, " ")] != '\0' || strchr(s, '-') != NULL || v >= UINT32_MAX)
        fail_at(ld, n, "<%.60s>: attribute %s=\"%.60s\" is not a number below 2^32-1",
                (const char *)n->name, name, s);
    return v;
}

uint64_t element_count(struct loader *ld, const xmlNode *n, const char *name)
{
    element_needed_attribute(ld, n, name);
    return element_count_or(ld, n, name, 0);
}

bool element_is_own_profile(const char *profile)
{
    return profile != NULL && (strcmp(profile, "ASSAY") == 0 || strcmp(profile, "CGL") == 0);
}

const xmlNode *element_own_technique(struct loader *ld, const xmlNode *n)
{
    const xmlNode *own = NULL;
    for (const xmlNode *extra = element_first(n); extra != NULL; extra = element_next(extra)) {
        const xmlNode *t = element_is(extra, "extra") ? element_first(extra) : NULL;
        for (; t != NULL; t = element_next(t)) {
            if (!element_is(t, "technique") ||
                !element_is_own_profile(element_attribute(t, "profile")))
                continue;
            if (own != NULL)
                fail_at(ld, t, "<%.60s> has more than one technique of profile ASSAY or CGL",
                        (const char *)n->name);
            own = t;
        }
    }
    return own;
}
