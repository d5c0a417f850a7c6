#include "export_cycles_internal.h"

#include <string.h>

static json_t *numbers3(double x, double y, double z)
{
    return json_pack("[fff]", x, y, z);
}
json_t *cycles_vec3(vec3 v)
{
    return numbers3(v.x, v.y, v.z);
}
json_t *cycles_rgb(rgb c)
{
    return numbers3(c.r, c.g, c.b);
}

json_t *cycles_name(const char *name)
{
    /* A name that was cut may end inside a UTF-8 sequence. */
    char ascii[64];
    size_t n = strnlen(name, sizeof ascii - 1);
    for (size_t i = 0; i < n; i++)
        ascii[i] = name[i] >= ' ' && name[i] <= '~' ? name[i] : '?';
    ascii[n] = '\0';
    return json_string(ascii);
}

void cycles_push(json_t **array, json_t *value)
{
    if (json_array_append_new(*array, value) == 0)
        return;
    json_decref(*array);
    *array = NULL;
}
