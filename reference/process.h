/* Runs other people's programs: own process group, time limit, last lines of output kept. */
#ifndef ASSAY_PROCESS_H
#define ASSAY_PROCESS_H

#include "../renderer/err.h"

#include <stddef.h>

struct process {
    const char *const *argv; /* argv[0] looked up in PATH; NULL-terminated */
    const char *cwd;         /* NULL: the current one */
    const char *log;         /* file that receives stdout and stderr; NULL: a temporary one */
    double timeout_s;        /* wall time; 0: none */
    /* Called a few times a second while it runs (progress); may be NULL. */
    void (*tick)(void *ctx);
    void *tick_ctx;
};

struct process_usage {
    double wall_s, cpu_s; /* of the child and its children */
};

/* Runs to the end. True if it exited with status 0. Otherwise the line says: not found / killed by
 * signal N / exit status N / no end after N s, then the last lines it printed. The whole process
 * group is gone when this returns. stdin is /dev/null. usage may be NULL. */
bool process_run(const struct process *p, struct process_usage *usage, struct err *e)
    __attribute__((warn_unused_result));

/* True if argv0 can be found in PATH; fills its absolute path. */
bool process_find(const char *argv0, char *path, size_t size);

#endif
