/* A scene written for another renderer, as `assay export` does: its options, and the files. */
#ifndef ASSAY_EXPORT_JOB_H
#define ASSAY_EXPORT_JOB_H

#include "renderer/base/err.h"

enum export_engine { EXPORT_CYCLES, EXPORT_POVRAY, EXPORT_MITSUBA, EXPORT_PBRT, EXPORT_UNKNOWN };

/* Texts are those of the command line. */
struct export_job {
    const char *scene;
    const char *environment; /* NULL: none */
    const char *out;         /* NULL: not said */
    double lens_radius, focal_distance;
    int engine; /* unknown: neither said nor told by the ending of `out` */
    int width, height, depth;
    bool help; /* was printed: nothing else is set */
    /* What the file says of how it was made; NULL: this program's version, the command of these settings. */
    const char *version, *command;
};

/* argv[0] is the verb. False with a line on anything but options and one scene. */
bool export_job_parse(int argc, char **argv, struct export_job *s, struct err *e)
    __attribute__((warn_unused_result));

/* "assay export ..." by which the same is made, every setting said, in one line of printable ASCII that a shell reads
 * (shell_quote.h); name: for --out, NULL: left out. To free(); NULL if out of memory. */
char *export_job_command(const struct export_job *s, const char *name)
    __attribute__((warn_unused_result));

/* Writes s->out, for an engine that is known, and makes the directories above it; files that it names lie beside it and were
 * there before it. The same settings of the same files give the same bytes, whatever `out` is, unless there are such files: they
 * are called after it, and then the file says --out, without directories. False with one line: a file that cannot be read or
 * written, or what the engine cannot express. */
bool export_job_run(const struct export_job *s, struct err *e) __attribute__((warn_unused_result));

#endif
