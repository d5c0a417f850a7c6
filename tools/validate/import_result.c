#include "import_result.h"

#include "tools/results/results.h"

#include <string.h>

static long long number(const json_t *report, const char *key)
{
    return (long long)json_integer_value(json_object_get(report, key));
}

/* ", 2 spheres": only what there is. */
static void add_unread(char *text, size_t size, const json_t *report, const char *key,
                       const char *what)
{
    size_t used = strlen(text);
    if (number(report, key) > 0)
        snprintf(text + used, size - used, "%s%lld %s", used > 0 ? ", " : "", number(report, key),
                 what);
}

void import_result_print(FILE *f, const json_t *reports)
{
    static const char *const unread[][2] = {{"unread_cameras", "camera by lookat"},
                                            {"unread_spheres", "spheres"},
                                            {"unread_rectangles", "rectangles of light"},
                                            {"unread_environments", "environment"},
                                            {"unread_normals", "normals"}};
    size_t agree = 0;
    long long triangles = 0;
    const char *absent = json_string_value(json_object_get(json_array_get(reports, 0), "absent"));
    if (absent != NULL) {
        fprintf(f, "Blender's own importer against ours: not checked (%s)\n", absent);
        return;
    }
    fprintf(f, "Blender's own importer against ours:\n");
    json_each(report, reports) {
        const char *error = json_string_value(json_object_get(report, "error"));
        const char *what = json_string_value(json_object_get(report, "what"));
        const char *scene = json_string_value(json_object_get(report, "scene"));
        char rest[256] = "";
        if (error != NULL || what != NULL) {
            fprintf(f, "  %-20s %s: %s\n", scene, error ? "NOT JUDGED" : "DIFFER",
                    error ? error : what);
            continue;
        }
        for (size_t k = 0; k < sizeof unread / sizeof *unread; k++)
            add_unread(rest, sizeof rest, report, unread[k][0], unread[k][1]);
        fprintf(f, "  %-20s agree: %lld camera, %lld triangles, %lld normals, %lld lights%s%s\n",
                scene, 1 - number(report, "unread_cameras"), number(report, "triangles"),
                number(report, "normals"), number(report, "lights"),
                rest[0] != '\0' ? "; Blender does not read: " : "", rest);
        agree++;
        triangles += number(report, "triangles");
    }
    fprintf(f, "  %zu of %zu scenes agree, %lld triangles\n", agree, json_array_size(reports),
            triangles);
}

int import_result_exit_code(const json_t *reports)
{
    int code = EXIT_EQUIVALENT;
    json_each(report, reports) {
        if (json_object_get(report, "absent") != NULL)
            continue;
        if (!json_is_boolean(json_object_get(report, "agrees")))
            return EXIT_NOT_JUDGED;
        if (!json_is_true(json_object_get(report, "agrees")))
            code = EXIT_DIFFERENT;
    }
    return code;
}
