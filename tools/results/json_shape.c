#include "json_shape.h"

#include "reference/base/json_node.h"
#include "tools/compare/verdict.h"

#include <stdio.h>
#include <string.h>

const char json_shape_measured[] = "MEASURED";

static bool is_count(const json_t *v)
{
    return json_is_integer(v) && json_integer_value(v) >= 0;
}

static bool are_counts(const json_t *v)
{
    for (size_t i = 0; i < json_array_size(v); i++)
        if (!is_count(json_array_get(v, i)))
            return false;
    return json_is_array(v);
}

static bool is_triple(const json_t *v)
{
    double x, y, z;
    return json_unpack((json_t *)v, "[FFF!]", &x, &y, &z) == 0;
}

static bool is_verdict(const json_t *v)
{
    const char *text = json_string_value(v);
    enum verdict verdict;
    return text != NULL &&
           (strcmp(text, json_shape_measured) == 0 || verdict_parse(text, &verdict));
}

/* NULL if v is of that kind, else what it should be, in words. */
static const char *wanted(const json_t *v, enum shape_kind kind)
{
    switch (kind) {
    case IS_TEXT: return json_is_string(v) ? NULL : "a string";
    case IS_NUMBER:
    case IS_ESTIMATE: return json_is_number(v) ? NULL : "a number";
    case IS_POSITIVE:
    case IS_POSITIVE_ESTIMATE: return json_number_value(v) > 0 ? NULL : "a positive number";
    case IS_COUNT: return is_count(v) ? NULL : "a whole number of 0 or more";
    case IS_BOOLEAN: return json_is_boolean(v) ? NULL : "true or false";
    case IS_INTERVAL:
        return json_is_interval(v) ? NULL : "an array of two numbers, the lower first";
    case IS_TRIPLE: return is_triple(v) ? NULL : "an array of three numbers";
    case IS_COUNTS: return are_counts(v) ? NULL : "an array of whole numbers";
    case IS_VERDICT: return is_verdict(v) ? NULL : "a verdict";
    case NUM_SHAPE_KINDS: break;
    }
    return "known";
}

/* The object being checked; error lines name its members by where ("FILE: claim 1") and within ("rungs."). */
struct place {
    const json_t *object;
    const char *where, *within;
};

/* Takes the next of *names, and into *sign the '?' or '~' behind it, else ' ' or NUL. False if none is left. */
static bool next_name(const char **names, char name[64], char *sign)
{
    *names += strspn(*names, " ");
    size_t n = strcspn(*names, " ?~");
    snprintf(name, 64, "%.*s", (int)n, *names);
    *sign = (*names)[n];
    *names += n + (*sign != '\0');
    return n > 0;
}

static bool check_members(const struct place *p, const char *names, enum shape_kind kind,
                          struct err *e)
{
    char name[64], ci[80], sign;
    while (next_name(&names, name, &sign)) {
        const json_t *v = json_object_get(p->object, name);
        if (v == NULL && sign == '?')
            continue;
        if (v == NULL)
            return err_set(e, "%s: '%s%s' is missing", p->where, p->within, name);
        const char *what = sign == '~' && json_is_null(v) ? NULL : wanted(v, kind);
        if (what != NULL)
            return err_set(e, "%s: '%s%s' is not %s", p->where, p->within, name, what);
        if (kind != IS_ESTIMATE && kind != IS_POSITIVE_ESTIMATE)
            continue;
        snprintf(ci, sizeof ci, "%s_ci", name);
        v = json_object_get(p->object, ci);
        if (!json_is_null(v) &&
            (!json_is_interval(v) ||
             (kind == IS_POSITIVE_ESTIMATE && !(json_number_value(json_array_get(v, 0)) > 0))))
            return err_set(e, "%s: '%s%s' is neither an interval nor null", p->where, p->within,
                           ci);
    }
    return true;
}

static bool check(const struct place *p, const struct shape *s, struct err *e);

static bool check_part(const struct place *p, const char *names, const struct shape *of,
                       enum shape_part kind, struct err *e)
{
    char name[64], within[128], sign;
    if (!next_name(&names, name, &sign))
        return true;
    json_t *v = json_object_get(p->object, name);
    struct place inner = {v, p->where, within};
    snprintf(within, sizeof within, "%s%s.", p->within, name);
    if (v == NULL)
        return sign == '?' || err_set(e, "%s: '%s%s' is missing", p->where, p->within, name);
    if (kind == PART_OBJECT)
        return json_is_object(v)
                   ? check(&inner, of, e)
                   : err_set(e, "%s: '%s%s' is not an object", p->where, p->within, name);
    if (!json_is_array(v) || json_array_size(v) < (size_t)kind)
        return err_set(e, "%s: '%s%s' is not an array%s", p->where, p->within, name,
                       kind == PART_LIST_OF_1   ? " with at least one element"
                       : kind == PART_LIST_OF_2 ? " with at least two elements"
                                                : "");
    for (size_t i = 0; i < json_array_size(v); i++) {
        inner.object = json_array_get(v, i);
        if (!json_is_object(inner.object))
            return err_set(e, "%s: '%s%s' has an element %zu that is not an object", p->where,
                           p->within, name, i);
        if (!check(&inner, of, e))
            return false;
    }
    return true;
}

static bool check(const struct place *p, const struct shape *s, struct err *e)
{
    bool ok = true;
    for (int k = 0; ok && k < NUM_SHAPE_KINDS; k++)
        ok = s->names[k] == NULL || check_members(p, s->names[k], (enum shape_kind)k, e);
    for (size_t k = 0; ok && k < sizeof s->part / sizeof *s->part && s->part[k].name != NULL; k++)
        ok = check_part(p, s->part[k].name, s->part[k].of, s->part[k].kind, e);
    return ok;
}

bool json_shape_check(const json_t *object, const struct shape *shape, const char *where,
                      struct err *e)
{
    return check(&(struct place){object, where, ""}, shape, e);
}

bool json_shape_check_row(const json_t *row, const struct shape *judged, const char *where,
                          struct err *e)
{
    const char *verdict = member_text(row, "verdict");
    bool passed = json_is_true(json_object_get(row, "passed"));
    if (member_text(row, "error") != NULL)
        return (!passed &&
                (verdict == NULL || strcmp(verdict, verdict_name(VERDICT_INCONCLUSIVE)) == 0)) ||
               err_set(e, "%s: has an 'error' and yet 'passed' or a 'verdict'", where);
    if (!json_shape_check(row, judged, where, e))
        return false;
    bool good = strcmp(verdict, json_shape_measured) == 0 ||
                strcmp(verdict, verdict_name(VERDICT_EQUIVALENT)) == 0;
    return good == passed || err_set(e, "%s: 'passed' contradicts 'verdict'", where);
}
