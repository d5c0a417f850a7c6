/* Exported scenes made again (reproduce.h): what `assay export` writes for Cycles, POV-Ray, Mitsuba and pbrt. */
#ifndef ASSAY_REPRODUCE_EXPORT_H
#define ASSAY_REPRODUCE_EXPORT_H

#include "reproduce.h"

/* Is it a scene for one of these, whoever wrote it? One without our command is for reproduce_export() to refuse. */
bool reproduce_is_export(const char *path, bool *is, struct err *e)
    __attribute__((warn_unused_result));

/* As reproduce(): writes the scene again by its command into `dir`, which exists, as the version that it says, and compares all
 * bytes, those of the files beside it too; out->num_values counts them. Scene and environment have to have the hashes that it says. opt->keep is
 * the scene again, by this version and under that name, which the files beside it are then called after. */
bool reproduce_export(const char *path, const struct reproduce_options *opt, const char *dir,
                      struct reproduced *out, struct err *e) __attribute__((warn_unused_result));

#endif
