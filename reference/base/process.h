/* Runs external programs in a process group of their own, with a time limit, keeping their last lines of output. */
#ifndef ASSAY_PROCESS_H
#define ASSAY_PROCESS_H

#include "renderer/base/err.h"

#include <stddef.h>

struct process {
    const char *const *argv; /* argv[0] looked up in PATH; NULL-terminated */
    const char *cwd;         /* NULL: the current one */
    const char *log;         /* file that receives stdout and stderr, at most 64 MiB; NULL: none */
    size_t
        log_most; /* limit of the log, bytes; control characters then become '?'. 0: 64 MiB, output unchanged */
    /* Called in the child before exec; may make only async-signal-safe calls. If it returns false, with errno set, the
     * program is not started. May be NULL. */
    bool (*before)(const void *ctx);
    const void *before_ctx;
    double timeout_s; /* wall time; 0: none */
    /* Called a few times a second while it runs (progress); may be NULL. */
    void (*tick)(void *ctx);
    void *tick_ctx;
};

struct process_usage {
    double wall_s, cpu_s; /* of the child and of those of its descendants that were waited for */
    int exit_status;      /* -1: it did not end by itself */
    int signal;           /* the signal that ended it before its time limit; 0: none */
};

/* Runs to the end. True if it exited with status 0. Otherwise the line says: not found / killed by
 * signal N / exit status N / no end after N s, then the last lines it printed, joined by " | "
 * (ASCII only). At the time limit the whole process group gets SIGTERM, 2 s later SIGKILL. Every
 * process of the group is killed by the time this returns, and also if the calling process dies for
 * any reason; if the kernel kills that for want of memory, only the program itself is. stdin is
 * /dev/null. usage may be NULL; it is filled whenever the program was started. May
 * be called from several threads. Linux only (PR_SET_PDEATHSIG). */
NODISCARD bool process_run(const struct process *p, struct process_usage *usage, struct err *e);

/* True if argv0 can be found in PATH; fills its absolute path. An argv0 with a slash is a path. */
bool process_find(const char *argv0, char *path, size_t size);
/* The same; the line says if a file of that path is there but not executable. */
NODISCARD bool process_find_or_say(const char *argv0, char *path, size_t size, struct err *e);

#endif
