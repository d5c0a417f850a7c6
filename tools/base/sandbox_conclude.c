/* Why a run in the sandbox ended, from its status, times and the supervisor's report. */
#include "sandbox_internal.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>

const char *const sandbox_end_name[] = {
    [SANDBOX_OK] = "ok",          [SANDBOX_FAILED] = "failed",
    [SANDBOX_WALL] = "wall time", [SANDBOX_CPU] = "processor time",
    [SANDBOX_MEMORY] = "memory",  [SANDBOX_FILE_SIZE] = "file size",
    [SANDBOX_DISK] = "disk full", [SANDBOX_UNPACK] = "cannot be unpacked",
    [SANDBOX_LOST] = "lost",
};

size_t sandbox_all_memory(const struct sandbox_limits *limit)
{
    enum { OURS = 64 << 20 };
    return limit->memory + 3 * limit->disk + OURS;
}

void sandbox_conclude(const struct sandbox_job *job, const char *word, const struct err *last,
                      struct sandbox_result *r)
{
    int signal = word != NULL && r->status > 128 ? r->status - 128 : 0;
    const struct sandbox_limits *l = &job->limit;
    char what[96] = "";
    if (word == NULL) {
        r->end = r->wall_s >= l->wall_s ? SANDBOX_WALL : SANDBOX_LOST;
        snprintf(what, sizeof what,
                 r->end == SANDBOX_WALL ? "no end after %g s"
                                        : "the sandbox was lost (killed, or no space?)",
                 l->wall_s);
    } else if (strcmp(word, "unpack") == 0) {
        r->end = SANDBOX_UNPACK;
        snprintf(what, sizeof what, "cannot be unpacked into %zu MiB", l->disk >> 20);
    } else if (strcmp(word, "memory") == 0) {
        r->end = SANDBOX_MEMORY;
        snprintf(what, sizeof what, "its processes use more than %zu MiB of memory",
                 l->memory >> 20);
    } else if (signal == SIGXCPU || (signal == SIGKILL && r->cpu_s >= l->cpu_s)) {
        r->end = SANDBOX_CPU;
        snprintf(what, sizeof what, "more than %g s of processor time", l->cpu_s);
    } else if (signal == SIGXFSZ) {
        r->end = SANDBOX_FILE_SIZE;
        snprintf(what, sizeof what, "a file of more than %zu MiB", l->file >> 20);
    } else if (strcmp(word, "disk") == 0) {
        r->end = SANDBOX_DISK;
        snprintf(what, sizeof what, "all %zu MiB of its directory are full", l->disk >> 20);
    } else if (r->status != 0) {
        r->end = SANDBOX_FAILED;
        if (signal > 0)
            snprintf(what, sizeof what, "killed by signal %d (%s)", signal, strsignal(signal));
        else
            snprintf(what, sizeof what, "exit status %d", r->status);
    } else {
        r->end = SANDBOX_OK;
    }
    /* process_run()'s line is "bwrap: exit status 1: last lines". */
    const char *lines = strstr(last->msg, ": ");
    lines = lines != NULL ? strstr(lines + 2, ": ") : NULL;
    if (r->end != SANDBOX_OK)
        snprintf(r->why, sizeof r->why, "%s%.400s", what, lines != NULL ? lines : "");
}
