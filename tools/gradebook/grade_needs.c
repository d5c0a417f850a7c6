#include "grade_needs.h"

#include "reference/base/json_node.h"
#include "tools/base/text.h"

#include <string.h>

static const struct {
    const char *name, *words;
} states[] = {
    {"not_built", "not built"}, {"not_started", "no image"}, {"usage", "printed its usage"}};

static bool made_an_image(const json_t *grade)
{
    const json_t *images = json_object_get(grade, "pictures");
    json_each(p, images)
        if (json_is_string(json_object_get(p, "sha256")))
            return true;
    return json_array_size(images) == 0;
}

const char *grade_state(const json_t *grade)
{
    if (member_text(grade, "trouble") != NULL)
        return "not graded";
    for (size_t i = 0; i < sizeof states / sizeof *states; i++)
        if (strcmp(member_or_empty(grade, "state"), states[i].name) == 0)
            return states[i].words;
    return made_an_image(grade) ? NULL : "no image";
}

bool grade_is_full(const json_t *check)
{
    return member_number(check, "share") >= 1;
}

bool grade_differs(const json_t *grade)
{
    json_each(c, json_object_get(grade, "checks"))
        if (!grade_is_full(c) && json_is_array(json_object_get(c, "relative")) &&
            strcmp(member_or_empty(c, "kind"), "growth") != 0)
            return true;
    return false;
}

bool grade_is_provisional(const json_t *object)
{
    json_each(c, json_object_get(object, "checks"))
        if (grade_is_provisional(c))
            return true;
    return json_array_size(json_object_get(object, "checks")) == 0 &&
           json_is_true(json_object_get(object, "provisional"));
}

bool grade_needs(const json_t *grade, char *text, size_t size)
{
    const char *state = grade_state(grade),
               *why = member_text(grade, member_text(grade, "trouble") ? "trouble" : "wrong");
    text[0] = '\0';
    if (state != NULL || why != NULL)
        text_append(text, size, "%s", why != NULL ? why : state);
    if (member_text(grade, "flag") != NULL)
        text_append(text, size, "%s%s", text[0] != '\0' ? "; " : "", member_text(grade, "flag"));
    json_each(c, json_object_get(grade, "checks")) {
        const char *name = member_or_empty(c, "name"), *flag = member_or_empty(c, "flag");
        const char *const what[] = {flag[0] != '\0' ? flag : NULL,
                                    json_is_true(json_object_get(c, "judged")) ? NULL
                                                                               : "not judged",
                                    grade_is_provisional(c) ? "provisional" : NULL};
        for (int k = 0; k < 3; k++)
            if (what[k] != NULL)
                text_append(text, size, "%s%s: %s", text[0] != '\0' ? "; " : "", name, what[k]);
    }
    return text[0] != '\0';
}
