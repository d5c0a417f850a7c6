#include "engine_bindings.h"

#include "reference/cycles/cycles_driver.h"
#include "reference/cycles/export_cycles.h"
#include "reference/mitsuba/export_mitsuba.h"
#include "reference/pbrt/export_pbrt.h"
#include "reference/povray/export_povray.h"
#include "reference/povray/povray_driver.h"
#include "renderer/base/fs.h"

#include <assert.h>
#include <string.h>

static bool print_povray(const struct scene *s, const struct camera *c, int depth, FILE *f,
                         struct err *e)
{
    const struct povray_variant plain = povray_variant_plain();
    return export_povray(s, c, depth, &plain, f, e);
}

static const struct {
    const char *name;
    /* One of the two; print() of a scene that is one text file, which is opened and renamed here. */
    bool (*write)(const struct scene *s, const struct camera *c, int depth, const char *path,
                  struct err *e);
    bool (*print)(const struct scene *s, const struct camera *c, int depth, FILE *f, struct err *e);
    const struct engine_driver *driver; /* of engines with goldens */
} bindings[] = {
    {"cycles", .write = export_cycles, .driver = &cycles_driver},
    {"povray", .print = print_povray, .driver = &povray_driver},
    {"mitsuba", .write = export_mitsuba},
    {"pbrt", .write = export_pbrt},
};

enum { NUM_BINDINGS = sizeof bindings / sizeof *bindings };

static int find(const char *engine)
{
    int i = 0;
    while (i < NUM_BINDINGS && strcmp(bindings[i].name, engine) != 0)
        i++;
    return i;
}

const struct engine_driver *engine_driver_of(const char *engine)
{
    int i = find(engine);
    return i < NUM_BINDINGS ? bindings[i].driver : NULL;
}

bool engine_export(const struct engine_kind *kind, const struct scene *s, const struct camera *c,
                   int depth, const char *path, struct err *e)
{
    struct out_file out;
    int i = find(kind->name);
    assert(i < NUM_BINDINGS);
    if (bindings[i].write != NULL)
        return bindings[i].write(s, c, depth, path, e);
    if (!out_open(&out, path, e))
        return false;
    if (bindings[i].print(s, c, depth, out.f, e))
        return out_commit(&out, e);
    out_abandon(&out);
    return false;
}
