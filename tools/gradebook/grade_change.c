#include "grade_change.h"

#include "reference/base/json_node.h"
#include "tools/base/text.h"

#include <math.h>
#include <stdio.h>

static const double told = 0.005; /* a point is written with two decimals */

static const json_t *find(const json_t *grade, const char *name)
{
    return member_named(json_object_get(grade, "checks"), name);
}

static json_t *points_of(const json_t *check)
{
    return check != NULL ? json_real(member_number(check, "points")) : json_null();
}

static void compare(json_t *list, const char *name, const json_t *was, const json_t *is)
{
    if (was == NULL || is == NULL ||
        fabs(member_number(was, "points") - member_number(is, "points")) >= told)
        json_array_append_new(list, json_pack("{ss, so, so, ss*}", "name", name, "was",
                                              points_of(was), "is", points_of(is), "appeal",
                                              is == NULL || member_text(is, "appeal") == NULL
                                                  ? member_text(was, "appeal")
                                                  : NULL));
}

json_t *grade_change(const json_t *old, const json_t *grade)
{
    json_t *list = json_array();
    json_each(c, json_object_get(grade, "checks"))
        compare(list, member_or_empty(c, "name"), find(old, member_or_empty(c, "name")), c);
    json_each(c, json_object_get(old, "checks"))
        if (find(grade, member_or_empty(c, "name")) == NULL)
            compare(list, member_or_empty(c, "name"), c, NULL);
    if (old == NULL ||
        (json_array_size(list) == 0 && member_number(old, "of") == member_number(grade, "of"))) {
        json_decref(list);
        return NULL;
    }
    return json_pack("{sf, sf, so}", "points", member_number(old, "points"), "of",
                     member_number(old, "of"), "checks", list);
}

void grade_change_text(const json_t *grade, char *out, size_t size)
{
    const json_t *before = json_object_get(grade, "before");
    out[0] = '\0';
    if (json_is_object(before))
        text_append(out, size, "%.2f of %g before", member_number(before, "points"),
                    member_number(before, "of"));
    json_each(c, json_object_get(before, "checks")) {
        char was[32], is[32];
        snprintf(was, sizeof was, "%.2f", member_number(c, "was"));
        snprintf(is, sizeof is, "now %.2f", member_number(c, "is"));
        text_append(out, size, "; %s %s%s, %s", member_or_empty(c, "name"),
                    json_is_null(json_object_get(c, "was")) ? "not asked" : was,
                    member_text(c, "appeal") != NULL ? " by appeal" : "",
                    json_is_null(json_object_get(c, "is")) ? "not asked now" : is);
    }
}
