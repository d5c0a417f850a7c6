#include "engine_table.h"

#include <string.h>

#define KIND(name, ...) {#name, __VA_ARGS__},

const struct engine_kind engine_table[] = {ENGINES(KIND){0}};
const char *const engine_names[] = {ENGINES_WITH_GOLDENS(ENGINE_WORD) NULL};

const struct engine_kind *engine_kind_of(const char *name)
{
    for (const struct engine_kind *k = engine_table; k->name != NULL; k++)
        if (strcmp(k->name, name) == 0)
            return k;
    return NULL;
}

const struct engine_kind *engine_with_goldens(const char *name)
{
    for (size_t i = 0; engine_names[i] != NULL; i++)
        if (strcmp(engine_names[i], name) == 0)
            return &engine_table[i];
    return NULL;
}
