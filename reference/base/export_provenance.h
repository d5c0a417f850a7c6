/* How an exported scene was made, said in the file itself: what `assay reproduce` makes it again from. */
#ifndef ASSAY_EXPORT_PROVENANCE_H
#define ASSAY_EXPORT_PROVENANCE_H

#include "renderer/base/err.h"

#include <stdio.h>

/* Texts of the caller's, each of printable ASCII. */
struct export_origin {
    const char *version;     /* of this program */
    const char *command;     /* without a name of the output: the file is the same under any */
    const char *named;       /* with it, where the file names others by its own name */
    const char *scene;       /* SHA-256 of the scene file */
    const char *environment; /* of the environment's; NULL: none */
};

/* Of POV-Ray, pbrt, and XML. "--" may not stand in a comment of XML: there two quotes are put between the dashes, a string of
 * nothing to a shell, so that the command is still one to paste ("-''-engine"). An element or attribute would be an error to
 * Mitsuba; comments its XML reader (pugixml) leaves out. */
enum export_comment { COMMENT_POVRAY, COMMENT_PBRT, COMMENT_XML };

/* A comment on a line of its own for each: assay:version, assay:command, assay:scene, assay:environment. An error of the file's
 * stays in the file. */
void export_origin_write(FILE *f, enum export_comment comment, const struct export_origin *o,
                         bool named);

/* What a file says; NULL: it does not. */
struct export_said {
    char *version, *command, *scene, *environment;
    bool
        is_scene; /* for Cycles, POV-Ray, Mitsuba or pbrt, by its name, first element or key, or by what it says */
};

/* Reads the comments at the head of the file, or the keys of export_cycles(). False on a file that cannot be read and out of
 * memory; any text or picture is a file that says nothing. To be freed, on failure too. */
bool export_origin_read(const char *path, struct export_said *said, struct err *e)
    __attribute__((warn_unused_result));
void export_said_free(struct export_said *said);

#endif
