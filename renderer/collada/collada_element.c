/* Reading elements: names, attributes, extras; and the error lines. */
#include "collada_internal.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool(fail_line)(struct loader *ld, const xmlNode *n, long line, const char *fmt, ...)
{
    char text[900];
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(text, sizeof text, fmt, ap);
    va_end(ap);
    for (char *c = text; *c != '\0'; c++)
        if ((unsigned char)*c < 0x20 || *c == 0x7f)
            *c = '?';
    return err_set(ld->err, "%s:%ld: %s", n != NULL ? element_document(n)->path : ld->path, line,
                   text);
}

bool(fail_at)(struct loader *ld, const xmlNode *n, const char *fmt, ...)
{
    char text[900];
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(text, sizeof text, fmt, ap);
    va_end(ap);
    return fail_line(ld, n, element_line(n), "%s", text);
}

bool(fail_memory)(struct loader *ld)
{
    return err_set(ld->err, "%s: out of memory", ld->path);
}

bool element_fail_unexpected(struct loader *ld, const xmlNode *child)
{
    return fail_at(ld, child, "unexpected <%.60s> in <%.60s>", (const char *)child->name,
                   (const char *)child->parent->name);
}

/* The parser's own line numbers end at 65535, so element_start() keeps them in _private. */
long element_line(const xmlNode *n)
{
    return (long)(intptr_t)n->_private;
}

const struct document *element_document(const xmlNode *n)
{
    return n->doc->_private;
}

static bool same_namespace(const xmlNs *a, const xmlNs *b)
{
    if (a == NULL || b == NULL)
        return a == b;
    return xmlStrEqual(a->href, b->href);
}

xmlNode *element_first_child(const xmlNode *n)
{
    return xmlFirstElementChild((xmlNode *)n);
}

xmlNode *element_next_sibling(const xmlNode *n)
{
    return xmlNextElementSibling((xmlNode *)n);
}

bool element_is(const xmlNode *n, const char *name)
{
    return strcmp((const char *)n->name, name) == 0 &&
           same_namespace(n->ns, xmlDocGetRootElement(n->doc)->ns);
}

bool element_word_is_one_of(const char *word, const char *words)
{
    for (; *words != '\0'; words += strspn(words, " ")) {
        size_t length = strcspn(words, " ");
        if (strlen(word) == length && memcmp(word, words, length) == 0)
            return true;
        words += length;
    }
    return false;
}

bool element_is_one_of(const xmlNode *n, const char *words)
{
    return element_word_is_one_of((const char *)n->name, words) &&
           same_namespace(n->ns, xmlDocGetRootElement(n->doc)->ns);
}

bool element_only_children(struct loader *ld, const xmlNode *n, const char *words)
{
    for (const xmlNode *c = element_first_child(n); c != NULL; c = element_next_sibling(c))
        if (!element_is_one_of(c, words))
            return element_fail_unexpected(ld, c);
    return true;
}

xmlNode *element_child_named(const xmlNode *n, const char *name)
{
    for (xmlNode *c = element_first_child(n); c != NULL; c = element_next_sibling(c))
        if (element_is(c, name))
            return c;
    return NULL;
}

bool element_one_child(struct loader *ld, const xmlNode *n, const char *name, xmlNode **out)
{
    *out = element_child_named(n, name);
    if (*out == NULL)
        return true;
    for (const xmlNode *c = element_next_sibling(*out); c != NULL; c = element_next_sibling(c))
        if (element_is(c, name))
            return fail_at(ld, c, "a second <%s> in <%.60s>", name, (const char *)n->name);
    return true;
}

const char *element_attribute(const xmlNode *n, const char *name)
{
    for (const xmlAttr *a = n->properties; a != NULL; a = a->next)
        if (a->ns == NULL && strcmp((const char *)a->name, name) == 0)
            return a->children != NULL && a->children->content != NULL
                       ? (const char *)a->children->content
                       : "";
    return NULL;
}

bool element_attribute_count_or(struct loader *ld, const xmlNode *n, const char *name,
                                uint64_t missing, uint64_t *out)
{
    const char *s = element_attribute(n, name);
    if (s == NULL) {
        *out = missing;
        return true;
    }
    s += strspn(s, " ");
    uint64_t v = 0;
    size_t digits = strspn(s, "0123456789");
    for (size_t i = 0; i < digits && v < UINT32_MAX; i++)
        v = 10 * v + (uint64_t)(s[i] - '0');
    if (digits == 0 || s[digits + strspn(s + digits, " ")] != '\0' || v >= UINT32_MAX)
        return fail_at(ld, n, "<%.60s>: attribute %s=\"%.60s\" is not a number below 2^32-1",
                       (const char *)n->name, name, element_attribute(n, name));
    *out = v;
    return true;
}

bool element_attribute_count(struct loader *ld, const xmlNode *n, const char *name, uint64_t *out)
{
    if (element_attribute(n, name) == NULL)
        return fail_at(ld, n, "<%.60s> without attribute '%s'", (const char *)n->name, name);
    return element_attribute_count_or(ld, n, name, 0, out);
}

int element_compare_ids(const void *a, const void *b)
{
    const struct id_entry *x = a, *y = b;
    return strcmp(x->id, y->id);
}

bool element_is_own_profile(const char *profile)
{
    return profile != NULL && (strcmp(profile, "ASSAY") == 0 || strcmp(profile, "CGL") == 0);
}

bool element_own_technique(struct loader *ld, const xmlNode *n, xmlNode **out)
{
    *out = NULL;
    for (const xmlNode *extra = element_first_child(n); extra != NULL;
         extra = element_next_sibling(extra)) {
        if (!element_is(extra, "extra"))
            continue;
        for (xmlNode *t = element_first_child(extra); t != NULL; t = element_next_sibling(t)) {
            if (!element_is(t, "technique") ||
                !element_is_own_profile(element_attribute(t, "profile")))
                continue;
            if (*out != NULL)
                return fail_at(ld, t, "<%.60s> has more than one technique of profile ASSAY or CGL",
                               (const char *)n->name);
            *out = t;
        }
    }
    return true;
}

bool element_technique_content(struct loader *ld, const xmlNode *technique, xmlNode **out)
{
    *out = element_first_child(technique);
    if (*out == NULL)
        return fail_at(ld, technique, "empty technique of profile '%s'",
                       element_attribute(technique, "profile"));
    if (element_next_sibling(*out) != NULL)
        return element_fail_unexpected(ld, element_next_sibling(*out));
    return true;
}
