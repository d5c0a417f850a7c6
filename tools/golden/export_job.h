/* A scene written for another renderer, as `assay export` does: its options, and the files. */
#ifndef ASSAY_EXPORT_JOB_H
#define ASSAY_EXPORT_JOB_H

#include "reference/suite/engine_table.h"
#include "renderer/base/err.h"

/* Texts are those of the command line. */
struct export_job {
    const char *scene;
    const char *environment; /* NULL: none */
    const char *out;
    double lens_radius, focal_distance;
    const struct engine_kind *engine; /* as --engine or the ending of `out` says */
    int width, height, depth;
    bool help;      /* was printed: nothing else is set */
    char note[512]; /* of export_job_run(): what the export lacks, for the user; empty: nothing */
};

/* argv[0] is the verb. False with a line on anything but options and one scene, and without --out or
 * an engine. */
bool export_job_parse(int argc, char **argv, struct export_job *s, struct err *e)
    __attribute__((warn_unused_result));

/* Writes s->out and makes the directories above it; files that it names lie beside it, are called
 * after it and are written before it. False with one line: a file that cannot be read or written, or what the engine cannot
 * express. A scene of a suite whose description (its .json) names an environment that was not given is exported without, and
 * so is one without any light: s->note says so. */
bool export_job_run(struct export_job *s, struct err *e) __attribute__((warn_unused_result));

#endif
