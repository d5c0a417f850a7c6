/* Child elements by tables of what they may be. */
#include "collada_internal.h"

#include <stdlib.h>
#include <string.h>

static bool read_number(struct loader *ld, const xmlNode *n, const struct field *f)
{
    double v;
    if (!text_read_exactly(ld, n, &v, 1))
        return false;
    if (!(v >= f->lo && v <= f->hi))
        return fail_at(ld, n, "<%s> is %g, outside %g to %g", f->name, v, f->lo, f->hi);
    if (f->kind == FIELD_FLOAT)
        *(float *)f->out = (float)v;
    else
        *(double *)f->out = v;
    return true;
}

static bool read_color(struct loader *ld, const xmlNode *n, const struct field *f)
{
    rgb *out = f->out;
    return text_read_color(ld, n, out, NULL) && (f->hi == 0 || (double)rgb_max(*out) <= f->hi ||
                                                 fail_at(ld, n, "<%s> above %g", f->name, f->hi));
}

static bool read_choice(struct loader *ld, const xmlNode *n, const struct field *f)
{
    char *word = text_read_word(ld, n);
    if (word == NULL)
        return false;
    bool second = strcmp(word, f->words[1]) == 0, ok = second || strcmp(word, f->words[0]) == 0;
    if (!ok)
        fail_at(ld, n, "<%s> is '%.60s', neither '%s' nor '%s'", f->name, word, f->words[0],
                f->words[1]);
    *(bool *)f->out = second;
    free(word);
    return ok;
}

bool field_read_all(struct loader *ld, const xmlNode *n, const struct field *fields, size_t count)
{
    for (const xmlNode *c = element_first_child(n); c != NULL; c = element_next_sibling(c)) {
        size_t i = 0;
        while (i < count && !element_is(c, fields[i].name))
            i++;
        if (i == count)
            return element_fail_unexpected(ld, c);
    }
    for (const struct field *f = fields; f < fields + count; f++) {
        xmlNode *c;
        if (!element_one_child(ld, n, f->name, &c))
            return false;
        if (c == NULL && f->is_needed)
            return fail_at(ld, n, "<%.60s> without <%s>", (const char *)n->name, f->name);
        if (c != NULL && !(f->kind == FIELD_COLOR    ? read_color(ld, c, f)
                           : f->kind == FIELD_CHOICE ? read_choice(ld, c, f)
                                                     : read_number(ld, c, f)))
            return false;
    }
    return true;
}
