#include "student_view.h"

#include "grade_needs.h"
#include "reference/base/json_node.h"

#include <math.h>
#include <string.h>

bool student_view_shows(const json_t *check)
{
    return strcmp(member_or_empty(check, "visibility"), "visible") == 0;
}

/* Does the text name a mistake that the student is told anyway? */
static bool is_told(const char *text, const json_t *diagnosis)
{
    json_each(b, json_object_get(diagnosis, "named"))
        if (member_text(b, "bug") != NULL && strstr(text, member_text(b, "bug")) != NULL)
            return true;
    return false;
}

/* The checks that are shown. What one of them has been spared may be known from another that is not. */
static json_t *shown_checks(const json_t *grade, const json_t *diagnosis)
{
    static const char paid[] = "held against images with a mistake that another check pays for";
    json_t *shown = json_array();
    bool lost = false;
    json_each(c, json_object_get(grade, "checks"))
        lost = lost || (!student_view_shows(c) && !grade_is_full(c));
    json_each(c, json_object_get(grade, "checks")) {
        const char *carried = member_or_empty(c, "carried");
        if (!student_view_shows(c))
            continue;
        json_t *copy = json_copy(c);
        if (lost && carried[0] != '\0' && !is_told(carried, diagnosis))
            json_object_set_new(copy, "carried", json_string(paid));
        json_array_append_new(shown, copy);
    }
    return shown;
}

/* Points, chance and so on of all checks, or of those of one part (NULL: of all). */
static double sum_of(const json_t *checks, const char *part, const char *what)
{
    double sum = 0;
    json_each(c, checks)
        if (part == NULL || strcmp(member_or_empty(c, "part"), part) == 0)
            sum += member_number(c, what);
    return sum;
}

static json_t *shown_parts(const json_t *grade, const json_t *checks)
{
    json_t *parts = json_array();
    json_each(p, json_object_get(grade, "parts")) {
        const char *number = member_or_empty(p, "number");
        bool any = false;
        json_each(c, checks)
            any = any || strcmp(member_or_empty(c, "part"), number) == 0;
        if (any)
            json_array_append_new(parts, json_pack("{ss, ss, sf, sf}", "number", number, "title",
                                                   member_or_empty(p, "title"), "points",
                                                   sum_of(checks, number, "points"), "of",
                                                   sum_of(checks, number, "of")));
    }
    return parts;
}

json_t *student_view(const json_t *grade)
{
    static const char *const about_mistake[] = {"diagnosis", "located", "located_picture"};
    json_t *view = json_copy((json_t *)grade);
    bool all = true;
    json_each(c, json_object_get(grade, "checks"))
        all = all && student_view_shows(c);
    if (all || view == NULL)
        return view;
    const json_t *told = json_object_get(grade, "for_student");
    for (size_t k = 0; k < sizeof about_mistake / sizeof *about_mistake; k++) {
        json_object_del(view, about_mistake[k]);
        json_object_set(view, about_mistake[k], json_object_get(told, about_mistake[k]));
    }
    json_t *checks = shown_checks(grade, json_object_get(told, "diagnosis"));
    json_object_set_new(view, "parts", shown_parts(grade, checks));
    json_object_set_new(view, "points", json_real(sum_of(checks, NULL, "points")));
    json_object_set_new(view, "of", json_real(sum_of(checks, NULL, "of")));
    json_object_set_new(view, "chance", json_real(fmin(1, sum_of(checks, NULL, "chance"))));
    json_object_set_new(view, "checks", checks);
    json_object_del(view, "provisional");
    json_object_del(view, "before"); /* of all checks */
    return view;
}
