/* Shared by the parts of the sandbox: sandbox.c (with namespaces), sandbox_bare.c (without),
 * sandbox_command.c (command lines) and sandbox_conclude.c (why a run ended). */
#ifndef ASSAY_SANDBOX_INTERNAL_H
#define ASSAY_SANDBOX_INTERNAL_H

#include "sandbox.h"

enum { SANDBOX_ARGS = 512, SANDBOX_TEXT = 16 << 10, SANDBOX_NOBODY = 65534, SANDBOX_LOG = 1 << 20 };

/* A command line under construction. Texts that are made for it live in `text`. */
struct sandbox_line {
    const char *arg[SANDBOX_ARGS];
    int num;
    char text[SANDBOX_TEXT];
    size_t used;
    bool overflow;
};

/* Appends bwrap (the outer layer), the supervisor, bwrap (the inner layer) and the program. keep:
 * the names of job->keep, with blanks between them. */
void sandbox_line_boxed(struct sandbox_line *l, const struct sandbox *s,
                        const struct sandbox_job *job, const char *keep);
/* Appends the program with its limits and its environment. box: where it starts; temp: its TMPDIR. */
void sandbox_line_bare(struct sandbox_line *l, const struct sandbox_job *job, const char *box,
                       const char *temp);

/* The limit of memory of a whole run in bytes, files in memory included (memory_group.h). */
size_t sandbox_all_memory(const struct sandbox_limits *limit);

/* Fills in r->end and r->why from r->status, r->wall_s and r->cpu_s. word: what the supervisor
 * reported ("ended", "memory", "disk", "unpack"); NULL: it was killed before it could. last: what
 * process_run() said. */
void sandbox_conclude(const struct sandbox_job *job, const char *word, const struct err *last,
                      struct sandbox_result *r);

/* sandbox_run() where s->unsafe. */
NODISCARD bool sandbox_run_bare(const struct sandbox *s, const struct sandbox_job *job,
                                struct sandbox_result *out, struct err *e);

#endif
