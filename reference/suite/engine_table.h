/* The engines that this program knows by name, in the order of lists and pages: the only table of them. The code that
 * writes their scene files and that runs them is bound to it in reference/external/engine_bindings.c. */
#ifndef ASSAY_ENGINE_TABLE_H
#define ASSAY_ENGINE_TABLE_H

#include <stdbool.h>
#include <stddef.h>

/* ROW(name, title, ending, program, subgrid), see struct engine_kind. First those that goldens are made with; the first of them
 * is the one that costs and convergence are compared with. */
#define ENGINES_WITH_GOLDENS(ROW)                                                                  \
    ROW(cycles, "Cycles", ".json", "blender", false)                                               \
    ROW(povray, "POV-Ray", ".pov", "povray", true)
#define ENGINES(ROW)                                                                               \
    ENGINES_WITH_GOLDENS(ROW)                                                                      \
    ROW(mitsuba, "Mitsuba", ".xml", "mitsuba", false)                                              \
    ROW(pbrt, "pbrt", ".pbrt", "pbrt", false)

/* For ROW: in lists of words, {"auto", ENGINES(ENGINE_WORD) NULL}, and in sentences, "one of" ENGINES(ENGINE_TEXT). */
#define ENGINE_WORD(name, ...)                                #name,
#define ENGINE_TEXT(name, ...)                                " " #name
#define ENGINE_ID(name, ...)                                  ENGINE_##name,
#define ENGINE_PROGRAM(name, title, ending, program, subgrid) program,
enum { ENGINES_WITH_GOLDENS(ENGINE_ID) NUM_ENGINES_WITH_GOLDENS };

struct engine_kind {
    const char *name;    /* in files, results and on command lines */
    const char *title;   /* for people */
    const char *ending;  /* of its scene files */
    const char *program; /* looked up in PATH */
    bool subgrid; /* scenes state k ("subgrid"), for k x k samples per pixel of a replicate, not "spp" */
};

extern const struct engine_kind engine_table[]; /* ends with a NULL name */
extern const char *const engine_names[];        /* of those with goldens; ends with NULL */

/* NULL if there is no engine of that name; engine_with_goldens() also if it has no goldens. */
const struct engine_kind *engine_kind_of(const char *name);
const struct engine_kind *engine_with_goldens(const char *name);

#endif
