/* Values of child elements whose number element_check() has checked. */
#include "collada_internal.h"

double field_number(struct loader *ld, const xmlNode *n, const char *name, double missing,
                    double lo, double hi)
{
    const xmlNode *c = element_child(n, name);
    double v = missing;
    if (c != NULL)
        text_read_numbers(ld, c, &v, 1, 1);
    if (c != NULL && !(v >= lo && v <= hi))
        fail_at(ld, c, "<%s> is %g, outside %g to %g", name, v, lo, hi);
    return v;
}

rgb field_color(struct loader *ld, const xmlNode *n, const char *name, float most)
{
    const xmlNode *c = element_child(n, name);
    rgb v = c != NULL ? text_read_color(ld, c, NULL) : grey(0);
    if (rgb_max(v) > most)
        fail_at(ld, c, "<%s> above %g", name, (double)most);
    return v;
}

int field_choice(struct loader *ld, const xmlNode *n, const char *name, const char *words,
                 int missing)
{
    const xmlNode *c = element_child(n, name);
    const char *word = c != NULL ? text_read_word(ld, c) : NULL;
    int which = word != NULL ? element_place_among(word, words) : missing;
    if (which < 0)
        fail_at(ld, c, "<%s> is '%.60s', not one of: %s", name, word, words);
    return which < 0 ? missing : which;
}
