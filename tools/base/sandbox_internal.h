/* Shared by sandbox.c, by the commands that it runs, and by sandbox_bare.c, which runs programs without namespaces. */
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

/* bwrap, the supervisor in it, and in that the program. keep: the names, with blanks between them. */
void sandbox_line_boxed(struct sandbox_line *l, const struct sandbox *s,
                        const struct sandbox_job *job, const char *keep);
/* The program with its limits and its environment. box: where it starts; temp: its TMPDIR. */
void sandbox_line_bare(struct sandbox_line *l, const struct sandbox_job *job, const char *box,
                       const char *temp);

/* What a run may have of memory, files in it included, where the kernel counts it (memory_group.h). */
size_t sandbox_all_memory(const struct sandbox_limits *limit);

/* Fills in r->end and r->why from r->status, r->wall_s and r->cpu_s. word: what else is known ("memory", "disk", "unpack"); NULL: it was killed
 * before it ended. last: of process_run(). */
void sandbox_conclude(const struct sandbox_job *job, const char *word, const struct err *last,
                      struct sandbox_result *r);

/* sandbox_run() where s->unsafe. */
NODISCARD bool sandbox_run_bare(const struct sandbox *s, const struct sandbox_job *job,
                                struct sandbox_result *out, struct err *e);

#endif
