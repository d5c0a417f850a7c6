/* The commands that make a stored reference anew, for people: as a shell takes them, from any folder. */
#ifndef ASSAY_RENEW_H
#define ASSAY_RENEW_H

#include "reference/external/engine_description.h"
#include "renderer/base/err.h"

/* Where the reference is, and what makes it. */
struct renew {
    const char *suite_dir, *golden_dir;
    bool is_own;                 /* a suite.json */
    const struct engine *engine; /* that is judged; NULL: none */
    const char *scene, *name;    /* of the reference */
    const json_t *manifest;      /* of what is stored; NULL: nothing */
};

/* Appends the words of --suite and --golden, with full paths, unless they are those that a command finds by itself in
 * any folder. golden_dir NULL: that of the suite. */
void renew_add_places(json_t *words, bool is_own, const char *suite_dir, const char *golden_dir);

/* "assay golden render ...", and in the next line "assay golden approve ..."; the caller frees it. NULL if out of memory,
 * or if nobody knows what makes the reference: neither an engine of ours nor the one that is judged, which made what is
 * stored, or whose name it has, or that and -VERSION. */
NODISCARD char *renew_commands(const struct renew *r);

/* Adds to a line that says that the reference is missing or stale how it is made; always returns false. */
bool renew_say(const struct renew *r, struct err *e);

#endif
