/* Restrictions on a process and its children that need no namespaces: its user, its system calls
 * (seccomp) and its files (Landlock). seccomp and Landlock need no privileges, but not every kernel
 * has them. */
#ifndef ASSAY_CONFINE_H
#define ASSAY_CONFINE_H

#include "memory_group.h"

#include "renderer/base/err.h"

#include <stddef.h>

struct confine {
    unsigned user; /* id of the user and group to become; 0: unchanged */
    int in, out;   /* stdin and stdout, borrowed; -1: unchanged */
    struct memory_group group;
    int files; /* a Landlock ruleset; -1: none. The caller closes it */
};

enum { CONFINE_FILTER = 512 /* bytes of a filter, at most */ };

/* Makes a filter for seccomp(2). It refuses memory that no limit counts (memfd_create, memfd_secret,
 * System V) and all calls by another architecture's numbers. alone: there are no namespaces around
 * the process, so the network, message queues, tracing and new namespaces are refused, too. Returns
 * the filter's length in bytes; 0: none can be made for this machine. */
size_t confine_filter(bool alone, unsigned char filter[CONFINE_FILTER]);

/* Makes a Landlock ruleset: the process may read and run what is in `read`, and do anything in
 * `write`. Paths of `hidden` stay closed even below a directory of `read`; they are real paths. All
 * three end with NULL; paths that do not exist are left out. *ruleset is -1 where the kernel has no
 * Landlock. */
NODISCARD bool confine_files(const char *const *read, const char *const *write,
                             const char *const *hidden, int *ruleset, struct err *e);

/* For struct process, as `before`: applies *ctx, a struct confine. Makes only async-signal-safe calls. */
bool confine_enter(const void *ctx);

#endif
