#include "engine_bindings.h"

#include "reference/cycles/export_cycles.h"
#include "reference/mitsuba/export_mitsuba.h"
#include "reference/pbrt/export_pbrt.h"
#include "reference/povray/export_povray.h"
#include "renderer/base/fs.h"

#include <assert.h>
#include <string.h>

static bool print_povray(const struct scene *s, const struct camera *c, int depth, FILE *f,
                         struct err *e)
{
    const struct povray_variant plain = povray_variant_plain();
    return export_povray(s, c, depth, &plain, f, e);
}

/* Either write(), or print() into a single text file, which is opened and renamed here. */
static const struct {
    const char *name;
    bool (*write)(const struct scene *s, const struct camera *c, int depth, const char *path,
                  struct err *e);
    bool (*print)(const struct scene *s, const struct camera *c, int depth, FILE *f, struct err *e);
} exporters[] = {
    {"cycles", .write = export_cycles},
    {"povray", .print = print_povray},
    {"mitsuba", .write = export_mitsuba},
    {"pbrt", .write = export_pbrt},
};

#define DRIVER(name, ...) &name##_driver,

const struct engine_driver *engine_driver_of(const char *engine)
{
    static const struct engine_driver *const drivers[] = {ENGINES_WITH_GOLDENS(DRIVER)};
    const struct engine_kind *kind = engine_with_goldens(engine);
    return kind != NULL ? drivers[kind - engine_table] : NULL;
}

bool engine_export(const struct engine_kind *kind, const struct scene *s, const struct camera *c,
                   int depth, const char *path, struct err *e)
{
    struct out_file out;
    size_t i = 0;
    while (strcmp(exporters[i].name, kind->name) != 0) {
        i++;
        assert(i < sizeof exporters / sizeof *exporters);
    }
    if (exporters[i].write != NULL)
        return exporters[i].write(s, c, depth, path, e);
    if (!out_open(&out, path, e))
        return false;
    if (exporters[i].print(s, c, depth, out.f, e))
        return out_commit(&out, e);
    out_abandon(&out);
    return false;
}
