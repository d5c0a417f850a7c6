/* What a process may do from now on, it and all that it starts, told to the kernel without namespaces: whose process it is, which system
 * calls it has (seccomp), which files (Landlock). The last two need no privileges, and not every kernel has them. */
#ifndef ASSAY_CONFINE_H
#define ASSAY_CONFINE_H

#include "memory_group.h"

#include "renderer/base/err.h"

#include <stddef.h>

struct confine {
    unsigned user; /* and group; 0: stays who it is */
    int in, out;   /* stdin and stdout, borrowed; -1: as they are */
    struct memory_group group;
    int files; /* a Landlock ruleset; -1: none. The caller closes it */
};

enum { CONFINE_FILTER = 512 /* bytes of a filter, at most */ };

/* A program for seccomp(2) that refuses what no limit counts: memory without a file (memfd_create, memfd_secret, System V), and all calls
 * by another architecture's numbers. alone: there are no namespaces around it, so also the network, message queues, tracing and namespaces of its
 * own. Returns its bytes; 0: this machine has none. */
size_t confine_filter(bool alone, unsigned char filter[CONFINE_FILTER]);

/* A Landlock ruleset: may read and run `read`, and do as it likes in `write` (NULL at the end); never what is in `hidden`, real paths,
 * even where a directory of `read` holds them. Paths that are not there are left out. *ruleset is -1 where the kernel has no Landlock. */
NODISCARD bool confine_files(const char *const *read, const char *const *write,
                             const char *const *hidden, int *ruleset, struct err *e);

/* For struct process: becomes what *ctx, a struct confine, says. Only calls that may follow fork(). */
bool confine_enter(const void *ctx);

#endif
