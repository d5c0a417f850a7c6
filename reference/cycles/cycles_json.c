/* Vectors, colours and names as JSON, for the exporter to Cycles. */
#include "export_cycles_internal.h"

#include <string.h>

json_t *cycles_vec3(vec3 v)
{
    return json_pack("[fff]", (double)v.x, (double)v.y, (double)v.z);
}

json_t *cycles_rgb(rgb c)
{
    return json_pack("[fff]", (double)c.r, (double)c.g, (double)c.b);
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
