/* A memory limit that the kernel enforces on a run and all processes that it starts: a control
 * group of its own. It also counts memory that belongs to no process any more [Linux,
 * Documentation/admin-guide/cgroup-v2.rst; cgroup-v1/memory.rst]. Making one takes root or, with
 * version 1, a hierarchy whose part that holds this process was given to its user; otherwise there
 * is no such limit. */
#ifndef ASSAY_MEMORY_GROUP_H
#define ASSAY_MEMORY_GROUP_H

#include <stdbool.h>
#include <stddef.h>

struct memory_group {
    char path[512]; /* "": there is none */
    int procs;      /* who writes "0" to it is in the group; -1 */
};

/* Of at most that many bytes, files in memory included. The caller calls memory_group_close(). */
void memory_group_open(struct memory_group *g, size_t bytes);
/* For struct process: joins *ctx, a struct memory_group. */
bool memory_group_enter(const void *ctx);
/* Whether somebody in it was killed for want of memory. Removes it once it is empty. */
bool memory_group_close(struct memory_group *g);

#endif
